//! A tree of boxes over segments in the plane.
//!
//! Consecutive segments of a polyline are neighbours in the plane, so their own order is a good one for a tree: leaves
//! are runs of [`LEAF`] segments, each node above joins two. Nothing is sorted, and pairs of segments whose boxes meet
//! are found in about `O(n log n)` for borders as parts have them.

use std::ops::Range;

use glam::DVec2;

/// Segments in a leaf: few enough to compare each with each, enough to keep the tree small.
const LEAF: usize = 4;

/// The least and greatest corner of a box.
pub(in crate::engine) type Box2 = [DVec2; 2];

/// Whether two boxes have a point in common.
pub(in crate::engine) fn meet(a: &Box2, b: &Box2) -> bool {
    a[0].cmple(b[1]).all() && b[0].cmple(a[1]).all()
}

/// A tree of boxes over segments.
pub(in crate::engine) struct Tree {
    /// Boxes of the segments.
    segments: Vec<Box2>,
    /// Boxes of the nodes, level by level, leaves first.
    nodes: Vec<Box2>,
    /// Where each level begins in `nodes`.
    levels: Vec<Range<usize>>,
}

impl Tree {
    /// Builds the tree over boxes of segments.
    pub(in crate::engine) fn new(segments: Vec<Box2>) -> Self {
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
    pub(in crate::engine) fn pairs(&self, mut visit: impl FnMut(usize, usize) -> bool) {
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

    /// Calls `visit(i)` for every segment whose box meets the half-line from `p` towards +x, in ascending order.
    pub(in crate::engine) fn to_the_right(&self, p: DVec2, mut visit: impl FnMut(usize)) {
        let meets = |b: &Box2| b[0].y <= p.y && p.y <= b[1].y && b[1].x >= p.x;
        if self.nodes.is_empty() {
            return;
        }
        let mut open = vec![(self.levels.len() - 1, 0_usize)];
        while let Some((level, a)) = open.pop() {
            if !meets(&self.nodes[self.levels[level].start + a]) {
                continue;
            }
            if level > 0 {
                let below = self.levels[level - 1].len();
                open.extend([2 * a + 1, 2 * a].into_iter().filter(|&x| x < below).map(|x| (level - 1, x)));
            } else {
                let run = a * LEAF..((a + 1) * LEAF).min(self.segments.len());
                run.filter(|&i| meets(&self.segments[i])).for_each(&mut visit);
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

        #[test]
        fn the_tree_finds_every_box_to_the_right_of_a_point(
            corners in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, 0.0..0.2_f64, 0.0..0.2_f64), 0..60),
            at in (0.0..1.0_f64, 0.0..1.0_f64),
        ) {
            let boxes: Vec<Box2> =
                corners.iter().map(|&(x, y, w, h)| [DVec2::new(x, y), DVec2::new(x + w, y + h)]).collect();
            let mut found = Vec::new();
            Tree::new(boxes.clone()).to_the_right(at.into(), |i| found.push(i));
            let right = |b: &Box2| b[1].x >= at.0 && b[0].y <= at.1 && at.1 <= b[1].y;
            let known: Vec<_> = (0..boxes.len()).filter(|&i| right(&boxes[i])).collect();
            prop_assert_eq!(found, known);
        }
    }
}
