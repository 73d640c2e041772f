//! The dense arithmetic of a front: a partial Cholesky factorisation in column-major storage.
//!
//! A panel's columns are `height` long; the rows of its own columns come first. Both numbers are padded ([`ROWS`],
//! [`COLUMNS`]) with unit columns and zero rows, so that no loop has a remainder. Entries above the diagonal hold
//! anything and never reach a result: each row of a tile depends on that row alone and on the diagonal block.
//!
//! Method: left-looking by blocks of [`COLUMNS`] columns; a tile of [`ROWS`] x [`COLUMNS`] stays in registers while all
//! columns before it are subtracted. `FUSED` says that the processor multiplies and adds in one instruction.

#![expect(
    clippy::inline_always,
    reason = "vector instructions reach only what is inlined into the function that asks for them"
)]
#![expect(clippy::needless_range_loop, reason = "rows and columns are indices of several arrays, as in the formulae")]

/// Columns of a tile.
pub(super) const COLUMNS: usize = 4;
/// Rows of a tile. With [`COLUMNS`] it fills eight vectors of four numbers, as many as hide the latency of an addition.
pub(super) const ROWS: usize = 8;

type Tile = [[f64; ROWS]; COLUMNS];

#[inline(always)]
pub(super) fn multiply_add<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// What remains of a tile when the products of the done columns' rows `row..` and rows `column..` are subtracted.
#[inline(always)]
fn subtract<const FUSED: bool>(done: &[f64], height: usize, row: usize, column: usize, mut tile: Tile) -> Tile {
    for source in done.chunks_exact(height) {
        let Some(rows) = source[row..].first_chunk::<ROWS>() else { return tile };
        let Some(factors) = source[column..].first_chunk::<COLUMNS>() else { return tile };
        for c in 0..COLUMNS {
            for r in 0..ROWS {
                tile[c][r] = multiply_add::<FUSED>(-factors[c], rows[r], tile[c][r]);
            }
        }
    }
    tile
}

#[inline(always)]
fn load(from: &[f64], stride: usize, row: usize) -> Tile {
    let mut tile = [[0.0; ROWS]; COLUMNS];
    for c in 0..COLUMNS {
        tile[c].copy_from_slice(&from[c * stride + row..c * stride + row + ROWS]);
    }
    tile
}

#[inline(always)]
fn store(tile: &Tile, to: &mut [f64], stride: usize, row: usize) {
    for c in 0..COLUMNS {
        to[c * stride + row..c * stride + row + ROWS].copy_from_slice(&tile[c]);
    }
}

/// Factorises all columns of a panel in place. A pivot that is not above `floor` is replaced by infinity's stand-in: its
/// unknown stays where it is. Gives how many were.
#[inline(always)]
pub(super) fn factorise<const FUSED: bool>(panel: &mut [f64], height: usize, floor: f64) -> usize {
    let columns = panel.len() / height;
    let mut held = 0;
    let mut j = 0;
    while j < columns {
        let (done, rest) = panel.split_at_mut(j * height);
        let block = &mut rest[..COLUMNS * height];
        let first = j / ROWS * ROWS;
        // The tile that holds the diagonal block comes first: its triangle divides all others.
        let tile = subtract::<FUSED>(done, height, first, j, load(block, height, first));
        let lower = triangle(&tile, j - first, floor);
        held += (0..COLUMNS).filter(|&c| lower[c][c] == HELD).count();
        let inverse = [0, 1, 2, 3].map(|c| 1.0 / lower[c][c]);
        let mut row = first;
        while row < height {
            let mut tile =
                if row == first { tile } else { subtract::<FUSED>(done, height, row, j, load(block, height, row)) };
            for c in 0..COLUMNS {
                for k in 0..c {
                    for r in 0..ROWS {
                        tile[c][r] = multiply_add::<FUSED>(-lower[k][c], tile[k][r], tile[c][r]);
                    }
                }
                for r in 0..ROWS {
                    tile[c][r] *= inverse[c];
                }
            }
            store(&tile, block, height, row);
            row += ROWS;
        }
        for c in 0..COLUMNS {
            block[c * height + j..c * height + j + COLUMNS].copy_from_slice(&lower[c]);
        }
        j += COLUMNS;
    }
    held
}

/// The factor of the 4 x 4 block in rows `at..` of a tile, by columns.
#[inline(always)]
fn triangle(tile: &Tile, at: usize, floor: f64) -> [[f64; COLUMNS]; COLUMNS] {
    let mut lower = [[0.0; COLUMNS]; COLUMNS];
    for c in 0..COLUMNS {
        let mut column = [0.0; COLUMNS];
        for r in c..COLUMNS {
            column[r] = tile[c][at + r];
            for k in 0..c {
                column[r] -= lower[k][r] * lower[k][c];
            }
        }
        let pivot = if column[c] > floor { column[c].sqrt() } else { HELD };
        for r in c..COLUMNS {
            lower[c][r] = if r == c { pivot } else { column[r] / pivot };
        }
    }
    lower
}

/// What the square root of a pivot that is not positive becomes: so large that its unknown does not move.
const HELD: f64 = 1e100;

/// Subtracts from a square of `stride` rows, whose first row is the panel's row `first`, the product of the panel's rows
/// from `first_column` on with themselves, lower half.
#[inline(always)]
pub(super) fn update<const FUSED: bool>(
    panel: &[f64],
    height: usize,
    first_column: usize,
    square: &mut [f64],
    stride: usize,
) {
    let first = height - stride;
    for (c, target) in square.chunks_exact_mut(COLUMNS * stride).enumerate() {
        let column = first_column + c * COLUMNS;
        let mut row = column / ROWS * ROWS;
        while row < height {
            let tile = load(target, stride, row - first);
            store(&subtract::<FUSED>(panel, height, row, column, tile), target, stride, row - first);
            row += ROWS;
        }
    }
}
