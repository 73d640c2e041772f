//! Tables 3.1 and 3.2 of the thesis on stand-ins for its four parts, and the cost of one polygon.
//!
//! Prints cells, cells traced, triangles and both times on a coarse grid and on one with many times the cells, and the
//! ratio of the tracing times, which should follow the cells traced: 100 times the cells, at most 12 times the time.

#![expect(clippy::expect_used, reason = "the regions are built here and are valid")]

use std::{f64::consts::TAU, hint::black_box, time::Instant};

use glam::DVec2;
use planish::engine::{
    budget::Unobserved,
    nurbs::Domain,
    triangulation::{Configuration, GridLines, trace},
    trimming::{BoundaryLoop, TrimRegion},
};

const UNIT: Domain = Domain { u: [0.0, 1.0], v: [0.0, 1.0] };

fn boundary(mut points: Vec<DVec2>, depth: u32) -> BoundaryLoop {
    let area: f64 = (0..points.len()).map(|k| points[k].perp_dot(points[(k + 1) % points.len()])).sum();
    if (area > 0.0) != depth.is_multiple_of(2) {
        points.reverse();
    }
    let corners = vec![false; points.len()];
    BoundaryLoop { points, sources: Vec::new(), corners, source_loop: None, depth, parent: None }
}

fn ring(centre: (f64, f64), radius: (f64, f64), points: usize) -> Vec<DVec2> {
    let at = |k: usize| DVec2::from_angle(TAU * k as f64 / points as f64) * DVec2::from(radius);
    (0..points).map(|k| DVec2::from(centre) + at(k)).collect()
}

/// A letter G: an open ring with a bar, about 40 points.
fn letter() -> TrimRegion {
    let arc = |radius: f64, from: f64, to: f64| {
        (0..=16).map(move |k| {
            DVec2::new(0.5, 0.5) + DVec2::from_angle(TAU * (from + (to - from) * f64::from(k) / 16.0)) * radius
        })
    };
    let mut points: Vec<DVec2> = arc(0.24, 0.12, 1.0).collect();
    points.extend([(0.55, 0.5), (0.55, 0.43)].map(DVec2::from));
    points.extend(arc(0.15, 0.93, 0.12));
    TrimRegion { loops: vec![boundary(points, 0)], natural: false }
}

fn lamp() -> TrimRegion {
    let loops = vec![
        boundary(ring((0.5, 0.5), (0.45, 0.42), 300), 0),
        boundary(ring((0.5, 0.5), (0.2, 0.2), 120), 1),
        boundary(ring((0.25, 0.25), (0.04, 0.04), 40), 1),
    ];
    TrimRegion { loops, natural: false }
}

fn car_body() -> TrimRegion {
    let outline = ring((0.5, 0.5), (0.47, 0.4), 200);
    let loops = vec![boundary(outline, 0), boundary(ring((0.6, 0.55), (0.2, 0.12), 80), 1)];
    TrimRegion { loops, natural: false }
}

fn chassis() -> TrimRegion {
    let frame = [(0.02, 0.05), (0.98, 0.05), (0.98, 0.95), (0.02, 0.95)].map(DVec2::from).to_vec();
    let mut loops = vec![boundary(frame, 0), boundary(ring((0.5, 0.52), (0.17, 0.21), 60), 1)];
    for k in 0..10 {
        let centre = (0.13 + 0.2 * f64::from(k % 5) - 0.01 * f64::from(k % 2), if k < 5 { 0.13 } else { 0.87 });
        loops.push(boundary(ring(centre, (0.03, 0.04), 24), 1));
    }
    TrimRegion { loops, natural: false }
}

/// The least time of several runs, microseconds.
fn least<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
    let time = |_| {
        let start = Instant::now();
        black_box(work());
        start.elapsed().as_secs_f64() * 1e6
    };
    (0..runs).map(time).fold(f64::INFINITY, f64::min)
}

/// One row of the table; returns the tracing time.
fn row(name: &str, region: &TrimRegion, columns: usize, rows: usize, runs: usize) -> f64 {
    let lines = GridLines::uniform(UNIT, columns + 1, rows + 1);
    let traced = trace(&lines, region, &Unobserved).expect("a traceable region");
    let mesh = traced.triangulate(Configuration::Regular, 0).expect("a mesh");
    let tracing = least(runs, || trace(&lines, region, &Unobserved));
    let triangulation = least(runs, || traced.triangulate(Configuration::Regular, 0));
    let counts = traced.counts();
    println!(
        "{name:<10}{:>6}{:>9}{:>8}{:>9.2}{:>12.1}{:>11}{:>14.1}",
        region.loops.len(),
        counts.cells,
        counts.cells_traced,
        100.0 * counts.cells_traced as f64 / counts.cells as f64,
        tracing,
        mesh.triangles.len(),
        triangulation
    );
    tracing
}

fn main() {
    println!("Part       Loops    Cells  Traced  % traced  Tracing us  Triangles  Triangulat. us");
    for (name, region, [columns, rows]) in [
        ("letter G", letter(), [56, 32]),
        ("lamp", lamp(), [100, 55]),
        ("car body", car_body(), [38, 20]),
        ("chassis", chassis(), [5, 5]),
    ] {
        let coarse = row(name, &region, columns, rows, 200);
        let fine = row(name, &region, 10 * columns, 10 * rows, 40);
        println!("           100 times the cells: {:.1} times the tracing time", fine / coarse);
    }
    println!("\nOne cell, a polygon with holes:");
    for (points, holes) in [(60, 0), (20, 4), (500, 0), (500, 10), (20_000, 0)] {
        let mut loops = vec![boundary(ring((0.5, 0.5), (0.45, 0.4), points), 0)];
        let hole = |k: usize| boundary(ring((0.2 + 0.06 * k as f64, 0.5), (0.02, 0.05), 40), 1);
        loops.extend((0..holes).map(hole));
        let region = TrimRegion { loops, natural: false };
        row(&format!("{points}+{holes}"), &region, 1, 1, if points > 1000 { 5 } else { 200 });
    }
}
