//! Drawing the pattern of a cylinder with a hundred holes from meshes of growing size: milliseconds, and the same a
//! triangle. Curves are mapped through the triangles along them, so the time should grow far slower than the mesh.
//!
//! `cargo bench --bench pattern_drawing` (a plain program: each line is the best of several runs).

#![expect(clippy::expect_used, reason = "the surface and its loops are built here and fit")]

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::time::Instant;

use glam::{DVec2, DVec3};
use planish::engine::budget::Unobserved;
use planish::engine::mesh::Topology;
use planish::engine::nurbs::{Curve2, KnotVector, Surface};
use planish::engine::pattern::{DrawInput, Finishing, Locator, Placement, draw, triangles_of_part};
use planish::engine::triangulation::{Configuration, GridLines, grid_mesh, lift};
use planish::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};

/// Runs of each measurement; the best counts, since noise only ever adds.
const RUNS: usize = 5;

const RADIUS: f64 = 100.0;
const HEIGHT: f64 = 400.0;

/// A quarter of a cylinder, u around and v up.
fn quarter() -> Surface {
    let knots = |degree: usize| {
        let values = [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat();
        KnotVector::new(degree, values, "knots").expect("knots that fit")
    };
    let w = std::f64::consts::FRAC_1_SQRT_2;
    let mut control = Vec::new();
    for (x, y) in [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
        control.extend([0.0, HEIGHT].map(|z| DVec3::new(x * RADIUS, y * RADIUS, z)));
    }
    Surface::new(knots(2), knots(1), control, Some(vec![1.0, 1.0, w, w, 1.0, 1.0])).expect("a cylinder")
}

/// A closed cubic about a place of the domain.
fn hole(centre: DVec2, size: DVec2) -> TrimLoop {
    let knots = KnotVector::new(3, (0..12).map(f64::from).collect(), "knots").expect("knots that fit");
    let control = (0..8).map(|k| centre + DVec2::from_angle(f64::from(k % 5) * 0.4 * std::f64::consts::PI) * size);
    let curve = Curve2::new(knots, control.collect(), None).expect("a curve");
    TrimLoop { curves: vec![TrimCurve { shape: TrimShape::Nurbs(curve), reversed: false }] }
}

fn main() {
    let mut loops = vec![TrimLoop {
        curves: vec![TrimCurve {
            shape: TrimShape::Polyline(
                [[0.01, 0.01], [0.99, 0.01], [0.99, 0.99], [0.01, 0.99], [0.01, 0.01]].map(DVec2::from_array).to_vec(),
            ),
            reversed: false,
        }],
    }];
    for k in 0..100 {
        let place = DVec2::new(f64::from(k % 10) + 0.5, f64::from(k / 10) + 0.5) / 10.2 + DVec2::splat(0.0098);
        loops.push(hole(place, DVec2::new(0.03, 0.02)));
    }
    let trimmed = TrimmedSurface { surface: quarter(), loops, side: Side::Normal };
    let trims = trimmed.check().expect("loops that do");
    println!("{:>12} {:>12} {:>12} {:>14} {:>10}", "triangles", "part, ms", "pattern, ms", "pattern, ns/t", "points");
    for (m, n) in [(60, 60), (200, 180), (710, 710)] {
        let surface = &trimmed.surface;
        let lines = GridLines::uniform(surface.domain(), m, n);
        let lifted = lift(surface, grid_mesh(&lines, Configuration::Regular, 0), &lines);
        let topology = Topology::new(&lifted.mesh).expect("a mesh");
        let unrolled = |p: &DVec3| DVec2::new(RADIUS * p.y.atan2(p.x).clamp(0.0, FRAC_PI_2), p.z);
        let flat: Vec<DVec2> = lifted.mesh.positions.iter().map(unrolled).collect();
        let region = trims.polygonise(surface, 0.05).expect("loops that do");
        let (mut part_time, mut draw_time, mut points) = (f64::INFINITY, f64::INFINITY, 0);
        for _ in 0..RUNS {
            let start = Instant::now();
            let locator = Locator::new(&lifted.domain, &Unobserved).expect("nobody cancels");
            let part = triangles_of_part(&lifted, &locator, &region, &Unobserved).expect("nobody cancels");
            let part = black_box(part);
            part_time = part_time.min(start.elapsed().as_secs_f64());
            let start = Instant::now();
            let input = DrawInput {
                surface,
                side: trimmed.side,
                trims: &trims,
                lifted: &lifted,
                topology: &topology,
                locator: &locator,
                exact: None,
                flat: &flat,
                part: &part,
                placement: &Placement::default(),
                holds: &[],
                curve_tolerance_mm: Some(0.04),
            };
            let mut drawn = draw(&input, &Unobserved).expect("a pattern");
            drawn.finish(&Finishing::default(), &Unobserved).expect("nobody cancels");
            draw_time = draw_time.min(start.elapsed().as_secs_f64());
            points = drawn.report.points;
        }
        let triangles = lifted.mesh.triangles.len();
        println!(
            "{triangles:>12} {:>12.2} {:>12.2} {:>14.1} {points:>10}",
            part_time * 1e3,
            draw_time * 1e3,
            draw_time * 1e9 / triangles as f64
        );
    }
}
