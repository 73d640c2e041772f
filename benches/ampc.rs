//! Lines of minimum curvature: milliseconds for a mesh of 70 x 70 points against a uniform grid's, and what a flattening makes of
//! either.
//!
//! `cargo bench --bench ampc` (a plain program: each time is the best of several runs, in one process). First the times of
//! mesh and lift. Then, over parts, for each setting the best and worst area change of Cader's flattening over
//! all seeds, and how many succeed. The stand-ins and real surfaces are those of the reference cases and data, where those
//! folders are there.

#![expect(clippy::unwrap_used, reason = "the surfaces are built here and sound")]

use std::time::Instant;

use glam::DVec3;
use planish::engine::budget::Unobserved;
use planish::engine::mesh::{Mesh, Topology};
use planish::engine::nurbs::{KnotVector, Surface};
use planish::engine::pipeline::Input;
use planish::engine::seed::{SearchSettings, search};
use planish::engine::triangulation::ampc::{AmpcBorder, AmpcFamilies, AmpcOptions, Integration, NpRule, ampc};
use planish::engine::triangulation::{Configuration, GridLines, grid_mesh, lift};
use planish::formats::surface::{self, Reading};

/// Runs of each measurement; the best counts, since noise only ever adds.
const RUNS: usize = 5;
/// Points each way of the timed meshes.
const TIMED: u32 = 70;
/// Points each way of the flattened ones: all seeds are run.
const FLATTENED: u32 = 24;
/// Real surfaces that are flattened, of those there are.
const REAL: [&str; 4] = ["abc_0000_step_f006", "abc_0000_step_f011", "abc_0008_step_f006", "bearing_iges_f021"];

fn main() {
    let mut parts = vec![
        ("cylinder, rulings across", parabolic(0.0)),
        ("cylinder, rulings leaning by 0.3", parabolic(0.3)),
        ("cone, rulings leaning by 0.4", cone()),
    ];
    parts.extend(["backlight_like", "windscreen_like"].into_iter().filter_map(|name| Some((name, stand_in(name)?))));
    println!("mesh and lift, {TIMED} x {TIMED} points");
    for (name, part) in &parts {
        let lines = GridLines::uniform(part.domain(), TIMED as usize, TIMED as usize);
        let grid = best(|| drop(lift(part, grid_mesh(&lines, Configuration::Regular, 0), &lines)));
        print!("{name}: grid {:.2} ms", 1e3 * grid);
        for (setting, options) in settings() {
            let seconds = best(|| {
                if let Ok(made) = ampc(part, [TIMED; 2], &options, &Unobserved) {
                    drop(lift(part, made.domain, &made.lines));
                }
            });
            print!("; {setting} {:.2} ms ({:.1} grids)", 1e3 * seconds, seconds / grid);
        }
        println!();
    }
    parts.extend(REAL.into_iter().filter_map(|name| Some((name, real(name)?))));
    println!(
        "Cader's flattening from all seeds, {FLATTENED} x {FLATTENED} points: best and worst area change, success"
    );
    for (name, part) in &parts {
        let lines = GridLines::uniform(part.domain(), FLATTENED as usize, FLATTENED as usize);
        let mesh = lift(part, grid_mesh(&lines, Configuration::Regular, 0), &lines).mesh;
        println!("{name}\n  uniform grid: {}", flattened(&mesh));
        for (setting, options) in settings() {
            match ampc(part, [FLATTENED; 2], &options, &Unobserved) {
                Ok(made) => println!("  {setting}: {}", flattened(&lift(part, made.domain, &made.lines).mesh)),
                Err(error) => println!("  {setting}: {error}"),
            }
        }
    }
}

fn settings() -> Vec<(&'static str, AmpcOptions)> {
    let published = AmpcOptions::default();
    let fourth = AmpcOptions { integration: Integration::RungeKutta, ..published };
    let free = AmpcOptions { border: AmpcBorder::Free, ..published };
    let both = AmpcOptions { families: AmpcFamilies::Both, ..published };
    vec![
        ("published", published),
        ("printed rule", AmpcOptions { np_rule: NpRule::Printed, ..published }),
        ("fourth order", fourth),
        ("free border", free),
        ("free, fourth order", AmpcOptions { border: AmpcBorder::Free, ..fourth }),
        ("both families", both),
        ("both, free, fourth order", AmpcOptions { families: AmpcFamilies::Both, border: AmpcBorder::Free, ..fourth }),
    ]
}

fn flattened(mesh: &Mesh) -> String {
    let topology = match Topology::new(mesh) {
        Ok(topology) => topology,
        Err(fault) => return fault.to_string(),
    };
    let settings = SearchSettings { landscape: true, ..SearchSettings::default() };
    match search(mesh, &topology, &settings, &Unobserved) {
        Ok(found) => {
            let percent = |changed: Option<f64>| changed.map_or("none".to_owned(), |x| format!("{x:.3e} %"));
            format!(
                "{} triangles, best {}, worst {}, {:.1} % of seeds",
                mesh.triangles.len(),
                percent(found.best.as_ref().ok().map(|ranked| ranked.percent)),
                percent(found.worst.map(|ranked| ranked.percent)),
                100.0 * found.succeeded as f64 / found.tried.max(1) as f64
            )
        }
        Err(error) => error.to_string(),
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

/// A bicubic Bezier surface through a polynomial map of the unit square.
fn bicubic(map: impl Fn(f64, f64) -> DVec3) -> Surface {
    // Bernstein coefficients of the cubic through its values at thirds.
    let rows = [[6.0, 0.0, 0.0, 0.0], [-5.0, 18.0, -9.0, 2.0], [2.0, -9.0, 18.0, -5.0], [0.0, 0.0, 0.0, 6.0]];
    let coefficient = |i: usize, j: usize| -> DVec3 {
        let terms = (0..4).flat_map(|k| (0..4).map(move |l| (k, l)));
        terms.map(|(k, l)| rows[i][k] * rows[j][l] / 36.0 * map(k as f64 / 3.0, l as f64 / 3.0)).sum()
    };
    let control = (0..16).map(|k| coefficient(k / 4, k % 4)).collect();
    let line = || KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], "knots").unwrap();
    Surface::new(line(), line(), control, None).unwrap()
}

fn parabolic(lean: f64) -> Surface {
    bicubic(|u, v| {
        let x = u + lean * v;
        DVec3::new(100.0 * x, 80.0 * v, 60.0 * x * x)
    })
}

fn cone() -> Surface {
    bicubic(|u, v| {
        let (s, w) = (1.0 + 0.8 * v, u - 0.5 + 0.4 * (v - 0.5));
        100.0 * s * DVec3::new(1.0, w, w * w)
    })
}

/// A stand-in of the reference cases.
fn stand_in(name: &str) -> Option<Surface> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/cases/synthetic_surfaces.json");
    let file: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).ok()?).unwrap();
    let case = &file[name]["surface"];
    let numbers = |value: &serde_json::Value| -> Vec<f64> { serde_json::from_value(value.clone()).unwrap() };
    let knots = |direction: &str| {
        let degree = case[format!("degree_{direction}")].as_u64().unwrap() as usize;
        KnotVector::new(degree, numbers(&case[format!("knots_{direction}")]), "knots").unwrap()
    };
    let rows = case["control_points"].as_array().unwrap();
    let control = rows.iter().flat_map(|row| row.as_array().unwrap()).map(|p| DVec3::from_slice(&numbers(p))).collect();
    Some(Surface::new(knots("u"), knots("v"), control, None).unwrap())
}

/// The base surface of a real part.
fn real(name: &str) -> Option<Surface> {
    let path = format!("{}/../shared/data/surfaces/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let geometry = surface::geometry(&std::fs::read(path).ok()?, Reading::default()).unwrap();
    match geometry.input() {
        Input::Trimmed(part) => Some(part.surface.clone()),
        Input::Mesh(_) | Input::Part(_) => None,
    }
}
