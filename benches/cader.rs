//! One Cader flattening: nanoseconds a triangle on one core, mapping order included, and the allocations after the first
//! run; and the search over all seeds.
//!
//! `cargo bench --bench cader` (a plain program: each time is the best of several runs). With arguments it flattens one
//! reading a number of times and stops, to count instructions: `valgrind --tool=callgrind BENCH count 200`.
//!
//! The mesh is 60 x 60 points on the backlight stand-in of the reference cases where that folder is there, else on a
//! shallow dome.

#![expect(clippy::unwrap_used, reason = "the meshes are built here and sound")]

use std::hint::black_box;
use std::time::Instant;

use glam::{DVec2, DVec3};
use planish::engine::budget::Unobserved;
use planish::engine::distortion::Original;
use planish::engine::flattening::cader::{CaderMesh, Scratch, flatten};
use planish::engine::flattening::{Anchor, Average, Check, Order, Parent, Readings, Scheme};
use planish::engine::mesh::{Mesh, Topology};
use planish::engine::nurbs::{KnotVector, Surface};
use planish::engine::seed::{SearchSettings, search};

/// Runs of each measurement; the best counts, since noise only ever adds.
const RUNS: usize = 300;

/// Seeds of one run, spread over the mesh: one seed over and over would be learnt by heart. Few, so that a run is short
/// against the time slices of a busy machine.
const SEEDS: usize = 11;

/// Points along u and v.
const GRID: usize = 60;

fn main() {
    let (name, surface) = backlight().map_or(("shallow dome", None), |s| ("backlight stand-in", Some(s)));
    let at = |u: f64, v: f64| surface.as_ref().map_or_else(|| dome(u, v), |s| s.point(u, v));
    let mesh = grid(GRID, false, at);
    let topology = Topology::new(&mesh).unwrap();
    let prepared = CaderMesh::new(&mesh, &topology).unwrap();
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|a| a == "count") {
        let runs: usize = arguments[at + 1].parse().unwrap();
        run_seeds(&prepared, Readings::default(), &mut Scratch::new(), runs);
        return;
    }

    println!("{GRID} x {GRID} points on the {name}: {} triangles", mesh.triangles.len());
    for (label, readings) in readings() {
        report(label, &prepared, readings);
    }
    let diamond = grid(GRID, true, at);
    let diamond_mesh = CaderMesh::new(&diamond, &Topology::new(&diamond).unwrap()).unwrap();
    report("diamond, default readings", &diamond_mesh, Readings::default());

    let original = Original::new(&mesh, &topology, None);
    let mut scratch = Scratch::new();
    flatten(&prepared, Readings::default(), 3480, &mut scratch).unwrap();
    let per_triangle = 1e9 / mesh.triangles.len() as f64;
    let seconds = best(|| {
        for _ in 0..SEEDS {
            black_box(original.area_change_percent(black_box(scratch.flat())));
        }
    });
    println!("area change: {:.2} ns a triangle", seconds / SEEDS as f64 * per_triangle);

    for (points, runs) in [(GRID, 3), (100, 1)] {
        let mesh = grid(points, false, at);
        let topology = Topology::new(&mesh).unwrap();
        for (landscape, what) in [(true, "every seed to its end"), (false, "losers abandoned")] {
            for threads in [1, 2] {
                searches(
                    &mesh,
                    &topology,
                    SearchSettings { landscape, ..SearchSettings::default() },
                    threads,
                    runs,
                    what,
                );
            }
        }
    }

    let large = grid(708, false, dome);
    let start = Instant::now();
    let topology = Topology::new(&large).unwrap();
    let topology_seconds = start.elapsed().as_secs_f64();
    let prepared = CaderMesh::new(&large, &topology).unwrap();
    let prepared_seconds = start.elapsed().as_secs_f64() - topology_seconds;
    let mut scratch = Scratch::new();
    let seconds = (0..3)
        .map(|_| {
            let start = Instant::now();
            let _ =
                black_box(flatten(&prepared, Readings { check: Check::Final, ..Readings::default() }, 0, &mut scratch));
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    println!(
        "{} triangles: topology {topology_seconds:.3} s, preparation {prepared_seconds:.3} s, one run {seconds:.3} s",
        large.triangles.len()
    );
}

/// The best of several searches on so many threads.
fn searches(mesh: &Mesh, topology: &Topology, settings: SearchSettings, threads: usize, runs: usize, what: &str) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut last = None;
    let seconds = (0..runs)
        .map(|_| {
            let start = Instant::now();
            last = Some(pool.install(|| search(mesh, topology, &settings, &Unobserved)).unwrap());
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    let found = last.unwrap();
    println!(
        "{} seeds, {what}, {threads} threads: {seconds:.3} s; best {:?}, {} abandoned",
        mesh.triangles.len(),
        found.best.map(|best| best.seed),
        found.abandoned
    );
}

fn readings() -> [(&'static str, Readings); 6] {
    let default = Readings::default();
    let fifo = Readings { order: Order::Fifo, anchor: Anchor::Start, ..default };
    [
        ("default (index, first, end, pair, incident)", default),
        ("fifo, first, start", fifo),
        ("index, last, end", Readings { parent: Parent::Last, ..default }),
        ("index, first, end, running", Readings { average: Average::Running, ..default }),
        ("index, first, end, no check till the end", Readings { check: Check::Final, ..default }),
        ("symmetric", Readings::SYMMETRIC),
    ]
}

fn report(label: &str, mesh: &CaderMesh, readings: Readings) {
    let mut scratch = Scratch::new();
    run_seeds(mesh, readings, &mut scratch, 1);
    let allocations = allocation_counter::measure(|| run_seeds(mesh, readings, &mut scratch, SEEDS)).count_total;
    // The scheme `symmetric` takes many times as long as the others: fewer runs.
    let runs = if readings.scheme == Scheme::Symmetric { RUNS / 30 } else { RUNS };
    let seconds = best_of(runs, || run_seeds(mesh, readings, &mut scratch, SEEDS));
    let per_triangle = seconds * 1e9 / (SEEDS * mesh.triangle_count()) as f64;
    println!("{label}: {per_triangle:.2} ns a triangle, {allocations} allocations in {SEEDS} further runs");
}

/// Flattens from seeds spread over the mesh.
fn run_seeds(mesh: &CaderMesh, readings: Readings, scratch: &mut Scratch, runs: usize) {
    for k in 0..runs {
        let seed = (k * 631 + mesh.triangle_count() / 2) % mesh.triangle_count();
        let _ = black_box(flatten(mesh, readings, seed as u32, scratch));
    }
}

/// Seconds of the best of several runs.
fn best(run: impl FnMut()) -> f64 {
    best_of(RUNS, run)
}

fn best_of(runs: usize, mut run: impl FnMut()) -> f64 {
    (0..runs)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn dome(u: f64, v: f64) -> DVec3 {
    let (x, y) = (u - 0.5, v - 0.5);
    DVec3::new(690.0 * x, 520.0 * y, -60.0 * (x * x + y * y))
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

fn grid(points: usize, diamond: bool, at: impl Fn(f64, f64) -> DVec3) -> Mesh {
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
        let falls = diamond && (i + j) % 2 == 1;
        mesh.triangles.extend(if falls { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] });
    }
    mesh
}
