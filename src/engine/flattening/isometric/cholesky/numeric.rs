//! The numbers of a factorisation, and solving with them.

#![expect(
    clippy::inline_always,
    reason = "vector instructions reach only what is inlined into the function that asks for them"
)]

use std::array::from_fn;
use std::ops::Range;

use super::dissection::NO_NODE;
use super::kernel::{COLUMNS, ROWS, factorise, multiply_add, place, update};
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
    /// For each column of the widest front four parts of a sum.
    sums: Vec<[f64; 4]>,
}

/// Makes a matrix more positive in a range of vertices; false when there is nothing left to do.
pub(crate) type Repair<'a, const D: usize> = dyn FnMut(Range<u32>, &mut Matrix<D>) -> bool + 'a;

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
            sums: vec![[0.0; 4]; symbolic.tallest],
        }
    }

    /// Factorises a matrix. Unknowns without a positive pivot are held. Where a front has one, beyond `allowed` of them in
    /// the last front, `repair` is asked first to make the matrix more positive in a range of vertices (new numbers): all
    /// that went into that pivot. While it says that it did, that range alone is factorised again.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`]: the observer is asked at every front.
    pub(crate) fn factorise(
        &mut self,
        symbolic: &Symbolic<D>,
        matrix: &mut Matrix<D>,
        (allowed, repair): (usize, &mut Repair<'_, D>),
        observer: &dyn Observer,
    ) -> Result<(), EngineError> {
        let greatest = matrix.diagonal.iter().flat_map(|block| (0..D).map(|d| block[d][d])).fold(0.0, f64::max);
        let floor = PIVOT_FLOOR * greatest;
        vectorised!(factorise_all::<D>(self, symbolic, matrix, (floor, allowed, repair), observer))
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
    matrix: &mut Matrix<D>,
    (floor, allowed, repair): (f64, usize, &mut Repair<'_, D>),
    observer: &dyn Observer,
) -> Result<(), EngineError> {
    let mut at = 0;
    while let Some(front) = symbolic.fronts.get(at) {
        at += 1;
        // Where a part falls apart by itself its separator is empty, and so may be its front.
        if front.height == 0 {
            continue;
        }
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
        // An empty separator passes on what its children pass, no more.
        let held = if columns > 0 { factorise::<FUSED>(panel, columns, floor) } else { 0 };
        if used > 0 && columns > 0 {
            update::<FUSED>(panel, columns, target, front.stride());
        }
        factor.buffers[front.buffer as usize] = square;
        observer.check()?;
        if held > if at == symbolic.fronts.len() { allowed } else { 0 } {
            let first = symbolic.first_below(at - 1);
            if repair(symbolic.fronts[first].start..front.end, matrix) {
                at = first;
            }
        }
    }
    Ok(())
}

/// Writes the matrix's columns of a front into its panel; padded columns become unit ones.
#[inline(always)]
fn scatter<const D: usize>(panel: &mut [f64], front: &Front, symbolic: &Symbolic<D>, matrix: &Matrix<D>) {
    let columns = front.columns as usize;
    // `D` divides the strips' height and each block begins at a multiple of it: no block is torn.
    for vertex in front.start as usize..front.end as usize {
        let first = D * (vertex - front.start as usize);
        let entries = symbolic.column_starts[vertex] as usize..symbolic.column_starts[vertex + 1] as usize;
        for c in 0..D {
            let at = place(columns, first, first + c);
            panel[at..at + D].copy_from_slice(&matrix.diagonal[vertex][c]);
        }
        for (&row, block) in symbolic.front_rows[entries.clone()].iter().zip(&matrix.below[entries]) {
            for (c, column) in block.iter().enumerate() {
                let at = place(columns, row as usize, first + c);
                panel[at..at + D].copy_from_slice(column);
            }
        }
    }
    for pad in D * (front.end - front.start) as usize..columns {
        panel[place(columns, pad, pad)] = 1.0;
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
    let (columns, stride) = (front.columns as usize, front.stride());
    let (from, offset) = (child.stride(), child.stride() - (child.height - child.columns) as usize);
    // Rows of the square count from those of the strip with the panel's row `columns`.
    let shift = front.height as usize - stride;
    for (c, &column) in rows.iter().enumerate() {
        for d in 0..D {
            let source = &passed[(D * c + d) * from + offset..(D * c + d + 1) * from];
            let at = column as usize + d;
            if at < columns {
                for (r, &row) in rows.iter().enumerate().skip(c) {
                    let to = place(columns, row as usize, at);
                    for e in 0..D {
                        panel[to + e] += source[D * r + e];
                    }
                }
            } else {
                let target = &mut square[(at - columns) * stride..(at - columns + 1) * stride];
                for (r, &row) in rows.iter().enumerate().skip(c) {
                    let to = row as usize - shift;
                    for e in 0..D {
                        target[to + e] += source[D * r + e];
                    }
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
    let Factor { panels, work, sums, .. } = factor;
    for front in symbolic.fronts.iter().filter(|front| front.columns > 0) {
        let (height, columns) = (front.height as usize, front.columns as usize);
        let work = &mut work[..height];
        work.fill(0.0);
        let own = front.start as usize..front.end as usize;
        let len = D * own.len();
        work[..len].copy_from_slice(unknowns[own.clone()].as_flattened());
        let panel = &panels[front.panel..front.panel + columns * height];
        for (number, strip) in panel.chunks_exact(ROWS * columns).enumerate() {
            let first = number * ROWS;
            let (strip, _) = strip.as_chunks::<ROWS>();
            let (done, rest) = work.split_at_mut(first);
            let Some(target) = rest.first_chunk_mut::<ROWS>() else { break };
            forward::<FUSED>(strip, done, target);
            for c in first..(first + ROWS).min(columns) {
                let x = target[c - first] / strip[c][c - first];
                target[c - first] = x;
                for r in c - first + 1..ROWS {
                    target[r] -= strip[c][r] * x;
                }
            }
        }
        unknowns[own].as_flattened_mut().copy_from_slice(&work[..len]);
        let passed = &symbolic.passed[front.passed[0] as usize..front.passed[1] as usize];
        for (&vertex, values) in passed.iter().zip(work[columns..].chunks_exact(D)) {
            for d in 0..D {
                unknowns[vertex as usize][d] += values[d];
            }
        }
    }
    for front in symbolic.fronts.iter().rev().filter(|front| front.columns > 0) {
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
        let sums = &mut sums[..columns];
        sums.fill([0.0; 4]);
        let panel = &panels[front.panel..front.panel + columns * height];
        for (number, strip) in panel.chunks_exact(ROWS * columns).enumerate().rev() {
            let first = number * ROWS;
            let (strip, _) = strip.as_chunks::<ROWS>();
            let Some(known) = work[first..].first_chunk_mut::<ROWS>() else { break };
            for c in (first..(first + ROWS).min(columns)).rev() {
                let [p, q, r, s] = sums[c];
                let mut value = known[c - first] - ((p + q) + (r + s));
                for r in c - first + 1..ROWS {
                    value -= strip[c][r] * known[r];
                }
                known[c - first] = value / strip[c][c - first];
            }
            // Four columns at a time: of single ones the compiler would make vectors across columns, by shuffling.
            let (fours, _) = strip[..first.min(columns)].as_chunks::<COLUMNS>();
            let (sums, _) = sums.as_chunks_mut::<COLUMNS>();
            for (sums, columns) in sums.iter_mut().zip(fours) {
                for (sum, column) in sums.iter_mut().zip(columns) {
                    let upper: [f64; 4] = from_fn(|p| multiply_add::<FUSED>(column[p], known[p], sum[p]));
                    *sum = from_fn(|p| multiply_add::<FUSED>(column[4 + p], known[4 + p], upper[p]));
                }
            }
        }
        unknowns[own].as_flattened_mut().copy_from_slice(&work[..len]);
    }
}

/// Subtracts from a strip's rows what the unknowns before them make of them, even and odd columns apart, so that no
/// addition waits for the one before.
#[inline(always)]
fn forward<const FUSED: bool>(strip: &[[f64; ROWS]], done: &[f64], target: &mut [f64; ROWS]) {
    let mut odd = [0.0; ROWS];
    let (pairs, last) = strip[..done.len().min(strip.len())].as_chunks::<2>();
    let (values, _) = done.as_chunks::<2>();
    for (columns, x) in pairs.iter().zip(values) {
        for r in 0..ROWS {
            target[r] = multiply_add::<FUSED>(-x[0], columns[0][r], target[r]);
            odd[r] = multiply_add::<FUSED>(-x[1], columns[1][r], odd[r]);
        }
    }
    debug_assert!(last.is_empty(), "columns come in fours");
    for r in 0..ROWS {
        target[r] += odd[r];
    }
}
