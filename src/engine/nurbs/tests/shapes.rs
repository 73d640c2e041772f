//! Exact shapes for tests: planes, cylinders, spheres, tori, circles, and random surfaces.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use crate::engine::nurbs::{Curve2, KnotVector, Surface};

/// Knots that do for a test.
pub(crate) fn knots(degree: usize, values: &[f64]) -> KnotVector {
    KnotVector::new(degree, values.to_vec(), "knots").expect("valid knots")
}

/// A full circle of nine points: knots over [0, 4], a quarter a span, anticlockwise from +x.
fn circle() -> (KnotVector, Vec<(DVec2, f64)>) {
    let knots = knots(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0]);
    let points = (0..9)
        .map(|k| {
            let (sin, cos) = (f64::from(k) * PI / 4.0).sin_cos();
            if k % 2 == 0 { (DVec2::new(cos, sin), 1.0) } else { (DVec2::new(cos, sin) / FRAC_1_SQRT_2, FRAC_1_SQRT_2) }
        })
        .collect();
    (knots, points)
}

/// A circle in the plane, anticlockwise.
pub(crate) fn circle2(centre: DVec2, radius: f64) -> Curve2 {
    let (knots, points) = circle();
    let control = points.iter().map(|(p, _)| centre + *p * radius).collect();
    Curve2::new(knots, control, Some(points.iter().map(|p| p.1).collect())).expect("a circle")
}

/// A rectangle `width x height` over [0, 1]^2 in the plane z = 0, normal +z.
pub(crate) fn plane(width: f64, height: f64) -> Surface {
    let line = knots(1, &[0.0, 0.0, 1.0, 1.0]);
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    Surface::new(line.clone(), line, vec![at(0.0, 0.0), at(0.0, height), at(width, 0.0), at(width, height)], None)
        .expect("a plane")
}

/// The surface of revolution about z of a profile in the (r, z) half plane: u around (over [0, 4]), v along the profile.
pub(crate) fn revolved(profile_knots: KnotVector, profile: &[(DVec2, f64)]) -> Surface {
    let (around, circle) = circle();
    let mut control = Vec::new();
    let mut weights = Vec::new();
    for (c, wc) in &circle {
        for (p, wp) in profile {
            control.push(DVec3::new(c.x * p.x, c.y * p.x, p.y));
            weights.push(wc * wp);
        }
    }
    Surface::new(around, profile_knots, control, Some(weights)).expect("a surface of revolution")
}

/// A full cylinder about z, u around, v up over [0, 1], normal outwards.
pub(crate) fn cylinder(radius: f64, height: f64) -> Surface {
    let profile = [(DVec2::new(radius, 0.0), 1.0), (DVec2::new(radius, height), 1.0)];
    revolved(knots(1, &[0.0, 0.0, 1.0, 1.0]), &profile)
}

/// A full sphere about the origin with poles at the ends of v, normal outwards.
pub(crate) fn sphere(radius: f64) -> Surface {
    let w = FRAC_1_SQRT_2;
    let at = |r: f64, z: f64| DVec2::new(r, z) * radius;
    let profile =
        [(at(0.0, -1.0), 1.0), (at(1.0, -1.0), w), (at(1.0, 0.0), 1.0), (at(1.0, 1.0), w), (at(0.0, 1.0), 1.0)];
    revolved(knots(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0]), &profile)
}

/// A full torus about z, normal outwards.
pub(crate) fn torus(major: f64, minor: f64) -> Surface {
    let (knots, circle) = circle();
    let profile: Vec<_> = circle.iter().map(|(p, w)| (DVec2::new(major, 0.0) + *p * minor, *w)).collect();
    revolved(knots, &profile)
}

/// Knots of a degree: clamped or not, repeated or not, over any domain.
pub(crate) fn any_knots(degree: usize) -> impl Strategy<Value = KnotVector> {
    let interior = proptest::collection::vec((0.05..1.0_f64, 1..=degree), 0..5);
    (interior, any::<bool>(), -20.0..20.0_f64, 0.1..50.0_f64).prop_map(move |(interior, clamped, start, scale)| {
        let mut values = Vec::new();
        let mut t = 0.0;
        for k in 0..=degree {
            values.push(if clamped { 0.0 } else { -0.3 * (degree - k) as f64 });
        }
        for (step, times) in interior {
            t += step;
            values.extend(std::iter::repeat_n(t, times));
        }
        t += 0.5;
        for k in 0..=degree {
            values.push(if clamped { t } else { t + 0.2 * k as f64 });
        }
        KnotVector::new(degree, values.iter().map(|k| start + scale * k).collect(), "knots").expect("valid knots")
    })
}

/// Any surface of moderate shape: degrees 1 to `most`, rational or not.
pub(crate) fn any_surface(most: usize) -> impl Strategy<Value = Surface> {
    (1..=most, 1..=most).prop_flat_map(|(p, q)| (any_knots(p), any_knots(q))).prop_flat_map(|(ku, kv)| {
        let count = ku.control_count() * kv.control_count();
        let control = proptest::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64, -5.0..5.0_f64), count);
        let weights = proptest::option::of(proptest::collection::vec(0.3..3.0_f64, count));
        (control, weights).prop_map(move |(control, weights)| {
            let control = control.into_iter().map(DVec3::from).collect();
            Surface::new(ku.clone(), kv.clone(), control, weights).expect("a valid surface")
        })
    })
}
