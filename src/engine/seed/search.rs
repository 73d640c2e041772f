//! The exhaustive seed search (thesis 4.4.4): every triangle is tried as the seed, the least change wins.
//!
//! Seeds are tried in slices of bounded work, each slice shared out over the caller's rayon pool with one [`Scratch`] a
//! share; between slices the observer hears of the progress and may stop the search. Every seed's outcome is computed
//! by itself and the outcomes are compared in the order of the seeds, so the result does not depend on the number of
//! threads: least change, lowest index on ties. Changes are percent of the sums in space, as in (4.9) and (4.10).
//!
//! Time is O(triangles^2): 7000 triangles are a matter of a second, 100 000 of minutes.

use rayon::prelude::*;

use crate::engine::budget::Observer;
use crate::engine::distortion::{Original, SeedSearchReport};
use crate::engine::error::EngineError;
use crate::engine::flattening::cader::{self, CaderMesh, Scratch, Stop};
use crate::engine::flattening::{FlatteningError, Readings};
use crate::engine::job::SearchMeasure;
use crate::engine::mesh::{Mesh, Topology};

/// Triangles that one share of a slice flattens, roughly 20 ms of work: large against the cost of handing it out, small
/// against the 100 ms within which a cancelled search is to stop.
const SLICE_TRIANGLES: usize = 1 << 20;

/// What is searched for, and how.
#[derive(Debug, Clone, Copy, Default)]
pub struct SearchSettings<'a> {
    /// Readings of the flattening.
    pub readings: Readings,
    /// What is minimised.
    pub measure: SearchMeasure,
    /// The triangles that the change is measured on; `None`: all. Every triangle is tried as a seed all the same.
    pub part: Option<&'a [bool]>,
    /// Whether both changes are measured for every seed, or only the one that is minimised.
    pub landscape: bool,
}

/// Changes of a whole flattening, percent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Changes {
    /// (4.9); `None` when it was not asked for.
    pub area_percent: Option<f64>,
    /// (4.10); `None` when it was not asked for.
    pub shape_percent: Option<f64>,
}

/// What became of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SeedSearch {
    /// For each seed its changes, or why it stopped.
    pub landscape: Vec<Result<Changes, Stop>>,
    /// The seed of least change, the lowest of several.
    pub best: u32,
    /// Its change, percent.
    pub best_percent: f64,
    /// The greatest change of a seed that succeeded, percent.
    pub worst_percent: f64,
    /// Seeds that flattened the whole mesh.
    pub succeeded: u64,
    /// What was minimised.
    pub measure: SearchMeasure,
}

impl SeedSearch {
    /// Seeds tried.
    #[must_use]
    pub fn tried(&self) -> u64 {
        self.landscape.len() as u64
    }

    /// The search as a report gives it.
    #[must_use]
    pub fn report(&self) -> SeedSearchReport {
        SeedSearchReport {
            measure: match self.measure {
                SearchMeasure::Area => "area".to_owned(),
                SearchMeasure::Shape => "shape".to_owned(),
            },
            tried: self.tried(),
            succeeded: self.succeeded,
            success_percent: 100.0 * self.succeeded as f64 / self.tried().max(1) as f64,
            best: self.best,
            best_percent: self.best_percent,
            worst_percent: self.worst_percent,
            abandoned: 0,
        }
    }
}

/// Tries every triangle of a mesh of one piece as the seed.
///
/// # Errors
/// [`EngineError::Cancelled`]; [`FlatteningError::Mesh`] and [`FlatteningError::SeveralPieces`] for a mesh that no seed
/// can flatten, [`FlatteningError::NoSeed`] when all fail.
pub fn search(
    mesh: &Mesh,
    topology: &Topology,
    settings: &SearchSettings,
    observer: &dyn Observer,
) -> Result<SeedSearch, EngineError> {
    let prepared = CaderMesh::new(mesh, topology).map_err(FlatteningError::from)?;
    let original = Original::new(mesh, topology, settings.part);
    let seeds = mesh.triangles.len();
    let threads = rayon::current_num_threads().max(1);
    let share = (SLICE_TRIANGLES / seeds.max(1)).max(1);
    let mut scratches = vec![Scratch::new(); threads.min(seeds)];
    let mut landscape: Vec<Result<Changes, Stop>> = Vec::with_capacity(seeds);
    while landscape.len() < seeds {
        observer.check()?;
        let from = landscape.len();
        landscape.resize(seeds.min(from + share * threads), Err(Stop::SeedOutOfRange));
        landscape[from..].par_chunks_mut(share).zip(&mut scratches).enumerate().for_each(|(k, (outcomes, scratch))| {
            for (i, outcome) in outcomes.iter_mut().enumerate() {
                let seed = (from + k * share + i) as u32;
                *outcome = cader::flatten(&prepared, settings.readings, seed, scratch)
                    .map(|()| changes(&original, settings, scratch));
            }
        });
        observer.progress(landscape.len() as f64 / seeds as f64);
    }
    conclude(mesh, &prepared, settings, landscape).map_err(EngineError::from)
}

fn changes(original: &Original, settings: &SearchSettings, scratch: &Scratch) -> Changes {
    let wanted = |measure| settings.landscape || settings.measure == measure;
    Changes {
        area_percent: wanted(SearchMeasure::Area).then(|| original.area_change_percent(scratch.flat())),
        shape_percent: wanted(SearchMeasure::Shape).then(|| original.shape_change_percent(scratch.flat())),
    }
}

/// Compares the outcomes in the order of the seeds.
fn conclude(
    mesh: &Mesh,
    prepared: &CaderMesh,
    settings: &SearchSettings,
    landscape: Vec<Result<Changes, Stop>>,
) -> Result<SeedSearch, FlatteningError> {
    let mut best: Option<(f64, u32)> = None;
    let (mut worst, mut succeeded) = (0.0_f64, 0);
    for (seed, outcome) in landscape.iter().enumerate() {
        let Ok(changes) = outcome else { continue };
        let change = match settings.measure {
            SearchMeasure::Area => changes.area_percent,
            SearchMeasure::Shape => changes.shape_percent,
        };
        let Some(change) = change else { continue };
        succeeded += 1;
        worst = worst.max(change);
        if best.is_none_or(|(least, _)| change < least) {
            best = Some((change, seed as u32));
        }
    }
    let Some((best_percent, best)) = best else { return Err(no_seed(mesh, prepared, settings, &landscape)) };
    Ok(SeedSearch { landscape, best, best_percent, worst_percent: worst, succeeded, measure: settings.measure })
}

/// All seeds fail: the failure of the one that got furthest, the lowest of several.
fn no_seed(
    mesh: &Mesh,
    prepared: &CaderMesh,
    settings: &SearchSettings,
    landscape: &[Result<Changes, Stop>],
) -> FlatteningError {
    let mut furthest = (0, 0);
    for (seed, outcome) in landscape.iter().enumerate() {
        match outcome {
            Err(Stop::Flipped { flattened, .. }) if *flattened > furthest.0 => furthest = (*flattened, seed as u32),
            // A mesh of several pieces: the same for every seed that does not flip first.
            Err(stop @ Stop::Unreached { .. }) => return stop.error(mesh, seed as u32, &[]),
            _ => {}
        }
    }
    let mut scratch = Scratch::new();
    match cader::flatten(prepared, settings.readings, furthest.1, &mut scratch) {
        Err(stop) => FlatteningError::NoSeed {
            tried: landscape.len() as u32,
            furthest: Box::new(stop.error(mesh, furthest.1, scratch.flat())),
        },
        // No triangles at all: there is nothing that could be a seed.
        Ok(()) => FlatteningError::SeedNotFound,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicU32, Ordering};

    use glam::DVec3;

    use super::*;
    use crate::engine::budget::Unobserved;
    use crate::engine::flattening::Check;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    fn dome(m: usize, depth: f64) -> (Mesh, Topology) {
        let mesh = grid(m, m, Diagonal::Regular, |u, v| {
            let (x, y) = (u - 0.5, v - 0.5);
            DVec3::new(100.0 * x, 90.0 * y, -depth * (x * x + 0.7 * y * y + 0.1 * x))
        });
        let topology = Topology::new(&mesh).unwrap();
        (mesh, topology)
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let (mesh, topology) = dome(20, 120.0);
        let settings = SearchSettings { landscape: true, ..SearchSettings::default() };
        let results: Vec<SeedSearch> = [1, 2, 8]
            .map(|n| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
                pool.install(|| search(&mesh, &topology, &settings, &Unobserved)).unwrap()
            })
            .into();
        assert_eq!(results[0], results[1]);
        assert_eq!(results[0], results[2]);
        assert!(results[0].best_percent > 0.0 && results[0].best_percent < results[0].worst_percent);
    }

    #[test]
    fn the_best_seed_is_the_first_of_least_change() {
        let (mesh, topology) = dome(12, 60.0);
        for measure in [SearchMeasure::Area, SearchMeasure::Shape] {
            let settings = SearchSettings { measure, landscape: true, ..SearchSettings::default() };
            let found = search(&mesh, &topology, &settings, &Unobserved).unwrap();
            let change = |c: &Changes| match measure {
                SearchMeasure::Area => c.area_percent.unwrap(),
                SearchMeasure::Shape => c.shape_percent.unwrap(),
            };
            let all: Vec<f64> = found.landscape.iter().map(|o| o.as_ref().map_or(f64::INFINITY, change)).collect();
            let least = all.iter().copied().fold(f64::INFINITY, f64::min);
            assert_eq!(found.best as usize, all.iter().position(|&c| c == least).unwrap());
            assert_eq!(found.best_percent, least);
        }
    }

    #[test]
    fn a_part_is_what_the_change_is_measured_on() {
        let (mesh, topology) = dome(16, 60.0);
        // The cells of the first four rows.
        let part: Vec<bool> = (0..mesh.triangles.len()).map(|t| t < 2 * 15 * 4).collect();
        let of = |part| {
            let settings = SearchSettings { part, ..SearchSettings::default() };
            search(&mesh, &topology, &settings, &Unobserved).unwrap()
        };
        let (whole, lower) = (of(None), of(Some(&part[..])));
        assert_eq!(lower.tried(), whole.tried());
        assert!(lower.best_percent < whole.best_percent);
        assert_ne!(lower.best, whole.best);
    }

    #[test]
    fn when_every_seed_fails_the_furthest_failure_is_told() {
        // A steep bowl on a dense mesh.
        let mesh = grid(24, 24, Diagonal::Diamond, |u, v| {
            let (x, y) = (u - 0.5, v - 0.5);
            DVec3::new(x, y, 40.0 * (x * x + y * y))
        });
        let topology = Topology::new(&mesh).unwrap();
        let result = search(&mesh, &topology, &SearchSettings::default(), &Unobserved);
        let error = result.map(|found| found.succeeded).unwrap_err();
        let EngineError::Flattening(FlatteningError::NoSeed { tried, furthest }) = error else { panic!("{error:?}") };
        assert_eq!(tried as usize, mesh.triangles.len());
        let FlatteningError::Flipped { flattened, total, place, .. } = *furthest else { panic!("{furthest:?}") };
        assert!(flattened > 0 && flattened < total);
        assert!(place.uv.is_some() && place.xyz_mm.is_some() && place.triangle.is_some());
    }

    #[test]
    fn a_mesh_of_two_pieces_is_refused() {
        let mut mesh = dome(4, 1.0).0;
        mesh.triangles.retain(|t| !t.contains(&5) && !t.contains(&10));
        let topology = Topology::new(&mesh).unwrap();
        assert!(topology.piece_count() > 1);
        let result = search(&mesh, &topology, &SearchSettings::default(), &Unobserved);
        let error = result.map(|found| found.succeeded).unwrap_err();
        assert!(matches!(error, EngineError::Flattening(FlatteningError::SeveralPieces { .. })), "{error:?}");
    }

    #[test]
    fn an_empty_mesh_has_no_seed() {
        let mesh = Mesh::default();
        let topology = Topology::new(&mesh).unwrap();
        assert!(search(&mesh, &topology, &SearchSettings::default(), &Unobserved).is_err());
    }

    /// Cancels at its n-th question and keeps what it heard.
    struct Impatient {
        questions: AtomicU32,
        patience: u32,
        heard: Mutex<Vec<f64>>,
    }

    impl Observer for Impatient {
        fn progress(&self, fraction: f64) {
            self.heard.lock().unwrap().push(fraction);
        }
        fn is_cancelled(&self) -> bool {
            self.questions.fetch_add(1, Ordering::Relaxed) >= self.patience
        }
    }

    #[test]
    fn a_search_stops_at_the_next_slice_when_it_is_no_longer_wanted() {
        let (mesh, topology) = dome(60, 40.0);
        let observer = Impatient { questions: AtomicU32::new(0), patience: 2, heard: Mutex::default() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let result = pool.install(|| search(&mesh, &topology, &SearchSettings::default(), &observer));
        assert_eq!(result, Err(EngineError::Cancelled));
        let heard = observer.heard.into_inner().unwrap();
        assert_eq!(heard.len(), 2);
        assert!(heard[0] < heard[1] && heard[1] < 0.2);
    }

    #[test]
    fn progress_ends_at_one() {
        let (mesh, topology) = dome(14, 30.0);
        let observer = Impatient { questions: AtomicU32::new(0), patience: u32::MAX, heard: Mutex::default() };
        let settings = SearchSettings {
            readings: Readings { check: Check::Final, ..Readings::default() },
            ..SearchSettings::default()
        };
        search(&mesh, &topology, &settings, &observer).unwrap();
        assert_eq!(observer.heard.into_inner().unwrap().last(), Some(&1.0));
    }
}
