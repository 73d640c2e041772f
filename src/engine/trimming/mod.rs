//! Trimming (thesis 1.5, 3.1): loops of curves in a surface's domain, their polylines, nesting, and the checklist.
//!
//! [`TrimmedSurface::check`] mends and judges the loops once and gives [`CheckedTrims`], whose curves can be evaluated and
//! of which [`CheckedTrims::polygonise`] makes a [`TrimRegion`] for any tolerance: the domain to the left of its loops.
//!
//! Lengths of the domain are compared relative to its width in u and v, lengths in space relative to the surface's
//! diagonal; each tolerance is a constant with its reason. Which side of a line a point is on is decided exactly.

mod check;
mod checked;
mod chord;
mod crossing;
mod error;
mod extent;
mod mend;
mod nesting;
mod pieces;
mod polygonise;
mod region;
mod trimmed_surface;

#[cfg(test)]
pub(crate) mod tests;

pub use checked::{CheckedCurve, CheckedLoop, CheckedTrims};
pub use error::{TrimWarning, TrimmingError};
pub use extent::part_box;
pub use nesting::Containment;
pub use region::{BoundaryLoop, CurvePoint, TrimRegion};
pub use trimmed_surface::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};
