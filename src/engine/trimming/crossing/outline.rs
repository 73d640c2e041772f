//! The polylines of all loops in one array.

use std::ops::Range;

use glam::DVec2;

use crate::engine::trimming::chord::ChordPoint;

/// Loops as polylines. Segment `i` runs from point `i` to point [`Outline::next`]`(i)`.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::engine::trimming) struct Outline {
    pub(in crate::engine::trimming) points: Vec<ChordPoint>,
    /// Where each loop's points are, with the loop's index in the file. In ascending order without gaps.
    pub(in crate::engine::trimming) loops: Vec<(usize, Range<usize>)>,
    /// The points before and after each point of a closed loop.
    links: Vec<[u32; 2]>,
}

impl Outline {
    /// The loop (as a place in `loops`) that a point belongs to.
    pub(in crate::engine::trimming) fn owner(&self, point: usize) -> usize {
        self.loops.partition_point(|l| l.1.end <= point)
    }

    /// The point after a point of a closed loop.
    pub(in crate::engine::trimming) fn next(&self, point: usize) -> usize {
        self.links[point][1] as usize
    }

    /// The point before it.
    pub(in crate::engine::trimming) fn before(&self, point: usize) -> usize {
        self.links[point][0] as usize
    }

    /// Ends of segment `i`.
    pub(in crate::engine::trimming) fn segment(&self, i: usize) -> [DVec2; 2] {
        [self.points[i].uv, self.points[self.next(i)].uv]
    }

    /// Ends a loop that began at point `start`: points that repeat the one before are dropped. Loops of fewer than three
    /// points are dropped whole, and false is returned.
    pub(in crate::engine::trimming) fn close(&mut self, index: usize, start: usize) -> bool {
        let mut kept = start;
        for i in start..self.points.len() {
            let p = self.points[i];
            if kept > start && self.points[kept - 1].uv == p.uv {
                let earlier = self.points[kept - 1].corner;
                self.points[kept - 1] = ChordPoint { corner: p.corner || earlier, ..p };
            } else {
                self.points[kept] = p;
                kept += 1;
            }
        }
        while kept > start + 1 && self.points[kept - 1].uv == self.points[start].uv {
            kept -= 1;
            self.points[start].corner |= self.points[kept].corner;
        }
        let whole = kept - start >= 3;
        self.points.truncate(if whole { kept } else { start });
        if whole {
            self.loops.push((index, start..kept));
            let (first, last) = (start as u32, kept as u32 - 1);
            self.links.extend(
                (first..=last).map(|i| [if i == first { last } else { i - 1 }, if i == last { first } else { i + 1 }]),
            );
        }
        whole
    }
}
