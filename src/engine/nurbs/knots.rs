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
}
