//! Where the time of a small job goes: microseconds of one core for each step from the bytes of a surface to those of its
//! DXF, without HTTP and the store.
//!
//! `cargo bench --bench small_job` (a plain program: each time is the median of many runs). The part is a domed panel of
//! 300 mm by 200 mm with a round hole.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "the part is built here and sound; a table is what comes out"
)]

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::Instant;

use planish::engine::budget::{Observer, Stage};
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::pipeline;
use planish::formats::surface::{self, Reading};
use planish::formats::{MeshParts, TitleBlock, dxf, report_json, stored};
use serde_json::json;

const RUNS: usize = 200;

/// Notes when each stage begins.
#[derive(Default)]
struct Times(Mutex<Vec<(&'static str, Instant)>>);

impl Times {
    fn mark(&self, name: &'static str) {
        self.0.lock().unwrap().push((name, Instant::now()));
    }
}

impl Observer for Times {
    fn enter(&self, stage: Stage) {
        self.mark(stage.name());
    }
}

fn main() {
    let body = panel();
    let mut all: Vec<(&'static str, Vec<f64>)> = Vec::new();
    for _ in 0..RUNS {
        let times = Times::default();
        times.mark("read and summed up");
        let read = surface::read(&body, Reading::default(), "").unwrap();
        times.mark("read again by the worker");
        let geometry = surface::geometry(&body, Reading::default()).unwrap();
        times.mark("before the first stage");
        let outcome = pipeline::run(JobKind::Flatten, geometry.input(), &JobOptions::default(), &times).unwrap();
        times.mark("mesh encoded");
        let mesh = stored::encode_mesh(&MeshParts::from(&outcome));
        times.mark("report written");
        let report = report_json::write(&outcome.report).unwrap();
        times.mark("pattern encoded");
        let pattern = stored::encode_pattern(outcome.pattern.as_ref().unwrap());
        times.mark("DXF written");
        let file =
            dxf::write(outcome.pattern.as_ref().unwrap(), &TitleBlock::new(read.name.as_deref(), &BTreeMap::new()));
        times.mark("end");
        std::hint::black_box((mesh, report, pattern, file.unwrap()));
        let marks = times.0.into_inner().unwrap();
        for (k, pair) in marks.windows(2).enumerate() {
            let took = pair[1].1.duration_since(pair[0].1).as_secs_f64() * 1e6;
            match all.get_mut(k) {
                Some((name, list)) if *name == pair[0].0 => list.push(took),
                _ => all.insert(k.min(all.len()), (pair[0].0, vec![took])),
            }
        }
    }
    let mut sum = 0.0;
    for (name, mut list) in all {
        list.sort_by(f64::total_cmp);
        let median = list[list.len() / 2];
        sum += median;
        println!("{name:<28} {median:8.0} us");
    }
    println!("{:<28} {sum:8.0} us", "in all");
}

/// The small part of the load tests.
fn panel() -> Vec<u8> {
    let height = |i: usize, j: usize| match (i, j) {
        (1, 1) => 60.0,
        (1, _) | (_, 1) => 20.0,
        _ => 0.0,
    };
    let points: Vec<Vec<[f64; 3]>> =
        (0..3).map(|i| (0..3).map(|j| [150.0 * i as f64, 100.0 * j as f64, height(i, j)]).collect()).collect();
    let circle = |k: usize| {
        let angle = std::f64::consts::TAU * (k % 32) as f64 / 32.0;
        [0.6 + 0.1 * angle.cos(), 0.5 + 0.15 * angle.sin()]
    };
    let hole: Vec<[f64; 2]> = (0..33).map(circle).collect();
    json!({
        "name": "panel", "units": "mm", "degree_u": 2, "degree_v": 2,
        "knots_u": [0, 0, 0, 1, 1, 1], "knots_v": [0, 0, 0, 1, 1, 1], "control_points": points,
        "trims": [
            [{ "points": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]] }],
            [{ "points": hole }]
        ],
        "labels": { "part_number": "panel" }
    })
    .to_string()
    .into_bytes()
}
