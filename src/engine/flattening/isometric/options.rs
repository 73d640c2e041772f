//! What is asked of the isometric method.

use serde::{Deserialize, Serialize};

use super::constraints::{Kept, Pin};

/// Which distortion is made least.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// Symmetric Dirichlet: stretching and shrinking count alike, area and shape weigh evenly.
    #[default]
    Balanced,
    /// As rigid as possible: the squares of the strains.
    Arap,
    /// Areas first: lengths give way.
    Area,
    /// Lengths first: the least mean change of lengths.
    Shape,
    /// How much the mean change of area and the mean change of angles weigh. A job gives them by themselves.
    #[serde(skip)]
    Weights {
        /// Weight of the change of area, above nought.
        area: f64,
        /// Weight of the change of angles, above nought.
        shape: f64,
    },
}

/// Weights of area and of angles for [`Objective::Area`]. With more weight the change of area hardly falls on real panels
/// (what is left is the softening), while lengths and the solver's time go up.
const AREA_FIRST: [f64; 2] = [10.0, 1.0];

/// The same for [`Objective::Shape`]: on real panels the mean change of lengths is least near this ratio. With more
/// weight on angles maps come near conformal ones, whose lengths change more.
const SHAPE_FIRST: [f64; 2] = [3.0, 1.0];

/// Greatest ratio of the weights: beyond it the lighter part drowns in rounding.
const WEIGHT_RANGE: f64 = 1e4;

impl Objective {
    /// The objective's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Balanced => "balanced",
            Self::Arap => "arap",
            Self::Area => "area",
            Self::Shape => "shape",
            Self::Weights { .. } => "weights",
        }
    }

    /// Why weights cannot be used, if they cannot.
    ///
    /// # Errors
    /// In words.
    pub fn check(self) -> Result<(), String> {
        self.weights().map(|_| ())
    }

    /// The weights of area and shape, the greater one 1, for the objectives that have any; `Err` with the reason when
    /// they cannot be used.
    pub(super) fn weights(self) -> Result<Option<[f64; 2]>, String> {
        let [area, shape] = match self {
            Self::Balanced | Self::Arap => return Ok(None),
            Self::Area => AREA_FIRST,
            Self::Shape => SHAPE_FIRST,
            Self::Weights { area, shape } => [area, shape],
        };
        let (least, most) = (area.min(shape), area.max(shape));
        if area.is_finite() && shape.is_finite() && least > 0.0 && most <= WEIGHT_RANGE * least {
            Ok(Some([area / most, shape / most]))
        } else {
            Err(format!("weights must be above 0 and at most {WEIGHT_RANGE} times each other, not {area} and {shape}"))
        }
    }
}

/// How a mesh is to be flattened with the least distortion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IsometricOptions {
    /// Which distortion is made least.
    pub objective: Objective,
    /// Points that are to lie at given places.
    pub pins: Vec<Pin>,
    /// Borders whose lengths are kept.
    pub keep: Vec<Kept>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_checked_and_scaled() {
        assert_eq!(Objective::Balanced.weights(), Ok(None));
        assert_eq!(Objective::Area.weights(), Ok(Some([1.0, 0.1])));
        assert_eq!(Objective::Weights { area: 2.0, shape: 8.0 }.weights(), Ok(Some([0.25, 1.0])));
        for (area, shape) in
            [(0.0, 1.0), (-1.0, 1.0), (f64::NAN, 1.0), (1.0, f64::NAN), (1.0, 1e5), (f64::INFINITY, 1.0)]
        {
            assert!(Objective::Weights { area, shape }.weights().is_err(), "{area} {shape}");
        }
    }
}
