//! Maps to start from.
//!
//! - Conformal: least squares conformal map with two far border vertices held (Levy et al. 2002): nearly right for
//!   everything that is nearly developable, but it can flip on strongly curved meshes, and is then not taken.
//! - Convex: the border on a circle, every inner vertex at a mean of its neighbours with positive weights (Tutte 1963,
//!   Floater 1997). It cannot flip. Holes are closed by one vertex each. Weights are those of the harmonic map where they
//!   are positive.
//!
//! Both are scaled so that their symmetric Dirichlet energy is least.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::cholesky::{Factor, Graph, Symbolic};
use super::energy::Derivatives;
use super::shape::Shape;
use super::solver::Solver;
use crate::engine::mesh::{Mesh, Topology, topology};

/// Least weight of an edge of the convex map, where equilateral triangles give 0.58: obtuse ones would give a negative
/// weight, with which the map can flip; weights near nought let triangles collapse.
const LEAST_WEIGHT: f64 = 0.05;

/// The conformal map, of any size. It may flip.
pub(super) fn conformal(solver: &mut Solver, places: &[DVec3], border: &[u32], flat: &mut [[f64; 2]]) {
    let far = |from: u32| {
        let distance = |v: u32| places[v as usize].distance_squared(places[from as usize]);
        border.iter().copied().fold(from, |best, v| if distance(v) > distance(best) { v } else { best })
    };
    let one = far(border[0]);
    let other = far(one);
    flat.fill([0.0; 2]);
    flat[other as usize] = [1.0, 0.0];
    let form = |cell: &super::shape::Cell| {
        let shear = cell.jet(flat).shear;
        let mut hessian = [[0.0; 4]; 4];
        (hessian[2][2], hessian[3][3]) = (1.0, 1.0);
        Derivatives { gradient: [0.0, 0.0, shear[0], shear[1]], hessian }
    };
    solver.assembly.quadratic(solver.shape, form, &mut solver.matrix, &mut solver.gradient);
    let mut held = vec![false; flat.len()];
    held[one as usize] = true;
    held[other as usize] = true;
    let pins = solver.held.replace(held);
    solver.hold();
    solver.held = pins;
    solver.factor.factorise(solver.symbolic, &solver.matrix, usize::MAX);
    solver.direction.copy_from_slice(&solver.gradient);
    solver.factor.solve(solver.symbolic, &mut solver.direction);
    for (place, step) in flat.iter_mut().zip(&solver.direction) {
        *place = [place[0] - step[0], place[1] - step[1]];
    }
}

/// The convex map, over the mesh's own numbering.
pub(super) fn convex(mesh: &Mesh, topo: &Topology) -> Vec<[f64; 2]> {
    let count = mesh.positions.len();
    let length = |h: &u32| {
        mesh.positions[topo.origin(*h) as usize].distance(mesh.positions[topo.target(*h) as usize])
    };
    let borders: Vec<&[u32]> = topo.borders().collect();
    let lengths: Vec<f64> = borders.iter().map(|b| b.iter().map(length).sum()).collect();
    let outer = (0..borders.len()).fold(0, |best, b| if lengths[b] > lengths[best] { b } else { best });
    // Border vertices lie on the circle, apart as along the border.
    let mut flat = vec![[0.0; 2]; count + borders.len()];
    let mut held = vec![false; count + borders.len()];
    let least = LEAST_ARC * lengths[outer] / borders[outer].len() as f64;
    let total: f64 = borders[outer].iter().map(|h| length(h).max(least)).sum();
    let mut along = 0.0;
    for h in borders[outer] {
        let v = topo.origin(*h) as usize;
        let angle = TAU * along / total;
        flat[v] = [angle.cos(), angle.sin()];
        held[v] = true;
        along += length(h).max(least);
    }
    held[count + outer] = true;
    // Edges with their weights, then the spokes of the holes.
    let mut edges: Vec<[u32; 2]> = (0..topo.edge_count() as u32).map(|e| topo.edge_vertices(e)).collect();
    let mut weights: Vec<f64> = topo.edges().iter().map(|&h| harmonic_weight(mesh, topo, h)).collect();
    let mut places = mesh.positions.clone();
    for (b, border) in borders.iter().enumerate() {
        let middle = border.iter().map(|&h| mesh.positions[topo.origin(h) as usize]).sum::<DVec3>() / border.len() as f64;
        places.push(middle);
        if b != outer {
            edges.extend(border.iter().map(|&h| [topo.origin(h), (count + b) as u32]));
            weights.extend(border.iter().map(|_| 1.0));
        }
    }
    let graph = Graph::of_edges(places.len(), edges.iter().copied());
    let symbolic = Symbolic::<1>::new(&places, &graph);
    let mut matrix = symbolic.matrix();
    let mut sides = [vec![[0.0]; places.len()], vec![[0.0]; places.len()]];
    for (edge, &weight) in edges.iter().zip(&weights) {
        let [a, b] = edge.map(|v| symbolic.rank[v as usize]);
        if let Some(block) = symbolic.block(a.max(b), a.min(b))
            && !held[edge[0] as usize]
            && !held[edge[1] as usize]
        {
            matrix.below[block as usize][0][0] -= weight;
        }
        for (from, to) in [(edge[0], edge[1]), (edge[1], edge[0])] {
            let rank = symbolic.rank[from as usize] as usize;
            matrix.diagonal[rank][0][0] += weight;
            for d in 0..2 {
                sides[d][rank][0] += weight * if held[to as usize] { flat[to as usize][d] } else { 0.0 };
            }
        }
    }
    for (v, _) in held.iter().enumerate().filter(|(_, held)| **held) {
        let rank = symbolic.rank[v] as usize;
        matrix.diagonal[rank][0][0] = 1.0;
        for d in 0..2 {
            sides[d][rank][0] = flat[v][d];
        }
    }
    let mut factor = Factor::new(&symbolic);
    factor.factorise(&symbolic, &matrix, usize::MAX);
    for (d, side) in sides.iter_mut().enumerate() {
        factor.solve(&symbolic, side);
        for v in 0..count {
            if !held[v] {
                flat[v][d] = side[symbolic.rank[v] as usize][0];
            }
        }
    }
    flat.truncate(count);
    flat
}

/// Border edges shorter than this part of the mean lie as far apart on the circle as if they had it.
const LEAST_ARC: f64 = 1e-3;

/// Half the sum of the cotangents opposite to an edge, at least [`LEAST_WEIGHT`].
fn harmonic_weight(mesh: &Mesh, topo: &Topology, halfedge: u32) -> f64 {
    let cotangent = |h: u32| {
        if h == topology::NONE {
            return 0.0;
        }
        let [a, b, c] = [h, topology::next(h), topology::prev(h)].map(|h| mesh.positions[topo.origin(h) as usize]);
        let (u, v) = (a - c, b - c);
        let area = u.cross(v).length();
        if area > 0.0 { u.dot(v) / area } else { 0.0 }
    };
    (0.5 * (cotangent(halfedge) + cotangent(topo.twin(halfedge)))).clamp(LEAST_WEIGHT, 1.0 / LEAST_WEIGHT)
}

/// Scales a map without flips so that its symmetric Dirichlet energy is least; false when no size does.
pub(super) fn scale(shape: &Shape, flat: &mut [[f64; 2]]) -> bool {
    let (mut forth, mut back) = (0.0, 0.0);
    for cell in &shape.cells {
        let jet = cell.jet(flat);
        let (norm, det) = (jet.norm_squared(), jet.determinant());
        forth += cell.weight * norm;
        back += cell.weight * norm / (det * det);
    }
    let factor = (back / forth).sqrt().sqrt();
    if !(factor.is_finite() && factor > 0.0) {
        return false;
    }
    for place in flat.iter_mut() {
        *place = place.map(|x| x * factor);
    }
    true
}

const _: f64 = PI;
