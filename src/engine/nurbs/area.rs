//! Quadrature: Gauss-Legendre rules and the area of a surface.
//!
//! The area is the integral of `|Su x Sv|` over the domain, per pair of knot spans (between knots the integrand is smooth
//! unless the surface folds), by an 8 x 8 rule that is compared with its four quarters and refined where they differ.
//! Sums run in a fixed order.

use super::grid::FirstDerivatives;
use super::{Domain, Surface};

/// Abscissae (positive half) and weights of the 8-point rule on [-1, 1], exact up to degree 15.
const RULE: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_3],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_5],
    [0.960_289_856_497_536_3, 0.101_228_536_290_376_3],
];

/// How often a cell may be quartered. Deeper: kinks inside a span are met more closely, at up to four times the work a
/// level; 12 leaves cells of 1/4096 of a span.
const DEEPEST: u32 = 12;

/// How many cells an area may take in all: bounds the work on surfaces that are nowhere smooth (64 evaluations each).
const MOST_CELLS: u32 = 200_000;

/// The finest relative tolerance that is worked for: below it rounding errors decide.
const FINEST_TOLERANCE: f64 = 1e-13;

/// The eight abscissae and weights of the Gauss-Legendre rule on `[a, b]`, in increasing order.
#[must_use]
pub fn gauss_legendre(a: f64, b: f64) -> [[f64; 2]; 8] {
    let (middle, half) = (0.5 * a + 0.5 * b, 0.5 * (b - a));
    let mut out = [[0.0; 2]; 8];
    for (k, [x, w]) in RULE.into_iter().enumerate() {
        out[4 + k] = [middle + half * x, half * w];
        out[3 - k] = [middle - half * x, half * w];
    }
    out
}

/// The integral of `f` over `[a, b]`, bisected until halves and whole agree within `relative_tolerance` of the integral
/// of the whole, at most `deepest` times.
pub fn integrate(f: &impl Fn(f64) -> f64, a: f64, b: f64, relative_tolerance: f64, deepest: u32) -> f64 {
    let whole = rule(f, a, b);
    refine_line(f, [a, b], whole, relative_tolerance.max(FINEST_TOLERANCE), deepest)
}

fn rule(f: &impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    gauss_legendre(a, b).iter().map(|&[x, w]| w * f(x)).sum()
}

fn refine_line(f: &impl Fn(f64) -> f64, [a, b]: [f64; 2], whole: f64, tolerance: f64, deepest: u32) -> f64 {
    let middle = 0.5 * a + 0.5 * b;
    let (left, right) = (rule(f, a, middle), rule(f, middle, b));
    let sum = left + right;
    if deepest == 0 || (sum - whole).abs() <= tolerance * sum.abs() || middle <= a || middle >= b {
        return sum;
    }
    refine_line(f, [a, middle], left, tolerance, deepest - 1)
        + refine_line(f, [middle, b], right, tolerance, deepest - 1)
}

impl Surface {
    /// The area of the whole surface, to `relative_tolerance` (at least 1e-13), in the square of its unit.
    ///
    /// The work is bounded: where the surface is nowhere smooth the result may be less exact than asked.
    #[must_use]
    pub fn area(&self, relative_tolerance: f64) -> f64 {
        let mut work = Work {
            surface: self,
            tolerance: relative_tolerance.max(FINEST_TOLERANCE),
            cells: 0,
            scale: 0.0,
            samples: FirstDerivatives::default(),
        };
        let (us, vs) = (self.knots_u().breaks(), self.knots_v().breaks());
        let mut cells = Vec::with_capacity((us.len() - 1) * (vs.len() - 1));
        for v in vs.windows(2) {
            for u in us.windows(2) {
                let cell = Domain { u: [u[0], u[1]], v: [v[0], v[1]] };
                cells.push((cell, work.rule(cell)));
            }
        }
        // A cell's error counts against its own area, or against an even share of the whole where that is more.
        work.scale = cells.iter().map(|c| c.1).sum::<f64>() / cells.len() as f64;
        cells.into_iter().map(|(cell, whole)| work.refine(cell, whole, DEEPEST)).sum()
    }
}

/// What a quadrature over a surface carries along.
struct Work<'a> {
    surface: &'a Surface,
    tolerance: f64,
    cells: u32,
    scale: f64,
    samples: FirstDerivatives,
}

impl Work<'_> {
    /// The 8 x 8 rule on one cell.
    fn rule(&mut self, cell: Domain) -> f64 {
        self.cells += 1;
        let (u, v) = (gauss_legendre(cell.u[0], cell.u[1]), gauss_legendre(cell.v[0], cell.v[1]));
        self.surface.grid_first_derivatives(&u.map(|x| x[0]), &v.map(|x| x[0]), &mut self.samples);
        let tangents = self.samples.su.chunks_exact(8).zip(self.samples.sv.chunks_exact(8));
        tangents
            .zip(&v)
            .map(|((su, sv), [_, wv])| {
                let row: f64 = su.iter().zip(sv).zip(&u).map(|((a, b), [_, wu])| wu * a.cross(*b).length()).sum();
                wv * row
            })
            .sum()
    }

    /// Quarters a cell until quarters and whole agree.
    fn refine(&mut self, cell: Domain, whole: f64, deepest: u32) -> f64 {
        let [um, vm] = [0.5 * cell.u[0] + 0.5 * cell.u[1], 0.5 * cell.v[0] + 0.5 * cell.v[1]];
        let quarters = [
            Domain { u: [cell.u[0], um], v: [cell.v[0], vm] },
            Domain { u: [um, cell.u[1]], v: [cell.v[0], vm] },
            Domain { u: [cell.u[0], um], v: [vm, cell.v[1]] },
            Domain { u: [um, cell.u[1]], v: [vm, cell.v[1]] },
        ];
        let parts = quarters.map(|q| self.rule(q));
        let sum: f64 = parts.iter().sum();
        let share = self.scale * 0.25_f64.powi((DEEPEST - deepest) as i32);
        let small = (sum - whole).abs() <= self.tolerance * sum.max(share);
        if small || deepest == 0 || self.cells >= MOST_CELLS {
            return sum;
        }
        (0..4).map(|k| self.refine(quarters[k], parts[k], deepest - 1)).sum()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::engine::nurbs::shapes::{cylinder, plane, sphere, torus};

    #[test]
    fn the_rule_is_exact_for_polynomials_up_to_degree_fifteen() {
        for degree in 0..=15_i32 {
            let sum: f64 = gauss_legendre(-0.5, 2.0).iter().map(|[x, w]| w * x.powi(degree)).sum();
            let exact = (2.0_f64.powi(degree + 1) - (-0.5_f64).powi(degree + 1)) / f64::from(degree + 1);
            assert!((sum - exact).abs() < 1e-12 * exact.abs(), "degree {degree}: {sum} where {exact} is exact");
        }
    }

    #[test]
    fn an_integral_is_as_exact_as_asked_even_with_a_kink() {
        let f = |x: f64| (x - 0.3).abs() + x.exp();
        let exact = 0.29 + 1.0_f64.exp() - 1.0;
        for tolerance in [1e-4, 1e-8, 1e-12] {
            let found = integrate(&f, 0.0, 1.0, tolerance, 40);
            assert!((found - exact).abs() <= tolerance * exact, "{tolerance}: {found} where {exact} is exact");
        }
    }

    #[test]
    fn areas_of_exact_shapes_are_met_to_the_tolerance_asked() {
        let shapes = [
            (plane(3.0, 4.0), 12.0),
            (cylinder(2.0, 5.0), 20.0 * PI),
            (sphere(1.5), 9.0 * PI),
            (torus(5.0, 2.0), 40.0 * PI * PI),
        ];
        for (shape, exact) in shapes {
            for tolerance in [1e-4, 1e-7, 1e-10] {
                let found = shape.area(tolerance);
                assert!((found - exact).abs() <= tolerance * exact, "{tolerance}: {found} where {exact} is exact");
            }
        }
    }

    #[test]
    fn area_scales_with_the_square_of_size_and_does_not_depend_on_place() {
        let s = torus(5.0, 2.0);
        let area = s.area(1e-10);
        for factor in [1e-3, 1e5] {
            assert!((s.scaled(factor).area(1e-10) / (factor * factor * area) - 1.0).abs() < 1e-9);
        }
        assert!((s.translated(glam::DVec3::splat(1e4)).area(1e-9) / area - 1.0).abs() < 1e-8);
    }
}
