//! The part's boundary in the plane: trimming curves mapped exactly and sampled to a tolerance.
//!
//! The polygonised loops ([`TrimRegion`]) say where the curves' corners and kinks are and give the parameter of each of
//! their points. Between two neighbouring points the exact curve `c(t)` is mapped through the flattening and bisected until
//! no probe is farther than an eighth of the tolerance from the two chords to the middle, which stays with the ends. These samples are
//! what is worked on; in the end curves are fitted through them, and points (never corners) are taken out of the polyline
//! while all that was sampled stays within half the tolerance ([`super::settle`]). So an arc that unrolls into a straight
//! line keeps two points.

use glam::DVec2;

use super::fitting::SAMPLED;
use super::flat_map::{FlatMap, Mapped};
use super::lengths::curve_length;
use crate::engine::budget::Observer;
use crate::engine::distortion::BoundaryReport;
use crate::engine::error::EngineError;
use crate::engine::nurbs::Surface;
use crate::engine::trimming::{BoundaryLoop, CheckedTrims, TrimRegion};

/// A probe is looked at for each such part of the domain's width that an interval runs through, so that no wave of the
/// flattening below it is missed.
const PROBE_STEP: f64 = 1.0 / 48.0;

/// Probes of an interval at least: they catch an S within it.
const LEAST_PROBES: usize = 3;

/// How often an interval may be bisected: bounds the work where the flattening is wild.
const DEEPEST: u32 = 14;

/// The most points that are sampled for one pattern.
const MOST_POINTS: usize = 2_000_000;

/// The most sampled points that one chord may replace: bounds the work of taking points out.
const MOST_JOINED: usize = 128;

/// Chords between two questions whether to go on, while points are taken out: each looks at a few thousand at the most.
const CHORDS_BETWEEN_CHECKS: usize = 256;

/// A loop is drawn at least this finely relative to its own size, however coarse the tolerance: small holes stay round.
pub(super) const OF_LOOP: f64 = 0.01;

/// Neighbouring points nearer than this, relative to the loop's size, are one: ends of a degenerate edge.
pub(super) const SAME_POINT: f64 = 1e-9;

/// One loop as it lies in the flattening (not yet placed), in its walking order.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FlatLoop {
    /// Points.
    pub(super) points: Vec<DVec2>,
    /// True where a point is a corner.
    pub(super) corners: Vec<bool>,
    /// The piece of the mesh that it lies in.
    pub(super) piece: u32,
}

/// What the curves are traced with.
pub(super) struct Tracer<'a> {
    pub(super) surface: &'a Surface,
    pub(super) trims: &'a CheckedTrims,
    pub(super) region: &'a TrimRegion,
    pub(super) map: &'a FlatMap<'a>,
    /// Largest distance between a curve and its polyline, mm.
    pub(super) tolerance: f64,
    /// Asked before each interval.
    pub(super) observer: &'a dyn Observer,
}

/// The curve between two neighbouring points of a polygonised loop, with a parameter from 0 to 1.
#[derive(Debug, Clone, Copy)]
struct Interval<'a> {
    trims: &'a CheckedTrims,
    ends: [DVec2; 2],
    /// Loop, curve and parameters, where the interval is part of a curve.
    curve: Option<(usize, usize, [f64; 2])>,
}

impl Interval<'_> {
    /// The point of the domain at `x` in [0, 1].
    fn at(&self, x: f64) -> DVec2 {
        match self.curve {
            _ if x <= 0.0 => self.ends[0],
            _ if x >= 1.0 => self.ends[1],
            Some((loop_index, curve, [t0, t1])) => self.trims.point(loop_index, curve, t0 + (t1 - t0) * x),
            None => self.ends[0].lerp(self.ends[1], x),
        }
    }
}

impl Tracer<'_> {
    /// The intervals of a loop, in order.
    fn intervals(&self, index: usize) -> impl Iterator<Item = Interval<'_>> {
        let boundary = &self.region.loops[index];
        let count = boundary.points.len();
        (0..count).map(move |k| {
            let next = (k + 1) % count;
            let curve = boundary.sources.get(k).map(|from| {
                let to = &boundary.sources[next];
                // The last interval of a curve ends where the walk leaves it; a loop may be a single curve.
                let end =
                    if to.curve == from.curve && next != 0 { to.t } else { self.leaves(index, from.curve as usize) };
                (index, from.curve as usize, [from.t, end])
            });
            Interval { trims: self.trims, ends: [boundary.points[k], boundary.points[next]], curve }
        })
    }

    /// The parameter at which the walk leaves a curve.
    fn leaves(&self, loop_index: usize, curve: usize) -> f64 {
        let curves = &self.trims.loops()[loop_index].curves;
        curves.iter().find(|c| c.curve == curve).map_or(0.0, |c| c.t_end)
    }

    /// The piece of the mesh that most of a loop lies in.
    fn piece(&self, index: usize) -> u32 {
        let count = self.map.piece_count();
        if count <= 1 {
            return 0;
        }
        let mut votes = vec![0_u32; count];
        for interval in self.intervals(index) {
            votes[self.map.piece_at(interval.at(0.5)) as usize] += 1;
        }
        let most = votes.iter().copied().max().unwrap_or(0);
        votes.iter().position(|&v| v == most).unwrap_or(0) as u32
    }

    /// A loop in the flattening. `None` where it is not flattened.
    ///
    /// # Errors
    /// [`EngineError::Parameter`] when the tolerance asks for more points than are allowed (`budget` counts them);
    /// [`EngineError::Cancelled`] when the observer asks for it.
    pub(super) fn flat_loop(&self, index: usize, budget: &mut usize) -> Result<Option<FlatLoop>, EngineError> {
        let boundary = &self.region.loops[index];
        let piece = self.piece(index);
        let at = |uv: DVec2| self.map.at(uv, piece).map_or(DVec2::NAN, |m| m.flat);
        let vertices: Vec<DVec2> = boundary.points.iter().map(|&uv| at(uv)).collect();
        if !vertices.iter().all(|p| p.is_finite()) {
            return Ok(None);
        }
        let low = vertices.iter().fold(DVec2::INFINITY, |m, p| m.min(*p));
        let high = vertices.iter().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p));
        let size = low.distance(high);
        let near = SAMPLED * self.tolerance.min(OF_LOOP * size);
        let mut points = Vec::with_capacity(2 * vertices.len());
        let mut corners = Vec::with_capacity(2 * vertices.len());
        for (k, interval) in self.intervals(index).enumerate() {
            self.observer.check()?;
            points.push(vertices[k]);
            corners.push(boundary.corners.get(k).copied().unwrap_or(true));
            let ends = [vertices[k], vertices[(k + 1) % vertices.len()]];
            self.bisect(&interval, &at, ends, near, &mut points);
            corners.resize(points.len(), false);
            if *budget + points.len() > MOST_POINTS {
                return Err(too_fine(self.tolerance));
            }
        }
        *budget += points.len();
        if !points.iter().all(|p| p.is_finite()) {
            return Ok(None);
        }
        let (points, corners) = distinct(&points, &corners, SAME_POINT * size);
        Ok((points.len() > 2).then_some(FlatLoop { points, corners, piece }))
    }

    /// Appends the inner points of an interval, in order.
    fn bisect(
        &self,
        interval: &Interval<'_>,
        at: &impl Fn(DVec2) -> DVec2,
        ends: [DVec2; 2],
        tolerance: f64,
        out: &mut Vec<DVec2>,
    ) {
        let domain = self.surface.domain();
        let width = DVec2::new(domain.u[1] - domain.u[0], domain.v[1] - domain.v[0]);
        let run = ((interval.ends[1] - interval.ends[0]) / width).length();
        // Odd, so that the middle is a probe.
        let first = (LEAST_PROBES + (run / PROBE_STEP).min(96.0) as usize) | 1;
        let mut open = vec![([0.0, 1.0], ends, first, 0)];
        while let Some(([x0, x1], [a, b], probes, depth)) = open.pop() {
            let step = (x1 - x0) / (probes + 1) as f64;
            let samples: Vec<DVec2> = (1..=probes).map(|k| at(interval.at(x0 + step * k as f64))).collect();
            let middle = samples[probes / 2];
            let near = samples.iter().enumerate().all(|(k, &p)| {
                let [from, to] = if k < probes / 2 { [a, middle] } else { [middle, b] };
                distance_to_segment(p, from, to) <= tolerance
            });
            let finite = samples.iter().all(|p| p.is_finite());
            if near || depth == DEEPEST || !finite || out.len() > MOST_POINTS {
                if x0 > 0.0 {
                    out.push(a);
                }
                out.push(middle);
                continue;
            }
            let xm = 0.5 * (x0 + x1);
            let fewer = (probes / 2).max(LEAST_PROBES) | 1;
            open.push(([xm, x1], [middle, b], fewer, depth + 1));
            open.push(([x0, xm], [a, middle], fewer, depth + 1));
        }
    }

    /// The three lengths of a loop.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`] when the observer asks for it.
    pub(super) fn lengths(&self, index: usize) -> Result<BoundaryReport, EngineError> {
        let boundary = &self.region.loops[index];
        let piece = self.piece(index);
        let on_surface = |uv: DVec2| self.surface.point(uv.x, uv.y);
        let nowhere = Mapped { flat: DVec2::NAN, mesh: glam::DVec3::NAN };
        let mapped = |uv: DVec2| self.map.at(uv, piece).unwrap_or(nowhere);
        let scale: f64 = segments(boundary).map(|[a, b]| on_surface(a).distance(on_surface(b))).sum();
        let mut report = BoundaryReport {
            source_loop: boundary.source_loop,
            hole: boundary.depth % 2 == 1,
            ..BoundaryReport::default()
        };
        for interval in self.intervals(index) {
            self.observer.check()?;
            let range = [0.0, 1.0];
            report.length_3d_mm += curve_length(&|x| on_surface(interval.at(x)), &glam::DVec3::distance, range, scale);
            report.length_mesh_mm +=
                curve_length(&|x| mapped(interval.at(x)).mesh, &glam::DVec3::distance, range, scale);
            report.length_2d_mm += curve_length(&|x| mapped(interval.at(x)).flat, &DVec2::distance, range, scale);
        }
        Ok(report)
    }
}

/// The closed polyline's segments.
fn segments(boundary: &BoundaryLoop) -> impl Iterator<Item = [DVec2; 2]> + '_ {
    let next = boundary.points.iter().skip(1).chain(boundary.points.first());
    boundary.points.iter().zip(next).map(|(&a, &b)| [a, b])
}

fn too_fine(tolerance: f64) -> EngineError {
    EngineError::Parameter {
        name: "curve_tolerance_mm".into(),
        detail: format!(
            "{tolerance} mm asks for more than {MOST_POINTS} points on the pattern's curves; a larger one is needed"
        ),
    }
}

/// Distance of a point from a segment.
fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (edge, to) = (b - a, p - a);
    let square = edge.length_squared();
    let x = if square > 0.0 { (to.dot(edge) / square).clamp(0.0, 1.0) } else { 0.0 };
    to.distance(edge * x)
}

/// A closed polyline without repeated points; what stands for a corner is one.
fn distinct(points: &[DVec2], corners: &[bool], same: f64) -> (Vec<DVec2>, Vec<bool>) {
    let mut out: (Vec<DVec2>, Vec<bool>) = (Vec::with_capacity(points.len()), Vec::with_capacity(points.len()));
    for (&p, &corner) in points.iter().zip(corners) {
        match (out.0.last(), out.1.last_mut()) {
            (Some(last), Some(flag)) if last.distance(p) <= same => *flag |= corner,
            _ => {
                out.0.push(p);
                out.1.push(corner);
            }
        }
    }
    while out.0.len() > 1 && out.0[0].distance(out.0[out.0.len() - 1]) <= same {
        out.0.pop();
        if out.1.pop() == Some(true) {
            out.1[0] = true;
        }
    }
    out
}

/// A closed polyline without the points that a chord within `tolerance` can replace, and without repeated ones. The first
/// point and all corners stay.
pub(super) fn thinned(
    points: &[DVec2],
    corners: &[bool],
    tolerance: f64,
    same: f64,
    observer: &dyn Observer,
) -> Result<(Vec<DVec2>, Vec<bool>), EngineError> {
    let count = points.len();
    let at = |k: usize| points[k % count];
    let mut out: (Vec<DVec2>, Vec<bool>) = (Vec::new(), Vec::new());
    let mut i = 0;
    while i < count {
        if out.0.len().is_multiple_of(CHORDS_BETWEEN_CHECKS) {
            observer.check()?;
        }
        match out.0.last() {
            Some(last) if last.distance(points[i]) <= same => {
                if let Some(corner) = out.1.last_mut() {
                    *corner |= corners[i];
                }
            }
            _ => {
                out.0.push(points[i]);
                out.1.push(corners[i]);
            }
        }
        let mut j = i + 1;
        while j < count && !corners[j] && j - i < MOST_JOINED {
            let all_near = (i + 1..=j).all(|k| distance_to_segment(points[k], points[i], at(j + 1)) <= tolerance);
            if !all_near {
                break;
            }
            j += 1;
        }
        i = j;
    }
    // The closing pair.
    while out.0.len() > 1 && out.0[0].distance(out.0[out.0.len() - 1]) <= same {
        out.0.pop();
        if out.1.pop() == Some(true) {
            out.1[0] = true;
        }
    }
    Ok(out)
}
