//! Curves to polylines within a chord tolerance (thesis 3.1).
//!
//! A curve `c(t)` of the domain stands for `S(c(t))` in space. A segment from `c(a)` to `c(b)` is good when at every probe
//! between them
//! - the point in space is within the tolerance of the chord in space, and
//! - the way from `c(t)` to the chord in the domain, mapped by `[Su Sv]`, is no longer than the tolerance: that is how far
//!   the boundary moves sideways on the surface, which a finer grid cannot mend;
//! - neither is more than [`SAGITTA_SHARE`] of the chord, so that however small a circle is it keeps nine points.
//!
//! A segment that is not good is cut into as many parts as its bending asks for (the deviation of a part falls with the
//! square of its length), each with an equal share of it, and these are tried in turn: fewer points than halving gives. Segments of the same curve that together are
//! good as well are joined afterwards, so that a spline of a hundred flat pieces does not cost a hundred points.
//!
//! Pieces that are straight *and* run along a line of constant u or v get no inner points at all: the cells of the grid
//! cut them at every line they cross, so the grid's density governs their chord. The same holds for every straight piece
//! on a plane.
//!
//! Limits: deviations are sampled, at three places a segment and more where the curve's degree or the surface's spans
//! suggest it; they are not a proof.

use glam::{DVec2, DVec3};

use super::checked::{CheckedCurve, CheckedLoop, CheckedTrims};
use super::pieces::{Piece, Run};
use crate::engine::nurbs::{Domain, Surface};

/// The largest sagitta of a segment as a part of its chord: a circle's arc of 40 degrees has 0.088 of it.
const SAGITTA_SHARE: f64 = 0.09;

/// How often the parts of a piece may be cut again for the tolerance's sake; each cut makes at least two of one.
const MAX_CUTS: u32 = 16;

/// How often they may be cut for [`SAGITTA_SHARE`] alone. At a cusp no cut helps, so this is small.
const MAX_TURN_CUTS: u32 = 3;

/// The most parts that one segment is cut into at once.
const MAX_PARTS: f64 = 256.0;

/// Probes of a part of a piece. Two see an arc and an S alike.
const PROBES: usize = 2;

/// The most probes on one piece before it is cut.
const MAX_PROBES: usize = 64;

/// A piece whose bound from its ends alone is below this part of the tolerance is not probed. Most pieces of splines
/// with many are; the bound is not quite one, so half of the tolerance is left for that.
const HERMITE_SHARE: f64 = 0.5;

/// More parts than the probes ask for, relatively: a part that is just too long is cut in two, which costs more.
const PARTS_MARGIN: f64 = 0.03;

/// The most segments that are joined to one.
const MAX_JOINED: usize = 256;

/// Kinks within a curve from this angle on are kept and are corners (radians; 3 degrees). Smaller ones come from
/// approximation, and a knife does not stop for them.
pub(super) const CORNER_ANGLE: f64 = 0.052;

/// A point of a polyline, and the segment that begins there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ChordPoint {
    pub(super) uv: DVec2,
    /// Place of the curve in its loop's walk.
    pub(super) place: u32,
    /// Parameter at the point, and where the segment ends.
    pub(super) t: [f64; 2],
    /// How far the curve is from the segment, in the metric that it was made with; 0 when it is straight.
    pub(super) deviation: f64,
    pub(super) corner: bool,
}

/// What lengths are measured by.
pub(super) enum Metric<'a> {
    /// A constant metric: a plane, or the domain itself. Its `Su` and `Sv`.
    Constant(DVec3, DVec3),
    /// A curved surface.
    Curved(&'a Surface),
}

impl<'a> Metric<'a> {
    /// The metric of a surface.
    pub(super) fn of(surface: &'a Surface) -> Self {
        /// How far the fourth corner of a bilinear patch may be from the plane's, relative to its diagonals.
        const PLANE: f64 = 1e-12;
        if let ([a, b, c, d], None) = (surface.control(), surface.weights()) {
            // Net of 2 x 2: a = (0, 0), b = (0, 1), c = (1, 0), d = (1, 1).
            if (*a - *b - *c + *d).length() <= PLANE * (a.distance(*d) + b.distance(*c)) {
                let Domain { u, v } = surface.domain();
                let (_, su, sv) = surface.first_derivatives(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
                return Self::Constant(su, sv);
            }
        }
        Self::Curved(surface)
    }

    /// The metric of the domain itself, scaled to a unit square.
    pub(super) fn of_domain(domain: &Domain) -> Self {
        Self::Constant(DVec3::X / (domain.u[1] - domain.u[0]), DVec3::Y / (domain.v[1] - domain.v[0]))
    }

    /// True when a straight line in the domain is straight in space.
    const fn keeps_lines(&self) -> bool {
        matches!(self, Self::Constant(..))
    }

    fn sample(&self, t: f64, uv: DVec2, from: DVec2) -> Sample {
        match self {
            Self::Constant(su, sv) => {
                let d = uv - from;
                Sample { t, uv, point: *su * d.x + *sv * d.y, su: *su, sv: *sv }
            }
            Self::Curved(surface) => {
                let (point, su, sv) = surface.first_derivatives(uv.x, uv.y);
                Sample { t, uv, point, su, sv }
            }
        }
    }

    /// The angle between two directions at a point, in [0, pi]; `None` when one of them has no length.
    pub(super) fn turn(&self, uv: DVec2, a: DVec2, b: DVec2, size: DVec2) -> Option<f64> {
        let at = self.sample(0.0, uv, uv);
        let map = |d: DVec2| at.su * d.x + at.sv * d.y;
        let angle = |a: DVec3, b: DVec3| Some(a.try_normalize()?.cross(b.try_normalize()?).length().atan2(a.dot(b)));
        // At a pole a direction may have no length in space; the domain's own angle is the next best.
        angle(map(a), map(b)).or_else(|| angle((a / size).extend(0.0), (b / size).extend(0.0)))
    }
}

/// A point on a curve with its image.
#[derive(Debug, Clone, Copy)]
struct Sample {
    t: f64,
    uv: DVec2,
    point: DVec3,
    su: DVec3,
    sv: DVec3,
}

impl Sample {
    /// A point whose image is not asked for (yet).
    const fn bare(t: f64, uv: DVec2) -> Self {
        Self { t, uv, point: DVec3::NAN, su: DVec3::ZERO, sv: DVec3::ZERO }
    }

    const fn is_bare(&self) -> bool {
        self.point.x.is_nan()
    }

    /// How far this point is from the segment between two others, by either of the two measures.
    fn deviation(&self, a: &Self, b: &Self, flat: bool) -> f64 {
        let space = off_segment(self.point - a.point, b.point - a.point);
        if flat {
            return space.sqrt();
        }
        let map = |d: DVec2| self.su * d.x + self.sv * d.y;
        space.max(off_segment(map(self.uv - a.uv), map(b.uv - a.uv))).sqrt()
    }
}

/// The squared distance of `d` from the segment from the origin to `e`.
fn off_segment(d: DVec3, e: DVec3) -> f64 {
    let length = e.length_squared();
    let along = if length > 0.0 { (d.dot(e) / length).clamp(0.0, 1.0) } else { 0.0 };
    (d - e * along).length_squared()
}

/// A point of a curve's polyline before pieces are joined.
#[derive(Debug, Clone, Copy)]
struct Step {
    at: Sample,
    /// Deviation of the segment that ends here.
    deviation: f64,
    /// True where the polyline must not be straightened.
    kept: bool,
    /// How the piece that ends here runs, when it is straight.
    run: Option<Run>,
}

/// Makes polylines of the loops of `trims`. Scratch space is kept from one curve to the next.
pub(super) struct Chords<'a> {
    trims: &'a CheckedTrims,
    metric: Metric<'a>,
    tolerance: f64,
    /// Segments of one piece that are still to be tried: own parameter of the end, the sample there, cuts so far.
    open: Vec<(f64, Sample, u32)>,
    /// The curve's points.
    line: Vec<Step>,
    /// The segment that is tried, its ends included.
    probes: Vec<Sample>,
    /// How much each inner probe's neighbourhood bends, in parts of the segment to come.
    weights: Vec<f64>,
}

impl<'a> Chords<'a> {
    pub(super) const fn new(trims: &'a CheckedTrims, metric: Metric<'a>, tolerance: f64) -> Self {
        Self { trims, metric, tolerance, open: Vec::new(), line: Vec::new(), probes: Vec::new(), weights: Vec::new() }
    }

    /// Appends the points of a loop in walking order. `limit` is the most points that `out` may hold; false when that is not
    /// enough.
    pub(super) fn whole(&mut self, checked: &CheckedLoop, out: &mut Vec<ChordPoint>, limit: usize) -> bool {
        let trims = self.trims;
        let end = |curve: &CheckedCurve, last: bool| {
            let last = last != curve.backwards();
            let piece = &trims.pieces.list[if last { curve.pieces.end - 1 } else { curve.pieces.start }];
            piece.ends[usize::from(last)]
        };
        let next = checked.curves.iter().cycle().skip(1);
        for (place, (curve, next)) in checked.curves.iter().zip(next).enumerate() {
            if !self.curve(curve, place as u32, out, limit) {
                return false;
            }
            // Where a jump along a pole was left open the end of a curve is a point of its own.
            let uv = end(curve, true);
            if uv != end(next, false) {
                out.push(ChordPoint { uv, place: place as u32, t: [curve.t_end; 2], deviation: 0.0, corner: true });
            }
        }
        true
    }

    /// Appends the points of a curve, its end left out, in walking order. `limit` is the most points that `out` may hold;
    /// false when that is not enough.
    fn curve(&mut self, curve: &CheckedCurve, place: u32, out: &mut Vec<ChordPoint>, limit: usize) -> bool {
        let trims = self.trims;
        let backwards = curve.backwards();
        let range = curve.pieces.clone();
        let count = range.len();
        let nth = |step: usize| &trims.pieces.list[if backwards { range.end - 1 - step } else { range.start + step }];
        let first = nth(0);
        let (t, uv) = if backwards { (first.t[1], first.ends[1]) } else { (first.t[0], first.ends[0]) };
        self.line.clear();
        self.line.push(Step { at: Sample::bare(t, uv), deviation: 0.0, kept: true, run: None });
        for step in 0..count {
            let piece = nth(step);
            self.piece(piece, backwards);
            if out.len() + self.line.len() > limit {
                return false;
            }
            if step + 1 < count
                && let Some(last) = self.line.last_mut()
            {
                last.kept = is_kink(trims, &self.metric, piece, nth(step + 1), backwards);
            }
        }
        self.emit(curve, place, out);
        true
    }

    /// Appends the points of one piece, its start left out.
    fn piece(&mut self, piece: &Piece, backwards: bool) {
        let origin = self.line[0].at.uv;
        let (trims, flat) = (self.trims, self.metric.keeps_lines());
        let far = usize::from(!backwards);
        let straight = match piece.run {
            Run::ConstantU | Run::ConstantV => true,
            Run::Line => flat,
            Run::Curved => false,
        };
        if straight {
            let at = Sample::bare(piece.t[far], piece.ends[far]);
            self.line.push(Step { at, deviation: 0.0, kept: false, run: Some(piece.run) });
            return;
        }
        let sample = |metric: &Metric<'_>, s: f64| {
            // By way of the curve's parameter, so that it gives the same point again, bit for bit.
            let t = piece.parameter(if backwards { 1.0 - s } else { s });
            metric.sample(t, trims.evaluate(piece, piece.own(t)), origin)
        };
        let Some(last) = self.line.last_mut() else { return };
        if last.at.is_bare() {
            last.at = self.metric.sample(last.at.t, last.at.uv, origin);
        }
        let mut from = last.at;
        let end = sample(&self.metric, 1.0);
        let whole = Step { at: end, deviation: 0.0, kept: false, run: None };
        if let Some(bound) = self.hermite_bound(piece, &from, &end, backwards)
            && bound <= HERMITE_SHARE * self.tolerance
            && bound <= SAGITTA_SHARE * from.point.distance(end.point)
        {
            self.line.push(Step { deviation: bound, ..whole });
            return;
        }
        let mut at = 0.0;
        self.open.clear();
        self.open.push((1.0, end, 0));
        while let Some((to, end, cuts)) = self.open.pop() {
            let count = if cuts == 0 {
                first_probes(&self.metric, piece)
            } else if flat && piece.degree() == 2 {
                // A conic has no inflections, and its middle is as good as where it is farthest from the chord.
                1
            } else {
                PROBES
            };
            let worst = self.probe(&from, &end, count, |metric, k| sample(metric, at + (to - at) * k));
            let chord = from.point.distance(end.point);
            let too_far = worst > self.tolerance && cuts < MAX_CUTS;
            let too_round = worst > SAGITTA_SHARE * chord && cuts < MAX_TURN_CUTS;
            if !too_far && !too_round {
                self.line.push(Step { at: end, deviation: worst, ..whole });
                (at, from) = (to, end);
                continue;
            }
            // Many parts need to know better how the piece bends.
            let most = (self.parts(too_far, too_round) as usize).min(MAX_PROBES);
            if most > 2 * count {
                self.probe(&from, &end, most, |metric, k| sample(metric, at + (to - at) * k));
            }
            let parts = self.parts(too_far, too_round).ceil().clamp(2.0, MAX_PARTS);
            self.open.push((to, end, cuts + 1));
            for k in (1..parts as usize).rev() {
                let s = at + (to - at) * self.cut(k as f64 / parts);
                self.open.push((s, sample(&self.metric, s), cuts + 1));
            }
        }
    }

    /// How far a short, simple piece is from its chord at most, from its ends and tangents alone: it is all but the cubic
    /// with these (Hermite's), whose control points bound it by 3/4 of their own distance. `None` where the piece, or the
    /// surface below it, may have waves that its ends do not show.
    fn hermite_bound(&self, piece: &Piece, from: &Sample, end: &Sample, backwards: bool) -> Option<f64> {
        let Metric::Curved(surface) = self.metric else { return None };
        if piece.degree() > 3 || !within_quarter_span(surface, piece) {
            return None;
        }
        let mut d = self.trims.pieces.end_derivatives(piece);
        if backwards {
            d = [-d[1], -d[0]];
        }
        let chord = end.point - from.point;
        let reach = |s: &Sample, d: DVec2, other: DVec2| {
            let map = |d: DVec2| s.su * d.x + s.sv * d.y;
            let step = map(d) / 3.0;
            off_segment(step, chord).max(off_segment(step, map(other)))
        };
        let span = end.uv - from.uv;
        let first = reach(from, d[0], span);
        // At the end all is seen from there, backwards.
        let map = |d: DVec2| end.su * d.x + end.sv * d.y;
        let step = -map(d[1]) / 3.0;
        let last = off_segment(step, -chord).max(off_segment(step, -map(span)));
        Some(0.75 * first.max(last).sqrt())
    }

    /// Samples a segment at `count` inner places and gives the deviation of the curve from the chord.
    fn probe(&mut self, from: &Sample, end: &Sample, count: usize, sample: impl Fn(&Metric<'_>, f64) -> Sample) -> f64 {
        let flat = self.metric.keeps_lines();
        self.probes.clear();
        self.probes.push(*from);
        let mut worst = 0.0_f64;
        for k in 1..=count {
            let probe = sample(&self.metric, k as f64 / (count + 1) as f64);
            worst = worst.max(probe.deviation(from, end, flat));
            self.probes.push(probe);
        }
        self.probes.push(*end);
        // The largest deviation of an arc lies between two even probes.
        let even = if count.is_multiple_of(2) { (count + 1) as f64 } else { f64::INFINITY };
        worst / (1.0 - 1.0 / (even * even))
    }

    /// How many parts the probed segment is to be cut into, not rounded; what each of the probes adds to it is kept.
    fn parts(&mut self, too_far: bool, too_round: bool) -> f64 {
        let flat = self.metric.keeps_lines();
        self.weights.clear();
        for w in self.probes.windows(3) {
            let off = w[1].deviation(&w[0], &w[2], flat);
            let far = if too_far { (off / self.tolerance).sqrt() } else { 0.0 };
            let round = if too_round { off / (SAGITTA_SHARE * w[0].point.distance(w[2].point)) } else { 0.0 };
            // Three probes span two steps. Closed loops within them have no chord: cut as often as is allowed.
            self.weights.push((0.5 * far.max(round)).min(MAX_PARTS));
        }
        self.bending() * (1.0 + PARTS_MARGIN)
    }

    /// The sum of the weights; the two outer half steps bend as their neighbours do.
    fn bending(&self) -> f64 {
        let outer =
            self.weights.first().copied().unwrap_or_default() + self.weights.last().copied().unwrap_or_default();
        self.weights.iter().sum::<f64>() + 0.5 * outer
    }

    /// Where in [0, 1] of the probed segment the share `share` of its bending lies before.
    fn cut(&self, share: f64) -> f64 {
        let count = self.weights.len();
        let mut left = share * self.bending();
        // Step k covers half of the neighbourhoods of the probes at both of its ends.
        for k in 0..=count {
            let step = 0.5 * (self.weights[k.saturating_sub(1)] + self.weights[k.min(count - 1)]);
            if left <= step {
                let within = if step > 0.0 { left / step } else { 0.5 };
                return (k as f64 + within) / (count + 1) as f64;
            }
            left -= step;
        }
        // Rounding alone leads here, for a share close to 1.
        share
    }

    /// Joins what may be joined and appends the points.
    fn emit(&self, curve: &CheckedCurve, place: u32, out: &mut Vec<ChordPoint>) {
        let line = &self.line;
        // Inner points of one piece are as far apart as they can be: only pieces can be joined.
        let joins = curve.pieces.len() > 1 && !curve.polyline;
        let mut i = 0;
        while i + 1 < line.len() {
            let (mut j, mut deviation) = (i + 1, line[i + 1].deviation);
            // Ever longer strides, and shorter ones again when a stride was too long.
            let (mut stride, mut grows) = (1, true);
            while joins && stride > 0 && j - i < MAX_JOINED {
                if let Some(joined) = line.get(j + stride).and_then(|_| self.joined(i, j + stride)) {
                    (j, deviation) = (j + stride, joined);
                    stride = if grows { 2 * stride } else { stride };
                } else {
                    (stride, grows) = (stride / 2, false);
                }
            }
            let from = &line[i];
            out.push(ChordPoint {
                uv: from.at.uv,
                place,
                t: [from.at.t, line[j].at.t],
                deviation,
                corner: if i == 0 { curve.corner_at_start } else { from.kept || curve.polyline },
            });
            i = j;
        }
    }

    /// The deviation of one segment from step `i` to step `k` of the line in place of those between, if it is good.
    fn joined(&self, i: usize, k: usize) -> Option<f64> {
        let (a, b) = (&self.line[i].at, &self.line[k].at);
        let inner = &self.line[i + 1..k];
        if inner.iter().any(|s| s.kept) {
            return None;
        }
        let run = self.line[k].run;
        if let Some(Run::ConstantU | Run::ConstantV) = run {
            // Along one line, and never back: the middle ones lie between the ends.
            let between = |p: DVec2| p.cmpge(a.uv.min(b.uv)).all() && p.cmple(a.uv.max(b.uv)).all();
            let along = inner.iter().all(|s| s.run == run && between(s.at.uv));
            return along.then_some(0.0);
        }
        if a.is_bare() || b.is_bare() || inner.iter().any(|s| s.at.is_bare()) {
            return None;
        }
        let flat = self.metric.keeps_lines();
        let most = self.tolerance.min(SAGITTA_SHARE * a.point.distance(b.point));
        let was = inner.iter().map(|s| s.deviation).fold(self.line[k].deviation, f64::max);
        let off = inner.iter().map(|s| s.at.deviation(a, b, flat)).fold(0.0, f64::max);
        (was + off <= most).then_some(was + off)
    }
}

/// Whether a curve turns sharply from one piece to the next.
fn is_kink(trims: &CheckedTrims, metric: &Metric<'_>, piece: &Piece, next: &Piece, backwards: bool) -> bool {
    /// A turn below this in the scaled domain is none in space either, unless the surface is stretched a thousandfold.
    const SURELY_SMOOTH: f64 = 1e-5;
    let a = trims.pieces.tangent(piece, !backwards);
    let b = trims.pieces.tangent(next, backwards);
    let d = trims.domain;
    let size = DVec2::new(d.u[1] - d.u[0], d.v[1] - d.v[0]);
    let (x, y) = (a / size, b / size);
    if x.dot(y) > 0.0 && x.perp_dot(y).abs() <= SURELY_SMOOTH * x.length() * y.length() {
        return false;
    }
    let uv = piece.ends[usize::from(!backwards)];
    metric.turn(uv, a, b, size).is_some_and(|angle| angle > CORNER_ANGLE)
}

/// How many probes a whole piece needs so that no wave of the curve or of the surface below it is missed.
fn first_probes(metric: &Metric<'_>, piece: &Piece) -> usize {
    let spans = match metric {
        Metric::Constant(..) => 0,
        Metric::Curved(surface) => {
            let [a, b] = piece.ends;
            surface.knots_u().span(a.x).abs_diff(surface.knots_u().span(b.x))
                + surface.knots_v().span(a.y).abs_diff(surface.knots_v().span(b.y))
        }
    };
    (1 + (piece.degree() + spans).next_multiple_of(2)).min(MAX_PROBES)
}

/// Whether a piece stays within a quarter of one span of the surface, in u and in v.
fn within_quarter_span(surface: &Surface, piece: &Piece) -> bool {
    let [a, b] = piece.ends;
    [(surface.knots_u(), a.x, b.x), (surface.knots_v(), a.y, b.y)].into_iter().all(|(knots, a, b)| {
        let span = knots.span(a);
        let [low, high] = [knots.knots()[span], knots.knots()[span + 1]];
        (low..=high).contains(&b) && 4.0 * (a - b).abs() <= high - low
    })
}
