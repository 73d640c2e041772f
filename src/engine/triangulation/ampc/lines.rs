//! All lines of a family: those found, those between them, and those beyond (thesis 6.4, stages 6 and 8).
//!
//! Between two lines whose starts are farther apart than the step 1/m others are blended linearly, as many as (6.1) says
//! (by `needed` one more than printed: its "- 2" leaves steps of 2/m). Integrated lines take their place under
//! `runge-kutta`, each from its start on t = 0, where they keep between their neighbours.
//!
//! Beyond the first and the last line, with the border `clamped`, copies are offset by the step until one lies outside
//! entirely, that one included. With the border `free` each further line is integrated both ways from a place one step
//! beyond the deepest place of the line before; where lines drift apart by more than `WIDEST` steps it begins anew one step
//! from where they are farthest, and nearer than `NARROWEST` steps they are not let come.
//!
//! Lines are x at every row and may leave [0, 1]. A free line that crosses the border between two rows has, at the row
//! outside, the x that makes the chord cross the border where the line does.

use glam::DVec2;

use super::field::Field;
use super::options::{AmpcBorder, AmpcOptions, Integration, NpRule};
use super::strips::{Found, ROUNDING, row_at};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// Gaps of so many steps and this part of one are whole numbers of steps: 0.1 is not ten hundredths in binary.
const WHOLE: f64 = 1e-9;

/// Steps between two integrated lines at the most, unless one that begins at the widest place is not nearer either. Larger
/// leaves coarse cells, smaller begins anew where rulings open like a fan.
const WIDEST: f64 = 1.5;

/// Steps between two integrated lines at the least: rulings may close like a fan to a twentieth of their distance. Smaller
/// gives thinner triangles, larger bends lines off their rulings earlier.
const NARROWEST: f64 = 0.05;

/// Halvings by which the crossing of a border is found: to rounding.
const HALVINGS: usize = 40;

/// The lines of a family from left to right, the first and the last outside entirely.
pub(super) struct Lines {
    /// x at every row.
    pub x: Vec<Vec<f64>>,
    /// How many of them lie beyond the first and beyond the last one that was found.
    pub beyond: [usize; 2],
}

/// Fills what `found` leaves.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub(super) fn fill(
    field: &Field,
    found: &Found,
    m: usize,
    options: &AmpcOptions,
    observer: &dyn Observer,
) -> Result<Lines, EngineError> {
    let mut x: Vec<Vec<f64>> = Vec::new();
    for line in &found.lines {
        if let Some(before) = x.last().cloned() {
            let gap = (line[0] - before[0]) * m as f64;
            let less = if options.np_rule == NpRule::Needed { 1.0 } else { 2.0 };
            let count = ((gap - WHOLE).ceil() - less).max(0.0) as usize;
            for k in 0..count {
                observer.check()?;
                let share = (k + 1) as f64 / (count + 1) as f64;
                let blended: Vec<f64> = before.iter().zip(line).map(|(a, b)| a + (b - a) * share).collect();
                x.push(match (options.integration, x.last()) {
                    (Integration::RungeKutta, Some(left)) => between(field, &blended, left, line, 1.0 / m as f64),
                    _ => blended,
                });
            }
        }
        x.push(line.clone());
    }
    let mut beyond = [0; 2];
    for (side, outwards) in [-1.0, 1.0].into_iter().enumerate() {
        let Some(mut last) = (if side == 0 { x.first() } else { x.last() }).cloned() else { break };
        let mut outer = Vec::new();
        loop {
            observer.check()?;
            // Offset copies end by themselves; integrated lines that hardly move on give way to them.
            let integrated = options.border == AmpcBorder::Free && outer.len() < 4 * m;
            let next = if integrated {
                further(field, &last, outwards, 1.0 / m as f64)
            } else {
                last.iter().map(|x| x + outwards / m as f64).collect()
            };
            let ends = next.iter().all(|&x| depth(x, outwards) < -ROUNDING);
            outer.push(next.clone());
            last = next;
            // Copies go on by a step each; only places that are no numbers could keep them from ending.
            if ends || outer.len() > 8 * m {
                break;
            }
        }
        beyond[side] = outer.len();
        if side == 0 {
            outer.reverse();
            outer.append(&mut x);
            x = outer;
        } else {
            x.append(&mut outer);
        }
    }
    Ok(Lines { x, beyond })
}

/// How far x is inside of the border that lies `outwards`.
fn depth(x: f64, outwards: f64) -> f64 {
    if outwards < 0.0 { x } else { 1.0 - x }
}

/// The line from where `blended` begins, integrated, kept between its neighbours.
fn between(field: &Field, blended: &[f64], left: &[f64], right: &[f64], step: f64) -> Vec<f64> {
    let n = blended.len();
    let mut line = blended.to_vec();
    let mut at = DVec2::new(blended[0], 0.0);
    let mut direction = field.start(at);
    for row in 1..n {
        let t = row_at(row, n);
        let Some((x, next)) = field.step(at, direction, t - at.y) else { return blended.to_vec() };
        let margin = (NARROWEST * step).min(0.5 * (right[row] - left[row]));
        line[row] = x.clamp(left[row] + margin, (right[row] - margin).max(left[row] + margin));
        (at, direction) = (DVec2::new(line[row], t), next);
    }
    line
}

/// The integrated line beyond `last`.
fn further(field: &Field, last: &[f64], outwards: f64, step: f64) -> Vec<f64> {
    let deepest = |values: &dyn Fn(usize) -> f64| {
        (0..last.len()).fold(0, |best, row| if values(row) > values(best) { row } else { best })
    };
    let begin = deepest(&|row| depth(last[row], outwards));
    let line = integrated(field, last, begin, outwards, step);
    let gap = |row: usize| {
        let inside = depth(line[row], outwards) > 0.0 && depth(last[row], outwards) > 0.0;
        if inside { (line[row] - last[row]) * outwards } else { 0.0 }
    };
    let widest = deepest(&gap);
    // A line that begins outside would be an offset copy.
    let anew = gap(widest) > WIDEST * step && depth(last[widest], outwards) > step;
    if anew { integrated(field, last, widest, outwards, step) } else { line }
}

/// The line one step beyond `last` at the row `begin`, followed both ways until it leaves the domain; from there on it keeps
/// its distance from `last`.
fn integrated(field: &Field, last: &[f64], begin: usize, outwards: f64, step: f64) -> Vec<f64> {
    let n = last.len();
    let mut line = vec![0.0; n];
    line[begin] = last[begin] + outwards * step;
    let first = field.start(DVec2::new(line[begin], row_at(begin, n)));
    let ways: [Vec<usize>; 2] = [(begin + 1..n).collect(), (0..begin).rev().collect()];
    for way in ways {
        let (mut before, mut direction) = (begin, first);
        let mut follows = depth(line[begin], outwards) >= 0.0;
        for row in way {
            let kept = last[row] + (line[before] - last[before]);
            let nearest = last[row] + outwards * NARROWEST * step;
            let at = DVec2::new(line[before], row_at(before, n));
            let h = row_at(row, n) - at.y;
            let stepped = if follows { field.step(at, direction, h) } else { None };
            line[row] = match stepped {
                Some((x, next)) if depth(x, outwards) >= 0.0 => {
                    direction = next;
                    x
                }
                Some((x, next)) => {
                    follows = false;
                    let share = crossing(|share| {
                        let x = field.step(at, direction, share * h).map_or(x, |(x, _)| x);
                        depth(x, outwards)
                    });
                    direction = next;
                    let border = if outwards < 0.0 { 0.0 } else { 1.0 };
                    // Within rounding of the row before, the chord would be level.
                    if share > WHOLE { at.x + (border - at.x) / share } else { x }
                }
                None => {
                    follows = false;
                    kept
                }
            };
            // Never back over the line before.
            line[row] = if outwards < 0.0 { line[row].min(nearest) } else { line[row].max(nearest) };
            before = row;
        }
    }
    line
}

/// The share of a step at which its depth vanishes: positive at 0, negative at 1.
fn crossing(depth: impl Fn(f64) -> f64) -> f64 {
    let (mut inside, mut outside) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if depth(middle) >= 0.0 { inside = middle } else { outside = middle }
    }
    outside
}
