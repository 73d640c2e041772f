//! Flattens a mesh for a comparison with other programs: `flatten_bin in.bin out.bin REPS`.
//!
//! `in.bin` holds the numbers of vertices and of triangles (two i64), positions (3 f64 a vertex) and corners (3 i32 a
//! triangle), all little-endian; `out.bin` gets two f64 a vertex. The environment variable `OBJECTIVE` says what is made
//! least: `balanced` (as when it is absent), `arap`, `area`, `shape`, or two weights `AREA:SHAPE`.
//!
//! One line goes to standard output: `{"times": [..], "cpu": [..], ..}`, wall and CPU seconds of each repetition of the
//! call from the raw mesh to the map, on one thread, reading and writing apart; or `{"error": ".."}`.

use std::time::Instant;

use anyhow::{Context as _, Result, bail};
use glam::{DVec2, DVec3};
use planish::engine::budget::Unobserved;
use planish::engine::error::EngineError;
use planish::engine::flattening::FlatteningError;
use planish::engine::flattening::isometric::{Isometric, IsometricOptions, Objective, flatten};
use planish::engine::mesh::{Mesh, Topology};
use serde_json::json;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, repetitions] = arguments.as_slice() else { bail!("use: flatten_bin in.bin out.bin REPS") };
    let mesh = read(&std::fs::read(input)?).context("in.bin is cut short")?;
    let options = IsometricOptions { objective: objective()?, ..IsometricOptions::default() };
    let (mut times, mut cpu) = (Vec::new(), Vec::new());
    let mut found = None;
    for _ in 0..repetitions.parse::<usize>()?.max(1) {
        let started = Instant::now();
        let before = cpu_seconds(started);
        let result = whole(&mesh, &options);
        times.push(started.elapsed().as_secs_f64());
        cpu.push(cpu_seconds(started) - before);
        match result {
            Ok(map) => found = Some(map),
            Err(why) => {
                println!("{}", json!({ "error": why.to_string() }));
                std::process::exit(1);
            }
        }
    }
    let found = found.context("no repetition")?;
    let bytes: Vec<u8> = found.flat.iter().flat_map(DVec2::to_array).flat_map(f64::to_le_bytes).collect();
    std::fs::write(output, bytes)?;
    let run = found.run;
    println!(
        "{}",
        json!({
            "times": times, "cpu": cpu, "energy": run.energy, "rounds": run.rounds, "kept": run.kept,
            "converged": run.converged,
        })
    );
    Ok(())
}

fn whole(mesh: &Mesh, options: &IsometricOptions) -> Result<Isometric, EngineError> {
    let topology = Topology::new(mesh).map_err(FlatteningError::from)?;
    flatten(mesh, &topology, options, &Unobserved)
}

fn objective() -> Result<Objective> {
    let Ok(name) = std::env::var("OBJECTIVE") else { return Ok(Objective::Balanced) };
    Ok(match name.as_str() {
        "balanced" => Objective::Balanced,
        "arap" => Objective::Arap,
        "area" => Objective::Area,
        "shape" => Objective::Shape,
        other => {
            let (area, shape) = other.split_once(':').with_context(|| format!("no objective {other:?}"))?;
            Objective::Weights { area: area.parse()?, shape: shape.parse()? }
        }
    })
}

fn read(bytes: &[u8]) -> Option<Mesh> {
    let (head, rest) = bytes.split_at_checked(16)?;
    let count = |at: usize| usize::try_from(i64::from_le_bytes(head[at..at + 8].try_into().ok()?)).ok();
    let (vertices, triangles) = (count(0)?, count(8)?);
    let (places, rest) = rest.split_at_checked(vertices.checked_mul(24)?)?;
    let corners = rest.get(..triangles.checked_mul(12)?)?;
    let numbers: Vec<f64> = places.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b)).collect();
    let indices: Vec<u32> = corners.as_chunks().0.iter().map(|&b| u32::from_le_bytes(b)).collect();
    Some(Mesh {
        positions: numbers.as_chunks().0.iter().map(|&p| DVec3::from_array(p)).collect(),
        uv: None,
        triangles: indices.as_chunks().0.to_vec(),
    })
}

/// CPU time of this process, which has one thread; where the system does not tell it, the time since the call began.
#[cfg(unix)]
fn cpu_seconds(_started: Instant) -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

#[cfg(not(unix))]
fn cpu_seconds(started: Instant) -> f64 {
    started.elapsed().as_secs_f64()
}
