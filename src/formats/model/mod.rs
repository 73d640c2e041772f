//! A mesh in space with its flattening: GLB to look at, OBJ, STL and PLY for other programs, JSON and CSV for numbers.
//!
//! What a form has no place for is left out, and each module says what that is. A vertex that a partial flattening did
//! not get to is never given a false place in silence.

pub mod glb;
pub mod mesh_json;
pub mod obj;
pub mod ply;
pub mod stl;
mod strain_colours;
pub mod triangles_csv;
mod vertex_strains;
pub mod vertices_csv;

use glam::{DVec2, DVec3};

use crate::engine::mesh::Mesh;
use crate::engine::pipeline::Outcome;
use crate::formats::numbers::WriteError;

/// What is written of a mesh. The slices are as long as the mesh has vertices (strains, part: triangles).
#[derive(Debug, Clone, Copy)]
pub struct MeshParts<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Unit normals at its vertices; empty when there are none.
    pub normals: &'a [DVec3],
    /// Places in the pattern, mm; NaN where a partial flattening did not get to.
    pub flat: Option<&'a [DVec2]>,
    /// Principal strains of each triangle `[least, greatest]`, percent; NaN where there is none.
    pub strain_percent: Option<&'a [[f64; 2]]>,
    /// Which triangles belong to the part; `None`: all of them.
    pub part: Option<&'a [bool]>,
    /// The surface's own Gaussian curvature at the vertices, 1/mm^2.
    pub gaussian: Option<&'a [f64]>,
    /// How far averaging moved each vertex, mm; NaN where a partial flattening did not get to.
    pub movement: Option<&'a [f64]>,
}

impl<'a> MeshParts<'a> {
    /// A mesh and nothing else.
    #[must_use]
    pub const fn of(mesh: &'a Mesh) -> Self {
        Self { mesh, normals: &[], flat: None, strain_percent: None, part: None, gaussian: None, movement: None }
    }

    /// Whether a triangle belongs to the part.
    fn is_of_part(&self, triangle: usize) -> bool {
        self.part.and_then(|part| part.get(triangle)).is_none_or(|inside| *inside)
    }

    /// The normals, when there is one for each vertex.
    fn normals(&self) -> Option<&'a [DVec3]> {
        Some(self.normals).filter(|normals| !normals.is_empty() && normals.len() == self.mesh.positions.len())
    }

    /// There must be triangles, and every position must be finite.
    fn check(&self) -> Result<(), WriteError> {
        if self.mesh.triangles.is_empty() {
            return Err(WriteError::Empty { what: "triangle" });
        }
        match self.mesh.positions.iter().position(|p| !p.is_finite()) {
            Some(i) => Err(WriteError::NotFinite { what: format!("position {i} of the mesh") }),
            None => Ok(()),
        }
    }
}

impl<'a> From<&'a Outcome> for MeshParts<'a> {
    fn from(outcome: &'a Outcome) -> Self {
        Self {
            mesh: &outcome.mesh,
            normals: &outcome.normals,
            flat: outcome.flat.as_deref(),
            strain_percent: outcome.strain_percent.as_deref(),
            part: outcome.part.as_deref(),
            gaussian: outcome.gaussian.as_deref(),
            movement: outcome.movement.as_deref(),
        }
    }
}
