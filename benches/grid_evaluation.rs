//! Points and normals of whole grids: points a second on one core, and the ratio to point by point evaluation in the
//! same run. The aim for a non-rational bicubic surface to 1000 x 1000 points with normals is 20 million a second.
//!
//! `cargo bench --bench grid_evaluation` (a plain program: each line is the best of several runs).

#![expect(clippy::expect_used, reason = "the surfaces are built here and fit")]

use std::hint::black_box;
use std::time::Instant;

use glam::DVec3;
use planish::engine::nurbs::{GridSamples, KnotVector, Surface};

/// Runs of each measurement; the best counts, since noise only ever adds.
const RUNS: usize = 7;

/// Points along u and v.
const GRID: usize = 1000;

fn knots(degree: usize, spans: usize) -> KnotVector {
    let interior = (1..spans).map(|k| k as f64 / spans as f64);
    let values = std::iter::repeat_n(0.0, degree + 1).chain(interior).chain(std::iter::repeat_n(1.0, degree + 1));
    KnotVector::new(degree, values.collect(), "knots").expect("knots that fit")
}

/// A wavy sheet with `spans` x `spans` knot spans.
fn sheet(degree: usize, spans: usize, rational: bool) -> Surface {
    let n = degree + spans;
    let at = |i: usize, j: usize| {
        let (x, y) = (i as f64 / n as f64, j as f64 / n as f64);
        DVec3::new(1000.0 * x, 800.0 * y, 60.0 * (5.0 * x).sin() * (4.0 * y).cos())
    };
    let control = (0..n * n).map(|k| at(k / n, k % n)).collect();
    let weights = rational.then(|| (0..n * n).map(|k| 1.0 + 0.2 * (k as f64).sin()).collect());
    Surface::new(knots(degree, spans), knots(degree, spans), control, weights).expect("a sheet")
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

fn main() {
    let lines: Vec<f64> = (0..GRID).map(|k| k as f64 / (GRID - 1) as f64).collect();
    let count = (GRID * GRID) as f64;
    println!(
        "{:<28} {:>14} {:>14} {:>14} {:>8}",
        "surface, 1000 x 1000", "normals M/s", "positions M/s", "singly M/s", "ratio"
    );
    for (name, degree, spans, rational) in [
        ("bilinear, 20 spans", 1, 20, false),
        ("biquadratic, 5 spans", 2, 5, false),
        ("bicubic, 1 span", 3, 1, false),
        ("bicubic, 5 spans", 3, 5, false),
        ("bicubic, 60 spans", 3, 60, false),
        ("degree 5, 5 spans", 5, 5, false),
        ("degree 12, 2 spans", 12, 2, false),
        ("rational biquadratic, 4 spans", 2, 4, true),
        ("rational bicubic, 5 spans", 3, 5, true),
    ] {
        let surface = sheet(degree, spans, rational);
        let mut samples = GridSamples::default();
        let normals = best(|| surface.grid(black_box(&lines), &lines, &mut samples));
        black_box(&samples);
        let positions = best(|| surface.grid_positions(black_box(&lines), &lines, &mut samples));
        black_box(&samples);
        // A tenth of the rows is enough to time single points.
        let rows = GRID / 10;
        let singly = best(|| {
            for &v in &lines[..rows] {
                for &u in &lines {
                    let (s, su, sv) = surface.first_derivatives(u, v);
                    black_box((s, su.cross(sv).normalize()));
                }
            }
        }) * 10.0;
        println!(
            "{name:<28} {:>14.1} {:>14.1} {:>14.2} {:>8.1}",
            count / normals / 1e6,
            count / positions / 1e6,
            count / singly / 1e6,
            singly / normals
        );
    }
}
