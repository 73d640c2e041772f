//! Fitting 100 000 samples of closed curves by lines with arcs and by lines with cubics: milliseconds, and the segments found. The
//! curves wave more or less often; the last one is noise as large as the tolerance, of which little can be made.
//!
//! `cargo bench --bench curve_fitting` (a plain program: each line is the best of several runs).

#![expect(clippy::expect_used, reason = "the curves are built here and fit")]

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use glam::DVec2;
use planish::engine::pattern::fits;

/// Runs of each measurement; the best counts, since noise only ever adds.
const RUNS: usize = 5;

const POINTS: usize = 100_000;
const RADIUS: f64 = 500.0;
const TOLERANCE: f64 = 0.01;

fn main() {
    println!("{:>8} {:>8} {:>8} {:>8} {:>8} {:>14}", "waves", "noise", "ms", "arcs", "cubics", "deviation, mm");
    for (waves, noise) in [(3.0, 0.0), (30.0, 0.0), (300.0, 0.0), (3.0, 0.25), (3.0, 1.0)] {
        let points: Vec<DVec2> = (0..POINTS)
            .map(|k| {
                let x = k as f64 / POINTS as f64;
                // A number without order, the same in each run.
                let chance = (k as f64 * 12.9898).sin() * 43_758.545;
                let off = noise * TOLERANCE * 2.0 * (chance - chance.floor() - 0.5);
                DVec2::from_angle(TAU * x) * (RADIUS * (1.0 + 0.1 / waves * (waves * TAU * x).sin()) + off)
            })
            .collect();
        let mut time = f64::INFINITY;
        let mut found = None;
        for _ in 0..RUNS {
            let start = Instant::now();
            found = Some(fits(black_box(&points), &[], true, TOLERANCE));
            time = time.min(1e3 * start.elapsed().as_secs_f64());
        }
        let found = found.expect("a run");
        let [arcs, spline] = [found.arcs, found.spline].map(|f| f.expect("points that can be fitted"));
        println!(
            "{waves:>8} {noise:>8} {time:>8.2} {:>8} {:>8} {:>14.5}",
            arcs.segments.len(),
            spline.segments.len(),
            arcs.deviation_mm.max(spline.deviation_mm)
        );
    }
}
