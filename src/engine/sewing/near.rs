//! What lies near a point: a tree of boxes over segments in space.
//!
//! Segments that follow each other in a list are taken to be neighbours, as those of borders are: a leaf is a run of them,
//! each node above joins two. Nothing is sorted.

use glam::DVec3;

/// Segments in a leaf.
const LEAF: usize = 8;

/// A segment of a face's border; a single point where both ends are the same.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    /// Its ends, mm.
    pub ends: [DVec3; 2],
    /// The face.
    pub face: u32,
    /// What it is of that: a vertex, or an edge of the border.
    pub of: u32,
    /// Where on the edge its ends are.
    pub s: [f64; 2],
}

impl Segment {
    /// Where along it, 0 to 1, the point nearest to `p` is, and the distance.
    pub(super) fn nearest(&self, p: DVec3) -> (f64, f64) {
        let [a, b] = self.ends;
        let along = b - a;
        let length = along.length_squared();
        let t = if length > 0.0 { ((p - a).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        (t, p.distance(a + along * t))
    }
}

/// The tree.
pub(super) struct Near {
    segments: Vec<Segment>,
    /// Boxes level by level, leaves first.
    levels: Vec<Vec<[DVec3; 2]>>,
}

impl Near {
    pub(super) fn new(segments: Vec<Segment>) -> Self {
        let join = |boxes: &[[DVec3; 2]]| {
            boxes.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], b| [low.min(b[0]), high.max(b[1])])
        };
        let of_segment = |s: &Segment| [s.ends[0].min(s.ends[1]), s.ends[0].max(s.ends[1])];
        let leaf = |run: &[Segment]| join(&run.iter().map(of_segment).collect::<Vec<_>>());
        let mut levels: Vec<Vec<[DVec3; 2]>> = vec![segments.chunks(LEAF).map(leaf).collect()];
        while let Some(last) = levels.last()
            && last.len() > 1
        {
            let above = last.chunks(2).map(join).collect();
            levels.push(above);
        }
        Self { segments, levels }
    }

    /// Calls `visit` for every segment whose box comes within `reach` of `p`, in the order of the list.
    pub(super) fn within(&self, p: DVec3, reach: f64, mut visit: impl FnMut(&Segment)) {
        let top = self.levels.len() - 1;
        let mut open = vec![(top, 0)];
        while let Some((level, k)) = open.pop() {
            let Some(&[low, high]) = self.levels[level].get(k) else { continue };
            if p.distance_squared(p.clamp(low, high)) > reach * reach {
                continue;
            }
            if level > 0 {
                open.extend([(level - 1, 2 * k + 1), (level - 1, 2 * k)]);
                continue;
            }
            self.segments[k * LEAF..((k + 1) * LEAF).min(self.segments.len())].iter().for_each(&mut visit);
        }
    }
}
