//! How much a flattening distorts the material (thesis 4.3), and where.

mod aspect;
mod change;
mod hot_spots;
mod iso_lines;
mod limits;
mod measure;
mod overlap;
mod report;
mod strain;
mod verdict;

pub use change::{Change, Original};
pub(in crate::engine) use change::{flat_area, flat_length};
pub use hot_spots::{HotSpot, HotSpotKind, hot_spots};
pub use iso_lines::{IsoLineReport, IsoLinesReport, Parameter, iso_lines};
pub use limits::{LimitCheck, Limits, Thresholds, Verdict, VerdictResult};
pub use measure::measure;
pub use overlap::{BorderPlace, Overlap, Overlaps, overlaps};
pub use report::{
    AspectRatio, BoundaryReport, CurvesReport, DevelopableReport, DistortionMeasures, DistortionReport,
    FlatteningReport, FormReport, InjectiveReport, OverlapReport, OverlapSide, PatternReport, PinReport,
    PlacementReport, Report, SeedSearchReport, SolverReport, StrainPlace, StrainReport, TriangulationReport,
};
pub use strain::{TriangleStrain, strains};
pub use verdict::verdict;
