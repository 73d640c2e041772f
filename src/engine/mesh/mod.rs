//! Triangle meshes: storage, half-edge topology, measures and invariants.

use glam::{DVec2, DVec3};

pub mod assembly;
mod fault;
pub mod invariants;
pub mod measures;
mod pieces;
#[cfg(test)]
pub(crate) mod test_meshes;
pub mod topology;

pub use fault::MeshFault;
pub use pieces::{Piece, check_sheet, pieces, sheet};
pub use topology::Topology;

/// A triangle mesh as struct of arrays.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Vertex positions, millimetres.
    pub positions: Vec<DVec3>,
    /// The vertices' places in the surface's domain, when they have one.
    pub uv: Option<Vec<DVec2>>,
    /// Corners, anticlockwise seen from the normal's side.
    pub triangles: Vec<[u32; 3]>,
}
