//! What is cut: outlines and holes mapped exactly from the trimming curves, placed as a person would lay them.
//!
//! [`draw()`] is the whole: each trimming curve is mapped point by point through the triangle of the domain mesh that holds
//! the point ([`Locator`]), sampled to a tolerance in the plane, turned and moved ([`Placement`]), and reported on.
//! [`triangles_of_part`] says which triangles of a base mesh belong to the part.

use glam::DVec2;
use serde::{Deserialize, Serialize};

mod bend;
mod draw;
mod flat_map;
mod lengths;
mod locator;
mod of_mesh;
mod outline;
mod part;
mod placement;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod unrolled_tests;

pub use draw::{DEFAULT_CURVE_TOLERANCE, DrawInput, Drawn, draw};
pub use locator::{Located, Locator};
pub use of_mesh::{MeshDrawInput, draw_mesh};
pub use part::triangles_of_part;
pub use placement::{Align, Hold, Motion, Placement, Transform, View, mirrored};

/// One closed polyline of a pattern. The first point is not repeated.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Contour {
    /// Points, millimetres.
    pub points: Vec<DVec2>,
    /// True where a point is a corner.
    pub corners: Vec<bool>,
}

/// One piece: outline anticlockwise, holes clockwise.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Piece {
    /// Its name.
    pub name: String,
    /// The outline.
    pub outline: Contour,
    /// The holes.
    pub holes: Vec<Contour>,
}

/// The pattern, in the first quadrant unless points were given places of their own.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Pattern {
    /// The pieces.
    pub pieces: Vec<Piece>,
    /// Width and height, millimetres.
    pub bounding_box_mm: [f64; 2],
}
