//! The isometric method where the answer is known, and what must hold for every mesh.

use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DQuat, DVec2, DVec3};
use proptest::prelude::*;
use robust::{Coord, orient2d};

use super::{Isometric, IsometricOptions, Objective, flatten};
use crate::engine::budget::{Observer, Unobserved};
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::test_meshes::{Diagonal, grid};
use crate::engine::mesh::{Mesh, MeshFault, Topology};

const OBJECTIVES: [Objective; 5] = [
    Objective::Balanced,
    Objective::Arap,
    Objective::Area,
    Objective::Shape,
    Objective::Weights { area: 1.0, shape: 30.0 },
];

fn solve(mesh: &Mesh, objective: Objective) -> Isometric {
    flatten(
        mesh,
        &Topology::new(mesh).unwrap(),
        &IsometricOptions { objective, ..IsometricOptions::default() },
        &Unobserved,
    )
    .unwrap()
}

fn refusal(mesh: &Mesh) -> EngineError {
    flatten(mesh, &Topology::new(mesh).unwrap(), &IsometricOptions::default(), &Unobserved).unwrap_err()
}

pub(super) fn flips(mesh: &Mesh, flat: &[DVec2]) -> usize {
    let place = |v: u32| Coord { x: flat[v as usize].x, y: flat[v as usize].y };
    mesh.triangles.iter().filter(|t| orient2d(place(t[0]), place(t[1]), place(t[2])) <= 0.0).count()
}

/// Singular values of each triangle's map, greater first, with the triangle's share of the area.
fn stretches(mesh: &Mesh, flat: &[DVec2]) -> Vec<(f64, f64, f64)> {
    let total = crate::engine::mesh::measures::total_area(mesh);
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            let [p, q, r] = t.map(|v| flat[v as usize]);
            let (u, n) = ((b - a).normalize(), (b - a).cross(c - a));
            let (x1, x2, y2) = ((b - a).length(), (c - a).dot(u), n.length() / (b - a).length());
            let first = (q - p) / x1;
            let second = (r - p - first * x2) / y2;
            // Conformal and anticonformal part: nothing cancels where the map is nearly rigid.
            let turn = 0.5 * DVec2::new(first.x + second.y, first.y - second.x).length();
            let shear = 0.5 * DVec2::new(first.x - second.y, first.y + second.x).length();
            (turn + shear, turn - shear, 0.5 * n.length() / total)
        })
        .collect()
}

/// The greatest distance between two point sets after the best rigid motion, mirrored when asked.
fn apart(from: &[DVec2], to: &[DVec2], mirrored: bool) -> f64 {
    let from: Vec<DVec2> = from.iter().map(|p| if mirrored { DVec2::new(-p.x, p.y) } else { *p }).collect();
    let middle = |p: &[DVec2]| p.iter().sum::<DVec2>() / p.len() as f64;
    let (a, b) = (middle(&from), middle(to));
    let turn: DVec2 = from.iter().zip(to).map(|(p, q)| (q - b).rotate((p - a) * DVec2::new(1.0, -1.0))).sum();
    let turn = turn.normalize();
    from.iter().zip(to).map(|(p, q)| (b + turn.rotate(p - a)).distance(*q)).fold(0.0, f64::max)
}

/// A spherical cap of radius 1 and half-angle `angle`: `rings` rings of 6, 12, 18, ... vertices about the pole.
pub(super) fn cap(angle: f64, rings: u32) -> Mesh {
    let mut mesh = Mesh { positions: vec![DVec3::Z], ..Mesh::default() };
    let first = |ring: u32| if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    for ring in 1..=rings {
        let polar = angle * f64::from(ring) / f64::from(rings);
        for k in 0..6 * ring {
            let around = TAU * f64::from(k) / f64::from(6 * ring);
            mesh.positions.push(DVec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()));
        }
    }
    for ring in 1..=rings {
        let (inner, outer) = (6 * (ring - 1).max(1), 6 * ring);
        let (a, b) = (first(ring - 1), first(ring));
        for side in 0..6 {
            for k in 0..ring {
                let (i, o) = (side * (ring - 1) + k, side * ring + k);
                let within = |i: u32| if ring == 1 { 0 } else { a + i % inner };
                mesh.triangles.push([within(i), b + o, b + (o + 1) % outer]);
                if k + 1 < ring {
                    mesh.triangles.push([within(i), b + (o + 1) % outer, within(i + 1)]);
                }
            }
        }
    }
    mesh
}

/// A saddle with waves: doubly curved, not symmetric.
pub(super) fn panel(diagonal: Diagonal, height: f64) -> Mesh {
    grid(17, 13, diagonal, |u, v| {
        let (x, y) = (3.0 * u, 2.0 * v);
        DVec3::new(x, y, height * ((1.3 * x).sin() * (0.9 * y + 0.4).cos() + 0.2 * x * y))
    })
}

#[test]
fn planes_and_other_developables_are_laid_down_without_strain() {
    for diagonal in Diagonal::ALL {
        let plane = grid(13, 9, diagonal, |u, v| DVec3::new(3.0 * u * u + u, 0.0, 2.0 * v + 0.3 * u));
        let cylinder =
            grid(25, 9, diagonal, |u, v| DVec3::new((4.0 * u).cos() * 40.0, (4.0 * u).sin() * 40.0, 70.0 * v));
        let cone = grid(25, 9, diagonal, |u, v| {
            let r = 1.0 + v;
            DVec3::new(r * (4.0 * u).cos(), r * (4.0 * u).sin(), 2.0 * r)
        });
        for mesh in [plane, cylinder, cone] {
            for objective in OBJECTIVES {
                let found = solve(&mesh, objective);
                assert!(found.run.converged);
                assert_eq!(flips(&mesh, &found.flat), 0);
                for (s1, s2, _) in stretches(&mesh, &found.flat) {
                    assert!((s1 - 1.0).abs() < 1e-10 && (s2 - 1.0).abs() < 1e-10, "{objective:?}: {s1} {s2}");
                }
            }
        }
    }
}

#[test]
fn caps_have_the_least_energies_that_are_known() {
    // Half-angle, mean symmetric Dirichlet energy, mean ARAP energy: from the radial equations.
    let known = [
        (15.0, 4.00010, 0.000_025),
        (30.0, 4.00158, 0.000_401),
        (45.0, 4.00811, 0.002_087),
        (60.0, 4.02613, 0.006_868),
        (90.0, 4.14051, 0.039_094),
    ];
    for (degrees, balanced, arap) in known {
        let angle = degrees * PI / 180.0;
        for (objective, expected, offset) in [(Objective::Balanced, balanced, 4.0), (Objective::Arap, arap, 0.0)] {
            let [a, b, c] = [12, 24, 48].map(|rings| offset + solve(&cap(angle, rings), objective).run.energy);
            // Richardson's extrapolation with the order that the three show.
            let limit = c - (c - b) * (c - b) / ((c - b) - (b - a));
            assert!((limit - expected).abs() < 5.5e-6, "{degrees} {objective:?}: {a} {b} {c} -> {limit}");
        }
    }
}

#[test]
fn caps_have_the_extreme_stretches_that_are_known() {
    // Half-angle, s1 and s2 at the border of the least balanced energy, and of the least ARAP energy.
    let known = [
        (15.0, [1.00864, 0.99574], [1.00862, 0.99572]),
        (30.0, [1.03538, 0.98322], [1.03507, 0.98287]),
        (45.0, [1.08291, 0.96322], [1.08126, 0.96146]),
        (60.0, [1.15638, 0.93686], [1.15073, 0.93152]),
        (90.0, [1.42333, 0.87038], [1.38629, 0.84657]),
    ];
    for (degrees, balanced, arap) in known {
        // 99 846 triangles.
        let mesh = cap(degrees * PI / 180.0, 129);
        for (objective, [most, least]) in [(Objective::Balanced, balanced), (Objective::Arap, arap)] {
            let all = stretches(&mesh, &solve(&mesh, objective).flat);
            let s1 = all.iter().map(|s| s.0).fold(0.0, f64::max);
            let s2 = all.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
            println!("{degrees} {objective:?}: {:.1e} {:.1e}", s1 - most, s2 - least);
            assert!((s1 - most).abs() < 1e-3 && (s2 - least).abs() < 1e-3, "{degrees} {objective:?}: {s1} {s2}");
        }
    }
}

/// The outline in the pattern does not depend on how the panel was triangulated: five triangulations agree the better the
/// denser they are.
#[test]
fn the_outline_converges_whatever_the_triangulation() {
    let surface = |u: f64, v: f64| {
        let (x, y) = (3.0 * u, 2.0 * v);
        DVec3::new(x, y, 0.3 * ((1.3 * x).sin() * (0.9 * y + 0.4).cos() + 0.2 * x * y))
    };
    // Places of the outline that all grids share.
    let outline = |cells: usize, diagonal: Diagonal, warp: f64| {
        // The free triangulation: parameter lines bent, but not at the outline's places.
        let mesh = grid(cells + 1, cells + 1, diagonal, |u, v| {
            let bend = |a: f64, b: f64| a + warp * (8.0 * TAU * a).sin() * (PI * b).sin().powi(2) / 12.0;
            surface(bend(u, v), bend(v, u))
        });
        let flat = solve(&mesh, Objective::Balanced).flat;
        let (step, side) = (cells / 8, cells + 1);
        (0..8)
            .flat_map(|k| [[k * step, 0], [cells, k * step], [cells - k * step, cells], [0, cells - k * step]])
            .map(|[i, j]| flat[j * side + i])
            .collect::<Vec<DVec2>>()
    };
    let diagonal = (3.0_f64).hypot(2.0);
    let kinds = [
        (Diagonal::Regular, 0.0),
        (Diagonal::Mirrored, 0.0),
        (Diagonal::Diamond, 0.0),
        (Diagonal::ChevronRows, 0.0),
        (Diagonal::Diamond, 0.12),
    ];
    let best = outline(160, Diagonal::Diamond, 0.0);
    let worst = [16, 40, 80].map(|cells| {
        kinds
            .map(|(kind, warp)| apart(&outline(cells, kind, warp), &best, false) / diagonal)
            .into_iter()
            .fold(0.0, f64::max)
    });
    assert!(worst[2] < 1e-4, "{worst:?}");
    assert!(worst[1] < 0.5 * worst[0] && worst[2] < 0.5 * worst[1], "{worst:?}");
}

#[test]
fn each_objective_is_best_at_what_it_asks_for() {
    let mesh = panel(Diagonal::Diamond, 0.3);
    let measured = OBJECTIVES.map(|objective| {
        let all = stretches(&mesh, &solve(&mesh, objective).flat);
        let mean = |f: &dyn Fn(f64, f64) -> f64| all.iter().map(|&(a, b, w)| w * f(a, b)).sum::<f64>();
        [
            mean(&|a, b| a * a + b * b + 1.0 / (a * a) + 1.0 / (b * b) - 4.0),
            mean(&|a, b| (a - 1.0).powi(2) + (b - 1.0).powi(2)),
            mean(&|a, b| (a * b - 1.0).abs()),
            mean(&|a, b| (a - b).abs()),
        ]
    });
    for (quantity, best) in [(0, 0), (1, 1), (2, 2), (3, 4)] {
        for other in 0..OBJECTIVES.len() {
            assert!(measured[best][quantity] <= measured[other][quantity], "{quantity}: {measured:?}");
        }
    }
}

#[test]
fn strongly_curved_meshes_lie_without_a_flip_under_every_objective() {
    // A sphere but for a small hole at the south pole, and a steep wavy panel.
    for mesh in [cap(0.93 * PI, 24), panel(Diagonal::Regular, 3.0)] {
        for objective in OBJECTIVES {
            let found = solve(&mesh, objective);
            assert_eq!(flips(&mesh, &found.flat), 0, "{objective:?}");
        }
    }
}

#[test]
fn holes_are_left_open() {
    let mut mesh = panel(Diagonal::Mirrored, 0.5);
    // Cells of two holes leave.
    let cell = |t: usize| ((t / 2) % 16, (t / 2) / 16);
    let mut at = 0;
    mesh.triangles.retain(|_| {
        let (i, j) = cell(at);
        at += 1;
        !((3..6).contains(&i) && (3..7).contains(&j) || (9..14).contains(&i) && (5..9).contains(&j))
    });
    let topology = Topology::new(&mesh).unwrap();
    assert_eq!(topology.border_count(), 3);
    let found = flatten(&mesh, &topology, &IsometricOptions::default(), &Unobserved).unwrap();
    assert!(found.run.converged && flips(&mesh, &found.flat) == 0);
    // Vertices of no triangle lie nowhere, all others somewhere.
    let mut used = vec![false; mesh.positions.len()];
    for &v in mesh.triangles.as_flattened() {
        used[v as usize] = true;
    }
    assert!(used.iter().zip(&found.flat).all(|(used, p)| *used == p.is_finite()));
    assert!(used.iter().any(|used| !used));
    // Less holds it than the whole panel.
    assert!(found.run.energy < solve(&panel(Diagonal::Mirrored, 0.5), Objective::Balanced).run.energy);
}

#[test]
fn what_is_no_disc_is_refused() {
    let tube = |closed: bool| {
        // 8 vertices around, 5 along; closed: a torus of 8 x 5.
        let mut mesh = Mesh::default();
        for j in 0..5_u32 {
            for i in 0..8_u32 {
                let (a, b) = (TAU * f64::from(i) / 8.0, TAU * f64::from(j) / 5.0);
                let r = 3.0 + a.cos();
                mesh.positions.push(DVec3::new(r * b.cos(), r * b.sin(), a.sin()));
                if j < 4 || closed {
                    let at = |i: u32, j: u32| 8 * (j % 5) + i % 8;
                    mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                    mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        mesh
    };
    assert_eq!(refusal(&tube(true)), FlatteningError::NotADisc { borders: 0, characteristic: 0 }.into());
    let mut punctured = tube(true);
    punctured.triangles.pop();
    assert_eq!(refusal(&punctured), FlatteningError::NotADisc { borders: 1, characteristic: -1 }.into());
    // A tube is a disc with a hole: it can lie flat.
    assert_eq!(flips(&tube(false), &solve(&tube(false), Objective::Balanced).flat), 0);
    // Two triangles that touch at a vertex are two pieces.
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let mut bow = Mesh {
        positions: vec![at(0.0, 0.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0), at(-1.0, -1.0)],
        triangles: vec![[0, 1, 2], [0, 3, 4]],
        uv: None,
    };
    assert_eq!(refusal(&bow), FlatteningError::SeveralPieces { unreached: 1, total: 2 }.into());
    bow.triangles.pop();
    bow.positions[1] = bow.positions[0];
    bow.positions[2] = bow.positions[0];
    assert_eq!(refusal(&bow), FlatteningError::from(MeshFault::ZeroArea { triangle: 0 }).into());
    bow.positions[2].x = f64::NAN;
    assert_eq!(refusal(&bow), FlatteningError::from(MeshFault::NotFinite { vertex: 2 }).into());
    assert!(matches!(refusal(&Mesh::default()), EngineError::Flattening(FlatteningError::SeveralPieces { .. })));
    let options =
        IsometricOptions { objective: Objective::Weights { area: 0.0, shape: 1.0 }, ..IsometricOptions::default() };
    let mesh = panel(Diagonal::Regular, 0.1);
    let refused = flatten(&mesh, &Topology::new(&mesh).unwrap(), &options, &Unobserved);
    assert!(matches!(refused, Err(EngineError::Parameter { .. })));
}

#[test]
fn slivers_and_places_far_from_the_origin_do_no_harm() {
    // Rows as thin as 1e-9 of the cells' length, and one triangle of no height at all.
    let mut mesh = grid(12, 12, Diagonal::Regular, |u, v| {
        let thin = if v > 0.5 { v } else { 0.4 * v + 1e-9 * (12.0 * v).floor() };
        DVec3::new(u, thin, 0.2 * u * thin)
    });
    for t in mesh.triangles.iter().take(3) {
        let [a, b, _] = t.map(|v| mesh.positions[v as usize]);
        mesh.positions[t[2] as usize] = 0.5 * (a + b);
    }
    for p in &mut mesh.positions {
        *p = *p * 1e3 + DVec3::new(1e7, -3e7, 2e7);
    }
    for objective in OBJECTIVES {
        assert_eq!(flips(&mesh, &solve(&mesh, objective).flat), 0, "{objective:?}");
    }
}

#[test]
fn work_that_is_no_longer_wanted_ends() {
    struct After(AtomicUsize);
    impl Observer for After {
        fn is_cancelled(&self) -> bool {
            self.0.fetch_sub(1, Ordering::Relaxed) <= 1
        }
    }
    let mesh = panel(Diagonal::Regular, 1.0);
    let topology = Topology::new(&mesh).unwrap();
    for asked in [1, 10, 50, 100] {
        let found = flatten(&mesh, &topology, &IsometricOptions::default(), &After(AtomicUsize::new(asked)));
        assert_eq!(found, Err(EngineError::Cancelled), "{asked}");
    }
}

/// A glTF binary of one primitive: float positions, then 32-bit indices, as the shared meshes are.
fn read_glb(path: &Path) -> Mesh {
    let bytes = std::fs::read(path).unwrap();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + number(12)]).unwrap();
    let start = 20 + number(12) + 8;
    let primitive = &json["meshes"][0]["primitives"][0];
    let view = |accessor: &serde_json::Value| {
        let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let offset = |v: &serde_json::Value| v["byteOffset"].as_u64().unwrap_or(0) as usize;
        (start + offset(view) + offset(accessor), accessor["count"].as_u64().unwrap() as usize)
    };
    let (at, count) = view(&primitive["attributes"]["POSITION"]);
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let positions = (0..count).map(|i| DVec3::from_array([0, 4, 8].map(|k| float(at + 12 * i + k)))).collect();
    let (at, count) = view(&primitive["indices"]);
    let triangles = (0..count / 3).map(|t| [0, 4, 8].map(|k| number(at + 12 * t + k) as u32)).collect();
    Mesh { positions, uv: None, triangles }
}

#[test]
fn real_discs_lie_without_a_flip_and_all_else_is_refused() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/meshes"));
    if !folder.is_dir() {
        println!("no folder ../shared/data/meshes: skipped");
        return;
    }
    // Mean symmetric Dirichlet energy that libigl's SLIM reaches in 50 iterations.
    for (name, peer) in [
        ("fold", 4.000_007),
        ("cat_head", 5.362),
        ("nefertiti", 4.038),
        ("hemisphere", 4.142),
        ("three_peaks", 5.623),
        ("mushroom", 5.394),
        ("maze", 4.04),
    ] {
        let mesh = read_glb(&folder.join(name).with_extension("glb"));
        let found = solve(&mesh, Objective::Balanced);
        assert_eq!(flips(&mesh, &found.flat), 0, "{name}");
        assert!(found.run.converged && 4.0 + found.run.energy <= peer, "{name}: {}", found.run.energy);
    }
    for name in ["boxes", "triple_vierbein", "moebius", "spot_closed", "punctured_torus", "monkey"] {
        let mesh = read_glb(&folder.join(name).with_extension("glb"));
        if let Ok(topology) = Topology::new(&mesh) {
            let found = flatten(&mesh, &topology, &IsometricOptions::default(), &Unobserved);
            assert!(matches!(found, Err(EngineError::Flattening(_))), "{name}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_pattern_goes_along_with_motions_scales_mirrors_and_numberings(
        height in 0.1..1.5, angle in 0.0..6.3, scale in 0.01..100.0, shift in -1000.0..1000.0, seed in 0_u64..1000,
    ) {
        let mesh = panel(Diagonal::Diamond, height);
        let expected = solve(&mesh, Objective::Balanced);
        let size = 3.6;
        let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle);
        let mut moved = mesh.clone();
        for p in &mut moved.positions {
            *p = turn * *p * scale + DVec3::new(shift, 2.0 * shift, -shift);
        }
        let scaled: Vec<DVec2> = expected.flat.iter().map(|p| *p * scale).collect();
        prop_assert!(apart(&solve(&moved, Objective::Balanced).flat, &scaled, false) < 1e-6 * size * scale);
        let mut mirrored = mesh.clone();
        for p in &mut mirrored.positions {
            p.x = -p.x;
        }
        for t in &mut mirrored.triangles {
            t.swap(1, 2);
        }
        prop_assert!(apart(&solve(&mirrored, Objective::Balanced).flat, &expected.flat, true) < 1e-6 * size);
        // Another numbering of the vertices and of the triangles' corners.
        let count = mesh.positions.len();
        let step = 1 + 2 * (seed as usize % 50);
        let number = |v: u32| ((v as usize * step + seed as usize) % count) as u32;
        prop_assume!(gcd(step, count) == 1);
        let mut renumbered = mesh.clone();
        for v in 0..count as u32 {
            renumbered.positions[number(v) as usize] = mesh.positions[v as usize];
        }
        renumbered.triangles = mesh.triangles.iter().rev().map(|&[a, b, c]| [number(b), number(c), number(a)]).collect();
        let found = solve(&renumbered, Objective::Balanced);
        let back: Vec<DVec2> = (0..count as u32).map(|v| found.flat[number(v) as usize]).collect();
        prop_assert!(apart(&back, &expected.flat, false) < 1e-6 * size);
    }

    #[test]
    fn random_heights_lie_without_a_flip(heights in proptest::collection::vec(-1.0..1.0_f64, 80), tall in 0.0..3.0) {
        let mesh = grid(10, 8, Diagonal::ChevronRows, |u, v| {
            let at = (9.0 * u).round() as usize + 10 * (7.0 * v).round() as usize;
            DVec3::new(9.0 * u, 7.0 * v, tall * heights[at])
        });
        for objective in OBJECTIVES {
            let found = solve(&mesh, objective);
            prop_assert_eq!(flips(&mesh, &found.flat), 0);
            prop_assert_eq!(&found, &solve(&mesh, objective), "the same bytes each time");
        }
    }
}

const fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
