//! Lines, circles, slots, waves, corners, noise: within the tolerance, closed, tangent, with few segments.

use std::f64::consts::{PI, TAU};

use glam::DVec2;
use proptest::prelude::*;

use super::*;
use crate::engine::pattern::Segment;

const TOLERANCE: f64 = 0.01;

/// A shape to be fitted.
#[derive(Clone)]
struct Shape {
    points: Vec<DVec2>,
    corners: Vec<bool>,
    closed: bool,
}

impl std::fmt::Debug for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} points from {:?} on", self.points.len(), self.points.first())
    }
}

impl Shape {
    fn of(points: Vec<DVec2>, closed: bool) -> Self {
        Self { corners: vec![false; points.len()], points, closed }
    }

    /// A curve over [0, 1] sampled as the tracer does: until a chord's middle is within an eighth of the tolerance, the middles kept.
    fn sampled(closed: bool, at: impl Fn(f64) -> DVec2) -> Self {
        let mut points = vec![at(0.0)];
        let parts = 16;
        for k in 0..parts {
            refine(&at, f64::from(k) / f64::from(parts), f64::from(k + 1) / f64::from(parts), &mut points);
        }
        if closed {
            points.pop();
        }
        Self::of(points, closed)
    }

    fn fits(&self) -> [Fit; 2] {
        let Fits { arcs: Some(arcs), spline: Some(spline) } = fits(&self.points, &self.corners, self.closed, TOLERANCE)
        else {
            panic!("nothing was fitted to {self:?}")
        };
        [arcs, spline]
    }

    /// Both forms, once they were found to hold what is promised.
    fn checked(&self) -> [Fit; 2] {
        let both = self.fits();
        for fit in &both {
            self.check(fit);
        }
        let allowed = |s: &Segment, spline: bool| {
            !matches!((s, spline), (Segment::Cubic { .. }, false) | (Segment::Arc { .. }, true))
        };
        assert!(both[0].segments.iter().all(|s| allowed(s, false)));
        assert!(both[1].circle.is_some() || both[1].segments.iter().all(|s| allowed(s, true)));
        both
    }

    fn check(&self, fit: &Fit) {
        assert_eq!(fit.corners.len(), fit.segments.len());
        assert!(fit.deviation_mm <= TOLERANCE, "{}", fit.deviation_mm);
        let end = fit.segments.last().expect("segments").to();
        if self.closed {
            assert_eq!(end, fit.start, "closed to the bit");
        } else {
            assert_eq!([fit.start, end], [self.points[0], self.points[self.points.len() - 1]]);
        }
        let worst = apart(fit, &self.points, self.closed);
        // What is told is what there is, but for the finite number of places that were measured.
        assert!(worst <= fit.deviation_mm * 1.1 + 1e-9, "{worst} where {} is told", fit.deviation_mm);
        let mut start = fit.start;
        for (k, segment) in fit.segments.iter().enumerate() {
            let to = segment.to();
            assert!(start.distance(to) > 0.2 * TOLERANCE, "a micro edge: {segment:?} from {start}");
            let next = fit.segments.get(k + 1).or_else(|| self.closed.then(|| &fit.segments[0]));
            if let (false, Some(next)) = (fit.corners[k], next) {
                let turn = angle(directions(start, segment)[1], directions(to, next)[0]);
                assert!(turn < 2e-4, "a kink of {turn} that is no corner, segment {k} of {}", fit.segments.len());
            }
            start = to;
        }
    }
}

fn refine(at: &impl Fn(f64) -> DVec2, t0: f64, t1: f64, out: &mut Vec<DVec2>) {
    let (a, b, m) = (at(t0), at(t1), at(0.5 * (t0 + t1)));
    let near = [0.25, 0.75].iter().all(|x| {
        let p = at(t0 + x * (t1 - t0));
        distance_to_segment(p, a, m).min(distance_to_segment(p, m, b)) <= SAMPLED * TOLERANCE
    });
    if near || t1 - t0 < 1e-6 {
        out.extend([m, b]);
    } else {
        refine(at, t0, 0.5 * (t0 + t1), out);
        refine(at, 0.5 * (t0 + t1), t1, out);
    }
}

/// The unit directions of a segment at both ends.
fn directions(start: DVec2, segment: &Segment) -> [DVec2; 2] {
    match *segment {
        Segment::Line { to } => [(to - start).normalize(); 2],
        Segment::Arc { to, bulge } => {
            let half = 2.0 * bulge.atan();
            [-half, half].map(|x| DVec2::from_angle(x).rotate((to - start).normalize()))
        }
        Segment::Cubic { a, b, to } => [(a - start).normalize(), (to - b).normalize()],
    }
}

/// A point of a segment.
fn place(start: DVec2, segment: &Segment, t: f64) -> DVec2 {
    match *segment {
        Segment::Line { to } => start.lerp(to, t),
        Segment::Arc { to, bulge } => {
            // By the angle at the circumference: the chord from the start to the place at share t turns with it.
            let half = 2.0 * bulge.atan();
            let chord = start.distance(to);
            let length = chord * (t * half).sin() / half.sin();
            start + DVec2::from_angle((t - 1.0) * half).rotate((to - start) / chord) * length
        }
        Segment::Cubic { a, b, to } => {
            let ab = start.lerp(a, t);
            let bc = a.lerp(b, t);
            let cd = b.lerp(to, t);
            ab.lerp(bc, t).lerp(bc.lerp(cd, t), t)
        }
    }
}

/// The greatest distance of a fit from the polyline of samples, both ways.
fn apart(fit: &Fit, samples: &[DVec2], closed: bool) -> f64 {
    let mut own = samples.to_vec();
    if closed {
        own.push(own[0]);
    }
    // Segments with where they start, and places on each.
    let starts = std::iter::once(fit.start).chain(fit.segments.iter().map(Segment::to));
    let segments: Vec<(DVec2, Segment)> = starts.zip(fit.segments.iter().copied()).collect();
    let places = (3000 / segments.len()).clamp(4, 64);
    let share = |k: usize| k as f64 / places as f64;
    let dense: Vec<(usize, usize, DVec2)> = segments
        .iter()
        .enumerate()
        .flat_map(|(n, (start, segment))| (0..=places).map(move |k| (n, k, place(*start, segment, share(k)))))
        .collect();
    let to_own = |p: DVec2| own.windows(2).map(|w| distance_to_segment(p, w[0], w[1])).fold(f64::INFINITY, f64::min);
    let of_fit = dense.iter().map(|d| to_own(d.2)).fold(0.0, f64::max);
    // The nearest place, and from there on the nearest point of its segment.
    let to_fit = |p: DVec2| {
        let nearest = dense.iter().map(|d| d.2.distance(p)).fold(f64::INFINITY, f64::min);
        // All stretches between places that may come nearer than the nearest place.
        let near = dense
            .windows(2)
            .map(|w| [w[0], w[1]])
            .filter(|[a, b]| 0.5 * (a.2.distance(p) + b.2.distance(p)) - 0.6 * a.2.distance(b.2) <= nearest);
        let within = near.filter(|[a, b]| a.0 == b.0 && a.1 < b.1).map(|[(n, k, _), _]| {
            let (start, segment) = &segments[n];
            let (mut low, mut high) = (share(k), share(k + 1));
            let at = |t: f64| place(*start, segment, t).distance(p);
            for _ in 0..50 {
                let third = (high - low) / 3.0;
                if at(low + third) < at(high - third) {
                    high -= third;
                } else {
                    low += third;
                }
            }
            at(0.5 * (low + high))
        });
        within.fold(nearest, f64::min)
    };
    own.iter().step_by(own.len().div_ceil(700)).map(|&p| to_fit(p)).fold(of_fit, f64::max)
}

fn counts(fits: &[Fit; 2]) -> [usize; 2] {
    fits.each_ref().map(|f| f.segments.len())
}

fn polygon(points: &[[f64; 2]]) -> Shape {
    let points: Vec<DVec2> = points.iter().map(|&p| DVec2::from(p)).collect();
    Shape { corners: vec![true; points.len()], points, closed: true }
}

#[test]
fn a_polygon_is_its_lines() {
    for fit in polygon(&[[0.0, 0.0], [40.0, 0.0], [40.0, 20.0], [10.0, 30.0]]).checked() {
        assert_eq!(fit.segments.len(), 4);
        assert!(fit.corners.iter().all(|&c| c) && fit.deviation_mm == 0.0);
    }
}

#[test]
fn points_within_a_side_go_and_those_too_near_to_be_told_apart() {
    let mut shape =
        polygon(&[[0.0, 0.0], [10.0, 0.0], [20.0, 0.001], [40.0, 0.0], [40.0, 20.0], [39.9995, 20.001], [0.0, 20.0]]);
    (shape.corners[1], shape.corners[2]) = (false, false);
    for fit in shape.checked() {
        assert_eq!(fit.segments.len(), 4, "{fit:?}");
        assert!(fit.deviation_mm > 9e-4);
    }
}

#[test]
fn a_circle_is_one_whatever_its_corners_are_said_to_be() {
    for (radius, way) in [(0.3, 1.0), (20.0, -1.0), (500.0, 1.0)] {
        let centre = DVec2::new(7.0, -3.0);
        let mut shape = Shape::sampled(true, |t| centre + DVec2::from_angle(way * TAU * t) * radius);
        for _ in 0..2 {
            for fit in shape.checked() {
                let (middle, found) = fit.circle.expect("a circle");
                assert!(middle.distance(centre) < 1e-6 * radius && (found - radius).abs() < 1e-6 * radius);
                assert!(fit.segments.iter().all(|s| matches!(s, Segment::Arc { bulge, .. } if *bulge == way)));
            }
            shape.corners[0] = true;
        }
    }
    // The same points once round and back again enclose nothing.
    let there: Vec<DVec2> = (0..200).map(|k| DVec2::from_angle(f64::from(k) * 0.03) * 20.0).collect();
    let back = there.iter().rev().skip(1).take(198);
    let shape = Shape::of(there.iter().chain(back).copied().collect(), true);
    assert!(shape.fits().iter().all(|f| f.circle.is_none()));
}

/// Two straight sides of 60 and two half turns of radius 10.
fn slot(t: f64) -> DVec2 {
    let (straight, round) = (60.0, 10.0 * PI);
    let length = 2.0 * (straight + round);
    let s = t * length;
    if s <= straight {
        DVec2::new(s, -10.0)
    } else if s <= straight + round {
        DVec2::new(straight, 0.0) + DVec2::from_angle((s - straight) / 10.0 - 0.5 * PI) * 10.0
    } else if s <= 2.0 * straight + round {
        DVec2::new(2.0 * straight + round - s, 10.0)
    } else {
        DVec2::from_angle((s - 2.0 * straight - round) / 10.0 + 0.5 * PI) * 10.0
    }
}

/// The slot with its joints among the samples, from a share of the way on.
fn slot_from(start: f64) -> Shape {
    let quarter = 60.0 / (120.0 + 20.0 * PI);
    let mut stops = [0.0, quarter, 0.5, 0.5 + quarter, start, 1.0];
    stops.sort_by(f64::total_cmp);
    let mut points = Vec::new();
    for w in stops.windows(2) {
        points.push(slot(w[0]));
        refine(&|x| slot(x.min(w[1] - 1e-12)), w[0], w[1], &mut points);
        points.pop();
    }
    points.dedup_by(|a, b| a.distance(*b) < 1e-9);
    let at = points.iter().position(|p| p.distance(slot(start)) < 1e-9).expect("a stop");
    points.rotate_left(at);
    Shape::of(points, true)
}

#[test]
fn a_slot_is_two_lines_and_two_arcs_wherever_it_begins() {
    for start in [0.0, 0.1, 0.4, 0.6, 0.95] {
        let fits = slot_from(start).checked();
        let lines = |f: &Fit| f.segments.iter().filter(|s| matches!(s, Segment::Line { .. })).count();
        assert!(fits.iter().all(|f| lines(f) == 2), "{start}: {fits:#?}");
        assert_eq!(fits[0].segments.len(), 4, "{start}: {:#?}", fits[0]);
        assert!(fits[1].segments.len() <= 8, "{start}: {}", fits[1].segments.len());
        assert!(fits.iter().all(|f| f.corners.iter().all(|&c| !c)));
    }
}

#[test]
fn an_ellipse_and_a_wave_take_few_segments_and_no_corner() {
    let ellipse = Shape::sampled(true, |t| DVec2::from_angle(TAU * t) * DVec2::new(50.0, 30.0));
    let wave = Shape::sampled(false, |t| DVec2::new(100.0 * t, 5.0 * (TAU * 2.0 * t).sin()));
    for (shape, most) in [(ellipse, [36, 6]), (wave, [36, 6])] {
        let fits = shape.checked();
        let found = counts(&fits);
        println!("{} points: {found:?}", shape.points.len());
        assert!(found[0] <= most[0] && found[1] <= most[1], "{found:?}");
        let inner = fits.iter().all(|f| f.corners[..f.corners.len() - 1].iter().all(|&c| !c));
        assert!(inner, "no corners");
    }
}

#[test]
fn an_arc_between_corners_is_one_arc_also_beyond_a_half_turn() {
    for sweep in [0.4, 2.0, PI, 4.0, 5.5] {
        let mut shape = Shape::sampled(false, |t| DVec2::from_angle(1.0 - sweep * t) * 25.0);
        shape.closed = true;
        let last = shape.points.len() - 1;
        (shape.corners[0], shape.corners[last]) = (true, true);
        let [arcs, _] = shape.checked();
        assert_eq!(arcs.segments.len(), 2, "{sweep}: {arcs:?}");
        assert!(matches!(arcs.segments[0], Segment::Arc { bulge, .. } if (bulge + (0.25 * sweep).tan()).abs() < 1e-3));
        assert!(matches!(arcs.segments[1], Segment::Line { .. }) && arcs.corners == [true, true]);
    }
}

#[test]
fn a_coarse_polygon_stays_what_it_is() {
    // Thirty edges, none a corner: smooth curves would leave it by more than the tolerance.
    let shape = Shape::of((0..30).map(|k| DVec2::from_angle(f64::from(k) * TAU / 30.0) * 40.0).collect(), true);
    for fit in shape.checked() {
        assert!(fit.segments.len() <= 60, "{}", fit.segments.len());
    }
}

#[test]
fn what_cannot_be_fitted_is_left_out() {
    let line = [DVec2::ZERO, DVec2::X];
    for (points, tolerance) in [(&line[..1], 0.1), (&line, 0.0), (&line, f64::NAN), (&[DVec2::ZERO; 4], 0.1)] {
        assert_eq!(fits(points, &[], false, tolerance), Fits::default());
    }
    assert_eq!(fits(&[DVec2::ZERO, DVec2::NAN], &[], false, 0.1), Fits::default());
    let two = fits(&line, &[], false, 0.1).arcs.expect("a line");
    assert_eq!((two.segments.len(), two.deviation_mm), (1, 0.0));
}

/// A smooth closed curve about a middle: a circle with some waves.
fn blob() -> impl Strategy<Value = Shape> {
    (5.0..200.0_f64, prop::collection::vec((-0.12..0.12_f64, 0.0..TAU), 4)).prop_map(|(radius, waves)| {
        Shape::sampled(true, |t| {
            let off: f64 =
                waves.iter().enumerate().map(|(k, (a, phase))| a * ((k + 2) as f64 * TAU * t + phase).sin()).sum();
            DVec2::from_angle(TAU * t) * radius * (1.0 + off)
        })
    })
}

/// A closed polygon whose edges bulge, with corners between.
fn petals() -> impl Strategy<Value = Shape> {
    prop::collection::vec((20.0..60.0_f64, -0.3..0.3_f64), 3..7).prop_map(|edges| {
        let count = edges.len();
        let corner = |k: usize| DVec2::from_angle(TAU * (k % count) as f64 / count as f64) * edges[k % count].0;
        let mut shape = Shape::of(Vec::new(), true);
        for (k, &(_, bulge)) in edges.iter().enumerate() {
            let (a, b) = (corner(k), corner(k + 1));
            let at = |t: f64| a.lerp(b, t) + (b - a).perp() * (bulge * (PI * t).sin() * t);
            let mut side = vec![a];
            for q in 0..4 {
                refine(&at, f64::from(q) / 4.0, f64::from(q + 1) / 4.0, &mut side);
            }
            side.pop();
            shape.corners.extend((0..side.len()).map(|n| n == 0));
            shape.points.extend(side);
        }
        shape
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn smooth_curves_have_no_corners(shape in blob()) {
        for fit in shape.checked() {
            prop_assert!(fit.corners.iter().all(|&c| !c), "{:?}", fit);
        }
    }

    #[test]
    fn corners_stay_and_none_are_added(shape in petals()) {
        let own: Vec<DVec2> =
            shape.points.iter().zip(&shape.corners).filter(|c| *c.1).map(|c| *c.0).collect();
        // By chance two sides may be tangent where they meet: a corner that is hardly one goes.
        let count = shape.points.len();
        let turn = |k: usize| {
            let [a, b, c] = [k + count - 1, k, k + 1].map(|k| shape.points[k % count]);
            angle(b - a, c - b)
        };
        let is_sharp = |&k: &usize| shape.corners[k] && turn(k) > 0.1;
        let sharp: Vec<DVec2> = (0..count).filter(is_sharp).map(|k| shape.points[k]).collect();
        for fit in shape.checked() {
            let found: Vec<DVec2> =
                fit.segments.iter().zip(&fit.corners).filter(|c| *c.1).map(|c| c.0.to()).collect();
            prop_assert!(found.iter().all(|p| own.contains(p)), "{:?}", found);
            prop_assert!(sharp.iter().all(|p| found.contains(p)), "{:?}", found);
        }
    }

    #[test]
    fn noise_is_kept_within_the_tolerance(
        shape in blob(), noise in prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64), 64), size in 0.0..4.0_f64,
    ) {
        let mut shape = shape;
        for (p, n) in shape.points.iter_mut().zip(noise.iter().cycle()) {
            *p += DVec2::new(n.0, n.1) * size * TOLERANCE;
        }
        shape.checked();
    }

    #[test]
    fn any_points_at_all_are_kept_within_the_tolerance(
        points in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, any::<bool>()), 3..60), closed in any::<bool>(), scale in 0.05..50.0_f64,
    ) {
        let shape = Shape {
            corners: points.iter().map(|p| p.2).collect(),
            points: points.iter().map(|p| DVec2::new(p.0, p.1) * scale).collect(),
            closed,
        };
        for fit in shape.fits() {
            prop_assert!(fit.deviation_mm <= TOLERANCE);
            let worst = apart(&fit, &shape.points, closed);
            prop_assert!(worst <= TOLERANCE * 1.001, "{}", worst);
        }
    }
}
