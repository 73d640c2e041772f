//! How much a flattening distorts the material (thesis 4.3), and where.

mod limits;
mod report;

pub use limits::{LimitCheck, Limits, Thresholds, Verdict, VerdictResult};
pub use report::{
    AspectRatio, BoundaryReport, DistortionMeasures, DistortionReport, FlatteningReport, PatternReport,
    PlacementReport, Report, SeedSearchReport, StrainPlace, StrainReport, TriangulationReport,
};
