//! What is asked of the isometric method.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::energy::Energy;

/// Which distortion is made least.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// Symmetric Dirichlet: stretching and shrinking count alike, lengths and areas weigh evenly.
    #[default]
    Balanced,
    /// As rigid as possible: the squares of the strains.
    Arap,
    /// Areas first: lengths give way.
    Area,
    /// Angles first: areas give way.
    Shape,
    /// Between these: how much changes of area and of shape weigh. `Balanced` is one of each.
    Weights {
        /// Weight of the change of area.
        area: f64,
        /// Weight of the change of shape.
        shape: f64,
    },
}

/// Weight of areas for [`Objective::Area`]: the change of area falls with its inverse, while what is left of it soon no
/// longer matters beside the mesh's own error; each power of ten costs the solver some steps.
const AREA_FIRST: f64 = 300.0;

/// Weight of areas for [`Objective::Shape`]. Without any, patterns grow and shrink at will for a little angle.
const SHAPE_FIRST: f64 = 0.05;

/// Least and greatest ratio of weights: beyond, the stiff part drowns the other in rounding.
const WEIGHT_RANGE: f64 = 1e5;

impl Objective {
    /// The energy that measures it. `None` when weights are negative, not numbers, or too far apart.
    #[must_use]
    pub(crate) fn energy(self) -> Option<Energy> {
        let weighted = |area: f64, shape: f64| {
            let (least, most) = (area.min(shape), area.max(shape));
            (area.is_finite() && least > 0.0 && most <= WEIGHT_RANGE * least)
                .then(|| Energy::Weighted { area: area / most, shape: shape / most })
        };
        match self {
            Self::Balanced => weighted(1.0, 1.0),
            Self::Arap => Some(Energy::Arap { barrier: 0.0 }),
            Self::Area => weighted(AREA_FIRST, 1.0),
            Self::Shape => weighted(SHAPE_FIRST, 1.0),
            Self::Weights { area, shape } => weighted(area, shape),
        }
    }
}

/// A vertex that is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pin {
    /// The vertex.
    pub vertex: u32,
    /// Its place in the pattern, millimetres.
    pub at: DVec2,
}

/// How a mesh is to be flattened with the least distortion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IsometricOptions {
    /// Which distortion is made least.
    pub objective: Objective,
    /// Vertices that are held.
    pub pins: Vec<Pin>,
}
