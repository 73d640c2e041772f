//! When a seed can no longer win: the change of what no later step can move only adds up.
//!
//! Cader's method moves a vertex only while it unfolds a triangle at that vertex. Triangles at one vertex are few levels
//! of the mapping order apart ([`CaderMesh::settles_within`]), so when a level is done, the triangles some levels before
//! it lie as they will lie at the end. Their changes of area (or the changes of length of their edges) are summed as they
//! settle; all terms are positive, so once the sum is greater than the least change that is known, the seed is lost.
//!
//! Never on a tie: the sum runs in the order of settling and the final change as eight sums in the order of the triangles, so the two
//! may differ by rounding; the bound is widened by more than both sums together can have lost ([`widened`]).

use glam::DVec2;

use crate::engine::distortion::{flat_area, flat_length};
use crate::engine::flattening::Readings;
use crate::engine::flattening::cader::{CaderMesh, Scratch};
use crate::engine::job::SearchMeasure;
use crate::engine::mesh::topology::NONE;
use crate::engine::mesh::{Mesh, Topology, measures};

/// What each triangle adds to the change.
#[derive(Debug)]
pub(super) enum Terms {
    /// Corners and area in space of each triangle; NaN for one that does not count.
    Area(Vec<([u32; 3], f64)>),
    /// Ends and lengths in space of the edges that triangles answer for, and where those of each begin. Every edge that
    /// counts has one triangle that answers for it.
    Shape { starts: Vec<u32>, edges: Vec<([u32; 2], f64)> },
}

impl Terms {
    /// The terms of a measure on the triangles that `part` marks.
    pub(super) fn new(mesh: &Mesh, topology: &Topology, part: Option<&[bool]>, measure: SearchMeasure) -> Self {
        let counts = |t: u32| part.is_none_or(|p| p.get(t as usize) == Some(&true));
        match measure {
            SearchMeasure::Area => {
                let area = |t: u32| if counts(t) { measures::area(measures::corners(mesh, t)) } else { f64::NAN };
                Self::Area(mesh.triangles.iter().enumerate().map(|(t, corners)| (*corners, area(t as u32))).collect())
            }
            SearchMeasure::Shape => {
                let lengths = measures::edge_lengths(mesh, topology);
                let mut owned: Vec<(u32, ([u32; 2], f64))> = Vec::with_capacity(lengths.len());
                for (e, length) in lengths.into_iter().enumerate() {
                    let (h, twin) = (topology.edges()[e], topology.twin(topology.edges()[e]));
                    if counts(h / 3) || (twin != NONE && counts(twin / 3)) {
                        owned.push((h / 3, (topology.edge_vertices(e as u32), length)));
                    }
                }
                owned.sort_by_key(|(triangle, _)| *triangle);
                let triangles = mesh.triangles.len() as u32;
                let starts = (0..=triangles).map(|t| owned.partition_point(|(owner, _)| *owner < t) as u32).collect();
                Self::Shape { starts, edges: owned.into_iter().map(|(_, edge)| edge).collect() }
            }
        }
    }

    /// What a settled triangle adds.
    #[inline]
    fn of(&self, triangle: u32, flat: &[DVec2]) -> f64 {
        match self {
            Self::Area(terms) => {
                let (corners, area) = terms[triangle as usize];
                if area.is_nan() { 0.0 } else { (area - flat_area(corners, flat)).abs() }
            }
            Self::Shape { starts, edges } => {
                let own = starts[triangle as usize] as usize..starts[triangle as usize + 1] as usize;
                edges[own].iter().map(|&(ends, length)| (length - flat_length(ends, flat)).abs()).sum()
            }
        }
    }
}

/// The sum over the triangles of one run that have settled.
#[derive(Debug)]
pub(super) struct Tally<'a> {
    terms: &'a Terms,
    /// Levels until a triangle has settled.
    lag: usize,
    /// The sum beyond which the seed has lost.
    bound: f64,
    sum: f64,
    /// Triangles summed.
    settled: usize,
    level: usize,
    /// Where the level begins that settles next, in the order of processing.
    next: usize,
}

impl<'a> Tally<'a> {
    /// Nothing summed yet. `bound` is a sum as [`widened`] gives it.
    pub(super) fn new(terms: &'a Terms, mesh: &CaderMesh, readings: Readings, bound: f64) -> Self {
        let lag = mesh.settles_within(readings).map_or(usize::MAX, |levels| levels as usize);
        Self { terms, lag, bound, sum: 0.0, settled: 0, level: 0, next: 0 }
    }

    /// A level is done: whether the seed may still win.
    #[inline]
    pub(super) fn goes_on(&mut self, scratch: &Scratch) -> bool {
        // Levels are asked about from the first on; the seed is level 0.
        self.level += 1;
        if self.level < self.lag {
            return true;
        }
        let levels = scratch.levels();
        let settling = self.level - self.lag;
        let Some(counts) = levels.get(settling) else { return true };
        self.next += counts.triangles as usize;
        let flat = scratch.flat();
        for triangle in scratch.stretch(self.settled..self.next) {
            self.sum += self.terms.of(triangle, flat);
        }
        self.settled = self.next;
        // A sum that is not a number (readings that let triangles collapse) abandons nothing.
        self.sum.partial_cmp(&self.bound) != Some(std::cmp::Ordering::Greater)
    }
}

/// The bound of a change in percent as a sum that no seed of that change exceeds, however its terms are added up.
///
/// A sum of `n` positive terms is off by at most `n` roundings, and there are two sums; a few more roundings lie between
/// a sum and its percentage.
pub(super) fn widened(percent: f64, before: f64, terms: usize) -> f64 {
    percent / 100.0 * before * (1.0 + (4 * terms + 16) as f64 * f64::EPSILON)
}
