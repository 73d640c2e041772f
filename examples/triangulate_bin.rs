//! Triangulates faces for a comparison with other programs: job lines in, one line of JSON out each.
//!
//! A job is `{"path": "face.json", "rel": 1e-3}` (chord tolerance as a fraction of the diagonal that the file gives under
//! `extra.bbox`) or `{"path": .., "tolerance": 0.01}` (millimetres), with an optional `"out"`: a file that gets the mesh
//! as raw little-endian numbers: vertices and triangles (two u64), positions (3 f64 a vertex), places in the domain
//! (2 f64), corners (3 u32 a triangle). The whole triangulation is timed: checking the loops, polygonising, planning,
//! tracing, triangulating and lifting. Reading the file is not. The time is the least of several runs on one thread:
//! on a core of one's own that is its CPU time.

use std::io::{BufRead as _, Write as _};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, anyhow};
use glam::{DVec2, DVec3};
use planish::engine::budget::Unobserved;
use planish::engine::nurbs::{Curve2, KnotVector, Surface};
use planish::engine::triangulation::density::{DensityInput, DensityLimits, plan};
use planish::engine::triangulation::{
    Configuration, Density, Lifted, aspect_of, lift, sampled_chord_error, trace, trimmed_area,
};
use planish::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};
use serde_json::{Value, json};

/// Runs are repeated for this long, and at least [`LEAST_RUNS`] times.
const REPEAT_FOR: Duration = Duration::from_millis(150);
const LEAST_RUNS: usize = 3;

fn main() -> Result<()> {
    // One thread: what runs in parallel is counted once.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| {
        let stdin = std::io::stdin();
        let mut stdout = std::io::stdout();
        for line in stdin.lock().lines() {
            let job: Value = serde_json::from_str(&line?)?;
            let answer = run(&job).unwrap_or_else(|why| json!({ "ok": false, "why": format!("{why:#}") }));
            writeln!(stdout, "{answer}")?;
            stdout.flush()?;
        }
        Ok(())
    })
}

fn run(job: &Value) -> Result<Value> {
    let path = job["path"].as_str().context("no path")?;
    let file: Value = serde_json::from_slice(&std::fs::read(path).with_context(|| path.to_owned())?)?;
    let trimmed = face(&file)?;
    let corners: Vec<f64> = file["extra"]["bbox"].as_array().context("no bbox")?.iter().flat_map(numbers).collect();
    let diagonal = DVec3::from_slice(&corners[..3]).distance(DVec3::from_slice(&corners[3..]));
    let tolerance = match job["tolerance"].as_f64() {
        Some(tolerance) => tolerance,
        None => job["rel"].as_f64().context("neither rel nor tolerance")? * diagonal,
    };
    let began = Instant::now();
    let mut least = Duration::MAX;
    let mut runs = 0;
    let mut stages = [Duration::MAX; STAGES.len()];
    let (mut lifted, _) = triangulate(&trimmed, tolerance, diagonal)?;
    while runs < LEAST_RUNS || began.elapsed() < REPEAT_FOR {
        let start = Instant::now();
        let (made, marks) = triangulate(&trimmed, tolerance, diagonal)?;
        least = least.min(start.elapsed());
        let mut former = start;
        for (stage, mark) in stages.iter_mut().zip(marks) {
            *stage = (*stage).min(mark - former);
            former = mark;
        }
        lifted = made;
        runs += 1;
    }
    if let Some(out) = job["out"].as_str() {
        write(out, &lifted)?;
    }
    Ok(json!({
        "ok": true,
        "name": file["name"],
        "rel": job["rel"],
        "tolerance": tolerance,
        "cpu": least.as_secs_f64(),
        "n_tri": lifted.mesh.triangles.len(),
        "stages_us": STAGES.iter().zip(stages).map(|(name, t)| (*name, json!(1e6 * t.as_secs_f64()))).collect::<Value>(),
        "chord_error": sampled_chord_error(&trimmed.surface, &lifted),
        "area": trimmed_area(&trimmed.surface, &lifted.domain),
        "area_occt": file["extra"]["area_occt"],
    }))
}

/// The steps of [`triangulate`], each timed for itself, too.
const STAGES: [&str; 6] = ["check", "polygonise", "plan", "trace", "triangulate", "lift"];

/// The whole way from loops as sent to a mesh in space.
fn triangulate(trimmed: &TrimmedSurface, tolerance: f64, diagonal: f64) -> Result<(Lifted, [Instant; 6])> {
    let checked = trimmed.check().map_err(|faults| anyhow!("{faults:?}"))?;
    let after_check = Instant::now();
    let region = checked.polygonise(&trimmed.surface, tolerance)?;
    let after_polygonise = Instant::now();
    let input = DensityInput {
        surface: &trimmed.surface,
        region: Some(&region),
        diagonal,
        density: Density::Chord(tolerance),
        configuration: Configuration::Regular,
        limits: DensityLimits::default(),
    };
    let lines = plan(&input, &Unobserved)?;
    let after_plan = Instant::now();
    let traced = trace(&lines, &region, &Unobserved)?.with_aspect(aspect_of(&trimmed.surface, &lines));
    let after_trace = Instant::now();
    let domain = traced.triangulate(Configuration::Regular, 0)?;
    let after_triangulate = Instant::now();
    let lifted = lift(&trimmed.surface, domain, &lines);
    let marks = [after_check, after_polygonise, after_plan, after_trace, after_triangulate, Instant::now()];
    Ok((lifted, marks))
}

fn write(path: &str, lifted: &Lifted) -> Result<()> {
    let mut uv = vec![DVec2::ZERO; lifted.mesh.positions.len()];
    for (place, vertex) in lifted.domain.uv.iter().zip(&lifted.vertex_of) {
        uv[*vertex as usize] = *place;
    }
    let mut bytes = Vec::new();
    for count in [lifted.mesh.positions.len(), lifted.mesh.triangles.len()] {
        bytes.extend((count as u64).to_le_bytes());
    }
    bytes.extend(lifted.mesh.positions.iter().flat_map(DVec3::to_array).flat_map(f64::to_le_bytes));
    bytes.extend(uv.iter().flat_map(DVec2::to_array).flat_map(f64::to_le_bytes));
    bytes.extend(lifted.mesh.triangles.iter().flatten().copied().flat_map(u32::to_le_bytes));
    std::fs::write(path, bytes).with_context(|| path.to_owned())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

fn knots(value: &Value, degree: &str, name: &str) -> Result<KnotVector> {
    let degree = value[degree].as_u64().context("no degree")? as usize;
    Ok(KnotVector::new(degree, numbers(&value[name]), "knots")?)
}

fn face(file: &Value) -> Result<TrimmedSurface> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let net = list(&file["control_points"]);
    let control = net.iter().flat_map(list).map(|p| DVec3::from_slice(&numbers(&p))).collect();
    let weights = file["weights"].as_array().map(|rows| rows.iter().flat_map(numbers).collect());
    let surface =
        Surface::new(knots(file, "degree_u", "knots_u")?, knots(file, "degree_v", "knots_v")?, control, weights)?;
    let mut loops = Vec::new();
    for source in list(&file["trims"]) {
        let mut curves = Vec::new();
        for curve in list(&source) {
            let control = list(&curve["control_points"]).iter().map(|p| DVec2::from_slice(&numbers(p))).collect();
            let weights = curve["weights"].as_array().map(|_| numbers(&curve["weights"]));
            curves.push(TrimCurve {
                shape: TrimShape::Nurbs(Curve2::new(knots(&curve, "degree", "knots")?, control, weights)?),
                reversed: curve["reversed"].as_bool().unwrap_or(false),
            });
        }
        loops.push(TrimLoop { curves });
    }
    Ok(TrimmedSurface { surface, loops, side: Side::Normal })
}
