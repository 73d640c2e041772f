//! The form of lines and cubic Bezier curves.

use glam::DVec2;

use super::Run;
use super::cubic::Cubic;
use super::joined::{Joined, Joint};
use super::reach::{farthest, is_noise, line};
use crate::engine::pattern::Segment;

/// Points of a cubic that are measured between two samples while cubics are looked for.
const COARSE: usize = 1;

/// A last cubic shorter than this part of the one before shares the way with it.
const SHORT: f64 = 0.5;

/// Lines and cubics along a run.
pub(super) fn join(run: &Run<'_>) -> Joined {
    Joined::around(run, between)
}

/// Cubics from one sample to another, with the directions that they must have at the ends.
fn between(run: &Run<'_>, [start, end]: [usize; 2], given: [Option<DVec2>; 2], out: &mut Joined) {
    let points = run.points();
    let cubic = |from: usize, to: usize, leaving: Option<DVec2>| {
        let arriving = if to == end { given[1] } else { Some(run.tangent(to)) };
        let cubic = Cubic::fitted(run, [from, to], [leaving, arriving])?;
        cubic.deviation(points[from], &points[from + 1..to], run.asked, COARSE)?;
        Some((cubic, arriving))
    };
    let push = |(cubic, to): (Cubic, usize), out: &mut Joined| {
        let [_, a, b, at] = cubic.0;
        let segment = Segment::Cubic { a, b, to: at };
        out.joints.push(Joint { segment, corner: false, sample: Some(to) });
    };
    let (mut at, mut leaving) = (start, given[0]);
    let mut guess = end - start;
    // The cubic before: where it starts, and how.
    let mut before: Option<(usize, Option<DVec2>)> = None;
    while at < end {
        let found = farthest(at, end, guess, false, |to| cubic(at, to, leaving));
        let reached = found.as_ref().map_or(at, |f| f.0);
        let chord = line(run, at, end, (reached - at).max(1));
        match found {
            Some((to, (mut last, arriving))) if !is_noise(run, at, chord, to) => {
                if let (true, Some((from, direction))) = (to == end, before)
                    && run.length(at, to) < SHORT * run.length(from, at)
                {
                    let middle = run.middle(from, to);
                    if let Some((first, arriving)) = cubic(from, middle, direction)
                        && let Some((second, _)) = cubic(middle, to, arriving)
                    {
                        out.joints.pop();
                        push((first, middle), out);
                        last = second;
                    }
                }
                push((last, to), out);
                before = Some((at, leaving));
                leaving = arriving;
                guess = to - at;
                at = to;
            }
            _ => {
                out.chord(run, [at, chord], leaving, given[1].filter(|_| chord == end), chord < end);
                (before, leaving) = (None, None);
                guess = chord - at;
                at = chord;
            }
        }
    }
}
