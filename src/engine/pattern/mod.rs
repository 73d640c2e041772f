//! What is cut: outlines and holes mapped exactly from the trimming curves, placed as a person would lay them.
//!
//! [`draw()`] is the whole: each trimming curve is mapped point by point through the triangle of the domain mesh that holds
//! the point ([`Locator`]), sampled to a tolerance in the plane, turned and moved ([`Placement`]), and reported on.
//! [`triangles_of_part`] says which triangles of a base mesh belong to the part.

mod bend;
mod content;
mod draw;
mod fitting;
mod flat_map;
mod lengths;
mod locator;
mod of_mesh;
mod outline;
mod part;
mod piece;
mod placement;
mod settle;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod unrolled_tests;

pub use draw::{DEFAULT_CURVE_TOLERANCE, DrawInput, Drawn, draw};
pub use fitting::fits;
pub use locator::{Located, Locator};
pub use of_mesh::{MeshDrawInput, draw_mesh};
pub use part::triangles_of_part;
pub use piece::{Compensation, Finishing, GREATEST_COMPENSATION, Pair};
pub use placement::{Align, Hold, Motion, Placement, Transform, View, mirrored};
pub use settle::CurveTolerances;

pub use content::{Contour, Curves, Fit, Fits, Grain, Mark, MarkKind, Pattern, Piece, Seam, SeamSide, Segment, Sense};
