//! Both methods where the answer is known, against the reference case, and against each other.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::history::LENGTH;
use super::{MAX_MOVES, Outcome, ReleaseOptions, Released, mccartney, wang};
use crate::engine::budget::{Observer, Unobserved};
use crate::engine::distortion::{Thresholds, measure};
use crate::engine::error::{EngineError, Located};
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::test_meshes::{Diagonal, grid};
use crate::engine::mesh::{Mesh, MeshFault, Topology};
use crate::engine::seed::test_cases::{load, numbers, surface_mesh};

type Method = fn(&Mesh, &Topology, u32, ReleaseOptions, &dyn Observer) -> Result<Outcome, EngineError>;

const METHODS: [(&str, Method); 2] = [("mccartney", mccartney::flatten), ("wang", wang::flatten)];

fn released(method: Method, mesh: &Mesh, seed: u32, options: ReleaseOptions) -> Released {
    let (released, error) = method(mesh, &Topology::new(mesh).unwrap(), seed, options, &Unobserved).unwrap();
    assert_eq!(error, None);
    released
}

/// A panel curved both ways, 300 x 200 mm.
fn panel(points: usize, diagonal: Diagonal) -> Mesh {
    grid(points, points - 3, diagonal, |u, v| {
        let (x, y) = (300.0 * (u - 0.5), 200.0 * (v - 0.5));
        DVec3::new(x, y, 25.0 * (0.012 * x).cos() * (0.015 * y).cos())
    })
}

/// The greatest distance between two placed point sets after the best rigid motion of the first, without mirroring.
fn apart(from: &[DVec2], to: &[DVec2]) -> f64 {
    let middle = |p: &[DVec2]| p.iter().sum::<DVec2>() / p.len() as f64;
    let (a, b) = (middle(from), middle(to));
    let turn: DVec2 = from.iter().zip(to).map(|(p, q)| (q - b).rotate((p - a) * DVec2::new(1.0, -1.0))).sum();
    let turn = turn.normalize();
    from.iter().zip(to).map(|(p, q)| (b + turn.rotate(p - a)).distance(*q)).fold(0.0, f64::max)
}

#[test]
fn planes_and_cylinders_are_laid_without_energy_and_nothing_moves() {
    let plane = |u: f64, v: f64| DVec3::new(3.0 * u * u + u, 2.0 * v + 0.3 * u, 0.0);
    let cylinder = |u: f64, v: f64| DVec3::new(40.0 * (PI * u).cos(), 40.0 * (PI * u).sin(), 70.0 * v);
    // The rectangle of the chords.
    let wide = 20.0 * 2.0 * 40.0 * (0.5 * PI / 20.0).sin();
    for (name, method) in METHODS {
        let mesh = grid(21, 12, Diagonal::Diamond, plane);
        let flat = released(method, &mesh, 77, ReleaseOptions::default());
        let places: Vec<DVec2> = mesh.positions.iter().map(|p| p.truncate()).collect();
        assert!(apart(&flat.flat, &places) < 1e-12, "{name}");
        assert!(flat.report.settled && flat.report.energy_after_mm < 1e-24);
        let mesh = grid(21, 12, Diagonal::Regular, cylinder);
        let flat = released(method, &mesh, 200, ReleaseOptions::default());
        let places: Vec<DVec2> = mesh.uv.as_ref().unwrap().iter().map(|p| DVec2::new(p.x * wide, p.y * 70.0)).collect();
        assert!(apart(&flat.flat, &places) < 1e-10, "{name}");
        assert!(flat.report.settled && flat.report.energy_after_mm < 1e-20 && flat.report.moves < 50_000);
        assert_eq!(flat.levels.iter().sum::<u32>() as usize, mesh.triangles.len());
    }
}

#[test]
fn mccartney_lays_the_reference_case_as_given_and_releases_what_it_does() {
    let Some(file) = load("mccartney.json") else { return };
    let diagonal = Diagonal::of_name(file["mesh"].as_str().unwrap()).unwrap();
    let mesh = surface_mesh(&file["surface"], 11, 9, diagonal);
    let seed = file["seed"].as_u64().unwrap() as u32;
    let topology = Topology::new(&mesh).unwrap();
    let (laid, error) = mccartney::lay(&mesh, &topology, seed);
    assert_eq!(error, None);
    let given = file["initial"]["P2"].as_array().unwrap();
    assert_eq!(given.len(), laid.flat.len());
    for (place, given) in laid.flat.iter().zip(given) {
        assert!(place.distance(DVec2::from_slice(&numbers(given))) < 1e-7, "{place} {given}");
    }
    let before = file["initial"]["energy"].as_f64().unwrap();
    let mut last = before;
    for case in file["release"].as_array().unwrap() {
        let number = |key: &str| case[key].as_f64().unwrap();
        // Their step is one length, ours a share of the edges: these are about a millimetre long here.
        let options = ReleaseOptions { threshold: Some(number("E_t")), step: Some(0.01), ..ReleaseOptions::default() };
        let found = released(mccartney::flatten, &mesh, seed, options).report;
        assert!((found.energy_before_mm - before).abs() < 1e-9 * before);
        let theirs = number("energy_after");
        assert!(found.energy_after_mm > 0.5 * theirs && found.energy_after_mm < 1.2 * theirs, "{found:?} {theirs}");
        assert!(found.energy_after_mm < last && found.settled);
        last = found.energy_after_mm;
    }
    // By default it comes much further.
    let found = released(mccartney::flatten, &mesh, seed, ReleaseOptions::default()).report;
    assert!(found.energy_after_mm < last);
}

#[test]
fn the_energy_never_rises_and_both_methods_come_to_the_same_rest() {
    for diagonal in [Diagonal::Regular, Diagonal::Diamond] {
        let mesh = panel(25, diagonal);
        let finely = |method| {
            let options = ReleaseOptions { threshold: Some(1e-13), ..ReleaseOptions::default() };
            released(method, &mesh, 500, options)
        };
        let [one, other] = [mccartney::flatten as Method, wang::flatten].map(finely);
        for found in [&one, &other] {
            let report = &found.report;
            assert!(report.settled, "{report:?}");
            assert!(
                report.history.windows(2).all(|w| w[0].0 <= w[1].0 && w[0].1 >= w[1].1 * (1.0 - 1e-12)),
                "{report:?}"
            );
            let ends = (report.history[0], report.history[report.history.len() - 1]);
            assert_eq!((ends.0.0, ends.0.1, ends.1.1), (0, report.energy_before_mm, report.energy_after_mm));
            assert!(report.history.len() <= LENGTH);
            assert!(report.energy_after_mm < report.energy_before_mm);
        }
        let energies = [one.report.energy_after_mm, other.report.energy_after_mm];
        assert!((energies[0] / energies[1] - 1.0).abs() < 1e-4, "{energies:?}");
        assert!(apart(&one.flat, &other.flat) < 0.01, "{}", apart(&one.flat, &other.flat));
        // What is left by default is within one percent.
        for (name, method) in METHODS {
            let report = released(method, &mesh, 500, ReleaseOptions::default()).report;
            assert!(
                report.settled && report.energy_after_mm < 1.01 * energies[0].min(energies[1]),
                "{name} {report:?}"
            );
        }
    }
}

#[test]
fn released_lengths_are_nearer_to_those_in_space_than_as_laid() {
    let mesh = panel(25, Diagonal::Regular);
    let topology = Topology::new(&mesh).unwrap();
    let change = |flat: &[DVec2]| measure(&mesh, &topology, flat, None, Thresholds::default()).shape_change_percent;
    let (laid, _) = mccartney::lay(&mesh, &topology, 500);
    for (name, method) in METHODS {
        let found = released(method, &mesh, 500, ReleaseOptions::default());
        assert!(
            change(&found.flat) < 0.9 * change(&laid.flat),
            "{name}: {} {}",
            change(&found.flat),
            change(&laid.flat)
        );
    }
}

#[test]
fn the_same_mesh_comes_out_the_same_bit_for_bit_and_scaled_by_two_twice_as_large() {
    let mesh = panel(15, Diagonal::ChevronRows);
    let mut large = mesh.clone();
    large.positions.iter_mut().for_each(|p| *p *= 2.0);
    for (name, method) in METHODS {
        let of = |mesh: &Mesh| released(method, mesh, 100, ReleaseOptions::default());
        let (one, again, large) = (of(&mesh), of(&mesh), of(&large));
        assert_eq!(one, again, "{name}");
        // Twice the numbers are the same digits.
        assert!(one.flat.iter().zip(&large.flat).all(|(p, q)| *p * 2.0 == *q), "{name}");
        assert_eq!(one.report.moves, large.report.moves, "{name}");
    }
}

#[test]
fn moves_are_bounded_and_the_report_says_when_they_are_spent() {
    let mesh = panel(25, Diagonal::Regular);
    for (name, method) in METHODS {
        for most in [0, 1000, 30_000] {
            let options = ReleaseOptions { max_moves: Some(most), ..ReleaseOptions::default() };
            let report = released(method, &mesh, 500, options).report;
            assert!(report.moves <= most && !report.settled, "{name} {report:?}");
        }
    }
    // What a job may not ask for is not done either.
    let options = ReleaseOptions { max_moves: Some(u64::MAX), ..ReleaseOptions::default() };
    assert!(released(mccartney::flatten, &mesh, 500, options).report.moves < MAX_MOVES);
}

/// A cap that no triangle keeps its place in: half of a sphere and more.
fn bulb(points: usize) -> Mesh {
    grid(points, points, Diagonal::Regular, |u, v| {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let polar = 2.7 * x.hypot(y) / 2.0_f64.sqrt();
        let around = y.atan2(x);
        50.0 * DVec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos())
    })
}

#[test]
fn what_is_too_curved_is_refused_with_its_place() {
    let mesh = bulb(24);
    let topology = Topology::new(&mesh).unwrap();
    for (name, method) in METHODS {
        let (found, error) = method(&mesh, &topology, 500, ReleaseOptions::default(), &Unobserved).unwrap();
        let error = error.unwrap_or_else(|| panic!("{name}: {:?}", found.report));
        assert!(["circles-miss", "triangle-flipped"].contains(&error.code()), "{error}");
        let place = error.place();
        assert!(place.triangle.is_some() && place.uv.is_some() && place.xyz_mm.is_some(), "{place:?}");
        assert!(!error.remedies().is_empty());
        if let FlatteningError::FlippedAtRest { triangle, flips, total, .. } = error {
            // The triangle that is named does lie turned over.
            let [a, b, c] = mesh.triangles[triangle as usize].map(|v| found.flat[v as usize]);
            assert!((b - a).perp_dot(c - a) <= 0.0 && flips > 0 && total as usize == mesh.triangles.len());
        }
    }
}

#[test]
fn what_cannot_be_flattened_at_all_is_refused() {
    let mesh = grid(4, 4, Diagonal::Regular, |u, v| DVec3::new(u, v, 0.0));
    let topology = Topology::new(&mesh).unwrap();
    for (_, method) in METHODS {
        let refused =
            |mesh: &Mesh, seed| method(mesh, &topology, seed, ReleaseOptions::default(), &Unobserved).unwrap_err();
        assert_eq!(refused(&mesh, 18), FlatteningError::SeedOutOfRange { seed: 18, triangles: 18 }.into());
        let mut broken = mesh.clone();
        broken.positions[5] = broken.positions[0].lerp(broken.positions[1], 0.5);
        assert_eq!(refused(&broken, 3), FlatteningError::Mesh(MeshFault::ZeroArea { triangle: 0 }).into());
        broken.positions[5] = DVec3::NAN;
        assert_eq!(refused(&broken, 3), FlatteningError::Mesh(MeshFault::NotFinite { vertex: 5 }).into());
        let mut pieces = mesh.clone();
        pieces.triangles.retain(|t| !t.contains(&5) && !t.contains(&10));
        let topology = Topology::new(&pieces).unwrap();
        let (_, error) = method(&pieces, &topology, 0, ReleaseOptions::default(), &Unobserved).unwrap();
        assert!(matches!(error, Some(FlatteningError::SeveralPieces { unreached, .. }) if unreached > 0));
    }
}

#[test]
fn who_no_longer_wants_the_result_is_heard() {
    struct Gone;
    impl Observer for Gone {
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let mesh = panel(9, Diagonal::Regular);
    let topology = Topology::new(&mesh).unwrap();
    for (_, method) in METHODS {
        let refused = method(&mesh, &topology, 0, ReleaseOptions::default(), &Gone).unwrap_err();
        assert!(matches!(refused, EngineError::Cancelled));
    }
}
