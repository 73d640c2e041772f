//! Closed forms, properties, and what the options are for.

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::field::{Family, Field};
use super::{Along, Ampc, AmpcBorder, AmpcDirection, AmpcFamilies, AmpcOptions, Integration, NpRule, ampc};
use crate::engine::budget::Unobserved;
use crate::engine::curvature;
use crate::engine::error::{EngineError, Located};
use crate::engine::mesh::{Topology, measures};
use crate::engine::nurbs::Surface;
use crate::engine::nurbs::shapes::{any_surface, cylinder, knots, plane, revolved, sphere, torus};
use crate::engine::triangulation::{DomainFault, DomainMesh, TriangulationError, check_domain_mesh, lift};
use crate::engine::trimming::TrimRegion;

fn made(surface: &Surface, grid: [u32; 2], options: &AmpcOptions) -> Ampc {
    ampc(surface, grid, options, &Unobserved).unwrap()
}

/// All combinations of integration, border and families.
fn every_option() -> Vec<AmpcOptions> {
    let mut all = Vec::new();
    for integration in [Integration::Cells, Integration::RungeKutta] {
        for border in [AmpcBorder::Clamped, AmpcBorder::Free] {
            for families in [AmpcFamilies::One, AmpcFamilies::Both] {
                all.push(AmpcOptions { integration, border, families, ..AmpcOptions::default() });
            }
        }
    }
    all
}

fn faults(surface: &Surface, mesh: &DomainMesh) -> Vec<DomainFault> {
    check_domain_mesh(mesh, &TrimRegion::whole(surface.domain()))
}

/// A Bezier surface of degree 3 in both directions through a polynomial map of the unit square.
fn bicubic(map: impl Fn(f64, f64) -> DVec3) -> Surface {
    // Coefficients of the cubic through its values at thirds, in Bernstein form.
    let rows = [[1.0, 0.0, 0.0, 0.0], [-5.0, 18.0, -9.0, 2.0], [2.0, -9.0, 18.0, -5.0], [0.0, 0.0, 0.0, 1.0]];
    let rows = rows.map(|row: [f64; 4]| row.map(|x| x / row.iter().sum::<f64>()));
    let third = |k: usize| k as f64 / 3.0;
    let mut control = vec![DVec3::ZERO; 16];
    for i in 0..4 {
        for j in 0..4 {
            for k in 0..4 {
                for l in 0..4 {
                    control[i * 4 + j] += rows[i][k] * rows[j][l] * map(third(k), third(l));
                }
            }
        }
    }
    let line = knots(3, &[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
    Surface::new(line.clone(), line, control, None).unwrap()
}

/// A parabolic cylinder whose rulings, lines of constant u + shear v, cross the parameter lines.
fn sheared(shear: f64) -> Surface {
    bicubic(|u, v| {
        let x = u + shear * v;
        DVec3::new(100.0 * x, 80.0 * v, 60.0 * x * x)
    })
}

/// A cone over a parabola with its apex outside; u + 0.4 v is the ruling, and v goes along it.
fn fanned() -> Surface {
    bicubic(|u, v| {
        let (s, w) = (1.0 + 0.8 * v, u - 0.5 + 0.4 * (v - 0.5));
        100.0 * s * DVec3::new(1.0, w, 0.0) + DVec3::Z * 100.0 * s * w * w
    })
}

/// The greatest angle deficit of an interior vertex, rad.
fn greatest_deficit(surface: &Surface, made: Ampc) -> f64 {
    let lifted = lift(surface, made.domain, &made.lines);
    let topology = Topology::new(&lifted.mesh).unwrap();
    let rings = curvature::rings(&lifted.mesh, &topology);
    rings.iter().flatten().map(|ring| ring.deficit().abs()).fold(0.0, f64::max)
}

#[test]
fn on_a_cylinder_and_a_cone_the_lines_are_rulings() {
    let profile = [(DVec2::new(3.0, 0.0), 1.0), (DVec2::new(1.0, 5.0), 1.0)];
    let cone = revolved(knots(1, &[0.0, 0.0, 1.0, 1.0]), &profile);
    for surface in [cylinder(2.0, 5.0), cone] {
        for (surface, along) in [(surface.clone(), Along::V), (surface.swapped(), Along::U)] {
            for options in every_option() {
                let made = made(&surface, [24, 10], &options);
                assert_eq!(made.counts.direction, along);
                for line in &made.polylines {
                    let across = |p: &DVec2| if along == Along::V { p.x } else { p.y };
                    assert!(line.iter().all(|p| (across(p) - across(&line[0])).abs() < 1e-9));
                }
                assert_eq!(faults(&surface, &made.domain), [], "{options:?}");
            }
        }
    }
}

#[test]
fn a_plane_and_a_sphere_have_no_direction_and_take_straight_lines() {
    for surface in [plane(30.0, 20.0), sphere(4.0)] {
        for options in every_option() {
            let made = made(&surface, [9, 8], &options);
            // At a pole rounding may find one.
            assert!(made.counts.votes.iter().sum::<u64>() * 4 <= 9 * 8);
            assert_eq!(faults(&surface, &made.domain), []);
        }
    }
}

#[test]
fn the_fourth_order_rule_stays_on_curved_rulings() {
    // A parabolic cylinder over x = u + v / 2 + u v / 5: its rulings are lines of constant x.
    let x = |p: DVec2| p.x + 0.5 * p.y + 0.2 * p.x * p.y;
    let surface = bicubic(|u, v| {
        let x = x(DVec2::new(u, v));
        DVec3::new(100.0 * x, 80.0 * v, 50.0 * x * x)
    });
    let worst = |integration, n: u32| {
        let made = made(&surface, [4, n], &AmpcOptions { integration, ..AmpcOptions::default() });
        let off = |line: &Vec<DVec2>| line.iter().map(|p| (x(*p) - x(line[0])).abs()).fold(0.0, f64::max);
        made.polylines.iter().map(off).fold(0.0, f64::max)
    };
    let fourth = worst(Integration::RungeKutta, 5);
    assert!(fourth < 1e-6, "{fourth}");
    let (coarse, fine) = (worst(Integration::Cells, 5), worst(Integration::Cells, 9));
    assert!(fine > coarse / 4.0 && fine > 1e-4, "straight through cells is of first order: {coarse} {fine}");
}

#[test]
fn halving_the_step_divides_the_error_by_sixteen() {
    let surface = bicubic(|u, v| {
        DVec3::new(100.0 * u, 90.0 * v, 60.0 * (u + 0.4 * v).powi(2) + 12.0 * u * v * v - 15.0 * u * u * u)
    });
    let field = Field::new(&surface, Along::V, Family::Minimum, Integration::RungeKutta);
    let end = |steps: u32| {
        let h = 0.6 / f64::from(steps);
        let mut at = DVec2::new(0.5, 0.0);
        let mut direction = field.start(at);
        for _ in 0..steps {
            let (x, next) = field.step(at, direction, h).unwrap();
            (at, direction) = (DVec2::new(x, at.y + h), next);
        }
        at.x
    };
    let [a, b, c] = [4, 8, 16].map(end);
    let ratio = (a - b) / (b - c);
    assert!((10.0..25.0).contains(&ratio), "{ratio}: {a} {b} {c}");
}

#[test]
fn free_ends_bend_a_developable_surface_less_than_clamped_ones() {
    let surface = sheared(0.3);
    let of = |border| {
        let made = made(&surface, [20, 16], &AmpcOptions { border, ..AmpcOptions::default() });
        assert_eq!(faults(&surface, &made.domain), []);
        greatest_deficit(&surface, made)
    };
    let (free, clamped) = (of(AmpcBorder::Free), of(AmpcBorder::Clamped));
    assert!(free < 0.2 * clamped, "{free} against {clamped}");
}

#[test]
fn integrated_free_lines_lose_least_where_rulings_fan_out() {
    let surface = fanned();
    let of = |integration, border| {
        let made = made(&surface, [20, 16], &AmpcOptions { integration, border, ..AmpcOptions::default() });
        assert_eq!(faults(&surface, &made.domain), []);
        greatest_deficit(&surface, made)
    };
    let printed = of(Integration::Cells, AmpcBorder::Clamped);
    let best = of(Integration::RungeKutta, AmpcBorder::Free);
    assert!(best < 1e-2 * printed, "{best} against {printed}");
}

#[test]
fn cells_of_both_families_have_right_angles_in_space() {
    let surface = fanned();
    let worst = |families| {
        let options = AmpcOptions { families, integration: Integration::RungeKutta, ..AmpcOptions::default() };
        let options = AmpcOptions { border: AmpcBorder::Free, ..options };
        let made = made(&surface, [24, 24], &options);
        assert_eq!(faults(&surface, &made.domain), []);
        let domain = surface.domain();
        let inner = |p: DVec2| p.x > domain.u[0] && p.x < domain.u[1] && p.y > domain.v[0] && p.y < domain.v[1];
        let mut worst = 0.0_f64;
        let mut seen = 0;
        for pair in made.domain.triangles.windows(2) {
            // A whole cell: (a, b, c) and (a, c, d) inside.
            let [[a, b, c], [a2, c2, _]] = [pair[0], pair[1]];
            if a != a2 || c != c2 || !pair.as_flattened().iter().all(|&k| inner(made.domain.uv[k as usize])) {
                continue;
            }
            let [a, b, c] = [a, b, c].map(|k| made.domain.uv[k as usize]).map(|p| surface.point(p.x, p.y));
            worst = worst
                .max((a - b).angle_between(c - b).to_degrees() - 90.0)
                .max(90.0 - (a - b).angle_between(c - b).to_degrees());
            seen += 1;
        }
        assert!(seen > 100, "{seen}");
        worst
    };
    let (one, both) = (worst(AmpcFamilies::One), worst(AmpcFamilies::Both));
    assert!(both < 3.0 && one > 10.0, "degrees off: {both} and {one}");
}

#[test]
fn the_printed_rule_leaves_steps_of_two() {
    let surface = cylinder(2.0, 5.0);
    let widest = |np_rule| {
        let made = made(&surface, [24, 10], &AmpcOptions { np_rule, ..AmpcOptions::default() });
        let mut starts: Vec<f64> = made.domain.uv.iter().filter(|p| p.y == 0.0).map(|p| p.x / 4.0).collect();
        starts.sort_by(f64::total_cmp);
        starts.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max) * 24.0
    };
    assert!((widest(NpRule::Needed) - 1.0).abs() < 1e-6);
    assert!((widest(NpRule::Printed) - 2.0).abs() < 1e-6);
}

#[test]
fn thin_cells_are_dropped_at_the_border_alone_and_nothing_is_lost() {
    let surface = sheared(0.3);
    let all = made(&surface, [20, 20], &AmpcOptions::default());
    let options = AmpcOptions { drop_thin: true, min_distance_mm: 2.0, ..AmpcOptions::default() };
    let kept = made(&surface, [20, 20], &options);
    assert!(kept.counts.cells_dropped > 0 && !kept.dropped.triangles.is_empty());
    assert_eq!(kept.domain.triangles.len() + kept.dropped.triangles.len(), all.domain.triangles.len());
    let area = |mesh: &DomainMesh| -> f64 {
        let at = |k: u32| mesh.uv[k as usize];
        mesh.triangles.iter().map(|&[a, b, c]| 0.5 * (at(b) - at(a)).perp_dot(at(c) - at(a))).sum()
    };
    assert!((area(&kept.domain) + area(&kept.dropped) - 1.0).abs() < 1e-12);
    assert!(faults(&surface, &kept.domain).iter().all(|fault| !matches!(fault, DomainFault::Unused(_))));
    let nothing = made(&surface, [20, 20], &AmpcOptions { min_distance_mm: 0.0, ..options });
    assert_eq!(nothing.counts.cells_dropped, 0);
}

#[test]
fn a_direction_that_no_line_runs_along_is_refused_with_a_remedy() {
    let options = AmpcOptions { direction: AmpcDirection::U, ..AmpcOptions::default() };
    let error = ampc(&cylinder(2.0, 5.0), [12, 12], &options, &Unobserved).unwrap_err();
    assert_eq!(error, TriangulationError::NoPolyline { along: Along::U, strips: 6 }.into());
    assert!(error.to_string().contains("along u") && error.remedies().len() == 2, "{error}");
    let error = ampc(&cylinder(2.0, 5.0), [1025, 2], &options, &Unobserved).unwrap_err();
    assert!(matches!(error, EngineError::Parameter { .. }));
}

#[test]
fn the_area_approaches_that_of_the_surface() {
    let surface = torus(5.0, 2.0);
    let exact = surface.area(1e-9);
    for options in every_option() {
        let of = |points| {
            let made = made(&surface, [points, points], &options);
            assert_eq!(faults(&surface, &made.domain), []);
            let lifted = lift(&surface, made.domain, &made.lines);
            (measures::total_area(&lifted.mesh) - exact).abs() / exact
        };
        let (coarse, fine) = (of(20), of(40));
        assert!(fine < 0.5 * coarse && fine < 1e-2, "{options:?}: {coarse} {fine}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_surface_is_covered_whole_or_refused(
        surface in any_surface(3),
        m in 2..18_u32,
        n in 2..18_u32,
        direction in prop_oneof![Just(AmpcDirection::Modal), Just(AmpcDirection::U), Just(AmpcDirection::V)],
    ) {
        for options in every_option() {
            match ampc(&surface, [m, n], &AmpcOptions { direction, ..options }, &Unobserved) {
                Ok(made) => {
                    prop_assert_eq!(faults(&surface, &made.domain), [], "{:?}", options);
                    prop_assert!(!made.polylines.is_empty());
                }
                Err(EngineError::Triangulation(error)) => {
                    let refused = match error {
                        TriangulationError::NoPolyline { .. } => true,
                        TriangulationError::LinesTangle { .. } => options.families == AmpcFamilies::Both,
                        _ => false,
                    };
                    prop_assert!(refused, "{:?}: {error}", options);
                }
                Err(error) => prop_assert!(false, "{error}"),
            }
        }
    }
}
