//! What a flattening is.

use glam::DVec2;

/// Counts of one level of the mapping order (thesis Tables 5.9 to 5.11).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LevelCounts {
    /// Triangles of this level.
    pub triangles: u32,
    /// Points that were averaged while it was processed.
    pub averaged: u32,
    /// Of these, points averaged before already.
    pub duplicates: u32,
}

/// A mesh in the plane.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Flattening {
    /// A place for each vertex of the mesh, millimetres; NaN where a partial flattening did not get to.
    pub flat: Vec<DVec2>,
    /// The seed triangle, for sequential methods.
    pub seed: u32,
    /// Triangles in the order in which they were processed.
    pub sequence: Vec<u32>,
    /// Counts by level; level 0 is the seed.
    pub levels: Vec<LevelCounts>,
    /// How far averaging moved each vertex from its first position (thesis Figure 6.6), mm; NaN where there is none.
    pub movement: Vec<f64>,
}
