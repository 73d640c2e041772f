//! The vertices of a mesh as a table (RFC 4180): a line for each with its places, its curvature and its movement.
//!
//! The first line names the columns, with their units. A field is empty where there is nothing to say: no parameters, no
//! flattening, an estimate of curvature at a border, the surface's own curvature where there is none or the job is not about it, a
//! vertex that a partial flattening did not get to. Numbers have a decimal point and every digit.

use std::io::Write as _;

use super::MeshParts;
use crate::engine::curvature::rings;
use crate::engine::mesh::Topology;
use crate::formats::numbers::WriteError;

const HEADER: &[u8] = b"vertex,u,v,x_mm,y_mm,z_mm,flat_x_mm,flat_y_mm,movement_mm,valency,angle_deficit_rad,\
gaussian_surface_per_mm2,gaussian_barycentric_per_mm2,gaussian_compensated_per_mm2,gaussian_voronoi_per_mm2\r\n";

/// The table.
///
/// # Errors
/// [`WriteError::Empty`] without triangles, [`WriteError::NotFinite`] for a position that is not finite.
pub fn write(parts: &MeshParts<'_>) -> Result<Vec<u8>, WriteError> {
    parts.check()?;
    let mesh = parts.mesh;
    let vertices = mesh.positions.len();
    let uv = mesh.uv.as_deref().filter(|uv| uv.len() == vertices);
    let flat = parts.flat.filter(|flat| flat.len() == vertices);
    let own = parts.gaussian.filter(|own| own.len() == vertices);
    let movement = parts.movement.filter(|movement| movement.len() == vertices);
    // As in the report: edges at fault are cut.
    let rings =
        Topology::cut(&mesh.triangles, vertices).map(|(topology, _)| rings(mesh, &topology)).unwrap_or_default();
    let mut out = Vec::with_capacity(HEADER.len() + vertices * 220);
    out.extend_from_slice(HEADER);
    for (v, position) in mesh.positions.iter().enumerate() {
        let ring = rings.get(v).copied().flatten();
        let [x, y, z] = position.to_array();
        let fields = [
            uv.map(|uv| uv[v].x),
            uv.map(|uv| uv[v].y),
            Some(x),
            Some(y),
            Some(z),
            flat.map(|flat| flat[v].x),
            flat.map(|flat| flat[v].y),
            movement.map(|movement| movement[v]),
        ];
        let estimates = [
            ring.map(|ring| ring.deficit()),
            own.map(|own| own[v]),
            ring.map(|ring| ring.barycentric()),
            ring.map(|ring| ring.compensated()),
            ring.map(|ring| ring.voronoi()),
        ];
        // Writing to memory cannot fail.
        let _ = write!(out, "{v}");
        for field in fields {
            number(&mut out, field);
        }
        out.push(b',');
        if let Some(ring) = ring {
            let _ = write!(out, "{}", ring.triangles);
        }
        for field in estimates {
            number(&mut out, field);
        }
        out.extend_from_slice(b"\r\n");
    }
    Ok(out)
}

/// A field: empty for what is not there or not finite, else the shortest digits that give the same double.
fn number(out: &mut Vec<u8>, field: Option<f64>) {
    out.push(b',');
    if let Some(value) = field.filter(|value| value.is_finite()) {
        // Adding positive zero drops the sign of zero. Writing to memory cannot fail.
        let _ = write!(out, "{:?}", value + 0.0);
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;
    use crate::engine::mesh::Mesh;

    /// Four triangles round the top of a pyramid.
    fn pyramid() -> Mesh {
        let base = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let mut positions = vec![DVec3::Z];
        positions.extend(base.map(|[x, y]| DVec3::new(x, y, 0.0)));
        Mesh { positions, uv: None, triangles: (0..4).map(|k| [0, 1 + k, 1 + (k + 1) % 4]).collect() }
    }

    #[test]
    fn the_top_of_a_pyramid_has_its_deficit_and_its_base_nothing_made_up() {
        let mesh = pyramid();
        let flat = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NAN];
        let movement = [0.5, 0.0, 0.0, 0.0, f64::NAN];
        let own = [2.0, f64::NAN, 0.0, 0.0, 0.0];
        let parts =
            MeshParts { flat: Some(&flat), movement: Some(&movement), gaussian: Some(&own), ..MeshParts::of(&mesh) };
        let text = String::from_utf8(write(&parts).unwrap()).unwrap();
        let lines: Vec<Vec<&str>> = text.split_terminator("\r\n").map(|line| line.split(',').collect()).collect();
        assert!(lines.iter().all(|line| line.len() == 15));
        let column = |name: &str| lines[0].iter().position(|n| *n == name).unwrap();
        let top = |name: &str| lines[1][column(name)].parse::<f64>().unwrap();
        // Four equilateral triangles with edges sqrt 2.
        let deficit = std::f64::consts::TAU - 4.0 * std::f64::consts::FRAC_PI_3;
        let area = 4.0 * 3.0_f64.sqrt() / 4.0 * 2.0;
        assert!((top("angle_deficit_rad") - deficit).abs() < 1e-12);
        assert!((top("gaussian_barycentric_per_mm2") - 3.0 * deficit / area).abs() < 1e-12);
        assert!((top("gaussian_compensated_per_mm2") - 3.0 * deficit / area * 4.0 / 6.0).abs() < 1e-12);
        assert_eq!((top("valency"), top("movement_mm"), top("gaussian_surface_per_mm2")), (4.0, 0.5, 2.0));
        assert_eq!(lines[2][column("valency")], "", "a border has no estimate");
        assert_eq!(lines[2][column("gaussian_surface_per_mm2")], "");
        assert_eq!(lines[5][column("movement_mm")], "", "not reached");
    }
}
