//! How much work a job is, roughly, before it is done: the queue gives small jobs a lane of their own.

use serde_json::Value;

#[cfg(test)]
use super::checks::MAX_BUDGET_S;
use super::checks::{MAX_TRIANGLES, grid_triangles};
use crate::engine::flattening::SeedChoice;
use crate::engine::job::{JobKind, JobOptions};
use crate::engine::pipeline::{CADER_TRIANGLES, OPTIMUM_UP_TO};
use crate::engine::triangulation::Density;

/// Triangles times the relative chord (or area) tolerance, on doubly curved parts: real faces came to 0.1 to 4. Too much
/// sends a small job to the larger lane, where it runs as well; too little lets a large one hold up small ones.
const TRIANGLES_TIMES_TOLERANCE: f64 = 4.0;

/// Size of a surface's part, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PartSize {
    /// Diagonal of its box, mm.
    pub diagonal: Option<f64>,
    /// Area, mm^2.
    pub area: Option<f64>,
    /// Triangles of a mesh, which is worked on as it is.
    pub triangles: Option<u64>,
}

impl PartSize {
    /// What the summary of a surface says.
    #[must_use]
    pub fn of(summary: &Value) -> Self {
        let number = |name: &str| summary.get(name).and_then(Value::as_f64);
        let triangles = summary.get("triangles").and_then(Value::as_u64);
        Self { diagonal: number("diagonal_mm"), area: number("area_mm2"), triangles }
    }
}

/// Triangles that two cores flatten in a second, the order of magnitude: what turns a budget into a cost.
pub const VISITS_PER_SECOND: u64 = 100_000_000;

/// Most visits of a job: ten minutes of them, which is what an attempt may take.
pub const MAX_VISITS: u64 = 600 * VISITS_PER_SECOND;

/// The estimate, in triangle visits: triangles times seeds tried, as far as the budget allows.
#[must_use]
pub fn cost(kind: JobKind, options: &JobOptions, size: PartSize) -> u64 {
    let triangles = match (size.triangles, options.triangulation.grid, options.triangulation.tolerance) {
        (Some(triangles), ..) => triangles,
        (None, Some(grid), _) => grid_triangles(grid),
        (None, None, Some(density)) => by_tolerance(density, size),
        (None, None, None) => CADER_TRIANGLES.1,
    };
    let searched = match (kind, options.flattening.seed) {
        (JobKind::OptimumSeedSearch, _) | (JobKind::Flatten, Some(SeedChoice::Optimum)) => true,
        (JobKind::Triangulate, _) | (JobKind::Flatten, Some(_)) => false,
        (JobKind::Flatten, None) => triangles <= OPTIMUM_UP_TO as u64,
    };
    if !searched {
        return triangles;
    }
    let budget = options.search.budget_s.map_or(u64::MAX, |s| (s * VISITS_PER_SECOND as f64) as u64);
    // The first seeds are tried whatever the budget is.
    triangles.saturating_mul(triangles).min(budget).max(triangles)
}

/// Triangles of a mesh whose density is left to a tolerance.
fn by_tolerance(density: Density, size: PartSize) -> u64 {
    let estimate = match density {
        Density::ChordRelative(share) | Density::AreaRelative(share) => TRIANGLES_TIMES_TOLERANCE / share,
        Density::Chord(chord) => size.diagonal.map_or(f64::INFINITY, |d| TRIANGLES_TIMES_TOLERANCE * d / chord),
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

    #[test]
    fn a_search_costs_the_square_of_the_triangles() {
        let size = PartSize::default();
        let mut options = JobOptions::default();
        options.triangulation.grid = Some([11, 11]);
        assert_eq!(cost(JobKind::Triangulate, &options, size), 200);
        assert_eq!(cost(JobKind::Flatten, &options, size), 40_000);
        options.flattening.seed = Some(SeedChoice::Centre);
        assert_eq!(cost(JobKind::Flatten, &options, size), 200);
        let mesh = PartSize { triangles: Some(30), ..size };
        assert_eq!(cost(JobKind::Triangulate, &options, mesh), 30, "a mesh has the triangles it has");
        options.flattening.seed = None;
        options.triangulation.grid = Some([101, 101]);
        assert_eq!(cost(JobKind::Flatten, &options, size), 20_000);
    }

    #[test]
    fn a_budget_bounds_what_a_search_costs_and_a_search_for_the_optimum_is_one_whatever_the_mesh() {
        let size = PartSize::default();
        let mut options = JobOptions::default();
        options.triangulation.grid = Some([301, 301]);
        assert_eq!(cost(JobKind::Flatten, &options, size), 180_000);
        assert_eq!(cost(JobKind::OptimumSeedSearch, &options, size), 180_000 * 180_000);
        options.search.budget_s = Some(2.5);
        assert_eq!(cost(JobKind::OptimumSeedSearch, &options, size), 250_000_000);
        options.search.budget_s = Some(1e-9);
        assert_eq!(cost(JobKind::OptimumSeedSearch, &options, size), 180_000);
        options.search.budget_s = Some(MAX_BUDGET_S);
        assert!(cost(JobKind::OptimumSeedSearch, &options, size) <= MAX_VISITS);
    }

    #[test]
    fn a_fine_tolerance_is_a_large_job_on_any_size_of_part() {
        let mut options = JobOptions::default();
        let size = PartSize { diagonal: Some(1000.0), area: Some(1e5), triangles: None };
        for (density, least) in [
            (Density::ChordRelative(1e-6), 4_000_000),
            (Density::Chord(1e-3), 4_000_000),
            (Density::Chord(1.0), 4000),
            (Density::Edge(1.0), 400_000),
            (Density::AreaRelative(1e-3), 4000),
            (Density::Area(100.0), 4000),
        ] {
            options.triangulation.tolerance = Some(density);
            assert_eq!(cost(JobKind::Triangulate, &options, size), least, "{density:?}");
        }
        options.triangulation.tolerance = Some(Density::Chord(1.0));
        assert_eq!(cost(JobKind::Triangulate, &options, PartSize::default()), MAX_TRIANGLES);
    }
}
