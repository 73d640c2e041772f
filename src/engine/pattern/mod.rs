//! What is cut: outlines and holes mapped exactly from the trimming curves, placed as a person would lay them.

use glam::DVec2;
use serde::{Deserialize, Serialize};

mod placement;

pub use placement::{Align, Placement, View};

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

/// The pattern, in the first quadrant.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Pattern {
    /// The pieces.
    pub pieces: Vec<Piece>,
    /// Width and height, millimetres.
    pub bounding_box_mm: [f64; 2],
}
