//! NURBS surfaces (thesis 1.1.3).

use glam::DVec3;

use super::{KnotVector, NurbsError};

/// A rectangle of parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// First and last u.
    pub u: [f64; 2],
    /// First and last v.
    pub v: [f64; 2],
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
        Ok(Self { knots_u, knots_v, control, weights })
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
}
