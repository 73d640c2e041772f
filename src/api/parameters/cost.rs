//! How much work a job is, roughly, before it is done: the queue gives small jobs a lane of their own.

use super::checks::grid_triangles;
use crate::engine::flattening::SeedChoice;
use crate::engine::job::{JobKind, JobOptions};

/// Triangles of a mesh whose density is left to a tolerance: the most that Cader's method is given by default.
const TRIANGLES_BY_TOLERANCE: u64 = 7000;
/// Up to so many triangles the seed is searched when none is named.
const SEARCHED_BY_DEFAULT: u64 = 8000;

/// The estimate, in triangle visits: triangles times seeds tried.
#[must_use]
pub fn cost(kind: JobKind, options: &JobOptions) -> u64 {
    let triangles = options.triangulation.grid.map_or(TRIANGLES_BY_TOLERANCE, grid_triangles);
    let searched = match options.flattening.seed {
        Some(SeedChoice::Optimum) => true,
        Some(_) => false,
        None => triangles <= SEARCHED_BY_DEFAULT,
    };
    if kind == JobKind::Flatten && searched { triangles.saturating_mul(triangles) } else { triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_costs_the_square_of_the_triangles() {
        let mut options = JobOptions::default();
        options.triangulation.grid = Some([11, 11]);
        assert_eq!(cost(JobKind::Triangulate, &options), 200);
        assert_eq!(cost(JobKind::Flatten, &options), 40_000);
        options.flattening.seed = Some(SeedChoice::Centre);
        assert_eq!(cost(JobKind::Flatten, &options), 200);
        options.flattening.seed = None;
        options.triangulation.grid = Some([101, 101]);
        assert_eq!(cost(JobKind::Flatten, &options), 20_000);
    }
}
