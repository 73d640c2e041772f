//! The mesh as a table (RFC 4180): a line for each triangle with its places, areas and strains.
//!
//! The first line names the columns, with their units. A field is empty where there is nothing to say: no parameters, no
//! flattening, or a triangle that a partial flattening did not get to. Numbers have a decimal point and every digit.
//! Area in the pattern is signed: negative for a triangle that is turned over. Area change is as in the report, that in
//! space less that in the pattern, so it is positive where the material is stretched when it is laid on the part, as
//! strains are.

use std::io::Write as _;

use glam::{DVec2, DVec3};

use super::MeshParts;
use crate::engine::mesh::measures;
use crate::formats::numbers::WriteError;

const HEADER: &[u8] =
    b"triangle,part,centroid_u,centroid_v,centroid_x_mm,centroid_y_mm,centroid_z_mm,flat_x_mm,flat_y_mm,\
area_3d_mm2,area_2d_mm2,area_change_mm2,area_change_percent,strain_min_percent,strain_max_percent\r\n";

/// The table.
///
/// # Errors
/// [`WriteError::Empty`] without triangles, [`WriteError::NotFinite`] for a number that is not finite other than those of
/// triangles that were not reached.
pub fn write(parts: &MeshParts<'_>) -> Result<Vec<u8>, WriteError> {
    parts.check()?;
    let mesh = parts.mesh;
    let vertices = mesh.positions.len();
    let uv = mesh.uv.as_deref().filter(|uv| uv.len() == vertices);
    let flat = parts.flat.filter(|flat| flat.len() == vertices);
    let strain = parts.strain_percent.filter(|strain| strain.len() == mesh.triangles.len());
    let mut out = Vec::with_capacity(HEADER.len() + mesh.triangles.len() * 200);
    out.extend_from_slice(HEADER);
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let space = triangle.map(|v| mesh.positions[v as usize]);
        let area = measures::area(space);
        let plane =
            flat.map(|flat| triangle.map(|v| flat[v as usize])).filter(|plane| !plane.iter().any(|p| p.is_nan()));
        let flat_area = plane.map(|[a, b, c]| 0.5 * (b - a).perp_dot(c - a));
        let change = flat_area.map(|flat_area| area - flat_area);
        let percent = change.filter(|_| area > 0.0).map(|change| 100.0 * change / area);
        let strain = strain.map(|strain| strain[t]).filter(|strain| !strain.iter().any(|s| s.is_nan()));
        let parameters = uv.map(|uv| mean(triangle.map(|v| uv[v as usize])));
        let place = plane.map(mean);
        let [x, y, z] = measures::centroid(space).to_array();
        let fields = [
            parameters.map(|p| p.x),
            parameters.map(|p| p.y),
            Some(x),
            Some(y),
            Some(z),
            place.map(|p| p.x),
            place.map(|p| p.y),
            Some(area),
            flat_area,
            change,
            percent,
            strain.map(|[least, _]| least),
            strain.map(|[_, greatest]| greatest),
        ];
        // Writing to memory cannot fail.
        let _ = write!(out, "{t},{}", u8::from(parts.is_of_part(t)));
        for field in fields {
            out.push(b',');
            match field {
                None => {}
                // The shortest digits that give the same double; adding positive zero drops the sign of zero.
                Some(value) if value.is_finite() => {
                    let _ = write!(out, "{:?}", value + 0.0);
                }
                Some(_) => return Err(WriteError::NotFinite { what: format!("a number of triangle {t}") }),
            }
        }
        out.extend_from_slice(b"\r\n");
    }
    Ok(out)
}

fn mean([a, b, c]: [DVec2; 3]) -> DVec2 {
    // As in space: see the centroid of a mesh's triangle.
    let mean: DVec3 = measures::centroid([a.extend(0.0), b.extend(0.0), c.extend(0.0)]);
    mean.truncate()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::mesh::Mesh;

    fn lines(parts: &MeshParts<'_>) -> Vec<String> {
        let text = String::from_utf8(write(parts).unwrap()).unwrap();
        assert!(text.ends_with("\r\n") && text.matches('\n').count() == text.matches("\r\n").count());
        text.split_terminator("\r\n").map(str::to_owned).collect()
    }

    fn mesh() -> Mesh {
        Mesh {
            positions: vec![
                DVec3::ZERO,
                DVec3::new(6.0, 0.0, 0.0),
                DVec3::new(0.0, 3.0, 0.0),
                DVec3::new(6.0, 3.0, 0.0),
            ],
            uv: Some([[0.0, 0.0], [0.75, 0.0], [0.0, 1.5], [0.75, 1.5]].map(DVec2::from_array).to_vec()),
            triangles: vec![[0, 1, 2], [1, 3, 2]],
        }
    }

    #[test]
    fn a_triangle_has_its_places_areas_and_strains_in_the_columns_that_the_header_names() {
        let mesh = mesh();
        let flat = [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0], [f64::NAN; 2]].map(DVec2::from_array);
        let strain = [[0.0, 100.0], [f64::NAN; 2]];
        let part = [true, false];
        let parts =
            MeshParts { flat: Some(&flat), strain_percent: Some(&strain), part: Some(&part), ..MeshParts::of(&mesh) };
        let lines = lines(&parts);
        assert_eq!(lines[0].split(',').count(), 15);
        assert_eq!(lines[1], "0,1,0.25,0.5,2.0,1.0,0.0,1.0,1.0,9.0,4.5,4.5,50.0,0.0,100.0");
        assert_eq!(lines[2], "1,0,0.5,1.0,4.0,2.0,0.0,,,9.0,,,,,", "not reached: nothing is made up");
        assert_eq!(lines.len(), 3);
    }

    #[test]
    fn a_mesh_that_was_not_flattened_has_empty_columns() {
        let mesh = Mesh { uv: None, ..mesh() };
        assert_eq!(lines(&MeshParts::of(&mesh))[1], "0,1,,,2.0,1.0,0.0,,,9.0,,,,,");
    }

    #[test]
    fn a_triangle_that_is_turned_over_has_a_negative_area() {
        let mesh = mesh();
        let flat = [[0.0, 0.0], [-6.0, 0.0], [0.0, 3.0], [-6.0, 3.0]].map(DVec2::from_array);
        let lines = lines(&MeshParts { flat: Some(&flat), ..MeshParts::of(&mesh) });
        assert_eq!(lines[1].split(',').nth(10), Some("-9.0"));
    }
}
