//! Triangulation by plane sweep, after Hertel and Mehlhorn, "Fast triangulation of the plane with respect to simple
//! polygons" (1983); reconstructed from general knowledge of it.
//!
//! Points are taken in order of (v, u), as if the line that sweeps upwards were tilted by an infinitesimal angle, so that
//! horizontal edges need no cases of their own. Active edges stand from left to right. Between a left edge (directed
//! down: the region is to its right) and the next edge (directed up) lies an *interval* of the region. What is still to
//! be triangulated below the sweep line is bounded by the interval's *chain*, from the last point of its left edge to
//! that of its right edge. Every inner vertex of a chain is reflex or straight as seen from above: as soon as one is not,
//! its triangle is written. So each new point only looks at the ends of chains, and:
//!
//! - an edge that ends gives its interval a new end point, which cuts off what it sees (strictly: collinear points stay);
//! - a point inside an interval (a split) sees the chain's newest point, its *helper*; the chain is cut there in two;
//! - two intervals that meet at a point (a merge) have their chains joined there;
//! - an interval that ends at a point is a pseudo-triangle with at most three convex corners, hence a fan of that point.
//!
//! All ends and starts at a point are dealt with together, so polygons that touch themselves in a vertex need nothing
//! special. Each decision is an exact sign (`robust`), or a comparison of coordinates.
//!
//! Active edges are a plain sorted list: finding is O(log n), inserting moves O(active edges) words. That is the fastest
//! for the tens of active edges that occur; with 10^5 of them the moving would show.

use std::cmp::Ordering;

use glam::DVec2;
use robust::{Coord, orient2d};

use super::NONE;

/// Codes at or above this mark a diagonal that no triangle has claimed on either side; the rest is its number.
const DIAGONAL: u32 = 1 << 31;

/// The edges do not bound a region at this point (an index of the points given).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) struct Trouble {
    pub(in super::super) point: u32,
}

/// An edge between its lower and upper point.
#[derive(Debug, Clone, Copy)]
struct Edge {
    low: u32,
    high: u32,
    /// Directed up: the region is to its left.
    up: bool,
    /// The interval to the right of an edge that is directed down.
    interval: u32,
}

/// A vertex in a chain.
#[derive(Debug, Clone, Copy)]
struct Node {
    vertex: u32,
    previous: u32,
    next: u32,
    /// What lies below the link to the next node: a half-edge, a diagonal, or nothing.
    below: u32,
}

/// A piece of the sweep line inside the region, by its chain.
#[derive(Debug, Clone, Copy)]
struct Interval {
    left: u32,
    right: u32,
    /// The node of the newest point.
    helper: u32,
}

/// The sweep's memory, and its result.
#[derive(Debug, Default)]
pub(super) struct Sweep {
    order: Vec<u32>,
    rank: Vec<u32>,
    edges: Vec<Edge>,
    /// Edges by their lower point; those of rank r are `starts[first_start[r]..first_start[r + 1]]`.
    starts: Vec<u32>,
    first_start: Vec<u32>,
    active: Vec<u32>,
    ending: Vec<u32>,
    nodes: Vec<Node>,
    intervals: Vec<Interval>,
    diagonals: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    twins: Vec<u32>,
}

/// Twice the signed area of a triangle; its sign is exact.
pub(in super::super) fn orientation(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

fn sweep_order(p: DVec2, q: DVec2) -> Ordering {
    p.y.partial_cmp(&q.y).unwrap_or(Ordering::Equal).then(p.x.partial_cmp(&q.x).unwrap_or(Ordering::Equal))
}

impl Sweep {
    /// The triangles, and for each half-edge `3 t + e` its twin or [`NONE`].
    pub(super) fn mesh_mut(&mut self) -> (&mut [[u32; 3]], &mut [u32]) {
        (&mut self.triangles, &mut self.twins)
    }

    /// Triangulates the region to the left of `edges`.
    pub(super) fn run(&mut self, points: &[DVec2], edges: &[[u32; 2]]) -> Result<(), Trouble> {
        self.prepare(points, edges)?;
        for k in 0..self.order.len() {
            let p = self.order[k];
            if self.rank[p as usize] == k as u32 {
                self.visit(points, p, k)?;
            }
        }
        match self.active.first() {
            Some(&e) => Err(Trouble { point: self.edges[e as usize].high }),
            None => Ok(()),
        }
    }

    /// Sorts points and edges.
    fn prepare(&mut self, points: &[DVec2], edges: &[[u32; 2]]) -> Result<(), Trouble> {
        for list in [&mut self.order, &mut self.starts, &mut self.first_start, &mut self.active, &mut self.diagonals] {
            list.clear();
        }
        self.edges.clear();
        self.nodes.clear();
        self.intervals.clear();
        self.triangles.clear();
        self.twins.clear();
        self.order.extend(0..points.len() as u32);
        self.order.sort_unstable_by(|&a, &b| sweep_order(points[a as usize], points[b as usize]).then(a.cmp(&b)));
        // Points at one place share the rank of the first.
        self.rank.clear();
        self.rank.resize(points.len(), 0);
        let mut first = 0;
        for (k, &p) in self.order.iter().enumerate() {
            if points[self.order[first] as usize] != points[p as usize] {
                first = k;
            }
            self.rank[p as usize] = first as u32;
        }
        self.first_start.resize(points.len() + 2, 0);
        for &[a, b] in edges {
            let (ra, rb) = (self.rank[a as usize], self.rank[b as usize]);
            let (low, high) = if ra < rb { (ra, rb) } else { (rb, ra) };
            if low == high {
                return Err(Trouble { point: a });
            }
            let at = |rank: u32| self.order[rank as usize];
            self.first_start[low as usize + 2] += 1;
            self.edges.push(Edge { low: at(low), high: at(high), up: ra < rb, interval: NONE });
        }
        for k in 2..self.first_start.len() {
            self.first_start[k] += self.first_start[k - 1];
        }
        self.starts.resize(edges.len(), 0);
        for (e, edge) in self.edges.iter().enumerate() {
            let slot = &mut self.first_start[self.rank[edge.low as usize] as usize + 1];
            self.starts[*slot as usize] = e as u32;
            *slot += 1;
        }
        Ok(())
    }

    /// Takes the sweep line over the point `p` of rank `rank`.
    fn visit(&mut self, points: &[DVec2], p: u32, rank: usize) -> Result<(), Trouble> {
        let trouble = Err(Trouble { point: p });
        let at = |k: u32| points[k as usize];
        let side = |edge: &Edge| orientation(at(edge.low), at(edge.high), at(p));
        let edges = &self.edges;
        let position = self.active.partition_point(|&e| side(&edges[e as usize]) < 0.0);
        let ends = self.active[position..].iter().take_while(|&&e| edges[e as usize].high == p).count();
        if let Some(&beyond) = self.active.get(position + ends)
            && side(&edges[beyond as usize]) <= 0.0
        {
            return trouble; // an edge runs through the point
        }
        let starting = self.first_start[rank] as usize..self.first_start[rank + 1] as usize;
        if starting.len() > 1 {
            let edges = &self.edges;
            self.starts[starting.clone()].sort_unstable_by(|&a, &b| {
                let turn = orientation(at(p), at(edges[a as usize].high), at(edges[b as usize].high));
                turn.partial_cmp(&0.0).unwrap_or(Ordering::Equal)
            });
        }
        if ends == 0 && starting.is_empty() {
            return Ok(()); // a point of no edge
        }
        // Left to right the region must alternate, below the point and above it.
        let left_edge = position.checked_sub(1).map(|k| self.active[k]);
        let left_inside = left_edge.is_some_and(|e| !self.edges[e as usize].up);
        let mut inside = left_inside;
        for &e in &self.active[position..position + ends] {
            if self.edges[e as usize].up != inside {
                return trouble;
            }
            inside = !inside;
        }
        let right_inside = inside;
        inside = left_inside;
        for &e in &self.starts[starting.clone()] {
            if self.edges[e as usize].up != inside {
                return trouble;
            }
            inside = !inside;
        }
        if inside != right_inside {
            return trouble;
        }
        self.ending.clear();
        self.ending.extend_from_slice(&self.active[position..position + ends]);
        self.active.splice(position..position + ends, self.starts[starting.clone()].iter().copied());

        let left = left_edge.filter(|_| left_inside).map(|e| self.edges[e as usize].interval);
        let mut right = None;
        if let (Some(&last), true) = (self.ending.last(), right_inside) {
            right = Some(self.edges[last as usize].interval);
        }
        if ends > 0 {
            if let Some(left) = left {
                self.push_right(points, left, p, NONE);
            }
            for k in 0..ends - 1 {
                let edge = self.edges[self.ending[k] as usize];
                if !edge.up {
                    self.finish(points, edge.interval, p)?;
                }
            }
            if let Some(right) = right {
                self.push_left(points, right, p, NONE);
            }
            if let (Some(left), Some(right), true) = (left, right, starting.is_empty()) {
                self.merge(left, right);
            }
        } else if let Some(left) = left {
            right = Some(self.split(points, left, p));
        }
        for k in starting.clone() {
            let e = self.starts[k] as usize;
            if self.edges[e].up {
                continue;
            }
            self.edges[e].interval = match right {
                Some(right) if k + 1 == starting.end => right,
                _ => self.begin(p),
            };
        }
        Ok(())
    }

    /// A new interval whose chain is one point.
    fn begin(&mut self, p: u32) -> u32 {
        let node = self.node(p, NONE, NONE, NONE);
        self.intervals.push(Interval { left: node, right: node, helper: node });
        self.intervals.len() as u32 - 1
    }

    fn node(&mut self, vertex: u32, previous: u32, next: u32, below: u32) -> u32 {
        self.nodes.push(Node { vertex, previous, next, below });
        self.nodes.len() as u32 - 1
    }

    /// Puts `p` before the chain's left end and cuts off what it sees. `link` lies below the first link.
    fn push_left(&mut self, points: &[DVec2], interval: u32, p: u32, link: u32) {
        let old = self.intervals[interval as usize].left;
        let fresh = self.node(p, NONE, old, link);
        self.nodes[old as usize].previous = fresh;
        loop {
            let first = self.nodes[fresh as usize].next;
            let second = self.nodes[first as usize].next;
            if second == NONE {
                break;
            }
            let [v, w] = [first, second].map(|n| self.nodes[n as usize].vertex);
            if orientation(points[p as usize], points[v as usize], points[w as usize]) <= 0.0 {
                break;
            }
            let codes = [self.nodes[fresh as usize].below, self.nodes[first as usize].below];
            self.nodes[fresh as usize].below = self.emit([p, v, w], codes);
            self.nodes[fresh as usize].next = second;
            self.nodes[second as usize].previous = fresh;
        }
        let interval = &mut self.intervals[interval as usize];
        interval.left = fresh;
        interval.helper = fresh;
    }

    /// Puts `p` behind the chain's right end and cuts off what it sees.
    fn push_right(&mut self, points: &[DVec2], interval: u32, p: u32, link: u32) {
        let old = self.intervals[interval as usize].right;
        let fresh = self.node(p, old, NONE, NONE);
        self.nodes[old as usize].next = fresh;
        self.nodes[old as usize].below = link;
        loop {
            let last = self.nodes[fresh as usize].previous;
            let before = self.nodes[last as usize].previous;
            if before == NONE {
                break;
            }
            let [v, w] = [before, last].map(|n| self.nodes[n as usize].vertex);
            if orientation(points[v as usize], points[w as usize], points[p as usize]) <= 0.0 {
                break;
            }
            let codes = [self.nodes[before as usize].below, self.nodes[last as usize].below];
            self.nodes[before as usize].below = self.emit([v, w, p], codes);
            self.nodes[before as usize].next = fresh;
            self.nodes[fresh as usize].previous = before;
        }
        let interval = &mut self.intervals[interval as usize];
        interval.right = fresh;
        interval.helper = fresh;
    }

    /// Cuts an interval at `p` inside it, along the diagonal from `p` to its helper. Returns the right part.
    fn split(&mut self, points: &[DVec2], interval: u32, p: u32) -> u32 {
        let Interval { right, helper, .. } = self.intervals[interval as usize];
        let at = self.nodes[helper as usize];
        let copy = self.node(at.vertex, NONE, at.next, at.below);
        if at.next != NONE {
            self.nodes[at.next as usize].previous = copy;
        }
        self.nodes[helper as usize].next = NONE;
        self.intervals[interval as usize].right = helper;
        self.intervals.push(Interval { left: copy, right: if right == helper { copy } else { right }, helper: copy });
        let other = self.intervals.len() as u32 - 1;
        let diagonal = DIAGONAL | self.diagonals.len() as u32;
        self.diagonals.push(NONE);
        self.push_right(points, interval, p, diagonal);
        self.push_left(points, other, p, diagonal);
        other
    }

    /// Joins two intervals whose chains meet in the point that was just put on both.
    fn merge(&mut self, left: u32, right: u32) {
        let (l, r) = (self.intervals[left as usize].right, self.intervals[right as usize].left);
        let Node { next, below, .. } = self.nodes[r as usize];
        self.nodes[l as usize].next = next;
        self.nodes[l as usize].below = below;
        self.nodes[next as usize].previous = l;
        self.intervals[left as usize].right = self.intervals[right as usize].right;
        self.intervals[left as usize].helper = l;
    }

    /// Ends an interval at `p`, the upper point of both its edges.
    fn finish(&mut self, points: &[DVec2], interval: u32, p: u32) -> Result<(), Trouble> {
        let Interval { left, right, .. } = self.intervals[interval as usize];
        self.push_left(points, interval, p, NONE);
        let fan = self.intervals[interval as usize].left;
        // A chain of one point is a pair of coincident edges; one that is not used up is not seen from `p`.
        if left == right || self.nodes[fan as usize].next != right { Err(Trouble { point: p }) } else { Ok(()) }
    }

    /// Writes a triangle whose first two edges lie on links with these codes. Returns its third half-edge.
    fn emit(&mut self, corners: [u32; 3], codes: [u32; 2]) -> u32 {
        let first = 3 * self.triangles.len() as u32;
        self.triangles.push(corners);
        self.twins.extend([NONE; 3]);
        for (h, code) in [(first, codes[0]), (first + 1, codes[1])] {
            let mut other = code;
            if code != NONE && code & DIAGONAL != 0 {
                let claimed = &mut self.diagonals[(code & !DIAGONAL) as usize];
                other = *claimed;
                *claimed = h;
            }
            if other != NONE {
                self.twins[h as usize] = other;
                self.twins[other as usize] = h;
            }
        }
        first + 2
    }
}
