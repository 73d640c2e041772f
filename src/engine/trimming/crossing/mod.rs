//! Whether the loops of an outline cross, each other or themselves.
//!
//! Polylines stand for curves, so a crossing of two segments says nothing yet when they are coarse, nor does its absence
//! when they pass each other closer than the curves deviate from them. Segments in such pairs are halved, all at once,
//! until they are clear of each other or finer than the resolution; only then do the exact predicates decide.

mod contact;
mod outline;
mod touch;
mod weld;

use glam::DVec2;

use super::checked::CheckedTrims;
use super::chord::ChordPoint;
use crate::engine::boxes::{Box2, Tree};
use contact::{Cross, cross, distance};
use weld::Spot;

pub(super) use contact::orient;
pub(super) use outline::Outline;
pub(super) use touch::{Encounter, encounter};
pub(super) use weld::{Touch, weld};

/// How often segments are halved: a deviation falls by four each time, so from a hundredth of the domain to below a
/// thousand-millionth.
const MAX_ROUNDS: usize = 12;

/// The most pairs of segments that are compared in one round. Loops of real parts need a few a segment; combs of long
/// slanting edges, which a tree of boxes cannot tell apart, need all pairs.
const MAX_PAIRS: usize = 50_000_000;

/// The most crossings that are collected: a person mends the first, and then looks again.
const MAX_CROSSINGS: usize = 1000;

/// The most points after refinement.
const MAX_REFINED: usize = 1_000_000;

/// Segments that cross by no more than this, relative to the domain, beside their deviation, touch: rounding is near
/// 1e-16, and what files mean to touch is good to their own rounding, 1e-9 to 1e-15.
pub(super) const TOUCH: f64 = 1e-9;

/// A deviation that was sampled may have missed the largest: boxes are made larger by this factor of it.
const DEVIATION_MARGIN: f64 = 1.5;

/// A crossing of two segments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// The loops, by their place in [`CheckedTrims::loops`].
    pub(super) loops: [usize; 2],
    /// Place of the first one's curve in the walk.
    pub(super) place: u32,
    /// Parameter on it.
    pub(super) t: f64,
    /// Where.
    pub(super) uv: DVec2,
}

/// What is left when coarse segments have been refined, in a fixed order.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Verdict {
    /// Where loops cross.
    pub(super) crossings: Vec<Crossing>,
    /// Where segments cross by no more than their deviation and rounding: they may touch, cross or pass each other.
    pub(super) touches: Vec<Touch>,
}

/// Finds where loops cross. Segments that are too coarse to tell are refined; `Err` with the limit when there are too many
/// pairs of segments to compare.
///
/// `clearance` is for polylines whose deviation is relative to the domain: the domain's size, and the deviation at which
/// refinement ends. Without it only segments that do cross are refined, and whatever crosses in the end is a crossing.
pub(super) fn cross_free(
    trims: &CheckedTrims,
    outline: &mut Outline,
    clearance: Option<(DVec2, f64)>,
) -> Result<Verdict, usize> {
    let (size, resolution) = clearance.unwrap_or((DVec2::ZERO, 0.0));
    let mut halve: Vec<bool> = Vec::new();
    for round in 0..=MAX_ROUNDS {
        let refine = round < MAX_ROUNDS && outline.points.len() < MAX_REFINED;
        let tree = Tree::new(boxes(outline, size));
        let deviation = |i: usize| outline.points[i].deviation;
        let coarse = |i: usize| refine && deviation(i) > resolution;
        let slack = |i: usize| deviation(i) * size.max_element();
        halve.clear();
        halve.resize(outline.points.len(), false);
        let mut verdict = Verdict::default();
        let (mut compared, mut any) = (0_usize, false);
        tree.pairs(|i, j| {
            compared += 1;
            if compared >= MAX_PAIRS || verdict.crossings.len() >= MAX_CROSSINGS {
                return false;
            }
            let neighbours = outline.next(i) == j || outline.next(j) == i;
            let unclear = coarse(i) || coarse(j);
            if unclear && clearance.is_some() && !neighbours && keeps_clear(outline, i, j, size) {
                return true;
            }
            if neighbours {
                if unclear && clearance.is_some() && is_sharp(outline, i, j) {
                    halve[i] |= coarse(i);
                    halve[j] |= coarse(j);
                    any = true;
                }
            } else if unclear && clearance.is_some() {
                halve[i] |= coarse(i);
                halve[j] |= coarse(j);
                any = true;
            } else if let Some(found) = cross(outline, i, j, slack) {
                if unclear {
                    // The coarsest alone: of two curves that touch the flatter one's chord cuts into the other as long
                    // as it is the longer one, whatever their length. At a common point four chords meet.
                    let chords = match found {
                        Cross::Inside(_) => [i, j, i, j],
                        Cross::AtPoint(_) => [i, j, outline.before(i), outline.before(j)],
                    };
                    let coarsest = chords.into_iter().fold(i, |m, k| if deviation(k) > deviation(m) { k } else { m });
                    halve[coarsest] = true;
                    any = true;
                } else if let Some(touch) = clearance.and_then(|_| touch(outline, i, j, found, size)) {
                    verdict.touches.push(touch);
                } else {
                    let (Cross::Inside(uv) | Cross::AtPoint(uv)) = found;
                    verdict.crossings.push(crossing(outline, i, j, uv));
                }
            }
            true
        });
        if compared >= MAX_PAIRS {
            return Err(MAX_PAIRS);
        }
        if !any {
            let key = |c: &Crossing| (c.loops, c.place, c.t);
            verdict.crossings.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
            return Ok(verdict);
        }
        *outline = halved(trims, outline, &halve);
    }
    Ok(Verdict::default())
}

/// The touch that two crossing segments may come from, when they cross by no more than their deviation and rounding.
fn touch(outline: &Outline, i: usize, j: usize, found: Cross, size: DVec2) -> Option<Touch> {
    let Cross::Inside(uv) = found else { return None };
    let ([a, b], [c, d]) = (outline.segment(i).map(|p| p / size), outline.segment(j).map(|p| p / size));
    let ends = [(distance(a, c, d), a), (distance(b, c, d), b), (distance(c, a, b), c), (distance(d, a, b), d)];
    let (depth, end) = ends.into_iter().fold((f64::INFINITY, a), |m, e| if e.0 < m.0 { e } else { m });
    if depth > outline.points[i].deviation + outline.points[j].deviation + TOUCH {
        return None;
    }
    // An end that is as good as on the other curve is the common point.
    let uv = if depth <= TOUCH { end * size } else { uv };
    let spots = [i, j].map(|s| {
        let at = crossing(outline, s, s, uv);
        let [from, to] = outline.points[s].t;
        Spot { index: at.loops[0], place: at.place, t: at.t, reach: (to - from).abs() }
    });
    Some(Touch { spots, uv })
}

/// Boxes around the curves that segments stand for.
fn boxes(outline: &Outline, size: DVec2) -> Vec<Box2> {
    let mut boxes = Vec::with_capacity(outline.points.len());
    for (i, p) in outline.points.iter().enumerate() {
        let [a, b] = outline.segment(i);
        let margin = size * (p.deviation * DEVIATION_MARGIN);
        boxes.push([a.min(b) - margin, a.max(b) + margin]);
    }
    boxes
}

/// Whether one of two segments lies on one side of the line of the other, farther than their curves deviate.
fn keeps_clear(outline: &Outline, i: usize, j: usize, size: DVec2) -> bool {
    let ([a, b], [c, d]) = (outline.segment(i).map(|p| p / size), outline.segment(j).map(|p| p / size));
    let margin = (outline.points[i].deviation + outline.points[j].deviation) * DEVIATION_MARGIN;
    let beside = |a: DVec2, b: DVec2, c: DVec2, d: DVec2| {
        let e = b - a;
        let (c, d, margin) = (e.perp_dot(c - a), e.perp_dot(d - a), margin * e.length());
        (c > margin && d > margin) || (c < -margin && d < -margin)
    };
    beside(a, b, c, d) || beside(c, d, a, b)
}

/// Whether two neighbouring segments form an angle so sharp that the curves may meet again beside their common point.
fn is_sharp(outline: &Outline, i: usize, j: usize) -> bool {
    /// Cosine of 60 degrees: two arcs of 40 degrees each turn towards each other by at most 40.
    const SHARP: f64 = 0.5;
    let ends = if outline.next(i) == j { [i, j] } else { [j, i] };
    let [a, p] = outline.segment(ends[0]);
    let q = outline.segment(ends[1])[1];
    let (back, on) = (a - p, q - p);
    let along = back.dot(on);
    along > 0.0 && along > SHARP * back.length() * on.length()
}

fn crossing(outline: &Outline, i: usize, j: usize, uv: DVec2) -> Crossing {
    let loops = [i, j].map(|s| outline.loops[outline.owner(s)].0);
    let [a, b] = outline.segment(i);
    let along = ((uv - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    let p = &outline.points[i];
    Crossing { loops, place: p.place, t: p.t[0] + (p.t[1] - p.t[0]) * along, uv }
}

/// The outline with some segments halved.
fn halved(trims: &CheckedTrims, outline: &Outline, halve: &[bool]) -> Outline {
    /// A half deviates by a quarter where the curve is smooth; a little more is allowed for.
    const QUARTER: f64 = 0.3;
    let mut refined = Outline::default();
    refined.points.reserve(outline.points.len() * 2);
    for (index, range) in &outline.loops {
        let start = refined.points.len();
        for i in range.clone() {
            let p = outline.points[i];
            if !halve[i] {
                refined.points.push(p);
                continue;
            }
            let t = 0.5 * (p.t[0] + p.t[1]);
            let curve = &trims.loops[*index].curves[p.place as usize];
            let deviation = p.deviation * QUARTER;
            refined.points.push(ChordPoint { t: [p.t[0], t], deviation, ..p });
            let uv = trims.on_curve(curve, t);
            refined.points.push(ChordPoint { uv, t: [t, p.t[1]], deviation, corner: false, ..p });
        }
        refined.close(*index, start);
    }
    refined
}
