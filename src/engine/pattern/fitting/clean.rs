//! Samples as they are fitted: finite, apart from each other, with true corners, cut into runs.

use glam::DVec2;

use super::reach::farthest;
use super::run::{Run, Store};
use super::{FINEST, OF_SIZE, SAMPLED, angle, distance_to_segment};

/// Samples nearer to each other than this part of the tolerance are one: no edge of a fit is shorter.
pub(super) const MICRO: f64 = 0.25;

/// Samples within this part of the tolerance of a chord between others are left out: curves are not followed better by more samples, only
/// slower. Samples lie apart by what makes an eighth ([`SAMPLED`]), so few are.
const DENSE: f64 = 1.0 / 32.0;

/// At a corner the curve turns by at least this, radians (1 degree); less is the joint of a dense polyline. Kinks
/// within trimming curves count as corners from 3 degrees on.
const CORNER: f64 = std::f64::consts::PI / 180.0;

/// Samples to fit, with what may be done to them.
#[derive(Debug)]
pub(super) struct Clean {
    /// Points. A closed curve starts at a corner where it has one, and repeats its first point at its end.
    store: Store,
    corners: Vec<bool>,
    /// Whether the curve closes.
    pub(super) closed: bool,
    /// By how much the fit may leave the samples.
    pub(super) tolerance: f64,
    /// The greatest distance of samples from those that stand for them.
    pub(super) moved: f64,
}

impl Clean {
    pub(super) fn new(points: &[DVec2], corners: &[bool], closed: bool, tolerance: f64) -> Option<Self> {
        let usable = tolerance > 0.0 && tolerance.is_finite() && points.iter().all(|p| p.is_finite());
        if points.len() < 2 || !usable {
            return None;
        }
        let low = points.iter().fold(DVec2::INFINITY, |m, p| m.min(*p));
        let high = points.iter().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p));
        let size = low.distance(high);
        let greatest = low.abs().max(high.abs()).max_element();
        let tolerance = tolerance.min(OF_SIZE * size).max(FINEST * greatest);
        if !(size.is_finite() && size > tolerance) {
            return None;
        }
        let (kept, flags, merged) = apart(points, corners, closed, MICRO * tolerance);
        if kept.len() < 2 {
            return None;
        }
        let (mut kept, mut flags, left_out) = sparse(&kept, &flags, DENSE * tolerance);
        let moved = merged + left_out;
        if closed {
            kept.push(kept[0]);
            flags.push(flags[0]);
        } else {
            let last = flags.len() - 1;
            (flags[0], flags[last]) = (true, true);
        }
        let mut clean = Self {
            store: Store::new(kept),
            corners: flags,
            closed,
            tolerance: (1.0 - SAMPLED) * tolerance - moved,
            moved,
        };
        clean.demote();
        clean.turn();
        Some(clean)
    }

    /// All points; a closed curve repeats its first one at its end.
    pub(super) fn points(&self) -> &[DVec2] {
        &self.store.points
    }

    /// Takes the flags off corners at which the curve hardly turns.
    fn demote(&mut self) {
        let last = self.corners.len() - 1;
        let flagged: Vec<usize> = (0..=last).filter(|&k| self.corners[k]).collect();
        let mut keep = Vec::with_capacity(flagged.len());
        for (n, &k) in flagged.iter().enumerate() {
            let ends = k == 0 || k == last;
            if ends && !self.closed {
                keep.push(true);
                continue;
            }
            // The samples up to the next corners on both sides; a closed curve has its first point at both ends.
            let previous =
                if k == 0 { flagged[flagged.len() - 2] } else { flagged.get(n.wrapping_sub(1)).copied().unwrap_or(0) };
            let next = if k == last { flagged[1] } else { flagged.get(n + 1).copied().unwrap_or(last) };
            let (before, after) = if ends { ([previous, last], [0, next]) } else { ([previous, k], [k, next]) };
            let run = |[from, to]: [usize; 2]| Run::new(&self.store, from, to, false, self.tolerance);
            let (run_before, run_after) = (run(before), run(after));
            keep.push(angle(run_before.tangent(run_before.last()), run_after.tangent(0)) >= CORNER);
        }
        for (&k, keep) in flagged.iter().zip(keep) {
            self.corners[k] = keep;
        }
    }

    /// Makes a closed curve start at a corner, or else at the end of something straight.
    fn turn(&mut self) {
        if !self.closed || self.corners[0] {
            return;
        }
        let last = self.corners.len() - 1;
        let start = self.corners.iter().position(|&c| c).or_else(|| {
            let whole = Run::new(&self.store, 0, last, true, self.tolerance);
            super::straight::stretches(&whole).first().map(|s| s[1] % last)
        });
        let Some(start) = start.filter(|&s| s > 0) else { return };
        let mut points = self.store.points[..last].to_vec();
        self.corners.pop();
        points.rotate_left(start);
        self.corners.rotate_left(start);
        points.push(points[0]);
        self.corners.push(self.corners[0]);
        self.store = Store::new(points);
    }

    /// The runs between corners, in order.
    pub(super) fn runs(&self) -> Vec<Run<'_>> {
        let last = self.corners.len() - 1;
        let mut ends: Vec<usize> = (1..last).filter(|&k| self.corners[k]).collect();
        ends.push(last);
        let smooth = self.closed && !self.corners[0];
        let mut from = 0;
        ends.into_iter()
            .map(|to| {
                let run = Run::new(&self.store, from, to, smooth, self.tolerance);
                from = to;
                run
            })
            .collect()
    }
}

/// The points that are farther apart than `least`, whether they are corners, and how far the others were from the one that stands
/// for them. Corners stand for what is near them, and so do the ends.
fn apart(points: &[DVec2], corners: &[bool], closed: bool, least: f64) -> (Vec<DVec2>, Vec<bool>, f64) {
    let mut kept: Vec<DVec2> = Vec::with_capacity(points.len());
    let mut flags: Vec<bool> = Vec::with_capacity(points.len());
    let mut moved = 0.0_f64;
    for (k, &p) in points.iter().enumerate() {
        let corner = corners.get(k) == Some(&true);
        let count = kept.len();
        match kept.last_mut() {
            Some(last) if last.distance(p) <= least => {
                moved = moved.max(last.distance(p));
                let flag = &mut flags[count - 1];
                if corner && !*flag && count > 1 {
                    *last = p;
                }
                *flag |= corner;
            }
            _ => {
                kept.push(p);
                flags.push(corner);
            }
        }
    }
    if closed {
        while kept.len() > 1 && kept[0].distance(kept[kept.len() - 1]) <= least {
            moved = moved.max(kept[0].distance(kept[kept.len() - 1]));
            kept.pop();
            if flags.pop() == Some(true) {
                flags[0] = true;
            }
        }
    } else if let (Some(end), Some(last)) = (points.last(), kept.last_mut()) {
        *last = *end;
    }
    (kept, flags, moved)
}

/// The points of a polyline without those that chords between others pass within `limit`, whether they are corners, and how far these
/// chords are from what they replace. Corners and ends stay.
fn sparse(points: &[DVec2], corners: &[bool], limit: f64) -> (Vec<DVec2>, Vec<bool>, f64) {
    let last = points.len() - 1;
    let off = |from: usize, to: usize| {
        let inner = points[from + 1..to].iter();
        inner.map(|&p| distance_to_segment(p, points[from], points[to])).fold(0.0, f64::max)
    };
    let (mut kept, mut flags, mut worst) = (vec![points[0]], vec![corners[0]], 0.0_f64);
    let (mut at, mut guess, mut corner) = (0, 1, 0);
    while at < last {
        if corner <= at {
            corner = (at + 1..last).find(|&k| corners[k]).unwrap_or(last);
        }
        let found = farthest(at, corner, guess, false, |to| {
            let inner = &points[at + 1..to];
            inner.iter().all(|&p| distance_to_segment(p, points[at], points[to]) <= limit).then_some(())
        });
        let to = found.map_or(at + 1, |f| f.0);
        worst = worst.max(off(at, to));
        (guess, at) = (to - at, to);
        kept.push(points[to]);
        flags.push(corners[to]);
    }
    (kept, flags, worst)
}
