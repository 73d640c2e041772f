//! A mesh as binary STL: triangles in millimetres, single precision, nothing else.
//!
//! STL has no units (millimetres are what programs take it for), no shared vertices, no flattening and no mark for the
//! part: all triangles of the mesh are written, in their order. Single precision carries seven digits, so a part of a
//! metre that lies a kilometre from the origin keeps tenths of a millimetre; PLY and JSON keep every digit.
//!
//! Facet normals are those of the triangles (right-hand rule), zero for a triangle without area, as readers expect.

use glam::DVec3;

use super::MeshParts;
use crate::formats::numbers::WriteError;

/// Must not begin with `solid`: that would announce text.
const TITLE: &[u8] = concat!("planish ", env!("CARGO_PKG_VERSION"), ", binary STL, millimetres").as_bytes();
/// Bytes of the title.
const TITLE_BYTES: usize = 80;
/// Bytes a facet.
const FACET: usize = 50;

/// The file.
///
/// # Errors
/// [`WriteError::Empty`] without triangles, [`WriteError::NotFinite`] for a position that single precision cannot hold,
/// [`WriteError::TooLarge`] beyond 2^32 triangles.
pub fn write(parts: &MeshParts<'_>) -> Result<Vec<u8>, WriteError> {
    parts.check()?;
    let mesh = parts.mesh;
    if let Some(i) = mesh.positions.iter().position(|p| !p.as_vec3().is_finite()) {
        return Err(WriteError::NotFinite { what: format!("position {i} of the mesh in single precision") });
    }
    let count = u32::try_from(mesh.triangles.len()).map_err(|_| WriteError::TooLarge {
        detail: format!("{} triangles, STL counts to 2^32", mesh.triangles.len()),
    })?;
    let mut out = Vec::with_capacity(TITLE_BYTES + 4 + FACET * mesh.triangles.len());
    out.extend_from_slice(TITLE);
    out.resize(TITLE_BYTES, b' ');
    out.extend_from_slice(&count.to_le_bytes());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::ZERO);
        for point in [normal, a, b, c] {
            for x in point.as_vec3().to_array() {
                // Adding positive zero drops the sign of zero.
                out.extend_from_slice(&(x + 0.0).to_le_bytes());
            }
        }
        out.extend_from_slice(&0_u16.to_le_bytes());
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::mesh::Mesh;

    #[test]
    fn a_facet_has_its_normal_its_corners_and_no_minus_zero() {
        let mesh = Mesh {
            positions: vec![DVec3::new(-0.0, 0.0, 5.0), DVec3::new(2.0, 0.0, 5.0), DVec3::new(0.0, 3.0, 5.0)],
            uv: None,
            triangles: vec![[0, 1, 2], [0, 1, 1]],
        };
        let bytes = write(&MeshParts::of(&mesh)).unwrap();
        assert_eq!(bytes.len(), 80 + 4 + 2 * 50);
        assert!(!bytes.starts_with(b"solid"));
        assert_eq!(bytes[80..84], 2_u32.to_le_bytes());
        let floats: Vec<u32> = bytes[84..84 + 48].as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
        let want = [0.0, 0.0, 1.0, 0.0, 0.0, 5.0, 2.0, 0.0, 5.0, 0.0, 3.0, 5.0_f32].map(f32::to_bits);
        assert_eq!(floats, want);
        assert_eq!(bytes[134..146], [0; 12], "no area, no normal");
        assert_eq!(write(&MeshParts::of(&Mesh::default())), Err(WriteError::Empty { what: "triangle" }));
        let far = Mesh { positions: vec![DVec3::splat(1e300); 3], ..mesh };
        assert!(matches!(write(&MeshParts::of(&far)), Err(WriteError::NotFinite { .. })));
    }
}
