//! Coarser discs are discs, and the way back has no flip.

use glam::DVec3;
use proptest::prelude::*;
use robust::{Coord, orient2d};

use super::coarsen::coarsen;
use super::{carry_over, put_back};
use crate::engine::budget::Unobserved;
use crate::engine::flattening::isometric::{IsometricOptions, flatten};
use crate::engine::mesh::test_meshes::{Diagonal, grid};
use crate::engine::mesh::{Mesh, Topology};

fn flips(triangles: &[[u32; 3]], flat: &[[f64; 2]]) -> usize {
    let at = |v: u32| Coord { x: flat[v as usize][0], y: flat[v as usize][1] };
    triangles.iter().filter(|t| orient2d(at(t[0]), at(t[1]), at(t[2])) <= 0.0).count()
}

/// A wavy panel of 61 x 51 points with a hole.
fn holed(diagonal: Diagonal, height: f64) -> Mesh {
    let mut mesh = grid(61, 51, diagonal, |u, v| {
        DVec3::new(6.0 * u, 5.0 * v, height * ((7.0 * u).sin() * (5.0 * v + 0.3).cos() + u * v))
    });
    let mut at = 0;
    mesh.triangles.retain(|_| {
        let (i, j) = ((at / 2) % 60, (at / 2) / 60);
        at += 1;
        !((20..33).contains(&i) && (15..24).contains(&j))
    });
    mesh
}

#[test]
fn coarser_meshes_are_discs_with_the_same_holes_and_nearly_the_same_area() {
    for diagonal in Diagonal::ALL {
        let mesh = holed(diagonal, 0.4);
        let topology = Topology::new(&mesh).unwrap();
        let found = coarsen(&mesh, &topology, (100, 4), &Unobserved).unwrap();
        assert!(found.levels.len() >= 2 && found.levels[0].triangles.len() * 3 < mesh.triangles.len());
        let area = crate::engine::mesh::measures::total_area(&mesh);
        let mut before = mesh.triangles.len();
        for level in &found.levels {
            assert!(level.triangles.len() < before);
            before = level.triangles.len();
            let part = Mesh { triangles: level.triangles.clone(), ..mesh.clone() };
            let coarse = Topology::new(&part).unwrap();
            assert_eq!((coarse.border_count(), coarse.piece_count()), (2, 1));
            assert_eq!(coarse.euler_characteristic(), topology.euler_characteristic());
            assert!((crate::engine::mesh::measures::total_area(&part) / area - 1.0).abs() < 0.05);
        }
        assert_eq!(found, coarsen(&mesh, &topology, (100, 4), &Unobserved).unwrap(), "the same each time");
    }
}

#[test]
fn a_map_that_is_carried_over_is_near_the_least_one() {
    let mesh = holed(Diagonal::Diamond, 6.0);
    let topology = Topology::new(&mesh).unwrap();
    let flat = carry_over(&mesh, &topology, &Unobserved).unwrap().unwrap();
    assert_eq!(flips(&mesh.triangles, &flat), 0);
    let energy = |flat: &[[f64; 2]]| {
        // Mean of s1^2 + s2^2 + 1/s1^2 + 1/s2^2 - 4 by areas: |F|^2 (1 + 1/det^2) - 4.
        let (mut sum, mut total) = (0.0, 0.0);
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
            let [p, q, r] = corners.map(|v| flat[v as usize]);
            let (e, f) = (b - a, c - a);
            let (d, g) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
            let double = e.cross(f).length();
            let dot = |x: [f64; 2], y: [f64; 2]| x[0] * y[0] + x[1] * y[1];
            let norm = dot(d, d) * f.dot(f) - 2.0 * dot(d, g) * e.dot(f) + dot(g, g) * e.dot(e);
            let det = (d[0] * g[1] - d[1] * g[0]) / double;
            sum += double * (norm / (double * double) * (1.0 + 1.0 / (det * det)) - 4.0);
            total += double;
        }
        sum / total
    };
    let least = flatten(&mesh, &topology, &IsometricOptions::default(), &Unobserved).unwrap().run.energy;
    let carried = energy(&flat);
    assert!(carried > least && carried < 1.2 * least, "{carried} {least}");
    // Where the surface is nearly developable there is no need.
    let mesh = holed(Diagonal::Diamond, 0.4);
    assert_eq!(carry_over(&mesh, &Topology::new(&mesh).unwrap(), &Unobserved).unwrap(), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Even from a bad map: the coarse mesh's own projection, stretched and bent without a flip.
    #[test]
    fn vertices_return_without_a_flip(
        heights in proptest::collection::vec(-1.0..1.0_f64, 97), tall in 0.0..0.3, stretch in 0.05..20.0, bend in -0.05..0.05,
    ) {
        let mesh = grid(24, 20, Diagonal::ChevronRows, |u, v| {
            let at = (23.0 * u).round() as usize * 7 + (19.0 * v).round() as usize;
            DVec3::new(23.0 * u, 19.0 * v, tall * heights[at % 97])
        });
        let topology = Topology::new(&mesh).unwrap();
        let found = coarsen(&mesh, &topology, (20, 4), &Unobserved).unwrap();
        let last = found.levels.last().unwrap();
        let mut flat: Vec<[f64; 2]> =
            mesh.positions.iter().map(|p| [stretch * (p.x + bend * p.x * p.y), p.y + bend * p.x]).collect();
        // Coarse triangles seen from above may lie the wrong way up: then there is nothing to carry.
        prop_assume!(flips(&last.triangles, &flat) == 0);
        for removal in &found.removals[..last.removals] {
            flat[removal.vertex as usize] = [f64::NAN; 2];
        }
        prop_assert!(put_back(&mesh.positions, &found, [0, last.removals], &mut flat));
        prop_assert_eq!(flips(&mesh.triangles, &flat), 0);
    }
}
