//! Cader's flattening where the answer is known: planes, cylinders and cones, motions and scalings.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec2, DVec3};
use proptest::prelude::*;

use super::cader::{CaderMesh, Scratch, Stop, flatten, flatten_once};
use super::{Anchor, Average, Check, FlatteningError, Order, Parent, Readings};
use crate::engine::distortion::{Thresholds, measure};
use crate::engine::error::Located;
use crate::engine::mesh::test_meshes::{Diagonal, grid};
use crate::engine::mesh::{Mesh, MeshFault, Topology};

fn all_readings() -> Vec<Readings> {
    let mut all = Vec::new();
    for order in [Order::Fifo, Order::Index] {
        for parent in [Parent::First, Parent::Last] {
            for anchor in [Anchor::Start, Anchor::End] {
                for average in [Average::Pair, Average::Running] {
                    for check in [Check::Incident, Check::Current, Check::Final] {
                        all.push(Readings { order, parent, anchor, average, check, ..Readings::default() });
                    }
                }
            }
        }
    }
    all.extend([Check::Incident, Check::Final].map(|check| Readings { check, ..Readings::SYMMETRIC }));
    all
}

fn flat(mesh: &Mesh, readings: Readings, seed: u32) -> Vec<DVec2> {
    let (flattening, error) = flatten_once(mesh, &Topology::new(mesh).unwrap(), readings, seed).unwrap();
    assert_eq!(error, None);
    flattening.flat
}

/// The greatest distance between two placed point sets after the best rigid motion of the first, without mirroring.
fn apart(from: &[DVec2], to: &[DVec2]) -> f64 {
    let middle = |p: &[DVec2]| p.iter().sum::<DVec2>() / p.len() as f64;
    let (a, b) = (middle(from), middle(to));
    let turn: DVec2 = from.iter().zip(to).map(|(p, q)| (q - b).rotate((p - a) * DVec2::new(1.0, -1.0))).sum();
    let turn = turn.normalize();
    from.iter().zip(to).map(|(p, q)| (b + turn.rotate(p - a)).distance(*q)).fold(0.0, f64::max)
}

#[test]
fn a_plane_is_laid_down_as_it_is_under_every_reading() {
    for diagonal in Diagonal::ALL {
        let mesh = grid(13, 9, diagonal, |u, v| DVec3::new(3.0 * u * u + u, 2.0 * v + 0.3 * u, 0.0));
        let plane: Vec<DVec2> = mesh.positions.iter().map(|p| p.truncate()).collect();
        for readings in all_readings() {
            assert!(apart(&flat(&mesh, readings, 77), &plane) < 1e-12, "{diagonal:?} {readings:?}");
        }
    }
}

#[test]
fn a_cylinder_becomes_the_rectangle_of_its_chords() {
    let (radius, height, m) = (40.0, 70.0, 33);
    let mesh = grid(m, 20, Diagonal::Regular, |u, v| {
        DVec3::new(radius * (TAU * u).cos(), radius * (TAU * u).sin(), height * v)
    });
    // An inscribed prism: its faces are as wide as their chords.
    let chord = 2.0 * radius * (PI / (m - 1) as f64).sin();
    let rectangle: Vec<DVec2> =
        mesh.uv.as_ref().unwrap().iter().map(|p| DVec2::new(p.x * chord * (m - 1) as f64, p.y * height)).collect();
    for seed in [0, 300, mesh.triangles.len() as u32 - 1] {
        for readings in [Readings::default(), Readings::SYMMETRIC] {
            assert!(apart(&flat(&mesh, readings, seed), &rectangle) < 1e-10);
        }
    }
}

#[test]
fn a_cone_becomes_the_sector_of_its_chords_and_has_no_strain() {
    // A frustum of slant height 30 to 90 from the apex, half-angle asin(1/3), over three quarters of a turn.
    let (sine, turn, m) = (1.0_f64 / 3.0, 1.5 * PI, 41);
    let cosine = (1.0 - sine * sine).sqrt();
    let slant = |v: f64| 30.0 + 60.0 * v;
    let mesh = grid(m, 25, Diagonal::Diamond, |u, v| {
        let (r, angle) = (slant(v) * sine, turn * u);
        DVec3::new(r * angle.cos(), r * angle.sin(), -slant(v) * cosine)
    });
    // Each face of the inscribed pyramid opens the angle whose chord at slant height 1 is that of the circle.
    let step = 2.0 * (sine * (0.5 * turn / (m - 1) as f64).sin()).asin();
    let sector: Vec<DVec2> = mesh
        .uv
        .as_ref()
        .unwrap()
        .iter()
        .map(|p| DVec2::from_angle(step * (m - 1) as f64 * p.x).rotate(DVec2::new(slant(p.y), 0.0)))
        .collect();
    // Seen from outside, u runs anticlockwise and v downwards: the sector is turned over.
    let seen: Vec<DVec2> = sector.iter().map(|p| DVec2::new(p.x, -p.y)).collect();
    for readings in [Readings::default(), Readings::SYMMETRIC] {
        let flattened = flat(&mesh, readings, 1000);
        assert!(apart(&flattened, &seen).min(apart(&flattened, &sector)) < 1e-10);
        let topology = Topology::new(&mesh).unwrap();
        let measures = measure(&mesh, &topology, &flattened, None, Thresholds::default());
        assert!(measures.strain_percent.max < 1e-9 && measures.strain_percent.min > -1e-9);
        assert!(measures.area_change_percent < 1e-10);
    }
}

#[test]
fn a_failure_names_the_place_and_leaves_the_rest_unplaced() {
    let mesh = grid(24, 24, Diagonal::Diamond, |u, v| {
        let (x, y) = (u - 0.5, v - 0.5);
        DVec3::new(x, y, 40.0 * (x * x + y * y))
    });
    let topology = Topology::new(&mesh).unwrap();
    let (flattening, error) = flatten_once(&mesh, &topology, Readings::default(), 500).unwrap();
    let Some(FlatteningError::Flipped { triangle, level, seed, flattened, total, place }) = error else { panic!() };
    assert_eq!((seed, total as usize, flattened as usize), (500, mesh.triangles.len(), flattening.sequence.len()));
    assert_eq!((place.triangle, place.level), (Some(triangle), Some(level)));
    assert_eq!(level as usize, flattening.levels.len() - 1);
    assert_eq!(flattening.levels.iter().map(|l| l.triangles).sum::<u32>(), flattened);
    assert!(place.uv.is_some() && place.xyz_mm.is_some() && place.xy_mm.is_some());
    let placed = |t: &u32| mesh.triangles[*t as usize].iter().all(|&v| flattening.flat[v as usize].is_finite());
    assert!(flattening.sequence.iter().all(placed));
    assert!(flattening.flat.iter().any(|p| p.is_nan()));
    // The triangle that is named does lie turned over.
    let [a, b, c] = mesh.triangles[triangle as usize].map(|v| flattening.flat[v as usize]);
    assert!((b - a).perp_dot(c - a) <= 0.0);
}

#[test]
fn what_cannot_be_flattened_is_refused() {
    let mesh = grid(4, 4, Diagonal::Regular, |u, v| DVec3::new(u, v, 0.0));
    let topology = Topology::new(&mesh).unwrap();
    let refused = flatten_once(&mesh, &topology, Readings::default(), 18).unwrap_err();
    assert_eq!(refused, FlatteningError::SeedOutOfRange { seed: 18, triangles: 18 });
    let mut flat_triangle = mesh.clone();
    flat_triangle.positions[5] = flat_triangle.positions[0].lerp(flat_triangle.positions[1], 0.5);
    let refused = flatten_once(&flat_triangle, &topology, Readings::default(), 3).unwrap_err();
    assert_eq!(refused, FlatteningError::Mesh(MeshFault::ZeroArea { triangle: 0 }));
    assert_eq!(refused.code(), "mesh-zero-area");
    let mut pieces = mesh;
    pieces.triangles.retain(|t| !t.contains(&5) && !t.contains(&10));
    let topology = Topology::new(&pieces).unwrap();
    let (_, error) = flatten_once(&pieces, &topology, Readings::default(), 0).unwrap();
    assert!(matches!(error, Some(FlatteningError::SeveralPieces { unreached, .. }) if unreached > 0));
}

#[test]
fn a_reused_scratch_forgets_the_run_before() {
    let dome = grid(20, 20, Diagonal::Diamond, |u, v| DVec3::new(u, v, 0.3 * (u * u + v * v)));
    let small = grid(5, 4, Diagonal::Regular, |u, v| DVec3::new(u, v, 0.1 * u * v));
    let prepare = |mesh: &Mesh| CaderMesh::new(mesh, &Topology::new(mesh).unwrap()).unwrap();
    let (dome_mesh, small_mesh) = (prepare(&dome), prepare(&small));
    let mut scratch = Scratch::new();
    assert_eq!(flatten(&dome_mesh, Readings::default(), 5, &mut scratch), Ok(()));
    for (mesh, prepared, seed) in [(&small, &small_mesh, 3), (&dome, &dome_mesh, 700), (&dome, &dome_mesh, 2)] {
        assert_eq!(flatten(prepared, Readings::default(), seed, &mut scratch), Ok(()));
        assert_eq!(scratch.flat(), flat(mesh, Readings::default(), seed));
        assert_eq!(scratch.sequence().len(), mesh.triangles.len());
    }
    assert_eq!(flatten(&small_mesh, Readings::default(), 24, &mut scratch), Err(Stop::SeedOutOfRange));
}

proptest! {
    #[test]
    fn a_flattening_does_not_depend_on_where_the_surface_lies(
        axis in prop::array::uniform3(-1.0..1.0_f64), angle in 0.0..TAU, shift in -80.0..80.0, seed in 0_u32..140
    ) {
        let mesh = grid(11, 8, Diagonal::ChevronRows, |u, v| DVec3::new(9.0 * u, 7.0 * v, 1.5 * u * v + u * u));
        let axis = DVec3::from_array(axis).try_normalize().unwrap_or(DVec3::Z);
        let mut moved = mesh.clone();
        for p in &mut moved.positions {
            *p = DQuat::from_axis_angle(axis, angle) * *p + DVec3::splat(shift);
        }
        let (one, two) = (flat(&mesh, Readings::default(), seed), flat(&moved, Readings::default(), seed));
        for (p, q) in one.iter().zip(&two) {
            prop_assert!(p.distance(*q) < 1e-10);
        }
    }

    #[test]
    fn a_flattening_scales_with_the_surface(exponent in -3.0..5.0_f64, seed in 0_u32..140) {
        let factor = 10.0_f64.powf(exponent);
        let mesh = grid(11, 8, Diagonal::Regular, |u, v| DVec3::new(9.0 * u, 7.0 * v, 1.5 * u * v + u * u));
        let mut scaled = mesh.clone();
        scaled.positions.iter_mut().for_each(|p| *p *= factor);
        let (one, two) = (flat(&mesh, Readings::default(), seed), flat(&scaled, Readings::default(), seed));
        for (p, q) in one.iter().zip(&two) {
            prop_assert!((*p * factor).distance(*q) < 1e-11 * factor);
        }
    }

    #[test]
    fn readings_that_average_once_agree_whatever_the_mean(seed in 0_u32..140) {
        // On a regular grid no vertex is averaged twice (Table 5.9), so the two means are the same.
        let mesh = grid(11, 8, Diagonal::Regular, |u, v| DVec3::new(9.0 * u, 7.0 * v, u * v));
        let of = |average| flat(&mesh, Readings { average, ..Readings::default() }, seed);
        for (p, q) in of(Average::Pair).iter().zip(&of(Average::Running)) {
            prop_assert!(p.distance(*q) < 1e-12);
        }
    }
}
