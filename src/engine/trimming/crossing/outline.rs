//! The polylines of all loops in one array, and a tree of boxes over their segments.
//!
//! Consecutive segments of a polyline are neighbours in the plane, so the array itself is a good order for a tree: leaves
//! are runs of [`LEAF`] segments, each node above joins two. Nothing is sorted, and pairs of segments whose boxes meet
//! are found in about `O(n log n)` for loops as parts have them.

use std::ops::Range;

use glam::DVec2;

use crate::engine::trimming::chord::ChordPoint;

/// Segments in a leaf: few enough to compare each with each, enough to keep the tree small.
const LEAF: usize = 4;

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

/// The least and greatest corner of a box.
pub(in crate::engine::trimming) type Box2 = [DVec2; 2];

/// Whether two boxes have a point in common.
pub(in crate::engine::trimming) fn meet(a: &Box2, b: &Box2) -> bool {
    a[0].cmple(b[1]).all() && b[0].cmple(a[1]).all()
}

/// A tree of boxes over segments.
pub(in crate::engine::trimming) struct Tree {
    /// Boxes of the segments.
    segments: Vec<Box2>,
    /// Boxes of the nodes, level by level, leaves first.
    nodes: Vec<Box2>,
    /// Where each level begins in `nodes`.
    levels: Vec<Range<usize>>,
}

impl Tree {
    /// Builds the tree over boxes of segments.
    pub(in crate::engine::trimming) fn new(segments: Vec<Box2>) -> Self {
        let join =
            |boxes: &[Box2]| boxes.iter().skip(1).fold(boxes[0], |[low, high], b| [low.min(b[0]), high.max(b[1])]);
        let mut nodes: Vec<Box2> = Vec::with_capacity(segments.len());
        nodes.extend(segments.chunks(LEAF).map(join));
        let mut level = 0..nodes.len();
        let mut levels = Vec::from([level.clone()]);
        while level.len() > 1 {
            let start = nodes.len();
            for i in level.clone().step_by(2) {
                let node = join(&nodes[i..(i + 2).min(level.end)]);
                nodes.push(node);
            }
            level = start..nodes.len();
            levels.push(level.clone());
        }
        Self { segments, nodes, levels }
    }

    /// Calls `visit(i, j)` with `i < j` for every pair of segments whose boxes meet, in a fixed order, until it returns
    /// false.
    pub(in crate::engine::trimming) fn pairs(&self, mut visit: impl FnMut(usize, usize) -> bool) {
        let top = self.levels.len() - 1;
        if self.nodes.is_empty() {
            return;
        }
        let mut open = vec![(top, 0_usize, 0_usize)];
        // Both nodes of a pair are of one level; a node with itself stands for the pairs within it.
        while let Some((level, a, b)) = open.pop() {
            let base = self.levels[level].start;
            if a != b && !meet(&self.nodes[base + a], &self.nodes[base + b]) {
                continue;
            }
            if level > 0 {
                let below = self.levels[level - 1].len();
                for x in [2 * a + 1, 2 * a] {
                    for y in [2 * b + 1, 2 * b] {
                        if x < below && y < below && (a != b || x <= y) {
                            open.push((level - 1, x, y));
                        }
                    }
                }
                continue;
            }
            let run = |leaf: usize| leaf * LEAF..((leaf + 1) * LEAF).min(self.segments.len());
            for i in run(a) {
                for j in if a == b { i + 1..run(b).end } else { run(b) } {
                    if meet(&self.segments[i], &self.segments[j]) && !visit(i, j) {
                        return;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn the_tree_finds_every_pair_of_boxes_that_meet_once(
            corners in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, 0.0..0.2_f64, 0.0..0.2_f64), 0..60),
        ) {
            let boxes: Vec<Box2> =
                corners.iter().map(|&(x, y, w, h)| [DVec2::new(x, y), DVec2::new(x + w, y + h)]).collect();
            let mut found = Vec::new();
            Tree::new(boxes.clone()).pairs(|i, j| {
                found.push((i, j));
                true
            });
            found.sort_unstable();
            let all = (0..boxes.len()).flat_map(|i| (i + 1..boxes.len()).map(move |j| (i, j)));
            let known: Vec<_> = all.filter(|&(i, j)| meet(&boxes[i], &boxes[j])).collect();
            prop_assert_eq!(found, known);
        }
    }
}
