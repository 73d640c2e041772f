//! How much work a job is, roughly, before it is done: the queue gives small jobs a lane of their own.

use serde_json::Value;

#[cfg(test)]
use super::checks::MAX_BUDGET_S;
use super::checks::{MAX_TRIANGLES, grid_triangles};
use crate::engine::flattening::{FlatteningMethod, Scheme, SeedChoice};
use crate::engine::job::{JobKind, JobOptions, SearchStrategy};
use crate::engine::pipeline::{CADER_TRIANGLES, DEFAULT_CHORD_RELATIVE, default_triangles, optimum_up_to};
use crate::engine::seed::predicted;
use crate::engine::triangulation::Density;

/// Triangles times the relative chord (or area) tolerance, on doubly curved parts of which no more is known: real faces
/// came to 0.1 to 4. Too much sends a small job to the larger lane, where it runs as well; too little lets a large one
/// hold up small ones.
const TRIANGLES_TIMES_TOLERANCE: f64 = 4.0;

/// What a triangle costs beside the visits of a search: it is made, measured, drawn and written. Rather too little, since
/// much of that is the same for any mesh; far too little, and jobs that only triangulate much would hold up small ones.
const VISITS_PER_TRIANGLE: u64 = 20;

/// What the map of least distortion costs a triangle beyond that: two microseconds on grids of 7200 triangles, up to seventeen
/// on strongly curved meshes of some ten thousand. Too much
/// sends parts of some thousand triangles to the larger lane, too little lets those of some ten thousand into the light one.
const SOLVER_VISITS_PER_TRIANGLE: u64 = 500;

/// What a map that lies on itself costs a triangle until it does not: 0.3 to 0.8 ms on meshes of 4600 to 59 000. Most parts for
/// which it is asked do not need it, but none is known before.
const INJECTIVE_VISITS_PER_TRIANGLE: u64 = 50_000;

/// What the release of energy costs a triangle: 50 to 100 microseconds on grids of 7000 triangles, with long waves of strain.
const RELEASE_VISITS_PER_TRIANGLE: u64 = 10_000;

/// Size of a surface's part, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PartSize {
    /// Diagonal of its box, mm.
    pub diagonal: Option<f64>,
    /// Area, mm^2.
    pub area: Option<f64>,
    /// Triangles of a mesh, which is worked on as it is.
    pub triangles: Option<u64>,
    /// Triangles that the default tolerance makes of a surface.
    pub default_triangles: Option<u64>,
    /// Faces of a part of several: a grid is laid on each.
    pub faces: Option<u64>,
}

impl PartSize {
    /// What the summary of a surface says.
    #[must_use]
    pub fn of(summary: &Value) -> Self {
        let number = |name: &str| summary.get(name).and_then(Value::as_f64);
        let count = |name: &str| summary.get(name).and_then(Value::as_u64);
        Self {
            diagonal: number("diagonal_mm"),
            area: number("area_mm2"),
            triangles: count("triangles"),
            default_triangles: count("default_triangles"),
            faces: count("faces"),
        }
    }

    /// Triangles times the relative chord tolerance that makes them: their number goes inversely with it.
    fn triangles_times_tolerance(self) -> f64 {
        self.default_triangles.map_or(TRIANGLES_TIMES_TOLERANCE, |n| n as f64 * DEFAULT_CHORD_RELATIVE)
    }
}

/// Triangles that two cores flatten in a second, the order of magnitude: what turns a budget into a cost.
pub const VISITS_PER_SECOND: u64 = 100_000_000;

/// Visits that a triangle of one run by the scheme `symmetric` is taken to cost: 48 fits, each about one unfolding, and what is
/// around them.
const SYMMETRIC_VISITS: u64 = 60;

/// Most visits of a job: ten minutes of them, which is what an attempt may take.
pub const MAX_VISITS: u64 = 600 * VISITS_PER_SECOND;

/// The estimate, in triangle visits: some for each triangle and, where seeds are searched, as many as seeds are tried, as
/// far as the budget allows.
#[must_use]
pub fn cost(kind: JobKind, options: &JobOptions, size: PartSize) -> u64 {
    let method = match kind {
        JobKind::OptimumSeedSearch => FlatteningMethod::Cader,
        JobKind::Triangulate | JobKind::Flatten => options.flattening.method(),
    };
    let triangles = match (size.triangles, options.triangulation.grid, options.triangulation.tolerance) {
        (Some(triangles), ..) => triangles,
        (None, Some(grid), _) => (grid_triangles(grid).saturating_mul(size.faces.unwrap_or(1))).min(MAX_TRIANGLES),
        (None, None, Some(density)) => by_tolerance(density, size),
        (None, None, None) => {
            let foretold = size.default_triangles.unwrap_or(MAX_TRIANGLES);
            let (least, most) = default_triangles(method);
            if kind == JobKind::Triangulate { foretold } else { foretold.clamp(least, most) }
        }
    };
    let seed = options.flattening.seed;
    let searched = kind == JobKind::OptimumSeedSearch
        || (kind == JobKind::Flatten
            && method == FlatteningMethod::Cader
            && matches!(seed, Some(SeedChoice::Optimum | SeedChoice::Predicted) | None));
    let predicted = options.search.strategy == SearchStrategy::Predicted
        || seed == Some(SeedChoice::Predicted)
        || (kind == JobKind::Flatten
            && seed.is_none()
            && triangles > optimum_up_to(options.flattening.readings().scheme) as u64);
    let tried = match (searched, predicted) {
        (true, true) => predicted::trials(triangles as usize) as u64,
        (true, false) => triangles,
        (false, _) => 0,
    };
    let solved = kind == JobKind::Flatten && method == FlatteningMethod::Isometric;
    let injective = solved && options.flattening.injective();
    let released = kind == JobKind::Flatten && matches!(method, FlatteningMethod::Mccartney | FlatteningMethod::Wang);
    let each = VISITS_PER_TRIANGLE
        + if released { RELEASE_VISITS_PER_TRIANGLE } else { 0 }
        + if solved { SOLVER_VISITS_PER_TRIANGLE } else { 0 }
        + if injective { INJECTIVE_VISITS_PER_TRIANGLE } else { 0 };
    let visits = match options.flattening.readings().scheme {
        Scheme::InTurn => 1,
        Scheme::Symmetric => SYMMETRIC_VISITS,
    };
    let once = (each + visits - 1).saturating_mul(triangles);
    // The first seeds are tried whatever the budget is.
    let budget = options.search.budget_s.map_or(u64::MAX, |s| (s * VISITS_PER_SECOND as f64) as u64);
    once.saturating_add(tried.saturating_mul(triangles).saturating_mul(visits).min(budget))
}

/// Triangles of a mesh whose density is left to a tolerance.
fn by_tolerance(density: Density, size: PartSize) -> u64 {
    let of_share = |share: f64| size.triangles_times_tolerance() / share;
    let estimate = match density {
        Density::ChordRelative(share) => of_share(share),
        Density::AreaRelative(share) => TRIANGLES_TIMES_TOLERANCE / share,
        Density::Chord(chord) => size.diagonal.map_or(f64::INFINITY, |d| of_share(chord / d)),
        Density::Area(area) => size.area.map_or(f64::INFINITY, |a| TRIANGLES_TIMES_TOLERANCE * a / area),
        // Right triangles whose longest side is the edge.
        Density::Edge(edge) => size.area.map_or(f64::INFINITY, |a| 4.0 * a / (edge * edge)),
    };
    // The engine refuses more than the limit, so no job is larger.
    (estimate.clamp(CADER_TRIANGLES.0 as f64, MAX_TRIANGLES as f64)) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::flattening::FlatteningOptions;
    use crate::engine::pipeline::ISOMETRIC_TRIANGLES;

    #[test]
    fn a_search_by_whole_levels_costs_more_but_no_more_than_its_budget() {
        let mut options = JobOptions::default();
        options.flattening.method = Some(FlatteningMethod::Cader);
        options.flattening.seed = Some(SeedChoice::Optimum);
        options.triangulation.grid = Some([60, 60]);
        let of = |options: &JobOptions| cost(JobKind::Flatten, options, PartSize::default());
        let in_turn = of(&options);
        options.flattening.readings = Some(crate::engine::flattening::Readings::SYMMETRIC);
        assert!(of(&options) > 30 * in_turn);
        options.search.budget_s = Some(2.0);
        assert!(of(&options) < 3 * VISITS_PER_SECOND);
    }

    #[test]
    fn a_search_costs_the_square_of_the_triangles() {
        let size = PartSize::default();
        let mut options = JobOptions::default();
        options.flattening.method = Some(FlatteningMethod::Cader);
        options.triangulation.grid = Some([11, 11]);
        assert_eq!(cost(JobKind::Triangulate, &options, size), 20 * 200);
        assert_eq!(cost(JobKind::Flatten, &options, size), 20 * 200 + 40_000);
        options.flattening.seed = Some(SeedChoice::Centre);
        assert_eq!(cost(JobKind::Flatten, &options, size), 20 * 200);
        let mesh = PartSize { triangles: Some(30), ..size };
        assert_eq!(cost(JobKind::Triangulate, &options, mesh), 20 * 30, "a mesh has the triangles it has");
        options.flattening.seed = None;
        options.triangulation.grid = Some([101, 101]);
        assert_eq!(cost(JobKind::Flatten, &options, size), (20 + 64) * 20_000, "few seeds are tried on a fine mesh");
        options.triangulation.grid = Some([41, 41]);
        options.flattening.seed = Some(SeedChoice::Predicted);
        assert_eq!(cost(JobKind::Flatten, &options, size), (20 + 22) * 3200);
        options.flattening.seed = None;
        options.search.strategy = SearchStrategy::Predicted;
        assert_eq!(cost(JobKind::OptimumSeedSearch, &options, size), (20 + 22) * 3200);
    }

    #[test]
    fn a_job_without_options_costs_what_the_default_tolerance_makes_of_the_surface() {
        let mut options = JobOptions::default();
        let isometric =
            cost(JobKind::Flatten, &options, PartSize { default_triangles: Some(3000), ..PartSize::default() });
        assert_eq!(isometric, 520 * 3000, "no seed is searched");
        options.flattening.injective = Some(true);
        let size = PartSize { default_triangles: Some(3000), ..PartSize::default() };
        assert_eq!(cost(JobKind::Flatten, &options, size), 50_520 * 3000, "the map may have to go on");
        assert_eq!(cost(JobKind::Triangulate, &options, size), 20 * 3000);
        options.flattening =
            FlatteningOptions { method: Some(FlatteningMethod::Cader), ..FlatteningOptions::default() };
        let of = |kind, foretold| cost(kind, &options, PartSize { default_triangles: foretold, ..PartSize::default() });
        assert_eq!(of(JobKind::Flatten, Some(300)), 20 * 300 + 300 * 300);
        // The density is brought into a range for flattening, and only for that.
        assert_eq!(of(JobKind::Flatten, Some(2)), 20 * 200 + 200 * 200);
        assert_eq!(of(JobKind::Flatten, Some(90_000)), 20 * 7000 + 7000 * 7000);
        assert_eq!(of(JobKind::Triangulate, Some(90_000)), 20 * 90_000);
        // Nothing is known, as of a part that is too large to be measured: the most that there may be.
        assert_eq!(of(JobKind::Flatten, None), 20 * 7000 + 7000 * 7000);
        assert_eq!(of(JobKind::Triangulate, None), 20 * MAX_TRIANGLES);
        let isometric = cost(JobKind::Flatten, &JobOptions::default(), PartSize::default());
        assert_eq!(isometric, 520 * ISOMETRIC_TRIANGLES.1);
    }

    #[test]
    fn what_the_default_tolerance_makes_foretells_other_tolerances() {
        let mut options = JobOptions::default();
        let size = PartSize { diagonal: Some(1000.0), default_triangles: Some(500), ..PartSize::default() };
        for (density, triangles) in [(Density::ChordRelative(1e-4), 5000), (Density::Chord(0.5), 1000)] {
            options.triangulation.tolerance = Some(density);
            assert_eq!(cost(JobKind::Triangulate, &options, size), 20 * triangles, "{density:?}");
        }
    }

    #[test]
    fn a_budget_bounds_what_a_search_costs_and_a_search_for_the_optimum_is_one_whatever_the_mesh() {
        let size = PartSize::default();
        let mut options = JobOptions::default();
        options.triangulation.grid = Some([301, 301]);
        let once = 20 * 180_000;
        assert_eq!(cost(JobKind::Flatten, &options, size), 520 * 180_000);
        options.flattening.method = Some(FlatteningMethod::Cader);
        assert_eq!(cost(JobKind::Flatten, &options, size), once + 64 * 180_000);
        assert_eq!(cost(JobKind::OptimumSeedSearch, &options, size), once + 180_000 * 180_000);
        options.search.budget_s = Some(2.5);
        assert_eq!(cost(JobKind::OptimumSeedSearch, &options, size), once + 250_000_000);
        options.search.budget_s = Some(1e-9);
        assert_eq!(cost(JobKind::OptimumSeedSearch, &options, size), once);
    }

    #[test]
    fn no_budget_makes_a_job_that_is_too_large() {
        let mut options = JobOptions::default();
        options.triangulation.grid = Some([1001, 2001]);
        options.search.budget_s = Some(MAX_BUDGET_S);
        assert!(cost(JobKind::OptimumSeedSearch, &options, PartSize::default()) <= MAX_VISITS);
    }

    #[test]
    fn a_fine_tolerance_is_a_large_job_on_any_size_of_part() {
        let mut options = JobOptions::default();
        let size = PartSize { diagonal: Some(1000.0), area: Some(1e5), ..PartSize::default() };
        for (density, least) in [
            (Density::ChordRelative(1e-6), 4_000_000),
            (Density::Chord(1e-3), 4_000_000),
            (Density::Chord(1.0), 4000),
            (Density::Edge(1.0), 400_000),
            (Density::AreaRelative(1e-3), 4000),
            (Density::Area(100.0), 4000),
        ] {
            options.triangulation.tolerance = Some(density);
            assert_eq!(cost(JobKind::Triangulate, &options, size), 20 * least, "{density:?}");
        }
        options.triangulation.tolerance = Some(Density::Chord(1.0));
        assert_eq!(cost(JobKind::Triangulate, &options, PartSize::default()), 20 * MAX_TRIANGLES);
    }
}
