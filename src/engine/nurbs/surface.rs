//! NURBS surfaces: storage and evaluation at single points (thesis 1.1.3, (1.10) and (1.13) to (1.18)).
//!
//! Basis functions live on the stack and nothing is allocated. Parameters outside the domain are clamped to it. At a knot
//! the derivatives are those from the right, at the domain's ends those from inside. Whole grids: [`Surface::grid`].

use glam::DVec3;

use super::basis::{Basis, NARROW, WIDEST};
use super::{KnotVector, NurbsError};

/// A rectangle of parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// First and last u.
    pub u: [f64; 2],
    /// First and last v.
    pub v: [f64; 2],
}

impl Domain {
    /// `(u, v)`, clamped to the domain, moved by the part `step` of the way to the opposite corner (in each direction to
    /// the end that is farther away, so that every point does move).
    #[must_use]
    pub fn inwards(&self, u: f64, v: f64, step: f64) -> [f64; 2] {
        let move_in = |t: f64, [a, b]: [f64; 2]| {
            let t = t.clamp(a, b);
            let far = if t - a > b - t { a } else { b };
            t + (far - t) * step
        };
        [move_in(u, self.u), move_in(v, self.v)]
    }
}

/// A point of a surface with its first and second derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceDerivatives {
    /// The point.
    pub s: DVec3,
    /// dS/du.
    pub su: DVec3,
    /// dS/dv.
    pub sv: DVec3,
    /// d2S/du2.
    pub suu: DVec3,
    /// d2S/dudv.
    pub suv: DVec3,
    /// d2S/dv2.
    pub svv: DVec3,
}

/// A NURBS surface: control point `(i, j)` stands at `control[i * nv + j]`. Weights are `None` when it is not rational.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    knots_u: KnotVector,
    knots_v: KnotVector,
    control: Vec<DVec3>,
    weights: Option<Vec<f64>>,
    /// Length of the longest line of the control net along u and along v: a measure for what is degenerate.
    reach: [f64; 2],
}

impl Surface {
    /// Checks and keeps a surface.
    ///
    /// # Errors
    /// [`NurbsError`] when counts do not fit, a coordinate is not finite or a weight is not positive.
    pub fn new(
        knots_u: KnotVector,
        knots_v: KnotVector,
        control: Vec<DVec3>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, NurbsError> {
        let expected = knots_u.control_count() * knots_v.control_count();
        if control.len() != expected {
            return Err(NurbsError::Net {
                what: "control_points",
                detail: format!(
                    "{} points where the knots ask for {} x {}",
                    control.len(),
                    knots_u.control_count(),
                    knots_v.control_count()
                ),
            });
        }
        if let Some(index) = control.iter().position(|p| !p.is_finite()) {
            return Err(NurbsError::NotFinite { what: "control_points", index });
        }
        if let Some(w) = &weights {
            if w.len() != expected {
                return Err(NurbsError::Net { what: "weights", detail: "one weight a control point is needed".into() });
            }
            if let Some(index) = w.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
                return Err(NurbsError::Weight { what: "weights", index });
            }
        }
        Ok(Self::from_parts(knots_u, knots_v, control, weights))
    }

    /// Knots along u.
    #[must_use]
    pub const fn knots_u(&self) -> &KnotVector {
        &self.knots_u
    }

    /// Knots along v.
    #[must_use]
    pub const fn knots_v(&self) -> &KnotVector {
        &self.knots_v
    }

    /// The control net, u slowest.
    #[must_use]
    pub fn control(&self) -> &[DVec3] {
        &self.control
    }

    /// The weights, in the order of the net, when rational.
    #[must_use]
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// The domain.
    #[must_use]
    pub fn domain(&self) -> Domain {
        Domain { u: self.knots_u.domain(), v: self.knots_v.domain() }
    }

    /// Keeps parts that are known to fit. Weights that are all equal cancel (thesis 1.1.2) and are dropped.
    pub(super) fn from_parts(
        knots_u: KnotVector,
        knots_v: KnotVector,
        control: Vec<DVec3>,
        weights: Option<Vec<f64>>,
    ) -> Self {
        let weights = weights.filter(|w| w.iter().any(|x| *x != w[0]));
        let nv = knots_v.control_count();
        let along_v = control.chunks_exact(nv).map(|row| length(row.iter())).fold(0.0, f64::max);
        let along_u = (0..nv).map(|j| length(control.iter().skip(j).step_by(nv))).fold(0.0, f64::max);
        Self { knots_u, knots_v, control, weights, reach: [along_u, along_v] }
    }

    /// Length of the longest line of the control net along u and along v.
    pub(super) const fn reach(&self) -> [f64; 2] {
        self.reach
    }

    /// The point at `(u, v)`.
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        let [[(a, w)]] = self.sums::<1>(u, v);
        self.project(a, w)
    }

    /// The point with its first derivatives: `(S, Su, Sv)`.
    #[must_use]
    pub fn first_derivatives(&self, u: f64, v: f64) -> (DVec3, DVec3, DVec3) {
        let [[(a, w), (av, wv)], [(au, wu), _]] = self.sums::<2>(u, v);
        let s = self.project(a, w);
        (s, self.project(au - s * wu, w), self.project(av - s * wv, w))
    }

    /// The point with its first and second derivatives; by the quotient rule when rational.
    #[must_use]
    pub fn derivatives(&self, u: f64, v: f64) -> SurfaceDerivatives {
        let [[a, av, avv], [au, auv, _], [auu, ..]] = self.sums::<3>(u, v);
        SurfaceDerivatives::from_weighted([a, au, av, auu, auv, avv], self.weights.is_some())
    }

    /// The point of a weighted sum.
    fn project(&self, sum: DVec3, w: f64) -> DVec3 {
        if self.weights.is_some() { sum / w } else { sum }
    }

    /// Sums of weighted control points, and of weights: `[i][j]` with the i-th derivative along u and the j-th along v.
    /// Without weights the sums of weights are zero and not used.
    #[inline]
    fn sums<const ORDERS: usize>(&self, u: f64, v: f64) -> [[(DVec3, f64); ORDERS]; ORDERS] {
        let narrow = self.knots_u.degree().max(self.knots_v.degree()) < NARROW;
        match (&self.weights, narrow) {
            (None, true) => self.sums_with::<ORDERS, NARROW>(u, v, |k| (self.control[k], 0.0)),
            (None, false) => self.sums_with::<ORDERS, WIDEST>(u, v, |k| (self.control[k], 0.0)),
            (Some(w), true) => self.sums_with::<ORDERS, NARROW>(u, v, |k| (self.control[k] * w[k], w[k])),
            (Some(w), false) => self.sums_with::<ORDERS, WIDEST>(u, v, |k| (self.control[k] * w[k], w[k])),
        }
    }

    /// [`Self::sums`] of the weighted points and weights that `point` gives.
    #[inline]
    fn sums_with<const ORDERS: usize, const WIDTH: usize>(
        &self,
        u: f64,
        v: f64,
        point: impl Fn(usize) -> (DVec3, f64),
    ) -> [[(DVec3, f64); ORDERS]; ORDERS] {
        let bu = Basis::<ORDERS, WIDTH>::at(&self.knots_u, u);
        let bv = Basis::<ORDERS, WIDTH>::at(&self.knots_v, v);
        let nv = self.knots_v.control_count();
        let mut out = [[(DVec3::ZERO, 0.0); ORDERS]; ORDERS];
        for k in 0..=self.knots_u.degree() {
            let start = (bu.first + k) * nv + bv.first;
            let mut row = [(DVec3::ZERO, 0.0); ORDERS];
            for l in 0..=self.knots_v.degree() {
                let (p, w) = point(start + l);
                for (sum, functions) in row.iter_mut().zip(&bv.rows) {
                    sum.0 += p * functions[l];
                    sum.1 += w * functions[l];
                }
            }
            for (line, functions) in out.iter_mut().zip(&bu.rows) {
                for (sum, part) in line.iter_mut().zip(&row) {
                    sum.0 += part.0 * functions[k];
                    sum.1 += part.1 * functions[k];
                }
            }
        }
        out
    }
}

impl SurfaceDerivatives {
    /// From weighted sums `[A, Au, Av, Auu, Auv, Avv]`, each with its sum of weights, by the quotient rule when rational.
    pub(super) fn from_weighted(sums: [(DVec3, f64); 6], rational: bool) -> Self {
        let [(a, w), (au, wu), (av, wv), (auu, wuu), (auv, wuv), (avv, wvv)] = sums;
        if !rational {
            return Self { s: a, su: au, sv: av, suu: auu, suv: auv, svv: avv };
        }
        let s = a / w;
        let su = (au - s * wu) / w;
        let sv = (av - s * wv) / w;
        Self {
            s,
            su,
            sv,
            suu: (auu - su * (2.0 * wu) - s * wuu) / w,
            suv: (auv - sv * wu - su * wv - s * wuv) / w,
            svv: (avv - sv * (2.0 * wv) - s * wvv) / w,
        }
    }
}

/// Length of a polyline.
fn length<'a>(points: impl Iterator<Item = &'a DVec3> + Clone) -> f64 {
    points.clone().zip(points.skip(1)).map(|(a, b)| a.distance(*b)).sum()
}
