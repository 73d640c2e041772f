//! Closed forms, random surfaces and scale for [`super::plan`].

use std::f64::consts::PI;

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::engine::budget::Unobserved;
use crate::engine::nurbs::{KnotVector, shapes};
use crate::engine::triangulation::{grid_mesh, lift, sampled_chord_error};

fn input(surface: &Surface, density: Density) -> DensityInput<'_> {
    let [low, high] = surface.bounding_box();
    DensityInput {
        surface,
        region: None,
        diagonal: low.distance(high),
        density,
        configuration: Configuration::Regular,
        limits: DensityLimits::default(),
    }
}

fn planned(surface: &Surface, density: Density) -> GridLines {
    plan(&input(surface, density), &Unobserved).expect("a plan")
}

/// Greatest sampled distance of the grid's mesh to the surface.
fn distance(surface: &Surface, lines: &GridLines) -> f64 {
    let lifted = lift(surface, grid_mesh(lines, Configuration::Regular, 0), lines);
    sampled_chord_error(surface, &lifted)
}

#[test]
fn a_plane_has_one_cell() {
    let lines = planned(&shapes::plane(30.0, 20.0), Density::Chord(1e-6));
    assert_eq!((lines.u.len(), lines.v.len()), (2, 2));
}

#[test]
fn a_cylinder_has_lines_along_its_curved_direction_only_and_as_many_as_the_closed_form() {
    let radius = 10.0;
    let surface = shapes::cylinder(radius, 40.0);
    for tolerance in [1.0, 0.1, 0.01, 1e-3, 1e-5] {
        let lines = planned(&surface, Density::Chord(tolerance));
        let mut counts = [lines.u.len() - 1, lines.v.len() - 1];
        counts.sort_unstable();
        assert_eq!(counts[0], 1, "{tolerance}");
        // A chord of angle h leaves the circle by R (1 - cos(h / 2)).
        let least = (PI / (1.0 - tolerance / radius).acos()).ceil();
        let cells = counts[1] as f64;
        assert!(cells >= least && cells <= 1.12 * least + 3.0, "{tolerance}: {cells} cells where {least} do");
        assert!(distance(&surface, &lines) <= tolerance * 1.02);
    }
}

#[test]
fn a_sphere_and_a_torus_are_met_closely() {
    for (surface, size) in [(shapes::sphere(5.0), 5.0), (shapes::torus(20.0, 5.0), 5.0)] {
        for share in [0.02, 1e-3, 1e-4] {
            let lines = planned(&surface, Density::Chord(share * size));
            let found = distance(&surface, &lines) / (share * size);
            assert!(found <= 1.02 && found > 0.6, "{share}: {found}");
        }
    }
}

#[test]
fn edges_are_no_longer_than_asked() {
    let surface = shapes::torus(20.0, 5.0);
    let lines = planned(&surface, Density::Edge(2.0));
    let used = check::worst(&surface, &lines.u, &lines.v, Aim::Edge(2.0), Diagonals::Rising, &|_, _| false);
    assert!(used <= 1.0 && used > 0.5, "{used}");
}

#[test]
fn the_mesh_area_is_within_the_tolerance_of_the_surface_area() {
    let surface = shapes::torus(20.0, 5.0);
    let exact = 4.0 * PI * PI * 20.0 * 5.0;
    for share in [1e-2, 1e-3, 1e-4] {
        let lines = planned(&surface, Density::AreaRelative(share));
        let area = check::mesh_area(&surface, &lines.u, &lines.v, Diagonals::Rising);
        let missing = (exact - area).abs() / (exact * share);
        assert!(missing <= 1.0 && missing > 0.5, "{share}: {missing}");
    }
}

#[test]
fn a_density_beyond_the_limit_is_refused_before_anything_is_made() {
    let surface = shapes::sphere(5.0);
    for tolerance in [1e-9, 1e-30, 1e-300] {
        let failed = plan(&input(&surface, Density::Chord(tolerance)), &Unobserved);
        assert!(
            matches!(failed, Err(EngineError::Triangulation(TriangulationError::TooManyTriangles { limit, .. })) if limit == MAX_TRIANGLES),
            "{failed:?}"
        );
    }
}

#[test]
fn a_clamp_brings_the_number_of_triangles_into_its_range() {
    for surface in
        [shapes::plane(30.0, 20.0), shapes::cylinder(3.0, 50.0), shapes::sphere(5.0), shapes::torus(9.0, 2.0)]
    {
        for share in [0.1, 1e-2, 1e-3, 1e-5, 1e-8] {
            let mut input = input(&surface, Density::ChordRelative(share));
            input.limits.clamp = Some((200, 7000));
            let lines = plan(&input, &Unobserved).expect("a plan");
            let triangles = 2 * (lines.u.len() - 1) * (lines.v.len() - 1);
            assert!((200..=7000).contains(&triangles), "{share}: {triangles} of {lines:?}");
        }
    }
}

#[test]
fn the_lines_do_not_depend_on_size_or_place() {
    let surface = shapes::torus(20.0, 5.0);
    let reference = planned(&surface, Density::ChordRelative(1e-3));
    for factor in [1e-3, 1e5] {
        let other = planned(&surface.scaled(factor), Density::ChordRelative(1e-3));
        assert_eq!((other.u.len(), other.v.len()), (reference.u.len(), reference.v.len()));
    }
    let far = planned(&surface.translated(DVec3::new(1e6, -2e6, 5e5)), Density::ChordRelative(1e-3));
    let (near, away) = ((reference.u.len() * reference.v.len()) as f64, (far.u.len() * far.v.len()) as f64);
    assert!((away / near - 1.0).abs() < 0.05, "{near} {away}");
}

#[test]
fn a_fine_polyline_does_not_make_a_line_of_every_point() {
    // An arc of radius 10 sampled at 2001 points, as a surface of degree 1.
    let n = 2001;
    let mut knots = vec![0.0];
    knots.extend((0..n).map(|k| f64::from(k) / f64::from(n - 1)));
    knots.push(1.0);
    let control = (0..n)
        .flat_map(|k| {
            let angle = PI * f64::from(k) / f64::from(n - 1);
            [0.0, 5.0].map(|z| DVec3::new(10.0 * angle.cos(), 10.0 * angle.sin(), z))
        })
        .collect();
    let surface = Surface::new(
        KnotVector::new(1, knots, "knots_u").unwrap(),
        KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0], "knots_v").unwrap(),
        control,
        None,
    )
    .unwrap();
    let lines = planned(&surface, Density::Chord(0.01));
    assert!(lines.u.len() < 60, "{}", lines.u.len());
    assert!(distance(&surface, &lines) <= 0.0101);
    // An edge that is meant stays one.
    let roof = Surface::new(
        KnotVector::new(1, vec![0.0, 0.0, 0.4, 1.0, 1.0], "knots_u").unwrap(),
        KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0], "knots_v").unwrap(),
        vec![
            DVec3::ZERO,
            DVec3::Y,
            DVec3::new(1.0, 0.0, 1.0),
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::X * 2.0,
            DVec3::new(2.0, 1.0, 0.0),
        ],
        None,
    )
    .unwrap();
    assert_eq!(planned(&roof, Density::Chord(0.01)).u, vec![0.0, 0.4, 1.0]);
}

fn bicubic() -> impl Strategy<Value = Surface> {
    proptest::collection::vec(-1.0..1.0_f64, 64).prop_map(|heights| {
        let knots = || {
            let inner = [1.0, 2.0, 3.5, 4.0];
            let values = [0.0; 4].into_iter().chain(inner).chain([5.0; 4]).collect();
            KnotVector::new(3, values, "knots").unwrap()
        };
        let control = (0..8)
            .flat_map(|i| (0..8).map(move |j| (i, j)))
            .zip(heights)
            .map(|((i, j), z)| DVec3::new(f64::from(i), f64::from(j), z))
            .collect();
        Surface::new(knots(), knots(), control, None).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn random_bicubics_stay_within_the_tolerance(surface in bicubic(), exponent in 1.0..3.0_f64) {
        let tolerance = 10.0_f64.powf(-exponent);
        let lines = planned(&surface, Density::Chord(tolerance));
        let found = distance(&surface, &lines) / tolerance;
        // The plan judges some of its cells and foretells the rest: on rough nets some are off by a few hundredths (1.057 was
        // seen). The report gives what was sampled.
        prop_assert!(found <= 1.1, "{} of the tolerance {}", found, tolerance);
        prop_assert!(lines.u.windows(2).all(|w| w[0] < w[1]) && lines.v.windows(2).all(|w| w[0] < w[1]));
        prop_assert_eq!((lines.u[0], lines.u[lines.u.len() - 1]), (0.0, 5.0));
    }
}

/// A hyperbolic paraboloid of straight lines: `width` long along u, `depth` along v, one end turned by `turn`.
fn twisted_strip(width: f64, depth: f64, turn: f64) -> Surface {
    let line = || KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0], "knots").unwrap();
    let end = |x: f64, angle: f64| {
        let half = 0.5 * depth * DVec3::new(0.0, angle.cos(), angle.sin());
        [DVec3::X * x - half, DVec3::X * x + half]
    };
    let control = [end(0.0, 0.0), end(width, turn)].concat();
    Surface::new(line(), line(), control, None).unwrap()
}

/// Like a rim: a narrow, ruled, twisted strip whose spine bends (degree 3 x 1).
fn ruled_rim(flare: f64) -> Surface {
    let control = (0..4)
        .flat_map(|k| {
            let along = f64::from(k) / 3.0;
            let spine = DVec3::new(8.0 * along, 3.0 * along * (1.0 - along), 0.0);
            let ruling = DVec3::new(0.0, 2.0 * (flare * along).cos(), 2.0 * (flare * along).sin());
            [spine, spine + ruling]
        })
        .collect();
    Surface::new(
        KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], "knots_u").unwrap(),
        KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0], "knots_v").unwrap(),
        control,
        None,
    )
    .unwrap()
}

#[test]
fn twisted_surfaces_of_straight_lines_are_divided_both_ways_and_their_area_converges() {
    for surface in [twisted_strip(10.0, 1.0, 1.5), twisted_strip(3.0, 3.0, 1.0), ruled_rim(1.5), ruled_rim(-2.5)] {
        let pieces: Vec<f64> = (0..=32).map(|k| f64::from(k) / 32.0).collect();
        let exact = check::surface_area(&surface, &pieces, &pieces);
        let mut former = f64::INFINITY;
        for share in [1e-4, 1e-5, 1e-6] {
            let lines = planned(&surface, Density::ChordRelative(share));
            let area = check::mesh_area(&surface, &lines.u, &lines.v, Diagonals::Rising);
            let off = ((area - exact) / exact).abs();
            assert!(
                off < 20.0 * share && off < 0.5 * former,
                "{share}: {off} with {:?}",
                (lines.u.len(), lines.v.len())
            );
            former = off;
            assert!(share > 2e-5 || lines.u.len().min(lines.v.len()) > 3, "{:?}", (lines.u.len(), lines.v.len()));
        }
    }
}

#[test]
fn a_flat_ring_keeps_its_borders_and_its_area() {
    // The middle of each cell lies in the ring's plane, however far its border's chord is from the border.
    let ring = {
        let tube = shapes::cylinder(10.0, 1.0);
        let control = tube.control().iter().map(|p| DVec3::new(p.x, p.y, 0.0) * (1.0 + 0.05 * p.z)).collect();
        Surface::new(tube.knots_u().clone(), tube.knots_v().clone(), control, tube.weights().map(<[f64]>::to_vec))
            .unwrap()
    };
    let exact = PI * (10.5_f64.powi(2) - 10.0_f64.powi(2));
    for tolerance in [0.1, 1e-2, 1e-3, 1e-4] {
        let lines = planned(&ring, Density::Chord(tolerance));
        let area = check::mesh_area(&ring, &lines.u, &lines.v, Diagonals::Rising);
        // A chord's segment of sagitta s has the area 2/3 s l; the inner circle's makes up for a part of the outer one's.
        let allowed = 8.0 / 3.0 * PI * (10.5 - 10.0) * tolerance;
        assert!((area - exact).abs() <= allowed, "{tolerance}: {area} of {exact}");
        assert!(lines.u.len().min(lines.v.len()) == 2, "{:?}", (lines.u.len(), lines.v.len()));
    }
}
