//! How far to go along a direction: never past a flip, never up.

use super::constraints::Terms;
use super::energy::Energy;
use super::shape::Shape;

/// Share of the way to the first flip that is tried first, when the whole step passes it.
const BEFORE_FLIP: f64 = 0.9;

/// Part of the decrease that the slope promises which must come (Armijo).
const SUFFICIENT: f64 = 1e-4;

/// Energies that differ by less than this part count as equal: a sum of a million terms rounds so.
const ROUNDING: f64 = 1e-13;

/// Most halvings of the step: 2^-40 of it is nothing.
const HALVINGS: usize = 40;

/// Moves `from` along `direction` into `to`, and gives the energy there. `None` when no step lowers it.
pub(super) fn search(
    (shape, terms): (&Shape, &Terms),
    energy: Energy,
    from: &[[f64; 2]],
    direction: &[[f64; 2]],
    (at_start, slope): (f64, f64),
    to: &mut [[f64; 2]],
) -> Option<(f64, f64)> {
    let mut step = 1.0;
    for trial in 0..HALVINGS {
        for ((to, from), d) in to.iter_mut().zip(from).zip(direction) {
            *to = [from[0] + step * d[0], from[1] + step * d[1]];
        }
        let value = shape.energy(energy, to) + terms.energy(to);
        if value <= at_start * (1.0 + ROUNDING) + SUFFICIENT * step * slope {
            return Some((value, step));
        }
        step = if trial == 0 && value == f64::INFINITY {
            (BEFORE_FLIP * first_flip(shape, from, direction)).min(0.5)
        } else if value < f64::INFINITY {
            // The least of the parabola through both ends with the slope at the start, kept within a sound range.
            let least = -0.5 * slope * step * step / (value - at_start - slope * step);
            least.clamp(0.1 * step, 0.5 * step)
        } else {
            0.5 * step
        };
    }
    None
}

/// The least step at which a triangle collapses: the determinant along the way is a quadratic in the step
/// (Smith and Schaefer 2015).
pub(super) fn first_flip(shape: &Shape, from: &[[f64; 2]], direction: &[[f64; 2]]) -> f64 {
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let minus = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let mut first = f64::INFINITY;
    for cell in &shape.cells {
        let [a, b, c] = cell.corners.map(|v| v as usize);
        let (e, f) = (minus(from[b], from[a]), minus(from[c], from[a]));
        let (u, v) = (minus(direction[b], direction[a]), minus(direction[c], direction[a]));
        // A sliver's determinant may round below nought, where its map's does not: nothing is left of the way then.
        let at_start = cross(e, f).max(0.0);
        first = first.min(least_positive_root(cross(u, v), cross(e, v) + cross(u, f), at_start).max(0.0));
    }
    first
}

/// The least positive root of a t^2 + b t + c with c > 0; infinite without one. Without cancellation.
fn least_positive_root(a: f64, b: f64, c: f64) -> f64 {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    let root = discriminant.sqrt();
    if b < 0.0 {
        // Both roots are positive if a > 0: the lesser has the greater denominator.
        2.0 * c / (root - b)
    } else if a < 0.0 {
        (b + root) / (-2.0 * a)
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_positive_root_is_found_in_every_case() {
        assert_eq!(least_positive_root(1.0, -3.0, 2.0), 1.0);
        assert_eq!(least_positive_root(-1.0, 1.0, 2.0), 2.0);
        assert_eq!(least_positive_root(0.0, -2.0, 1.0), 0.5);
        assert_eq!(least_positive_root(0.0, 2.0, 1.0), f64::INFINITY);
        assert_eq!(least_positive_root(1.0, 3.0, 2.0), f64::INFINITY);
        assert_eq!(least_positive_root(1.0, 1.0, 2.0), f64::INFINITY);
        assert!((least_positive_root(1e-20, -1.0, 1e-9) - 1e-9).abs() < 1e-24);
    }
}
