//! The form of lines and arcs.

use glam::DVec2;

use super::arc::{Arc, biarc};
use super::clean::MICRO;
use super::joined::{Joined, Joint};
use super::reach::{farthest, is_noise, line};
use super::{Run, TANGENT, angle};

/// A single arc is taken for two when it reaches this part of the way that two reach.
const WORTH: f64 = 0.6;

/// A single arc that others follow takes this part of the tolerance: what it leaves, its end's direction is off by.
const OF_SINGLE: f64 = 0.5;

/// The direction at the end of such an arc differs from the samples' by less, radians.
const DRIFT: f64 = 0.1;

/// Samples that an arc between free ends is laid through, at the most.
const THROUGH: usize = 32;

/// Points of an arc that are measured between two samples while arcs are looked for.
const COARSE: usize = 1;

/// Lines and arcs along a run.
pub(super) fn join(run: &Run<'_>) -> Joined {
    Joined::around(run, between)
}

/// What was found from one sample to another.
enum Found {
    Single(Arc),
    Pair([Arc; 2]),
}

/// Arcs from one sample to another, with the directions that they must have at the ends.
fn between(run: &Run<'_>, ends: [usize; 2], given: [Option<DVec2>; 2], out: &mut Joined) {
    let points = run.points();
    let [start, end] = ends;
    let (mut at, mut direction) = (start, given[0]);
    let (mut guess, mut whole) = (end - start, true);
    while at < end {
        let single = |to: usize| {
            let arc = if let Some(direction) = direction {
                Arc::leaving(points[at], direction, points[to])?
            } else if to - at > 1 {
                let taken = (to - at).min(THROUGH);
                let others = (1..taken).map(|n| points[at + (n * (to - at)) / taken]);
                Arc::through(points[at], points[to], others)?
            } else {
                Arc { from: points[at], to: points[to], bulge: 0.0 }
            };
            let (limit, towards) = if to == end {
                (1.0, given[1].map(|d| (d, TANGENT)))
            } else {
                (OF_SINGLE, Some((run.tangent(to), DRIFT)))
            };
            if towards.is_some_and(|(d, most)| angle(arc.end_direction(), d) > most) {
                return None;
            }
            arc.deviation(points[at], &points[at + 1..to], points[to], limit * run.asked, COARSE)?;
            Some(Found::Single(arc))
        };
        let leaving = direction.unwrap_or_else(|| run.tangent_of(at, [false, true]));
        let pair = |to: usize| {
            let arriving = match given[1] {
                Some(given) if to == end => given,
                None if to == end => run.tangent_of(to, [true, false]),
                _ => run.tangent(to),
            };
            let arcs = biarc(points[at], leaving, points[to], arriving)?;
            fits(run, &arcs, [at, to])?;
            Some(Found::Pair(arcs))
        };
        let first = if whole { single(end).map(|f| (end, f)) } else { None };
        let found = first.or_else(|| {
            let two = if whole { pair(end).map(|f| (end, f)) } else { None };
            let one = farthest(at, end, guess / 2, false, single);
            let two = two.or_else(|| farthest(at, end, guess, false, pair));
            match (one, two) {
                (Some(one), Some(two)) => {
                    let enough = WORTH * run.length(at, two.0) <= run.length(at, one.0);
                    Some(if enough { one } else { two })
                }
                (one, two) => one.or(two),
            }
        });
        whole = false;
        let reached = found.as_ref().map_or(at, |f| f.0);
        let chord = line(run, at, end, (reached - at).max(1));
        match found {
            Some((to, found)) if !is_noise(run, at, chord, to) => {
                let last = match found {
                    Found::Single(arc) => arc,
                    Found::Pair([one, two]) => {
                        out.joints.push(Joint { segment: one.segment(), corner: false, sample: None });
                        two
                    }
                };
                out.joints.push(Joint { segment: last.segment(), corner: false, sample: Some(to) });
                direction = Some(last.end_direction());
                guess = to - at;
                at = to;
            }
            _ => {
                out.chord(run, [at, chord], direction, given[1].filter(|_| chord == end), chord < end);
                direction = None;
                guess = chord - at;
                at = chord;
            }
        }
    }
}

/// Whether two arcs are within the tolerance.
fn fits(run: &Run<'_>, arcs: &[Arc; 2], [from, to]: [usize; 2]) -> Option<()> {
    let points = run.points();
    let [one, two] = arcs;
    let micro = MICRO * run.tolerance;
    if one.from.distance(one.to) < micro || two.from.distance(two.to) < micro {
        return None;
    }
    let (joint, direction) = (one.to, one.end_direction());
    let passed = points[from + 1..to].iter().take_while(|&&p| (p - joint).dot(direction) <= 0.0).count();
    let split = from + 1 + passed;
    one.deviation(points[from], &points[from + 1..split], points[split], run.asked, COARSE)?;
    two.deviation(points[split - 1], &points[split..to], points[to], run.asked, COARSE)?;
    Some(())
}
