//! Pins and kept lengths where the answer is known.

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::super::tests::{cap, flips, panel};
use super::{Kept, KeptCurve, Pin};
use crate::engine::budget::Unobserved;
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningError;
use crate::engine::flattening::isometric::{Isometric, IsometricOptions, Objective, flatten};
use crate::engine::flattening::rigid::Rigid;
use crate::engine::mesh::test_meshes::{Diagonal, grid};
use crate::engine::mesh::{Mesh, Topology};

const OBJECTIVES: [Objective; 4] = [Objective::Balanced, Objective::Arap, Objective::Area, Objective::Shape];

fn solve(mesh: &Mesh, options: &IsometricOptions) -> Result<Isometric, EngineError> {
    flatten(mesh, &Topology::new(mesh).unwrap(), options, &Unobserved)
}

fn free(mesh: &Mesh, objective: Objective) -> Isometric {
    solve(mesh, &IsometricOptions { objective, ..IsometricOptions::default() }).unwrap()
}

fn pinned(mesh: &Mesh, objective: Objective, pins: &[Pin]) -> Result<Isometric, EngineError> {
    solve(mesh, &IsometricOptions { objective, pins: pins.to_vec(), ..IsometricOptions::default() })
}

fn place(mesh: &Mesh, flat: &[DVec2], pin: &Pin) -> DVec2 {
    let corners = mesh.triangles[pin.triangle as usize];
    corners.iter().zip(pin.weights).map(|(&v, w)| flat[v as usize] * w).sum()
}

/// Pins at where points of a map lie, moved by `f`.
fn pins_of(mesh: &Mesh, flat: &[DVec2], triangles: &[u32], f: impl Fn(DVec2) -> DVec2) -> Vec<Pin> {
    let weights = [[0.2, 0.3, 0.5], [1.0, 0.0, 0.0], [0.5, 0.5, 0.0]];
    let pin = |(k, &triangle): (usize, &u32)| {
        let pin = Pin { triangle, weights: weights[k % 3], to: DVec2::ZERO };
        Pin { to: f(place(mesh, flat, &pin)), ..pin }
    };
    triangles.iter().enumerate().map(pin).collect()
}

fn worst(mesh: &Mesh, flat: &[DVec2], pins: &[Pin]) -> f64 {
    pins.iter().map(|pin| place(mesh, flat, pin).distance(pin.to)).fold(0.0, f64::max)
}

fn strip() -> Mesh {
    grid(33, 9, Diagonal::Diamond, |u, v| DVec3::new(40.0 * u, 10.0 * v, 0.0))
}

#[test]
fn one_pin_moves_the_free_map_and_no_more() {
    let mesh = panel(Diagonal::Regular, 0.4);
    for objective in OBJECTIVES {
        let free = free(&mesh, objective);
        let pins = pins_of(&mesh, &free.flat, &[100], |_| DVec2::new(50.0, -20.0));
        let found = pinned(&mesh, objective, &pins).unwrap();
        assert!(worst(&mesh, &found.flat, &pins) < 1e-11);
        let shift = found.flat[0] - free.flat[0];
        assert!(free.flat.iter().zip(&found.flat).all(|(a, b)| (*b - *a).distance(shift) < 1e-12));
        assert_eq!(found.run.rounds, free.run.rounds);
        assert!((found.run.energy - free.run.energy).abs() <= 1e-9 * free.run.energy, "{objective:?}");
    }
}

#[test]
fn pins_where_the_points_lie_anyhow_move_the_free_map_rigidly() {
    let mesh = panel(Diagonal::Diamond, 0.4);
    let free = free(&mesh, Objective::Balanced);
    let turn = DVec2::from_angle(2.0);
    let motion = |p: DVec2| turn.rotate(p) + DVec2::new(7.0, 3.0);
    for triangles in [&[3, 200][..], &[3, 200, 90, 377]] {
        let pins = pins_of(&mesh, &free.flat, triangles, motion);
        let found = pinned(&mesh, Objective::Balanced, &pins).unwrap();
        assert_eq!(found.run.rounds, free.run.rounds, "nothing is solved again");
        assert!(free.flat.iter().zip(&found.flat).all(|(a, b)| motion(*a).distance(*b) < 1e-9));
    }
}

#[test]
fn a_strip_between_pins_that_are_too_far_apart_is_stretched() {
    let mesh = strip();
    let size = 20.0;
    for objective in OBJECTIVES {
        // The ends, every vertex of them, a hundredth farther apart: the strain is uniform, with the width free.
        let mut pins = Vec::new();
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let p = mesh.positions[corners[k] as usize];
                if p.x == 0.0 || p.x == 40.0 {
                    let mut weights = [0.0; 3];
                    weights[k] = 1.0;
                    pins.push(Pin { triangle: t as u32, weights, to: DVec2::new(1.01 * p.x + 3.0, p.y) });
                }
            }
        }
        let found = pinned(&mesh, objective, &pins).unwrap();
        assert!(worst(&mesh, &found.flat, &pins) < 1e-9 * size, "{objective:?}");
        assert_eq!(flips(&mesh, &found.flat), 0);
        let middle = |k: usize| found.flat[4 * 33 + k];
        let along = (middle(20).x - middle(12).x) / 10.0;
        assert!((along - 1.01).abs() < 2e-3, "{objective:?}: {along}");
        // Both energies have no lateral contraction: one strain, the width as it was.
        let s: f64 = 1.01;
        let expected = match objective {
            Objective::Balanced => s * s + 1.0 / (s * s) - 2.0,
            Objective::Arap => (s - 1.0) * (s - 1.0),
            _ => continue,
        };
        assert!((found.run.energy / expected - 1.0).abs() < 1e-8, "{objective:?}: {} {expected}", found.run.energy);
    }
}

#[test]
fn two_pins_too_far_apart_are_met_for_the_least_energy() {
    let mesh = strip();
    for objective in OBJECTIVES {
        let flat: Vec<DVec2> = mesh.positions.iter().map(|p| p.truncate()).collect();
        let pins = pins_of(&mesh, &flat, &[0, 511], |p| 1.01 * p);
        let found = pinned(&mesh, objective, &pins).unwrap();
        assert!(worst(&mesh, &found.flat, &pins) < 2e-8 && flips(&mesh, &found.flat) == 0, "{objective:?}");
        assert!(found.run.energy > 0.0);
        // Sizes of changes at two pulled points have no clear least: there the rounds run out.
        assert!(
            found.run.converged || matches!(objective, Objective::Area | Objective::Shape | Objective::Weights { .. })
        );
        // No admissible change lowers the energy: the uniform stretch is one, and costs more.
        let stretched: Vec<DVec2> = flat.iter().map(|p| 1.01 * *p).collect();
        assert!(worst(&mesh, &stretched, &pins) < 1e-12);
        let s: f64 = 1.01;
        let uniform = match objective {
            Objective::Balanced => 2.0 * (s * s + 1.0 / (s * s)) - 4.0,
            Objective::Arap => 2.0 * (s - 1.0) * (s - 1.0),
            // Of sizes and with softening: no closed form; that the change of area is less than the uniform one's is a bound.
            _ => {
                let double = |t: &[u32; 3]| {
                    let [a, b, c] = t.map(|k| found.flat[k as usize]);
                    (b - a).perp_dot(c - a)
                };
                let area = 0.5 * mesh.triangles.iter().map(double).sum::<f64>();
                assert!((area / 400.0 - 1.0).abs() < s * s - 1.0, "{objective:?}: {area}");
                continue;
            }
        };
        assert!(found.run.energy < uniform, "{objective:?}");
    }
}

#[test]
fn a_curved_panel_is_bent_to_pins_far_off_under_every_objective() {
    for mesh in [panel(Diagonal::Diamond, 0.5), cap(1.0, 12)] {
        let flat = free(&mesh, Objective::Balanced).flat;
        let count = mesh.triangles.len() as u32;
        let bend =
            |p: DVec2| DVec2::new(1.05 * p.x + 0.1 * p.y * p.y, 0.95 * p.y - 0.05 * p.x * p.x) + DVec2::splat(9.0);
        let pins = pins_of(&mesh, &flat, &[0, count / 5, count / 2, 3 * count / 4, count - 1], bend);
        for objective in OBJECTIVES {
            let found = pinned(&mesh, objective, &pins).unwrap();
            assert!(worst(&mesh, &found.flat, &pins) < 2e-9, "{objective:?}");
            assert_eq!(flips(&mesh, &found.flat), 0, "{objective:?}");
            assert_eq!(found, pinned(&mesh, objective, &pins).unwrap(), "the same bytes each time");
        }
    }
}

#[test]
fn pins_that_turn_a_triangle_over_are_refused_with_the_worst() {
    let mesh = panel(Diagonal::Regular, 0.3);
    let free = free(&mesh, Objective::Balanced);
    for objective in OBJECTIVES {
        // The corners of one triangle, mirrored.
        let [a, b, c] = mesh.triangles[150].map(|v| free.flat[v as usize]);
        let pin = |k: usize, to: DVec2| {
            let mut weights = [0.0; 3];
            weights[k] = 1.0;
            Pin { triangle: 150, weights, to }
        };
        let pins = [pin(0, a), pin(1, c), pin(2, b)];
        match pinned(&mesh, objective, &pins) {
            Err(EngineError::Flattening(FlatteningError::PinsNotMet { pin, residual_mm, .. })) => {
                assert!(pin < 3 && residual_mm > 1e-3, "{objective:?}: {pin} {residual_mm}");
            }
            other => panic!("{objective:?}: {other:?}"),
        }
        // Two targets for one point.
        let twice = [pin(0, a), pin(0, a + DVec2::new(0.1, 0.0)), pin(1, b)];
        assert!(pinned(&mesh, objective, &twice).is_err(), "{objective:?}");
    }
}

/// Relative change of the border's length, and the greatest of an edge.
fn length_errors(mesh: &Mesh, flat: &[DVec2], border: usize) -> [f64; 2] {
    let topology = Topology::new(mesh).unwrap();
    let halfedges = topology.borders().nth(border).unwrap();
    let (mut sums, mut worst) = ([0.0; 2], 0.0_f64);
    for &h in halfedges {
        let [a, b] = [topology.origin(h), topology.target(h)].map(|v| v as usize);
        let (rest, length) = (mesh.positions[a].distance(mesh.positions[b]), flat[a].distance(flat[b]));
        sums = [sums[0] + rest, sums[1] + length];
        worst = worst.max((length / rest - 1.0).abs());
    }
    [(sums[1] / sums[0] - 1.0).abs(), worst]
}

#[test]
fn the_more_a_length_weighs_the_better_it_is_kept_and_the_more_it_costs() {
    let mesh = cap(std::f64::consts::FRAC_PI_3, 20);
    for objective in OBJECTIVES {
        let free = free(&mesh, objective);
        let mut before = ([length_errors(&mesh, &free.flat, 0)[0], free.run.energy], free.clone());
        for weight in [0.0, 0.1, 1.0, 10.0, 100.0, 1000.0] {
            let keep = vec![Kept { curve: KeptCurve::Borders, weight }];
            let found = solve(&mesh, &IsometricOptions { objective, keep, ..IsometricOptions::default() }).unwrap();
            assert_eq!(flips(&mesh, &found.flat), 0);
            let now = [length_errors(&mesh, &found.flat, 0)[0], found.run.energy];
            if weight == 0.0 {
                assert_eq!(found.flat, free.flat, "no weight, no change");
            } else {
                assert!(
                    now[0] < before.0[0] && now[1] > before.0[1] * (1.0 - 1e-3),
                    "{objective:?} {weight}: {now:?} {before:?}"
                );
            }
            before = (now, found);
        }
        let [total, worst] = length_errors(&mesh, &before.1.flat, 0);
        assert!(total < 2e-3 && worst < 4e-3, "{objective:?}: {total} {worst}");
    }
}

#[test]
fn the_border_that_is_named_is_kept() {
    // A tube of a cone's kind with a bulge: two borders.
    let mut mesh = panel(Diagonal::Mirrored, 0.8);
    let mut at = 0;
    mesh.triangles.retain(|_| {
        let (i, j) = ((at / 2) % 16, (at / 2) / 16);
        at += 1;
        !((5..10).contains(&i) && (4..8).contains(&j))
    });
    let error = |keep: &[Kept], border: usize| {
        let options = IsometricOptions { keep: keep.to_vec(), ..IsometricOptions::default() };
        length_errors(&mesh, &solve(&mesh, &options).unwrap().flat, border)[1]
    };
    let kept = |border: u32| [Kept { curve: KeptCurve::Border(border), weight: 300.0 }];
    for border in 0..2 {
        assert!(error(&kept(border), border as usize) < 0.1 * error(&[], border as usize));
        assert!(error(&kept(1 - border), border as usize) > 0.2 * error(&[], border as usize));
    }
    let refused = IsometricOptions { keep: kept(2).to_vec(), ..IsometricOptions::default() };
    assert!(matches!(solve(&mesh, &refused), Err(EngineError::Parameter { .. })));
}

#[test]
fn what_cannot_be_a_constraint_is_refused() {
    let mesh = panel(Diagonal::Regular, 0.1);
    let pin = Pin { triangle: 0, weights: [1.0, 0.0, 0.0], to: DVec2::ZERO };
    for bad in [
        Pin { triangle: 1 << 20, ..pin },
        Pin { weights: [1.0, 1.0, 0.0], ..pin },
        Pin { weights: [f64::NAN; 3], ..pin },
        Pin { to: DVec2::new(f64::INFINITY, 0.0), ..pin },
    ] {
        assert!(
            matches!(pinned(&mesh, Objective::Balanced, &[pin, bad]), Err(EngineError::Parameter { .. })),
            "{bad:?}"
        );
    }
    for weight in [-1.0, f64::NAN, f64::INFINITY] {
        let keep = vec![Kept { curve: KeptCurve::Borders, weight }];
        let options = IsometricOptions { keep, ..IsometricOptions::default() };
        assert!(matches!(solve(&mesh, &options), Err(EngineError::Parameter { .. })));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn pins_and_lengths_go_along_with_motions_mirrors_and_numberings(
        height in 0.1..0.8, angle in 0.0..6.3, x in -100.0..100.0, stretch in 0.95..1.05,
    ) {
        let mesh = panel(Diagonal::Diamond, height);
        let free = free(&mesh, Objective::Balanced).flat;
        let keep = vec![Kept { curve: KeptCurve::Borders, weight: 5.0 }];
        let solve = |mesh: &Mesh, pins: Vec<Pin>| {
            let options = IsometricOptions { objective: Objective::Balanced, pins, keep: keep.clone() };
            solve(mesh, &options).unwrap().flat
        };
        let pins = pins_of(&mesh, &free, &[5, 190, 301], |p| p * stretch);
        let expected = solve(&mesh, pins.clone());
        prop_assert!(worst(&mesh, &expected, &pins) < 1e-9);
        // Targets moved: the whole moves along.
        let motion = Rigid { rotation: DVec2::from_angle(angle), shift: DVec2::new(x, 3.0), residual: 0.0 };
        let moved = solve(&mesh, pins.iter().map(|pin| Pin { to: motion.at(pin.to), ..*pin }).collect());
        prop_assert!(expected.iter().zip(&moved).all(|(a, b)| motion.at(*a).distance(*b) < 1e-5));
        // Part and targets mirrored.
        let mut mirrored = mesh.clone();
        mirrored.positions.iter_mut().for_each(|p| p.x = -p.x);
        mirrored.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let flip = |p: DVec2| DVec2::new(-p.x, p.y);
        let images = pins.iter().map(|p| Pin { weights: [p.weights[0], p.weights[2], p.weights[1]], to: flip(p.to), ..*p });
        let found = solve(&mirrored, images.collect());
        prop_assert!(expected.iter().zip(&found).all(|(a, b)| flip(*a).distance(*b) < 1e-5));
        // Triangles the other way round.
        let mut renumbered = mesh.clone();
        renumbered.triangles = mesh.triangles.iter().rev().map(|&[a, b, c]| [b, c, a]).collect();
        let last = mesh.triangles.len() as u32 - 1;
        let images = pins.iter().map(|p| Pin { triangle: last - p.triangle, weights: [p.weights[1], p.weights[2], p.weights[0]], ..*p });
        let found = solve(&renumbered, images.collect());
        prop_assert!(expected.iter().zip(&found).all(|(a, b)| a.distance(*b) < 1e-5));
    }
}
