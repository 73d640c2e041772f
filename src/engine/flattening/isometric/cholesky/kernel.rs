//! The dense arithmetic of a front: a partial Cholesky factorisation in column-major storage.
//!
//! A panel is stored in strips of [`ROWS`] rows, each by columns, so that all that is read of it lies in a row: the entry
//! of row r and column c is number [`place`]. The rows of its own columns come first. Rows and columns are padded
//! ([`ROWS`], [`COLUMNS`]) with unit columns and zero rows, so that no loop has a remainder. Entries above the diagonal hold
//! anything and never reach a result: each row of a tile depends on that row alone and on the diagonal block.
//!
//! Method: a tile of [`ROWS`] x [`COLUMNS`] stays in registers while the columns before it are subtracted. Columns are
//! taken in groups of [`GROUP`], whose rows stay in the cache while the panel's strips pass by, and what is subtracted in
//! runs of at most [`DEPTH`] columns. `FUSED` says that the processor multiplies and adds in one instruction.

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

/// Columns of a group: as many as keep their rows in the second cache.
const GROUP: usize = 32;

/// Columns that are subtracted in one run: a strip of as many stays in the first cache.
const DEPTH: usize = 256;

/// Where the entry of a row and a column lies in a panel.
#[inline(always)]
pub(super) const fn place(columns: usize, row: usize, column: usize) -> usize {
    row / ROWS * ROWS * columns + column * ROWS + row % ROWS
}

/// What remains of a tile when the products of its rows in `rows` and its columns' rows in `factors` are subtracted: two
/// runs of strips over the same columns; `half` says where in their strip the columns' rows begin.
#[inline(always)]
fn subtract<const FUSED: bool>(rows: &[f64], factors: &[f64], half: usize, mut tile: Tile) -> Tile {
    let (rows, _) = rows.as_chunks::<ROWS>();
    let (factors, _) = factors.as_chunks::<ROWS>();
    if half == 0 {
        for (rows, factors) in rows.iter().zip(factors) {
            for c in 0..COLUMNS {
                for r in 0..ROWS {
                    tile[c][r] = multiply_add::<FUSED>(-factors[c], rows[r], tile[c][r]);
                }
            }
        }
    } else {
        for (rows, factors) in rows.iter().zip(factors) {
            for c in 0..COLUMNS {
                for r in 0..ROWS {
                    tile[c][r] = multiply_add::<FUSED>(-factors[COLUMNS + c], rows[r], tile[c][r]);
                }
            }
        }
    }
    tile
}

/// A tile whose columns are `stride` apart.
#[inline(always)]
fn load(from: &[f64], stride: usize) -> Tile {
    let mut tile = [[0.0; ROWS]; COLUMNS];
    for c in 0..COLUMNS {
        tile[c].copy_from_slice(&from[c * stride..c * stride + ROWS]);
    }
    tile
}

#[inline(always)]
fn store(tile: &Tile, to: &mut [f64], stride: usize) {
    for c in 0..COLUMNS {
        to[c * stride..c * stride + ROWS].copy_from_slice(&tile[c]);
    }
}

/// Factorises all columns of a panel in place. A pivot that is not above `floor` is replaced by infinity's stand-in: its
/// unknown stays where it is. Gives how many were.
#[inline(always)]
pub(super) fn factorise<const FUSED: bool>(panel: &mut [f64], columns: usize, floor: f64) -> usize {
    let strip = ROWS * columns;
    let mut held = 0;
    let mut group = 0;
    while group < columns {
        let end = (group + GROUP).min(columns);
        let mut from = 0;
        while from < group {
            let to = (from + DEPTH).min(group);
            take_away::<FUSED>(panel, columns, [group, end], [from, to]);
            from = to;
        }
        let mut j = group;
        while j < end {
            let first = j / ROWS;
            let (head, below) = panel.split_at_mut((first + 1) * strip);
            let head = &mut head[first * strip..];
            // The tile that holds the diagonal block comes first: its triangle divides all others.
            let factors = &head[group * ROWS..j * ROWS];
            let tile = subtract::<FUSED>(factors, factors, j % ROWS, load(&head[j * ROWS..], ROWS));
            let lower = triangle(&tile, j % ROWS, floor);
            held += (0..COLUMNS).filter(|&c| lower[c][c] == HELD).count();
            let inverse = [0, 1, 2, 3].map(|c| 1.0 / lower[c][c]);
            store(&divide::<FUSED>(tile, &lower, &inverse), &mut head[j * ROWS..], ROWS);
            for c in 0..COLUMNS {
                let at = (j + c) * ROWS + j % ROWS;
                head[at..at + COLUMNS].copy_from_slice(&lower[c]);
            }
            let factors = &head[group * ROWS..j * ROWS];
            for rows in below.chunks_exact_mut(strip) {
                let (done, rest) = rows.split_at_mut(j * ROWS);
                let tile = subtract::<FUSED>(&done[group * ROWS..], factors, j % ROWS, load(rest, ROWS));
                store(&divide::<FUSED>(tile, &lower, &inverse), rest, ROWS);
            }
            j += COLUMNS;
        }
        group = end;
    }
    held
}

/// Subtracts from the columns of a group what the columns of a run before it make of them.
#[inline(always)]
fn take_away<const FUSED: bool>(panel: &mut [f64], columns: usize, group: [usize; 2], run: [usize; 2]) {
    let strip = ROWS * columns;
    let run = run[0] * ROWS..run[1] * ROWS;
    for row in group[0] / ROWS..panel.len() / strip {
        let (before, rest) = panel.split_at_mut(row * strip);
        let (rows, later) = rest.split_at_mut(run.end);
        let rows = &rows[run.start..];
        for column in (group[0]..group[1]).step_by(COLUMNS) {
            let of = column / ROWS;
            if of > row {
                break;
            }
            let factors = if of == row { rows } else { &before[of * strip..][run.clone()] };
            let target = &mut later[column * ROWS - run.end..];
            store(&subtract::<FUSED>(rows, factors, column % ROWS, load(target, ROWS)), target, ROWS);
        }
    }
}

/// Divides a tile by the triangle of its columns.
#[inline(always)]
fn divide<const FUSED: bool>(mut tile: Tile, lower: &[[f64; COLUMNS]; COLUMNS], inverse: &[f64; COLUMNS]) -> Tile {
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
    tile
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

/// Subtracts from a square, lower half, the product of the panel's rows below its own columns with themselves. The square is
/// stored by columns of `stride` rows, the first of which is that of the strip with the panel's row `columns`.
#[inline(always)]
pub(super) fn update<const FUSED: bool>(panel: &[f64], columns: usize, square: &mut [f64], stride: usize) {
    let strip = ROWS * columns;
    let (first, strips) = (columns / ROWS, panel.len() / strip);
    let count = square.len() / stride;
    for from in (0..columns).step_by(DEPTH) {
        let run = from * ROWS..(from + DEPTH).min(columns) * ROWS;
        for group in (0..count).step_by(GROUP) {
            for row in (columns + group) / ROWS..strips {
                let rows = &panel[row * strip..][run.clone()];
                for c in (group..(group + GROUP).min(count)).step_by(COLUMNS) {
                    let column = columns + c;
                    if column / ROWS > row {
                        break;
                    }
                    let factors = &panel[column / ROWS * strip..][run.clone()];
                    let target = &mut square[c * stride + (row - first) * ROWS..];
                    store(&subtract::<FUSED>(rows, factors, column % ROWS, load(target, stride)), target, stride);
                }
            }
        }
    }
}
