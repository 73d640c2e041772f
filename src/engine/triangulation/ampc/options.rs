//! How lines of curvature are sampled: the very names that a job uses.

use serde::{Deserialize, Serialize};

/// How many lines are blended between two that were found (stage 6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NpRule {
    /// As many as the step size needs: `ceil(gap m) - 1`.
    #[default]
    Needed,
    /// As (6.1) and (6.2) print it, one fewer: `ceil(gap m) - 2`, which leaves steps of 2/m.
    Printed,
}

/// How a line follows the direction field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integration {
    /// Straight through each cell, in the direction at the point where it enters (stage 4).
    #[default]
    Cells,
    /// The classical fourth-order rule, one step a cell, staying with its family of principal directions.
    RungeKutta,
}

/// How lines end at the border of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AmpcBorder {
    /// Outer lines are offset copies, and points outside are moved onto the border (stage 8).
    #[default]
    Clamped,
    /// Outer lines are integrated as the inner ones are, and each ends where it crosses the border.
    Free,
}

/// Which lines of curvature are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AmpcFamilies {
    /// Those of minimum curvature; the other lines of the grid are iso-parametric.
    #[default]
    One,
    /// Both: cells with right angles in space.
    Both,
}

/// Which way the lines of minimum curvature run through the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AmpcDirection {
    /// The way in which more of the grid's points have their direction (stage 2).
    #[default]
    Modal,
    /// From the first u to the last.
    U,
    /// From the first v to the last.
    V,
}

/// The `triangulation.ampc` object of a job.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AmpcOptions {
    /// How many lines are blended between two that were found.
    pub np_rule: NpRule,
    /// Starts tried in each strip, its two ends among them; the thesis's s, for which it finds 5 to 10 enough.
    pub starts: u32,
    /// Leave out cells of the outer lines with two points nearer than `min_distance_mm`.
    pub drop_thin: bool,
    /// What `drop_thin` goes by, mm.
    pub min_distance_mm: f64,
    /// How a line follows the direction field.
    pub integration: Integration,
    /// How lines end at the border.
    pub border: AmpcBorder,
    /// Which lines are followed.
    pub families: AmpcFamilies,
    /// Which way they run.
    pub direction: AmpcDirection,
}

impl AmpcOptions {
    /// Most starts of a strip: each may be followed through the whole strip, and the thesis needs ten.
    pub const MAX_STARTS: u32 = 64;
}

impl Default for AmpcOptions {
    fn default() -> Self {
        Self {
            np_rule: NpRule::default(),
            starts: 8,
            drop_thin: false,
            min_distance_mm: 1.0,
            integration: Integration::default(),
            border: AmpcBorder::default(),
            families: AmpcFamilies::default(),
            direction: AmpcDirection::default(),
        }
    }
}
