//! Flattenings with known strains in known places.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::engine::mesh::test_meshes::{Diagonal, grid};

/// A plane of 100 x 60 mm with `m` x `n` points, flattened by a map.
fn mapped(m: usize, n: usize, diagonal: Diagonal, map: impl Fn(DVec2) -> DVec2) -> (Mesh, Topology, Vec<DVec2>) {
    let mesh = grid(m, n, diagonal, |u, v| DVec3::new(100.0 * u, 60.0 * v, 5.0));
    let topology = Topology::new(&mesh).unwrap();
    let flat = mesh.positions.iter().map(|p| map(p.truncate())).collect();
    (mesh, topology, flat)
}

/// A displacement whose derivative is a hill of height 1 and radius `r` around `at`.
fn hill(x: f64, at: f64, r: f64) -> f64 {
    let t = ((x - at) / r).clamp(-1.0, 1.0);
    // The integral of (1 - t^2)^2.
    r * (t - 2.0 * t.powi(3) / 3.0 + t.powi(5) / 5.0)
}

/// A band that is gathered along x, around x = 25, and one that is stretched, around x = 75.
fn bands(p: DVec2) -> DVec2 {
    DVec2::new(p.x + 0.04 * hill(p.x, 25.0, 8.0) - 0.02 * hill(p.x, 75.0, 8.0), p.y)
}

#[test]
fn two_bands_are_two_spots_with_their_signs_places_and_areas() {
    let (mesh, topology, flat) = mapped(201, 61, Diagonal::Regular, bands);
    let spots = hot_spots(&mesh, &topology, &flat, None, Some(1.0));
    assert_eq!(spots.len(), 2, "{spots:?}");
    // The pattern is longer by 4 % at x = 25: the material is gathered by 1 - 1 / 1.04.
    assert_eq!(spots[0].kind, HotSpotKind::Gathered);
    assert!((spots[0].peak_percent + 100.0 * (1.0 - 1.0 / 1.04)).abs() < 0.01, "{}", spots[0].peak_percent);
    assert!((spots[0].at.xyz_mm[0] - 25.0).abs() < 0.6 && (spots[0].at.uv.unwrap()[0] - 0.25).abs() < 0.006);
    assert_eq!(spots[1].kind, HotSpotKind::Stretched);
    assert!((spots[1].peak_percent - 100.0 * (1.0 / 0.98 - 1.0)).abs() < 0.01);
    assert!((spots[1].at.xy_mm[0] - bands(DVec2::new(75.0, 0.0)).x).abs() < 0.6);
    // Above three quarters of 1 % the band of 4 % (1 - t^2)^2 is as wide as t < sqrt(1 - sqrt(0.75 / 4)), about.
    let width = 2.0 * 8.0 * (1.0 - (0.75_f64 / 4.0).sqrt()).sqrt();
    assert!((spots[0].area_mm2 / 60.0 - width).abs() < 0.8, "{} {width}", spots[0].area_mm2 / 60.0);
    assert!(spots.iter().all(|s| s.remedies.len() == 2 && !s.remedies[0].say.is_empty()));
}

#[test]
fn shear_and_growth_in_all_directions_are_told_apart() {
    let shear = |p: DVec2| DVec2::new(p.x + 0.05 * hill(p.y, 30.0, 20.0), p.y);
    let (mesh, topology, flat) = mapped(81, 61, Diagonal::Diamond, shear);
    let spots = hot_spots(&mesh, &topology, &flat, None, None);
    assert_eq!((spots.len(), spots[0].kind), (1, HotSpotKind::Sheared));
    // Simple shear by 5 %: its principal stretches differ by that.
    assert!((spots[0].peak_percent - 5.0).abs() < 0.1, "{}", spots[0].peak_percent);
    for (size, sign) in [(0.97, 1.0), (1.03, -1.0)] {
        let (mesh, topology, flat) = mapped(41, 31, Diagonal::Regular, |p| p * size);
        let spots = hot_spots(&mesh, &topology, &flat, None, None);
        assert_eq!((spots.len(), spots[0].kind), (1, HotSpotKind::Area));
        assert!((spots[0].peak_percent - 100.0 * (1.0 / (size * size) - 1.0)).abs() < 1e-9);
        assert!(spots[0].peak_percent * sign > 0.0);
        assert!((spots[0].area_mm2 - 6000.0).abs() < 1e-9, "all of it");
        assert_eq!(spots[0].at.triangle, 0);
    }
}

#[test]
fn what_is_exact_partial_or_empty_has_no_spots() {
    let (mesh, topology, flat) = mapped(21, 13, Diagonal::Regular, |p| p);
    assert_eq!(hot_spots(&mesh, &topology, &flat, None, None), []);
    assert_eq!(hot_spots(&mesh, &topology, &vec![DVec2::NAN; flat.len()], None, None), []);
    let nothing = Mesh::default();
    assert_eq!(hot_spots(&nothing, &Topology::new(&nothing).unwrap(), &[], None, None), []);
}

#[test]
fn a_torn_corner_comes_last_and_changes_no_other_spot() {
    let (mesh, topology, mut flat) = mapped(201, 121, Diagonal::Regular, bands);
    let without = hot_spots(&mesh, &topology, &flat, None, None);
    flat[0] -= DVec2::splat(0.4);
    let with = hot_spots(&mesh, &topology, &flat, None, None);
    assert_eq!(with[..2], without[..]);
    assert_eq!(with.len(), 3);
    assert!(with[2].peak_percent < -20.0 && with[2].area_mm2 < 2.0 && with[2].at.triangle < 2);
}

#[test]
fn only_the_part_counts_and_at_most_ten_are_told() {
    let waves = |p: DVec2| DVec2::new(p.x + 0.2 * (p.x * std::f64::consts::TAU / 5.0).sin(), p.y);
    let (mesh, topology, flat) = mapped(401, 21, Diagonal::Regular, waves);
    let spots = hot_spots(&mesh, &topology, &flat, None, None);
    assert_eq!(spots.len(), 10);
    let rank = |s: &HotSpot| s.peak_percent.abs() * s.area_mm2;
    assert!(spots.windows(2).all(|w| rank(&w[0]) >= rank(&w[1])));
    // A part from x = 20 to x = 26.
    let part: Vec<bool> = (0..mesh.triangles.len() as u32)
        .map(|t| (20.0..26.0).contains(&measures::centroid(measures::corners(&mesh, t)).x))
        .collect();
    let spots = hot_spots(&mesh, &topology, &flat, Some(&part), None);
    assert!(!spots.is_empty() && spots.len() < 5);
    assert!(spots.iter().all(|s| (20.0..26.0).contains(&s.at.xyz_mm[0])));
}

#[test]
fn another_mesh_of_the_same_part_shows_the_same_spots() {
    let of = |m: usize, n: usize, diagonal: Diagonal| {
        let (mesh, topology, flat) = mapped(m, n, diagonal, bands);
        hot_spots(&mesh, &topology, &flat, None, None)
    };
    let one = of(161, 41, Diagonal::Regular);
    for (m, n, diagonal) in
        [(161, 41, Diagonal::Mirrored), (233, 91, Diagonal::Diamond), (321, 81, Diagonal::ChevronRows)]
    {
        let other = of(m, n, diagonal);
        assert_eq!(one.len(), other.len());
        for (a, b) in one.iter().zip(&other) {
            assert_eq!(a.kind, b.kind);
            assert!((a.peak_percent / b.peak_percent - 1.0).abs() < 0.02, "{} {}", a.peak_percent, b.peak_percent);
            assert!((a.area_mm2 / b.area_mm2 - 1.0).abs() < 0.15, "{} {}", a.area_mm2, b.area_mm2);
            assert!((a.at.xyz_mm[0] - b.at.xyz_mm[0]).abs() < 1.0);
        }
    }
}

proptest! {
    #[test]
    fn where_the_pattern_lies_does_not_matter(angle in 0.0..6.3_f64, x in -50.0..50.0_f64) {
        let turn = DVec2::from_angle(angle);
        let (mesh, topology, flat) = mapped(81, 21, Diagonal::Regular, bands);
        let moved: Vec<DVec2> = flat.iter().map(|p| turn.rotate(*p) + DVec2::splat(x)).collect();
        let (one, two) = (
            hot_spots(&mesh, &topology, &flat, None, Some(1.0)),
            hot_spots(&mesh, &topology, &moved, None, Some(1.0)),
        );
        prop_assert_eq!(one.len(), two.len());
        for (a, b) in one.iter().zip(&two) {
            prop_assert_eq!(a.kind, b.kind);
            prop_assert!((a.peak_percent - b.peak_percent).abs() < 1e-9);
            prop_assert!((a.area_mm2 - b.area_mm2).abs() < 1e-9);
            prop_assert_eq!(a.at.triangle, b.at.triangle);
        }
    }
}
