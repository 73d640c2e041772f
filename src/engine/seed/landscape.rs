//! What became of each seed, and what a search says of them all.

use crate::engine::distortion::SeedSearchReport;
use crate::engine::flattening::FlatteningError;
use crate::engine::flattening::cader::Stop;
use crate::engine::job::{SearchMeasure, SearchOptions, SearchStrategy};

/// Changes of a whole flattening, percent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Changes {
    /// (4.9); `None` when it was not asked for.
    pub area_percent: Option<f64>,
    /// (4.10); `None` when it was not asked for.
    pub shape_percent: Option<f64>,
}

impl Changes {
    /// The one that is minimised.
    #[must_use]
    pub const fn of(&self, measure: SearchMeasure) -> Option<f64> {
        match measure {
            SearchMeasure::Area => self.area_percent,
            SearchMeasure::Shape => self.shape_percent,
        }
    }
}

/// What became of one seed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum SeedOutcome {
    /// Its turn did not come.
    #[default]
    Untried,
    /// It flattened the whole mesh.
    Flattened(Changes),
    /// It stopped: a flip, triangles out of reach, or it could no longer win.
    Stopped(Stop),
}

impl SeedOutcome {
    /// Its changes, when it flattened the whole mesh.
    #[must_use]
    pub const fn changes(&self) -> Option<&Changes> {
        match self {
            Self::Flattened(changes) => Some(changes),
            Self::Untried | Self::Stopped(_) => None,
        }
    }
}

/// The outcomes of all triangles of a mesh as seeds, pieces together.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SeedLandscape {
    /// What was minimised.
    pub measure: SearchMeasure,
    /// For each triangle what became of it as a seed. Triangles are those of the whole mesh, also in flips.
    pub seeds: Vec<SeedOutcome>,
    /// The best seed of each piece, in the order of the pieces.
    pub best: Vec<Option<u32>>,
}

/// A seed with its change, percent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranked {
    /// The seed.
    pub seed: u32,
    /// Its change.
    pub percent: f64,
}

/// What became of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SeedSearch {
    /// For each seed what became of it.
    pub outcomes: Vec<SeedOutcome>,
    /// The seed of least change, the lowest of several; or why there is none.
    pub best: Result<Ranked, FlatteningError>,
    /// The seed of greatest change of those that succeeded, the lowest of several.
    pub worst: Option<Ranked>,
    /// Seeds whose turn came.
    pub tried: u64,
    /// Seeds that flattened the whole mesh.
    pub succeeded: u64,
    /// Seeds abandoned since they could no longer win.
    pub abandoned: u64,
    /// Whether it ended since its time had run out.
    pub spent: bool,
    /// What was asked for.
    pub options: SearchOptions,
}

impl SeedSearch {
    /// Whether every seed had its turn.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.tried == self.outcomes.len() as u64
    }

    /// Whether some seed succeeds (thesis 4.4.2); not known where none of those tried did, and not all were.
    #[must_use]
    pub fn almost_developable(&self) -> Option<bool> {
        let known = self.succeeded > 0 || (self.complete() && !self.outcomes.is_empty());
        known.then_some(self.succeeded > 0)
    }

    /// The search as a report gives it; `triangle_of` names the seeds as triangles of the whole mesh.
    #[must_use]
    pub fn report(&self, triangle_of: &[u32]) -> SeedSearchReport {
        let name = |seed: u32| triangle_of.get(seed as usize).copied().unwrap_or(seed);
        let best = self.best.as_ref().ok();
        // What abandoned seeds would have come to is not known, and those that a prediction picks stand for no others.
        let all = self.abandoned == 0 && self.options.strategy == SearchStrategy::Exhaustive;
        let worst = self.worst.filter(|_| all);
        SeedSearchReport {
            measure: self.options.measure.name().to_owned(),
            strategy: self.options.strategy.name().to_owned(),
            seeds: self.outcomes.len() as u64,
            tried: self.tried,
            succeeded: self.succeeded,
            success_percent: all.then(|| 100.0 * self.succeeded as f64 / self.tried.max(1) as f64),
            best: best.map(|best| name(best.seed)),
            best_percent: best.map(|best| best.percent),
            worst: worst.map(|worst| name(worst.seed)),
            worst_percent: worst.map(|worst| worst.percent),
            abandoned: self.abandoned,
            complete: self.complete(),
            almost_developable: self.almost_developable(),
            budget_s: self.options.budget_s,
        }
    }
}
