//! What is straight by itself: stretches of a run that follow a line far more closely than the tolerance asks, and for
//! far longer than the curve on either side follows one.

use super::reach::farthest;
use super::{Run, distance_to_segment};

/// Part of the tolerance by which a straight stretch may leave its chord. Samples of a curve lie apart by what makes an eighth of the
/// tolerance, so three of them show more.
const STRAIGHT: f64 = 1.0 / 64.0;

/// How many times longer than the stretches beside it a straight one is; near a turning point of a cubic it is three.
const LONGER: f64 = 8.0;

/// The straight stretches, first and last sample of each, in order; a run that is one as a whole is not looked at.
pub(super) fn stretches(run: &Run<'_>) -> Vec<[usize; 2]> {
    let limit = STRAIGHT * run.tolerance;
    let (points, last) = (run.points(), run.last());
    let is_straight = |from: usize, to: usize| {
        points[from + 1..to].iter().all(|&p| distance_to_segment(p, points[from], points[to]) <= limit)
    };
    let ahead = |from: usize, guess: usize| {
        farthest(from, last, guess, true, |to| is_straight(from, to).then_some(())).map_or(from + 1, |f| f.0)
    };
    let back = |from: usize, guess: usize| {
        let most = from.min(4 * guess.max(1));
        farthest(0, most, guess.max(1), true, |steps| is_straight(from - steps, from).then_some(()))
            .map_or(from, |f| from - f.0)
    };
    let mut found: Vec<[usize; 2]> = Vec::new();
    let (mut at, mut guess) = (0, 1);
    while at < last {
        let end = ahead(at, guess);
        guess = end - at;
        let length = run.length(at, end);
        let sides = |from: usize, to: usize| {
            let after = if to < last { run.length(to, ahead(to, 1)) } else { 0.0 };
            let before = if from > 0 { run.length(back(from, 1), from) } else { 0.0 };
            after.max(before)
        };
        // A curve's stretches are alike: most are turned down by the one before alone.
        let alone = end - at >= 2 || at + 1 == last || points[at].distance(points[end]) > LONGER * limit;
        if alone && length >= LONGER * sides(at, end) && !(at == 0 && end == last) {
            found.push([at, end]);
        }
        at = end;
    }
    found
}
