//! Trimming (thesis 1.5, 3.1): loops of curves in a surface's domain, their polylines, nesting, and the checklist.

mod error;
mod region;
mod trimmed_surface;

pub use error::{TrimWarning, TrimmingError};
pub use region::{BoundaryLoop, CurvePoint, TrimRegion};
pub use trimmed_surface::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};
