//! How faces are sewn: the `sewing` object of a job.

use serde::{Deserialize, Serialize};

/// Greatest distance of borders that are one, as a part of the diagonal of all faces. Modellers leave some thousandths of a
/// millimetre between the faces of a part of a metre, exchange by files with few digits a hundred times that; much more, and
/// borders that are meant to be apart (a slot, a step) would close.
pub const DEFAULT_SEWING_TOLERANCE: f64 = 1e-4;

/// The most that can be asked for, as a part of the diagonal: beyond it faces would be deformed, not sewn.
pub const GREATEST_SEWING_TOLERANCE: f64 = 1e-2;

/// Whether faces that share a border become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Join {
    /// All of them do; faces that do not meet become pieces.
    #[default]
    All,
    /// None does: each face is a piece, and what they share are seams.
    None,
}

/// The `sewing` object of a job.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SewingOptions {
    /// Whether faces become one.
    pub join: Join,
    /// Borders at most so far apart are shared, mm. Absent: [`DEFAULT_SEWING_TOLERANCE`] of the diagonal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance_mm: Option<f64>,
}
