//! Measures of a mesh in space (thesis 1.6): areas, lengths, aspect ratios, the centroid and the triangle nearest to it.
//!
//! Differences of positions are taken first, so that a mesh far from the origin loses no more than its coordinates
//! have lost already. Sums run in the order of triangles or edges. Lengths mm, areas mm^2.

use glam::DVec3;

use super::{Mesh, Topology};

/// Ranges of Tables 3.3 and 3.4: each ends where the next begins, the last has no end.
pub const ASPECT_RANGES: [f64; 16] =
    [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0, 15.0, 25.0, 50.0, 100.0, 300.0, 1e3, 1e4, 1e5];

/// What the aspect ratio of a triangle without height is given as: larger than any that means something, yet a number
/// that every format can write.
pub const ASPECT_MAX: f64 = 1e15;

/// Centroids whose distances from the area centroid differ by less than this part of the mesh's size count as equally
/// near. Smaller, and rounding would choose between triangles that symmetry makes equal; larger, and a triangle would be
/// taken that is visibly not the nearest.
const CENTRE_TIE: f64 = 1e-9;

/// The corners of a triangle in space.
#[must_use]
pub fn corners(mesh: &Mesh, triangle: u32) -> [DVec3; 3] {
    mesh.triangles[triangle as usize].map(|v| mesh.positions[v as usize])
}

/// Area of a triangle (1.32).
#[must_use]
pub fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Areas of all triangles, mm^2.
#[must_use]
pub fn areas(mesh: &Mesh) -> Vec<f64> {
    (0..mesh.triangles.len() as u32).map(|t| area(corners(mesh, t))).collect()
}

/// Area of the mesh, mm^2.
#[must_use]
pub fn total_area(mesh: &Mesh) -> f64 {
    (0..mesh.triangles.len() as u32).map(|t| area(corners(mesh, t))).sum()
}

/// Lengths of all edges by their numbers, mm.
#[must_use]
pub fn edge_lengths(mesh: &Mesh, topology: &Topology) -> Vec<f64> {
    (0..topology.edge_count() as u32)
        .map(|e| {
            let [a, b] = topology.edge_vertices(e);
            mesh.positions[a as usize].distance(mesh.positions[b as usize])
        })
        .collect()
}

/// Longest edge over smallest height (1.39): at least 2 / sqrt(3), [`ASPECT_MAX`] for a triangle without height.
#[must_use]
pub fn aspect_ratio(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let longest_squared = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    let ratio = 0.5 * longest_squared / area(corners);
    if ratio < ASPECT_MAX { ratio } else { ASPECT_MAX }
}

/// Centroid of a triangle (1.30).
#[must_use]
pub fn centroid([a, b, c]: [DVec3; 3]) -> DVec3 {
    a + ((b - a) + (c - a)) / 3.0
}

/// The area centroid of the mesh, or of those triangles that `part` marks. `None` when they have no area.
#[must_use]
pub fn area_centroid(mesh: &Mesh, part: Option<&[bool]>) -> Option<DVec3> {
    let origin = *mesh.positions.first()?;
    let (mut moment, mut total) = (DVec3::ZERO, 0.0);
    for t in chosen(mesh, part) {
        let corners = corners(mesh, t);
        let area = area(corners);
        moment += (centroid(corners) - origin) * area;
        total += area;
    }
    (total > 0.0).then(|| origin + moment / total)
}

/// The triangle whose centroid is nearest to the area centroid, the least when several are equally near.
#[must_use]
pub fn central_triangle(mesh: &Mesh, part: Option<&[bool]>) -> Option<u32> {
    let centre = area_centroid(mesh, part)?;
    let distance = |t: u32| centroid(corners(mesh, t)).distance(centre);
    let (mut nearest, mut farthest) = (f64::INFINITY, 0.0_f64);
    for t in chosen(mesh, part) {
        nearest = nearest.min(distance(t));
        farthest = farthest.max(distance(t));
    }
    let near_enough = nearest + CENTRE_TIE * farthest;
    chosen(mesh, part).find(|&t| distance(t) <= near_enough)
}

fn chosen(mesh: &Mesh, part: Option<&[bool]>) -> impl Iterator<Item = u32> {
    (0..mesh.triangles.len() as u32).filter(move |&t| part.is_none_or(|p| p.get(t as usize) == Some(&true)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    fn plane(m: usize, n: usize) -> Mesh {
        grid(m, n, Diagonal::Regular, |u, v| DVec3::new(6.0 * u, 2.0 * v, 0.0))
    }

    #[test]
    fn a_rectangle_has_its_area_its_edges_and_its_centroid() {
        let mesh = plane(4, 3);
        assert!((total_area(&mesh) - 12.0).abs() < 1e-14);
        let topology = Topology::new(&mesh).unwrap();
        // 9 edges of 2, 8 of 1, 6 diagonals.
        let expected = 9.0 * 2.0 + 8.0 + 6.0 * 5.0_f64.sqrt();
        assert!((edge_lengths(&mesh, &topology).iter().sum::<f64>() - expected).abs() < 1e-13);
        assert!(area_centroid(&mesh, None).unwrap().distance(DVec3::new(3.0, 1.0, 0.0)) < 1e-14);
    }

    #[test]
    fn aspect_ratios_of_known_triangles() {
        let ratio = |b: [f64; 2], c: [f64; 2]| {
            aspect_ratio([DVec3::ZERO, DVec3::new(b[0], b[1], 0.0), DVec3::new(c[0], c[1], 0.0)])
        };
        assert!((ratio([1.0, 0.0], [0.5, 0.75_f64.sqrt()]) - 2.0 / 3.0_f64.sqrt()).abs() < 1e-14);
        assert!((ratio([1.0, 0.0], [0.0, 1.0]) - 2.0).abs() < 1e-14);
        assert!((ratio([10.0, 0.0], [5.0, 0.1]) - 100.0).abs() < 1e-12);
        assert_eq!(ratio([1.0, 0.0], [2.0, 0.0]), ASPECT_MAX);
        assert_eq!(ratio([0.0, 0.0], [0.0, 0.0]), ASPECT_MAX);
    }

    #[test]
    fn of_equally_central_triangles_the_least_is_taken_wherever_the_mesh_lies() {
        // The middle cell of 5 x 5 is cell 12: triangles 24 and 25 are equally near by symmetry.
        let mut mesh = plane(6, 6);
        assert_eq!(central_triangle(&mesh, None), Some(24));
        for p in &mut mesh.positions {
            *p = glam::DQuat::from_rotation_z(0.7) * *p + DVec3::new(100.0, -31.7, 5.3);
        }
        assert_eq!(central_triangle(&mesh, None), Some(24));
    }

    #[test]
    fn the_centre_of_a_part_lies_in_the_part() {
        let mesh = plane(6, 6);
        let part: Vec<bool> = (0..50).map(|t| t < 10).collect();
        assert!(central_triangle(&mesh, Some(&part)).unwrap() < 10);
        assert_eq!(central_triangle(&mesh, Some(&[])), None);
    }

    proptest! {
        #[test]
        fn centroid_and_area_go_along_with_a_rigid_motion(angle in 0.0..6.3, x in -50.0..50.0, y in -50.0..50.0) {
            let mesh = grid(5, 4, Diagonal::Diamond, |u, v| DVec3::new(u, 2.0 * v, u * v));
            let turn = glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle);
            let shift = DVec3::new(x, y, 1.0);
            let mut moved = mesh.clone();
            for p in &mut moved.positions {
                *p = turn * *p + shift;
            }
            prop_assert!((total_area(&mesh) - total_area(&moved)).abs() < 1e-12);
            let (a, b) = (area_centroid(&mesh, None).unwrap(), area_centroid(&moved, None).unwrap());
            prop_assert!((turn * a + shift).distance(b) < 1e-12);
        }
    }
}
