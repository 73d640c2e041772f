//! NURBS curves and surfaces (thesis 1.1 to 1.4): evaluation, differential geometry, knot insertion, Bezier form, area.

mod curve;
mod error;
mod knots;
mod surface;

pub use curve::{Curve, Curve2, Curve3, Point};
pub use error::NurbsError;
pub use knots::{KnotVector, MAX_DEGREE};
pub use surface::{Domain, Surface, SurfaceDerivatives};
