//! NURBS curves in the plane and in space (thesis 1.1.2).

use glam::{DVec2, DVec3};

use super::basis::{Basis, NARROW, WIDEST};
use super::{KnotVector, NurbsError};

/// What a curve's control points may be: [`DVec2`] in a surface's domain, [`DVec3`] in space.
pub trait Point:
    Copy
    + std::fmt::Debug
    + PartialEq
    + Default
    + Send
    + Sync
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<f64, Output = Self>
{
    /// True when no coordinate is NaN or infinite.
    fn finite(self) -> bool;
}

impl Point for DVec2 {
    fn finite(self) -> bool {
        self.is_finite()
    }
}

impl Point for DVec3 {
    fn finite(self) -> bool {
        self.is_finite()
    }
}

/// A NURBS curve. Weights are `None` when it is not rational.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve<P> {
    knots: KnotVector,
    control: Vec<P>,
    weights: Option<Vec<f64>>,
}

/// A curve in a surface's domain.
pub type Curve2 = Curve<DVec2>;
/// A curve in space.
pub type Curve3 = Curve<DVec3>;

impl<P: Point> Curve<P> {
    /// Checks and keeps a curve.
    ///
    /// # Errors
    /// [`NurbsError`] when counts do not fit, a coordinate is not finite or a weight is not positive.
    pub fn new(knots: KnotVector, control: Vec<P>, weights: Option<Vec<f64>>) -> Result<Self, NurbsError> {
        if control.len() != knots.control_count() {
            return Err(NurbsError::KnotCount {
                what: "knots",
                found: knots.knots().len(),
                expected: control.len() + knots.degree() + 1,
            });
        }
        if let Some(index) = control.iter().position(|p| !p.finite()) {
            return Err(NurbsError::NotFinite { what: "control_points", index });
        }
        if let Some(w) = &weights {
            if w.len() != control.len() {
                return Err(NurbsError::Net { what: "weights", detail: "one weight a control point is needed".into() });
            }
            if let Some(index) = w.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
                return Err(NurbsError::Weight { what: "weights", index });
            }
        }
        Ok(Self { knots, control, weights })
    }

    /// The knot vector.
    #[must_use]
    pub const fn knots(&self) -> &KnotVector {
        &self.knots
    }

    /// The control points.
    #[must_use]
    pub fn control(&self) -> &[P] {
        &self.control
    }

    /// The weights, when rational.
    #[must_use]
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// Keeps parts that are known to fit: the outcome of an operation on a checked curve.
    pub(super) fn from_parts(knots: KnotVector, control: Vec<P>, weights: Option<Vec<f64>>) -> Self {
        Self { knots, control, weights }
    }

    /// First and last parameter.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        self.knots.domain()
    }

    /// The point at `t` (1.5), (1.7). A `t` outside the domain is clamped to it.
    #[must_use]
    pub fn point(&self, t: f64) -> P {
        let [(a, w)] = self.sums::<1>(t);
        if self.weights.is_some() { a * (1.0 / w) } else { a }
    }

    /// The point with its first and second derivative `[C, C', C'']` at `t` (1.8), (1.9); by the quotient rule when
    /// rational. At a knot the derivatives are those from the right, at the domain's end those from inside.
    #[must_use]
    pub fn derivatives(&self, t: f64) -> [P; 3] {
        let [(a, w), (a1, w1), (a2, w2)] = self.sums::<3>(t);
        if self.weights.is_none() {
            return [a, a1, a2];
        }
        let c = a * (1.0 / w);
        let c1 = (a1 - c * w1) * (1.0 / w);
        let c2 = (a2 - c1 * (2.0 * w1) - c * w2) * (1.0 / w);
        [c, c1, c2]
    }

    /// The curve walked from its end to its start, over the same domain `[a, b]`: point `t` of it is point `a + b - t`.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            knots: self.knots.reversed(),
            control: self.control.iter().rev().copied().collect(),
            weights: self.weights.as_ref().map(|w| w.iter().rev().copied().collect()),
        }
    }

    /// The control points whose hull holds the curve between the parameters `from <= to` (both in the domain).
    #[must_use]
    pub fn hull(&self, from: f64, to: f64) -> &[P] {
        let p = self.knots.degree();
        let first = self.knots.span(from) - p;
        let last = self.knots.span(to).max(first + p);
        &self.control[first..=last]
    }

    /// Sums of weighted control points, and of weights, with the functions' derivatives up to `ORDERS - 1`.
    #[inline]
    fn sums<const ORDERS: usize>(&self, t: f64) -> [(P, f64); ORDERS] {
        if self.knots.degree() < NARROW {
            self.sums_with::<ORDERS, NARROW>(t)
        } else {
            self.sums_with::<ORDERS, WIDEST>(t)
        }
    }

    /// [`Self::sums`] with room for `WIDTH` functions.
    #[inline]
    fn sums_with<const ORDERS: usize, const WIDTH: usize>(&self, t: f64) -> [(P, f64); ORDERS] {
        let basis = Basis::<ORDERS, WIDTH>::at(&self.knots, t);
        let mut out = [(P::default(), 0.0); ORDERS];
        for k in 0..=self.knots.degree() {
            let i = basis.first + k;
            let w = self.weights.as_ref().map_or(1.0, |w| w[i]);
            for (sum, row) in out.iter_mut().zip(&basis.rows) {
                let n = row[k] * w;
                sum.0 = sum.0 + self.control[i] * n;
                sum.1 += n;
            }
        }
        out
    }
}
