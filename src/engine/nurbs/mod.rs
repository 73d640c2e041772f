//! NURBS curves and surfaces (thesis 1.1 to 1.4): evaluation, differential geometry, knot insertion, Bezier form, area.
//!
//! Any degree up to [`MAX_DEGREE`], any non-decreasing knots over any domain, clamped or not, rational or not. Control
//! point `(i, j)` of a surface stands at `i * nv + j`; sample `(i, j)` of a grid at `j * nu + i` (rows of v outermost).

mod area;
mod basis;
mod bezier;
mod curve;
mod differential;
mod error;
mod grid;
mod knots;
mod surface;
#[cfg(test)]
pub(crate) mod tests;
mod transform;

pub use area::{gauss_legendre, integrate};
pub use bezier::{BezierPatch, BezierSegment};
pub use curve::{Curve, Curve2, Curve3, Point};
pub use differential::Curvature;
pub use error::NurbsError;
pub use grid::{FirstDerivatives, GridSamples};
pub use knots::{KnotVector, MAX_DEGREE};
pub use surface::{Domain, Surface, SurfaceDerivatives};
#[cfg(test)]
pub(crate) use tests::shapes;
