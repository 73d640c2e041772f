//! The segments of a run, one after the other, and how far they are from its samples.

use glam::DVec2;

use super::arc::Arc;
use super::cubic::Cubic;
use super::reach::line;
use super::straight::stretches;
use super::{Run, TANGENT, angle};
use crate::engine::pattern::Segment;

/// Points of a segment that are measured between two samples when the deviation is told.
const FINE: usize = 4;

/// A segment, and what its end is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joint {
    pub(super) segment: Segment,
    /// Whether the end is a corner.
    pub(super) corner: bool,
    /// The sample that it ends on; `None` where two arcs of a pair meet.
    pub(super) sample: Option<usize>,
}

/// Segments, end to start.
#[derive(Debug, Default)]
pub(super) struct Joined {
    pub(super) joints: Vec<Joint>,
    /// Whether the first one does not leave in the direction that it was given.
    kinked: bool,
}

impl Joined {
    /// Lines where a run is straight by itself, and `between` them, or from end to end, what that makes of the samples with the directions
    /// that it must leave and arrive in.
    pub(super) fn around(run: &Run<'_>, between: fn(&Run<'_>, [usize; 2], [Option<DVec2>; 2], &mut Self)) -> Self {
        let mut joined = Self::default();
        let (points, last) = (run.points(), run.last());
        if line(run, 0, last, last) == last {
            joined.joints.push(Joint {
                segment: Segment::Line { to: points[last] },
                corner: false,
                sample: Some(last),
            });
        } else {
            let lines = stretches(run);
            let direction = |[from, to]: [usize; 2]| (points[to] - points[from]).try_normalize();
            // A run that closes on itself has one direction at both ends: that of a line where one stands there.
            let both = run.smooth.then(|| {
                let ends = [lines.first().filter(|l| l[0] == 0), lines.last().filter(|l| l[1] == last)];
                ends.into_iter().flatten().find_map(|&l| direction(l)).unwrap_or_else(|| run.tangent(0))
            });
            let (mut at, mut leaving) = (0, both);
            for &stretch in &lines {
                let [from, to] = stretch;
                let along = direction(stretch);
                if from > at {
                    between(run, [at, from], [leaving, along], &mut joined);
                }
                joined.chord(run, stretch, leaving.filter(|_| from == at), both.filter(|_| to == last), false);
                (at, leaving) = (to, along);
            }
            if at < last {
                between(run, [at, last], [leaving, both], &mut joined);
            }
        }
        joined.closed(run)
    }

    /// A run as chords within its tolerance.
    pub(super) fn chords(run: &Run<'_>) -> Self {
        let mut joined = Self::default();
        let (mut at, mut guess) = (0, 1);
        while at < run.last() {
            let to = line(run, at, run.last(), guess);
            joined.chord(run, [at, to], None, None, true);
            (at, guess) = (to, to - at);
        }
        joined.kinked = true;
        joined.closed(run)
    }

    /// Appends a chord. Its start is a corner where it does not leave as it was told to, its end where it does not arrive so,
    /// or is to be one.
    pub(super) fn chord(
        &mut self,
        run: &Run<'_>,
        [from, to]: [usize; 2],
        leaving: Option<DVec2>,
        arriving: Option<DVec2>,
        corner: bool,
    ) {
        let points = run.points();
        let differs = |given: Option<DVec2>| given.is_some_and(|d| angle(points[to] - points[from], d) > TANGENT);
        if differs(leaving) {
            match self.joints.last_mut() {
                Some(before) => before.corner = true,
                None => self.kinked = true,
            }
        }
        let segment = Segment::Line { to: points[to] };
        self.joints.push(Joint { segment, corner: corner || differs(arriving), sample: Some(to) });
    }

    /// The end of a run is a corner, unless the run closes on itself and is tangent there.
    fn closed(mut self, run: &Run<'_>) -> Self {
        let kinked = self.kinked;
        if let Some(end) = self.joints.last_mut() {
            end.corner = !run.smooth || kinked || end.corner;
        }
        self
    }

    /// The greatest distance between a run and its segments, both ways, finely measured.
    pub(super) fn measured(&self, run: &Run<'_>) -> f64 {
        let points = run.points();
        let mut worst = 0.0_f64;
        // Where the segment begins, the sample there or the last one before, and how many samples lie before it ends.
        let (mut start, mut at) = (points[0], 0);
        for (k, joint) in self.joints.iter().enumerate() {
            let to = joint.segment.to();
            let (until, next) = match (joint.sample, self.joints.get(k + 1).and_then(|j| j.sample)) {
                (Some(end), _) => (end, end),
                (None, Some(end)) => {
                    let direction = Arc::of(start, joint.segment).end_direction();
                    let passed = points[at + 1..end].iter().take_while(|&&p| (p - to).dot(direction) <= 0.0).count();
                    (at + 1 + passed, at + passed)
                }
                (None, None) => return f64::INFINITY,
            };
            let inner = &points[at + 1..until];
            let off = match joint.segment {
                Segment::Cubic { a, b, to } => {
                    Cubic([start, a, b, to]).deviation(points[at], inner, f64::INFINITY, FINE)
                }
                _ => Arc::of(start, joint.segment).deviation(points[at], inner, points[until], f64::INFINITY, FINE),
            };
            worst = worst.max(off.unwrap_or(f64::INFINITY));
            (start, at) = (to, next);
        }
        worst
    }
}
