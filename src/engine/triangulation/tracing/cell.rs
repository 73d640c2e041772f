//! The part of a region in one cell (thesis 3.4.1, 3.4.4), as directed edges for the polygon triangulation.
//!
//! The thesis joins crossing lists into polygons: after a leave point it goes on along the cell's edges, anticlockwise,
//! to the next enter point. The same rule is applied here without forming rings: the pieces of the border from each leave
//! point to the next enter point bound the region, and together with the lists and the contained loops that is all the
//! polygon triangulation asks for. So it does not matter which list is taken first, whether a contained loop is a hole or
//! an island, or how many polygons meet in a point.

use std::cmp::Ordering;

use glam::DVec2;

use super::{
    crossings::{CellEdge, CrossingList, Event, What},
    walk::Step,
};
use crate::engine::triangulation::polygon::orientation;

const EDGES: [CellEdge; 4] = [CellEdge::Bottom, CellEdge::Right, CellEdge::Top, CellEdge::Left];

/// Where a vertex of a cell's region comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// The cell's corner of this number, anticlockwise from the lower left.
    Corner(u8),
    /// The traced point of this index.
    Point(u32),
}

/// What is to be done in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// Nothing of the region is in it.
    Outside,
    /// All of it is inside, and no edge carries a point: two triangles.
    Whole,
    /// The region is bounded by the edges collected.
    Polygon,
}

/// One end of a crossing list.
#[derive(Debug, Clone, Copy)]
struct End {
    /// Vertex of the border.
    at: u32,
    /// The loop comes into the cell here.
    enters: bool,
    /// The list's point next to it.
    toward: DVec2,
}

/// The region in one cell. Its memory is kept from cell to cell.
#[derive(Debug, Default)]
pub(super) struct CellRegion {
    pub(super) points: Vec<DVec2>,
    pub(super) sources: Vec<Source>,
    pub(super) edges: Vec<[u32; 2]>,
    ends: Vec<End>,
    /// Points on the cell's edges, several at one place among them.
    touches: Vec<(CellEdge, u32)>,
    /// Number of vertices on the border; they come first, anticlockwise from the lower left corner.
    border: u32,
    /// The border's vertex at which each cell edge begins.
    corners: [u32; 4],
}

impl CellRegion {
    /// Collects the region in `cell` from its events.
    ///
    /// `corners` are the cell's, anticlockwise from the lower left; `left_inside` says whether the region lies just to
    /// the left of the cell. The second result is the right-edge check (thesis 3.4.2): whether the region lies inside the
    /// cell along its right edge, so that cells up to the next event are inside as well.
    ///
    /// # Errors
    /// Index of a traced point at which the lists do not fit together.
    pub(super) fn collect(
        &mut self,
        steps: &[Step],
        corners: [DVec2; 4],
        cell: [u32; 2],
        events: &[Event],
        left_inside: bool,
    ) -> Result<(Shape, bool), u32> {
        let mut slides = 0_i32;
        let (mut lists, mut contained) = (0, 0);
        self.touches.clear();
        for event in events {
            match event.what {
                What::List(list) => {
                    lists += 1;
                    let ends = [(list.enter, list.first), (list.leave, list.last)];
                    self.touches.extend(ends.into_iter().filter(|&(_, point)| !steps[point as usize].on_corner()));
                }
                What::Contained { .. } => contained += 1,
                What::Touch { edge, point } => self.touches.push((edge, point)),
                What::Slide { inside } => slides += if inside { 1 } else { -1 },
            }
        }
        // Without a list the whole border has one status. A slide knows it (two against each other cancel: a slit);
        // else it is that of the cell to the left.
        let status = if slides == 0 { left_inside } else { slides > 0 };
        if lists == 0 && contained == 0 {
            if !status {
                return Ok((Shape::Outside, false));
            }
            if self.touches.is_empty() {
                return Ok((Shape::Whole, true));
            }
        }
        self.lay_border(steps, corners);
        let mut right_inside = status;
        if lists > 0 {
            right_inside = self.cut_border(steps, cell, events)?;
        } else if status {
            self.edges.extend((0..self.border).map(|b| [b, (b + 1) % self.border]));
        }
        for event in events {
            match event.what {
                What::List(list) => self.add_list(steps, cell, &list)?,
                What::Contained { first, end } => self.add_loop(steps, first..end),
                _ => {}
            }
        }
        Ok((Shape::Polygon, right_inside))
    }

    /// Puts the border's vertices first: corners and the points on each edge, in order, each place once.
    fn lay_border(&mut self, steps: &[Step], corners: [DVec2; 4]) {
        self.points.clear();
        self.sources.clear();
        self.edges.clear();
        let at = |point: u32| steps[point as usize].at;
        self.touches.sort_unstable_by(|&(e, p), &(f, q)| e.cmp(&f).then(order_along(e, at(p), at(q))).then(p.cmp(&q)));
        let mut touches = self.touches.iter().peekable();
        for (k, edge) in EDGES.into_iter().enumerate() {
            self.corners[k] = self.points.len() as u32;
            self.points.push(corners[k]);
            self.sources.push(Source::Corner(k as u8));
            while let Some(&(_, point)) = touches.next_if(|t| t.0 == edge) {
                if self.points.last() != Some(&at(point)) {
                    self.points.push(at(point));
                    self.sources.push(Source::Point(point));
                }
            }
        }
        self.border = self.points.len() as u32;
    }

    /// The border's vertex at an end of a list.
    fn border_vertex(&self, step: &Step, edge: CellEdge, cell: [u32; 2]) -> Option<u32> {
        if step.on_corner() {
            let corner = match [0, 1].map(|k| step.code[k] / 2 - cell[k]) {
                [0, 0] => 0,
                [1, 0] => 1,
                [1, 1] => 2,
                _ => 3,
            };
            return Some(self.corners[corner]);
        }
        let first = self.corners[edge as usize] + 1;
        let end = self.corners.get(edge as usize + 1).map_or(self.border, |&c| c);
        let on_edge = &self.points[first as usize..end as usize];
        let k = on_edge.partition_point(|&p| order_along(edge, p, step.at).is_lt());
        (on_edge.get(k) == Some(&step.at)).then_some(first + k as u32)
    }

    /// Adds the pieces of the border from each leave point to the next enter point. Returns whether the right edge's
    /// first piece is among them; when the next cell has no event, the edge is one piece.
    fn cut_border(&mut self, steps: &[Step], cell: [u32; 2], events: &[Event]) -> Result<bool, u32> {
        self.ends.clear();
        for event in events {
            let What::List(list) = event.what else { continue };
            for (enters, point, edge, beside) in
                [(true, list.first, list.enter, list.first + 1), (false, list.last, list.leave, list.last - 1)]
            {
                let at = self.border_vertex(&steps[point as usize], edge, cell).ok_or(point)?;
                self.ends.push(End { at, enters, toward: steps[beside as usize].at });
            }
        }
        // At one vertex: anticlockwise from the border's direction after it.
        let points = &self.points;
        self.ends.sort_by(|a, b| {
            let turn = || orientation(points[a.at as usize], a.toward, b.toward);
            a.at.cmp(&b.at).then_with(|| 0.0.partial_cmp(&turn()).unwrap_or(Ordering::Equal))
        });
        let Some(last) = self.ends.last() else { return Ok(false) };
        let first_of_last = self.ends.partition_point(|e| e.at < last.at);
        let mut inside = !self.ends[first_of_last].enters;
        let mut right_inside = false;
        let mut ends = self.ends.as_slice();
        for b in 0..self.border {
            let (here, rest) = ends.split_at(ends.partition_point(|e| e.at == b));
            ends = rest;
            for end in here.iter().rev() {
                if end.enters != inside {
                    return Err(self.any_point(b, events));
                }
                inside = !inside;
            }
            if inside {
                self.edges.push([b, (b + 1) % self.border]);
            }
            if b == self.corners[CellEdge::Right as usize] {
                right_inside = inside;
            }
        }
        Ok(right_inside)
    }

    /// A traced point to name in an error at border vertex `b`.
    fn any_point(&self, b: u32, events: &[Event]) -> u32 {
        match self.sources[b as usize] {
            Source::Point(point) => point,
            Source::Corner(_) => {
                events.iter().find_map(|e| if let What::List(l) = e.what { Some(l.first) } else { None }).unwrap_or(0)
            }
        }
    }

    /// Adds the edges of a crossing list.
    fn add_list(&mut self, steps: &[Step], cell: [u32; 2], list: &CrossingList) -> Result<(), u32> {
        let end = |point: u32, edge| self.border_vertex(&steps[point as usize], edge, cell).ok_or(point);
        let (mut before, last) = (end(list.first, list.enter)?, end(list.last, list.leave)?);
        for point in list.first + 1..list.last {
            let vertex = self.add_point(steps, point);
            self.edges.push([before, vertex]);
            before = vertex;
        }
        self.edges.push([before, last]);
        Ok(())
    }

    /// Adds the edges of a contained loop.
    fn add_loop(&mut self, steps: &[Step], points: std::ops::Range<u32>) {
        let first = self.points.len() as u32;
        let count = points.len() as u32;
        for point in points {
            self.add_point(steps, point);
        }
        self.edges.extend((0..count).map(|k| [first + k, first + (k + 1) % count]));
    }

    fn add_point(&mut self, steps: &[Step], point: u32) -> u32 {
        self.points.push(steps[point as usize].at);
        self.sources.push(Source::Point(point));
        self.points.len() as u32 - 1
    }
}

/// The order of two points on a cell edge, anticlockwise.
fn order_along(edge: CellEdge, p: DVec2, q: DVec2) -> Ordering {
    match edge {
        CellEdge::Bottom => p.x.total_cmp(&q.x),
        CellEdge::Right => p.y.total_cmp(&q.y),
        CellEdge::Top => q.x.total_cmp(&p.x),
        CellEdge::Left => q.y.total_cmp(&p.y),
    }
}
