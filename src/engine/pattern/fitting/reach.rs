//! How far segments reach.

use super::{Run, distance_to_segment};

/// A search for the farthest end stops when it is this part of the way uncertain.
const CLOSE: usize = 32;

/// A chord is taken for a curve when it goes this many times as far: then curves follow noise.
const FARTHER: f64 = 2.5;

/// The farthest end in `from + 1..=end` for which `test` gives something, and what it gives: by doubling from a guess on and
/// halving after that. `None` where not even the next one does.
pub(super) fn farthest<T>(
    from: usize,
    end: usize,
    guess: usize,
    exactly: bool,
    mut test: impl FnMut(usize) -> Option<T>,
) -> Option<(usize, T)> {
    let mut best: Option<(usize, T)> = None;
    let mut fails = end + 1;
    let mut step = guess.clamp(1, (end - from).max(1));
    while from + step < fails && best.as_ref().is_none_or(|b| b.0 < end) {
        let to = from + step;
        if let Some(found) = test(to) {
            best = Some((to, found));
            step = (2 * step).min(end - from);
        } else {
            fails = to;
            if best.is_some() {
                break;
            }
            step = (step / 2).max(1);
        }
    }
    while let Some((to, _)) = &best {
        let close = if exactly { 1 } else { ((to - from) / CLOSE).max(1) };
        if fails.saturating_sub(*to) <= close {
            break;
        }
        let middle = usize::midpoint(*to, fails);
        match test(middle) {
            Some(found) => best = Some((middle, found)),
            None => fails = middle,
        }
    }
    best
}

/// Whether a chord from one sample to another is to stand where a curve reaches a third one: the curve is none.
pub(super) fn is_noise(run: &Run<'_>, from: usize, chord: usize, curve: usize) -> bool {
    run.length(from, chord) > FARTHER * run.length(from, curve)
}

/// Whether all samples between two lie within a distance of their chord.
fn is_line(run: &Run<'_>, from: usize, to: usize, limit: f64) -> bool {
    let points = run.points();
    points[from + 1..to].iter().all(|&p| distance_to_segment(p, points[from], points[to]) <= limit)
}

/// The farthest sample that a line within the tolerance goes to; at least the next one.
pub(super) fn line(run: &Run<'_>, from: usize, end: usize, guess: usize) -> usize {
    farthest(from, end, guess, true, |to| is_line(run, from, to, run.tolerance).then_some(())).map_or(from + 1, |f| f.0)
}
