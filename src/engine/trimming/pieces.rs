//! The Bezier pieces that trimming curves are worked on as (thesis 1.2.3).
//!
//! All pieces of all loops lie in one array, their control points in another, so that a face with many curves costs a
//! handful of allocations. While loops are being mended a control point is `(u, v, w)`; [`Pieces::seal`] turns it into
//! `(w u, w v, w)`, from which points are found by Horner's scheme in Bernstein form (Farin, 5.4), `O(degree)` a point.
//!
//! Ends are kept apart and returned bit for bit, and so is the constant coordinate of a piece along a parameter line:
//! whatever stands exactly on a grid line or on the domain's border stays there.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::{TrimCurve, TrimShape};

/// How a piece runs through the domain, which decides how it is turned into a polyline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Run {
    /// Straight along a line of constant u, never backwards.
    ConstantU,
    /// Straight along a line of constant v, never backwards.
    ConstantV,
    /// Straight.
    Line,
    /// Anything else.
    Curved,
}

/// One Bezier piece.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Piece {
    /// First and last parameter on the curve that it is a piece of, ascending.
    pub(super) t: [f64; 2],
    /// First and last point.
    pub(super) ends: [DVec2; 2],
    /// How it runs.
    pub(super) run: Run,
    /// True when its weights differ.
    pub(super) rational: bool,
    first: usize,
    degree: usize,
}

impl Piece {
    /// Its control points' places in [`Pieces::control`].
    pub(super) const fn control(&self) -> Range<usize> {
        self.first..self.first + self.degree + 1
    }

    /// The degree.
    pub(super) const fn degree(&self) -> usize {
        self.degree
    }

    /// The same kind of piece between other parameters and ends, with its control points from `first` on.
    pub(super) fn part(&self, t: [f64; 2], ends: [DVec2; 2], first: usize) -> Self {
        Self { t, ends, first, ..self.clone() }
    }

    /// Looks again how it runs after an end was moved.
    pub(super) fn bent(&mut self) {
        let [a, b] = self.ends;
        let constant = match self.run {
            Run::ConstantU => a.x == b.x,
            Run::ConstantV => a.y == b.y,
            Run::Line | Run::Curved => true,
        };
        if !constant {
            self.run = if self.degree == 1 { Run::Line } else { Run::Curved };
        }
    }

    /// The curve's parameter at the piece's own `s` in [0, 1].
    pub(super) fn parameter(&self, s: f64) -> f64 {
        if s >= 1.0 { self.t[1] } else { self.t[0] + s * (self.t[1] - self.t[0]) }
    }

    /// The piece's own parameter in [0, 1] at the curve's `t`.
    pub(super) fn own(&self, t: f64) -> f64 {
        if t >= self.t[1] { 1.0 } else { ((t - self.t[0]) / (self.t[1] - self.t[0])).clamp(0.0, 1.0) }
    }
}

/// The pieces of all curves.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Pieces {
    /// The pieces, curve by curve, each curve's in the order of its parameter.
    pub(super) list: Vec<Piece>,
    /// Control points: `(u, v, w)` before [`Pieces::seal`], `(w u, w v, w)` after.
    pub(super) control: Vec<DVec3>,
}

impl Pieces {
    /// Appends the pieces of a curve; returns where they are. Empty for a polyline of fewer than two points.
    pub(super) fn push_curve(&mut self, curve: &TrimCurve) -> Range<usize> {
        let first = self.list.len();
        match &curve.shape {
            TrimShape::Polyline(points) => {
                for (i, w) in points.windows(2).enumerate() {
                    self.push([i as f64, (i + 1) as f64], w.iter().map(|p| p.extend(1.0)));
                }
            }
            TrimShape::Nurbs(curve) => {
                let (knots, control) = (curve.knots(), curve.control());
                let p = knots.degree();
                let weight = |i: usize| curve.weights().map_or(1.0, |w| w[i]);
                if p == 1 {
                    for s in knots.spans() {
                        let ends = [s - 1, s].map(|i| control[i].extend(weight(i)));
                        self.push([knots.knots()[s], knots.knots()[s + 1]], ends.into_iter());
                    }
                } else if control.len() == p + 1 && knots.multiplicity(knots.domain()[0]) > p {
                    // One clamped span: the control points are the Bezier points.
                    let points = control.iter().enumerate().map(|(i, c)| c.extend(weight(i)));
                    self.push(knots.domain(), points);
                } else {
                    for segment in curve.to_bezier() {
                        let weight = |i: usize| segment.weights.as_ref().map_or(1.0, |w| w[i]);
                        self.push(segment.domain, segment.control.iter().enumerate().map(|(i, c)| c.extend(weight(i))));
                    }
                }
            }
        }
        first..self.list.len()
    }

    /// Appends one piece with its control points `(u, v, w)`, at least two.
    pub(super) fn push(&mut self, t: [f64; 2], points: impl Iterator<Item = DVec3>) {
        let first = self.control.len();
        self.control.extend(points);
        let points = &self.control[first..];
        let (degree, w) = (points.len() - 1, points[0].z);
        let rational = points.iter().any(|p| p.z != w);
        let ends = [points[0].truncate(), points[degree].truncate()];
        self.list.push(Piece { t, ends, run: Run::Curved, rational, first, degree });
    }

    /// Finds out how the pieces of `range` run, and weights their control points: from here on they are evaluated.
    pub(super) fn seal(&mut self, range: Range<usize>) {
        for piece in &mut self.list[range] {
            let points = &mut self.control[piece.first..=piece.first + piece.degree];
            piece.ends = [points[0].truncate(), points[piece.degree].truncate()];
            piece.run = run(points);
            if piece.rational {
                for p in points {
                    *p = (p.truncate() * p.z).extend(p.z);
                }
            }
        }
    }

    /// The point of a sealed piece at `s` in [0, 1].
    pub(super) fn point(&self, piece: &Piece, s: f64) -> DVec2 {
        if s <= 0.0 {
            return piece.ends[0];
        }
        if s >= 1.0 {
            return piece.ends[1];
        }
        let control = &self.control[piece.control()];
        let n = piece.degree;
        let rest = 1.0 - s;
        let (mut power, mut binomial) = (1.0, 1.0);
        let mut sum = control[0] * rest;
        for (i, c) in control.iter().enumerate().take(n).skip(1) {
            power *= s;
            binomial *= (n + 1 - i) as f64 / i as f64;
            sum = (sum + *c * (power * binomial)) * rest;
        }
        sum += control[n] * (power * s);
        let point = sum.truncate();
        let point = if piece.rational { point / sum.z } else { point };
        match piece.run {
            Run::ConstantU => DVec2::new(piece.ends[0].x, point.y),
            Run::ConstantV => DVec2::new(point.x, piece.ends[0].y),
            Run::Line | Run::Curved => point,
        }
    }

    /// Derivatives of a sealed piece at its start and end with respect to its own parameter.
    pub(super) fn end_derivatives(&self, piece: &Piece) -> [DVec2; 2] {
        let control = &self.control[piece.control()];
        let n = piece.degree;
        let from = |end: DVec2, at: DVec3, next: DVec3| {
            let (place, weight) =
                if piece.rational { (next.truncate() / next.z, next.z / at.z) } else { (next.truncate(), 1.0) };
            (place - end) * (n as f64 * weight)
        };
        [from(piece.ends[0], control[0], control[1]), -from(piece.ends[1], control[n], control[n - 1])]
    }

    /// Direction of a sealed piece at its start (`end` false) or end, in the direction of its parameter; not a unit
    /// vector, zero only when all control points coincide.
    pub(super) fn tangent(&self, piece: &Piece, end: bool) -> DVec2 {
        let place = |p: &DVec3| if piece.rational { p.truncate() / p.z } else { p.truncate() };
        let control = &self.control[piece.control()];
        let from = piece.ends[usize::from(end)];
        let differs = |p: &DVec2| (*p - from) != DVec2::ZERO;
        if end {
            control.iter().rev().skip(1).map(place).find(differs).map_or(DVec2::ZERO, |p| from - p)
        } else {
            control.iter().skip(1).map(place).find(differs).map_or(DVec2::ZERO, |p| p - from)
        }
    }
}

/// How a piece with these control points `(u, v, w)` runs.
fn run(points: &[DVec3]) -> Run {
    let constant = |of: fn(&DVec3) -> f64| points.iter().all(|p| of(p) == of(&points[0]));
    let monotone = |of: fn(&DVec3) -> f64| {
        points.windows(2).all(|w| of(&w[0]) <= of(&w[1])) || points.windows(2).all(|w| of(&w[0]) >= of(&w[1]))
    };
    if constant(|p| p.x) && monotone(|p| p.y) {
        Run::ConstantU
    } else if constant(|p| p.y) && monotone(|p| p.x) {
        Run::ConstantV
    } else if points.len() == 2 {
        Run::Line
    } else {
        Run::Curved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::nurbs::{Curve2, KnotVector};

    fn curve(degree: usize, knots: &[f64], weights: Option<Vec<f64>>) -> Curve2 {
        let knots = KnotVector::new(degree, knots.to_vec(), "knots").unwrap();
        let control =
            (0..knots.control_count()).map(|i| DVec2::from_angle(i as f64 * 1.3) * (1.0 + i as f64)).collect();
        Curve2::new(knots, control, weights).unwrap()
    }

    #[test]
    fn pieces_are_the_curve_at_every_parameter() {
        let curves = [
            curve(1, &[-1.0, 0.0, 0.5, 2.0, 3.0], None),
            curve(3, &[0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0], None),
            curve(3, &[0.0, 1.0, 1.5, 2.0, 3.5, 4.0, 6.0, 7.0, 8.0], None),
            curve(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 3.0, 3.0, 3.0], Some(vec![1.0, 0.3, 2.0, 0.7, 1.0])),
        ];
        for c in curves {
            let mut pieces = Pieces::default();
            let trim = TrimCurve { shape: TrimShape::Nurbs(c.clone()), reversed: false };
            let range = pieces.push_curve(&trim);
            pieces.seal(range);
            for piece in &pieces.list {
                for k in 0..=20 {
                    let s = f64::from(k) / 20.0;
                    let (got, exact) = (pieces.point(piece, s), c.point(piece.parameter(s)));
                    assert!(got.distance(exact) < 1e-13, "{got} for {exact}");
                }
                let width = piece.t[1] - piece.t[0];
                let [first, last] = pieces.end_derivatives(piece);
                let inside = 1e-9 * width;
                for (d, t) in [(first, piece.t[0] + inside), (last, piece.t[1] - inside)] {
                    assert!((d - c.derivatives(t)[1] * width).length() < 1e-6 * (1.0 + d.length()));
                }
            }
        }
    }

    #[test]
    fn runs_along_a_parameter_line_only_when_it_does_not_turn_back() {
        let run_of = |points: &[[f64; 2]]| {
            let points: Vec<DVec3> = points.iter().map(|p| DVec3::new(p[0], p[1], 1.0)).collect();
            run(&points)
        };
        assert_eq!(run_of(&[[1.0, 0.0], [1.0, 0.5], [1.0, 2.0]]), Run::ConstantU);
        assert_eq!(run_of(&[[3.0, 1.0], [1.0, 1.0]]), Run::ConstantV);
        assert_eq!(run_of(&[[1.0, 0.0], [1.0, 3.0], [1.0, 2.0]]), Run::Curved);
        assert_eq!(run_of(&[[1.0, 0.0], [2.0, 3.0]]), Run::Line);
    }
}
