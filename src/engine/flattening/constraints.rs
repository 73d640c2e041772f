//! What a job asks of the flattening beside the least distortion: the very names that it uses.

use serde::{Deserialize, Serialize};

/// Most pins of a job. Each costs next to nothing; more are no pattern that somebody wants pinned but a map that somebody
/// has already.
pub const MAX_PINS: usize = 1000;

/// Most entries of `keep`.
pub const MAX_KEEPS: usize = 100;

/// Farthest target from the pattern's origin along either axis, mm: ten kilometres. Beyond, coordinates would lose digits
/// that a cutter sees.
pub const MAX_TARGET: f64 = 1e7;

/// Greatest weight of a kept length. Beyond it nothing changes any more but the digits that are lost.
pub const MAX_KEEP_WEIGHT: f64 = 1e6;

/// A point of the part that is to lie at a place of the pattern.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PinAt {
    /// The point.
    pub at: PinPlace,
    /// Where it is to lie, mm.
    pub to_mm: [f64; 2],
}

/// A point of the part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PinPlace {
    /// In the surface's domain.
    Uv([f64; 2]),
    /// In space, mm.
    Xyz([f64; 3]),
}

impl PinPlace {
    /// Its coordinates.
    #[must_use]
    pub const fn coordinates(&self) -> &[f64] {
        match self {
            Self::Uv(uv) => uv,
            Self::Xyz(xyz) => xyz,
        }
    }
}

/// A boundary curve whose length is to be kept.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keep {
    /// Which.
    pub curve: KeepCurve,
    /// How.
    #[serde(default)]
    pub length: KeepLength,
    /// How much it weighs beside the distortion of the whole, above 0.
    #[serde(default = "usual_weight")]
    pub weight: f64,
}

/// Weight of a kept length where none is given: the border then has by far the most of its length, and the rest is not yet
/// ruled by it.
pub const DEFAULT_KEEP_WEIGHT: f64 = 10.0;

const fn usual_weight() -> f64 {
    DEFAULT_KEEP_WEIGHT
}

/// Which curves are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeepCurve {
    /// `"borders"`: every boundary of the part.
    Borders,
    /// `{ "border": i }`: one, counted as the report's `distortion.boundary` does.
    Border(u32),
}

/// How a length is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeepLength {
    /// As far as its weight goes against the distortion.
    #[default]
    Soft,
}
