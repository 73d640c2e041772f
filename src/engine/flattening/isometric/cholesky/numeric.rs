//! The numbers of a factorisation, and solving with them.

#![expect(
    clippy::inline_always,
    reason = "vector instructions reach only what is inlined into the function that asks for them"
)]

use super::dissection::NO_NODE;
use super::kernel::{COLUMNS, factorise, multiply_add, update};
use super::symbolic::{Front, Matrix, Symbolic};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// A pivot at most this part of the greatest diagonal entry of the matrix is taken as nought. Larger, and unknowns of
/// tiny triangles would be held for no reason; smaller, and rounding would pass for stiffness.
const PIVOT_FLOOR: f64 = 1e-24;

/// A factor with the room to make it in.
#[derive(Debug, Clone)]
pub(crate) struct Factor<const D: usize> {
    panels: Vec<f64>,
    buffers: Vec<Vec<f64>>,
    work: Vec<f64>,
}

/// Runs a closure with the widest vectors that the processor is known to have; tells it whether they multiply and add
/// in one instruction.
macro_rules! vectorised {
    ($call:ident :: <$($generic:tt),*> ($($argument:expr),*)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            match pulp::x86::V3::try_new() {
                Some(simd) => simd.vectorize(#[inline(always)] || $call::<$($generic,)* true>($($argument),*)),
                None => $call::<$($generic,)* false>($($argument),*),
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            $call::<$($generic,)* false>($($argument),*)
        }
    }};
}

impl<const D: usize> Factor<D> {
    /// Room for factors of this structure.
    pub(crate) fn new(symbolic: &Symbolic<D>) -> Self {
        Self {
            panels: vec![0.0; symbolic.len],
            buffers: symbolic.buffers.iter().map(|&len| vec![0.0; len]).collect(),
            work: vec![0.0; symbolic.tallest],
        }
    }

    /// Factorises a matrix. Unknowns without a positive pivot are held; false as soon as these are more than `allowed`.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`]: the observer is asked at every front.
    pub(crate) fn factorise(
        &mut self,
        symbolic: &Symbolic<D>,
        matrix: &Matrix<D>,
        allowed: usize,
        observer: &dyn Observer,
    ) -> Result<bool, EngineError> {
        let greatest = matrix.diagonal.iter().flat_map(|block| (0..D).map(|d| block[d][d])).fold(0.0, f64::max);
        let floor = PIVOT_FLOOR * greatest;
        vectorised!(factorise_all::<D>(self, symbolic, matrix, (floor, allowed), observer))
    }

    /// Solves in place for `D` unknowns a vertex, in the new numbering.
    pub(crate) fn solve(&mut self, symbolic: &Symbolic<D>, unknowns: &mut [[f64; D]]) {
        vectorised!(solve_all::<D>(self, symbolic, unknowns));
    }
}

#[inline(always)]
fn factorise_all<const D: usize, const FUSED: bool>(
    factor: &mut Factor<D>,
    symbolic: &Symbolic<D>,
    matrix: &Matrix<D>,
    (floor, allowed): (f64, usize),
    observer: &dyn Observer,
) -> Result<bool, EngineError> {
    let mut held = 0;
    // Where a part falls apart by itself its separator is empty, and so may be its front.
    for front in symbolic.fronts.iter().filter(|front| front.height > 0) {
        let (height, columns) = (front.height as usize, front.columns as usize);
        let panel = &mut factor.panels[front.panel..front.panel + columns * height];
        panel.fill(0.0);
        scatter(panel, front, symbolic, matrix);
        let mut square = std::mem::take(&mut factor.buffers[front.buffer as usize]);
        let used = front.stride() * front.square as usize;
        // The root passes nothing on and has no buffer of its own.
        let target = if used == 0 { &mut [][..] } else { &mut square[..used] };
        target.fill(0.0);
        for child in front.children.into_iter().filter(|&c| c != NO_NODE) {
            let child = &symbolic.fronts[child as usize];
            extend::<D>(panel, target, front, child, symbolic, &factor.buffers[child.buffer as usize]);
        }
        held += factorise::<FUSED>(panel, height, floor);
        if used > 0 {
            update::<FUSED>(panel, height, columns, target, front.stride());
        }
        factor.buffers[front.buffer as usize] = square;
        if held > allowed {
            return Ok(false);
        }
        observer.check()?;
    }
    Ok(true)
}

/// Writes the matrix's columns of a front into its panel; padded columns become unit ones.
#[inline(always)]
fn scatter<const D: usize>(panel: &mut [f64], front: &Front, symbolic: &Symbolic<D>, matrix: &Matrix<D>) {
    let height = front.height as usize;
    for vertex in front.start as usize..front.end as usize {
        let first = D * (vertex - front.start as usize);
        for c in 0..D {
            let column = &mut panel[(first + c) * height..(first + c + 1) * height];
            column[first..first + D].copy_from_slice(&matrix.diagonal[vertex][c]);
            let entries = symbolic.column_starts[vertex] as usize..symbolic.column_starts[vertex + 1] as usize;
            for (&row, block) in symbolic.front_rows[entries.clone()].iter().zip(&matrix.below[entries]) {
                column[row as usize..row as usize + D].copy_from_slice(&block[c]);
            }
        }
    }
    for pad in D * (front.end - front.start) as usize..front.columns as usize {
        panel[pad * height + pad] = 1.0;
    }
}

/// Adds what a child passes on.
#[inline(always)]
fn extend<const D: usize>(
    panel: &mut [f64],
    square: &mut [f64],
    front: &Front,
    child: &Front,
    symbolic: &Symbolic<D>,
    passed: &[f64],
) {
    let rows = &symbolic.parent_rows[child.passed[0] as usize..child.passed[1] as usize];
    let (height, columns, stride) = (front.height as usize, front.columns as usize, front.stride());
    let (from, offset) = (child.stride(), child.stride() - (child.height - child.columns) as usize);
    for (c, &column) in rows.iter().enumerate() {
        for d in 0..D {
            let source = &passed[(D * c + d) * from + offset..(D * c + d + 1) * from];
            let at = column as usize + d;
            let target = if at < columns {
                &mut panel[at * height..(at + 1) * height]
            } else {
                // Rows of the square count from the panel's row `height - stride`.
                let at = (at - columns) * stride;
                &mut square[at..at + stride]
            };
            let shift = if at < columns { 0 } else { height - stride };
            for (r, &row) in rows.iter().enumerate().skip(c) {
                let (to, from) = (row as usize - shift, D * r);
                for e in 0..D {
                    target[to + e] += source[from + e];
                }
            }
        }
    }
}

#[inline(always)]
fn solve_all<const D: usize, const FUSED: bool>(
    factor: &mut Factor<D>,
    symbolic: &Symbolic<D>,
    unknowns: &mut [[f64; D]],
) {
    let Factor { panels, work, .. } = factor;
    for front in symbolic.fronts.iter().filter(|front| front.height > 0) {
        let (height, columns) = (front.height as usize, front.columns as usize);
        let work = &mut work[..height];
        work.fill(0.0);
        let own = front.start as usize..front.end as usize;
        for (at, value) in unknowns[own.clone()].as_flattened().iter().enumerate() {
            work[at] = *value;
        }
        let panel = &panels[front.panel..front.panel + columns * height];
        for (block, columns) in panel.chunks_exact(COLUMNS * height).enumerate() {
            let j = block * COLUMNS;
            let column = [0, 1, 2, 3].map(|c| &columns[c * height..(c + 1) * height]);
            let mut x = [0.0; COLUMNS];
            for c in 0..COLUMNS {
                let mut value = work[j + c];
                for k in 0..c {
                    value -= column[k][j + c] * x[k];
                }
                x[c] = value / column[c][j + c];
                work[j + c] = x[c];
            }
            let below = j + COLUMNS;
            let tail = &mut work[below..];
            let [a, b, c, d] = column.map(|column| &column[below..]);
            for i in 0..tail.len().min(a.len()).min(b.len()).min(c.len()).min(d.len()) {
                let mut value = multiply_add::<FUSED>(-x[0], a[i], tail[i]);
                value = multiply_add::<FUSED>(-x[1], b[i], value);
                value = multiply_add::<FUSED>(-x[2], c[i], value);
                tail[i] = multiply_add::<FUSED>(-x[3], d[i], value);
            }
        }
        let len = D * own.len();
        unknowns[own].as_flattened_mut().copy_from_slice(&work[..len]);
        let passed = &symbolic.passed[front.passed[0] as usize..front.passed[1] as usize];
        for (&vertex, values) in passed.iter().zip(work[columns..].chunks_exact(D)) {
            for d in 0..D {
                unknowns[vertex as usize][d] += values[d];
            }
        }
    }
    for front in symbolic.fronts.iter().rev().filter(|front| front.height > 0) {
        let (height, columns) = (front.height as usize, front.columns as usize);
        let work = &mut work[..height];
        work.fill(0.0);
        let own = front.start as usize..front.end as usize;
        let len = D * own.len();
        work[..len].copy_from_slice(unknowns[own.clone()].as_flattened());
        let passed = &symbolic.passed[front.passed[0] as usize..front.passed[1] as usize];
        for (&vertex, values) in passed.iter().zip(work[columns..].chunks_exact_mut(D)) {
            values.copy_from_slice(&unknowns[vertex as usize]);
        }
        let panel = &panels[front.panel..front.panel + columns * height];
        for (block, columns) in panel.chunks_exact(COLUMNS * height).enumerate().rev() {
            let j = block * COLUMNS;
            let column = [0, 1, 2, 3].map(|c| &columns[c * height..(c + 1) * height]);
            let below = j + COLUMNS;
            let sums = dots::<FUSED>(column.map(|column| &column[below..]), &work[below..]);
            for c in (0..COLUMNS).rev() {
                let mut value = work[j + c] - sums[c];
                for k in c + 1..COLUMNS {
                    value -= column[c][j + k] * work[j + k];
                }
                work[j + c] = value / column[c][j + c];
            }
        }
        unknowns[own].as_flattened_mut().copy_from_slice(&work[..len]);
    }
}

/// The products of four columns with one, summed in four interleaved parts.
#[inline(always)]
fn dots<const FUSED: bool>(columns: [&[f64]; COLUMNS], with: &[f64]) -> [f64; COLUMNS] {
    let mut parts = [[0.0; 4]; COLUMNS];
    let (whole, _) = with.as_chunks::<4>();
    let columns = columns.map(|column| column.as_chunks::<4>().0);
    for (i, with) in whole.iter().enumerate() {
        for c in 0..COLUMNS {
            for p in 0..4 {
                parts[c][p] = multiply_add::<FUSED>(columns[c][i][p], with[p], parts[c][p]);
            }
        }
    }
    parts.map(|p| (p[0] + p[1]) + (p[2] + p[3]))
}
