//! A mesh as JSON for programs: every coordinate to its last bit, millimetres.
//!
//! `{ "positions": [[x, y, z]], "triangles": [[a, b, c]], "uv": [[u, v]] | null, "flat": [[x, y]] | null,
//! "strain_percent": [[least, greatest]] | null, "part": [true] | null }`. Strains and `part` are those of triangles; `part`
//! is null when all triangles belong to the part. A vertex that a partial flattening did not get to has `null` in `flat`,
//! a triangle without strain has it in `strain_percent`.

use glam::DVec2;
use serde::{Serialize, Serializer};

use super::MeshParts;
use crate::formats::numbers::{Coordinates, WriteError, compact_json};

#[derive(Serialize)]
struct MeshDocument<'a> {
    positions: Positions<'a>,
    triangles: &'a [[u32; 3]],
    uv: Option<Domain<'a>>,
    flat: Option<Flat<'a>>,
    strain_percent: Option<Strains<'a>>,
    part: Option<&'a [bool]>,
}

struct Positions<'a>(&'a [glam::DVec3]);
struct Domain<'a>(&'a [DVec2]);
struct Flat<'a>(&'a [DVec2]);
struct Strains<'a>(&'a [[f64; 2]]);

impl Serialize for Positions<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|p| Coordinates(p.to_array())))
    }
}

impl Serialize for Domain<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|p| Coordinates(p.to_array())))
    }
}

impl Serialize for Flat<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|p| (!p.is_nan()).then(|| Coordinates(p.to_array()))))
    }
}

impl Serialize for Strains<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|s| (!s[0].is_nan() && !s[1].is_nan()).then_some(Coordinates(*s))))
    }
}

/// The document.
///
/// # Errors
/// [`WriteError::NotFinite`] for a position or parameter that is not finite, or a flat place or strain that is infinite.
pub fn write(parts: &MeshParts<'_>) -> Result<Vec<u8>, WriteError> {
    compact_json(&MeshDocument {
        positions: Positions(&parts.mesh.positions),
        triangles: &parts.mesh.triangles,
        uv: parts.mesh.uv.as_deref().map(Domain),
        flat: parts.flat.map(Flat),
        strain_percent: parts.strain_percent.map(Strains),
        part: parts.part,
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::Mesh;

    #[test]
    fn the_document_has_the_documented_shape_and_unreached_vertices_are_null() {
        let mesh = Mesh {
            positions: vec![DVec3::new(0.1, -0.0, 1e-9), DVec3::X, DVec3::Y],
            uv: Some(vec![DVec2::ZERO; 3]),
            triangles: vec![[0, 1, 2], [2, 1, 0]],
        };
        let flat = [DVec2::ZERO, DVec2::NAN, DVec2::ONE];
        let strain = [[f64::NAN; 2], [-0.0, 0.1]];
        let parts = MeshParts {
            flat: Some(&flat),
            strain_percent: Some(&strain),
            part: Some(&[true, false]),
            ..MeshParts::of(&mesh)
        };
        let text = String::from_utf8(write(&parts).unwrap()).unwrap();
        assert_eq!(
            text,
            r#"{"positions":[[0.1,0.0,1e-9],[1.0,0.0,0.0],[0.0,1.0,0.0]],"triangles":[[0,1,2],[2,1,0]],"uv":[[0.0,0.0],[0.0,0.0],[0.0,0.0]],"flat":[[0.0,0.0],null,[1.0,1.0]],"strain_percent":[null,[0.0,0.1]],"part":[true,false]}"#
        );
        let bad = Mesh { positions: vec![DVec3::NAN], ..Mesh::default() };
        assert!(write(&MeshParts::of(&bad)).is_err());
    }
}
