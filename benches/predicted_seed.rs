//! The predicted seed: its time at 20 000 triangles, and how near it comes to the optimum at which cost.
//!
//! `cargo bench --bench predicted_seed` (a plain program). First the time of a search on 100 x 100 points of a dome, the best of
//! several runs, on one thread and on two. Then, where the real surfaces are there, on grids of their base surfaces: the change of
//! area over that of the optimum (a failure counts as infinite), the seeds tried, and the triangles flattened as a share of those
//! that searches of all seeds flatten, to their ends or with losers abandoned.

#![expect(clippy::unwrap_used, reason = "the meshes are built here and sound")]

use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use planish::engine::budget::Unobserved;
use planish::engine::flattening::cader::Stop;
use planish::engine::job::{JobKind, JobOptions, SearchOptions, SearchStrategy};
use planish::engine::mesh::{Mesh, Topology};
use planish::engine::pipeline;
use planish::engine::seed::{SearchSettings, SeedOutcome, SeedSearch, search};
use planish::formats::surface::{self, Reading};
use serde_json::json;

/// Runs of the time's measurement; the best counts, since noise only ever adds.
const RUNS: usize = 15;

/// Changes of area below this, in percent, are rounding.
const NOTHING: f64 = 1e-6;

fn main() {
    let mesh = dome(100);
    let topology = Topology::new(&mesh).unwrap();
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut tried = 0;
        let seconds = (0..RUNS)
            .map(|_| {
                let start = Instant::now();
                tried = pool.install(|| searched(&mesh, &topology, SearchStrategy::Predicted, false)).tried;
                start.elapsed().as_secs_f64()
            })
            .fold(f64::INFINITY, f64::min);
        println!("{} triangles, {threads} threads: {:.1} ms, {tried} seeds tried", mesh.triangles.len(), 1e3 * seconds);
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("the real surfaces are not there");
        return;
    };
    let mut paths: Vec<_> = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some()).collect();
    paths.sort();
    for (points, configuration) in [(40, "regular"), (60, "regular"), (50, "diamond")] {
        let mut ratios = Vec::new();
        let [mut few, mut ends, mut abandoning, mut tried, mut seeds] = [0; 5];
        for path in &paths {
            let geometry = surface::geometry(&std::fs::read(path).unwrap(), Reading::default()).unwrap();
            let job = json!({ "triangulation": {
                "method": "grid", "grid": [points, points], "configuration": configuration } });
            let options: JobOptions = serde_json::from_value(job).unwrap();
            let Ok(outcome) = pipeline::run(JobKind::Triangulate, geometry.input(), &options, &Unobserved) else {
                continue;
            };
            let mesh = outcome.mesh;
            let topology = Topology::new(&mesh).unwrap();
            let all = searched(&mesh, &topology, SearchStrategy::Exhaustive, true);
            let Some(optimum) = all.best.as_ref().ok().map(|best| best.percent).filter(|best| *best > NOTHING) else {
                continue;
            };
            let found = searched(&mesh, &topology, SearchStrategy::Predicted, false);
            ratios.push(found.best.as_ref().map_or(f64::INFINITY, |best| best.percent / optimum));
            few += flattened(&found);
            ends += flattened(&all);
            abandoning += flattened(&searched(&mesh, &topology, SearchStrategy::Exhaustive, false));
            tried += found.tried;
            seeds += found.outcomes.len() as u64;
        }
        ratios.sort_by(f64::total_cmp);
        let failed = ratios.iter().filter(|ratio| !ratio.is_finite()).count();
        let percent = |part: u64, whole: u64| 100.0 * part as f64 / whole as f64;
        println!(
            "{points} x {points} points, {configuration}, {} surfaces: median {:.3}, 90th percentile {:.3}, {failed} failed; \
             {:.2} % of seeds tried, {:.2} % of the triangles flattened ({:.2} % with losers abandoned)",
            ratios.len(),
            ratios[ratios.len() / 2],
            ratios[ratios.len() * 9 / 10],
            percent(tried, seeds),
            percent(few, ends),
            percent(few, abandoning),
        );
    }
}

fn searched(mesh: &Mesh, topology: &Topology, strategy: SearchStrategy, landscape: bool) -> SeedSearch {
    let options = SearchOptions { strategy, ..SearchOptions::default() };
    search(mesh, topology, &SearchSettings { options, landscape, ..SearchSettings::default() }, &Unobserved).unwrap()
}

/// Triangles flattened in all trials.
fn flattened(search: &SeedSearch) -> u64 {
    let whole = search.outcomes.len() as u64;
    let of = |outcome: &SeedOutcome| match outcome {
        SeedOutcome::Flattened(_) => whole,
        SeedOutcome::Stopped(Stop::Flipped { flattened, .. } | Stop::Abandoned { flattened }) => u64::from(*flattened),
        SeedOutcome::Stopped(_) | SeedOutcome::Untried => 0,
    };
    search.outcomes.iter().map(of).sum()
}

fn dome(points: usize) -> Mesh {
    let step = |k: usize| k as f64 / (points - 1) as f64 - 0.5;
    let place = |k: usize| {
        let (x, y) = (step(k % points), step(k / points));
        DVec3::new(690.0 * x, 520.0 * y, -60.0 * (x * x + y * y))
    };
    let mut mesh = Mesh { positions: (0..points * points).map(place).collect(), ..Mesh::default() };
    for k in 0..(points - 1) * (points - 1) {
        let a = (k / (points - 1) * points + k % (points - 1)) as u32;
        let (b, c, d) = (a + 1, a + points as u32 + 1, a + points as u32);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}
