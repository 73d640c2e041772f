//! Shapes whose answers are known.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::samples::{backwards, circle, polygon, rectangle, square, trimmed};
use crate::engine::nurbs::{Curve2, KnotVector, Surface, shapes};
use crate::engine::trimming::{Containment, TrimCurve, TrimLoop, TrimRegion, TrimShape, TrimmedSurface};

fn region(face: &TrimmedSurface, tolerance: f64) -> TrimRegion {
    face.check().unwrap().polygonise(&face.surface, tolerance).unwrap()
}

fn nurbs(degree: usize, knots: &[f64], points: &[[f64; 2]]) -> TrimCurve {
    let control = points.iter().map(|&p| DVec2::from_array(p)).collect();
    let knots = KnotVector::new(degree, knots.to_vec(), "knots").unwrap();
    TrimCurve { shape: TrimShape::Nurbs(Curve2::new(knots, control, None).unwrap()), reversed: false }
}

#[test]
fn a_surface_without_loops_is_bounded_by_its_domain() {
    let face = trimmed(square(3.0, 10.0), Vec::new());
    let trims = face.check().unwrap();
    let region = trims.polygonise(&face.surface, 0.1).unwrap();
    assert!(region.natural && trims.natural());
    assert_eq!(region.loops[0].points, [[3.0, 3.0], [4.0, 3.0], [4.0, 4.0], [3.0, 4.0]].map(DVec2::from_array));
    assert_eq!(region.loops[0].corners, [true; 4]);
    assert_eq!(trims.point(0, 1, 0.5), DVec2::new(4.0, 3.5));
}

#[test]
fn the_area_of_a_circle_converges_and_its_chords_keep_the_tolerance() {
    for (at, size) in [(0.0, 1.0), (1e5, 1.0), (0.0, 1e-3), (-7.0, 1e5)] {
        let centre = [at + 0.5, at + 0.5];
        let face = trimmed(square(at, size), vec![circle(centre, 0.4)]);
        for relative in [1e-2, 1e-3, 1e-4, 1e-5] {
            let tolerance = relative * size;
            let region = region(&face, tolerance);
            let points = region.loops[0].points.len();
            // A regular polygon within the tolerance has this many corners; cutting thirds costs a few more.
            let least = (PI / (1.0 - relative / 0.4).acos()).ceil();
            assert!(
                points >= 9 && (points as f64) < (1.35 * least).max(10.0),
                "{points} points where {least} would do"
            );
            for [a, b] in region.loops[0].segments() {
                let sagitta = 0.4 - ((a + b) * 0.5).distance(DVec2::from_array(centre));
                assert!(sagitta <= relative * 1.01, "{sagitta} at {relative}");
            }
            let exact = PI * 0.16;
            assert!((region.area() - exact).abs() < 2.0 * PI * 0.4 * relative, "{}", region.area());
        }
    }
}

#[test]
fn however_small_a_circle_is_it_keeps_its_shape() {
    let face = trimmed(square(0.0, 1.0), vec![rectangle([0.1, 0.1], [0.9, 0.9]), circle([0.5, 0.5], 1e-6)]);
    let region = region(&face, 0.01);
    assert!(region.loops[1].points.len() >= 9);
    assert!(region.loops[1].corners.iter().all(|c| !c));
}

#[test]
fn either_orientation_of_any_loop_gives_the_same_region() {
    let loops = || vec![rectangle([0.1, 0.1], [0.9, 0.9]), circle([0.5, 0.5], 0.2)];
    let plain = region(&trimmed(square(0.0, 1.0), loops()), 1e-3);
    for flips in 1..4 {
        let flipped = loops()
            .into_iter()
            .enumerate()
            .map(|(i, l)| if flips & (1 << i) == 0 { l } else { backwards(l) })
            .collect();
        let other = region(&trimmed(square(0.0, 1.0), flipped), 1e-3);
        assert!((plain.area() - other.area()).abs() < 1e-15);
        for (a, b) in plain.loops.iter().zip(&other.loops) {
            let mut rows = [a, b].map(|l| l.points.iter().map(DVec2::to_array).collect::<Vec<_>>());
            for r in &mut rows {
                r.sort_by(|x, y| x.partial_cmp(y).unwrap());
            }
            assert_eq!(rows[0].len(), rows[1].len());
            for (x, y) in rows[0].iter().zip(&rows[1]) {
                assert!((x[0] - y[0]).abs() + (x[1] - y[1]).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn islands_in_holes_and_several_outers_nest_in_any_order() {
    let loops = vec![
        rectangle([0.3, 0.3], [0.4, 0.4]),
        rectangle([0.6, 0.1], [0.9, 0.9]),
        rectangle([0.1, 0.1], [0.5, 0.9]),
        rectangle([0.2, 0.2], [0.45, 0.5]),
        rectangle([0.7, 0.2], [0.8, 0.8]),
    ];
    let region = region(&trimmed(square(0.0, 1.0), loops), 1e-3);
    assert_eq!(region.loops.iter().map(|l| l.depth).collect::<Vec<_>>(), [2, 0, 0, 1, 1]);
    assert_eq!(region.loops.iter().map(|l| l.parent).collect::<Vec<_>>(), [Some(3), None, None, Some(2), Some(1)]);
    assert!((region.area() - (0.01 + 0.24 + 0.32 - 0.075 - 0.06)).abs() < 1e-15);
    let inside =
        [([0.35, 0.35], true), ([0.25, 0.25], false), ([0.15, 0.5], true), ([0.55, 0.5], false), ([0.75, 0.5], false)];
    for (p, is_in) in inside {
        assert_eq!(region.contains(DVec2::from_array(p)) == Containment::Inside, is_in, "{p:?}");
    }
    for p in [[0.3, 0.35], [0.3, 0.3], [0.9, 0.9], [0.7, 0.1], [0.45, 0.2]] {
        assert_eq!(region.contains(DVec2::from_array(p)), Containment::Boundary, "{p:?}");
    }
}

#[test]
fn loops_may_touch_each_other_themselves_and_the_border() {
    // A triangle with a corner on the border, a square that shares an edge with it from inside, a bow tie that meets
    // itself at a point without crossing, and one that runs along the border.
    let cases = [
        vec![polygon(&[[0.0, 0.5], [0.5, 0.2], [0.5, 0.8]])],
        vec![rectangle([0.0, 0.0], [1.0, 1.0]), rectangle([0.0, 0.25], [0.5, 0.75])],
        vec![rectangle([0.0, 0.0], [1.0, 1.0]), polygon(&[[0.5, 0.0], [0.75, 0.5], [0.25, 0.5]])],
        vec![polygon(&[[0.1, 0.1], [0.5, 0.5], [0.9, 0.1], [0.9, 0.9], [0.5, 0.5], [0.1, 0.9]])],
        vec![rectangle([0.1, 0.1], [0.5, 0.5]), rectangle([0.5, 0.5], [0.9, 0.9])],
        vec![rectangle([0.1, 0.1], [0.5, 0.5]), rectangle([0.5, 0.2], [0.9, 0.7])],
        vec![circle([0.5, 0.5], 0.5)],
    ];
    for (i, loops) in cases.into_iter().enumerate() {
        let face = trimmed(square(0.0, 1.0), loops);
        let region = face.check().unwrap_or_else(|e| panic!("case {i}: {e:?}")).polygonise(&face.surface, 1e-3);
        assert!(region.is_ok(), "case {i}: {region:?}");
    }
}

#[test]
fn points_on_the_border_are_on_it_bit_for_bit() {
    // Overshoots and falls short by what real files do.
    for off in [1e-15, 2e-7, -2e-7] {
        let [a, b] = [1e3 - off, 1e3 + 1.0 + off];
        let face = trimmed(square(1e3, 1.0), vec![rectangle([a, a], [b, b])]);
        let region = region(&face, 1e-3);
        for p in &region.loops[0].points {
            assert!((p.x == 1e3 || p.x == 1001.0) && (p.y == 1e3 || p.y == 1001.0), "{p}");
        }
    }
}

#[test]
fn unclamped_knots_and_reversed_curves_join() {
    // A uniform cubic over its inner knots, closed by a line that is sent the other way round.
    let spline = nurbs(
        3,
        &[-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
        &[[0.1, 0.1], [0.3, 0.2], [0.6, 0.9], [0.8, 0.3], [0.9, 0.2]],
    );
    let TrimShape::Nurbs(curve) = &spline.shape else { panic!("a spline") };
    let [a, b] = [curve.point(0.0), curve.point(2.0)];
    let mut line = nurbs(1, &[0.0, 0.0, 1.0, 1.0], &[a.to_array(), b.to_array()]);
    line.reversed = true;
    let face = trimmed(square(0.0, 10.0), vec![TrimLoop { curves: vec![spline.clone(), line] }]);
    let trims = face.check().unwrap();
    for t in [0.0, 0.4, 1.0, 1.7, 2.0] {
        assert!(trims.point(0, 0, t).distance(curve.point(t)) < 1e-15);
    }
    let region = trims.polygonise(&face.surface, 1e-5).unwrap();
    for (p, s) in region.loops[0].points.iter().zip(&region.loops[0].sources) {
        assert_eq!(*p, trims.point(0, s.curve as usize, s.t));
    }
    assert_eq!(region.loops[0].corners.iter().filter(|c| **c).count(), 2);
}

#[test]
fn a_straight_way_across_a_cylinder_gets_points_and_along_it_none() {
    let surface = shapes::cylinder(10.0, 50.0);
    let slanted = polygon(&[[1.0, 0.1], [2.0, 0.2], [2.0, 0.9], [1.0, 0.8]]);
    let face = trimmed(surface, vec![slanted]);
    let region = region(&face, 0.01);
    let between = |x: f64| region.loops[0].points.iter().filter(|p| p.x == x).count();
    assert_eq!((between(1.0), between(2.0)), (2, 2));
    // A quarter turn of radius 10 within 0.01 takes about 18 chords.
    assert!((34..60).contains(&region.loops[0].points.len()), "{}", region.loops[0].points.len());
}

#[test]
fn a_curve_of_many_flat_pieces_costs_few_points() {
    let n = 100;
    let mut knots = vec![0.0; 3];
    knots.extend((0..=n).map(f64::from));
    knots.extend([f64::from(n); 3]);
    let control: Vec<[f64; 2]> =
        (0..n + 3).map(|i| [0.1 + 0.8 * f64::from(i) / f64::from(n + 2), 0.2 + 1e-7 * f64::from(i % 2)]).collect();
    let spline = nurbs(3, &knots, &control);
    let [first, last] = [control[0], control[control.len() - 1]];
    let back = TrimCurve {
        shape: TrimShape::Polyline([last, [0.5, 0.9], first].map(DVec2::from_array).to_vec()),
        reversed: false,
    };
    let face = trimmed(square(0.0, 1.0), vec![TrimLoop { curves: vec![spline, back] }]);
    let region = region(&face, 1e-3);
    assert!(region.loops[0].points.len() <= 6, "{}", region.loops[0].points.len());
}

#[test]
fn a_wave_on_the_surface_below_a_straight_line_is_seen() {
    // A sheet that waves along u: the diagonal of the domain waves in space.
    let n = 24;
    let mut knots = vec![0.0; 3];
    knots.extend((0..=n - 2).map(f64::from));
    knots.extend([f64::from(n - 2); 2]);
    knots.remove(0);
    let knots_u = KnotVector::new(2, knots, "knots").unwrap();
    let control = (0..n).flat_map(|i| {
        let (x, z) = (f64::from(i), f64::from(i % 2));
        [DVec3::new(x, 0.0, z), DVec3::new(x, 20.0, z)]
    });
    let knots_v = KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0], "knots").unwrap();
    let surface = Surface::new(knots_u, knots_v, control.collect(), None).unwrap();
    let u = surface.domain().u;
    let face = trimmed(surface, vec![polygon(&[[u[0], 0.0], [u[1], 1.0], [u[0], 1.0]])]);
    let region = region(&face, 0.05);
    assert!(region.loops[0].points.len() > 2 * n as usize, "{}", region.loops[0].points.len());
}

#[test]
fn circles_that_touch_anywhere_pass_and_their_polylines_do_not_cross() {
    // From outside and from inside, in directions that no vertex stands in.
    for angle in [0.0, 0.3, 1.0, 2.2, 4.0] {
        for (distance, radius) in [(0.3, 0.1), (0.15, 0.05), (0.1, 0.1)] {
            let centre = DVec2::splat(0.5) + DVec2::from_angle(angle) * distance;
            let loops = vec![circle([0.5, 0.5], 0.2), circle(centre.to_array(), radius)];
            let face = trimmed(square(0.0, 1.0), loops);
            let trims = face.check().unwrap_or_else(|e| panic!("{angle} {distance}: {e:?}"));
            assert_eq!(trims.loops()[1].depth, u32::from(distance < 0.2));
            for tolerance in [0.1, 1e-2, 1e-3, 1e-5] {
                let region = trims.polygonise(&face.surface, tolerance).unwrap();
                let least = 2.0 * PI * (0.2 + radius) * tolerance;
                let exact = PI * (0.04 + if distance < 0.2 { -radius * radius } else { radius * radius });
                assert!((region.area() - exact).abs() <= least, "{angle} {distance} {tolerance}");
            }
        }
    }
}
