//! Surfaces in closed form: sheets over a rectangle, and profiles turned about the z axis.

use glam::{DVec2, DVec3};
use planish::engine::nurbs::{KnotVector, Surface};

/// Digits that coordinates keep of the part's own size, so that the files are the same whatever the machine's sine.
const DIGITS: i32 = 11;

/// `x` rounded to [`DIGITS`] digits of `size`.
pub(crate) fn tidy(x: f64, size: f64) -> f64 {
    let decimals = DIGITS - size.log10().ceil() as i32;
    let scale = 10_f64.powi(decimals.abs());
    // Dividing by an exact power of ten gives the nearest double to the decimal; adding zero drops the sign of zero.
    let rounded = if decimals >= 0 { (x * scale).round() / scale } else { (x / scale).round() * scale };
    rounded + 0.0
}

/// A knot vector that is sound by construction.
pub(crate) fn knots(degree: usize, knots: Vec<f64>) -> KnotVector {
    KnotVector::new(degree, knots, "knots").expect("the example's knots are sound")
}

fn surface(u: KnotVector, v: KnotVector, points: Vec<DVec3>, weights: Option<Vec<f64>>) -> Surface {
    let size = points.iter().map(|p| p.abs().max_element()).fold(f64::MIN_POSITIVE, f64::max);
    let points = points.into_iter().map(|p| DVec3::from_array(p.to_array().map(|x| tidy(x, size)))).collect();
    let weights = weights.map(|w| w.into_iter().map(|w| tidy(w, 1.0)).collect());
    Surface::new(u, v, points, weights).expect("the example's net is sound")
}

/// `count` control points of degree `degree` over `[0, length]`, with a full knot at both ends.
fn clamped(degree: usize, count: usize, length: f64) -> KnotVector {
    let spans = count - degree;
    let inner = (1..spans).map(|i| tidy(length * i as f64 / spans as f64, length));
    let ends = |x: f64| std::iter::repeat_n(x, degree + 1);
    knots(degree, ends(0.0).chain(inner).chain(ends(length)).collect())
}

/// The same with equally spaced knots that run over both ends of the domain.
fn unclamped(degree: usize, count: usize, length: f64) -> KnotVector {
    let step = length / (count - degree) as f64;
    knots(degree, (0..=count + degree).map(|i| tidy((i as f64 - degree as f64) * step, length)).collect())
}

/// A sheet over a rectangle: x runs with u, y with v, so that the domain is in millimetres; z is a height.
pub(crate) struct Sheet {
    pub(crate) degree: usize,
    pub(crate) count: [usize; 2],
    pub(crate) size: [f64; 2],
    pub(crate) clamped: bool,
}

impl Sheet {
    /// The sheet whose control points have the heights `z(s, t)`, s and t in [0, 1].
    pub(crate) fn lifted(&self, z: impl Fn(f64, f64) -> f64) -> Surface {
        let vector = |k: usize| {
            let make = if self.clamped { clamped } else { unclamped };
            make(self.degree, self.count[k], self.size[k])
        };
        let (u, v) = (vector(0), vector(1));
        let (xs, ys) = (greville(&u), greville(&v));
        let mut points = Vec::new();
        for x in &xs {
            for y in &ys {
                points.push(DVec3::new(*x, *y, z(x / self.size[0], y / self.size[1])));
            }
        }
        surface(u, v, points, None)
    }
}

/// Means of `degree` neighbouring knots: with control points there, the coordinate is the parameter itself.
fn greville(vector: &KnotVector) -> Vec<f64> {
    let p = vector.degree();
    (0..vector.control_count()).map(|i| vector.knots()[i + 1..=i + p].iter().sum::<f64>() / p as f64).collect()
}

/// A curve in the (radius, height) plane.
pub(crate) struct Profile {
    vector: KnotVector,
    points: Vec<DVec2>,
    weights: Vec<f64>,
}

impl Profile {
    /// A straight line.
    pub(crate) fn line(from: [f64; 2], to: [f64; 2]) -> Self {
        Self {
            vector: clamped(1, 2, 1.0),
            points: vec![DVec2::from_array(from), DVec2::from_array(to)],
            weights: vec![1.0; 2],
        }
    }

    /// An arc of a circle, from one angle to another, degrees.
    pub(crate) fn arc(centre: [f64; 2], radius: f64, degrees: [f64; 2]) -> Self {
        let (vector, points, weights) = arc(degrees, 1);
        let points = points.into_iter().map(|p| DVec2::from_array(centre) + p * radius).collect();
        Self { vector, points, weights }
    }

    /// The surface that the profile sweeps about the z axis between two angles, degrees: u around, v along the profile.
    /// Its normal points away from the axis where the profile rises.
    pub(crate) fn turned(&self, degrees: [f64; 2], spans: usize) -> Surface {
        let (u, around, around_weights) = arc(degrees, spans);
        let mut points = Vec::new();
        let mut weights = Vec::new();
        for (a, wa) in around.iter().zip(&around_weights) {
            for (p, wp) in self.points.iter().zip(&self.weights) {
                points.push(DVec3::new(a.x * p.x, a.y * p.x, p.y));
                weights.push(wa * wp);
            }
        }
        surface(u, self.vector.clone(), points, Some(weights))
    }
}

/// An arc of the unit circle as a rational quadratic over [0, 1] with equal spans of less than 180 degrees.
fn arc(degrees: [f64; 2], spans: usize) -> (KnotVector, Vec<DVec2>, Vec<f64>) {
    let [from, to] = degrees.map(f64::to_radians);
    let half = (to - from) / (2 * spans) as f64;
    let mut points = Vec::new();
    let mut weights = Vec::new();
    for i in 0..=2 * spans {
        let angle = from + half * i as f64;
        let (reach, weight) = if i % 2 == 0 { (1.0, 1.0) } else { (1.0 / half.cos(), half.cos()) };
        points.push(DVec2::from_angle(angle) * reach);
        weights.push(weight);
    }
    let inner = (1..spans).flat_map(|i| [tidy(i as f64 / spans as f64, 1.0); 2]);
    let vector = [0.0; 3].into_iter().chain(inner).chain([1.0; 3]).collect();
    (knots(2, vector), points, weights)
}
