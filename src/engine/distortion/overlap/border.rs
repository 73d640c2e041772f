//! The borders of a flat mesh as closed polylines, and where their edges cross.

use glam::DVec2;

use super::predicate::{above, area, left, right_of};
use crate::engine::boxes::Tree;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::mesh::Topology;

/// The most crossings that are sorted out. A border that crosses itself more often covers itself nearly everywhere.
const MOST_CROSSINGS: usize = 1 << 21;

/// The most pairs of edges whose boxes meet that are looked at: ordinary borders have a few an edge.
const MOST_PAIRS: usize = 1 << 28;

/// Borders that coincide are told apart by moving their nodes by this part of the extent: below what a touch may be, above
/// what rounding does to the order of crossings along an edge.
const SHAKEN: f64 = 1e-11;

/// Pairs between two questions whether to go on.
const BETWEEN_CHECKS: usize = 1 << 16;

/// All borders. Edge `k` runs from node `k` to node `next[k]`, and the mesh lies to its left. A vertex that borders pass
/// twice is two nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Border {
    pub(super) points: Vec<DVec2>,
    pub(super) next: Vec<u32>,
    /// The half-edge that edge `k` is.
    pub(super) halfedges: Vec<u32>,
    /// First node of each loop; loops are runs of nodes.
    pub(super) loops: Vec<u32>,
}

/// Edges `a < b` cross.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub(super) edges: [u32; 2],
    /// How far along each edge, in [0, 1].
    pub(super) at: [f64; 2],
    /// True when the walk along the first edge comes from the right of the second and goes to its left.
    pub(super) to_left: bool,
    pub(super) point: DVec2,
}

impl Border {
    /// Of a flat mesh. Loops that are not wholly flattened are left out.
    pub(super) fn new(flat: &[DVec2], topology: &Topology) -> Self {
        let mut border = Self::default();
        for halfedges in topology.borders() {
            let points = halfedges.iter().map(|&h| flat[topology.origin(h) as usize]);
            if points.clone().all(DVec2::is_finite) {
                border.push(points, halfedges);
            }
        }
        border.shaken()
    }

    /// Adds a closed loop.
    pub(super) fn push(&mut self, points: impl Iterator<Item = DVec2>, halfedges: &[u32]) {
        let start = self.points.len() as u32;
        let end = start + halfedges.len() as u32;
        self.loops.push(start);
        self.points.extend(points);
        self.next.extend((start..end).map(|k| if k + 1 == end { start } else { k + 1 }));
        self.halfedges.extend(halfedges);
    }

    /// The same with each node moved by up to [`SHAKEN`] of the extent, by an amount that depends on its number.
    pub(super) fn shaken(mut self) -> Self {
        let low = self.points.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = self.points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let step = SHAKEN * low.distance(high);
        for (k, p) in self.points.iter_mut().enumerate() {
            let bits = scattered(k as u64);
            let part = |bits: u64| f64::from(bits as u32) / f64::from(u32::MAX) - 0.5;
            *p += DVec2::new(part(bits), part(bits >> 32)) * step;
        }
        self
    }

    /// The nodes of loop `number`.
    pub(super) fn nodes(&self, number: usize) -> std::ops::Range<usize> {
        let end = self.loops.get(number + 1).map_or(self.points.len(), |&k| k as usize);
        self.loops[number] as usize..end
    }

    /// The ends of an edge.
    pub(super) fn ends(&self, edge: usize) -> [DVec2; 2] {
        [self.points[edge], self.points[self.next[edge] as usize]]
    }

    /// A tree over the edges.
    pub(super) fn tree(&self) -> Tree {
        let boxes = (0..self.points.len()).map(|k| {
            let [a, b] = self.ends(k);
            [a.min(b), a.max(b)]
        });
        Tree::new(boxes.collect())
    }

    /// All crossings in a fixed order. `None` when there are too many.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`].
    pub(super) fn crossings(&self, tree: &Tree, observer: &dyn Observer) -> Result<Option<Vec<Crossing>>, EngineError> {
        let (mut found, mut pairs, mut stopped) = (Vec::new(), 0_usize, Ok(()));
        tree.pairs(|i, j| {
            pairs += 1;
            if pairs.is_multiple_of(BETWEEN_CHECKS) {
                stopped = observer.check();
            }
            found.extend(self.crossing(i, j));
            stopped.is_ok() && found.len() <= MOST_CROSSINGS && pairs <= MOST_PAIRS
        });
        stopped?;
        Ok((found.len() <= MOST_CROSSINGS && pairs <= MOST_PAIRS).then_some(found))
    }

    /// Whether and where two edges `i < j` cross. Neighbours in a loop do not.
    fn crossing(&self, i: usize, j: usize) -> Option<Crossing> {
        let (a, b) = (i, self.next[i] as usize);
        let (c, d) = (j, self.next[j] as usize);
        if a == c || a == d || b == c || b == d {
            return None;
        }
        let p = &self.points;
        let (a_left, b_left) = (left(p, c, d, a), left(p, c, d, b));
        if a_left == b_left || left(p, a, b, c) == left(p, a, b, d) {
            return None;
        }
        let at = [share(p[a], p[b], [p[c], p[d]]), share(p[c], p[d], [p[a], p[b]])];
        let point = p[a].lerp(p[b], at[0]);
        Some(Crossing { edges: [i as u32, j as u32], at, to_left: b_left, point })
    }

    /// How often the borders wind around the place to the right of each edge's start, for the first edge of each loop from
    /// its rightmost node on: `(edge, windings)`.
    pub(super) fn start(&self, tree: &Tree, number: usize) -> (usize, i32) {
        let p = &self.points;
        let nodes = self.nodes(number);
        let first = nodes.start;
        let node = nodes.clone().skip(1).fold(first, |best, k| if right_of(p, k, best) { k } else { best });
        let before = if node == first { nodes.end - 1 } else { node - 1 };
        let after = self.next[node] as usize;
        // A half-line to the right leaves the loop here and meets neither of the node's own edges.
        let mut windings = 0;
        tree.to_the_right(p[node], |edge| {
            let (a, b) = (edge, self.next[edge] as usize);
            if a == node || b == node {
                return;
            }
            let (from, to) = (above(p, a, node), above(p, b, node));
            if from != to && left(p, a, b, node) == to {
                windings += if to { 1 } else { -1 };
            }
        });
        // At a corner that turns left the place lies to the right of both edges, at one that turns right to the left.
        (node, if left(p, before, node, after) { windings } else { windings - 1 })
    }
}

/// A number whose bits look random (the finaliser of `SplitMix64`).
fn scattered(k: u64) -> u64 {
    let mut z = k.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// How far along `a b` the line through the other edge meets it. Where both lie on one line: the middle of what they share.
fn share(a: DVec2, b: DVec2, [c, d]: [DVec2; 2]) -> f64 {
    let (from, to) = (area(c, d, a), area(c, d, b));
    if from != to && from.is_finite() && to.is_finite() && (from > 0.0) != (to > 0.0) {
        return (from / (from - to)).clamp(0.0, 1.0);
    }
    let along = b - a;
    let place = |p: DVec2| ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    let middle = 0.5 * (place(c) + place(d));
    if middle.is_finite() { middle } else { 0.5 }
}
