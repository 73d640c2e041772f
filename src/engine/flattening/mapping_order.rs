//! The mapping order (thesis 4.2.2): breadth-first levels of triangles over shared edges, found while they are flattened.
//!
//! Level 0 is the seed; level k + 1 holds the triangles that share an edge with one of level k and are in no level
//! before. [`Order`] settles the order within a level, [`Parent`] which shared edge a triangle is unfolded over: since
//! triangles are discovered in the very order in which they are processed, the discovering edge is the one to the
//! neighbour processed first, and the latest to touch a triangle before its turn is the one processed last.
//!
//! Half-edge `e` of triangle `t` has the *tag* `4 * t + e` here: a tag gives its triangle by a shift, and tags sort by
//! triangle. A border half-edge has as its neighbour the tag of a triangle that does not exist and always counts as seen.

use std::ops::Range;

use super::{Order, Parent};

/// A triangle that has not been met.
const UNSEEN: u8 = 0;
/// Bit of one that is in the queue or has been taken from it, or that lies beyond the border.
const SEEN: u8 = 1;
/// Bit of one that is known to have been taken.
const DONE: u8 = 2;

/// Moves that the insertion sort of a level may make, for each triangle of it. Levels come nearly sorted on grids (a
/// move or two for each triangle at most), and then nothing is faster; a level that needs more is left to the library.
const MOVES: usize = 8;

/// Memory of the mapping order, reused by the next run.
#[derive(Debug, Clone, Default)]
pub(super) struct MappingOrder {
    /// Tags in the order of processing: the half-edge that each triangle is unfolded over.
    queue: Vec<u32>,
    queued: usize,
    /// [`UNSEEN`], or the bits [`SEEN`] and [`DONE`], for each triangle.
    seen: Vec<u8>,
    /// How many triangles of the queue are marked as done: they are marked when someone asks.
    marked: usize,
    /// For `Parent::Last`: the half-edge through which each triangle was touched last.
    touched: Vec<u32>,
}

impl MappingOrder {
    /// Forgets the last run and begins with a seed.
    pub(super) fn begin(&mut self, triangles: usize, seed: u32) {
        // A triangle's neighbours are written to the queue's end before it is known whether they are new.
        self.queue.resize(triangles + 1, 0);
        self.seen.clear();
        self.seen.resize(triangles + 1, UNSEEN);
        self.seen[triangles] = SEEN;
        self.touched.resize(triangles + 1, 0);
        self.queue[0] = 4 * seed;
        self.queued = 1;
        self.seen[seed as usize] = SEEN;
        self.marked = 0;
    }

    /// The order while triangles are processed; [`MappingOrder::end`] keeps how far it came.
    pub(super) fn walk(&mut self) -> Walk<'_> {
        let Self { queue, seen, touched, queued, marked } = self;
        Walk { queue, seen, touched, queued: *queued, marked }
    }

    /// Keeps how far a walk came.
    pub(super) const fn end(&mut self, queued: usize) {
        self.queued = queued;
    }

    /// How many triangles have been discovered.
    pub(super) const fn len(&self) -> usize {
        self.queued
    }

    /// The triangles at these places of the order; those not yet processed are at its end.
    pub(super) fn triangles(&self, places: Range<usize>) -> impl ExactSizeIterator<Item = u32> {
        self.queue[..self.queued][places].iter().map(|tag| tag >> 2)
    }

    /// Brings a level that has just been discovered, `from..len()`, into order.
    pub(super) fn arrange(&mut self, from: usize, order: Order) {
        if order == Order::Index {
            sort_nearly_sorted(&mut self.queue[from..self.queued]);
        }
    }
}

/// The mapping order while triangles are processed: slices and a counter, which a loop keeps in registers.
pub(super) struct Walk<'a> {
    queue: &'a mut [u32],
    seen: &'a mut [u8],
    touched: &'a mut [u32],
    queued: usize,
    marked: &'a mut usize,
}

impl Walk<'_> {
    /// Asks which triangles have been taken, when the first `taken` of the order have. Askers of one run must not go
    /// back in the order; all of them together take no longer than the run.
    #[inline]
    pub(super) fn record(&mut self, taken: usize) -> Record<'_> {
        Record { taken: &self.queue[..taken], seen: self.seen, marked: self.marked }
    }

    /// How many triangles have been discovered.
    #[inline]
    pub(super) const fn len(&self) -> usize {
        self.queued
    }

    /// The triangle at one place of the order: the tag of the half-edge that it is unfolded over.
    #[inline]
    pub(super) fn tag(&self, at: usize, parent: Parent) -> u32 {
        let tag = self.queue[at];
        match parent {
            Parent::First => tag,
            Parent::Last => self.touched[(tag >> 2) as usize],
        }
    }

    /// The tag that stands at a place now: the right one where that level has been arranged.
    #[inline]
    pub(super) fn peek(&self, at: usize) -> Option<u32> {
        self.queue.get(at).copied()
    }

    /// Meets two neighbours of the triangle that is being processed, by the tags of their own half-edges.
    #[inline]
    pub(super) fn touch(&mut self, [one, two]: [u32; 2], parent: Parent) {
        for tag in [one, two] {
            let triangle = (tag >> 2) as usize;
            // Written before it is known whether it is new: a branch would be guessed wrongly half of the time.
            self.queue[self.queued] = tag;
            self.queued += usize::from(self.seen[triangle] == UNSEEN);
            self.seen[triangle] |= SEEN;
            if parent == Parent::Last {
                self.touched[triangle] = tag;
            }
        }
    }
}

/// Which triangles have been taken.
pub(super) struct Record<'a> {
    taken: &'a [u32],
    seen: &'a mut [u8],
    marked: &'a mut usize,
}

impl Record<'_> {
    /// Whether a triangle has been taken.
    pub(super) fn is_done(&mut self, triangle: u32) -> bool {
        for tag in &self.taken[*self.marked..] {
            self.seen[(tag >> 2) as usize] |= DONE;
        }
        *self.marked = self.taken.len();
        self.seen[triangle as usize] & DONE != 0
    }
}

/// Insertion sort as long as there is little to move.
fn sort_nearly_sorted(tags: &mut [u32]) {
    let mut moves = MOVES * tags.len();
    let mut greatest = 0;
    for i in 0..tags.len() {
        let tag = tags[i];
        if tag >= greatest {
            greatest = tag;
            continue;
        }
        let mut j = i;
        while j > 0 && tags[j - 1] > tag {
            tags[j] = tags[j - 1];
            j -= 1;
        }
        tags[j] = tag;
        let moved = i - j;
        if moved > moves {
            tags.sort_unstable();
            return;
        }
        moves -= moved;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn levels_are_sorted_however_they_come(mut tags in prop::collection::vec(0..5000_u32, 0..400)) {
            let mut expected = tags.clone();
            expected.sort_unstable();
            sort_nearly_sorted(&mut tags);
            prop_assert_eq!(tags, expected);
        }

        #[test]
        fn nearly_sorted_levels_are_sorted(swaps in prop::collection::vec((0..90_usize, 1..9_usize), 0..200)) {
            let mut tags: Vec<u32> = (0..100).collect();
            for (i, by) in swaps {
                tags.swap(i, i + by);
            }
            sort_nearly_sorted(&mut tags);
            prop_assert_eq!(tags, (0..100).collect::<Vec<u32>>());
        }
    }

    #[test]
    fn a_strip_is_walked_in_both_directions_and_ends_at_its_borders() {
        // Three triangles in a row; the tag 4 * 3 stands for what lies beyond the border.
        let mut order = MappingOrder::default();
        order.begin(3, 1);
        let mut walk = order.walk();
        assert_eq!(walk.tag(0, Parent::First), 4);
        walk.touch([10, 12], Parent::First);
        walk.touch([12, 1], Parent::First);
        let queued = walk.len();
        order.end(queued);
        assert_eq!(order.len(), 3);
        order.arrange(1, Order::Index);
        let mut walk = order.walk();
        assert_eq!([walk.tag(1, Parent::First), walk.tag(2, Parent::First)], [1, 10]);
        walk.touch([12, 4], Parent::First);
        assert_eq!(walk.len(), 3);
        assert_eq!(order.triangles(0..3).collect::<Vec<_>>(), [1, 0, 2]);
    }

    #[test]
    fn triangles_are_done_when_the_order_has_passed_them() {
        let mut order = MappingOrder::default();
        order.begin(3, 0);
        let mut walk = order.walk();
        walk.touch([4, 8], Parent::First);
        assert!(walk.record(1).is_done(0) && !walk.record(1).is_done(1));
        assert!(walk.record(2).is_done(1) && !walk.record(2).is_done(2));
    }

    #[test]
    fn the_last_touch_before_its_turn_is_what_last_unfolds_over() {
        let mut order = MappingOrder::default();
        order.begin(4, 0);
        let mut walk = order.walk();
        walk.touch([4, 5], Parent::Last);
        walk.touch([16, 6], Parent::Last);
        assert_eq!(walk.len(), 2);
        assert_eq!(walk.tag(1, Parent::Last), 6);
    }
}
