//! Flattening by the release of energy: seconds from the mesh to rest, and how far above the least energy that rest is.
//!
//! `cargo bench --bench energy_release` (a plain program: each time is the best of several runs, in one process). For each
//! part: triangles, seconds, moves, `E_t`, the energy as laid and at rest, and its ratio to where it stalls: the energy that
//! is left with a hundredth of that `E_t` and moves to spare. Parts: a section of a torus, and the
//! backlight stand-in of the reference cases where that folder is there.

#![expect(clippy::unwrap_used, reason = "the meshes are built here and sound")]

use std::f64::consts::PI;
use std::time::Instant;

use glam::{DVec2, DVec3};
use planish::engine::budget::Unobserved;
use planish::engine::flattening::energy_release::{Outcome, ReleaseOptions, mccartney, wang};
use planish::engine::mesh::{Mesh, Topology, measures};
use planish::engine::nurbs::{KnotVector, Surface};

/// Runs of each measurement; the best counts, since noise only ever adds.
const RUNS: usize = 3;

/// Points along u and v: 6962 triangles.
const GRID: usize = 60;

type Method = fn(&Mesh, &Topology, u32, ReleaseOptions) -> Outcome;

fn main() {
    let methods: [(&str, Method); 2] = [
        ("mccartney", |mesh, topology, seed, options| {
            mccartney::flatten(mesh, topology, seed, options, &Unobserved).unwrap()
        }),
        ("wang", |mesh, topology, seed, options| wang::flatten(mesh, topology, seed, options, &Unobserved).unwrap()),
    ];
    let mut parts =
        vec![("torus, outer section", grid(GRID, outer_torus)), ("torus, saddle section", grid(GRID, inner_torus))];
    if let Some(surface) = backlight() {
        parts.push(("backlight stand-in", grid(GRID, |u, v| surface.point(u, v))));
    }
    for (part, mesh) in &parts {
        let topology = Topology::new(mesh).unwrap();
        let seed = measures::central_triangle(mesh, None).unwrap();
        for (method, flatten) in methods {
            let (released, error) = flatten(mesh, &topology, seed, ReleaseOptions::default());
            let report = &released.report;
            let seconds = best(|| drop(flatten(mesh, &topology, seed, ReleaseOptions::default())));
            let further = ReleaseOptions {
                threshold: Some(1e-2 * report.threshold_mm),
                max_moves: Some(100_000_000),
                ..ReleaseOptions::default()
            };
            let (stalled, _) = flatten(mesh, &topology, seed, further);
            println!(
                "{part}, {method}: {} triangles, {seconds:.3} s, {} moves, E_t {:.2e} mm, energy {:.4e} -> {:.4e} mm ({}), \
                 {:.5} of where it stalls ({:.4e} mm, {}){}",
                mesh.triangles.len(),
                report.moves,
                report.threshold_mm,
                report.energy_before_mm,
                report.energy_after_mm,
                if report.settled { "at rest" } else { "moves spent" },
                report.energy_after_mm / stalled.report.energy_after_mm,
                stalled.report.energy_after_mm,
                if stalled.report.settled { "at rest" } else { "moves spent" },
                error.map_or_else(String::new, |error| format!("; {error}"))
            );
        }
    }
}

/// Seconds of the best of several runs.
fn best(mut run: impl FnMut()) -> f64 {
    (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

/// A sixth of a torus of radii 100 and 40 mm, about its greatest circle: curved like an egg.
fn outer_torus(u: f64, v: f64) -> DVec3 {
    torus((u - 0.5) * PI / 3.0, (v - 0.5) * PI / 2.0)
}

/// The same about its throat: curved like a saddle.
fn inner_torus(u: f64, v: f64) -> DVec3 {
    torus((u - 0.5) * PI / 3.0, PI + (v - 0.5) * PI / 2.0)
}

fn torus(along: f64, across: f64) -> DVec3 {
    let radius = 100.0 + 40.0 * across.cos();
    DVec3::new(radius * along.cos(), radius * along.sin(), 40.0 * across.sin())
}

/// The backlight stand-in, when the reference cases are there.
fn backlight() -> Option<Surface> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/cases/synthetic_surfaces.json");
    let file: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()?;
    let surface = &file["backlight_like"]["surface"];
    let knots = |key: &str| {
        let values = serde_json::from_value(surface[key].clone()).ok()?;
        KnotVector::new(3, values, "knots").ok()
    };
    let net: Vec<Vec<[f64; 3]>> = serde_json::from_value(surface["control_points"].clone()).ok()?;
    let control = net.into_iter().flatten().map(DVec3::from_array).collect();
    Surface::new(knots("knots_u")?, knots("knots_v")?, control, None).ok()
}

fn grid(points: usize, at: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let step = |k: usize| k as f64 / (points - 1) as f64;
    let mut mesh = Mesh { uv: Some(Vec::new()), ..Mesh::default() };
    for k in 0..points * points {
        let (u, v) = (step(k % points), step(k / points));
        mesh.positions.push(at(u, v));
        mesh.uv.as_mut().unwrap().push(DVec2::new(u, v));
    }
    for k in 0..(points - 1) * (points - 1) {
        let (i, j) = (k % (points - 1), k / (points - 1));
        let a = (j * points + i) as u32;
        let (b, c, d) = (a + 1, a + points as u32 + 1, a + points as u32);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}
