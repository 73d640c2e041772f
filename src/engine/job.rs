//! What a job asks for, in the very names that the API, the store and the command line use.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::distortion::{Limits, Thresholds};
use super::flattening::{FlatteningDomain, FlatteningOptions};
use super::pattern::{Compensation, Finishing, Pair, Placement};
use super::sewing::{Cut, SewingOptions};
use super::triangulation::TriangulationOptions;

/// The kind of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JobKind {
    /// A mesh.
    Triangulate,
    /// A mesh, its flattening, and the pattern.
    Flatten,
    /// Every seed of the mesh run to its end (thesis 4.4.4), or the predicted ones, and the flattening from the best.
    OptimumSeedSearch,
}

impl JobKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Triangulate, Self::Flatten, Self::OptimumSeedSearch];

    /// The kind's name, as in a job's `kind`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Triangulate => "triangulate",
            Self::Flatten => "flatten",
            Self::OptimumSeedSearch => "optimum-seed-search",
        }
    }
}

/// What a seed search minimises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SearchMeasure {
    /// Absolute area change (4.9).
    #[default]
    Area,
    /// Absolute shape change (4.10).
    Shape,
}

impl SearchMeasure {
    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::Shape => "shape",
        }
    }
}

/// Which seeds a search tries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SearchStrategy {
    /// All of them.
    #[default]
    Exhaustive,
    /// A few that the shape points to.
    Predicted,
}

impl SearchStrategy {
    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exhaustive => "exhaustive",
            Self::Predicted => "predicted",
        }
    }
}

/// The `search` object of a job.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SearchOptions {
    /// What is minimised.
    pub measure: SearchMeasure,
    /// Which seeds are tried.
    pub strategy: SearchStrategy,
    /// How long the search may take, seconds: then the best so far is taken. Absent: as long as it takes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget_s: Option<f64>,
}

/// The parameters of a job: everything but its kind, surface and labels.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct JobOptions {
    /// How to triangulate.
    pub triangulation: TriangulationOptions,
    /// How to flatten.
    pub flattening: FlatteningOptions,
    /// How the seed is searched.
    pub search: SearchOptions,
    /// How the pattern lies.
    pub placement: Placement,
    /// What the verdict is judged by.
    pub limits: Limits,
    /// Thresholds of the averages.
    pub thresholds: Thresholds,
    /// Chord tolerance of the pattern's curves, mm; absent: 1e-4 of the part's diagonal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curve_tolerance_mm: Option<f64>,
    /// By how much the pieces are made larger or smaller after flattening.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compensation: Option<Compensation>,
    /// The second piece that each is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pair: Option<Pair>,
    /// How the faces of a part are sewn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sewing: Option<SewingOptions>,
    /// Lines along which faces are cut open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cuts: Vec<Cut>,
    /// Leave out pieces that cannot be flattened instead of failing.
    pub skip_bad_pieces: bool,
}

impl JobOptions {
    /// What is flattened, the default filled in: that of the method, unless the mesh is that of the whole base anyhow.
    #[must_use]
    pub fn domain(&self) -> FlatteningDomain {
        match (self.flattening.domain, self.triangulation.method) {
            (Some(domain), _) => domain,
            (None, method) if method.is_of_base() => FlatteningDomain::Base,
            (None, _) => self.flattening.method().usual_domain(),
        }
    }

    /// What is done to the pieces of the pattern.
    #[must_use]
    pub const fn finishing(&self) -> Finishing {
        Finishing { compensation: self.compensation, pair: self.pair }
    }

    /// The options of flattening with the defaults that do not depend on the surface.
    #[must_use]
    pub fn filled_flattening(&self) -> FlatteningOptions {
        FlatteningOptions { domain: Some(self.domain()), ..self.flattening.filled() }
    }
}

/// Free key-value strings that come back in listings and stand in the pattern's title block.
pub type Labels = BTreeMap<String, String>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::flattening::FlatteningMethod;
    use crate::engine::triangulation::TriangulationMethod;

    #[test]
    fn what_is_flattened_follows_from_the_method_and_the_mesh() {
        let mut options = JobOptions::default();
        assert_eq!(options.domain(), FlatteningDomain::Trimmed);
        options.triangulation.method = TriangulationMethod::Grid;
        assert_eq!(options.domain(), FlatteningDomain::Base);
        options.triangulation.method = TriangulationMethod::Tracing;
        options.flattening.method = Some(FlatteningMethod::Cader);
        assert_eq!(options.domain(), FlatteningDomain::Base);
        options.flattening.domain = Some(FlatteningDomain::Trimmed);
        assert_eq!(options.domain(), FlatteningDomain::Trimmed);
        assert_eq!(options.filled_flattening().domain, Some(FlatteningDomain::Trimmed));
    }
}
