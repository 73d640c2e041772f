//! Whether the loops of an outline cross, each other or themselves.
//!
//! Polylines stand for curves, so a crossing of two segments says nothing yet when they are coarse, nor does its absence
//! when they pass each other closer than the curves deviate from them. Segments in such pairs are halved, all at once,
//! until they are clear of each other or finer than the resolution; only then do the exact predicates decide.

use glam::DVec2;

use super::checked::CheckedTrims;
use super::chord::ChordPoint;
use super::contact::cross;
use super::outline::{Box2, Outline, Tree};

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

/// The crossings that are left when coarse segments have been refined, in a fixed order; `Err` with the limit when there
/// are too many pairs of segments to compare.
///
/// `clearance` is for polylines whose deviation is relative to the domain: the domain's size, and the deviation at which
/// refinement ends. Without it only segments that do cross are refined.
pub(super) fn cross_free(
    trims: &CheckedTrims,
    outline: &mut Outline,
    clearance: Option<(DVec2, f64)>,
) -> Result<Vec<Crossing>, usize> {
    let (size, resolution) = clearance.unwrap_or((DVec2::ZERO, 0.0));
    let mut halve: Vec<bool> = Vec::new();
    let mut found: Vec<Crossing> = Vec::new();
    for round in 0..=MAX_ROUNDS {
        let refine = round < MAX_ROUNDS && outline.points.len() < MAX_REFINED;
        let tree = Tree::new(boxes(outline, size));
        let coarse = |i: usize| outline.points[i].deviation > resolution;
        halve.clear();
        halve.resize(outline.points.len(), false);
        found.clear();
        let (mut compared, mut any) = (0_usize, false);
        tree.pairs(|i, j| {
            compared += 1;
            let neighbours = outline.next(i) == j || outline.next(j) == i;
            let unclear = refine && (coarse(i) || coarse(j)) && clearance.is_some();
            if neighbours {
                if !(unclear && is_sharp(outline, i, j)) {
                    return compared < MAX_PAIRS;
                }
            } else if !unclear {
                let Some(uv) = cross(outline, i, j) else { return compared < MAX_PAIRS };
                if !refine || !(coarse(i) || coarse(j)) {
                    found.push(crossing(outline, i, j, uv));
                    return found.len() < MAX_CROSSINGS && compared < MAX_PAIRS;
                }
            }
            halve[i] |= coarse(i);
            halve[j] |= coarse(j);
            any = true;
            compared < MAX_PAIRS
        });
        if compared >= MAX_PAIRS {
            return Err(MAX_PAIRS);
        }
        if !any {
            break;
        }
        *outline = halved(trims, outline, &halve);
    }
    found.sort_by(|a, b| {
        (a.loops, a.place, a.t).partial_cmp(&(b.loops, b.place, b.t)).unwrap_or(std::cmp::Ordering::Equal)
    });
    Ok(std::mem::take(&mut found))
}

/// Boxes around the curves that segments stand for.
fn boxes(outline: &Outline, size: DVec2) -> Vec<Box2> {
    let mut boxes = Vec::with_capacity(outline.points.len());
    for (_, range) in &outline.loops {
        for i in range.clone() {
            let (a, b) = (outline.points[i], outline.points[Outline::next_in(range, i)].uv);
            let margin = size * (a.deviation * DEVIATION_MARGIN);
            boxes.push([a.uv.min(b) - margin, a.uv.max(b) + margin]);
        }
    }
    boxes
}

/// Whether two neighbouring segments form an angle so sharp that the curves may meet again beside their common point.
fn is_sharp(outline: &Outline, i: usize, j: usize) -> bool {
    /// Cosine of 60 degrees: two arcs of 40 degrees each turn towards each other by at most 40.
    const SHARP: f64 = 0.5;
    let ends = if outline.next(i) == j { [i, j] } else { [j, i] };
    let [a, p] = outline.segment(ends[0]);
    let q = outline.segment(ends[1])[1];
    let (back, on) = (a - p, q - p);
    back.dot(on) > SHARP * back.length() * on.length()
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
