//! NURBS curves in the plane and in space (thesis 1.1.2).

use glam::{DVec2, DVec3};

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
}
