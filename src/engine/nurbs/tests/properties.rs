//! Properties of every curve and surface, for random degrees, knots, weights and control points.

use glam::DVec3;
use proptest::prelude::*;

use super::shapes::{any_knots, any_surface};
use crate::engine::nurbs::basis::{Basis, WIDEST};
use crate::engine::nurbs::grid::FirstDerivatives;
use crate::engine::nurbs::{Curve3, GridSamples, Surface};

/// The parameter that stands at the part `x` of a domain.
fn at([a, b]: [f64; 2], x: f64) -> f64 {
    a + (b - a) * x
}

/// Largest coordinate of the net, at least 1: what errors are relative to.
fn size(surface: &Surface) -> f64 {
    surface.control().iter().map(|p| p.abs().max_element()).fold(1.0, f64::max)
}

fn any_curve(most: usize) -> impl Strategy<Value = Curve3> {
    (1..=most).prop_flat_map(any_knots).prop_flat_map(|knots| {
        let n = knots.control_count();
        let control = proptest::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64, -5.0..5.0_f64), n);
        let weights = proptest::option::of(proptest::collection::vec(0.3..3.0_f64, n));
        (control, weights).prop_map(move |(control, weights)| {
            Curve3::new(knots.clone(), control.into_iter().map(DVec3::from).collect(), weights).expect("valid")
        })
    })
}

proptest! {
    #[test]
    fn basis_functions_sum_to_one_and_their_derivatives_to_zero(
        knots in (1..=25_usize).prop_flat_map(any_knots), x in 0.0..=1.0_f64,
    ) {
        let basis = Basis::<3, WIDEST>::at(&knots, at(knots.domain(), x));
        let p = knots.degree();
        let sums = basis.rows.map(|row| row[..=p].iter().sum::<f64>());
        let sizes = basis.rows.map(|row| row[..=p].iter().map(|n| n.abs()).sum::<f64>());
        prop_assert!((sums[0] - 1.0).abs() < 1e-13);
        prop_assert!(sums[1].abs() <= 1e-12 * sizes[1]);
        prop_assert!(sums[2].abs() <= 1e-11 * sizes[2]);
        prop_assert!(basis.rows[0][..=p].iter().all(|&n| n >= -1e-16));
        prop_assert!(basis.first + p < knots.control_count());
    }

    #[test]
    fn a_curve_stays_the_same_under_knot_insertion_reversal_and_in_bezier_form(
        curve in any_curve(12), x in 0.0..=1.0_f64, y in 0.0..1.0_f64, times in 1..3_usize,
    ) {
        let [a, b] = curve.domain();
        let t = at([a, b], x);
        let point = curve.point(t);
        if let Ok(inserted) = curve.insert_knot(at([a, b], y), times) {
            prop_assert!(inserted.point(t).distance(point) < 1e-11);
            prop_assert_eq!(inserted.domain(), [a, b]);
        }
        for segment in curve.to_bezier() {
            if segment.domain[0] <= t && t < segment.domain[1] {
                prop_assert!(segment.to_curve().point(t).distance(point) < 1e-11);
            }
        }
        // Off the knots, where a curve with repeated knots may jump.
        if curve.knots().breaks().iter().all(|k| (k - t).abs() > 1e-6 * (b - a)) {
            prop_assert!(curve.reversed().point(a + b - t).distance(point) < 1e-6);
        }
    }

    #[test]
    fn derivatives_of_a_curve_agree_with_differences(curve in any_curve(15), x in 0.02..0.98_f64) {
        let domain = curve.domain();
        let t = at(domain, x);
        let breaks = curve.knots().breaks();
        let gap = breaks.iter().map(|k| (k - t).abs()).fold(f64::INFINITY, f64::min);
        let span = domain[1] - domain[0];
        prop_assume!(gap > 1e-3 * span);
        let h = 1e-5 * span;
        let [_, c1, c2] = curve.derivatives(t);
        let [before, after] = [curve.derivatives(t - h), curve.derivatives(t + h)];
        let speed = c1.length() + span * c2.length() + 1.0 / span;
        let third = (after[2] - before[2]).length() / (2.0 * h);
        prop_assert!(((after[0] - before[0]) / (2.0 * h)).distance(c1) < 1e-5 * speed + h * h * third);
        prop_assert!(((after[1] - before[1]) / (2.0 * h)).distance(c2) < 1e-3 * (speed / span + third * span));
    }

    #[test]
    fn a_surface_stays_the_same_under_knot_insertion_exchange_and_in_bezier_form(
        surface in any_surface(6), x in 0.0..1.0_f64, y in 0.0..1.0_f64, a in 0.01..0.99_f64, b in 0.01..0.99_f64,
    ) {
        let domain = surface.domain();
        let (u, v) = (at(domain.u, x), at(domain.v, y));
        let point = surface.point(u, v);
        let inserted = surface.insert_knots_u(&[at(domain.u, a)]).and_then(|s| s.insert_knots_v(&[at(domain.v, b)]));
        if let Ok(inserted) = inserted {
            prop_assert!(inserted.point(u, v).distance(point) < 1e-11 * size(&surface));
        }
        prop_assert!(surface.swapped().point(v, u).distance(point) < 1e-12 * size(&surface));
        let mut holding = 0;
        for patch in surface.to_bezier() {
            let (du, dv) = (patch.domain.u, patch.domain.v);
            if du[0] <= u && u < du[1] && dv[0] <= v && v < dv[1] {
                holding += 1;
                prop_assert!(patch.to_surface().point(u, v).distance(point) < 1e-10 * size(&surface));
            }
        }
        prop_assert_eq!(holding, 1);
    }

    #[test]
    fn a_grid_gives_what_single_points_give(
        surface in any_surface(8),
        us in proptest::collection::vec(-0.1..1.1_f64, 1..40), vs in proptest::collection::vec(-0.1..1.1_f64, 1..6),
    ) {
        let domain = surface.domain();
        let us: Vec<f64> = us.into_iter().map(|x| at(domain.u, x)).collect();
        let vs: Vec<f64> = vs.into_iter().map(|y| at(domain.v, y)).collect();
        let mut grid = GridSamples::default();
        surface.grid(&us, &vs, &mut grid);
        let mut positions = GridSamples::default();
        surface.grid_positions(&us, &vs, &mut positions);
        let mut first = FirstDerivatives::default();
        surface.grid_first_derivatives(&us, &vs, &mut first);
        let mut all = Vec::new();
        surface.grid_derivatives(&us, &vs, &mut all);
        prop_assert_eq!((grid.nu, grid.nv), (us.len(), vs.len()));
        prop_assert!(positions.normals.is_empty());
        for (j, &v) in vs.iter().enumerate() {
            for (i, &u) in us.iter().enumerate() {
                let k = j * us.len() + i;
                let d = surface.derivatives(u, v);
                let near = |a: DVec3, b: DVec3| a.distance(b) <= 1e-9 * (1.0 + b.length());
                prop_assert!(near(grid.positions[k], d.s));
                prop_assert!(near(positions.positions[k], d.s));
                prop_assert!(near(first.s[k], d.s) && near(first.su[k], d.su) && near(first.sv[k], d.sv));
                prop_assert!(near(all[k].s, d.s) && near(all[k].su, d.su) && near(all[k].sv, d.sv));
                prop_assert!(near(all[k].suu, d.suu) && near(all[k].suv, d.suv) && near(all[k].svv, d.svv));
                prop_assert!((grid.normals[k].length() - 1.0).abs() < 1e-12);
                // Where the area element nearly vanishes a normal has few digits.
                if d.su.cross(d.sv).length() > 1e-4 * d.su.length() * d.sv.length() {
                    prop_assert!(grid.normals[k].distance(surface.normal(u, v)) < 1e-8);
                }
            }
        }
    }

    #[test]
    fn principal_curvatures_and_directions_satisfy_their_equation(
        surface in any_surface(5), x in 0.0..1.0_f64, y in 0.0..1.0_f64,
    ) {
        let domain = surface.domain();
        let (u, v) = (at(domain.u, x), at(domain.v, y));
        let c = surface.curvature(u, v);
        let area2 = c.e * c.g - c.f * c.f;
        prop_assume!(area2 > 1e-6 * c.e * c.g);
        prop_assert!(c.k1 <= c.k2);
        let scale = c.k1.abs().max(c.k2.abs());
        prop_assert!((c.k1 * c.k2 - c.gaussian).abs() <= 1e-9 * scale * scale);
        prop_assert!((c.k1 + c.k2 - 2.0 * c.mean).abs() <= 1e-9 * scale);
        prop_assert!(c.kmag.abs() <= c.k1.abs() && c.kmag.abs() <= c.k2.abs());
        for (k, d) in [(c.k1, c.d1), (c.k2, c.d2)] {
            prop_assert!((d.length() - 1.0).abs() < 1e-12);
            if c.k2 - c.k1 > 1e-6 * scale {
                let rows = [
                    (c.l - k * c.e) * d.x + (c.m - k * c.f) * d.y,
                    (c.m - k * c.f) * d.x + (c.n - k * c.g) * d.y,
                ];
                let size = scale * (c.e + c.g) * 1e-6;
                prop_assert!(rows[0].abs() < size && rows[1].abs() < size);
            }
        }
        let d = surface.derivatives(u, v);
        if c.k2 - c.k1 > 1e-6 * scale {
            let (a, b) = (d.su * c.d1.x + d.sv * c.d1.y, d.su * c.d2.x + d.sv * c.d2.y);
            prop_assert!(a.dot(b).abs() <= 1e-6 * a.length() * b.length());
        }
    }

    #[test]
    fn a_normal_is_a_unit_vector_everywhere_even_on_collapsed_nets(
        surface in any_surface(4), collapse in 0..5_usize, x in 0.0..=1.0_f64, y in 0.0..=1.0_f64,
    ) {
        let nv = surface.knots_v().control_count();
        let control = surface.control().iter().enumerate().map(|(k, &p)| {
            let (i, j) = (k / nv, k % nv);
            match collapse {
                0 if i == 0 => surface.control()[0],
                1 if j == 0 => surface.control()[0],
                2 if i + j < 2 => surface.control()[0],
                3 => DVec3::new(1.0, 2.0, 3.0),
                4 => DVec3::new(p.x, 0.0, 0.0),
                _ => p,
            }
        }).collect();
        let surface = Surface::new(
            surface.knots_u().clone(), surface.knots_v().clone(), control, surface.weights().map(<[f64]>::to_vec),
        ).expect("valid");
        let domain = surface.domain();
        for (x, y) in [(x, y), (0.0, y), (x, 0.0), (0.0, 0.0), (1.0, 1.0), (0.5, 0.5)] {
            let (u, v) = (at(domain.u, x), at(domain.v, y));
            let n = surface.normal(u, v);
            prop_assert!((n.length() - 1.0).abs() < 1e-9, "{n} at {u}, {v}");
            let mut grid = GridSamples::default();
            surface.grid(&[u], &[v], &mut grid);
            prop_assert!((grid.normals[0].length() - 1.0).abs() < 1e-9);
            let c = surface.curvature(u, v);
            prop_assert!(c.k1.is_finite() && c.k2.is_finite() && c.d1.is_finite() && c.d2.is_finite());
        }
    }
}
