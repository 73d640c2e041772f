//! What every mesh of the engine keeps to, checked from the outside: for tests of whatever makes meshes, and for meshes
//! that users send.
//!
//! - [ ] every coordinate is finite;
//! - [ ] corners exist and differ; no edge has more than two triangles; neighbours are oriented alike;
//! - [ ] no triangle has an area that vanishes against its longest edge ([`FLAT`]);
//! - [ ] no vertex of a border lies inside an edge of the border (a T-junction: the mesh has a crack there);
//! - [ ] no vertex is touched by separate fans of triangles.
//!
//! Time is O(n log n) but for meshes most of whose border edges overlap one another.

use glam::DVec3;

use super::measures::corners;
use super::topology::{NONE, next, prev};
use super::{Mesh, MeshFault, Topology};

/// A triangle whose height is below this part of its longest edge has no area. Larger, and slivers that trimming loops
/// make unavoidable would count; smaller, and rounding of the coordinates decides.
pub const FLAT: f64 = 1e-12;

/// A vertex this near to an edge, relative to the edge's length, lies on it. A crack that is wider shows in a drawing;
/// rounding of mesh coordinates is some orders smaller.
pub const ON_EDGE: f64 = 1e-9;

/// All faults of a mesh; empty for a sound one. When the connectivity is broken only its first fault and those of the
/// coordinates are given, since the rest has no meaning then.
#[must_use]
pub fn faults(mesh: &Mesh) -> Vec<MeshFault> {
    let mut faults: Vec<MeshFault> = mesh
        .positions
        .iter()
        .enumerate()
        .filter(|(_, p)| !p.is_finite())
        .map(|(v, _)| MeshFault::NotFinite { vertex: v as u32 })
        .collect();
    let topology = match Topology::new(mesh) {
        Ok(topology) => topology,
        Err(fault) => {
            faults.push(fault);
            return faults;
        }
    };
    for triangle in 0..mesh.triangles.len() as u32 {
        let [a, b, c] = corners(mesh, triangle);
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        if (b - a).cross(c - a).length() <= FLAT * longest {
            faults.push(MeshFault::ZeroArea { triangle });
        }
    }
    faults.extend(pinched(&topology));
    if !faults.iter().any(|f| matches!(f, MeshFault::NotFinite { .. })) {
        faults.extend(t_junctions(mesh, &topology));
    }
    faults
}

/// Vertices with more than one fan.
fn pinched(topology: &Topology) -> Vec<MeshFault> {
    let mut fans = vec![0_u32; topology.vertex_count()];
    let mut seen = vec![false; 3 * topology.triangle_count()];
    for border in [true, false] {
        for first in 0..3 * topology.triangle_count() as u32 {
            if seen[first as usize] || (border && topology.twin(first) != NONE) {
                continue;
            }
            fans[topology.origin(first) as usize] += 1;
            let mut h = first;
            while h != NONE && !seen[h as usize] {
                seen[h as usize] = true;
                h = topology.twin(prev(h));
            }
        }
    }
    let many = fans.iter().enumerate().filter(|&(_, &n)| n > 1);
    many.map(|(v, &fans)| MeshFault::PinchedVertex { vertex: v as u32, fans }).collect()
}

/// Border vertices that lie inside border edges, found by a sweep along x.
fn t_junctions(mesh: &Mesh, topology: &Topology) -> Vec<MeshFault> {
    let at = |v: u32| mesh.positions[v as usize];
    let mut vertices: Vec<u32> = topology.borders().flatten().map(|&h| topology.origin(h)).collect();
    vertices.sort_unstable_by(|&a, &b| at(a).x.total_cmp(&at(b).x).then(a.cmp(&b)));
    vertices.dedup();
    let mut found = Vec::new();
    for &h in topology.borders().flatten() {
        let (start, end) = (topology.origin(h), topology.target(h));
        let (a, b) = (at(start), at(end));
        let reach = ON_EDGE * a.distance(b);
        let first = vertices.partition_point(|&v| at(v).x < a.x.min(b.x) - reach);
        for &vertex in vertices[first..].iter().take_while(|&&v| at(v).x <= a.x.max(b.x) + reach) {
            if vertex != start && vertex != end && lies_inside(at(vertex), a, b, reach) {
                found.push(MeshFault::TJunction { vertex, vertices: [start, end], triangle: h / 3 });
            }
        }
    }
    debug_assert!(topology.borders().flatten().all(|&h| topology.origin(next(h)) == topology.target(h)));
    found
}

/// Whether `p` lies on the open segment, away from its ends. (Ends that coincide are a seam, not a crack.)
fn lies_inside(p: DVec3, a: DVec3, b: DVec3, reach: f64) -> bool {
    let along = (p - a).dot(b - a) / a.distance_squared(b);
    if !(0.0..=1.0).contains(&along) {
        return false;
    }
    p.distance(a + (b - a) * along) <= reach && p.distance(a) > reach && p.distance(b) > reach
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    fn of(points: &[[f64; 2]], triangles: &[[u32; 3]]) -> Mesh {
        let positions = points.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect();
        Mesh { positions, uv: None, triangles: triangles.to_vec() }
    }

    #[test]
    fn grids_are_sound() {
        for diagonal in Diagonal::ALL {
            assert_eq!(faults(&grid(9, 7, diagonal, |u, v| DVec3::new(u, v, u * v))), []);
        }
    }

    #[test]
    fn a_seam_is_not_a_crack() {
        let turn = std::f64::consts::TAU;
        let mesh = grid(9, 5, Diagonal::Regular, |u, v| DVec3::new((turn * u).cos(), (turn * u).sin(), v));
        assert_eq!(faults(&mesh), []);
    }

    #[test]
    fn a_hanging_vertex_is_found() {
        let points = [[0.0, 0.0], [2.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, -1.0], [2.0, -1.0]];
        let mesh = of(&points, &[[0, 1, 2], [0, 4, 3], [3, 5, 1]]);
        assert!(faults(&mesh).contains(&MeshFault::TJunction { vertex: 3, vertices: [0, 1], triangle: 0 }));
    }

    #[test]
    fn flat_and_broken_triangles_are_found() {
        let flat = of(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]], &[[0, 1, 2]]);
        assert!(faults(&flat).contains(&MeshFault::ZeroArea { triangle: 0 }));
        let turned = of(&[[0.0, 0.0], [1.0, 0.0], [0.5, 1.0], [0.5, -1.0]], &[[0, 1, 2], [0, 1, 3]]);
        assert_eq!(faults(&turned), [MeshFault::Orientation { vertices: [0, 1], triangles: [0, 1] }]);
        let nowhere = of(&[[0.0, 0.0], [1.0, 0.0], [f64::NAN, 1.0]], &[[0, 1, 2]]);
        assert!(faults(&nowhere).contains(&MeshFault::NotFinite { vertex: 2 }));
    }

    #[test]
    fn a_bow_tie_is_pinched() {
        let points = [[0.0, 0.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
        let bow_tie = of(&points, &[[0, 1, 2], [0, 3, 4]]);
        assert_eq!(faults(&bow_tie), [MeshFault::PinchedVertex { vertex: 0, fans: 2 }]);
    }
}
