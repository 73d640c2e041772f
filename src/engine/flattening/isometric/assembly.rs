//! Gradient and Hessian of the energy of a whole map, in a pattern that is found once.
//!
//! A triangle's Hessian over (p, q) becomes one over its corners by p = (sum z conj(g)) / 2, q = (sum z g) / 2, where z are
//! the corners' places and g the gradients of their hat functions as complex numbers. The blocks of the first corner
//! follow from the other two's, since the gradients add up to nought.

#![expect(clippy::needless_range_loop, reason = "rows and columns are indices of several arrays, as in the formulae")]

use std::ops::Range;

use super::cholesky::{Matrix, Symbolic};
use super::energy::{Curvature, Derivatives, Energy};
use super::shape::{Cell, Shape};

/// Weight of a pull to where each place is now, per area, beside energies whose curvature is near 8. It settles what the
/// energy leaves open (moving and turning the whole) and is too weak to slow what the energy asks for.
const STAY: f64 = 1e-9;

/// Where the three blocks below the diagonal of each triangle go.
#[derive(Debug, Clone)]
pub(super) struct Assembly {
    slots: Vec<[u32; 3]>,
}

/// Corners (row, column) of the three blocks off the diagonal.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

impl Assembly {
    /// The pattern of a mesh. `None` when two corners of a triangle are not neighbours in the structure.
    pub(super) fn new(shape: &Shape, symbolic: &Symbolic<2>) -> Option<Self> {
        let slot = |cell: &Cell, [a, b]: [usize; 2]| {
            let (a, b) = (cell.corners[a], cell.corners[b]);
            symbolic.block(a.max(b), a.min(b))
        };
        let slots = shape
            .cells
            .iter()
            .map(|cell| Some([slot(cell, PAIRS[0])?, slot(cell, PAIRS[1])?, slot(cell, PAIRS[2])?]))
            .collect::<Option<_>>()?;
        Some(Self { slots })
    }

    /// Writes the Hessian, or what stands for it, and the gradient of the mean energy.
    pub(super) fn hessian(
        &self,
        shape: &Shape,
        (energy, curvature): (Energy, Curvature),
        flat: &[[f64; 2]],
        matrix: &mut Matrix<2>,
        gradient: &mut [[f64; 2]],
    ) {
        self.quadratic(shape, |cell| energy.derivatives(&cell.jet(flat), curvature), matrix, gradient);
    }

    /// Writes a sum over triangles of forms in (p, q), given by their gradient and Hessian.
    pub(super) fn quadratic(
        &self,
        shape: &Shape,
        form: impl Fn(&Cell) -> Derivatives,
        matrix: &mut Matrix<2>,
        gradient: &mut [[f64; 2]],
    ) {
        matrix.below.fill([[0.0; 2]; 2]);
        gradient.fill([0.0; 2]);
        for (block, mass) in matrix.diagonal.iter_mut().zip(&shape.masses) {
            *block = [[STAY * mass, 0.0], [0.0, STAY * mass]];
        }
        self.add_quadratic(shape, form, matrix, gradient);
    }

    /// Adds such a sum to what is there.
    pub(super) fn add_quadratic(
        &self,
        shape: &Shape,
        form: impl Fn(&Cell) -> Derivatives,
        matrix: &mut Matrix<2>,
        gradient: &mut [[f64; 2]],
    ) {
        for (cell, slots) in shape.cells.iter().zip(&self.slots) {
            let derivatives = form(cell);
            add_gradient(cell, &derivatives.gradient, gradient);
            add_hessian(cell, slots, &derivatives.hessian, matrix);
        }
    }

    /// Takes all negative eigenvalues away from the triangles with a corner in a range of places, where only the share
    /// `clamped` of them has been; false when there is no such triangle. `done` marks those of which they are gone.
    pub(super) fn clamp(
        &self,
        shape: &Shape,
        (energy, clamped): (Energy, f64),
        flat: &[[f64; 2]],
        (range, done): (Range<u32>, &mut [bool]),
        matrix: &mut Matrix<2>,
    ) -> bool {
        let mut any = false;
        for ((cell, slots), done) in shape.cells.iter().zip(&self.slots).zip(done) {
            if *done || !cell.corners.iter().any(|v| range.contains(v)) {
                continue;
            }
            (*done, any) = (true, true);
            let jet = cell.jet(flat);
            let [less, full] =
                [clamped, 1.0].map(|clamped| energy.derivatives(&jet, Curvature::Newton { clamped }).hessian);
            let difference = std::array::from_fn(|r| std::array::from_fn(|c| full[r][c] - less[r][c]));
            add_hessian(cell, slots, &difference, matrix);
        }
        any
    }
}

/// Adds what a triangle's Hessian over (p, q) means to its corners.
#[inline]
fn add_hessian(cell: &Cell, slots: &[u32; 3], hessian: &[[f64; 4]; 4], matrix: &mut Matrix<2>) {
    let blocks = corner_blocks(cell, hessian);
    for corner in 0..3 {
        let target = &mut matrix.diagonal[cell.corners[corner] as usize];
        for c in 0..2 {
            for r in 0..2 {
                target[c][r] += blocks[corner][corner][c][r];
            }
        }
    }
    for (pair, slot) in PAIRS.into_iter().zip(slots) {
        let [a, b] = pair;
        // [column][row]: the greater number is the row.
        let (row, column) = if cell.corners[a] > cell.corners[b] { (a, b) } else { (b, a) };
        let target = &mut matrix.below[*slot as usize];
        for c in 0..2 {
            for r in 0..2 {
                target[c][r] += blocks[column][row][c][r];
            }
        }
    }
}

/// The gradient of the mean energy alone.
pub(super) fn gradient_of(shape: &Shape, energy: Energy, flat: &[[f64; 2]], gradient: &mut [[f64; 2]]) {
    gradient.fill([0.0; 2]);
    add_gradient_of(shape, energy, flat, gradient);
}

/// Adds the gradient of the mean energy to what is there.
pub(super) fn add_gradient_of(shape: &Shape, energy: Energy, flat: &[[f64; 2]], gradient: &mut [[f64; 2]]) {
    for cell in &shape.cells {
        add_gradient(cell, &energy.gradient(&cell.jet(flat)), gradient);
    }
}

#[inline]
fn add_gradient(cell: &Cell, by_parts: &[f64; 4], gradient: &mut [[f64; 2]]) {
    let mut first = [0.0; 2];
    for (corner, g) in cell.corners[1..].iter().zip(&cell.gradients) {
        let rows = columns_of(*g);
        let target = &mut gradient[*corner as usize];
        for d in 0..2 {
            let value = cell.weight * (0..4).map(|k| rows[d][k] * by_parts[k]).sum::<f64>();
            target[d] += value;
            first[d] -= value;
        }
    }
    let target = &mut gradient[cell.corners[0] as usize];
    target[0] += first[0];
    target[1] += first[1];
}

/// How (p, q) changes with x and with y of a corner whose hat function has the gradient g.
#[inline]
pub(super) fn columns_of(g: [f64; 2]) -> [[f64; 4]; 2] {
    let [a, b] = [0.5 * g[0], 0.5 * g[1]];
    [[a, -b, a, b], [b, a, -b, a]]
}

/// The 2 x 2 blocks of all pairs of corners: `[column corner][row corner][c][r]`.
#[inline]
fn corner_blocks(cell: &Cell, hessian: &[[f64; 4]; 4]) -> [[[[f64; 2]; 2]; 3]; 3] {
    let mut blocks = [[[[0.0; 2]; 2]; 3]; 3];
    let columns = cell.gradients.map(columns_of);
    for b in 0..2 {
        for c in 0..2 {
            let mut image = [0.0; 4];
            for k in 0..4 {
                for l in 0..4 {
                    image[k] += hessian[k][l] * columns[b][c][l];
                }
            }
            for a in 0..2 {
                for r in 0..2 {
                    let mut value = 0.0;
                    for k in 0..4 {
                        value += image[k] * columns[a][r][k];
                    }
                    blocks[b + 1][a + 1][c][r] = cell.weight * value;
                }
            }
        }
    }
    for c in 0..2 {
        for r in 0..2 {
            for b in 1..3 {
                blocks[b][0][c][r] = -(blocks[b][1][c][r] + blocks[b][2][c][r]);
                // By symmetry.
                blocks[0][b][r][c] = blocks[b][0][c][r];
            }
        }
    }
    for c in 0..2 {
        for r in 0..2 {
            blocks[0][0][c][r] = -(blocks[0][1][c][r] + blocks[0][2][c][r]);
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::budget::Unobserved;
    use crate::engine::flattening::isometric::cholesky::Graph;
    use crate::engine::mesh::Topology;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    /// The whole gradient and the whole Hessian against differences of the energy and of the gradient.
    #[test]
    fn gradient_and_hessian_are_those_of_the_energy() {
        let mesh = grid(5, 4, Diagonal::Diamond, |u, v| DVec3::new(2.0 * u, v + 0.2 * u, 0.4 * u * v));
        let topology = Topology::new(&mesh).unwrap();
        let edges = (0..topology.edge_count() as u32).map(|e| topology.edge_vertices(e));
        let graph = Graph::of_edges(mesh.positions.len(), edges);
        let symbolic = Symbolic::<2>::new(&mesh.positions, &graph, &Unobserved).unwrap();
        let shape = Shape::new(&mesh, &symbolic.rank).unwrap();
        let assembly = Assembly::new(&shape, &symbolic).unwrap();
        let flat: Vec<[f64; 2]> = symbolic
            .order
            .iter()
            .map(|&v| {
                let p = mesh.positions[v as usize] / shape.unit;
                [1.1 * p.x + 0.05 * p.y * p.y, 0.95 * p.y - 0.1 * p.x * p.y]
            })
            .collect();
        let count = flat.len();
        for energy in [
            Energy::Weighted { area: 1.0, shape: 0.5 },
            Energy::Arap { barrier: 0.1 },
            Energy::Robust { area: 1.0, shape: 0.5, soft: 0.1, barrier: 0.01 },
        ] {
            let (mut matrix, mut gradient) = (symbolic.matrix(), vec![[0.0; 2]; count]);
            let full = Curvature::Newton { clamped: 0.0 };
            assembly.hessian(&shape, (energy, full), &flat, &mut matrix, &mut gradient);
            let mut alone = vec![[1.0; 2]; count];
            gradient_of(&shape, energy, &flat, &mut alone);
            assert_eq!(alone, gradient);
            for v in 0..count {
                for d in 0..2 {
                    let moved = |step: f64| {
                        let mut moved = flat.clone();
                        moved[v][d] += step;
                        moved
                    };
                    let step = 1e-5;
                    let slope =
                        (shape.energy(energy, &moved(step)) - shape.energy(energy, &moved(-step))) / (2.0 * step);
                    assert!((slope - gradient[v][d]).abs() < 1e-7, "{energy:?} {v} {d}: {slope} {}", gradient[v][d]);
                    let (mut up, mut down) = (gradient.clone(), gradient.clone());
                    gradient_of(&shape, energy, &moved(step), &mut up);
                    gradient_of(&shape, energy, &moved(-step), &mut down);
                    for w in 0..count {
                        let (row, column) = (v.max(w) as u32, v.min(w) as u32);
                        for e in 0..2 {
                            let expected = (up[w][e] - down[w][e]) / (2.0 * step);
                            let found = if v == w {
                                matrix.diagonal[v][d][e]
                            } else if let Some(at) = symbolic.block(row, column) {
                                let block = matrix.below[at as usize];
                                if v < w { block[d][e] } else { block[e][d] }
                            } else {
                                0.0
                            };
                            assert!((found - expected).abs() < 1e-5, "{energy:?} {v} {d} {w} {e}: {found} {expected}");
                        }
                    }
                }
            }
        }
    }
}
