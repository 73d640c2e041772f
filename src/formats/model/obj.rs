//! A mesh as Wavefront OBJ: text, millimetres, every digit.
//!
//! `vt` is a vertex's place in the pattern in millimetres where there is a flattening, else its parameters (u, v) on the
//! surface; the first lines say which. `vn` is its normal where there is one. Triangles are in their order within the
//! groups `part` and `waste` (outside the loops; only where the mesh is that of the whole base surface). A corner
//! that a partial flattening did not get to has no `vt`, and a triangle with such a corner names none. OBJ has no place
//! for strains.

use std::io::Write as _;

use glam::DVec2;

use super::MeshParts;
use crate::formats::numbers::WriteError;

/// The file. `stem` names the object: letters, digits, `-` and `_`.
///
/// # Errors
/// [`WriteError::Empty`] without triangles, [`WriteError::NotFinite`] for a number that is not finite other than the
/// place of a vertex that was not reached.
pub fn write(parts: &MeshParts<'_>, stem: &str) -> Result<Vec<u8>, WriteError> {
    parts.check()?;
    let mesh = parts.mesh;
    let vertices = mesh.positions.len();
    let normals = parts.normals();
    let flat = parts.flat.filter(|flat| flat.len() == vertices);
    let coordinates = flat.or_else(|| mesh.uv.as_deref().filter(|uv| uv.len() == vertices));
    let mut out = Vec::with_capacity(vertices * 96 + mesh.triangles.len() * 24);
    out.extend_from_slice(concat!("# planish ", env!("CARGO_PKG_VERSION"), ", millimetres\n").as_bytes());
    match (flat, coordinates) {
        (Some(_), _) => out.extend_from_slice(b"# vt: place in the pattern, millimetres\n"),
        (None, Some(_)) => out.extend_from_slice(b"# vt: parameters u, v of the surface\n"),
        (None, None) => {}
    }
    line(&mut out, "o", stem);
    for p in &mesh.positions {
        numbers(&mut out, "v", &p.to_array());
    }
    let indices = places(&mut out, coordinates)?;
    for (i, n) in normals.unwrap_or_default().iter().enumerate() {
        if !n.is_finite() {
            return Err(WriteError::NotFinite { what: format!("normal {i} of the mesh") });
        }
        numbers(&mut out, "vn", &n.to_array());
    }
    let groups: &[(&str, bool)] =
        if parts.part.is_some() { &[("part", true), ("waste", false)] } else { &[("part", true)] };
    for (name, inside) in groups {
        line(&mut out, "g", name);
        for (_, triangle) in mesh.triangles.iter().enumerate().filter(|(t, _)| parts.is_of_part(*t) == *inside) {
            face(&mut out, *triangle, &indices, normals.is_some());
        }
    }
    Ok(out)
}

/// Writes the `vt` lines; gives the number of each vertex's line, 0 where it has none.
fn places(out: &mut Vec<u8>, coordinates: Option<&[DVec2]>) -> Result<Vec<u32>, WriteError> {
    let mut written = 0;
    coordinates
        .unwrap_or_default()
        .iter()
        .enumerate()
        .map(|(i, p)| {
            if p.is_nan() {
                return Ok(0);
            }
            if !p.is_finite() {
                return Err(WriteError::NotFinite { what: format!("place {i} of the mesh") });
            }
            numbers(out, "vt", &p.to_array());
            written += 1;
            Ok(written)
        })
        .collect()
}

fn face(out: &mut Vec<u8>, triangle: [u32; 3], places: &[u32], normals: bool) {
    let place = |v: u32| places.get(v as usize).copied().unwrap_or(0);
    let placed = triangle.iter().all(|v| place(*v) > 0);
    out.push(b'f');
    for v in triangle {
        let i = u64::from(v) + 1;
        // Writing to memory cannot fail.
        let _ = match (placed, normals) {
            (true, true) => write!(out, " {i}/{}/{i}", place(v)),
            (true, false) => write!(out, " {i}/{}", place(v)),
            (false, true) => write!(out, " {i}//{i}"),
            (false, false) => write!(out, " {i}"),
        };
    }
    out.push(b'\n');
}

fn line(out: &mut Vec<u8>, keyword: &str, rest: &str) {
    let _ = writeln!(out, "{keyword} {rest}");
}

/// The shortest digits that give the same double; adding positive zero drops the sign of zero.
fn numbers(out: &mut Vec<u8>, keyword: &str, values: &[f64]) {
    out.extend_from_slice(keyword.as_bytes());
    for x in values {
        let _ = write!(out, " {:?}", x + 0.0);
    }
    out.push(b'\n');
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::Mesh;

    fn square() -> Mesh {
        Mesh {
            positions: vec![DVec3::new(-0.0, 0.1, 1e-9), DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y],
            uv: Some([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from_array).to_vec()),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    fn text(parts: &MeshParts<'_>) -> Vec<String> {
        let text = String::from_utf8(write(parts, "square").unwrap()).unwrap();
        text.lines().skip(1).map(str::to_owned).collect()
    }

    #[test]
    fn a_mesh_without_a_flattening_has_the_surfaces_parameters() {
        let mesh = square();
        let lines = text(&MeshParts { normals: &[DVec3::Z; 4], ..MeshParts::of(&mesh) });
        assert_eq!(lines[..3], ["# vt: parameters u, v of the surface", "o square", "v 0.0 0.1 1e-9"]);
        assert_eq!(lines[6], "vt 0.0 0.0");
        assert_eq!(lines[10], "vn 0.0 0.0 1.0");
        assert_eq!(lines[14..], ["g part", "f 1/1/1 2/2/2 3/3/3", "f 1/1/1 3/3/3 4/4/4"]);
    }

    #[test]
    fn what_was_not_reached_has_no_place_and_waste_is_a_group_of_its_own() {
        let mesh = square();
        let flat = [[5.0, 5.0], [f64::NAN; 2], [6.0, 6.0], [5.0, 6.0]].map(DVec2::from_array);
        let parts = MeshParts { flat: Some(&flat), part: Some(&[false, true]), ..MeshParts::of(&mesh) };
        let lines = text(&parts);
        assert_eq!(lines[0], "# vt: place in the pattern, millimetres");
        assert_eq!(
            lines[6..],
            ["vt 5.0 5.0", "vt 6.0 6.0", "vt 5.0 6.0", "g part", "f 1/1 3/2 4/3", "g waste", "f 1 2 3"]
        );
    }

    #[test]
    fn bare_triangles_are_written_too_and_numbers_read_back_bit_for_bit() {
        let mesh = Mesh { uv: None, ..square() };
        let lines = text(&MeshParts::of(&mesh));
        assert_eq!(lines[5..], ["g part", "f 1 2 3", "f 1 3 4"]);
        let read: Vec<f64> = lines[1][2..].split(' ').map(|x| x.parse().unwrap()).collect();
        assert_eq!(read, [0.0, 0.1, 1e-9]);
    }
}
