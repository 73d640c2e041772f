//! How a pattern is to lie.

use serde::{Deserialize, Serialize};

/// The side one looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// The show side.
    #[default]
    Show,
    /// The back: the mirror image.
    Back,
}

/// Which direction of the surface is turned to `to_deg`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Align {
    /// The surface's u direction at the part's area centroid.
    #[default]
    U,
    /// Its v direction there.
    V,
    /// A direction in the domain.
    Uv([f64; 2]),
    /// A direction in space.
    Xyz([f64; 3]),
}

/// The `placement` object of a job.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Placement {
    /// The side.
    pub view: View,
    /// The direction.
    pub align: Align,
    /// Where that direction points in the pattern, degrees anticlockwise from +x.
    pub to_deg: f64,
}
