//! Shape change as thesis 4.3 defines it: by the lengths of iso-parameter lines before and after flattening, (4.7).
//!
//! An iso-parameter line of the mesh is the chain of its edges whose two ends have the same u, or the same v, bit for bit: the
//! lines of the grid, as far as the part reaches. L^o is its length in space and L^f its length in the plane. Unlike the sum over
//! edges of (4.10), in which stretch and compression of one line's edges add up, here they cancel along a line.
//!
//! Limits: a mesh without places in the domain has none; nor is it asked of meshes whose points are skewed or follow lines of
//! curvature. A line that holes interrupt counts as one, and a straight trimming edge along u or v is one. At a pole lines lose
//! their last edge. Edges that were not reached
//! (NaN) count for nothing.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::engine::mesh::{Mesh, Topology, topology::NONE};

/// How the lengths of iso-parameter lines change.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct IsoLinesReport {
    /// Lines of constant u, and of constant v.
    pub lines: [u64; 2],
    /// Sum of the absolute changes of the lines' lengths, percent of their summed lengths on the mesh.
    pub shape_change_percent: f64,
    /// (4.7) over all lines, positive = shrunk.
    pub relative_shape: f64,
    /// The line whose length changes most, in percent of its own.
    pub greatest: Option<IsoLineReport>,
}

/// One iso-parameter line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct IsoLineReport {
    /// The parameter that is constant along it: `u` or `v`.
    pub constant: Parameter,
    /// Its value.
    pub value: f64,
    /// (4.7) in percent, positive = shrunk.
    pub change_percent: f64,
}

/// A parameter of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parameter {
    /// The first.
    U,
    /// The second.
    V,
}

/// Measures the lines of a mesh, or of the triangles of it that `part` marks. `None` where there are none.
#[must_use]
pub fn iso_lines(mesh: &Mesh, topology: &Topology, flat: &[DVec2], part: Option<&[bool]>) -> Option<IsoLinesReport> {
    let uv = mesh.uv.as_deref()?;
    let counts = |h: u32| h != NONE && part.is_none_or(|part| part.get((h / 3) as usize) == Some(&true));
    let mut report = IsoLinesReport::default();
    let (mut before, mut after, mut absolute) = (0.0, 0.0, 0.0);
    for (constant, of) in [(Parameter::U, 0), (Parameter::V, 1)] {
        let mut edges: Vec<(f64, u32)> = Vec::new();
        for (e, &h) in topology.edges().iter().enumerate() {
            let [a, b] = topology.edge_vertices(e as u32).map(|v| uv[v as usize][of]);
            if a.to_bits() == b.to_bits() && (counts(h) || counts(topology.twin(h))) {
                edges.push((a, e as u32));
            }
        }
        edges.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for line in edges.chunk_by(|a, b| a.0 == b.0) {
            let [mut in_space, mut in_plane] = [0.0; 2];
            for &(_, e) in line {
                let [a, b] = topology.edge_vertices(e).map(|v| v as usize);
                let length = flat[a].distance(flat[b]);
                if length.is_finite() {
                    in_space += mesh.positions[a].distance(mesh.positions[b]);
                    in_plane += length;
                }
            }
            if in_space > 0.0 {
                report.lines[of] += 1;
                before += in_space;
                after += in_plane;
                absolute += f64::abs(in_space - in_plane);
                let change_percent = 100.0 * (in_space - in_plane) / in_space;
                if report.greatest.is_none_or(|so_far| change_percent.abs() > so_far.change_percent.abs()) {
                    report.greatest = Some(IsoLineReport { constant, value: line[0].0, change_percent });
                }
            }
        }
    }
    report.greatest?;
    report.shape_change_percent = 100.0 * absolute / before;
    report.relative_shape = (before - after) / before;
    Some(report)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    #[test]
    fn a_sheet_stretched_along_x_changes_the_lines_of_constant_v_alone() {
        let mesh = grid(5, 4, Diagonal::Regular, |u, v| DVec3::new(8.0 * u, 3.0 * v, 0.0));
        let topology = Topology::new(&mesh).unwrap();
        let flat: Vec<DVec2> = mesh.positions.iter().map(|p| DVec2::new(1.25 * p.x, p.y)).collect();
        let found = iso_lines(&mesh, &topology, &flat, None).unwrap();
        assert_eq!(found.lines, [5, 4]);
        let greatest = found.greatest.unwrap();
        assert_eq!((greatest.constant, greatest.value), (Parameter::V, 0.0));
        assert!((greatest.change_percent + 25.0).abs() < 1e-12);
        // Four lines of 8 become 10; five of 3 stay.
        assert!((found.shape_change_percent - 100.0 * 8.0 / 47.0).abs() < 1e-12);
        assert!((found.relative_shape + 8.0 / 47.0).abs() < 1e-14);
    }

    #[test]
    fn stretch_and_compression_cancel_along_a_line_and_only_there() {
        let mesh = grid(3, 2, Diagonal::Regular, |u, v| DVec3::new(2.0 * u, v, 0.0));
        let topology = Topology::new(&mesh).unwrap();
        // The middle column moves to one side: both halves of each row change, the rows do not.
        let flat: Vec<DVec2> =
            mesh.positions.iter().map(|p| DVec2::new(if p.x == 1.0 { 1.2 } else { p.x }, p.y)).collect();
        let found = iso_lines(&mesh, &topology, &flat, None).unwrap();
        assert!(found.shape_change_percent < 1e-12, "{found:?}");
    }

    #[test]
    fn lines_end_where_the_part_ends_and_a_mesh_without_a_domain_has_none() {
        let mesh = grid(4, 4, Diagonal::Regular, |u, v| DVec3::new(u, v, 0.0));
        let topology = Topology::new(&mesh).unwrap();
        let flat: Vec<DVec2> = mesh.positions.iter().map(|p| p.truncate()).collect();
        // The first row of cells alone.
        let part: Vec<bool> = (0..18).map(|t| t < 6).collect();
        assert_eq!(iso_lines(&mesh, &topology, &flat, Some(&part)).unwrap().lines, [4, 2]);
        let bare = Mesh { uv: None, ..mesh };
        assert_eq!(iso_lines(&bare, &topology, &flat, None), None);
    }
}
