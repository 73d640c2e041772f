//! What the walk leaves in the cells: edge crossing lists (thesis 3.3.2), points on cell edges, contained loops.
//!
//! Storage is sparse: one list of events, sorted by row and then column, so that only cells which a loop meets occur.
//!
//! # How this differs from the thesis
//! - A crossing list ends whenever the loop comes back to the cell's border, also where it only touches it: a touch point
//!   may pinch the cell's polygon, and every list then runs from border to border through the cell's interior.
//! - A part of a loop that slides along a cell edge belongs to no list (lists with such spikes are what goes wrong under
//!   the scheme as printed). It tells both cells of the edge where the region lies: the cell to its left is inside.
//! - A point on an edge is told to a cell of the edge also when no list of the cell begins or ends there, so a neighbour
//!   that no loop enters carries it as well.

use super::walk::Step;

/// An edge of a cell, anticlockwise from the bottom.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CellEdge {
    /// From the lower left corner to the lower right.
    Bottom,
    /// Upwards on the right.
    Right,
    /// From the upper right corner to the upper left.
    Top,
    /// Downwards on the left.
    Left,
}

/// Points of a loop from where it enters a cell to where it leaves it, both on the cell's border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CrossingList {
    /// Index of the enter point among the traced points.
    pub first: u32,
    /// Index of the leave point; the points between lie inside the cell.
    pub last: u32,
    /// Edge of the enter point.
    pub enter: CellEdge,
    /// Edge of the leave point. Points in corners belong to the first edge in the order top, left, bottom, right.
    pub leave: CellEdge,
}

/// Something a loop leaves in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum What {
    /// It runs through.
    List(CrossingList),
    /// It has a point on an edge at which no list of this cell begins or ends (corners are not told).
    Touch { edge: CellEdge, point: u32 },
    /// It slides along an edge, with the region on this cell's side or on the other.
    Slide { inside: bool },
    /// It lies inside altogether: its points are `first..end`.
    Contained { first: u32, end: u32 },
}

/// An event in a cell (column i, row j).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Event {
    pub(super) cell: [u32; 2],
    pub(super) what: What,
}

/// The cell in whose interior or on whose border the part of a loop between two steps of a walk lies.
fn cell_between(a: &Step, b: &Step) -> [u32; 2] {
    [0, 1].map(|k| a.code[k].min(b.code[k]) / 2)
}

/// The edge of `cell` on which a step lies, in the order in which the thesis checks them.
fn edge_of(step: &Step, cell: [u32; 2]) -> CellEdge {
    if step.code[1] == 2 * cell[1] + 2 {
        CellEdge::Top
    } else if step.code[0] == 2 * cell[0] {
        CellEdge::Left
    } else if step.code[1] == 2 * cell[1] {
        CellEdge::Bottom
    } else {
        CellEdge::Right
    }
}

/// The two cells at a grid line along which a loop slides from `a` to `b`: left and right of it. `None` when it does
/// not slide; a cell beyond the domain is `None` too.
fn slide(a: &Step, b: &Step, size: [u32; 2]) -> Option<[Option<[u32; 2]>; 2]> {
    let k = (0..2).find(|&k| a.code[k] == b.code[k] && a.code[k].is_multiple_of(2))?;
    let other = 1 - k;
    let (line, along) = (a.code[k] / 2, a.code[other].min(b.code[other]) / 2);
    let cell = |line: u32| {
        let mut cell = [along; 2];
        cell[k] = line;
        cell
    };
    let before = (line > 0).then(|| cell(line - 1));
    let after = (line < size[k]).then(|| cell(line));
    // Upwards on a line of constant u the left is before it; to the right on a line of constant v it is after it.
    let forwards = b.at[other] > a.at[other];
    Some(if forwards == (k == 0) { [before, after] } else { [after, before] })
}

/// Tells the cells what a loop does in them.
///
/// `steps` is its closed walk: when it meets a grid line, it begins on one and its first step is repeated at the end;
/// otherwise it lies in one cell and is not repeated. `base` is the index of its first step among all traced points,
/// `size` the number of columns and rows of cells. Returns how often a cell was entered.
pub(super) fn distribute(steps: &[Step], base: u32, size: [u32; 2], events: &mut Vec<Event>) -> u64 {
    if !steps[0].on_line() {
        let cell = steps[0].code.map(|c| c / 2);
        events.push(Event { cell, what: What::Contained { first: base, end: base + steps.len() as u32 } });
        return 1;
    }
    let mut visited = Visited::default();
    let mut k = 0;
    // The cell of the list that ended at step k.
    let mut left = None;
    while k + 1 < steps.len() {
        if let Some(sides) = slide(&steps[k], &steps[k + 1], size) {
            touch(&steps[k], base + k as u32, [left, None], size, events);
            for (cell, inside) in sides.into_iter().zip([true, false]) {
                events.extend(cell.map(|cell| Event { cell, what: What::Slide { inside } }));
            }
            if let Some(cell) = sides[0].or(sides[1]) {
                visited.enter(cell);
            }
            left = None;
            k += 1;
            continue;
        }
        let cell = cell_between(&steps[k], &steps[k + 1]);
        touch(&steps[k], base + k as u32, [left, Some(cell)], size, events);
        visited.enter(cell);
        let first = k;
        k += 1;
        while !steps[k].on_line() {
            k += 1; // ends: the last step is on a line, as the first is
        }
        events.push(Event {
            cell,
            what: What::List(CrossingList {
                first: base + first as u32,
                last: base + k as u32,
                enter: edge_of(&steps[first], cell),
                leave: edge_of(&steps[k], cell),
            }),
        });
        left = Some(cell);
    }
    // The last step is the first again, but it has its own index, which a list may end with. Each cell at it is told one
    // of the two by a list or both here; it takes the lower one.
    touch(&steps[k], base + k as u32, [left, None], size, events);
    visited.count()
}

/// Tells a point on a grid line, if it is no corner, to those cells at it that do not know it from a list.
fn touch(step: &Step, point: u32, knowing: [Option<[u32; 2]>; 2], size: [u32; 2], events: &mut Vec<Event>) {
    if step.on_corner() {
        return;
    }
    let [i, j] = step.code.map(|c| c / 2);
    let mut tell = |cell, edge| {
        if !knowing.contains(&Some(cell)) {
            events.push(Event { cell, what: What::Touch { edge, point } });
        }
    };
    if step.code[0].is_multiple_of(2) {
        if i < size[0] {
            tell([i, j], CellEdge::Left);
        }
        if i > 0 {
            tell([i - 1, j], CellEdge::Right);
        }
    } else {
        if j < size[1] {
            tell([i, j], CellEdge::Bottom);
        }
        if j > 0 {
            tell([i, j - 1], CellEdge::Top);
        }
    }
}

/// Counts visits along a closed walk.
#[derive(Default)]
struct Visited {
    first: Option<[u32; 2]>,
    now: Option<[u32; 2]>,
    count: u64,
}

impl Visited {
    fn enter(&mut self, cell: [u32; 2]) {
        if self.now != Some(cell) {
            self.count += 1;
            self.now = Some(cell);
            self.first = self.first.or(Some(cell));
        }
    }

    /// The first list and the last one, when they are in one cell, are one (the thesis merges them).
    fn count(&self) -> u64 {
        if self.count > 1 && self.first == self.now { self.count - 1 } else { self.count }
    }
}

/// Sorts events by row, then column, keeping the order of those in one cell. Linear time.
pub(super) fn sort_by_cell(events: &mut Vec<Event>, size: [u32; 2]) {
    let mut sorted = events.clone();
    for k in 0..2 {
        let mut place = vec![0_u32; size[k] as usize + 1];
        for e in events.iter() {
            place[e.cell[k] as usize + 1] += 1;
        }
        for c in 1..place.len() {
            place[c] += place[c - 1];
        }
        for e in events.iter() {
            let slot = &mut place[e.cell[k] as usize];
            sorted[*slot as usize] = *e;
            *slot += 1;
        }
        std::mem::swap(events, &mut sorted);
    }
}
