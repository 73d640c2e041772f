//! Strips and the straightest line of each (thesis 6.4, stages 3 to 5).
//!
//! The domain is divided into r = floor(m / 2) strips, m being the points across. In each strip `starts` equally spaced
//! starts, its two ends among them, are followed from t = 0 to t = 1; of the lines that stay in the strip, its ends
//! included, the one with the least range of x is kept, the first of equal ones. When no strip holds a line there are
//! r - 1 strips, and so on down to one.

use glam::DVec2;

use super::field::Field;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// Lines whose ranges differ by less are equally straight, and a line this far out of its strip is in it: rulings drift by
/// rounding. More would keep lines that are not the straightest, less lets rounding choose among rulings.
pub(super) const ROUNDING: f64 = 1e-12;

/// Lines nearer than this at every row are one line: the shared end of two strips. It is far above the rounding of a line
/// and far below any step.
const SAME: f64 = 1e-9;

/// Most steps that are taken while strips are searched, a minute of them at the most. A search that comes so far has found no line in
/// wide strips nor in many narrow ones, and gives up as if there were none.
const MAX_STEPS: u64 = 50_000_000;

/// What was found.
pub(super) struct Found {
    /// For each line x at every row, from left to right.
    pub lines: Vec<Vec<f64>>,
    /// Strips at first.
    pub strips_initial: u32,
    /// Strips in which lines were found; 0 when there are none for any number of strips.
    pub strips_used: u32,
}

/// The lines of a grid with `m` points across and `n` rows.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub(super) fn find(
    field: &Field,
    [m, n]: [usize; 2],
    starts: usize,
    observer: &dyn Observer,
) -> Result<Found, EngineError> {
    let most = (m / 2).max(1);
    let mut steps = 0_u64;
    let mut found = Found { lines: Vec::new(), strips_initial: most as u32, strips_used: 0 };
    'search: for strips in (1..=most).rev() {
        for strip in 0..strips {
            observer.check()?;
            if steps > MAX_STEPS {
                break 'search;
            }
            let ends = [strip, strip + 1].map(|k| k as f64 / strips as f64);
            let Some(line) = straightest(field, n, ends, starts.max(2), &mut steps) else { continue };
            let last: Option<&Vec<f64>> = found.lines.last();
            if last.is_none_or(|last| last.iter().zip(&line).any(|(a, b)| (a - b).abs() > SAME)) {
                found.lines.push(line);
            }
        }
        if !found.lines.is_empty() {
            found.strips_used = strips as u32;
            break;
        }
    }
    Ok(found)
}

/// The straightest line of a strip.
fn straightest(field: &Field, n: usize, [low, high]: [f64; 2], starts: usize, steps: &mut u64) -> Option<Vec<f64>> {
    let mut best: Option<(f64, Vec<f64>)> = None;
    for q in 0..starts {
        let start = low + (high - low) * (q as f64 / (starts - 1) as f64);
        let narrower = best.as_ref().map_or(f64::INFINITY, |(range, _)| range - ROUNDING);
        best = contained(field, n, [low, high], (start, narrower), steps).or(best);
    }
    best.map(|(_, line)| line)
}

/// The line from `start` with its range, where it stays in the strip and its range is below `narrower`.
fn contained(
    field: &Field,
    n: usize,
    [low, high]: [f64; 2],
    (start, narrower): (f64, f64),
    steps: &mut u64,
) -> Option<(f64, Vec<f64>)> {
    let mut line = Vec::with_capacity(n);
    line.push(start);
    let (mut least, mut greatest) = (start, start);
    let mut at = DVec2::new(start, 0.0);
    let mut direction = field.start(at);
    for row in 1..n {
        let t = row_at(row, n);
        *steps += 1;
        let (x, next) = field.step(at, direction, t - at.y)?;
        (least, greatest) = (least.min(x), greatest.max(x));
        if !(x >= low - ROUNDING && x <= high + ROUNDING && greatest - least < narrower) {
            return None;
        }
        line.push(x);
        (at, direction) = (DVec2::new(x, t), next);
    }
    (greatest - least < narrower).then_some((greatest - least, line))
}

/// t of a row of n.
pub(super) fn row_at(row: usize, n: usize) -> f64 {
    row as f64 / (n - 1) as f64
}
