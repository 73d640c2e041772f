//! A mesh in space with its flattening: GLB to look at, JSON for programs.

pub mod glb;
pub mod mesh_json;
mod strain_colours;

use glam::{DVec2, DVec3};

use crate::engine::mesh::Mesh;
use crate::engine::pipeline::Outcome;

/// What is written of a mesh. The slices are as long as the mesh has vertices (strains: triangles).
#[derive(Debug, Clone, Copy)]
pub struct MeshParts<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Unit normals at its vertices.
    pub normals: &'a [DVec3],
    /// Places in the pattern, mm; NaN where a partial flattening did not get to.
    pub flat: Option<&'a [DVec2]>,
    /// Principal strains of each triangle `[least, greatest]`, percent; NaN where there is none.
    pub strain_percent: Option<&'a [[f64; 2]]>,
    /// Which triangles belong to the part; `None`: all of them.
    pub part: Option<&'a [bool]>,
}

impl<'a> MeshParts<'a> {
    /// A mesh and nothing else.
    #[must_use]
    pub const fn of(mesh: &'a Mesh) -> Self {
        Self { mesh, normals: &[], flat: None, strain_percent: None, part: None }
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
        }
    }
}
