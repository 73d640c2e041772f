//! Knot vectors (thesis 1.2).

use super::NurbsError;

/// The largest degree that is supported. Basis functions live in arrays of this size plus one on the stack.
pub const MAX_DEGREE: usize = 25;

/// A non-decreasing sequence of knots with its degree, clamped or not. The domain is `[knots[p], knots[len - p - 1]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct KnotVector {
    degree: usize,
    knots: Vec<f64>,
}

impl KnotVector {
    /// Checks and keeps a knot vector.
    ///
    /// # Errors
    /// [`NurbsError`] with the field name `what` when the degree, order, multiplicity or size of a knot does not do.
    pub fn new(degree: usize, knots: Vec<f64>, what: &'static str) -> Result<Self, NurbsError> {
        if degree == 0 || degree > MAX_DEGREE {
            return Err(NurbsError::Degree { what, degree, max: MAX_DEGREE });
        }
        if knots.len() < 2 * (degree + 1) {
            return Err(NurbsError::KnotCount { what, found: knots.len(), expected: 2 * (degree + 1) });
        }
        if let Some(index) = knots.iter().position(|k| !k.is_finite()) {
            return Err(NurbsError::NotFinite { what, index });
        }
        if let Some(index) = knots.windows(2).position(|w| w[1] < w[0]) {
            return Err(NurbsError::KnotOrder { what, index: index + 1 });
        }
        if let Some(index) = knots.windows(degree + 2).position(|w| w[0] == w[degree + 1]) {
            return Err(NurbsError::KnotMultiplicity { what, index });
        }
        if knots[degree] >= knots[knots.len() - degree - 1] {
            return Err(NurbsError::KnotMultiplicity { what, index: degree });
        }
        Ok(Self { degree, knots })
    }

    /// The degree `p`.
    #[must_use]
    pub const fn degree(&self) -> usize {
        self.degree
    }

    /// All knots.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// How many control points go with this vector.
    #[must_use]
    pub fn control_count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// First and last parameter of the domain.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.knots.len() - self.degree - 1]]
    }

    /// Index `s` of the span that `t` is evaluated in: `knots[s] <= t < knots[s + 1]`, and the last span that is not
    /// empty where `t` is the domain's end or beyond it (so ends are evaluated from inside, and (1.2a) is half open).
    #[must_use]
    pub fn span(&self, t: f64) -> usize {
        let first = self.degree;
        let last = self.control_count() - 1;
        let inside = &self.knots[first..=last + 1];
        let mut s = first + inside.partition_point(|&k| k <= t).saturating_sub(1);
        s = s.min(last);
        while s > first && self.knots[s] >= self.knots[s + 1] {
            s -= 1;
        }
        while s < last && self.knots[s] >= self.knots[s + 1] {
            s += 1;
        }
        s
    }

    /// `t` moved into the domain.
    #[must_use]
    pub fn clamp(&self, t: f64) -> f64 {
        let [a, b] = self.domain();
        t.clamp(a, b)
    }

    /// Indices of the spans of the domain that are not empty, in order. There is at least one.
    pub fn spans(&self) -> impl Iterator<Item = usize> + '_ {
        (self.degree..self.control_count()).filter(|&s| self.knots[s] < self.knots[s + 1])
    }

    /// The distinct knots of the domain, its ends included, in order. There are at least two.
    #[must_use]
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks: Vec<f64> = self.spans().map(|s| self.knots[s]).collect();
        breaks.push(self.domain()[1]);
        breaks
    }

    /// How often `t` occurs among the knots.
    #[must_use]
    pub fn multiplicity(&self, t: f64) -> usize {
        self.knots.iter().filter(|&&k| k == t).count()
    }

    /// The vector with `t` once more in its place. `t` is a number of the domain; the caller has checked the multiplicity.
    pub(super) fn with(&self, t: f64) -> Self {
        let mut knots = self.knots.clone();
        knots.insert(knots.partition_point(|&k| k <= t), t);
        Self { degree: self.degree, knots }
    }

    /// The vector walked backwards over the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let [a, b] = self.domain();
        let mirror = |k: f64| {
            if k == a {
                b
            } else if k == b {
                a
            } else if k < a {
                (a + b - k).max(b)
            } else if k > b {
                (a + b - k).min(a)
            } else {
                (a + b - k).clamp(a, b)
            }
        };
        Self { degree: self.degree, knots: self.knots.iter().rev().map(|&k| mirror(k)).collect() }
    }

    /// The clamped vector of one Bezier segment over `domain`.
    pub(super) fn bezier(degree: usize, domain: [f64; 2]) -> Self {
        let mut knots = vec![domain[0]; degree + 1];
        knots.resize(2 * (degree + 1), domain[1]);
        Self { degree, knots }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knots(degree: usize, values: &[f64]) -> KnotVector {
        KnotVector::new(degree, values.to_vec(), "knots").expect("valid")
    }

    #[test]
    fn a_span_is_half_open_save_the_last() {
        let k = knots(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 9.0].map(|t| k.span(t)), [2, 2, 2, 4, 4, 4, 4]);
        assert_eq!(k.breaks(), [0.0, 1.0, 2.0]);
    }

    #[test]
    fn the_domain_of_unclamped_knots_lies_inside_them() {
        let k = knots(3, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert_eq!(k.domain(), [3.0, 5.0]);
        assert_eq!([0.0, 3.0, 4.0, 5.0, 8.0].map(|t| k.span(t)), [3, 3, 4, 4, 4]);
        assert_eq!(k.clamp(7.0), 5.0);
        assert_eq!(k.reversed().domain(), [3.0, 5.0]);
    }

    #[test]
    fn an_interior_knot_may_be_repeated_degree_plus_one_times() {
        let k = knots(1, &[0.0, 0.0, 1.0, 1.0, 2.0, 2.0]);
        assert_eq!([0.5, 1.0, 2.0].map(|t| k.span(t)), [1, 3, 3]);
        assert_eq!(k.multiplicity(1.0), 2);
        assert!(KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0], "knots").is_err());
    }

    #[test]
    fn a_span_that_is_empty_at_the_end_of_the_domain_is_never_used() {
        // Multiplicity degree + 1 just before the end leaves empty spans next to it.
        let k = knots(1, &[0.0, 0.0, 1.0, 1.0]);
        assert_eq!(k.span(1.0), 1);
        assert_eq!(k.reversed(), k);
    }
}
