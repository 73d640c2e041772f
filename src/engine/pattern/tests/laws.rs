//! Laws that hold for any flattening and any polygon.

use proptest::prelude::*;

use super::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn the_pattern_does_not_depend_on_how_the_flattening_lies(
        angle in 0.0..2.0 * PI, x in -1e3..1e3_f64, y in -1e3..1e3_f64, reversed in any::<bool>(),
    ) {
        let mut part = f_on_a_plane();
        part.side = if reversed { Side::Reversed } else { Side::Normal };
        let before = part.draw();
        let turn = DVec2::from_angle(angle);
        for p in &mut part.flat {
            *p = turn.rotate(*p) + DVec2::new(x, y);
        }
        let after = part.draw();
        let (a, b) = (&before.pattern.pieces[0].outline.points, &after.pattern.pieces[0].outline.points);
        prop_assert_eq!(a.len(), b.len());
        prop_assert!(a.iter().zip(b).all(|(a, b)| a.distance(*b) < 1e-9));
        // The transform brings the flattening to where the pattern is.
        let (placed, moved) = (before.transform.apply(&f_on_a_plane().flat), after.transform.apply(&part.flat));
        prop_assert!(placed.iter().zip(&moved).all(|(a, b)| a.distance(*b) < 1e-9));
    }

    #[test]
    fn the_triangles_of_a_part_are_those_that_its_polygon_meets(
        radii in proptest::collection::vec(0.05..0.48_f64, 3..12), m in 0..4_u32, n in 0..4_u32, snap in any::<bool>(),
    ) {
        // Grid lines at binary fractions, so that a snapped polygon does run along them and through their crossings.
        let (m, n) = (2_usize.pow(m) + 1, 2_usize.pow(n) + 1);
        let count = radii.len();
        let corner = |k: usize| {
            let p = DVec2::new(0.5, 0.5) + DVec2::from_angle(k as f64 * 2.0 * PI / count as f64) * radii[k];
            // On grid lines now and then.
            if snap { (p * 8.0).round() / 8.0 } else { p }
        };
        let points: Vec<DVec2> = (0..count).map(corner).collect();
        // Snapping may fold a corner into a spike, which encloses nothing: by two corners at one place, or by a way back.
        prop_assume!((0..count).all(|k| !points[..k].contains(&points[k])));
        let turns_back = |k: usize| {
            let (there, back) = (points[(k + 1) % count] - points[k], points[(k + 2) % count] - points[(k + 1) % count]);
            there.perp_dot(back) == 0.0 && there.dot(back) < 0.0
        };
        prop_assume!(!(0..count).any(turns_back));
        let trimmed = TrimmedSurface {
            surface: plane(1.0, 1.0), loops: vec![polyline(points.iter().copied())], side: Side::Normal,
        };
        let Ok(trims) = trimmed.check() else { return Ok(()) };
        let region = trims.polygonise(&trimmed.surface, 1e-6).expect("a polygon");
        let lines = GridLines::uniform(trimmed.surface.domain(), m, n);
        let lifted = lift(&trimmed.surface, grid_mesh(&lines, Configuration::Diamond, 0), &lines);
        let part = part_of(&lifted, &region);
        let polygon = &region.loops[0].points;
        for (t, corners) in lifted.domain.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|k| lifted.domain.uv[k as usize]);
            // The polygon clipped to the triangle has an area exactly when they meet.
            let mut clipped = polygon.clone();
            for (p, q) in [(a, b), (b, c), (c, a)] {
                clipped = clip(&clipped, p, q);
            }
            let common = area(&clipped).abs();
            if common > 1e-9 {
                prop_assert!(part[t], "{t}: {common}");
            }
            if common == 0.0 {
                prop_assert!(!part[t], "{t}");
            }
        }
    }
}

/// What of a polygon lies to the left of a line (Sutherland and Hodgman).
fn clip(polygon: &[DVec2], a: DVec2, b: DVec2) -> Vec<DVec2> {
    let side = |p: DVec2| (b - a).perp_dot(p - a);
    let mut out = Vec::new();
    for (k, &p) in polygon.iter().enumerate() {
        let q = polygon[(k + 1) % polygon.len()];
        let (sp, sq) = (side(p), side(q));
        if sp >= 0.0 {
            out.push(p);
        }
        if (sp > 0.0 && sq < 0.0) || (sp < 0.0 && sq > 0.0) {
            out.push(p.lerp(q, sp / (sp - sq)));
        }
    }
    out
}
