//! Closed forms, random developables, and the real faces.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use crate::engine::budget::Unobserved;
use crate::engine::nurbs::shapes::{cylinder, knots, plane, revolved, sphere, torus};
use crate::engine::nurbs::{KnotVector, integrate};
use crate::engine::trimming::tests::samples::real_faces;
use crate::engine::trimming::{BoundaryLoop, TrimmedSurface};

/// What "exact" means: far above rounding, far below everything that can be measured on a part.
const EXACT: f64 = 1e-10;

fn unrolled(surface: &Surface) -> Option<Unrolled> {
    unroll(surface, surface.domain(), DEVELOPABLE_STRAIN, &Unobserved).unwrap()
}

fn line(degree: usize) -> KnotVector {
    let mut values = vec![0.0; degree + 1];
    values.resize(2 * degree + 2, 1.0);
    knots(degree, &values)
}

/// Greatest difference between distances in the plane and those of `flat`, over pairs of points of a grid of the domain.
fn misfit(unrolled: &Unrolled, surface: &Surface, flat: impl Fn(DVec2) -> DVec2) -> f64 {
    let Domain { u, v } = surface.domain();
    let places: Vec<DVec2> = (0..121_i32)
        .map(|k| DVec2::new(f64::from(k % 11) / 10.0, f64::from(k / 11) / 10.0))
        .map(|x| DVec2::new(u[0] + (u[1] - u[0]) * x.x, v[0] + (v[1] - v[0]) * x.y))
        .collect();
    let mut worst = 0.0_f64;
    for &p in &places {
        for &q in &places {
            worst = worst.max((unrolled.map(p).distance(unrolled.map(q)) - flat(p).distance(flat(q))).abs());
        }
    }
    worst
}

#[test]
fn a_plane_keeps_all_its_distances_however_its_parameters_run() {
    let surface = plane(4.0, 3.0);
    let flat = unrolled(&surface).expect("a plane");
    assert_eq!(flat.kind(), DevelopableKind::Plane);
    assert!(misfit(&flat, &surface, |uv| uv * DVec2::new(4.0, 3.0)) < 1e-14);
    // A quadrangle, a triangle with a degenerate edge, and a bent net in the plane.
    let quadrangle = [DVec2::ZERO, DVec2::new(0.5, 2.0), DVec2::new(3.0, -0.5), DVec2::new(4.0, 3.0)];
    let triangle = [DVec2::ZERO, DVec2::ZERO, DVec2::new(3.0, -0.5), DVec2::new(4.0, 3.0)];
    for net in [quadrangle, triangle] {
        let control = net.iter().map(|p| DVec3::new(p.x, 1.0, p.y)).collect();
        let surface = Surface::new(line(1), line(1), control, None).unwrap();
        let flat = unrolled(&surface).expect("a plane");
        assert!(flat.strain() < EXACT, "{:e}", flat.strain());
        let exact = |uv: DVec2| {
            let p = surface.point(uv.x, uv.y);
            DVec2::new(p.x, p.z)
        };
        assert!(misfit(&flat, &surface, exact) < 1e-13);
    }
}

#[test]
fn a_cylinder_becomes_its_rectangle_and_is_cut_at_its_seam() {
    for (radius, height) in [(3.0, 7.0), (1e-3, 50.0), (4e5, 2.0)] {
        let surface = cylinder(radius, height);
        for (surface, swapped) in [(surface.clone(), false), (surface.swapped(), true)] {
            let flat = unrolled(&surface).expect("a cylinder");
            assert_eq!(flat.kind(), DevelopableKind::Cylinder);
            assert!(flat.strain() < EXACT, "{:e}", flat.strain());
            let at = |u: f64, v: f64| flat.map(if swapped { DVec2::new(v, u) } else { DVec2::new(u, v) });
            let size = radius.max(height);
            assert!((at(0.0, 0.0).distance(at(4.0, 0.0)) - 2.0 * PI * radius).abs() < 1e-11 * size);
            assert!((at(0.0, 0.0).distance(at(0.0, 1.0)) - height).abs() < 1e-11 * size);
            let diagonal = (2.0 * PI * radius).hypot(height);
            assert!((at(0.0, 0.0).distance(at(4.0, 1.0)) - diagonal).abs() < 1e-11 * size);
            // The orientation of (u, v) is kept.
            let [fu, fv] = flat.jacobian(DVec2::new(0.5, 0.5));
            assert!(fu.perp_dot(fv) > 0.0);
        }
    }
}

#[test]
fn a_cone_becomes_its_sector_up_to_its_apex() {
    let profile = [(DVec2::new(3.0, 0.0), 1.0), (DVec2::new(0.0, 4.0), 1.0)];
    let cone = revolved(line(1), &profile);
    let flat = unrolled(&cone).expect("a cone");
    assert_eq!(flat.kind(), DevelopableKind::Cone);
    assert!(flat.strain() < EXACT, "{:e}", flat.strain());
    let apex = flat.map(DVec2::new(0.0, 1.0));
    for k in 0..=40 {
        let u = f64::from(k) / 10.0;
        assert!(flat.map(DVec2::new(u, 1.0)).distance(apex) < 1e-12, "the apex is one point");
        assert!((flat.map(DVec2::new(u, 0.0)).distance(apex) - 5.0).abs() < 1e-12);
    }
    // The sector's angle is 2 pi 3/5: its chord is as long as that.
    let chord = flat.map(DVec2::ZERO).distance(flat.map(DVec2::new(4.0, 0.0)));
    assert!((chord - 2.0 * 5.0 * (PI * 3.0 / 5.0).sin()).abs() < 1e-11);
}

/// The tangent surface of the twisted cubic (t, t^2, t^3), from its edge of regression or from a little beyond it.
fn tangents(from: f64) -> Surface {
    // Bezier points of c(t) + s (1, 2 t, 3 t^2), for s = `from` and s = `from` + 1.
    let ends = [from, from + 1.0].map(|s| {
        let power = [DVec3::new(s, 0.0, 0.0), DVec3::new(1.0, 2.0 * s, 0.0), DVec3::new(0.0, 1.0, 3.0 * s), DVec3::Z];
        [
            power[0],
            power[0] + power[1] / 3.0,
            power[0] + power[1] * (2.0 / 3.0) + power[2] / 3.0,
            power[0] + power[1] + power[2] + power[3],
        ]
    });
    let control = (0..4).flat_map(|i| [ends[0][i], ends[1][i]]).collect();
    Surface::new(line(3), line(1), control, None).unwrap()
}

#[test]
fn a_tangent_developable_unrolls_with_the_lengths_of_its_curves() {
    for from in [0.25, 0.0] {
        let surface = tangents(from);
        let flat = unrolled(&surface).expect("a tangent developable");
        assert_eq!(flat.kind(), DevelopableKind::General);
        assert!(flat.strain() < EXACT, "{from}: {:e}", flat.strain());
        // A curve across the rulings has its length. Its points in the plane are summed up as chords of many parts, with
        // one step of extrapolation.
        let curve = |t: f64| DVec2::new(t, 0.2 + 0.6 * t * t);
        let speed = |t: f64| {
            let p = curve(t);
            let (_, su, sv) = surface.first_derivatives(p.x, p.y);
            (su + sv * (1.2 * t)).length()
        };
        let exact = integrate(&speed, 0.0, 1.0, 1e-13, 12);
        let chords = |n: u32| -> f64 {
            let at = |k: u32| flat.map(curve(f64::from(k) / f64::from(n)));
            (0..n).map(|k| at(k).distance(at(k + 1))).sum()
        };
        let length = (4.0 * chords(4000) - chords(2000)) / 3.0;
        assert!((length - exact).abs() < 1e-9 * exact, "{length} {exact}");
    }
}

/// A parabolic cylinder (x, y, x^2 / 2) whose rulings are no parameter lines: x and y are bilinear in (u, v).
fn skewed() -> Surface {
    let x = [[0.0, 0.7], [1.1, 2.0]];
    let y = [[0.0, 1.3], [-0.4, 0.8]];
    // Bezier points of degree 2 x 2 of f g for bilinear f, g: the polar form.
    let mixed = |f: &[[f64; 2]; 2], g: &[[f64; 2]; 2], i: usize, j: usize| {
        let halves = |k: usize| if k == 1 { vec![(0, 1), (1, 0)] } else { vec![(k / 2, k / 2)] };
        let (a, b) = (halves(i), halves(j));
        let sum: f64 =
            a.iter().flat_map(|p| b.iter().map(move |q| (p, q))).map(|(p, q)| f[p.0][q.0] * g[p.1][q.1]).sum();
        sum / (a.len() * b.len()) as f64
    };
    let one = [[1.0; 2]; 2];
    let control = (0..9)
        .map(|k| {
            let (i, j) = (k / 3, k % 3);
            DVec3::new(mixed(&x, &one, i, j), mixed(&y, &one, i, j), 0.5 * mixed(&x, &x, i, j))
        })
        .collect();
    Surface::new(line(2), line(2), control, None).unwrap()
}

#[test]
fn rulings_need_not_be_parameter_lines() {
    let surface = skewed();
    let flat = unrolled(&surface).expect("a cylinder");
    assert_eq!(flat.kind(), DevelopableKind::Cylinder);
    assert!(flat.strain() < EXACT, "{:e}", flat.strain());
    let arc = |x: f64| 0.5 * (x * (1.0 + x * x).sqrt() + x.asinh());
    let exact = |uv: DVec2| {
        let p = surface.point(uv.x, uv.y);
        assert!((p.z - 0.5 * p.x * p.x).abs() < 1e-14);
        DVec2::new(arc(p.x), p.y)
    };
    assert!(misfit(&flat, &surface, exact) < 1e-12);
}

/// A vertical quarter cylinder of height 1, and on its upper rim a ring that spreads by `spread` and rises by `rise`.
fn rimmed(spread: f64, rise: f64) -> Surface {
    let w = std::f64::consts::FRAC_1_SQRT_2;
    let rows = [(1.0, 0.0), (1.0, 1.0), (1.0 + spread, 1.0 + rise)];
    let corners = [DVec2::X, DVec2::ONE, DVec2::Y];
    let control = corners.iter().flat_map(|c| rows.map(|(r, z)| (*c * r).extend(z))).collect();
    let weights = [1.0, w, 1.0].iter().flat_map(|&w| [w; 3]).collect();
    Surface::new(line(2), knots(1, &[0.0, 0.0, 1.0, 2.0, 2.0]), control, Some(weights)).unwrap()
}

#[test]
fn a_fold_along_a_ruling_stays_and_a_fold_along_a_curve_is_refused() {
    // A roof of two planes.
    let control = [[0.0, 0.0], [2.0, 1.5], [4.0, 0.0]];
    let control = control.iter().flat_map(|&[x, z]| [DVec3::new(x, 0.0, z), DVec3::new(x, 5.0, z)]).collect();
    let roof = Surface::new(knots(1, &[0.0, 0.0, 1.0, 2.0, 2.0]), line(1), control, None).unwrap();
    let flat = unrolled(&roof).expect("two planes");
    assert!(misfit(&flat, &roof, |uv| uv * DVec2::new(2.5, 5.0)) < 1e-13);
    assert!(unrolled(&rimmed(0.0, 1.0)).is_some(), "the cylinder goes on");
    assert_eq!(unrolled(&rimmed(0.5, 0.0)), None, "a flat ring does not lie beside a cylinder");
}

#[test]
fn what_is_curved_twice_is_not_unrolled() {
    for surface in [sphere(2.0), torus(5.0, 2.0), rimmed(0.3, 1.0)] {
        assert_eq!(unrolled(&surface), None);
    }
    // A hyperbolic paraboloid that is ever so slightly twisted: a ruled surface that is not developable.
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let twisted = |z: f64| {
        let control = vec![at(0.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(1.0, 0.0, 0.0), at(1.0, 1.0, z)];
        Surface::new(line(1), line(1), control, None).unwrap()
    };
    assert_eq!(unrolled(&twisted(0.02)), None);
    assert!(unrolled(&twisted(0.0)).is_some());
    // Its strain grows with the square of the twist, and what is reported is what is there.
    let slight = unrolled(&twisted(1e-3)).expect("almost a plane");
    assert!(slight.strain() > 1e-9 && slight.strain() < DEVELOPABLE_STRAIN, "{:e}", slight.strain());
}

#[test]
fn a_window_is_judged_by_itself() {
    // The lower half of a surface that is a cylinder below and spreads above.
    let surface = rimmed(0.3, 1.0);
    let window = Domain { u: [0.0, 1.0], v: [0.0, 0.9] };
    let flat = unroll(&surface, window, DEVELOPABLE_STRAIN, &Unobserved).unwrap().expect("a cylinder");
    assert!(flat.strain() < EXACT);
    let empty = Domain { u: [0.5, 0.5], v: [0.0, 1.0] };
    assert_eq!(unroll(&surface, empty, DEVELOPABLE_STRAIN, &Unobserved).unwrap(), None);
}

/// Wants nothing any more.
struct Cancelled;

impl Observer for Cancelled {
    fn is_cancelled(&self) -> bool {
        true
    }
}

#[test]
fn a_cancelled_job_stops() {
    let surface = cylinder(1.0, 1.0);
    assert_eq!(unroll(&surface, surface.domain(), 1e-6, &Cancelled), Err(EngineError::Cancelled));
}

/// The box of a face's loops, with the face moved to the origin.
fn centred(face: &TrimmedSurface) -> (Surface, Domain) {
    let [low, high] = face.surface.bounding_box();
    let region = face.check().unwrap().polygonise(&face.surface, 1e-3 * low.distance(high)).unwrap();
    let points = || region.loops.iter().flat_map(|l: &BoundaryLoop| l.points.iter().copied());
    let (a, b) = (points().reduce(DVec2::min).unwrap(), points().reduce(DVec2::max).unwrap());
    (face.surface.translated(-low.midpoint(high)), Domain { u: [a.x, b.x], v: [a.y, b.y] })
}

#[test]
fn every_developable_real_face_is_recognised_and_unrolled_on_its_surface() {
    let faces = real_faces();
    if faces.is_empty() {
        return;
    }
    // These are curved a little: their strain is their own, and below the tolerance.
    let almost = ["bearing_iges_f199", "bottle_brep_f001"];
    let mut counts = [0; 4];
    for (name, face, extra) in faces {
        let (surface, window) = centred(&face);
        let flat = unroll(&surface, window, DEVELOPABLE_STRAIN, &Unobserved).unwrap();
        let tags = extra["tags"].to_string();
        let kind = extra["orig_type"].as_str().unwrap_or_default();
        let expected = ["Plane", "Cylinder", "Cone"].contains(&kind)
            || tags.contains("\"developable\"")
            || tags.contains("flat_bilinear")
            || almost.contains(&name.as_str());
        assert_eq!(flat.is_some(), expected, "{name} ({kind}, {tags})");
        let Some(flat) = flat else { continue };
        let allowed = if almost.contains(&name.as_str()) { DEVELOPABLE_STRAIN } else { EXACT };
        assert!(flat.strain() < allowed, "{name}: {:e}", flat.strain());
        match kind {
            "Plane" => assert_eq!(flat.kind(), DevelopableKind::Plane, "{name}"),
            "Cylinder" => assert_eq!(flat.kind(), DevelopableKind::Cylinder, "{name}"),
            "Cone" => assert_eq!(flat.kind(), DevelopableKind::Cone, "{name}"),
            _ => {}
        }
        counts[flat.kind() as usize] += 1;
    }
    assert_eq!(counts.iter().sum::<i32>(), 35, "{counts:?}");
}

proptest! {
    #[test]
    fn any_general_cylinder_unrolls_to_the_arc_length_of_its_profile(
        steps in proptest::collection::vec((0.3..1.0_f64, -0.6..0.6_f64), 6),
        angles in (0.0..6.0_f64, -1.5..1.5_f64, 0.0..6.0_f64),
        scale in -6.0..6.0_f64,
        slope in -0.5..0.5_f64,
    ) {
        let scale = 10.0_f64.powf(scale);
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, angles.0, angles.1, angles.2);
        let mut at = DVec2::ZERO;
        let mut profile = vec![at];
        for (x, y) in steps {
            at += DVec2::new(x, y);
            profile.push(at);
        }
        let ruling = DVec3::new(0.2, 0.1, 1.5);
        let net = |p: &DVec2, far: bool| turn * (p.extend(slope * p.x) + if far { ruling } else { DVec3::ZERO }) * scale;
        let control = profile.iter().flat_map(|p| [net(p, false), net(p, true)]).collect();
        let around = knots(3, &[0.0, 0.0, 0.0, 0.0, 0.2, 0.5, 0.7, 1.0, 1.0, 1.0, 1.0]);
        let surface = Surface::new(around, line(1), control, None).unwrap();
        let flat = unrolled(&surface).expect("a cylinder");
        prop_assert!(flat.strain() < EXACT, "{:e}", flat.strain());
        // Across the rulings, points are as far apart as the profile is long in that direction.
        let along = (turn * ruling).normalize();
        let speed = |t: f64| {
            let (_, su, _) = surface.first_derivatives(t, 0.0);
            (su - along * su.dot(along)).length()
        };
        let breaks = [0.0, 0.2, 0.5, 0.7, 1.0];
        let width: f64 = breaks.windows(2).map(|w| integrate(&speed, w[0], w[1], 1e-13, 12)).sum();
        let height = (surface.point(1.0, 0.0) - surface.point(0.0, 0.0)).dot(along);
        let found = flat.map(DVec2::ZERO).distance(flat.map(DVec2::X));
        prop_assert!((found - width.hypot(height)).abs() < 1e-10 * found, "{found} {}", width.hypot(height));
    }

    #[test]
    fn the_map_has_no_step_between_panels(t in 0.0..4.0_f64, v in 0.0..1.0_f64) {
        let flat = unrolled(&cylinder(3.0, 7.0)).expect("a cylinder");
        let step = 1e-9;
        let near = flat.map(DVec2::new(t, v)).distance(flat.map(DVec2::new((t + step).min(4.0), v)));
        prop_assert!(near < 2.0 * 3.0 * PI * step);
    }
}
