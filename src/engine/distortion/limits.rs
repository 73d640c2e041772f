//! Limits that a pattern is judged by, and the verdict.

use serde::{Deserialize, Serialize};

/// The `limits` object of a job. A limit that is absent is not judged.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Largest strain (99th percentile by area), percent: the material is stretched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stretch_percent: Option<f64>,
    /// Largest compression (1st percentile by area, as a positive number), percent: the material is gathered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compression_percent: Option<f64>,
    /// Largest absolute area change (4.9), percent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_percent: Option<f64>,
    /// Largest absolute shape change (4.10), percent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape_percent: Option<f64>,
    /// Largest shear angle (99th percentile by area), degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_deg: Option<f64>,
    /// Largest difference of a boundary's length in 2D and on the surface, percent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub boundary_percent: Option<f64>,
}

/// Changes below these do not count in the averages of Tables 5.7 and 5.8.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Thresholds {
    /// Area, mm^2.
    pub area_mm2: f64,
    /// Length, mm.
    pub length_mm: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { area_mm2: 0.1, length_mm: 0.1 }
    }
}

/// What the verdict says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VerdictResult {
    /// All limits are kept.
    Pass,
    /// Some limit is not.
    Fail,
    /// No limits were given.
    #[default]
    Unchecked,
}

/// One limit against its value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LimitCheck {
    /// Name, as in [`Limits`].
    pub name: String,
    /// The limit.
    pub limit: f64,
    /// The value.
    pub value: f64,
    /// What the value is of all those of the part: `p99` and `p01` (percentiles by area), `total` (the change of the
    /// whole in percent of the whole), `max` (the worst boundary).
    #[serde(default)]
    pub of: String,
    /// Whether it is kept.
    pub ok: bool,
}

/// The verdict.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Verdict {
    /// The result.
    pub result: VerdictResult,
    /// Each limit.
    pub limits: Vec<LimitCheck>,
}

impl Verdict {
    /// The verdict on a pattern with so many overlaps: one that lies on itself is not fit to be cut whatever its strains are.
    #[must_use]
    pub fn of_overlaps(mut self, overlaps: Option<u64>) -> Self {
        if self.result == VerdictResult::Pass && overlaps.is_some_and(|n| n > 0) {
            self.result = VerdictResult::Fail;
        }
        self
    }
}
