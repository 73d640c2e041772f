//! Knot insertion and Bezier form (thesis 1.2.3, 1.3.2).
//!
//! Insertion is Boehm's (The NURBS Book, A5.1), one knot at a time. The Bezier points of a span are values of its blossom:
//! `b_j = f(a, .., a, b, .., b)` with `j` times the span's end `b`, found by de Boor's scheme with one argument a step
//! (Ramshaw 1989). Only convex combinations occur, spans do not depend on each other, and clamped, unclamped and
//! repeated knots need no cases of their own. Weights go along as one more coordinate.

use glam::DVec3;

use super::{Curve, Domain, KnotVector, NurbsError, Point, Surface};

/// A control point in homogeneous form: `p` is the weighted point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Weighted<P> {
    /// Weight times point.
    pub(super) p: P,
    /// Weight.
    pub(super) w: f64,
}

impl<P: Point> Weighted<P> {
    /// The homogeneous form of a point.
    pub(super) fn new(point: P, weight: f64) -> Self {
        Self { p: point * weight, w: weight }
    }

    /// `(1 - a) self + a other`.
    fn mix(self, other: Self, a: f64) -> Self {
        Self { p: self.p * (1.0 - a) + other.p * a, w: self.w * (1.0 - a) + other.w * a }
    }
}

/// Homogeneous points of a net; weights of one when there are none.
pub(super) fn weighted<P: Point>(control: &[P], weights: Option<&[f64]>) -> Vec<Weighted<P>> {
    match weights {
        Some(w) => control.iter().zip(w).map(|(&p, &w)| Weighted::new(p, w)).collect(),
        None => control.iter().map(|&p| Weighted { p, w: 1.0 }).collect(),
    }
}

/// Points and weights of homogeneous points; no weights when the source was not rational.
pub(super) fn projected<P: Point>(points: &[Weighted<P>], rational: bool) -> (Vec<P>, Option<Vec<f64>>) {
    if rational {
        (points.iter().map(|h| h.p * (1.0 / h.w)).collect(), Some(points.iter().map(|h| h.w).collect()))
    } else {
        (points.iter().map(|h| h.p).collect(), None)
    }
}

/// Checks that `t` can be inserted `times` times: inside the domain, to a multiplicity of at most degree + 1.
pub(super) fn check_insertion(knots: &KnotVector, t: f64, times: usize, what: &'static str) -> Result<(), NurbsError> {
    let [a, b] = knots.domain();
    let most = knots.degree() + 1;
    if !(a..=b).contains(&t) || times > most || knots.multiplicity(t) + times > most {
        return Err(NurbsError::Insertion { what, value: t, times });
    }
    Ok(())
}

/// The points of one line of control points after `t` is inserted once into `knots` (Boehm).
pub(super) fn insert_once<P: Point>(knots: &KnotVector, t: f64, line: &[Weighted<P>]) -> Vec<Weighted<P>> {
    let k = knots.knots();
    let p = knots.degree();
    let last = k.partition_point(|&k| k <= t) - 1;
    let repeated = knots.multiplicity(t);
    let mut out = Vec::with_capacity(line.len() + 1);
    for i in 0..=line.len() {
        out.push(if i + p <= last {
            line[i]
        } else if i + repeated <= last {
            line[i - 1].mix(line[i], (t - k[i]) / (k[i + p] - k[i]))
        } else {
            line[i - 1]
        });
    }
    out
}

/// The Bezier points of a span of a line of control points.
fn span_points<P: Point>(knots: &KnotVector, span: usize, line: &[Weighted<P>]) -> Vec<Weighted<P>> {
    let p = knots.degree();
    let k = knots.knots();
    let (a, b) = (k[span], k[span + 1]);
    let mut scheme = vec![Weighted::default(); p + 1];
    (0..=p)
        .map(|j| {
            scheme.copy_from_slice(&line[span - p..=span]);
            for step in 1..=p {
                let t = if step <= j { b } else { a };
                for i in (step..=p).rev() {
                    let low = k[span - p + i];
                    let high = k[span + 1 + i - step];
                    scheme[i] = scheme[i - 1].mix(scheme[i], (t - low) / (high - low));
                }
            }
            scheme[p]
        })
        .collect()
}

/// One Bezier segment of a curve: `degree + 1` control points over `domain`.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierSegment<P> {
    /// First and last parameter on the curve.
    pub domain: [f64; 2],
    /// Control points.
    pub control: Vec<P>,
    /// Weights, when rational.
    pub weights: Option<Vec<f64>>,
}

impl<P: Point> BezierSegment<P> {
    /// The segment as a curve of its own, with the parameters of the curve it is from.
    #[must_use]
    pub fn to_curve(&self) -> Curve<P> {
        let knots = KnotVector::bezier(self.control.len() - 1, self.domain);
        Curve::from_parts(knots, self.control.clone(), self.weights.clone())
    }
}

/// One Bezier patch of a surface: `(degree_u + 1) (degree_v + 1)` control points over `domain`, u slowest.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierPatch {
    /// Parameters on the surface.
    pub domain: Domain,
    /// Degree along u.
    pub degree_u: usize,
    /// Degree along v.
    pub degree_v: usize,
    /// Control points; `(i, j)` at `i * (degree_v + 1) + j`.
    pub control: Vec<DVec3>,
    /// Weights, when rational.
    pub weights: Option<Vec<f64>>,
}

impl BezierPatch {
    /// The patch as a surface of its own, with the parameters of the surface it is from.
    #[must_use]
    pub fn to_surface(&self) -> Surface {
        Surface::from_parts(
            KnotVector::bezier(self.degree_u, self.domain.u),
            KnotVector::bezier(self.degree_v, self.domain.v),
            self.control.clone(),
            self.weights.clone(),
        )
    }
}

impl<P: Point> Curve<P> {
    /// The same curve with `t` inserted `times` times.
    ///
    /// # Errors
    /// [`NurbsError::Insertion`] when `t` lies outside the domain or would be repeated more than degree + 1 times.
    pub fn insert_knot(&self, t: f64, times: usize) -> Result<Self, NurbsError> {
        check_insertion(self.knots(), t, times, "t")?;
        let mut knots = self.knots().clone();
        let mut line = weighted(self.control(), self.weights());
        for _ in 0..times {
            line = insert_once(&knots, t, &line);
            knots = knots.with(t);
        }
        let (control, weights) = projected(&line, self.weights().is_some());
        Ok(Self::from_parts(knots, control, weights))
    }

    /// The curve's Bezier segments, one a span that is not empty, in order.
    #[must_use]
    pub fn to_bezier(&self) -> Vec<BezierSegment<P>> {
        let line = weighted(self.control(), self.weights());
        let knots = self.knots();
        knots
            .spans()
            .map(|s| {
                let (control, weights) = projected(&span_points(knots, s, &line), self.weights().is_some());
                BezierSegment { domain: [knots.knots()[s], knots.knots()[s + 1]], control, weights }
            })
            .collect()
    }
}

/// Applies `change` to every column (along u) of a net with `nv` columns; all results have one length.
fn along_u(
    net: &[Weighted<DVec3>],
    nv: usize,
    change: impl Fn(&[Weighted<DVec3>]) -> Vec<Weighted<DVec3>>,
) -> Vec<Weighted<DVec3>> {
    let columns: Vec<Vec<_>> =
        (0..nv).map(|j| change(&net.iter().skip(j).step_by(nv).copied().collect::<Vec<_>>())).collect();
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows).flat_map(|i| columns.iter().map(move |c| c[i])).collect()
}

/// Applies `change` to every row (along v) of a net with `nv` columns.
fn along_v(
    net: &[Weighted<DVec3>],
    nv: usize,
    change: impl Fn(&[Weighted<DVec3>]) -> Vec<Weighted<DVec3>>,
) -> Vec<Weighted<DVec3>> {
    net.chunks_exact(nv).flat_map(change).collect()
}

impl Surface {
    /// The same surface with the given knots inserted along u (a knot given twice is inserted twice).
    ///
    /// # Errors
    /// [`NurbsError::Insertion`] as for [`Curve::insert_knot`].
    pub fn insert_knots_u(&self, values: &[f64]) -> Result<Self, NurbsError> {
        let mut knots = self.knots_u().clone();
        let nv = self.knots_v().control_count();
        let mut net = weighted(self.control(), self.weights());
        for &t in values {
            check_insertion(&knots, t, 1, "u")?;
            net = along_u(&net, nv, |line| insert_once(&knots, t, line));
            knots = knots.with(t);
        }
        let (control, weights) = projected(&net, self.weights().is_some());
        Ok(Self::from_parts(knots, self.knots_v().clone(), control, weights))
    }

    /// The same surface with the given knots inserted along v.
    ///
    /// # Errors
    /// [`NurbsError::Insertion`] as for [`Curve::insert_knot`].
    pub fn insert_knots_v(&self, values: &[f64]) -> Result<Self, NurbsError> {
        let mut knots = self.knots_v().clone();
        let mut net = weighted(self.control(), self.weights());
        for &t in values {
            check_insertion(&knots, t, 1, "v")?;
            net = along_v(&net, knots.control_count(), |line| insert_once(&knots, t, line));
            knots = knots.with(t);
        }
        let (control, weights) = projected(&net, self.weights().is_some());
        Ok(Self::from_parts(self.knots_u().clone(), knots, control, weights))
    }

    /// The surface's Bezier patches, one a pair of spans that are not empty; u spans slowest.
    #[must_use]
    pub fn to_bezier(&self) -> Vec<BezierPatch> {
        let (ku, kv) = (self.knots_u(), self.knots_v());
        let net = weighted(self.control(), self.weights());
        let nv = kv.control_count();
        let mut patches = Vec::new();
        for su in ku.spans() {
            let strip = along_u(&net, nv, |line| span_points(ku, su, line));
            for sv in kv.spans() {
                let points = along_v(&strip, nv, |line| span_points(kv, sv, line));
                let (control, weights) = projected(&points, self.weights().is_some());
                patches.push(BezierPatch {
                    domain: Domain { u: [ku.knots()[su], ku.knots()[su + 1]], v: [kv.knots()[sv], kv.knots()[sv + 1]] },
                    degree_u: ku.degree(),
                    degree_v: kv.degree(),
                    control,
                    weights,
                });
            }
        }
        patches
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::nurbs::shapes::{circle2, knots, sphere};

    #[test]
    fn a_circle_in_bezier_form_is_four_quarters_of_it() {
        let circle = circle2(glam::DVec2::new(1.0, 2.0), 3.0);
        let quarters = circle.to_bezier();
        assert_eq!(quarters.len(), 4);
        for quarter in &quarters {
            let curve = quarter.to_curve();
            for k in 0..=10 {
                let t = quarter.domain[0] + 0.1 * f64::from(k);
                assert!((curve.point(t).distance(glam::DVec2::new(1.0, 2.0)) - 3.0).abs() < 1e-13);
                assert!(curve.point(t).distance(circle.point(t)) < 1e-13);
            }
        }
    }

    #[test]
    fn a_knot_that_does_not_fit_is_refused() {
        let circle = circle2(glam::DVec2::ZERO, 1.0);
        for (t, times) in [(-0.1, 1), (4.1, 1), (f64::NAN, 1), (1.0, 2), (0.0, 1), (0.5, 4)] {
            let refused = circle.insert_knot(t, times);
            assert!(matches!(refused, Err(NurbsError::Insertion { .. })), "{t} x {times}");
        }
        assert!(sphere(1.0).insert_knots_u(&[0.5, 0.5, 0.5, 0.5]).is_err());
        assert!(sphere(1.0).insert_knots_v(&[f64::INFINITY]).is_err());
    }

    #[test]
    fn unclamped_ends_can_be_clamped_by_insertion() {
        let points = (0..6).map(|k| glam::DVec2::new(f64::from(k), f64::from(k * k % 5))).collect();
        let curve =
            Curve::new(knots(3, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]), points, None).expect("valid");
        let clamped = curve.insert_knot(3.0, 3).and_then(|c| c.insert_knot(6.0, 3)).expect("the knots fit");
        for k in 0..=30 {
            let t = 3.0 + 0.1 * f64::from(k);
            assert!(clamped.point(t).distance(curve.point(t)) < 1e-13);
        }
        assert!(clamped.hull(6.0, 6.0).iter().any(|p| p.distance(curve.point(6.0)) < 1e-13));
    }
}
