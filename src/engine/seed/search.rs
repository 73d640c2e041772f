//! The seed search (thesis 4.4.4): every triangle is tried as the seed, the least change wins. Or few are tried, those that
//! [`predicted`] names.
//!
//! Seeds are tried in the order of [`candidates`], in slices whose sizes follow from the mesh alone. The
//! threads of the caller's rayon pool take the seeds of a slice one by one; every outcome is computed by itself. Between
//! slices the observer hears of the progress, the time is looked at, and the bound is renewed beyond which a seed can no
//! longer win ([`bound`](super::bound)): a bound that all threads shared at any time would spare a little more, but then
//! how many seeds were abandoned would depend on which thread was faster. So the result does not depend on the number of
//! threads in any byte: least change, lowest index on ties. With a budget it depends on how far the search came.
//! Changes are percent of the sums in space, as in (4.9) and (4.10).
//!
//! Time is O(triangles^2): 7000 triangles are a matter of a second, 100 000 of minutes.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::prelude::*;

use super::bound::{Tally, Terms, widened};
use super::landscape::{Changes, Ranked, SeedOutcome, SeedSearch};
use super::{candidates, predicted};
use crate::engine::budget::Observer;
use crate::engine::distortion::Original;
use crate::engine::error::EngineError;
use crate::engine::flattening::cader::{self, CaderMesh, Scratch, Stop};
use crate::engine::flattening::{FlatteningError, Readings};
use crate::engine::job::{SearchMeasure, SearchOptions, SearchStrategy};
use crate::engine::mesh::{Mesh, Topology};

/// Triangles that a slice flattens: some 20 ms of one thread's work. Large against the cost of waking the threads for
/// it, small against the time that a bound gets old in.
const SLICE_TRIANGLES: usize = 1 << 20;
/// So many times as large are slices where no seed is abandoned.
const UNBOUND_SLICES: usize = 4;
/// Seeds of a slice at least, so that many threads have something to do on large meshes too.
const LEAST_SLICE: usize = 64;
/// Seeds of the first slice: there is no bound yet, so it is small. Each further one is twice as large.
const FIRST_SLICE: usize = 8;

/// What is searched for, and how.
#[derive(Debug, Clone, Copy, Default)]
pub struct SearchSettings<'a> {
    /// Readings of the flattening.
    pub readings: Readings,
    /// What is minimised, and how long that may take.
    pub options: SearchOptions,
    /// The triangles that the change is measured on; `None`: all. Every triangle is tried as a seed all the same.
    pub part: Option<&'a [bool]>,
    /// Whether every seed is run to its end and both changes are measured, or seeds that can no longer win are abandoned.
    pub landscape: bool,
}

/// Tries triangles of a mesh of one piece as the seed, as many as the strategy says. When no seed succeeds that is part of
/// the answer, not an error.
///
/// # Errors
/// [`EngineError::Cancelled`]; [`FlatteningError::Mesh`] and [`FlatteningError::SeveralPieces`] for a mesh that no seed
/// can flatten.
pub fn search(
    mesh: &Mesh,
    topology: &Topology,
    settings: &SearchSettings,
    observer: &dyn Observer,
) -> Result<SeedSearch, EngineError> {
    let prepared = CaderMesh::new(mesh, topology).map_err(FlatteningError::from)?;
    let original = Original::new(mesh, topology, settings.part);
    let abandons = !settings.landscape && prepared.settles_within(settings.readings).is_some();
    let terms = abandons.then(|| Terms::new(mesh, topology, settings.part, settings.options.measure));
    let seeds = mesh.triangles.len();
    let threads = rayon::current_num_threads().clamp(1, seeds.max(1));
    let mut search = Search {
        prepared: &prepared,
        original: &original,
        terms,
        settings,
        workers: vec![Worker::default(); threads],
        outcomes: vec![SeedOutcome::Untried; seeds],
        best: None,
        tried: 0,
        spent: false,
    };
    match settings.options.strategy {
        SearchStrategy::Exhaustive => search.all(topology, observer)?,
        SearchStrategy::Predicted => predicted::run(&mut search, mesh, topology, observer)?,
    }
    search.conclude(mesh)
}

/// A search under way.
pub(super) struct Search<'a> {
    prepared: &'a CaderMesh,
    original: &'a Original,
    /// What the tallies of runs are made of, where seeds may be abandoned.
    terms: Option<Terms>,
    settings: &'a SearchSettings<'a>,
    workers: Vec<Worker>,
    outcomes: Vec<SeedOutcome>,
    /// Least change so far, percent.
    best: Option<f64>,
    tried: usize,
    /// Whether the time ran out.
    spent: bool,
}

/// What one thread has to itself.
#[derive(Debug, Clone, Default)]
struct Worker {
    scratch: Scratch,
    found: Vec<(u32, SeedOutcome)>,
}

impl Search<'_> {
    /// Tries all seeds, as far as there is time.
    fn all(&mut self, topology: &Topology, observer: &dyn Observer) -> Result<(), EngineError> {
        let mut size = FIRST_SLICE;
        let sample = candidates::sample(self.outcomes.len());
        if self.run(&sample, &mut size, observer)? {
            let others = candidates::others(topology, &self.ranked(sample));
            self.run(&others, &mut size, observer)?;
        }
        debug_assert!(self.spent || self.tried == self.outcomes.len());
        Ok(())
    }

    /// Tries these seeds in slices. Gives whether there was time for all of them.
    fn run(&mut self, seeds: &[u32], size: &mut usize, observer: &dyn Observer) -> Result<bool, EngineError> {
        let total = self.outcomes.len();
        // Where no bound is renewed, all that a slice ends for is the progress.
        let triangles = if self.terms.is_some() { SLICE_TRIANGLES } else { UNBOUND_SLICES * SLICE_TRIANGLES };
        let largest = (triangles / total.max(1)).max(LEAST_SLICE);
        let mut rest = seeds;
        while !rest.is_empty() {
            observer.check()?;
            if self.out_of_time(observer) {
                return Ok(false);
            }
            let (slice, later) = rest.split_at((*size).min(rest.len()));
            self.slice(slice, self.best, observer)?;
            observer.progress(self.tried as f64 / total as f64);
            *size = (*size * 2).min(largest);
            rest = later;
        }
        Ok(true)
    }

    /// Whether the time has run out. The first slice is always tried: a search without any seed would have nothing to say.
    pub(super) fn out_of_time(&mut self, observer: &dyn Observer) -> bool {
        self.spent |=
            self.tried > 0 && self.settings.options.budget_s.is_some_and(|budget| observer.out_of_time(budget));
        self.spent
    }

    /// Whether the time was found to have run out.
    pub(super) const fn spent(&self) -> bool {
        self.spent
    }

    /// Seeds whose turn came.
    pub(super) const fn tried(&self) -> usize {
        self.tried
    }

    /// The change of a seed that flattened the whole mesh, percent.
    pub(super) fn change(&self, seed: u32) -> Option<f64> {
        self.outcomes[seed as usize].changes()?.of(self.settings.options.measure)
    }

    /// Tries the seeds of one slice on all threads. Where seeds may be abandoned, those are that cannot come to this
    /// change, percent, any more.
    pub(super) fn slice(
        &mut self,
        slice: &[u32],
        lost_above: Option<f64>,
        observer: &dyn Observer,
    ) -> Result<(), EngineError> {
        let bound = lost_above.map(|percent| self.bound(percent));
        let (prepared, original, terms, settings) = (self.prepared, self.original, self.terms.as_ref(), self.settings);
        let (next, cancelled) = (AtomicUsize::new(0), AtomicBool::new(false));
        let work = |worker: &mut Worker| {
            while let Some(&seed) = slice.get(next.fetch_add(1, Ordering::Relaxed)) {
                if cancelled.load(Ordering::Relaxed) || observer.is_cancelled() {
                    cancelled.store(true, Ordering::Relaxed);
                    return;
                }
                let scratch = &mut worker.scratch;
                let mut tally =
                    terms.zip(bound).map(|(terms, bound)| Tally::new(terms, prepared, settings.readings, bound));
                let run = cader::flatten_while(prepared, settings.readings, seed, scratch, |scratch| {
                    tally.as_mut().is_none_or(|tally| tally.goes_on(scratch))
                });
                let outcome = match run {
                    Ok(()) => SeedOutcome::Flattened(changes(original, settings, scratch)),
                    Err(stop) => SeedOutcome::Stopped(stop),
                };
                worker.found.push((seed, outcome));
            }
        };
        match (slice, self.workers.as_mut_slice()) {
            // One seed wakes no thread.
            ([_], [worker, ..]) => work(worker),
            (_, workers) => workers.par_iter_mut().with_max_len(1).for_each(work),
        }
        if cancelled.into_inner() {
            return Err(EngineError::Cancelled);
        }
        let measure = self.settings.options.measure;
        for (seed, outcome) in self.workers.iter_mut().flat_map(|worker| worker.found.drain(..)) {
            if let Some(change) = outcome.changes().and_then(|changes| changes.of(measure)) {
                self.best = Some(self.best.map_or(change, |best| best.min(change)));
            }
            self.outcomes[seed as usize] = outcome;
        }
        self.tried += slice.len();
        Ok(())
    }

    /// The sum beyond which a seed cannot come to this change any more.
    fn bound(&self, percent: f64) -> f64 {
        let (before, terms) = match self.settings.options.measure {
            SearchMeasure::Area => (self.original.area(), self.original.triangle_count()),
            SearchMeasure::Shape => (self.original.length(), self.original.edge_count()),
        };
        widened(percent, before, terms)
    }

    /// These seeds, the best first; those that failed after them, the furthest first.
    pub(super) fn ranked(&self, mut seeds: Vec<u32>) -> Vec<u32> {
        seeds.sort_by(|&a, &b| self.compare(a, b).then(a.cmp(&b)));
        seeds
    }

    /// Whether a seed came to more than another.
    pub(super) fn is_better(&self, seed: u32, than: u32) -> bool {
        self.compare(seed, than).is_lt()
    }

    /// The better first.
    fn compare(&self, a: u32, b: u32) -> std::cmp::Ordering {
        let measure = self.settings.options.measure;
        let rank = |seed: u32| match self.outcomes[seed as usize] {
            SeedOutcome::Flattened(changes) => (0, changes.of(measure).unwrap_or(f64::INFINITY)),
            SeedOutcome::Stopped(Stop::Abandoned { flattened }) => (1, -f64::from(flattened)),
            SeedOutcome::Stopped(Stop::Flipped { flattened, .. }) => (2, -f64::from(flattened)),
            SeedOutcome::Stopped(_) | SeedOutcome::Untried => (3, 0.0),
        };
        let (a, b) = (rank(a), rank(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    }

    /// Compares the outcomes in the order of the seeds.
    fn conclude(self, mesh: &Mesh) -> Result<SeedSearch, EngineError> {
        let measure = self.settings.options.measure;
        let (mut best, mut worst): (Option<Ranked>, Option<Ranked>) = (None, None);
        let (mut succeeded, mut abandoned) = (0, 0);
        for (seed, outcome) in self.outcomes.iter().enumerate() {
            match outcome {
                SeedOutcome::Flattened(changes) => {
                    succeeded += 1;
                    let Some(percent) = changes.of(measure) else { continue };
                    let ranked = Ranked { seed: seed as u32, percent };
                    if best.is_none_or(|best| percent < best.percent) {
                        best = Some(ranked);
                    }
                    if worst.is_none_or(|worst| percent > worst.percent) {
                        worst = Some(ranked);
                    }
                }
                SeedOutcome::Stopped(Stop::Abandoned { .. }) => abandoned += 1,
                // A mesh of several pieces: the same for every seed that does not flip first.
                SeedOutcome::Stopped(stop @ Stop::Unreached { .. }) => {
                    return Err(stop.error(mesh, seed as u32, &[]).into());
                }
                SeedOutcome::Stopped(_) | SeedOutcome::Untried => {}
            }
        }
        let best = best.ok_or_else(|| self.no_seed(mesh));
        Ok(SeedSearch {
            best,
            worst,
            tried: self.tried as u64,
            succeeded,
            abandoned,
            spent: self.spent,
            options: self.settings.options,
            outcomes: self.outcomes,
        })
    }

    /// All seeds fail: the failure of the one that got furthest, the lowest of several.
    fn no_seed(&self, mesh: &Mesh) -> FlatteningError {
        if self.outcomes.is_empty() {
            return FlatteningError::SeedNotFound;
        }
        let mut furthest = (0, 0);
        for (seed, outcome) in self.outcomes.iter().enumerate() {
            if let SeedOutcome::Stopped(Stop::Flipped { flattened, .. }) = outcome
                && *flattened > furthest.0
            {
                furthest = (*flattened, seed as u32);
            }
        }
        let mut scratch = Scratch::new();
        let Err(stop) = cader::flatten(self.prepared, self.settings.readings, furthest.1, &mut scratch) else {
            // Not one seed failed: none was tried.
            return FlatteningError::SeedNotFound;
        };
        let (tried, seeds) = (self.tried as u32, self.outcomes.len() as u32);
        let furthest = Box::new(stop.error(mesh, furthest.1, scratch.flat()));
        if self.spent {
            FlatteningError::BudgetSpent { tried, seeds, furthest }
        } else if tried < seeds {
            FlatteningError::NonePredicted { tried, seeds, furthest }
        } else {
            FlatteningError::NoSeed { tried, furthest }
        }
    }
}

fn changes(original: &Original, settings: &SearchSettings, scratch: &Scratch) -> Changes {
    let wanted = |measure| settings.landscape || settings.options.measure == measure;
    Changes {
        area_percent: wanted(SearchMeasure::Area).then(|| original.area_change_percent(scratch.flat())),
        shape_percent: wanted(SearchMeasure::Shape).then(|| original.shape_change_percent(scratch.flat())),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::atomic::AtomicU32;

    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::engine::budget::Unobserved;
    use crate::engine::flattening::{Average, Check, Parent};
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    fn dome(m: usize, depth: f64) -> (Mesh, Topology) {
        let mesh = grid(m, m, Diagonal::Regular, |u, v| {
            let (x, y) = (u - 0.5, v - 0.5);
            DVec3::new(100.0 * x, 90.0 * y, -depth * (x * x + 0.7 * y * y + 0.1 * x))
        });
        let topology = Topology::new(&mesh).unwrap();
        (mesh, topology)
    }

    fn measured_by(measure: SearchMeasure) -> SearchSettings<'static> {
        SearchSettings { options: SearchOptions { measure, ..SearchOptions::default() }, ..SearchSettings::default() }
    }

    #[test]
    fn no_byte_of_the_result_depends_on_the_number_of_threads() {
        let (mesh, topology) = dome(20, 120.0);
        for landscape in [true, false] {
            let settings = SearchSettings { landscape, ..SearchSettings::default() };
            let results: Vec<SeedSearch> = [1, 2, 8]
                .map(|n| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
                    pool.install(|| search(&mesh, &topology, &settings, &Unobserved)).unwrap()
                })
                .into();
            assert_eq!(results[0], results[1]);
            assert_eq!(results[0], results[2]);
            assert_eq!(results[0].report(&[]), results[2].report(&[]));
            let best = results[0].best.clone().unwrap();
            assert!(best.percent > 0.0 && best.percent < results[0].worst.unwrap().percent);
            assert_eq!(results[0].abandoned > 100, !landscape, "{}", results[0].abandoned);
        }
    }

    #[test]
    fn the_best_seed_is_the_first_of_least_change() {
        let (mesh, topology) = dome(12, 60.0);
        for measure in [SearchMeasure::Area, SearchMeasure::Shape] {
            let settings = SearchSettings { landscape: true, ..measured_by(measure) };
            let found = search(&mesh, &topology, &settings, &Unobserved).unwrap();
            let change = |o: &SeedOutcome| o.changes().map_or(f64::INFINITY, |c| c.of(measure).unwrap());
            let all: Vec<f64> = found.outcomes.iter().map(change).collect();
            let least = all.iter().copied().fold(f64::INFINITY, f64::min);
            let seed = all.iter().position(|&c| c == least).unwrap() as u32;
            assert_eq!(found.best, Ok(Ranked { seed, percent: least }));
        }
    }

    /// A surface of four bumps of random heights, so that searches have several basins.
    fn hilly(m: usize, n: usize, diagonal: Diagonal, heights: [f64; 4]) -> Mesh {
        grid(m, n, diagonal, |u, v| {
            let bump = |k: usize| {
                let (x, y) = (u - 0.25 - 0.5 * (k % 2) as f64, v - 0.25 - 0.5 * (k / 2) as f64);
                heights[k] * (-12.0 * (x * x + y * y)).exp()
            };
            DVec3::new(100.0 * u, 80.0 * v, (0..4).map(bump).sum())
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn abandoning_finds_the_same_winner_to_the_last_bit(
            m in 6..14_usize, n in 6..14_usize, diagonal in prop::sample::select(Diagonal::ALL.to_vec()),
            heights in prop::array::uniform4(-14.0..14.0_f64), shape in any::<bool>(), last in any::<bool>(),
            running in any::<bool>(), part in any::<bool>(),
        ) {
            let mesh = hilly(m, n, diagonal, heights);
            let topology = Topology::new(&mesh).unwrap();
            let marks: Vec<bool> = (0..mesh.triangles.len()).map(|t| t % 5 != 1).collect();
            let readings = Readings {
                parent: if last { Parent::Last } else { Parent::First },
                average: if running { Average::Running } else { Average::Pair },
                ..Readings::default()
            };
            let measure = if shape { SearchMeasure::Shape } else { SearchMeasure::Area };
            let part = part.then_some(marks.as_slice());
            let settings = |landscape| SearchSettings { readings, part, landscape, ..measured_by(measure) };
            let exhaustive = search(&mesh, &topology, &settings(true), &Unobserved).unwrap();
            let abandoning = search(&mesh, &topology, &settings(false), &Unobserved).unwrap();
            prop_assert_eq!(&exhaustive.best, &abandoning.best);
            prop_assert_eq!(exhaustive.abandoned, 0);
            // What was not abandoned came out the same, and what was would not have won.
            for (all, some) in exhaustive.outcomes.iter().zip(&abandoning.outcomes) {
                match some {
                    SeedOutcome::Stopped(Stop::Abandoned { .. }) => {
                        let change = all.changes().map_or(f64::INFINITY, |c| c.of(measure).unwrap());
                        prop_assert!(change > exhaustive.best.as_ref().unwrap().percent);
                    }
                    SeedOutcome::Flattened(changes) => {
                        prop_assert_eq!(changes.of(measure), all.changes().unwrap().of(measure));
                    }
                    stopped => prop_assert_eq!(stopped, all),
                }
            }
        }
    }

    #[test]
    fn on_a_plane_where_all_seeds_are_equal_none_is_abandoned_on_a_tie() {
        // Exact arithmetic: legs of 3 and 4.
        let mesh = grid(9, 9, Diagonal::Regular, |u, v| DVec3::new(24.0 * u, 32.0 * v, 0.0));
        let topology = Topology::new(&mesh).unwrap();
        let settings = |landscape| SearchSettings { landscape, ..SearchSettings::default() };
        let exhaustive = search(&mesh, &topology, &settings(true), &Unobserved).unwrap();
        let abandoning = search(&mesh, &topology, &settings(false), &Unobserved).unwrap();
        assert_eq!(exhaustive.best, abandoning.best);
        assert!(exhaustive.best.unwrap().percent < 1e-12);
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
        assert_eq!(lower.tried, whole.tried);
        let (whole, lower) = (whole.best.unwrap(), lower.best.unwrap());
        assert!(lower.percent < whole.percent);
        assert_ne!(lower.seed, whole.seed);
    }

    /// A steep bowl on a dense mesh.
    fn bowl() -> (Mesh, Topology) {
        let mesh = grid(24, 24, Diagonal::Diamond, |u, v| {
            let (x, y) = (u - 0.5, v - 0.5);
            DVec3::new(x, y, 40.0 * (x * x + y * y))
        });
        let topology = Topology::new(&mesh).unwrap();
        (mesh, topology)
    }

    #[test]
    fn when_every_seed_fails_the_furthest_failure_is_told_and_what_became_of_each() {
        let (mesh, topology) = bowl();
        let found = search(&mesh, &topology, &SearchSettings::default(), &Unobserved).unwrap();
        assert!(found.outcomes.iter().all(|o| matches!(o, SeedOutcome::Stopped(Stop::Flipped { .. }))));
        let report = found.report(&[]);
        assert_eq!((report.best, report.worst, report.success_percent), (None, None, Some(0.0)));
        let Err(FlatteningError::NoSeed { tried, furthest }) = found.best else { panic!("{:?}", found.best) };
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
        let error = search(&mesh, &topology, &SearchSettings::default(), &Unobserved).unwrap_err();
        assert!(matches!(error, EngineError::Flattening(FlatteningError::SeveralPieces { .. })), "{error:?}");
    }

    #[test]
    fn an_empty_mesh_has_no_seed() {
        let mesh = Mesh::default();
        let topology = Topology::new(&mesh).unwrap();
        let found = search(&mesh, &topology, &SearchSettings::default(), &Unobserved).unwrap();
        assert_eq!(found.best, Err(FlatteningError::SeedNotFound));
    }

    /// Cancels when it has heard of progress so often, says that the time is over at its n-th question, and keeps what
    /// it heard.
    struct Impatient {
        reports: usize,
        questions: AtomicU32,
        patience: u32,
        heard: Mutex<Vec<f64>>,
    }

    impl Impatient {
        fn new(reports: usize, patience: u32) -> Self {
            Self { reports, questions: AtomicU32::new(0), patience, heard: Mutex::default() }
        }
    }

    impl Observer for Impatient {
        fn progress(&self, fraction: f64) {
            self.heard.lock().unwrap().push(fraction);
        }
        fn out_of_time(&self, budget_s: f64) -> bool {
            assert_eq!(budget_s, 7.0);
            self.questions.fetch_add(1, Ordering::Relaxed) >= self.patience
        }
        fn is_cancelled(&self) -> bool {
            self.heard.lock().unwrap().len() >= self.reports
        }
    }

    #[test]
    fn a_search_stops_at_the_next_seed_when_it_is_no_longer_wanted() {
        let (mesh, topology) = dome(40, 40.0);
        let observer = Impatient::new(2, u32::MAX);
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
        let observer = Impatient::new(usize::MAX, u32::MAX);
        let settings = SearchSettings {
            readings: Readings { check: Check::Final, ..Readings::default() },
            ..SearchSettings::default()
        };
        search(&mesh, &topology, &settings, &observer).unwrap();
        assert_eq!(observer.heard.into_inner().unwrap().last(), Some(&1.0));
    }

    #[test]
    fn when_the_budget_runs_out_the_best_so_far_is_taken_and_the_report_says_so() {
        let (mesh, topology) = dome(20, 120.0);
        let options = SearchOptions { budget_s: Some(7.0), ..SearchOptions::default() };
        for landscape in [true, false] {
            let settings = SearchSettings { options, landscape, ..SearchSettings::default() };
            let found = search(&mesh, &topology, &settings, &Impatient::new(usize::MAX, 3)).unwrap();
            // Four slices, each meant to be twice as large as the one before; the sample ends within the third. The first is
            // not asked about.
            assert_eq!(found.tried, 8 + 16 + 3 + 64);
            assert!(!found.complete());
            let untried = found.outcomes.iter().filter(|o| **o == SeedOutcome::Untried).count() as u64;
            assert_eq!(found.tried + untried, mesh.triangles.len() as u64);
            let report = found.report(&[]);
            assert_eq!((report.complete, report.budget_s, report.tried), (false, Some(7.0), found.tried));
            let best = found.best.unwrap();
            let least = found.outcomes.iter().filter_map(|o| o.changes()?.area_percent).fold(f64::INFINITY, f64::min);
            assert_eq!(best.percent, least);
            let all = search(&mesh, &topology, &settings, &Impatient::new(usize::MAX, u32::MAX)).unwrap();
            assert!(all.complete() && all.best.unwrap().percent <= best.percent);
        }
    }

    #[test]
    fn a_budget_that_runs_out_before_any_seed_succeeds_is_an_error_of_its_own() {
        let (mesh, topology) = bowl();
        let options = SearchOptions { budget_s: Some(7.0), ..SearchOptions::default() };
        let settings = SearchSettings { options, ..SearchSettings::default() };
        let found = search(&mesh, &topology, &settings, &Impatient::new(usize::MAX, 0)).unwrap();
        let Err(FlatteningError::BudgetSpent { tried, seeds, .. }) = found.best else { panic!("{:?}", found.best) };
        assert_eq!((tried as usize, seeds as usize), (FIRST_SLICE, mesh.triangles.len()));
    }
}
