//! What a triangulation is made of and what it counts.

use glam::{DVec2, DVec3};

use crate::engine::mesh::Mesh;

/// The lines of a rectilinear grid, strictly increasing; first and last are the domain's ends bit for bit.
#[derive(Debug, Clone, PartialEq)]
pub struct GridLines {
    /// Columns.
    pub u: Vec<f64>,
    /// Rows.
    pub v: Vec<f64>,
}

/// A conforming triangulation of (a region of) the parameter domain. No two vertices share (u, v).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DomainMesh {
    /// Vertices.
    pub uv: Vec<DVec2>,
    /// Corners, anticlockwise in (u, v).
    pub triangles: Vec<[u32; 3]>,
}

/// What tracing touched (thesis Table 3.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TracingCounts {
    /// Cells of the grid.
    pub cells: u64,
    /// Visits of cells by loops.
    pub cells_traced: u64,
    /// Distinct cells visited.
    pub cells_distinct: u64,
    /// Loops that lie in one cell entirely.
    pub contained_loops: u64,
}

/// A domain mesh with its image in space.
///
/// The two differ at poles only: a degenerate edge of the domain has many vertices in (u, v) and one in space, and
/// triangles that vanish there have no counterpart in the mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lifted {
    /// The triangulation of the domain, covering it whole.
    pub domain: DomainMesh,
    /// The mesh in space: no zero-area triangles, one vertex a pole, a cut along seams.
    pub mesh: Mesh,
    /// Unit normals of the surface at the mesh's vertices.
    pub normals: Vec<DVec3>,
    /// For each vertex of `domain` its vertex of `mesh`.
    pub vertex_of: Vec<u32>,
    /// For each triangle of `domain` its triangle of `mesh`, `u32::MAX` where it vanished.
    pub triangle_of: Vec<u32>,
}
