//! Pieces laid flat by the release of energy.

use glam::DVec2;

use super::{Laid, PieceJob};
use crate::engine::budget::{Observer, Stage};
use crate::engine::error::EngineError;
use crate::engine::flattening::energy_release::{ReleaseReport, mccartney, wang};
use crate::engine::flattening::{FlatteningError, FlatteningMethod, LevelCounts, SeedChoice};
use crate::engine::seed::locate;

impl PieceJob<'_> {
    /// The piece laid from its seed and let go, and why that is no result, if it is none.
    pub(super) fn released(
        &self,
        observer: &dyn Observer,
        laid: &mut Laid,
    ) -> Result<(Vec<DVec2>, Option<FlatteningError>), EngineError> {
        let mesh = &self.piece.mesh;
        let seed = match self.seed {
            Some(seed) => seed,
            None => locate::centre(mesh, self.part)?,
        };
        if self.first && laid.seed_choice.is_none() {
            laid.seed_choice = Some(SeedChoice::Centre);
        }
        observer.enter(Stage::Flattening);
        observer.check()?;
        let options = self.options.flattening.release.unwrap_or_default();
        let (released, error) = if self.options.flattening.method() == FlatteningMethod::Wang {
            wang::flatten(mesh, self.topology, seed, options, observer)?
        } else {
            mccartney::flatten(mesh, self.topology, seed, options, observer)?
        };
        laid.flattened += released.flattened;
        if !released.report.settled && error.is_none() {
            laid.warnings.push(format!(
                "the moves were spent before the energy had settled ({} of them): more are possible with `release.max_moves`",
                released.report.moves
            ));
        }
        if self.first {
            laid.seed = Some(self.piece.triangle_of[seed as usize]);
            let of_level = |&triangles: &u32| LevelCounts { triangles, ..LevelCounts::default() };
            laid.levels = released.levels.iter().map(of_level).collect();
        }
        laid.release = Some(match laid.release.take() {
            Some(all) => together(all, &released.report),
            None => released.report,
        });
        Ok((released.flat, error))
    }
}

/// The sums of two reports, with the history of the first.
fn together(all: ReleaseReport, further: &ReleaseReport) -> ReleaseReport {
    ReleaseReport {
        threshold_mm: all.threshold_mm.max(further.threshold_mm),
        energy_before_mm: all.energy_before_mm + further.energy_before_mm,
        energy_after_mm: all.energy_after_mm + further.energy_after_mm,
        moves: all.moves + further.moves,
        tests: all.tests + further.tests,
        joint_moves: all.joint_moves + further.joint_moves,
        settled: all.settled && further.settled,
        history: all.history,
    }
}
