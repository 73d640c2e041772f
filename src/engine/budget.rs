//! The one handle through which the engine reports progress and asks whether it should stop.
//!
//! The engine has no clock and no threads of its own. Whoever calls it hands in an [`Observer`]; the engine names the
//! stage it enters, tells how far it is, and asks often (at least every few milliseconds of work) whether to go on.

use super::error::EngineError;

/// A stage of the pipeline, in the order in which they run. The caller times them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Loops are polygonised, checked and nested; the grid's density is chosen.
    Preparation,
    /// Loops are walked through the cells (thesis 3.3).
    Tracing,
    /// Polygons are generated and triangulated, and the mesh is lifted to 3D (thesis 3.4, 3.5).
    Triangulation,
    /// Seeds are tried (thesis 4.4.4).
    SeedSearch,
    /// The mesh is flattened.
    Flattening,
    /// Distortion is measured and the pattern drawn.
    Pattern,
}

impl Stage {
    /// The stage's name as the API prints it in `timings_ms` and `progress.stage`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Preparation => "preparation",
            Self::Tracing => "tracing",
            Self::Triangulation => "triangulation",
            Self::SeedSearch => "seed_search",
            Self::Flattening => "flattening",
            Self::Pattern => "pattern",
        }
    }
}

/// What the engine tells its caller while it works, and what it asks.
pub trait Observer: Sync {
    /// A stage begins (the one before it has ended).
    fn enter(&self, _stage: Stage) {}
    /// Fraction of the present stage that is done, in [0, 1].
    fn progress(&self, _fraction: f64) {}
    /// True when the present stage has taken so many seconds, all its entries together. The engine has no clock; an
    /// observer without one never says so.
    fn out_of_time(&self, _budget_s: f64) -> bool {
        false
    }
    /// True when the work is no longer wanted.
    fn is_cancelled(&self) -> bool {
        false
    }
    /// `Err(Cancelled)` when the work is no longer wanted: for `?` in long loops.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`].
    fn check(&self) -> Result<(), EngineError> {
        if self.is_cancelled() { Err(EngineError::Cancelled) } else { Ok(()) }
    }
}

/// An observer that neither listens nor cancels: for tests, examples and `planish run`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unobserved;

impl Observer for Unobserved {}
