//! Exact predicates on the border's nodes, as if no three of them stood on a line.
//!
//! Where the determinant vanishes, nodes are moved by infinitely small amounts that depend on their number alone
//! (Simulation of Simplicity, Edelsbrunner and Muecke 1990): node `i` by `(e^(2 * 4^i), e^(4^i))`, so the lesser number
//! moves farther, and in y farther than in x. All answers agree with one such movement, so they never contradict each other,
//! and borders that touch or coincide need no cases of their own: at the most they overlap by infinitely thin slivers.

use glam::DVec2;
use robust::{Coord, orient2d};

/// Twice the area of the triangle of three nodes, positive when anticlockwise; the sign is exact.
pub(super) fn area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let on = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(on(a), on(b), on(c))
}

/// Whether node `c` lies to the left of the way from `a` to `b`. The three are different numbers.
pub(super) fn left(points: &[DVec2], a: usize, b: usize, c: usize) -> bool {
    let exact = area(points[a], points[b], points[c]);
    if exact != 0.0 {
        return exact > 0.0;
    }
    // Into ascending order, with the sign of the permutation.
    let (mut order, mut odd) = ([a, b, c], false);
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if order[i] > order[j] {
            order.swap(i, j);
            odd = !odd;
        }
    }
    let [p, q, r] = order.map(|k| points[k]);
    // Coefficients of the movements in the order of their size; the last one is one.
    let term = [r.x - q.x, q.y - r.y, p.x - r.x].into_iter().find(|&t| t != 0.0).unwrap_or(1.0);
    (term > 0.0) != odd
}

/// Whether node `a` lies higher than node `b`.
pub(super) fn above(points: &[DVec2], a: usize, b: usize) -> bool {
    points[a].y > points[b].y || (points[a].y == points[b].y && a < b)
}

/// Whether node `a` lies farther to the right than node `b`.
pub(super) fn right_of(points: &[DVec2], a: usize, b: usize) -> bool {
    points[a].x > points[b].x || (points[a].x == points[b].x && a < b)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Points of a tiny lattice: on lines, and on each other, more often than not.
        #[test]
        fn answers_do_not_contradict_each_other(
            at in proptest::collection::vec((0..3_i8, 0..3_i8), 4)
        ) {
            let p: Vec<DVec2> = at.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y))).collect();
            for [a, b, c] in [[0, 1, 2], [1, 2, 3], [0, 2, 3], [0, 1, 3]] {
                let l = left(&p, a, b, c);
                prop_assert!(l == left(&p, b, c, a) && l == left(&p, c, a, b));
                prop_assert!(l != left(&p, b, a, c) && l != left(&p, a, c, b));
            }
            // Of four points in general position: d sees the triangle a b c from outside over one or two edges, or not.
            if left(&p, 0, 1, 2) {
                let sides = [left(&p, 0, 1, 3), left(&p, 1, 2, 3), left(&p, 2, 0, 3)];
                prop_assert!(sides.contains(&true), "no point is to the right of all sides");
            }
        }

        /// The movement itself, made with numbers that are small but not infinitely so.
        #[test]
        fn answers_are_those_of_small_movements(at in proptest::collection::vec((0..3_i8, 0..3_i8), 3)) {
            let p: Vec<DVec2> = at.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y))).collect();
            let e = 2.0_f64.powi(-9);
            let moved: Vec<DVec2> =
                p.iter().zip([1, 4, 16]).map(|(p, k)| *p + DVec2::new(e.powi(2 * k), e.powi(k))).collect();
            // The third point's movement is lost in rounding, as it may be: it decides nothing.
            if area(moved[0], moved[1], moved[2]) != 0.0 {
                prop_assert_eq!(left(&p, 0, 1, 2), area(moved[0], moved[1], moved[2]) > 0.0);
            }
        }
    }
}
