//! The mapping order (thesis 4.2.2): breadth-first levels of triangles over shared edges, found while they are flattened.
//!
//! Level 0 is the seed; level k + 1 holds the triangles that share an edge with one of level k and are in no level
//! before. [`Order`] settles the order within a level, [`Parent`] which shared edge a triangle is unfolded over: since
//! triangles are discovered in the very order in which they are processed, the discovering edge is the one to the
//! neighbour processed first, and the latest to touch a triangle before its turn is the one processed last.
//!
//! Half-edge `e` of triangle `t` has the *tag* `4 * t + e` here: a tag gives its triangle by a shift, and tags sort by
//! triangle. A border half-edge has as its neighbour the tag of a triangle that does not exist and always counts as seen.

use super::{Order, Parent};

/// Not met yet.
const UNSEEN: u8 = 0;
/// In the queue, or the triangle beyond the border.
const QUEUED: u8 = 1;
/// Flattened.
const DONE: u8 = 2;

/// The queue of one run, reused by the next.
#[derive(Debug, Clone, Default)]
pub(super) struct MappingOrder {
    /// Tags in the order of processing: the half-edge that each triangle is unfolded over.
    queue: Vec<u32>,
    queued: usize,
    seen: Vec<u8>,
    /// For `Parent::Last`: the half-edge through which each triangle was touched last.
    touched: Vec<u32>,
}

impl MappingOrder {
    /// Forgets the last run and begins with a seed.
    pub(super) fn begin(&mut self, triangles: usize, seed: u32) {
        // Each of a triangle's neighbours is written to the queue's end before it is known to be new.
        self.queue.resize(triangles + 1, 0);
        self.seen.clear();
        self.seen.resize(triangles + 1, UNSEEN);
        self.seen[triangles] = QUEUED;
        self.touched.resize(triangles + 1, 0);
        self.queue[0] = 4 * seed;
        self.queued = 1;
        self.seen[seed as usize] = QUEUED;
    }

    /// How many triangles have been discovered.
    pub(super) const fn len(&self) -> usize {
        self.queued
    }

    /// The triangles discovered, in order; those not yet processed at the end.
    pub(super) fn triangles(&self) -> impl ExactSizeIterator<Item = u32> {
        self.queue[..self.queued].iter().map(|tag| tag >> 2)
    }

    /// The tag of place `at` in the order, with the half-edge that the reading unfolds over.
    pub(super) fn tag(&mut self, at: usize, parent: Parent) -> u32 {
        let tag = self.queue[at];
        match parent {
            Parent::First => tag,
            Parent::Last => self.touched[(tag >> 2) as usize],
        }
    }

    /// Marks a triangle as flattened.
    pub(super) fn done(&mut self, triangle: u32) {
        self.seen[triangle as usize] = DONE;
    }

    /// Whether a triangle has been flattened.
    pub(super) fn is_done(&self, triangle: u32) -> bool {
        self.seen[triangle as usize] == DONE
    }

    /// A neighbour of the triangle that is being processed, by the tag of the neighbour's own half-edge.
    pub(super) fn touch(&mut self, tag: u32, parent: Parent) {
        let triangle = (tag >> 2) as usize;
        self.queue[self.queued] = tag;
        let seen = self.seen[triangle];
        self.queued += usize::from(seen == UNSEEN);
        self.seen[triangle] = seen.max(QUEUED);
        if parent == Parent::Last {
            self.touched[triangle] = tag;
        }
    }

    /// The two other neighbours of a triangle that was unfolded over `over`, in the order of its edges.
    pub(super) fn touch_pair(&mut self, over: u32, after: u32, before: u32, parent: Parent) {
        // Edges in the order 0, 1, 2: over edge 1 the previous one (0) comes before the next (2).
        let (one, two) = if over & 3 == 1 { (before, after) } else { (after, before) };
        self.touch(one, parent);
        self.touch(two, parent);
    }

    /// Brings a level that has just been discovered, `from..len()`, into order.
    pub(super) fn arrange(&mut self, from: usize, order: Order) {
        if order == Order::Index {
            self.queue[from..self.queued].sort_unstable();
        }
    }
}
