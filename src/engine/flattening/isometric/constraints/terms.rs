//! What is asked of single points and edges beside the energy of the triangles: pinned points and kept lengths.
//!
//! - A pinned point is a point `p = sum w_i x_i` of a triangle that is to lie at `t`: it adds `k/2 |p - t + f|^2`, where k is
//!   a stiffness and k f the force that holds the point there (the multiplier of the method of Hestenes and Powell, 1969).
//! - A kept edge adds `c (l - l0)^2`, l being its length and l0 that at rest.
//!
//! All corners of one term are corners of one triangle, so that the matrix has its entries already. Lengths are those of
//! [`super::super::shape`].

use std::ops::Range;

use super::super::cholesky::{Matrix, Symbolic};
use super::super::energy::Curvature;

/// All terms; none cost nothing.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Terms {
    /// The points.
    pub(in super::super) points: Vec<Point>,
    /// Of all points.
    pub(in super::super) stiffness: f64,
    /// The edges.
    pub(in super::super) edges: Vec<Edge>,
    done: Vec<bool>,
}

/// A pinned point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Point {
    corners: [u32; 3],
    slots: [u32; 3],
    weights: [f64; 3],
    target: [f64; 2],
    /// Over the stiffness.
    force: [f64; 2],
}

/// A kept edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Edge {
    ends: [u32; 2],
    slot: u32,
    rest: f64,
    factor: f64,
}

/// Corners of the three blocks off the diagonal.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

impl Point {
    /// A point of a triangle (corners in the factorisation's numbering). `None` when two corners are no neighbours.
    pub(in super::super) fn new(
        symbolic: &Symbolic<2>,
        corners: [u32; 3],
        weights: [f64; 3],
        target: [f64; 2],
    ) -> Option<Self> {
        let slot = |[a, b]: [usize; 2]| symbolic.block(corners[a].max(corners[b]), corners[a].min(corners[b]));
        let slots = [slot(PAIRS[0])?, slot(PAIRS[1])?, slot(PAIRS[2])?];
        Some(Self { corners, slots, weights, target, force: [0.0; 2] })
    }

    /// Where it lies.
    pub(in super::super) fn place(&self, flat: &[[f64; 2]]) -> [f64; 2] {
        let at = |d: usize| (0..3).map(|k| self.weights[k] * flat[self.corners[k] as usize][d]).sum();
        [at(0), at(1)]
    }

    /// Where it is to lie.
    pub(in super::super) const fn target(&self) -> [f64; 2] {
        self.target
    }

    fn off(&self, flat: &[[f64; 2]]) -> [f64; 2] {
        let place = self.place(flat);
        [place[0] - self.target[0], place[1] - self.target[1]]
    }

    fn pulled(&self, flat: &[[f64; 2]]) -> [f64; 2] {
        let off = self.off(flat);
        [off[0] + self.force[0], off[1] + self.force[1]]
    }
}

impl Edge {
    /// An edge with its length at rest and the factor c. `None` when its ends are no neighbours.
    pub(in super::super) fn new(symbolic: &Symbolic<2>, [a, b]: [u32; 2], rest: f64, factor: f64) -> Option<Self> {
        Some(Self { ends: [a, b], slot: symbolic.block(a.max(b), a.min(b))?, rest, factor })
    }

    /// Its direction and its length.
    fn line(&self, flat: &[[f64; 2]]) -> ([f64; 2], f64) {
        let [a, b] = self.ends.map(|v| flat[v as usize]);
        let (x, y) = (a[0] - b[0], a[1] - b[1]);
        let length = x.hypot(y);
        (if length > 0.0 { [x / length, y / length] } else { [1.0, 0.0] }, length)
    }

    /// The block of its Hessian: along it 2 c, across it 2 c (1 - l0 / l), of which a share is taken away where it is
    /// negative.
    fn block(&self, flat: &[[f64; 2]], clamped: f64) -> [[f64; 2]; 2] {
        let ([x, y], length) = self.line(flat);
        let across = 1.0 - self.rest / length.max(f64::MIN_POSITIVE);
        let across = if across < 0.0 { (1.0 - clamped) * across } else { across };
        // Nothing wider than the edge is stiff: an edge near collapse would ask for no step at all.
        let across = across.max(-1.0);
        let c = 2.0 * self.factor;
        let mixed = c * (1.0 - across) * x * y;
        [[c * (x * x + across * y * y), mixed], [mixed, c * (y * y + across * x * x)]]
    }
}

impl Terms {
    /// What they add to the energy.
    pub(in super::super) fn energy(&self, flat: &[[f64; 2]]) -> f64 {
        let mut sum = 0.0;
        for point in &self.points {
            let [x, y] = point.pulled(flat);
            sum += 0.5 * self.stiffness * (x * x + y * y);
        }
        for edge in &self.edges {
            let off = edge.line(flat).1 - edge.rest;
            sum += edge.factor * off * off;
        }
        sum
    }

    /// Adds their gradient.
    pub(in super::super) fn add_gradient(&self, flat: &[[f64; 2]], gradient: &mut [[f64; 2]]) {
        for point in &self.points {
            let pulled = point.pulled(flat);
            for (corner, weight) in point.corners.iter().zip(point.weights) {
                for d in 0..2 {
                    gradient[*corner as usize][d] += self.stiffness * weight * pulled[d];
                }
            }
        }
        for edge in &self.edges {
            let (direction, length) = edge.line(flat);
            let force = 2.0 * edge.factor * (length - edge.rest);
            let [a, b] = edge.ends.map(|v| v as usize);
            for d in 0..2 {
                gradient[a][d] += force * direction[d];
                gradient[b][d] -= force * direction[d];
            }
        }
    }

    /// Adds their Hessian, or what stands for it.
    pub(in super::super) fn add_hessian(&mut self, flat: &[[f64; 2]], curvature: Curvature, matrix: &mut Matrix<2>) {
        for point in &self.points {
            let own = |a: usize, b: usize| self.stiffness * point.weights[a] * point.weights[b];
            for (k, corner) in point.corners.iter().enumerate() {
                add_unit(&mut matrix.diagonal[*corner as usize], own(k, k));
            }
            for ([a, b], slot) in PAIRS.into_iter().zip(point.slots) {
                add_unit(&mut matrix.below[slot as usize], own(a, b));
            }
        }
        let clamped = match curvature {
            Curvature::Secant => 1.0,
            Curvature::Newton { clamped } => clamped,
        };
        for edge in &self.edges {
            add_edge(edge, edge.block(flat, clamped), matrix);
        }
        self.done.clear();
        self.done.resize(self.edges.len(), false);
    }

    /// Takes all negative eigenvalues away from the edges with an end in a range, where only a share of them has been;
    /// false when there is no such edge.
    pub(in super::super) fn clamp(
        &mut self,
        flat: &[[f64; 2]],
        clamped: f64,
        range: &Range<u32>,
        matrix: &mut Matrix<2>,
    ) -> bool {
        let mut any = false;
        for (edge, done) in self.edges.iter().zip(&mut self.done) {
            if *done || !edge.ends.iter().any(|v| range.contains(v)) {
                continue;
            }
            (*done, any) = (true, true);
            let [less, full] = [clamped, 1.0].map(|clamped| edge.block(flat, clamped));
            let difference = std::array::from_fn(|c| std::array::from_fn(|r| full[c][r] - less[c][r]));
            add_edge(edge, difference, matrix);
        }
        any
    }

    /// The point that is farthest from its target, with the distance.
    pub(in super::super) fn worst(&self, flat: &[[f64; 2]]) -> (usize, f64) {
        let distances = self.points.iter().map(|point| {
            let [x, y] = point.off(flat);
            x.hypot(y)
        });
        distances.enumerate().fold((0, 0.0), |worst, (k, d)| if d > worst.1 { (k, d) } else { worst })
    }

    /// The force that holds each point grows by what it lacked.
    pub(in super::super) fn push(&mut self, flat: &[[f64; 2]]) {
        for point in &mut self.points {
            point.force = point.pulled(flat);
        }
    }

    /// Another stiffness; forces stay what they are.
    pub(in super::super) fn stiffen(&mut self, stiffness: f64) {
        let ratio = self.stiffness / stiffness;
        for point in &mut self.points {
            point.force = point.force.map(|f| ratio * f);
        }
        self.stiffness = stiffness;
    }
}

fn add_unit(block: &mut [[f64; 2]; 2], value: f64) {
    block[0][0] += value;
    block[1][1] += value;
}

/// The block is symmetric: which end is the row does not matter.
fn add_edge(edge: &Edge, block: [[f64; 2]; 2], matrix: &mut Matrix<2>) {
    let [a, b] = edge.ends.map(|v| v as usize);
    for (c, column) in block.iter().enumerate() {
        for (r, value) in column.iter().enumerate() {
            matrix.diagonal[a][c][r] += value;
            matrix.diagonal[b][c][r] += value;
            matrix.below[edge.slot as usize][c][r] -= value;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::budget::Unobserved;
    use crate::engine::flattening::isometric::cholesky::Graph;
    use crate::engine::mesh::Topology;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    /// Two points, one with a weight below nought, and three edges: two stretched, one shortened.
    fn terms() -> (Symbolic<2>, Terms, Vec<[f64; 2]>) {
        let mesh = grid(4, 3, Diagonal::Regular, |u, v| DVec3::new(2.0 * u, v, 0.0));
        let topology = Topology::new(&mesh).unwrap();
        let edges = (0..topology.edge_count() as u32).map(|e| topology.edge_vertices(e));
        let graph = Graph::of_edges(mesh.positions.len(), edges);
        let symbolic = Symbolic::<2>::new(&mesh.positions, &graph, &Unobserved).unwrap();
        let rank = |v: u32| symbolic.rank[v as usize];
        let corners = |t: usize| mesh.triangles[t].map(rank);
        let mut terms = Terms {
            points: vec![
                Point::new(&symbolic, corners(0), [0.2, 0.5, 0.3], [0.1, 0.4]).unwrap(),
                Point::new(&symbolic, corners(7), [0.7, 0.5, -0.2], [-0.3, 0.2]).unwrap(),
            ],
            stiffness: 7.0,
            edges: [[0_u32, 1, 4], [1, 2, 9], [2, 3, 5]]
                .map(|[a, b, rest]| Edge::new(&symbolic, [a, b].map(rank), 0.1 * f64::from(rest), 3.0).unwrap())
                .to_vec(),
            done: Vec::new(),
        };
        let flat: Vec<[f64; 2]> = symbolic
            .order
            .iter()
            .map(|&v| {
                let p = mesh.positions[v as usize];
                [1.1 * p.x + 0.2 * p.y * p.y, 0.9 * p.y - 0.1 * p.x * p.x]
            })
            .collect();
        terms.push(&flat);
        (symbolic, terms, flat)
    }

    #[test]
    fn gradient_and_hessian_are_those_of_the_energy() {
        let (symbolic, mut terms, flat) = terms();
        let count = flat.len();
        let gradient_at = |terms: &Terms, flat: &[[f64; 2]]| {
            let mut gradient = vec![[0.0; 2]; count];
            terms.add_gradient(flat, &mut gradient);
            gradient
        };
        let (mut matrix, gradient) = (symbolic.matrix(), gradient_at(&terms, &flat));
        terms.add_hessian(&flat, Curvature::Newton { clamped: 0.0 }, &mut matrix);
        for v in 0..count {
            for d in 0..2 {
                let moved = |step: f64| {
                    let mut moved = flat.clone();
                    moved[v][d] += step;
                    moved
                };
                let step = 1e-5;
                let slope = (terms.energy(&moved(step)) - terms.energy(&moved(-step))) / (2.0 * step);
                assert!((slope - gradient[v][d]).abs() < 1e-7, "{v} {d}: {slope} {}", gradient[v][d]);
                let (up, down) = (gradient_at(&terms, &moved(step)), gradient_at(&terms, &moved(-step)));
                for w in 0..count {
                    for e in 0..2 {
                        let expected = (up[w][e] - down[w][e]) / (2.0 * step);
                        let block = symbolic.block(v.max(w) as u32, v.min(w) as u32);
                        let found = match block {
                            _ if v == w => matrix.diagonal[v][d][e],
                            Some(at) => matrix.below[at as usize][d][e],
                            None => 0.0,
                        };
                        assert!((found - expected).abs() < 1e-6, "{v} {d} {w} {e}: {found} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn clamping_afterwards_is_clamping_at_once() {
        let (symbolic, mut terms, flat) = terms();
        let (mut at_once, mut later) = (symbolic.matrix(), symbolic.matrix());
        terms.add_hessian(&flat, Curvature::Newton { clamped: 1.0 }, &mut at_once);
        terms.add_hessian(&flat, Curvature::Newton { clamped: 0.3 }, &mut later);
        assert_ne!(at_once.diagonal, later.diagonal);
        let all = 0..flat.len() as u32;
        assert!(terms.clamp(&flat, 0.3, &all, &mut later));
        assert!(!terms.clamp(&flat, 0.3, &all, &mut later), "nothing is left to take away");
        for (a, b) in at_once.diagonal.iter().chain(&at_once.below).zip(later.diagonal.iter().chain(&later.below)) {
            assert!(a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        // A symmetric block is positive semidefinite when its diagonal and its determinant are.
        for edge in &terms.edges {
            let [[a, b], [_, c]] = edge.block(&flat, 1.0);
            assert!(a >= 0.0 && c >= 0.0 && a * c - b * b >= -1e-12);
        }
    }

    #[test]
    fn a_force_is_the_same_at_another_stiffness() {
        let (_, mut terms, flat) = terms();
        let force =
            |terms: &Terms| terms.points.iter().map(|p| p.force.map(|f| f * terms.stiffness)).collect::<Vec<_>>();
        let before = force(&terms);
        terms.stiffen(300.0);
        let same = force(&terms).as_flattened().iter().zip(before.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(same && terms.worst(&flat).1 > 0.0);
    }
}
