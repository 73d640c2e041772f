//! Nested dissection: an order of the vertices in which a sparse Cholesky factorisation fills in little.
//!
//! Method: the vertices are halved by rank along the principal axis of their places in space; of the two sides the one
//! that has fewer vertices with a neighbour across the cut gives these as separator; both rests are divided likewise,
//! down to a handful of vertices (George 1973, with the cuts of inertial bisection). The separators of a surface are
//! near-straight sections, so the factor of n vertices has O(n log n) entries, as for the best orders known. Ties go by
//! vertex number: the order depends on nothing else.
//!
//! The answer is a binary tree of contiguous runs in the new numbering, children before their parent.

use std::cmp::Ordering;
use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DMat3, DVec3};

use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// Runs of at most this many vertices are not divided. Larger, and leaves are factorised with many zeros; smaller, and
/// the book-keeping of tiny fronts costs more than their arithmetic.
const LEAF: usize = 10;

/// Steps of the power iteration for the principal axis: a rough axis does, it only steers the cut.
const AXIS_STEPS: usize = 6;

/// Parts of at least this many vertices are cut where the separator is least; smaller ones in the middle.
const SWEPT: usize = 100;

/// Stripes in which a part is swept for its best cut.
const STRIPES: usize = 64;

/// Least share of a part on either side of a cut, and how much a cut's cost rises with the square of what the lesser side
/// lacks of a half: unequal halves make the tree deeper.
const LEAST_SHARE: f64 = 0.3;
const UNEQUAL: f64 = 6.0;

/// Parts of at least one in this many of all vertices are swept along more axes: their separators cost most.
const MANY_AXES: usize = 64;

/// "No node."
pub(super) const NO_NODE: u32 = u32::MAX;

/// A separator (or leaf) and what hangs below it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Node {
    /// Its own vertices, a range of the new numbering.
    pub(super) start: u32,
    /// End of that range.
    pub(super) end: u32,
    /// The two parts that it separates, or [`NO_NODE`] twice.
    pub(super) children: [u32; 2],
    /// Distance from the root.
    pub(super) depth: u32,
}

/// An elimination order with its tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Dissection {
    /// For each new number the old one.
    pub(super) order: Vec<u32>,
    /// Children before parents; the last is the root.
    pub(super) nodes: Vec<Node>,
}

/// The vertices' neighbours as a flat table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Graph {
    /// Where the neighbours of each vertex begin; one more entry than vertices.
    pub(super) starts: Vec<u32>,
    /// The neighbours.
    pub(super) neighbours: Vec<u32>,
}

impl Graph {
    /// The graph of the given edges over `0..count`.
    pub(crate) fn of_edges(count: usize, edges: impl Iterator<Item = [u32; 2]> + Clone) -> Self {
        let mut starts = vec![0_u32; count + 1];
        for [a, b] in edges.clone() {
            starts[a as usize + 1] += 1;
            starts[b as usize + 1] += 1;
        }
        for v in 0..count {
            starts[v + 1] += starts[v];
        }
        let mut fill = starts.clone();
        let mut neighbours = vec![0; starts[count] as usize];
        for [a, b] in edges {
            for (from, to) in [(a, b), (b, a)] {
                neighbours[fill[from as usize] as usize] = to;
                fill[from as usize] += 1;
            }
        }
        Self { starts, neighbours }
    }

    /// The neighbours of a vertex.
    pub(crate) fn of(&self, vertex: u32) -> &[u32] {
        &self.neighbours[self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize]
    }
}

/// Divides the vertices of a graph that lie at `places`.
pub(super) fn dissect(places: &[DVec3], graph: &Graph, observer: &dyn Observer) -> Result<Dissection, EngineError> {
    let mut dissector = Dissector {
        places,
        graph,
        observer,
        side: vec![0; places.len()],
        keyed: Vec::with_capacity(SWEPT),
        bucket: vec![0; places.len()],
        before: Vec::with_capacity(places.len()),
        after: Vec::with_capacity(places.len()),
        nodes: Vec::with_capacity(places.len() / 4 + 1),
    };
    let mut order: Vec<u32> = (0..places.len() as u32).collect();
    dissector.divide(&mut order, 0, 0)?;
    Ok(Dissection { order, nodes: dissector.nodes })
}

struct Dissector<'a> {
    places: &'a [DVec3],
    graph: &'a Graph,
    observer: &'a dyn Observer,
    /// Per vertex: the mark of the part it is in; every part has a mark of its own.
    side: Vec<u32>,
    keyed: Vec<(f64, u32)>,
    /// The stripe of each vertex in the sweep at hand.
    bucket: Vec<u32>,
    before: Vec<u32>,
    after: Vec<u32>,
    nodes: Vec<Node>,
}

impl Dissector<'_> {
    /// Arranges the vertices of one part and appends its nodes; gives the number of the part's top node. Each part has at
    /// most seven tenths of the vertices of the one above, which bounds the depth.
    fn divide(&mut self, part: &mut [u32], start: u32, depth: u32) -> Result<u32, EngineError> {
        self.observer.check()?;
        if part.len() <= LEAF {
            part.sort_unstable();
            return Ok(self.push(start, start + part.len() as u32, [NO_NODE; 2], depth));
        }
        let middle = self.halve(part);
        // Parts of one depth share their marks: no edge joins two of them, so none can be mistaken for the other's half.
        let mark_base = (depth + 1) << 1;
        for (rank, &v) in part.iter().enumerate() {
            self.side[v as usize] = mark_base | u32::from(rank >= middle);
        }
        let at_cut = |v: u32| self.graph.of(v).iter().any(|&w| self.side[w as usize] == (self.side[v as usize] ^ 1));
        let counts = [&part[..middle], &part[middle..]].map(|half| half.iter().filter(|&&v| at_cut(v)).count());
        // Vertices: left rest, right rest, separator. The separator is taken from the side that gives fewer.
        let from_left = counts[0] <= counts[1];
        let (mut rest, mut cut) = (Vec::with_capacity(part.len()), Vec::with_capacity(counts[0].min(counts[1])));
        let mut left = 0;
        for (rank, &v) in part.iter().enumerate() {
            if ((rank < middle) == from_left) && at_cut(v) {
                cut.push(v);
            } else {
                left += usize::from(rank < middle);
                rest.push(v);
            }
        }
        cut.sort_unstable();
        part[..rest.len()].copy_from_slice(&rest);
        part[rest.len()..].copy_from_slice(&cut);
        for &v in &cut {
            self.side[v as usize] = 0;
        }
        let (kept, own) = (rest.len(), cut.len());
        drop((rest, cut));
        let children = [
            self.divide(&mut part[..left], start, depth + 1)?,
            self.divide(&mut part[left..kept], start + left as u32, depth + 1)?,
        ];
        Ok(self.push(start + kept as u32, start + (kept + own) as u32, children, depth))
    }

    /// Puts one half of a part before the other; gives how many are in the first.
    fn halve(&mut self, part: &mut [u32]) -> usize {
        let frame = principal_frame(self.places, part);
        if part.len() < SWEPT {
            return self.halve_by_rank(part, frame[0]);
        }
        let [a, b, c] = frame;
        let tried = if part.len() * MANY_AXES >= self.places.len() {
            &[a, b, (a + b) * FRAC_1_SQRT_2, (a - b) * FRAC_1_SQRT_2, c][..]
        } else {
            &[a, b][..]
        };
        let best = tried
            .iter()
            .map(|&axis| (self.sweep(part, axis), axis))
            .reduce(|best, next| if next.0.0 < best.0.0 { next } else { best });
        let Some(((_, cut), axis)) = best.filter(|((cost, _), _)| *cost < f64::INFINITY) else {
            // No cut between stripes divides the part evenly enough (most of it lies in one): by rank then.
            return self.halve_by_rank(part, a);
        };
        self.stripe(part, axis);
        self.before.clear();
        self.after.clear();
        for &v in part.iter() {
            if self.bucket[v as usize] < cut { self.before.push(v) } else { self.after.push(v) }
        }
        let first = self.before.len();
        part[..first].copy_from_slice(&self.before);
        part[first..].copy_from_slice(&self.after);
        first
    }

    fn halve_by_rank(&mut self, part: &mut [u32], axis: DVec3) -> usize {
        self.keyed.clear();
        self.keyed.extend(part.iter().map(|&v| (self.places[v as usize].dot(axis), v)));
        let middle = part.len() / 2;
        self.keyed.select_nth_unstable_by(middle, by_key);
        for (to, (_, v)) in part.iter_mut().zip(&self.keyed) {
            *to = *v;
        }
        middle
    }

    /// Numbers the vertices of a part by stripes across an axis.
    fn stripe(&mut self, part: &[u32], axis: DVec3) {
        let place = |v: u32| self.places[v as usize].dot(axis);
        let (least, most) =
            part.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(place(v)), b.max(place(v))));
        let scale = STRIPES as f64 / (most - least).max(f64::MIN_POSITIVE);
        for &v in part {
            self.bucket[v as usize] = (((place(v) - least) * scale) as u32).min(STRIPES as u32 - 1);
        }
    }

    /// The best cut between two stripes across an axis, and what it costs: the separator's vertices, more for halves that
    /// are unequal.
    fn sweep(&mut self, part: &[u32], axis: DVec3) -> (f64, u32) {
        self.stripe(part, axis);
        let mark = self.side[part[0] as usize];
        // What changes from one cut to the next: vertices before it, and those of them (of the others) with neighbours
        // across.
        let mut changes = [[0_i64; 3]; STRIPES + 1];
        for &v in part {
            let own = self.bucket[v as usize];
            let (mut least, mut most) = (own, own);
            for &w in self.graph.of(v) {
                if self.side[w as usize] == mark {
                    least = least.min(self.bucket[w as usize]);
                    most = most.max(self.bucket[w as usize]);
                }
            }
            let (own, least, most) = (own as usize, least as usize, most as usize);
            changes[own + 1][0] += 1;
            changes[own + 1][1] += 1;
            changes[most + 1][1] -= 1;
            changes[least + 1][2] += 1;
            changes[own + 1][2] -= 1;
        }
        let (mut best, mut now) = ((f64::INFINITY, STRIPES as u32 / 2), [0_i64; 3]);
        for (cut, change) in changes.iter().enumerate().take(STRIPES).skip(1) {
            for (now, change) in now.iter_mut().zip(change) {
                *now += change;
            }
            let share = now[0] as f64 / part.len() as f64;
            let balance = share.min(1.0 - share);
            if balance >= LEAST_SHARE {
                let cost = now[1].min(now[2]) as f64 * (1.0 + UNEQUAL * (0.5 - balance) * (0.5 - balance));
                if cost < best.0 {
                    best = (cost, cut as u32);
                }
            }
        }
        best
    }

    fn push(&mut self, start: u32, end: u32, children: [u32; 2], depth: u32) -> u32 {
        self.nodes.push(Node { start, end, children, depth });
        self.nodes.len() as u32 - 1
    }
}

fn by_key(a: &(f64, u32), b: &(f64, u32)) -> Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
}

/// The directions along which a part is longest, second longest and shortest, nearly.
fn principal_frame(places: &[DVec3], part: &[u32]) -> [DVec3; 3] {
    let mean = part.iter().map(|&v| places[v as usize]).sum::<DVec3>() / part.len() as f64;
    let mut spread = DMat3::ZERO;
    for &v in part {
        let d = places[v as usize] - mean;
        spread += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let first = longest(spread);
    let across =
        spread - DMat3::from_cols(first * first.x, first * first.y, first * first.z) * first.dot(spread * first);
    let second = longest(across);
    let second = (second - first * first.dot(second)).normalize_or(first.any_orthonormal_vector());
    [first, second, first.cross(second)]
}

/// The direction of the greatest eigenvalue, nearly.
fn longest(spread: DMat3) -> DVec3 {
    let columns = [spread.x_axis, spread.y_axis, spread.z_axis];
    let mut axis =
        columns.into_iter().fold(DVec3::X, |a, b| if b.length_squared() > a.length_squared() { b } else { a });
    for _ in 0..AXIS_STEPS {
        axis = (spread * axis).normalize_or(DVec3::X);
    }
    axis
}
