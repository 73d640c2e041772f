//! A mesh as binary little-endian PLY: every number in full, with everything that is known of vertices and triangles.
//!
//! Vertices: `x y z` (mm), `nx ny nz`, `u v` (parameters of the surface), `flat_x flat_y` (mm in the pattern), each group
//! where there is one. Faces: `vertex_indices`, `strain_min strain_max` (percent) where there are strains, and `part`
//! (1: belongs to the part, 0: lies outside its loops). A value that a partial flattening did not get to is NaN, as the
//! header says.

use std::fmt::Write as _;

use glam::DVec2;

use super::MeshParts;
use crate::formats::numbers::WriteError;

/// The file.
///
/// # Errors
/// [`WriteError::Empty`] without triangles, [`WriteError::NotFinite`] for a position, normal or parameter that is not
/// finite, or an infinite place or strain; [`WriteError::TooLarge`] beyond 2^31 vertices.
pub fn write(parts: &MeshParts<'_>) -> Result<Vec<u8>, WriteError> {
    parts.check()?;
    let mesh = parts.mesh;
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    if i32::try_from(vertices).is_err() {
        return Err(WriteError::TooLarge { detail: format!("{vertices} vertices, PLY indices count to 2^31") });
    }
    let normals = parts.normals();
    let uv = mesh.uv.as_deref().filter(|uv| uv.len() == vertices);
    let flat = parts.flat.filter(|flat| flat.len() == vertices);
    let strain = parts.strain_percent.filter(|strain| strain.len() == triangles);
    let mut out = header(parts, normals.is_some(), uv.is_some(), flat, strain).into_bytes();
    let doubles =
        3 + 3 * usize::from(normals.is_some()) + 2 * (usize::from(uv.is_some()) + usize::from(flat.is_some()));
    out.reserve(vertices * 8 * doubles + triangles * (14 + 16 * usize::from(strain.is_some())));
    let mut put = |values: &[f64], what: &str, i: usize, may_be_nan: bool| {
        for x in values {
            if !(x.is_finite() || may_be_nan && x.is_nan()) {
                return Err(WriteError::NotFinite { what: format!("{what} {i} of the mesh") });
            }
            // One bit pattern for NaN; adding positive zero drops the sign of zero.
            let x = if x.is_nan() { f64::NAN } else { x + 0.0 };
            out.extend_from_slice(&x.to_le_bytes());
        }
        Ok(())
    };
    for (i, p) in mesh.positions.iter().enumerate() {
        put(&p.to_array(), "position", i, false)?;
        if let Some(n) = normals {
            put(&n[i].to_array(), "normal", i, false)?;
        }
        if let Some(uv) = uv {
            put(&uv[i].to_array(), "parameter", i, false)?;
        }
        if let Some(flat) = flat {
            put(&flat[i].to_array(), "place", i, true)?;
        }
    }
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        out.push(3);
        for corner in triangle {
            out.extend_from_slice(&corner.to_le_bytes());
        }
        if let Some(strain) = strain {
            for x in strain[t] {
                if x.is_infinite() {
                    return Err(WriteError::NotFinite { what: format!("strain {t} of the mesh") });
                }
                out.extend_from_slice(&(if x.is_nan() { f64::NAN } else { x + 0.0 }).to_le_bytes());
            }
        }
        out.push(u8::from(parts.is_of_part(t)));
    }
    Ok(out)
}

fn header(
    parts: &MeshParts<'_>,
    normals: bool,
    uv: bool,
    flat: Option<&[DVec2]>,
    strain: Option<&[[f64; 2]]>,
) -> String {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    text.push_str(concat!("comment planish ", env!("CARGO_PKG_VERSION"), ", lengths in millimetres\n"));
    if flat.is_some() {
        text.push_str("comment flat_x flat_y: place in the pattern\n");
    }
    if strain.is_some() {
        text.push_str(
            "comment strain: percent, positive where the material is stretched when it is laid on the part\n",
        );
    }
    if flat.is_some_and(|flat| flat.iter().any(|p| p.is_nan())) {
        text.push_str("comment NaN: the flattening stopped before it came there\n");
    }
    // Writing to a string cannot fail.
    let _ = writeln!(text, "element vertex {}", parts.mesh.positions.len());
    let groups: [(bool, &[&str]); 4] = [
        (true, &["x", "y", "z"]),
        (normals, &["nx", "ny", "nz"]),
        (uv, &["u", "v"]),
        (flat.is_some(), &["flat_x", "flat_y"]),
    ];
    for name in groups.iter().filter(|(has, _)| *has).flat_map(|(_, names)| names.iter()) {
        let _ = writeln!(text, "property double {name}");
    }
    let _ = writeln!(text, "element face {}", parts.mesh.triangles.len());
    text.push_str("property list uchar int vertex_indices\n");
    if strain.is_some() {
        text.push_str("property double strain_min\nproperty double strain_max\n");
    }
    text.push_str("property uchar part\nend_header\n");
    text
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::Mesh;

    #[test]
    fn header_and_numbers_are_as_documented_bit_for_bit() {
        let mesh = Mesh {
            positions: vec![DVec3::new(0.1, -0.0, 1e-300), DVec3::X, DVec3::Y],
            uv: Some(vec![DVec2::new(0.25, 0.5); 3]),
            triangles: vec![[0, 1, 2], [2, 1, 0]],
        };
        let flat = [DVec2::new(7.0, 8.0), DVec2::NAN, DVec2::ONE];
        let parts = MeshParts {
            flat: Some(&flat),
            strain_percent: Some(&[[-1.5, 2.5], [f64::NAN; 2]]),
            part: Some(&[true, false]),
            ..MeshParts::of(&mesh)
        };
        let bytes = write(&parts).unwrap();
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
        let properties: Vec<&str> = header.lines().filter(|l| l.starts_with("property")).collect();
        assert_eq!(properties.len(), 3 + 2 + 2 + 1 + 2 + 1, "{header}");
        assert!(header.contains("element vertex 3\n") && header.contains("element face 2\n"), "{header}");
        let double = |at: usize| f64::from_le_bytes(bytes[end + at..end + at + 8].try_into().unwrap());
        let first: Vec<u64> = (0..7).map(|k| double(8 * k).to_bits()).collect();
        assert_eq!(first, [0.1, 0.0, 1e-300, 0.25, 0.5, 7.0, 8.0_f64].map(f64::to_bits));
        assert!(double(56 + 40).is_nan(), "not reached");
        let faces = end + 3 * 56;
        assert_eq!(bytes.len(), faces + 2 * (1 + 12 + 16 + 1));
        assert_eq!(bytes[faces..faces + 13], [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
        assert_eq!((double(3 * 56 + 13), double(3 * 56 + 21)), (-1.5, 2.5));
        assert_eq!((bytes[faces + 29], bytes[faces + 59]), (1, 0), "part and waste");
    }

    #[test]
    fn a_number_that_is_infinite_is_named() {
        let mesh = Mesh { positions: vec![DVec3::X; 3], uv: None, triangles: vec![[0, 1, 2]] };
        let flat = [DVec2::ZERO, DVec2::INFINITY, DVec2::ZERO];
        let error = write(&MeshParts { flat: Some(&flat), ..MeshParts::of(&mesh) }).unwrap_err();
        assert_eq!(error, WriteError::NotFinite { what: "place 1 of the mesh".into() });
    }
}
