//! Strips that wind by more than a full turn, and what becomes of them.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use robust::{Coord, orient2d};

use super::*;
use crate::engine::budget::Unobserved;
use crate::engine::distortion::overlaps;
use crate::engine::flattening::isometric::flatten;
use crate::engine::mesh::test_meshes::{Diagonal, grid};

/// A ramp that winds up by so many turns between two distances from its axis.
fn ramp(points: [usize; 2], turns: f64, pitch: f64, [inner, outer]: [f64; 2]) -> Mesh {
    grid(points[0], points[1], Diagonal::Diamond, |u, v| {
        let (r, direction) = (outer + (inner - outer) * v, DVec2::from_angle(TAU * turns * u));
        (r * direction).extend(pitch * turns * u)
    })
}

/// A strip that curls to the left at one end and to the right at the other, each time by so many turns.
fn curls(turns: f64) -> Mesh {
    grid(161, 5, Diagonal::Regular, |u, v| {
        let side = if u < 0.5 { 1.0 } else { -1.0 };
        let angle = TAU * turns * (2.0 * u - 1.0).abs();
        // Two arcs of radius 10 about (0, 10) and (0, -10) that touch at the origin; to the left is up.
        let r = 10.0 + 2.0 * (v - 0.5) * -side;
        DVec3::new(-side * r * angle.sin(), side * (10.0 - r * angle.cos()), 6.0 * (2.0 * u - 1.0))
    })
}

fn free_of(mesh: &Mesh, topology: &Topology, options: &IsometricOptions) -> Vec<DVec2> {
    flatten(mesh, topology, options, &Unobserved).unwrap().flat
}

fn overlap_count(topology: &Topology, flat: &[DVec2]) -> usize {
    let found = overlaps(flat, topology, &Unobserved).unwrap();
    assert!(found.complete);
    found.regions.len()
}

/// Flattens a mesh whose free map lies on itself, and checks all that is promised.
fn without_overlaps(mesh: &Mesh, objective: Objective) -> Injective {
    let topology = Topology::new(mesh).unwrap();
    let options = IsometricOptions { objective, ..IsometricOptions::default() };
    let free = free_of(mesh, &topology, &options);
    assert!(overlap_count(&topology, &free) > 0, "nothing to do");
    let found = flatten_injectively(mesh, &topology, &options, &free, &Unobserved).unwrap().unwrap();
    assert_eq!(overlap_count(&topology, &found.flat), 0);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| found.flat[v as usize]).map(|p| Coord { x: p.x, y: p.y });
        assert!(orient2d(a, b, c) > 0.0);
    }
    assert!(found.energy_after.is_finite() && found.energy_after > found.energy_before);
    found
}

/// The least distance between border vertices that are far apart along the border.
fn gap(topology: &Topology, flat: &[DVec2], apart: usize) -> f64 {
    let border: Vec<DVec2> =
        topology.borders().next().unwrap().iter().map(|&h| flat[topology.origin(h) as usize]).collect();
    let count = border.len();
    let mut least = f64::INFINITY;
    for i in 0..count {
        for j in i + apart..(i + count).saturating_sub(apart).min(count) {
            least = least.min(scaffold::distance_to_segment(border[i], [border[j], border[(j + 1) % count]]));
        }
    }
    least
}

#[test]
fn a_ramp_of_two_turns_becomes_a_spiral_with_a_gap() {
    let mesh = ramp([97, 5], 2.0, 20.0, [15.0, 20.0]);
    let found = without_overlaps(&mesh, Objective::Balanced);
    assert!(found.converged);
    // A strip of a quarter of its radius: bending it to the spiral's radii costs strains of some percent.
    assert!(found.energy_after < 5e-3, "{}", found.energy_after);
    let topology = Topology::new(&mesh).unwrap();
    let size = crate::engine::mesh::measures::total_area(&mesh).sqrt();
    let gap = gap(&topology, &found.flat, 12) / size;
    assert!((1e-4..2e-2).contains(&gap), "{gap}");
}

#[test]
fn every_objective_has_a_map_without_overlaps() {
    let mesh = ramp([61, 4], 1.4, 10.0, [12.0, 20.0]);
    for objective in [Objective::Arap, Objective::Area, Objective::Shape, Objective::Weights { area: 1.0, shape: 2.0 }]
    {
        without_overlaps(&mesh, objective);
    }
}

#[test]
fn what_curls_both_ways_has_no_centre_and_starts_from_the_convex_map() {
    let mesh = curls(1.15);
    let topology = Topology::new(&mesh).unwrap();
    let free = free_of(&mesh, &topology, &IsometricOptions::default());
    let same: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let shape = Shape::new(&mesh, &same).unwrap();
    assert_eq!(spirals((&shape, &topology), &free, &Unobserved).unwrap().len(), 0);
    let found = without_overlaps(&mesh, Objective::Balanced);
    assert!(found.energy_after < 0.1, "{}", found.energy_after);
}

#[test]
fn holes_stay_holes() {
    let mut mesh = ramp([97, 7], 1.5, 15.0, [12.0, 20.0]);
    let middle = |t: &[u32; 3]| {
        let uv = mesh.uv.as_ref().unwrap();
        t.iter().map(|&v| uv[v as usize]).sum::<DVec2>() / 3.0
    };
    let kept = |t: &[u32; 3]| {
        let at = middle(t);
        [0.25, 0.6].iter().all(|hole| (at.x - hole).abs() > 0.02 || (at.y - 0.5).abs() > 0.2)
    };
    let triangles = mesh.triangles.iter().copied().filter(kept).collect();
    mesh.triangles = triangles;
    assert_eq!(Topology::new(&mesh).unwrap().border_count(), 3);
    without_overlaps(&mesh, Objective::Balanced);
}

#[test]
fn the_same_bytes_come_out_with_one_thread_and_with_two() {
    let mesh = ramp([61, 4], 1.6, 12.0, [14.0, 20.0]);
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| without_overlaps(&mesh, Objective::Balanced))
    });
    assert_eq!(one, two);
}

#[test]
fn a_mesh_that_is_no_disc_is_refused_and_a_cancelled_one_stops() {
    struct Cancelled;
    impl Observer for Cancelled {
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let mesh = ramp([61, 4], 1.6, 12.0, [14.0, 20.0]);
    let topology = Topology::new(&mesh).unwrap();
    let free = free_of(&mesh, &topology, &IsometricOptions::default());
    let stopped = flatten_injectively(&mesh, &topology, &IsometricOptions::default(), &free, &Cancelled);
    assert!(matches!(stopped, Err(EngineError::Cancelled)));
    let two = Mesh { triangles: vec![mesh.triangles[0], mesh.triangles[100]], ..mesh };
    let topology = Topology::of_triangles(&two.triangles, two.positions.len()).unwrap();
    assert!(flatten_injectively(&two, &topology, &IsometricOptions::default(), &free, &Unobserved).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn random_ramps_never_lie_on_themselves(
        turns in 1.2..2.6_f64,
        width in 0.1..0.6_f64,
        pitch in 1.0..20.0_f64,
        across in 2..5_usize,
    ) {
        let mesh = ramp([(40.0 * turns) as usize, across], turns, pitch, [20.0 * (1.0 - width), 20.0]);
        let topology = Topology::new(&mesh).unwrap();
        let free = free_of(&mesh, &topology, &IsometricOptions::default());
        if overlap_count(&topology, &free) > 0 {
            let found = without_overlaps(&mesh, Objective::Balanced);
            prop_assert!(found.energy_after < 1.0, "{}", found.energy_after);
        }
    }
}
