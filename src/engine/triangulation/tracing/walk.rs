//! Walks a loop from cell to cell (thesis 3.3.3) and gives the points at which it meets the grid's lines.
//!
//! A place is described along each axis by a *code*: 2 i on line i exactly, 2 i + 1 strictly between lines i and i + 1.
//! Whether a segment leaves the present cell is then a comparison of its end's codes with the cell's, the thesis's check
//! "is the end point right of the edge", one dimension at a time. An end beyond a corner is right of two edges: the one
//! with the smaller parameter is crossed; equal parameters are the corner, and the walk goes on in the diagonal cell.
//!
//! A crossing takes the line's coordinate bit for bit and is computed once for both cells. It is held between the last
//! point and the segment's end, and within the cell, so rounding can never lead the walk astray. What comes within
//! [`SNAP`] of a line is put on it: without that, loops meant to run along lines leave slivers some ulps wide.

use glam::DVec2;

use crate::engine::{nurbs::Domain, triangulation::GridLines};

/// Points nearer to a grid line than this fraction of the domain are put on it. Larger moves the boundary visibly (the
/// region's area must hold to 1e-10); smaller leaves triangles so thin that their normals in space are noise.
const SNAP: f64 = 2e-11;

/// ... but never farther than this fraction of the narrowest cell.
const SNAP_IN_CELL: f64 = 1e-3;

/// A point of a loop on the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub(super) at: DVec2,
    pub(super) code: [u32; 2],
}

impl Step {
    /// True on a grid line.
    pub(super) const fn on_line(&self) -> bool {
        self.code[0].is_multiple_of(2) || self.code[1].is_multiple_of(2)
    }

    /// True where grid lines cross.
    pub(super) const fn on_corner(&self) -> bool {
        self.code[0].is_multiple_of(2) && self.code[1].is_multiple_of(2)
    }
}

/// The lines of one axis.
struct Axis<'a> {
    lines: &'a [f64],
    snap: f64,
}

impl<'a> Axis<'a> {
    fn new(lines: &'a [f64], [first, last]: [f64; 2]) -> Self {
        let narrowest = lines.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        Self { lines, snap: (SNAP * (last - first)).min(SNAP_IN_CELL * narrowest) }
    }

    /// Coordinate and code of `x`, looking from cell `near` onwards. `None` when it lies outside the lines.
    fn locate(&self, x: f64, near: usize) -> Option<(f64, u32)> {
        let lines = self.lines;
        let mut i = near.min(lines.len() - 2);
        while i + 2 < lines.len() && x >= lines[i + 1] {
            i += 1;
        }
        while i > 0 && x < lines[i] {
            i -= 1;
        }
        if (x - lines[i]).abs() <= self.snap {
            Some((lines[i], 2 * i as u32))
        } else if (lines[i + 1] - x).abs() <= self.snap {
            Some((lines[i + 1], 2 * i as u32 + 2))
        } else {
            (lines[i] < x && x < lines[i + 1]).then_some((x, 2 * i as u32 + 1))
        }
    }

    /// The next line on the way from code `from` to code `to`, if there is one strictly before `to`.
    const fn next_line(from: u32, to: u32) -> Option<u32> {
        if to > from {
            let line = from / 2 + 1;
            if 2 * line < to { Some(line) } else { None }
        } else if to < from {
            let line = (from - 1) / 2;
            if 2 * line > to { Some(line) } else { None }
        } else {
            None
        }
    }

    /// Coordinate and code of a point computed as `x` between the places `from` and `to`, with no line between it and
    /// `from`.
    fn between(&self, x: f64, from: (f64, u32), to: (f64, u32)) -> (f64, u32) {
        if from.1 == to.1 {
            return if from.1.is_multiple_of(2) { from } else { (x.clamp(from.0.min(to.0), from.0.max(to.0)), from.1) };
        }
        let up = to.1 > from.1;
        let line = if up { from.1 / 2 + 1 } else { (from.1 - 1) / 2 };
        let ahead = self.lines[line as usize];
        let x = if up { x.clamp(from.0, to.0.min(ahead)) } else { x.clamp(to.0.max(ahead), from.0) };
        if (x - ahead).abs() <= self.snap {
            (ahead, 2 * line)
        } else if from.1.is_multiple_of(2) && (x - from.0).abs() <= self.snap {
            from
        } else {
            (x, if up { from.1 | 1 } else { (from.1 - 1) | 1 })
        }
    }
}

/// The grid that loops are walked through.
pub(super) struct Walker<'a> {
    axes: [Axis<'a>; 2],
}

impl<'a> Walker<'a> {
    /// For lines that are strictly increasing, at least two along each axis.
    pub(super) fn new(lines: &'a GridLines) -> Self {
        let Domain { u, v } = lines.domain();
        Self { axes: [Axis::new(&lines.u, u), Axis::new(&lines.v, v)] }
    }

    /// The step at a loop's first point: the only search of a whole axis.
    pub(super) fn start(&self, p: DVec2) -> Option<Step> {
        let near = [0, 1].map(|k| self.axes[k].lines.partition_point(|&line| line <= p[k]).saturating_sub(1));
        self.locate(p, near)
    }

    /// The step at a point, searched from the step before it.
    pub(super) fn follow(&self, p: DVec2, before: &Step) -> Option<Step> {
        self.locate(p, before.code.map(|c| (c / 2) as usize))
    }

    fn locate(&self, p: DVec2, near: [usize; 2]) -> Option<Step> {
        let (u, cu) = self.axes[0].locate(p.x, near[0])?;
        let (v, cv) = self.axes[1].locate(p.y, near[1])?;
        Some(Step { at: DVec2::new(u, v), code: [cu, cv] })
    }

    /// Appends the crossings of the segment between two steps, and its end, to `path`. Two steps at one place give none.
    pub(super) fn segment(&self, start: Step, end: Step, path: &mut Vec<Step>) {
        if start.at == end.at {
            return;
        }
        let mut now = start;
        loop {
            let next = [0, 1].map(|k| Axis::next_line(now.code[k], end.code[k]));
            let parameter = [0, 1].map(|k| {
                let line = next[k].map(|line| self.axes[k].lines[line as usize]);
                line.map_or(f64::INFINITY, |x| (x - start.at[k]) / (end.at[k] - start.at[k]))
            });
            let crossed = match (next[0], next[1]) {
                (None, None) => break,
                (Some(i), Some(j)) if parameter[0] == parameter[1] => {
                    let [u, v] = [self.axes[0].lines[i as usize], self.axes[1].lines[j as usize]];
                    Step { at: DVec2::new(u, v), code: [2 * i, 2 * j] }
                }
                (Some(i), _) if parameter[0] < parameter[1] => self.cross(0, i, parameter[0], [&start, &now, &end]),
                (_, Some(j)) => self.cross(1, j, parameter[1], [&start, &now, &end]),
                (Some(i), None) => self.cross(0, i, parameter[0], [&start, &now, &end]),
            };
            path.push(crossed);
            now = crossed;
        }
        path.push(end);
    }

    /// The crossing of a segment with line `line` of axis `k` at parameter `t`, seen from the present step.
    fn cross(&self, k: usize, line: u32, t: f64, [start, now, end]: [&Step; 3]) -> Step {
        let other = 1 - k;
        let along = start.at[other] + t * (end.at[other] - start.at[other]);
        let place = |step: &Step| (step.at[other], step.code[other]);
        let (x, code) = self.axes[other].between(along, place(now), place(end));
        let mut crossed = *now;
        crossed.at[k] = self.axes[k].lines[line as usize];
        crossed.code[k] = 2 * line;
        crossed.at[other] = x;
        crossed.code[other] = code;
        crossed
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn lines() -> GridLines {
        GridLines { u: vec![0.0, 1.0, 2.5, 3.0, 7.0], v: vec![-1.0, 0.0, 0.5, 4.0] }
    }

    fn path(from: (f64, f64), to: (f64, f64)) -> Vec<Step> {
        let lines = lines();
        let walker = Walker::new(&lines);
        let start = walker.start(from.into()).unwrap();
        let end = walker.follow(to.into(), &start).unwrap();
        let mut path = vec![start];
        walker.segment(start, end, &mut path);
        path
    }

    fn codes(path: &[Step]) -> Vec<[u32; 2]> {
        path.iter().map(|s| s.code).collect()
    }

    #[test]
    fn an_end_beyond_a_corner_crosses_the_nearer_line_first() {
        assert_eq!(codes(&path((0.5, -0.5), (1.2, 0.1))), [[1, 1], [2, 1], [3, 2], [3, 3]]);
        assert_eq!(codes(&path((0.5, -0.5), (1.1, 0.2))), [[1, 1], [1, 2], [2, 3], [3, 3]]);
    }

    #[test]
    fn equal_parameters_are_the_corner() {
        assert_eq!(codes(&path((0.5, -0.5), (1.25, 0.25))), [[1, 1], [2, 2], [3, 3]]);
        assert_eq!(codes(&path((1.25, 0.25), (0.5, -0.5))), [[3, 3], [2, 2], [1, 1]]);
    }

    #[test]
    fn touching_a_line_is_not_crossing_it() {
        assert_eq!(codes(&path((0.5, -0.5), (1.0, -0.25))), [[1, 1], [2, 1]]);
        assert_eq!(codes(&path((1.0, -0.25), (0.5, -0.5))), [[2, 1], [1, 1]]);
        assert_eq!(codes(&path((0.0, 0.0), (1.0, 0.5))), [[0, 2], [2, 4]]);
    }

    #[test]
    fn a_walk_along_a_line_stops_at_its_corners() {
        assert_eq!(codes(&path((7.0, 0.5), (0.5, 0.5))), [[8, 4], [6, 4], [4, 4], [2, 4], [1, 4]]);
    }

    #[test]
    fn what_is_within_a_hair_of_a_line_is_put_on_it() {
        let hair = 1e-12;
        let p = path((1.0 - hair, 0.5 + hair), (2.0, 0.5 - hair));
        assert_eq!(codes(&p), [[2, 4], [3, 4]]);
        assert_eq!(p[0].at, DVec2::new(1.0, 0.5));
        let lines = lines();
        let walker = Walker::new(&lines);
        assert!(walker.start(DVec2::new(-hair, 0.0)).is_some());
        assert!(walker.start(DVec2::new(-0.1, 0.0)).is_none());
        assert!(walker.start(DVec2::new(f64::NAN, 0.0)).is_none());
    }

    proptest! {
        #[test]
        fn every_part_of_a_walk_lies_in_one_cell_and_on_the_segment(
            from in (0.0..=7.0_f64, -1.0..=4.0_f64), to in (0.0..=7.0_f64, -1.0..=4.0_f64), coarse in any::<bool>()
        ) {
            let round = |p: (f64, f64)| if coarse { ((p.0 * 2.0).round() / 2.0, (p.1 * 2.0).round() / 2.0) } else { p };
            let (from, to) = (round(from), round(to));
            let p = path(from, to);
            for w in p.windows(2) {
                for k in 0..2 {
                    let (a, b) = (w[0].code[k].min(w[1].code[k]), w[0].code[k].max(w[1].code[k]));
                    prop_assert!(b - a <= if a % 2 == 0 { 2 } else { 1 }, "more than a cell");
                }
            }
            let (a, b) = (DVec2::from(from), DVec2::from(to));
            for s in &p {
                let off = if a == b { (s.at - a).length() } else { (b - a).perp_dot(s.at - a).abs() / (b - a).length() };
                prop_assert!(off < 1e-9);
            }
        }
    }
}
