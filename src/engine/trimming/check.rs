//! The checklist that trimming loops go through before anything is built on them.
//!
//! | item | what is asked |
//! |---|---|
//! | domain | no curve leaves the domain by more than rounding of real files |
//! | joints | each curve starts where the one before it ends |
//! | area | each loop encloses some |
//! | crossings | no loop crosses itself or another; touching is allowed |
//! | twins | no loop is there twice |
//! | nesting | depth by containment: even is outer, odd is a hole; any order, any orientation as sent |
//!
//! All faults are reported at once. Crossings and nesting are decided on polylines that are refined wherever two curves
//! come near each other, down to [`RESOLUTION`].

use std::collections::BTreeSet;
use std::ops::Range;

use glam::DVec2;

use super::checked::{CheckedCurve, CheckedLoop, CheckedTrims};
use super::chord::{CORNER_ANGLE, Chords, Metric};
use super::crossing::{Crossing, Encounter, Outline, TOUCH, Touch, Verdict, cross_free, encounter, weld};
use super::mend::{Findings, Frame, mend};
use super::nesting::{Ring, nest};
use super::pieces::{Pieces, Run};
use super::{TrimShape, TrimmedSurface, TrimmingError};

/// Deviation, relative to the domain, down to which the polylines of curves that come near each other are refined before
/// it is decided whether they cross. Curves that cross by less are taken to touch.
pub(super) const RESOLUTION: f64 = 1e-7;

/// Deviation of the polylines to begin with, relative to the domain. [`Chords`] keeps circles round by itself.
const FIRST_DEVIATION: f64 = 0.01;

/// Area of a loop relative to its box below which it encloses nothing.
const NO_AREA: f64 = 1e-9;

/// Touches of curves nearer to each other than this, relative to the domain, are one: about a chord at [`RESOLUTION`].
const SAME_TOUCH: f64 = 1e-4;

/// How often curves that touch are given common points before it is looked again. What is left after the first time is
/// rare.
const MAX_WELDS: usize = 4;

/// The most points that loops are worked on with. A loop of real parts has tens to thousands.
pub(super) const MAX_POINTS: usize = 400_000;

/// The most loops on one surface: nesting compares each with each.
const MAX_LOOPS: usize = 10_000;

impl TrimmedSurface {
    /// Runs the whole checklist over the trimming loops: mends what is within tolerance, nests and orients them.
    ///
    /// # Errors
    /// Every fault there is, in the order of the loops; crossings and twins are looked for among the loops that are whole.
    pub fn check(&self) -> Result<CheckedTrims, Vec<TrimmingError>> {
        let frame = Frame::new(&self.surface);
        if self.loops.is_empty() {
            return Ok(natural(&frame));
        }
        if self.loops.len() > MAX_LOOPS {
            return Err(vec![TrimmingError::TooIntricate { what: "loops", limit: MAX_LOOPS }]);
        }
        let mut findings = Findings::default();
        let mut pieces = Pieces::default();
        let mut loops = Vec::with_capacity(self.loops.len());
        for (index, trim) in self.loops.iter().enumerate() {
            let Some(ranges) = mend(&frame, index, trim, &mut pieces, &mut findings) else { continue };
            let curves = ranges.into_iter().zip(&trim.curves).enumerate().map(|(curve, (range, sent))| {
                let ends = [pieces.list[range.start].t[0], pieces.list[range.end - 1].t[1]];
                let [t_start, t_end] = if sent.reversed { [ends[1], ends[0]] } else { ends };
                let polyline = matches!(sent.shape, TrimShape::Polyline(_));
                CheckedCurve { curve, t_start, t_end, corner_at_start: true, polyline, pieces: range }
            });
            let curves = curves.collect();
            loops.push(CheckedLoop { source_loop: Some(index), depth: 0, parent: None, curves, flipped: false });
        }
        let Findings { mut errors, warnings } = findings;
        let mut trims = CheckedTrims { domain: frame.domain, loops, natural: false, warnings, pieces };
        arrange(&frame, &mut trims, &mut errors);
        if !errors.is_empty() {
            return Err(errors);
        }
        mark_corners(&frame, &mut trims);
        Ok(trims)
    }
}

/// The border of the domain as a loop of four straight curves.
fn natural(frame: &Frame<'_>) -> CheckedTrims {
    let ([a, b], [c, d]) = (frame.domain.u, frame.domain.v);
    let corners = [DVec2::new(a, c), DVec2::new(b, c), DVec2::new(b, d), DVec2::new(a, d)];
    let mut pieces = Pieces::default();
    let curves = (0..4)
        .map(|i| {
            pieces.push([0.0, 1.0], [corners[i], corners[(i + 1) % 4]].map(|p| p.extend(1.0)).into_iter());
            CheckedCurve {
                curve: i,
                t_start: 0.0,
                t_end: 1.0,
                corner_at_start: true,
                polyline: false,
                pieces: i..i + 1,
            }
        })
        .collect();
    pieces.seal(0..4);
    let border = CheckedLoop { source_loop: None, depth: 0, parent: None, curves, flipped: false };
    CheckedTrims { domain: frame.domain, loops: vec![border], natural: true, warnings: Vec::new(), pieces }
}

/// Finds crossings, loops without area and twins; nests the loops and orients them.
fn arrange(frame: &Frame<'_>, trims: &mut CheckedTrims, errors: &mut Vec<TrimmingError>) {
    let (outline, crossings) = match outlined(frame, trims, errors) {
        Ok(outlined) => outlined,
        Err(error) => {
            errors.push(error);
            return;
        }
    };
    report(frame, trims, &crossings, errors);
    let ring = |range: &Range<usize>| Ring::new(outline.points[range.clone()].iter().map(|p| p.uv).collect());
    let rings: Vec<Ring> = outline.loops.iter().map(|(_, range)| ring(range)).collect();
    for ((l, _), ring) in outline.loops.iter().zip(&rings) {
        let extent = ring.extent();
        // A figure eight may have no area on balance: the crossing is the fault to report.
        let crosses = crossings.iter().any(|c| c.loops == [*l, *l]);
        if ring.area.abs() <= NO_AREA * extent.x * extent.y && !crosses {
            errors.push(empty(frame, trims, *l, ring.points[0]));
        }
    }
    if !errors.is_empty() {
        return;
    }
    let nesting = nest(&rings);
    for &(a, b) in &nesting.twins {
        let [loop_index, other] = [a, b].map(|r| trims.loops[outline.loops[r].0].source_loop.unwrap_or_default());
        let place = frame.place(other, None, None, rings[b].points[0]);
        errors.push(TrimmingError::Twins { loop_index, other, place });
    }
    // All loops are whole here, so ring r is loop r.
    for (r, (depth, parent)) in nesting.rings.into_iter().enumerate() {
        let checked = &mut trims.loops[r];
        (checked.depth, checked.parent) = (depth, parent);
        if (rings[r].area > 0.0) != depth.is_multiple_of(2) {
            checked.flipped = true;
            checked.curves.reverse();
            for c in &mut checked.curves {
                std::mem::swap(&mut c.t_start, &mut c.t_end);
            }
        }
    }
}

/// Polylines of the loops that are fine enough to judge them, and where they cross. Curves that touch get a common point
/// on the way. Loops without three different points are reported and left out.
fn outlined(
    frame: &Frame<'_>,
    trims: &mut CheckedTrims,
    errors: &mut Vec<TrimmingError>,
) -> Result<(Outline, Vec<Crossing>), TrimmingError> {
    let mut welds = 0;
    loop {
        let mut outline = Outline::default();
        let mut chords = Chords::new(trims, Metric::of_domain(&trims.domain), FIRST_DEVIATION);
        let mut lines = Vec::new();
        for (l, checked) in trims.loops.iter().enumerate() {
            let start = outline.points.len();
            if !chords.whole(checked, &mut outline.points, MAX_POINTS) {
                return Err(TrimmingError::TooIntricate { what: "points on the loops", limit: MAX_POINTS });
            }
            let first = outline.points[start].uv;
            if !outline.close(l, start) {
                lines.push((l, first));
            }
        }
        let Verdict { mut crossings, touches } = cross_free(trims, &mut outline, Some((frame.size, RESOLUTION)))
            .map_err(|limit| TrimmingError::TooIntricate { what: "pairs of neighbouring segments", limit })?;
        let mut welded: Vec<Touch> = Vec::new();
        for touch in touches {
            let straight = touch.spots.iter().all(|s| trims.is_straight(s.index, s.place as usize, s.t));
            match if straight { Encounter::Touch(touch) } else { encounter(trims, &touch, frame.size) } {
                // Several chords lie around one touch of curves; corners of polylines are each their own.
                Encounter::Touch(t) if straight || !welded.iter().any(|w| frame.relative(w.uv - t.uv) < SAME_TOUCH) => {
                    welded.push(t);
                }
                Encounter::Touch(_) | Encounter::Apart => {}
                Encounter::Cross => crossings.push(Crossing {
                    loops: touch.spots.map(|s| s.index),
                    place: touch.spots[0].place,
                    t: touch.spots[0].t,
                    uv: touch.uv,
                }),
            }
        }
        if welds == MAX_WELDS || !weld(trims, &welded, frame.size * (2.0 * TOUCH)) {
            errors.extend(lines.into_iter().map(|(l, first)| empty(frame, trims, l, first)));
            return Ok((outline, crossings));
        }
        welds += 1;
    }
}

fn empty(frame: &Frame<'_>, trims: &CheckedTrims, l: usize, at: DVec2) -> TrimmingError {
    let loop_index = trims.loops[l].source_loop.unwrap_or_default();
    TrimmingError::Empty { loop_index, place: frame.place(loop_index, None, None, at) }
}

/// Turns crossings into errors: the first of each pair of loops.
pub(super) fn report(frame: &Frame<'_>, trims: &CheckedTrims, crossings: &[Crossing], errors: &mut Vec<TrimmingError>) {
    let mut seen = BTreeSet::new();
    for c in crossings {
        let [a, b] = c.loops.map(|l| trims.loops[l].source_loop.unwrap_or_default());
        if !seen.insert((a.min(b), a.max(b))) {
            continue;
        }
        let curve = trims.loops[c.loops[0]].curves[c.place as usize].curve;
        let place = frame.place(a, Some(curve), Some(c.t), c.uv);
        errors.push(if a == b {
            TrimmingError::SelfIntersection { loop_index: a, place }
        } else {
            TrimmingError::LoopsIntersect { loop_index: a, other: b, place }
        });
    }
}

/// Sets the corner flags at the joints of curves.
fn mark_corners(frame: &Frame<'_>, trims: &mut CheckedTrims) {
    let metric = Metric::of(frame.surface);
    for l in 0..trims.loops.len() {
        let count = trims.loops[l].curves.len();
        for c in 0..count {
            let before = &trims.loops[l].curves[if c == 0 { count - 1 } else { c - 1 }];
            let here = &trims.loops[l].curves[c];
            let (arrives, end, run) = walk_end(trims, before, true);
            let (leaves, start, next) = walk_end(trims, here, false);
            let corner = match (run, next) {
                // A line of constant u and one of constant v always form a corner.
                (Run::ConstantU, Run::ConstantV) | (Run::ConstantV, Run::ConstantU) => true,
                _ => end != start || metric.turn(start, arrives, leaves, frame.size).is_none_or(|a| a > CORNER_ANGLE),
            };
            trims.loops[l].curves[c].corner_at_start = corner;
        }
    }
}

/// Direction of walking at a curve's end (or start), the point there, and how the piece there runs.
fn walk_end(trims: &CheckedTrims, curve: &CheckedCurve, end: bool) -> (DVec2, DVec2, Run) {
    let last = end != curve.backwards();
    let piece = &trims.pieces.list[if last { curve.pieces.end - 1 } else { curve.pieces.start }];
    let along = trims.pieces.tangent(piece, last);
    (if curve.backwards() { -along } else { along }, piece.ends[usize::from(last)], piece.run)
}
