//! How a surface is to be triangulated: the very names that a job uses.

use serde::{Deserialize, Serialize};

use super::Skew;
use super::ampc::AmpcOptions;

/// The method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TriangulationMethod {
    /// Loops are traced through the cells of a grid (thesis chapter 3).
    #[default]
    Tracing,
    /// The grid of the whole domain, without loops (thesis chapter 5).
    Grid,
    /// Along lines of minimum curvature over the whole domain, without loops (thesis 6.4).
    Ampc,
}

impl TriangulationMethod {
    /// Whether the mesh is that of the whole base surface, whatever the loops.
    #[must_use]
    pub const fn is_of_base(self) -> bool {
        matches!(self, Self::Grid | Self::Ampc)
    }

    /// The method's name, as in a job.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tracing => "tracing",
            Self::Grid => "grid",
            Self::Ampc => "ampc",
        }
    }
}

/// How the diagonals of the grid's cells are placed (thesis 5.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Configuration {
    /// All diagonals run from (i, j) to (i+1, j+1).
    #[default]
    Regular,
    /// All diagonals run from (i+1, j) to (i, j+1).
    RegularMirrored,
    /// A checkerboard of both: interior valencies 4 and 8.
    Diamond,
    /// Both, alternating by row.
    ChevronRows,
    /// Both, alternating by column.
    ChevronColumns,
    /// Each as it fits the surface's Gaussian curvature best (thesis 5.4), for the method `grid`.
    Fitted,
    /// Each by chance, as `random_seed` decides (thesis 5.5.4), for the method `grid`.
    Random,
}

/// How dense the mesh is: exactly one of these is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Density {
    /// Largest distance between mesh and surface, mm.
    Chord(f64),
    /// The same as a fraction of the part's diagonal.
    ChordRelative(f64),
    /// Largest difference between the mesh's area and the surface's, mm^2 (the thesis's criterion).
    Area(f64),
    /// The same as a fraction of the surface's area.
    AreaRelative(f64),
    /// Largest edge, mm.
    Edge(f64),
}

/// The `triangulation` object of a job. At most one of `grid` and `tolerance` is given.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TriangulationOptions {
    /// The method.
    pub method: TriangulationMethod,
    /// Points along u and v, uniform over the domain, at least 2 each.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid: Option<[u32; 2]>,
    /// A tolerance that places rows and columns by need.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Density>,
    /// The diagonals.
    pub configuration: Configuration,
    /// Phase of `diamond` and `chevron-*`: 0, or 1 to begin with the other diagonal.
    pub phase: u8,
    /// Which of the `random` configurations; absent: 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub random_seed: Option<u32>,
    /// The skew of the sampling, for the method `grid`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skew: Option<Skew>,
    /// How lines of curvature are followed, for the method `ampc`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ampc: Option<AmpcOptions>,
}
