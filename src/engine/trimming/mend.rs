//! From the curves of a loop to closed pieces inside the domain: small overshoots are clamped, small gaps are closed.
//!
//! Files of real CAD systems leave the domain by up to 2e-7 of its width and have gaps of 1e-7 to 1e-4 of it between
//! curves. Both are mended on the Bezier control points, so that whoever evaluates a curve later meets the mended one:
//! - Control points that leave the domain by at most [`BORDER_TOLERANCE`] are clamped; a piece that runs along the border
//!   within it is put on the border bit for bit, and so are ends that lie that close to it.
//! - The ends of two curves that should meet are moved to one point. What that changes is spread linearly over each
//!   curve, by adding a linear function of the parameter to its control points (exact for polynomial pieces).
//!
//! Where two ends are apart in (u, v) but one point in space (a loop that jumps along a pole) nothing is moved: the
//! polyline walks straight from one to the other.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::pieces::Pieces;
use super::{TrimLoop, TrimWarning, TrimmingError};
use crate::engine::error::Place;
use crate::engine::nurbs::{Domain, Surface};

/// How far a curve may leave the domain, relative to the domain's width in that direction, and how near the border counts
/// as on it. Real files overshoot by up to 2e-7; ten times that is still invisible on a part, and a wrong curve is not.
const BORDER_TOLERANCE: f64 = 1e-6;

/// What lies this near the border is put on it only when it is this small a part of its own loop: a loop of the size of
/// [`BORDER_TOLERANCE`] must not be flattened onto the border.
const BORDER_SHARE: f64 = 1e-3;

/// Gaps up to this part of the domain come from rounding and are closed without a word.
const ROUNDING_GAP: f64 = 1e-9;

/// The largest gap that is closed, relative to the domain or to the surface's diagonal in space. Real files have up to
/// 1e-4; a person who left a gap on purpose or by mistake leaves a larger one.
const GAP_TOLERANCE: f64 = 2e-4;

/// No gap is closed that is a larger part of its own loop than this: a tiny open arc is not a hole.
const GAP_SHARE: f64 = 0.02;

/// A curve whose u (or v) varies by no more than this part of the domain runs along a line of constant u (or v).
/// Rounding in files is near 1e-15; what is straightened here moves by far less than any tolerance of the part.
const STRAIGHT_TOLERANCE: f64 = 1e-11;

/// Segments that the straight way across a gap is sampled with in space.
const BRIDGE_SAMPLES: usize = 8;

/// How often a piece is halved to see whether it leaves the domain: the hull of its control points approaches it with
/// the square of that, so 12 halvings tell overshoots apart that differ by 1e-7 of the hull.
const HULL_HALVINGS: usize = 12;

/// The surface, and what sizes are measured by.
pub(super) struct Frame<'a> {
    pub(super) surface: &'a Surface,
    pub(super) domain: Domain,
    /// Width of the domain in u and v.
    pub(super) size: DVec2,
}

impl<'a> Frame<'a> {
    pub(super) fn new(surface: &'a Surface) -> Self {
        let domain = surface.domain();
        Self { surface, domain, size: DVec2::new(domain.u[1] - domain.u[0], domain.v[1] - domain.v[0]) }
    }

    /// A vector of the domain relative to the domain's size: its larger component.
    pub(super) fn relative(&self, d: DVec2) -> f64 {
        (d / self.size).abs().max_element()
    }

    /// The point of the surface at (u, v).
    pub(super) fn lift(&self, uv: DVec2) -> DVec3 {
        self.surface.point(uv.x, uv.y)
    }

    /// A place in words: whatever applies is given.
    pub(super) fn place(&self, loop_index: usize, curve: Option<usize>, t: Option<f64>, uv: DVec2) -> Box<Place> {
        let known = uv.is_finite();
        let inside = super::checked::clamp(&self.domain, uv);
        Box::new(Place {
            loop_index: Some(loop_index),
            curve,
            t,
            uv: known.then(|| uv.to_array()),
            xyz_mm: known.then(|| self.lift(inside).to_array()),
            ..Place::default()
        })
    }
}

/// What is found on the way.
#[derive(Default)]
pub(super) struct Findings {
    pub(super) errors: Vec<TrimmingError>,
    pub(super) warnings: Vec<TrimWarning>,
}

/// Appends the pieces of loop `index`, mended and sealed, and returns where each curve's are. `None` when a fault was found.
pub(super) fn mend(
    frame: &Frame<'_>,
    index: usize,
    trim: &TrimLoop,
    pieces: &mut Pieces,
    findings: &mut Findings,
) -> Option<Vec<Range<usize>>> {
    let known = findings.errors.len();
    let first = pieces.list.len();
    let curves: Vec<Range<usize>> = trim.curves.iter().map(|c| pieces.push_curve(c)).collect();
    if curves.is_empty() || curves.iter().any(Range::is_empty) {
        let place =
            Place { loop_index: Some(index), curve: curves.iter().position(Range::is_empty), ..Place::default() };
        findings.errors.push(TrimmingError::Empty { loop_index: index, place: Box::new(place) });
        return None;
    }
    let [low, high] = bounds(pieces, first..pieces.list.len());
    let extent = high - low;
    for (c, range) in curves.iter().enumerate() {
        clamp_curve(frame, (index, c), range.clone(), extent, pieces, findings);
    }
    if findings.errors.len() == known {
        join(frame, index, trim, &curves, extent, pieces, findings);
    }
    pieces.seal(first..pieces.list.len());
    (findings.errors.len() == known).then_some(curves)
}

/// The box of the control points of some pieces.
fn bounds(pieces: &Pieces, range: Range<usize>) -> [DVec2; 2] {
    pieces.list[range]
        .iter()
        .flat_map(|p| &pieces.control[p.control()])
        .fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], p| [low.min(p.truncate()), high.max(p.truncate())])
}

/// Brings a curve into the domain and onto the border where it is that near; reports it when it goes too far.
fn clamp_curve(
    frame: &Frame<'_>,
    (index, curve): (usize, usize),
    range: Range<usize>,
    extent: DVec2,
    pieces: &mut Pieces,
    findings: &mut Findings,
) {
    let low = DVec2::new(frame.domain.u[0], frame.domain.v[0]);
    let high = DVec2::new(frame.domain.u[1], frame.domain.v[1]);
    let tolerance = frame.size * BORDER_TOLERANCE;
    let near = tolerance.min(extent * BORDER_SHARE);
    let within = |p: DVec2| p.cmpge(low - tolerance).all() && p.cmple(high + tolerance).all();
    for k in range.clone() {
        let piece = pieces.list[k].clone();
        let control = &mut pieces.control[piece.control()];
        if !control.iter().all(|p| within(p.truncate())) {
            if let Some((s, uv)) = leaves(control, &within) {
                findings.errors.push(TrimmingError::OutsideDomain {
                    loop_index: index,
                    curve,
                    place: frame.place(index, Some(curve), Some(piece.parameter(s)), uv),
                });
                return;
            }
            // Only the hull leaves the domain: such a curve is clamped where it is evaluated.
            continue;
        }
        for p in control.iter_mut() {
            *p = p.truncate().clamp(low, high).extend(p.z);
        }
        snap(control, low, near);
        snap(control, high, near);
    }
    straighten(pieces, &range, frame.size * STRAIGHT_TOLERANCE);
    // Neighbouring pieces share their common end bit for bit, whatever rounding did to it.
    for k in range.start + 1..range.end {
        let before = pieces.control[pieces.list[k - 1].control().end - 1].truncate();
        let start = pieces.list[k].control().start;
        let here = pieces.control[start].truncate();
        if frame.relative(here - before) > ROUNDING_GAP {
            findings.errors.push(TrimmingError::Gap {
                loop_index: index,
                curve,
                gap_mm: frame.lift(here.clamp(low, high)).distance(frame.lift(before.clamp(low, high))),
                tolerance_mm: 0.0,
                place: frame.place(index, Some(curve), Some(pieces.list[k].t[0]), before),
            });
            return;
        }
        pieces.control[start] = before.extend(pieces.control[start].z);
    }
}

/// Puts a piece, or an end of it, on the border lines through `border` where it is nearer than `near`.
fn snap(control: &mut [DVec3], border: DVec2, near: DVec2) {
    let last = control.len() - 1;
    let close = |p: &DVec3| (p.truncate() - border).abs().cmple(near);
    let all = control.iter().map(close).fold(glam::BVec2::TRUE, |a, b| a & b);
    for (i, p) in control.iter_mut().enumerate() {
        let here = if i == 0 || i == last { close(p) } else { all };
        *p = DVec2::select(here, border, p.truncate()).extend(p.z);
    }
}

/// Makes u (or v) of a curve exactly constant when it varies by rounding only.
fn straighten(pieces: &mut Pieces, range: &Range<usize>, tolerance: DVec2) {
    let [low, high] = bounds(pieces, range.clone());
    let spread = high - low;
    let constant = spread.cmple(tolerance) & spread.cmpgt(DVec2::ZERO);
    if constant.any() && !constant.all() {
        let value = pieces.control[pieces.list[range.start].control().start].truncate();
        for k in range.clone() {
            let control = pieces.list[k].control();
            for p in &mut pieces.control[control] {
                *p = DVec2::select(constant, value, p.truncate()).extend(p.z);
            }
        }
    }
}

/// Where a piece with these control points `(u, v, w)` leaves what is `within`, if it does: its own parameter and the point.
fn leaves(control: &[DVec3], within: &impl Fn(DVec2) -> bool) -> Option<(f64, DVec2)> {
    let weighted: Vec<DVec3> = control.iter().map(|p| (p.truncate() * p.z).extend(p.z)).collect();
    let place = |p: &DVec3| p.truncate() / p.z;
    let mut open = vec![(weighted, 0.0, 1.0, HULL_HALVINGS)];
    while let Some((points, from, to, halvings)) = open.pop() {
        if points.iter().all(|p| within(place(p))) {
            continue;
        }
        for (p, s) in [(points.first(), from), (points.last(), to)] {
            if let Some(p) = p.map(place)
                && !within(p)
            {
                return Some((s, p));
            }
        }
        if halvings == 0 {
            continue;
        }
        // De Casteljau at the middle: the first points of each step are the left half, the last ones the right.
        let (mut left, mut right, mut rest) = (Vec::new(), Vec::new(), points);
        while let (Some(&a), Some(&b)) = (rest.first(), rest.last()) {
            left.push(a);
            right.push(b);
            rest = rest.windows(2).map(|w| (w[0] + w[1]) * 0.5).collect();
        }
        right.reverse();
        let middle = 0.5 * (from + to);
        open.push((right, middle, to, halvings - 1));
        open.push((left, from, middle, halvings - 1));
    }
    None
}

/// Closes the gaps between the curves of a loop, or reports them.
fn join(
    frame: &Frame<'_>,
    index: usize,
    trim: &TrimLoop,
    curves: &[Range<usize>],
    extent: DVec2,
    pieces: &mut Pieces,
    findings: &mut Findings,
) {
    let count = curves.len();
    // Ends in walking order, as they are and as they will be.
    let ends: Vec<[DVec2; 2]> = (0..count).map(|c| walk_ends(pieces, &curves[c], trim.curves[c].reversed)).collect();
    let mut joined = ends.clone();
    let mut moved = false;
    for c in 0..count {
        let next = (c + 1) % count;
        let (from, to) = (ends[c][1], ends[next][0]);
        if from == to {
            continue;
        }
        let gap = frame.relative(to - from);
        let curve_end = &pieces.list[if trim.curves[c].reversed { curves[c].start } else { curves[c].end - 1 }];
        let t = if trim.curves[c].reversed { curve_end.t[0] } else { curve_end.t[1] };
        if gap > ROUNDING_GAP {
            let gap_mm = across(frame, from, to);
            let own = frame.relative(extent);
            let tolerance_mm = tolerance_mm(frame, &ends);
            let small = gap <= (GAP_SHARE * own).min(GAP_TOLERANCE);
            let place = frame.place(index, Some(c), Some(t), from);
            if !small && gap_mm > tolerance_mm {
                findings.errors.push(TrimmingError::Gap { loop_index: index, curve: c, gap_mm, tolerance_mm, place });
                continue;
            }
            findings.warnings.push(TrimWarning {
                code: "gap-closed",
                detail: format!(
                    "trimming loop {index}: the gap of {gap_mm:.3e} mm ({gap:.1e} of the domain) after curve {c} was closed"
                ),
                place: *place,
            });
            if !small && gap > GAP_TOLERANCE {
                continue;
            }
        }
        let prefer = |a: f64, b: f64, ends: [f64; 2], a_constant: bool, b_constant: bool| {
            let on = |x: f64| x == ends[0] || x == ends[1];
            if a == b || on(a) || (a_constant && !on(b)) {
                a
            } else if on(b) || b_constant {
                b
            } else {
                0.5 * (a + b)
            }
        };
        let [a, b] = [&curves[c], &curves[next]].map(|r| {
            let [low, high] = bounds(pieces, r.clone());
            low.cmpeq(high)
        });
        let shared =
            DVec2::new(prefer(from.x, to.x, frame.domain.u, a.x, b.x), prefer(from.y, to.y, frame.domain.v, a.y, b.y));
        joined[c][1] = shared;
        joined[next][0] = shared;
        moved = true;
    }
    if moved {
        for c in 0..count {
            let flip = trim.curves[c].reversed;
            let order = |e: [DVec2; 2]| if flip { [e[1], e[0]] } else { e };
            bend(pieces, &curves[c], order(ends[c]), order(joined[c]));
        }
    }
}

/// First and last point of a curve as it is walked.
fn walk_ends(pieces: &Pieces, range: &Range<usize>, reversed: bool) -> [DVec2; 2] {
    let first = pieces.control[pieces.list[range.start].control().start].truncate();
    let last = pieces.control[pieces.list[range.end - 1].control().end - 1].truncate();
    if reversed { [last, first] } else { [first, last] }
}

/// Length on the surface of the straight way between two points of the domain.
fn across(frame: &Frame<'_>, from: DVec2, to: DVec2) -> f64 {
    let mut length = 0.0;
    let mut last = frame.lift(from);
    for k in 1..=BRIDGE_SAMPLES {
        let next = frame.lift(from.lerp(to, k as f64 / BRIDGE_SAMPLES as f64));
        length += next.distance(last);
        last = next;
    }
    length
}

/// The largest gap in space that is closed in a loop with these curve ends.
fn tolerance_mm(frame: &Frame<'_>, ends: &[[DVec2; 2]]) -> f64 {
    let [low, high] = frame.surface.bounding_box();
    let [a, b] = ends
        .iter()
        .flatten()
        .map(|&uv| frame.lift(uv))
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)]);
    let diagonal = low.distance(high);
    let own = if ends.len() > 2 { a.distance(b) } else { diagonal };
    (GAP_TOLERANCE * diagonal).min(GAP_SHARE * own)
}

/// Adds to a curve the linear function of its parameter that takes its ends from `old` to `new`.
fn bend(pieces: &mut Pieces, range: &Range<usize>, old: [DVec2; 2], new: [DVec2; 2]) {
    let [start, end] = [new[0] - old[0], new[1] - old[1]];
    if start == DVec2::ZERO && end == DVec2::ZERO {
        return;
    }
    let (from, to) = (pieces.list[range.start].t[0], pieces.list[range.end - 1].t[1]);
    for k in range.clone() {
        let piece = &pieces.list[k];
        let ([a, b], degree) = (piece.t, piece.degree());
        let control = piece.control();
        for (j, p) in pieces.control[control].iter_mut().enumerate() {
            let t = a + (b - a) * (j as f64 / degree as f64);
            *p = (p.truncate() + start.lerp(end, (t - from) / (to - from))).extend(p.z);
        }
    }
    for k in range.start + 1..range.end {
        let before = pieces.control[pieces.list[k - 1].control().end - 1].truncate();
        let first = pieces.list[k].control().start;
        pieces.control[first] = before.extend(pieces.control[first].z);
    }
    let (first, last) = (pieces.list[range.start].control().start, pieces.list[range.end - 1].control().end - 1);
    pieces.control[first] = new[0].extend(pieces.control[first].z);
    pieces.control[last] = new[1].extend(pieces.control[last].z);
}
