//! What a factorisation needs to know of the graph: the new numbering, the fronts, and where each number goes.

use glam::DVec3;

use super::dissection::{Graph, NO_NODE, dissect};
use super::kernel::{COLUMNS, ROWS};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// One front: which rows it has and where its numbers lie.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Front {
    /// Its own vertices in the new numbering.
    pub(super) start: u32,
    /// End of them.
    pub(super) end: u32,
    /// The vertices that it passes on to, in `Symbolic::passed`.
    pub(super) passed: [u32; 2],
    /// Its children, or [`NO_NODE`].
    pub(super) children: [u32; 2],
    /// The buffer for what it passes on: no two that are needed at the same time share one.
    pub(super) buffer: u32,
    /// Columns of its panel, padded.
    pub(super) columns: u32,
    /// Columns of the square that it passes on, padded.
    pub(super) square: u32,
    /// Rows of its panel, padded.
    pub(super) height: u32,
    /// Where its panel begins in the factor.
    pub(super) panel: usize,
}

impl Front {
    /// Rows of the square: those of the panel from the last whole tile of its own columns on.
    pub(super) const fn stride(&self) -> usize {
        (self.height - self.columns / ROWS as u32 * ROWS as u32) as usize
    }
}

/// The structure of a factorisation with `D` unknowns a vertex.
#[derive(Debug, Clone)]
pub(crate) struct Symbolic<const D: usize> {
    /// For each new number the vertex.
    pub(crate) order: Vec<u32>,
    /// For each vertex its new number.
    pub(crate) rank: Vec<u32>,
    /// Where the entries below the diagonal of each column of blocks begin; one more than vertices.
    pub(super) column_starts: Vec<u32>,
    /// The block row of each of them, ascending in each column.
    rows: Vec<u32>,
    /// The row of its front that it belongs to (the first of `D`).
    pub(super) front_rows: Vec<u32>,
    pub(super) fronts: Vec<Front>,
    /// Vertices passed on to, by fronts.
    pub(super) passed: Vec<u32>,
    /// For each of them its row in the parent's front.
    pub(super) parent_rows: Vec<u32>,
    /// Sizes of the buffers.
    pub(super) buffers: Vec<usize>,
    /// Numbers in the factor.
    pub(super) len: usize,
    /// Rows of the tallest front.
    pub(super) tallest: usize,
}

/// A symmetric matrix of `D` x `D` blocks in a [`Symbolic`]'s new numbering.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Matrix<const D: usize> {
    /// Diagonal blocks.
    pub(crate) diagonal: Vec<[[f64; D]; D]>,
    /// Blocks below the diagonal: `[c][r]` is the entry of the column's unknown `c` and the row's unknown `r`.
    pub(crate) below: Vec<[[f64; D]; D]>,
}

const fn padded(count: usize, to: usize) -> usize {
    count.div_ceil(to) * to
}

impl<const D: usize> Symbolic<D> {
    /// The structure for a graph over vertices at `places` (which steer the order alone).
    ///
    /// # Errors
    /// [`EngineError::Cancelled`].
    pub(crate) fn new(places: &[DVec3], graph: &Graph, observer: &dyn Observer) -> Result<Self, EngineError> {
        let count = places.len();
        let dissection = dissect(places, graph, observer)?;
        let mut rank = vec![0_u32; count];
        for (new, &old) in dissection.order.iter().enumerate() {
            rank[old as usize] = new as u32;
        }
        let mut column_starts = Vec::with_capacity(count + 1);
        column_starts.push(0);
        let mut rows = Vec::with_capacity(graph.neighbours.len() / 2);
        for new in 0..count as u32 {
            let from = rows.len();
            rows.extend(
                graph.of(dissection.order[new as usize]).iter().map(|&w| rank[w as usize]).filter(|&r| r > new),
            );
            rows[from..].sort_unstable();
            column_starts.push(rows.len() as u32);
        }
        let front_rows = vec![0; rows.len()];
        let mut symbolic = Self {
            order: dissection.order,
            rank,
            column_starts,
            rows,
            front_rows,
            fronts: Vec::with_capacity(dissection.nodes.len()),
            passed: Vec::new(),
            parent_rows: Vec::new(),
            buffers: Vec::new(),
            len: 0,
            tallest: 0,
        };
        let mut row_of = vec![0_u32; count];
        let mut mark = vec![u32::MAX; count];
        for (number, node) in dissection.nodes.iter().enumerate() {
            let front = Front { start: node.start, end: node.end, children: node.children, ..Front::default() };
            symbolic.add_front(number as u32, front, &mut mark, &mut row_of);
        }
        symbolic.parent_rows.resize(symbolic.passed.len(), 0);
        symbolic.assign_buffers(&dissection.nodes.iter().map(|n| n.depth).collect::<Vec<_>>());
        Ok(symbolic)
    }

    /// How many vertices there are.
    pub(crate) fn vertex_count(&self) -> usize {
        self.order.len()
    }

    /// The first of the fronts below one: they are those from it on.
    pub(super) fn first_below(&self, front: usize) -> usize {
        let mut first = front;
        while self.fronts[first].children[0] != NO_NODE {
            first = self.fronts[first].children[0] as usize;
        }
        first
    }

    /// A matrix of zeros.
    pub(crate) fn matrix(&self) -> Matrix<D> {
        Matrix { diagonal: vec![[[0.0; D]; D]; self.order.len()], below: vec![[[0.0; D]; D]; self.rows.len()] }
    }

    /// The number of the block of two neighbours, given as (greater, lesser) of the new numbering.
    pub(crate) fn block(&self, row: u32, column: u32) -> Option<u32> {
        let [from, to] = [0, 1].map(|k| self.column_starts[column as usize + k] as usize);
        self.rows[from..to].binary_search(&row).ok().map(|at| (from + at) as u32)
    }

    /// Takes the held vertices' unknowns out of a matrix: their rows become those of the unit matrix.
    pub(crate) fn hold(&self, matrix: &mut Matrix<D>, held: &[usize]) {
        for column in 0..self.order.len() {
            let entries = self.column_starts[column] as usize..self.column_starts[column + 1] as usize;
            for (row, block) in self.rows[entries.clone()].iter().zip(&mut matrix.below[entries]) {
                if held.contains(&column) || held.contains(&(*row as usize)) {
                    *block = [[0.0; D]; D];
                }
            }
        }
        for &v in held {
            matrix.diagonal[v] = std::array::from_fn(|c| std::array::from_fn(|r| f64::from(u8::from(c == r))));
        }
    }

    fn add_front(&mut self, number: u32, mut front: Front, mark: &mut [u32], row_of: &mut [u32]) {
        let from = self.passed.len();
        for column in front.start..front.end {
            let [a, b] = [0, 1].map(|k| self.column_starts[column as usize + k] as usize);
            for &row in &self.rows[a..b] {
                if row >= front.end && mark[row as usize] != number {
                    mark[row as usize] = number;
                    self.passed.push(row);
                }
            }
        }
        for child in front.children.into_iter().filter(|&c| c != NO_NODE) {
            let [a, b] = self.fronts[child as usize].passed;
            for at in a..b {
                let row = self.passed[at as usize];
                if row >= front.end && mark[row as usize] != number {
                    mark[row as usize] = number;
                    self.passed.push(row);
                }
            }
        }
        self.passed[from..].sort_unstable();
        let own = D * (front.end - front.start) as usize;
        let passed = D * (self.passed.len() - from);
        front.columns = padded(own, COLUMNS) as u32;
        front.square = padded(passed, COLUMNS) as u32;
        front.height = padded((front.columns + front.square) as usize, ROWS) as u32;
        front.passed = [from as u32, self.passed.len() as u32];
        front.panel = self.len;
        self.len += front.columns as usize * front.height as usize;
        self.tallest = self.tallest.max(front.height as usize);
        for (at, &row) in self.passed[from..].iter().enumerate() {
            row_of[row as usize] = front.columns + (D * at) as u32;
        }
        for vertex in front.start..front.end {
            row_of[vertex as usize] = D as u32 * (vertex - front.start);
        }
        for at in self.column_starts[front.start as usize]..self.column_starts[front.end as usize] {
            self.front_rows[at as usize] = row_of[self.rows[at as usize] as usize];
        }
        self.parent_rows.resize(self.passed.len(), 0);
        for child in front.children.into_iter().filter(|&c| c != NO_NODE) {
            let [a, b] = self.fronts[child as usize].passed;
            for at in a as usize..b as usize {
                self.parent_rows[at] = row_of[self.passed[at] as usize];
            }
        }
        self.fronts.push(front);
    }

    /// Two fronts of one depth are needed at the same time only when they are siblings.
    fn assign_buffers(&mut self, depths: &[u32]) {
        let deepest = depths.iter().copied().max().unwrap_or(0) as usize;
        self.buffers = vec![0; 2 * (deepest + 1)];
        for number in 0..self.fronts.len() {
            let children = self.fronts[number].children;
            for (side, child) in children.into_iter().enumerate().filter(|&(_, c)| c != NO_NODE) {
                let front = &mut self.fronts[child as usize];
                let buffer = 2 * depths[child as usize] as usize + side;
                front.buffer = buffer as u32;
                self.buffers[buffer] = self.buffers[buffer].max(front.stride() * front.square as usize);
            }
        }
    }
}
