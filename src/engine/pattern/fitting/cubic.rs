//! A cubic Bezier curve through samples by least squares, and how far it is from them.
//!
//! Its ends are samples. Of an inner control point the length of the tangent is unknown where the direction is given, and both
//! coordinates where it is not. The first round takes samples at equal lengths to lie at equal parameters; after each
//! round the parameters move to the feet of the samples, and distances count along the curve's normals alone: a
//! Gauss-Newton step in the true distances.

use glam::DVec2;

use super::{LEAST_MEASURED, Run, distance_to_segment};

/// Places along the samples that count in the least squares.
const PLACES: usize = 24;

/// Rounds of least squares. After the third the distances change little; more is time lost in the search.
const ROUNDS: usize = 4;

/// Damping towards the round before, as a part of what an arm across the curve would count: where tangents lie along the chord, distances
/// say next to nothing of their lengths.
const DAMPING: f64 = 1e-5;

/// The least length of an end's tangent, three times that of the control point's arm, as a part of the length of the samples: a
/// shorter one makes a kink.
const LEAST_ARM: f64 = 0.05;

/// The steps of Newton's method that look for the foot of a sample, at the most.
const FOOT_STEPS: usize = 5;

/// A foot that is off by this part of the limit along the curve costs the square of it over the curve's radius: nothing.
const CLOSE: f64 = 0.02;

/// Control points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cubic(pub(super) [DVec2; 4]);

impl Cubic {
    fn at(&self, t: f64) -> DVec2 {
        let Self([a, b, c, d]) = *self;
        let s = 1.0 - t;
        a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t)
    }

    fn derivative(&self, t: f64) -> DVec2 {
        let Self([a, b, c, d]) = *self;
        let s = 1.0 - t;
        3.0 * ((b - a) * (s * s) + (c - b) * (2.0 * s * t) + (d - c) * (t * t))
    }

    fn second(&self, t: f64) -> DVec2 {
        let Self([a, b, c, d]) = *self;
        6.0 * ((c - 2.0 * b + a) * (1.0 - t) + (d - 2.0 * c + b) * t)
    }

    /// A step of Newton's method to the foot of a point.
    fn nearer(&self, q: DVec2, t: f64) -> f64 {
        let (off, along) = (self.at(t) - q, self.derivative(t));
        let square = along.length_squared();
        let slope = square + off.dot(self.second(t));
        // Where the distance is greatest and not least the plain projection leads away from there.
        let slope = if slope > 0.25 * square { slope } else { square };
        let step = off.dot(along) / slope;
        if step.is_finite() { t - step } else { t }
    }

    /// The cubic nearest to the samples from one to another, with given unit directions at its ends where there are some.
    pub(super) fn fitted(run: &Run<'_>, [from, to]: [usize; 2], given: [Option<DVec2>; 2]) -> Option<Self> {
        let points = run.points();
        let (first, last) = (points[from], points[to]);
        let length = run.length(from, to);
        let mut places = [(DVec2::ZERO, 0.0); PLACES];
        for (k, place) in places.iter_mut().enumerate() {
            let t = (k + 1) as f64 / (PLACES + 1) as f64;
            *place = (run.at_length(from, to, t * length), t);
        }
        // Unknown k moves an arm (0: at the start, 1: at the end) along a direction.
        let mut unknowns = [(0_usize, DVec2::ZERO); 4];
        let mut count = 0;
        for (arm, direction) in given.into_iter().enumerate() {
            // Arms point away from their ends.
            let sign = if arm == 0 { 1.0 } else { -1.0 };
            let axes = direction.map_or([Some(DVec2::X), Some(DVec2::Y)], |d| [Some(d * sign), None]);
            for axis in axes.into_iter().flatten() {
                unknowns[count] = (arm, axis);
                count += 1;
            }
        }
        let unknowns = &unknowns[..count];
        let mut arms = [DVec2::ZERO; 2];
        let mut cubic = Self([first, first, last, last]);
        for round in 0..ROUNDS {
            let (mut matrix, mut right, mut full) = ([[0.0; 4]; 4], [0.0; 4], [0.0; 2]);
            for &(q, t) in &places {
                let s = 1.0 - t;
                let base = first * (s * s * (s + 3.0 * t)) + last * (t * t * (t + 3.0 * s));
                let weights = [3.0 * s * s * t, 3.0 * s * t * t];
                full = [full[0] + weights[0] * weights[0], full[1] + weights[1] * weights[1]];
                let mut count_along = |axis: DVec2| {
                    let mut row = [0.0; 4];
                    for (x, &(arm, along)) in row.iter_mut().zip(unknowns) {
                        *x = weights[arm] * along.dot(axis);
                    }
                    let wanted = (q - base).dot(axis);
                    for i in 0..count {
                        for j in 0..count {
                            matrix[i][j] += row[i] * row[j];
                        }
                        right[i] += row[i] * wanted;
                    }
                };
                if round == 0 {
                    count_along(DVec2::X);
                    count_along(DVec2::Y);
                } else {
                    count_along(cubic.derivative(t).perp().normalize_or(DVec2::Y));
                }
            }
            for (i, &(arm, along)) in unknowns.iter().enumerate() {
                let before = if round == 0 { length / 3.0 } else { arms[arm].dot(along) };
                // A free arm has nowhere to start from.
                if round > 0 || given[arm].is_some() {
                    matrix[i][i] += DAMPING * full[arm];
                    right[i] += DAMPING * full[arm] * before;
                }
            }
            let solution = solved(matrix, right, count)?;
            arms = [DVec2::ZERO; 2];
            for (&(arm, along), x) in unknowns.iter().zip(solution) {
                let x = if given[arm].is_some() { x.clamp(LEAST_ARM * length / 3.0, length) } else { x };
                arms[arm] += along * x;
            }
            cubic = Self([first, first + arms[0], last + arms[1], last]);
            if round + 1 < ROUNDS {
                for (q, t) in &mut places {
                    *t = cubic.nearer(*q, *t).clamp(0.0, 1.0);
                }
            }
        }
        let long = arms.iter().all(|a| a.length() >= LEAST_ARM * length / 3.0);
        (cubic.0.iter().all(|p| p.is_finite()) && long).then_some(cubic)
    }

    /// Its greatest distance from the samples between its ends and from the polyline of `before`, these and its end, `before` being where it
    /// starts; `None` when that is more than `limit`, or where it turns back. `fine` points are measured between two samples.
    pub(super) fn deviation(&self, before: DVec2, inner: &[DVec2], limit: f64, fine: usize) -> Option<f64> {
        let mut worst = 0.0_f64;
        let fine = fine.max(LEAST_MEASURED / (inner.len() + 1));
        let (mut last, mut t0, mut along) = (before, 0.0, self.derivative(0.0));
        let close = if limit.is_finite() { CLOSE * limit } else { 0.0 };
        for k in 0..=inner.len() {
            let (q, t1) = match inner.get(k) {
                Some(&q) => {
                    let speed = along.length().max(f64::MIN_POSITIVE);
                    let mut t = (t0 + q.distance(last) / speed).min(1.0);
                    for _ in 0..FOOT_STEPS {
                        let next = self.nearer(q, t).clamp(t0, 1.0);
                        let step = (next - t).abs() * speed;
                        t = next;
                        if step <= close || step <= 1e-9 * speed {
                            break;
                        }
                    }
                    worst = worst.max(self.at(t).distance(q));
                    (q, t)
                }
                None => (self.0[3], 1.0),
            };
            for n in 1..=fine {
                let x = n as f64 / (fine + 1) as f64;
                worst = worst.max(distance_to_segment(self.at(t0 + (t1 - t0) * x), last, q));
            }
            let next = self.derivative(t1);
            if worst.is_nan() || worst > limit || next.dot(along) < 0.0 {
                return None;
            }
            (last, t0, along) = (q, t1, next);
        }
        Some(worst)
    }
}

/// Gauss elimination with pivots of a system of up to four unknowns; unused ones come out as zero.
fn solved(mut matrix: [[f64; 4]; 4], mut right: [f64; 4], count: usize) -> Option<[f64; 4]> {
    for k in 0..count {
        let pivot = (k..count).max_by(|&i, &j| matrix[i][k].abs().total_cmp(&matrix[j][k].abs()))?;
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        // Equal to zero or not a number: there is no solution.
        if matrix[k][k] == 0.0 || matrix[k][k].is_nan() {
            return None;
        }
        for i in k + 1..count {
            let factor = matrix[i][k] / matrix[k][k];
            let row = matrix[k];
            for (x, pivot) in matrix[i].iter_mut().zip(row).skip(k) {
                *x -= factor * pivot;
            }
            right[i] -= factor * right[k];
        }
    }
    let mut solution = [0.0; 4];
    for k in (0..count).rev() {
        let rest: f64 = (k + 1..count).map(|j| matrix[k][j] * solution[j]).sum();
        solution[k] = (right[k] - rest) / matrix[k][k];
    }
    Some(solution)
}
