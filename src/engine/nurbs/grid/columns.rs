//! Basis functions of a grid's columns in blocks, and the sweep over its rows.
//!
//! A grid is a tensor product. The functions along u are formed once a column and kept in blocks of [`LANES`] columns of
//! one knot span, function by function, so that a sum over control points runs over whole blocks side by side. For each
//! row the net is first contracted along v to one line of control points a derivative; the columns' sums run along it.

use crate::engine::nurbs::basis::{Basis, WIDEST};
use crate::engine::nurbs::{KnotVector, Surface};

/// Columns that are worked on side by side. More: fewer turns of the loop; fewer: less is wasted where spans hold few
/// columns (a block never reaches over a knot).
pub(super) const LANES: usize = 16;

/// Lanes that are worked on when a block holds no more columns than these: where every column has a knot span of its own,
/// whole blocks would be idle for the most part.
const FEW_LANES: usize = 4;

/// One number for each column of a block.
pub(super) type Lanes = [f64; LANES];

/// Coordinates and weight. The weight is unused where the surface is not rational.
pub(super) type Homogeneous = [f64; 4];

/// Consecutive columns in one knot span.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// The first control point of the span.
    first_control: usize,
    /// The first column.
    pub(super) start: usize,
    /// How many columns, at most [`LANES`].
    pub(super) len: usize,
}

/// The functions of all columns.
struct Columns {
    blocks: Vec<Block>,
    /// Function `k`, derivative `d` of block `b` at `(b * orders + d) * (degree + 1) + k`.
    functions: Vec<Lanes>,
}

impl Columns {
    fn new<const ORDERS: usize>(knots: &KnotVector, us: &[f64]) -> Self {
        let width = knots.degree() + 1;
        let mut columns = Self { blocks: Vec::new(), functions: Vec::new() };
        for (column, &u) in us.iter().enumerate() {
            let basis = Basis::<ORDERS, WIDEST>::at(knots, u);
            let fits = columns.blocks.last().is_some_and(|b| b.first_control == basis.first && b.len < LANES);
            if !fits {
                columns.blocks.push(Block { first_control: basis.first, start: column, len: 0 });
                columns.functions.resize(columns.blocks.len() * ORDERS * width, [0.0; LANES]);
            }
            let base = (columns.blocks.len() - 1) * ORDERS * width;
            if let Some(block) = columns.blocks.last_mut() {
                for (d, row) in basis.rows.iter().enumerate() {
                    for (k, &value) in row[..width].iter().enumerate() {
                        columns.functions[base + d * width + k][block.len] = value;
                    }
                }
                block.len += 1;
            }
        }
        columns
    }
}

/// One block of one row, ready to be summed: functions along u and contracted control points, by derivative.
pub(super) struct Tile<'a, const ORDERS: usize> {
    /// The row.
    pub(super) row: usize,
    /// The columns.
    pub(super) block: Block,
    /// The functions along u, `degree + 1` a derivative.
    pub(super) functions: [&'a [Lanes]; ORDERS],
    /// The net contracted along v, `degree + 1` points a derivative.
    pub(super) lines: [&'a [Homogeneous]; ORDERS],
}

/// Visits every block of every row, rows outermost.
pub(super) fn sweep<const ORDERS: usize>(
    surface: &Surface,
    us: &[f64],
    vs: &[f64],
    mut visit: impl FnMut(&Tile<'_, ORDERS>),
) {
    let width = surface.knots_u().degree() + 1;
    let nv = surface.knots_v().control_count();
    let columns = Columns::new::<ORDERS>(surface.knots_u(), us);
    // Only control points that some column needs are contracted.
    let low = columns.blocks.iter().map(|b| b.first_control).min().unwrap_or(0);
    let high = columns.blocks.iter().map(|b| b.first_control + width).max().unwrap_or(0);
    let net = homogeneous(surface, low * nv, high * nv);
    let mut lines = vec![[0.0; 4]; ORDERS * (high - low)];
    for (row, &v) in vs.iter().enumerate() {
        contract::<ORDERS>(&net, surface.knots_v(), v, &mut lines);
        for (b, &block) in columns.blocks.iter().enumerate() {
            let functions = std::array::from_fn(|d| {
                let at = (b * ORDERS + d) * width;
                &columns.functions[at..at + width]
            });
            let tile_lines = std::array::from_fn(|d| {
                let at = d * (high - low) + block.first_control - low;
                &lines[at..at + width]
            });
            visit(&Tile { row, block, functions, lines: tile_lines });
        }
    }
}

/// The control points `from..to` of the net with their weights multiplied in.
fn homogeneous(surface: &Surface, from: usize, to: usize) -> Vec<Homogeneous> {
    let control = &surface.control()[from..to];
    match surface.weights() {
        Some(w) => control.iter().zip(&w[from..to]).map(|(p, &w)| [p.x * w, p.y * w, p.z * w, w]).collect(),
        None => control.iter().map(|p| [p.x, p.y, p.z, 0.0]).collect(),
    }
}

/// Contracts every row of control points of `net` with the functions along v at `v`; derivative by derivative.
fn contract<const ORDERS: usize>(net: &[Homogeneous], knots: &KnotVector, v: f64, lines: &mut [Homogeneous]) {
    let basis = Basis::<ORDERS, WIDEST>::at(knots, v);
    let width = knots.degree() + 1;
    let count = lines.len() / ORDERS;
    for (i, points) in net.chunks_exact(knots.control_count()).enumerate() {
        let points = &points[basis.first..basis.first + width];
        for (d, row) in basis.rows.iter().enumerate() {
            let mut sum = [0.0; 4];
            for (point, &n) in points.iter().zip(&row[..width]) {
                for c in 0..4 {
                    sum[c] += point[c] * n;
                }
            }
            lines[d * count + i] = sum;
        }
    }
}

/// `sums[c][lane]` = sum over `k` of `functions[k][lane] * line[k][c]` for the first `len` lanes at least, with the loop
/// over `k` unrolled for low degrees.
pub(super) fn combine<const C: usize>(functions: &[Lanes], line: &[Homogeneous], len: usize, sums: &mut [Lanes; C]) {
    if len <= FEW_LANES {
        narrow::<C, FEW_LANES>(functions, line, sums);
    } else {
        narrow::<C, LANES>(functions, line, sums);
    }
}

/// [`combine`] over the first `L` lanes.
fn narrow<const C: usize, const L: usize>(functions: &[Lanes], line: &[Homogeneous], sums: &mut [Lanes; C]) {
    match (functions, line) {
        ([f0, f1], &[l0, l1]) => unrolled::<2, C, L>([f0, f1], [l0, l1], sums),
        ([f0, f1, f2], &[l0, l1, l2]) => unrolled::<3, C, L>([f0, f1, f2], [l0, l1, l2], sums),
        ([f0, f1, f2, f3], &[l0, l1, l2, l3]) => unrolled::<4, C, L>([f0, f1, f2, f3], [l0, l1, l2, l3], sums),
        _ => {
            for sum in sums.iter_mut() {
                sum[..L].fill(0.0);
            }
            for (f, point) in functions.iter().zip(line) {
                for (sum, &x) in sums.iter_mut().zip(point) {
                    for lane in 0..L {
                        sum[lane] += f[lane] * x;
                    }
                }
            }
        }
    }
}

/// [`combine`] for a degree known beforehand.
fn unrolled<const K: usize, const C: usize, const L: usize>(
    functions: [&Lanes; K],
    line: [Homogeneous; K],
    sums: &mut [Lanes; C],
) {
    for (c, sum) in sums.iter_mut().enumerate() {
        for lane in 0..L {
            let mut s = functions[0][lane] * line[0][c];
            for k in 1..K {
                s += functions[k][lane] * line[k][c];
            }
            sum[lane] = s;
        }
    }
}
