//! Random loops: area, orientation and nesting.

use glam::DVec2;
use proptest::prelude::*;

use super::samples::{backwards, polygon, square, trimmed};
use crate::engine::trimming::Containment;

/// Corners of a star about a centre.
fn star(centre: DVec2, radii: &[f64]) -> Vec<[f64; 2]> {
    let step = std::f64::consts::TAU / radii.len() as f64;
    radii.iter().enumerate().map(|(i, r)| (centre + DVec2::from_angle(step * i as f64) * *r).to_array()).collect()
}

fn area(points: &[[f64; 2]]) -> f64 {
    (0..points.len())
        .map(|i| {
            let (a, b) = (points[i], points[(i + 1) % points.len()]);
            0.5 * (a[0] * b[1] - a[1] * b[0])
        })
        .sum()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn nested_stars_have_their_area_orientation_and_depth(
        outer in prop::collection::vec(0.25..0.45_f64, 3..40),
        middle in prop::collection::vec(0.3..0.9_f64, 5..30),
        inner in prop::collection::vec(0.3..0.9_f64, 5..20),
        flips in 0_u8..8,
        order in 0_usize..6,
    ) {
        let centre = DVec2::splat(0.5);
        // Each star lies in the circle that the one around it cannot enter.
        let within = |radii: &[f64]| {
            let least = radii.iter().fold(f64::INFINITY, |m, r| m.min(*r));
            least * (std::f64::consts::PI / radii.len() as f64).cos()
        };
        let scale = |radii: &[f64], by: f64| radii.iter().map(|r| r * by).collect::<Vec<_>>();
        let middle = scale(&middle, within(&outer));
        let inner = scale(&inner, within(&middle));
        let stars = [star(centre, &outer), star(centre, &middle), star(centre, &inner)];
        let permutation = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]][order];
        let loops = permutation
            .iter()
            .map(|&k| if flips & (1 << k) == 0 { polygon(&stars[k]) } else { backwards(polygon(&stars[k])) })
            .collect();
        let face = trimmed(square(0.0, 50.0), loops);
        let region = face.check().unwrap().polygonise(&face.surface, 0.01).unwrap();
        let exact = area(&stars[0]) - area(&stars[1]) + area(&stars[2]);
        prop_assert!((region.area() - exact).abs() < 1e-13);
        for (l, &k) in region.loops.iter().zip(&permutation) {
            prop_assert_eq!(l.depth as usize, k);
            prop_assert_eq!(l.signed_area() > 0.0, k != 1);
            prop_assert_eq!(l.points.len(), stars[k].len());
        }
        prop_assert_eq!(region.contains(centre), Containment::Inside);
        for s in &stars {
            prop_assert_eq!(region.contains(DVec2::from_array(s[0])), Containment::Boundary);
        }
    }

    #[test]
    fn random_closed_chains_are_judged_as_every_pair_of_segments_says(
        points in prop::collection::vec((0_i32..12, 0_i32..12), 4..12),
    ) {
        // Corners on a coarse grid, so that vertices fall on segments often. Only proper crossings are certain here.
        let corners: Vec<[f64; 2]> = points.iter().map(|&(x, y)| [f64::from(x) / 16.0, f64::from(y) / 16.0]).collect();
        let turn = |a: (i32, i32), b: (i32, i32), c: (i32, i32)| {
            ((b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)).signum()
        };
        let n = points.len();
        let proper = (0..n).any(|i| (0..n).any(|j| {
            let (a, b, c, d) = (points[i], points[(i + 1) % n], points[j], points[(j + 1) % n]);
            turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0
        }));
        let face = trimmed(square(0.0, 1.0), vec![polygon(&corners)]);
        let result = face.check();
        if proper {
            prop_assert!(result.is_err());
        }
        if let Ok(trims) = result {
            let region = trims.polygonise(&face.surface, 1e-3).unwrap();
            prop_assert!(region.area() > 0.0);
        }
    }
}
