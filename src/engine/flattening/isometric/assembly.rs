//! Gradient and Hessian of the energy of a whole map, in a pattern that is found once.
//!
//! A triangle's Hessian over (p, q) becomes one over its corners by p = (sum z conj(g)) / 2, q = (sum z g) / 2, where z are
//! the corners' places and g the gradients of their hat functions as complex numbers. The blocks of the first corner
//! follow from the other two's, since the gradients add up to nought.

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
        for (cell, slots) in shape.cells.iter().zip(&self.slots) {
            let derivatives = form(cell);
            add_gradient(cell, &derivatives.gradient, gradient);
            let blocks = corner_blocks(cell, &derivatives.hessian);
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
    }
}

/// The gradient of the mean energy alone.
pub(super) fn gradient_of(shape: &Shape, energy: Energy, flat: &[[f64; 2]], gradient: &mut [[f64; 2]]) {
    gradient.fill([0.0; 2]);
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
fn columns_of(g: [f64; 2]) -> [[f64; 4]; 2] {
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
