//! The convex map: the longest border on a circle, every other vertex at a mean of its neighbours with positive weights
//! (Tutte 1963, Floater 1997). It cannot flip but by rounding. Holes are closed by one vertex each. The weights are those
//! of the harmonic map where these are positive.

use std::f64::consts::TAU;

use glam::DVec3;

use super::cholesky::{Factor, Graph, Symbolic};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, Topology, topology};

/// Least weight of an edge, where equilateral triangles give 0.58: obtuse ones would give a negative weight, with which
/// the map can flip; weights near nought let triangles collapse.
const LEAST_WEIGHT: f64 = 0.05;

/// Border edges shorter than this part of the mean lie as far apart on the circle as if they had it.
const LEAST_ARC: f64 = 1e-3;

/// The convex map of radius 1, in the mesh's own numbering.
///
/// # Errors
/// [`EngineError::Cancelled`].
pub(super) fn convex(mesh: &Mesh, topo: &Topology, observer: &dyn Observer) -> Result<Vec<[f64; 2]>, EngineError> {
    let count = mesh.positions.len();
    let length = |h: &u32| mesh.positions[topo.origin(*h) as usize].distance(mesh.positions[topo.target(*h) as usize]);
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
        let middle =
            border.iter().map(|&h| mesh.positions[topo.origin(h) as usize]).sum::<DVec3>() / border.len() as f64;
        places.push(middle);
        if b != outer {
            edges.extend(border.iter().map(|&h| [topo.origin(h), (count + b) as u32]));
            weights.extend(border.iter().map(|_| 1.0));
        }
    }
    let graph = Graph::of_edges(places.len(), edges.iter().copied());
    let symbolic = Symbolic::<1>::new(&places, &graph, observer)?;
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
    factor.factorise(&symbolic, &mut matrix, (0, &mut |_, _| false), observer)?;
    for (d, side) in sides.iter_mut().enumerate() {
        factor.solve(&symbolic, side);
        for v in 0..count {
            if !held[v] {
                flat[v][d] = side[symbolic.rank[v] as usize][0];
            }
        }
    }
    flat.truncate(count);
    Ok(flat)
}

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
