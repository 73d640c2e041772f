//! Where curves touch they get a common point.
//!
//! Two loops that touch in exact arithmetic cross by rounding, or by the chords of their polylines, however fine these are.
//! So the check puts a common end of pieces there: pieces are split (de Casteljau), or ends that are that near already are
//! moved together. From then on the touch is a point that both polylines have, bit for bit, at any tolerance.

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::engine::trimming::checked::CheckedTrims;
use crate::engine::trimming::pieces::Pieces;

/// A place on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::engine::trimming) struct Spot {
    /// Place of the loop in [`CheckedTrims::loops`].
    pub(in crate::engine::trimming) index: usize,
    /// Place of the curve in the loop's walk.
    pub(in crate::engine::trimming) place: u32,
    /// Parameter on the curve.
    pub(in crate::engine::trimming) t: f64,
    /// Length in the parameter of the chord that it was found on.
    pub(in crate::engine::trimming) reach: f64,
}

/// A point where two curves touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::engine::trimming) struct Touch {
    pub(in crate::engine::trimming) spots: [Spot; 2],
    pub(in crate::engine::trimming) uv: DVec2,
}

/// A piece is not split nearer to its ends than this part of it: what was left would be shorter than its coordinates'
/// rounding can tell. Larger would leave touches without a common end.
const SHORTEST: f64 = 1e-12;

/// Gives the curves a common end of pieces at every touch. Ends no farther from it than `near` are moved there.
///
/// True when something was changed.
pub(in crate::engine::trimming) fn weld(trims: &mut CheckedTrims, touches: &[Touch], near: DVec2) -> bool {
    let mut changed = false;
    for touch in touches {
        for spot in touch.spots {
            let curve = trims.loops[spot.index].curves[spot.place as usize].pieces.clone();
            let list = &trims.pieces.list[curve.clone()];
            let k = curve.start + list.partition_point(|p| p.t[1] < spot.t).min(list.len() - 1);
            let piece = &trims.pieces.list[k];
            let close = |p: DVec2| (p - touch.uv).abs().cmple(near).all();
            if let Some(old) = piece.ends.into_iter().find(|&e| close(e)) {
                if old != touch.uv {
                    move_ends(trims, spot.index, old, touch.uv);
                    changed = true;
                }
            } else {
                let s = piece.own(spot.t);
                if (SHORTEST..=1.0 - SHORTEST).contains(&s) {
                    trims.pieces.split(k, s, touch.uv);
                    make_room(trims, k);
                    changed = true;
                }
            }
        }
    }
    changed
}

/// Moves all ends of pieces of a loop that are at `old`.
fn move_ends(trims: &mut CheckedTrims, index: usize, old: DVec2, new: DVec2) {
    let ranges: Vec<Range<usize>> = trims.loops[index].curves.iter().map(|c| c.pieces.clone()).collect();
    for k in ranges.into_iter().flatten() {
        for end in [0, 1] {
            if trims.pieces.list[k].ends[end] == old {
                trims.pieces.move_end(k, end, new);
            }
        }
    }
}

/// Takes note that piece `k` has become two.
fn make_room(trims: &mut CheckedTrims, k: usize) {
    for curve in trims.loops.iter_mut().flat_map(|l| &mut l.curves) {
        if curve.pieces.start > k {
            curve.pieces.start += 1;
        }
        if curve.pieces.end > k {
            curve.pieces.end += 1;
        }
    }
}

impl Pieces {
    /// Splits a sealed piece at its own parameter `s`, strictly inside, and puts the common end to `uv`.
    fn split(&mut self, k: usize, s: f64, uv: DVec2) {
        let piece = self.list[k].clone();
        let t = piece.parameter(s);
        let mut rest: Vec<DVec3> = self.control[piece.control()].to_vec();
        let (mut left, mut right) = (Vec::with_capacity(rest.len()), Vec::with_capacity(rest.len()));
        while let (Some(&a), Some(&b)) = (rest.first(), rest.last()) {
            left.push(a);
            right.push(b);
            rest = rest.windows(2).map(|w| w[0].lerp(w[1], s)).collect();
        }
        right.reverse();
        let first = self.control.len();
        self.control.extend(&left);
        self.control.extend(&right);
        let halves = [
            piece.part([piece.t[0], t], [piece.ends[0], uv], first),
            piece.part([t, piece.t[1]], [uv, piece.ends[1]], first + left.len()),
        ];
        self.list.splice(k..=k, halves);
        self.move_end(k, 1, uv);
        self.move_end(k + 1, 0, uv);
    }

    /// Moves an end (0 or 1) of a sealed piece.
    fn move_end(&mut self, k: usize, end: usize, uv: DVec2) {
        let control = self.list[k].control();
        let at = if end == 0 { control.start } else { control.end - 1 };
        let w = self.control[at].z;
        let weight = if self.list[k].rational { w } else { 1.0 };
        self.control[at] = (uv * weight).extend(w);
        self.list[k].ends[end] = uv;
        self.list[k].bent();
    }
}
