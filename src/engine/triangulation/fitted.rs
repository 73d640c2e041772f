//! Diagonals fitted to the surface's Gaussian curvature: the thesis's optimised configuration (5.4).
//!
//! Greedy. The first point is the interior grid point of largest |K| (the lowest number where several have it); the rest
//! of its row follows, then the rows above it whole, each from i = 1, then the mirror image of that below. At each point
//! the cells round it whose diagonal is still free are tried both ways, 16, 4, 2 or 1 combinations, and the one whose
//! estimate (5.7) is nearest to the surface's own K stays. Combinations are counted in binary with the cells in the order
//! lower left, lower right, upper left, upper right, `/` before `\`; a later one must be strictly nearer, by more than rounding (`TIE`).
//!
//! Limits: a grid without interior points keeps `/` throughout. A cell is never visited twice, so late rows mostly
//! have one free cell a point: the first point decides more than the last.

use glam::DVec3;

use super::grid::split_cell;
use super::{DomainMesh, GridLines, Skew, grid_mesh_by};
use crate::engine::budget::Observer;
use crate::engine::curvature::Ring;
use crate::engine::error::EngineError;
use crate::engine::nurbs::{GridSamples, Surface};

/// An estimate is nearer only when it is so by more than this angle over the triangles' area. On symmetric surfaces mirrored
/// combinations tie but for rounding (about 1e-15 rad): less would let rounding choose, more would take real differences for
/// ties.
const TIE: f64 = 1e-12;

/// What the search found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fitted {
    /// For cell (i, j) at `j * (m - 1) + i` whether its diagonal is `\`.
    pub backslash: Vec<bool>,
    /// The point (i, j) that the search began with; `None` where the grid has no interior points.
    pub start: Option<[usize; 2]>,
    /// New combinations at each point, in the order of the search.
    pub tried: Vec<u8>,
}

/// Fits the diagonals of a grid, whose points are skewed where a skew is given.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub fn fit(
    surface: &Surface,
    lines: &GridLines,
    skew: Option<&Skew>,
    observer: &dyn Observer,
) -> Result<Fitted, EngineError> {
    let size = [lines.u.len(), lines.v.len()];
    let Some(skew) = skew else {
        let mut samples = GridSamples::default();
        surface.grid_positions(&lines.u, &lines.v, &mut samples);
        let mut own = Vec::with_capacity(samples.positions.len());
        for &v in &lines.v {
            observer.check()?;
            own.extend(lines.u.iter().map(|&u| surface.curvature(u, v).gaussian));
        }
        return fit_points(&samples.positions, &own, size, observer);
    };
    let (mut positions, mut own) = (Vec::new(), Vec::new());
    for row in skew.points(lines).chunks(size[0]) {
        observer.check()?;
        positions.extend(row.iter().map(|p| surface.point(p.x, p.y)));
        own.extend(row.iter().map(|p| surface.curvature(p.x, p.y).gaussian));
    }
    fit_points(&positions, &own, size, observer)
}

/// The mesh of a whole grid with fitted diagonals, numbered as [`super::grid_mesh`] numbers. The diagonals are fitted to the
/// skewed points, where a skew is given; the mesh's points are not skewed yet ([`Skew::apply`]).
///
/// # Errors
/// As [`fit`].
pub fn fitted_mesh(
    surface: &Surface,
    lines: &GridLines,
    skew: Option<&Skew>,
    observer: &dyn Observer,
) -> Result<DomainMesh, EngineError> {
    let fitted = fit(surface, lines, skew, observer)?;
    let columns = lines.u.len().saturating_sub(1);
    Ok(grid_mesh_by(lines, |i, j| fitted.backslash[j * columns + i]))
}

fn fit_points(
    positions: &[DVec3],
    own: &[f64],
    [m, n]: [usize; 2],
    observer: &dyn Observer,
) -> Result<Fitted, EngineError> {
    let mut start: Option<[usize; 2]> = None;
    for j in 1..n.saturating_sub(1) {
        for i in 1..m.saturating_sub(1) {
            if start.is_none_or(|[a, b]| own[j * m + i].abs() > own[b * m + a].abs()) {
                start = Some([i, j]);
            }
        }
    }
    let cells = m.saturating_sub(1) * n.saturating_sub(1);
    let mut search = Search { positions, own, m, diagonals: vec![None; cells], tried: Vec::new() };
    if let Some([first, row]) = start {
        (first..m - 1).for_each(|i| search.point(i, row));
        for j in row + 1..n - 1 {
            observer.check()?;
            (1..m - 1).for_each(|i| search.point(i, j));
        }
        (1..first).rev().for_each(|i| search.point(i, row));
        for j in (1..row).rev() {
            observer.check()?;
            (1..m - 1).rev().for_each(|i| search.point(i, j));
        }
    }
    let backslash = search.diagonals.iter().map(|&diagonal| diagonal == Some(true)).collect();
    Ok(Fitted { backslash, start, tried: search.tried })
}

struct Search<'a> {
    positions: &'a [DVec3],
    own: &'a [f64],
    m: usize,
    /// `None` while a cell's diagonal is free.
    diagonals: Vec<Option<bool>>,
    tried: Vec<u8>,
}

impl Search<'_> {
    /// Chooses the free diagonals round an interior point.
    fn point(&mut self, i: usize, j: usize) {
        let cells = [[i - 1, j - 1], [i, j - 1], [i - 1, j], [i, j]];
        let known = cells.map(|[i, j]| self.diagonals[j * (self.m - 1) + i]);
        let free = known.iter().filter(|d| d.is_none()).count();
        let target = self.own[j * self.m + i];
        let mut best = (f64::INFINITY, known.map(|d| d.unwrap_or(false)));
        for combination in 0..1_u8 << free {
            // The first free cell is the highest bit: it changes last.
            let mut bit = free;
            let chosen = known.map(|d| {
                d.unwrap_or_else(|| {
                    bit -= 1;
                    combination >> bit & 1 == 1
                })
            });
            let ring = self.estimate(j * self.m + i, &cells, chosen);
            let error = (ring.compensated() - target).abs();
            if error < best.0 - TIE / ring.area {
                best = (error, chosen);
            }
        }
        for ([i, j], backslash) in cells.into_iter().zip(best.1) {
            self.diagonals[j * (self.m - 1) + i] = Some(backslash);
        }
        self.tried.push(1 << free);
    }

    /// The triangles round a vertex with these diagonals.
    fn estimate(&self, vertex: usize, cells: &[[usize; 2]; 4], diagonals: [bool; 4]) -> Ring {
        let mut ring = Ring::default();
        for (&[i, j], backslash) in cells.iter().zip(diagonals) {
            let a = (j * self.m + i) as u32;
            let d = a + self.m as u32;
            for triangle in split_cell([a, a + 1, d + 1, d], backslash) {
                if let Some(e) = triangle.iter().position(|&k| k as usize == vertex) {
                    ring.add([0, 1, 2].map(|k| self.positions[triangle[(e + k) % 3] as usize]));
                }
            }
        }
        ring
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::budget::Unobserved;
    use crate::engine::nurbs::shapes::{plane, torus};

    #[test]
    fn a_plane_keeps_its_first_diagonals_and_the_counts_shrink_from_sixteen() {
        let surface = plane(10.0, 8.0);
        let lines = GridLines::uniform(surface.domain(), 4, 4);
        let fitted = fit(&surface, &lines, None, &Unobserved).unwrap();
        assert_eq!(fitted.backslash, [false; 9]);
        // The first point has four free cells, its neighbours along the row and above it two, the last one.
        assert_eq!(fitted.tried, [16, 4, 4, 2]);
        let slim = GridLines::uniform(surface.domain(), 2, 5);
        assert_eq!(fit(&surface, &slim, None, &Unobserved).unwrap().start, None);
    }

    #[test]
    fn every_point_of_a_torus_is_visited_once_and_the_search_repeats_itself() {
        let surface = torus(30.0, 10.0);
        let lines = GridLines::uniform(surface.domain(), 17, 13);
        let fitted = fit(&surface, &lines, None, &Unobserved).unwrap();
        assert_eq!(fitted.tried.len(), 15 * 11);
        // Every cell is chosen once: powers of two add up to the number of cells.
        assert_eq!(fitted.tried.iter().map(|t| t.trailing_zeros()).sum::<u32>(), 16 * 12);
        assert_eq!(fit(&surface, &lines, None, &Unobserved).unwrap(), fitted);
    }

    #[test]
    fn diagonals_start_and_counts_are_those_of_the_reference_case() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/cases/flatten_small.json");
        let Ok(text) = std::fs::read_to_string(path) else {
            println!("reference cases are not there: nothing compared");
            return;
        };
        let case: serde_json::Value = serde_json::from_str(&text).unwrap();
        let points: Vec<[f64; 3]> = serde_json::from_value(case["X"].clone()).unwrap();
        let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        let own: Vec<f64> = serde_json::from_value(case["K_exact"].clone()).unwrap();
        let fitted = fit_points(&points, &own, [11, 9], &Unobserved).unwrap();
        let expected = &case["optimised"];
        let diagonals: Vec<Vec<u8>> = serde_json::from_value(expected["diagonals_57"].clone()).unwrap();
        let found: Vec<u8> = fitted.backslash.iter().map(|&b| u8::from(b)).collect();
        assert_eq!(found, diagonals.concat());
        assert_eq!(serde_json::to_value(fitted.start).unwrap(), expected["start"]);
        assert_eq!(serde_json::to_value(fitted.tried).unwrap(), expected["tried"]);
    }
}
