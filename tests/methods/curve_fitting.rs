//! Curves that are fitted to the patterns of real surfaces: how many entities they take, and that they are where the mapped curves are.
//!
//! The mapped curve is the same pattern followed fifty times as closely: its polyline is within 2e-6 of the diagonal of it.

use std::path::Path;

use glam::DVec2;
use planish::engine::budget::Unobserved;
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::pattern::{Contour, Fit, Segment};
use planish::engine::pipeline::{self, Outcome};
use planish::formats::surface::{self, Geometry, Reading};
use serde_json::{Value, json};

/// The tolerance of the fits as a part of the mesh's diagonal, and that of the curves they are held against.
const TOLERANCE: f64 = 1e-4;
const REFERENCE: f64 = 2e-6;

/// Entities a span of the trimming curves in the median.
const MOST: f64 = 3.0;

/// Samples of the mapped curve that are held against a fit.
const SAMPLES: usize = 1500;

#[test]
fn real_patterns_take_few_entities_and_stay_within_the_tolerance() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: there is no folder {}", folder.display());
        return;
    };
    let mut paths: Vec<_> = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some()).collect();
    paths.sort();
    let (mut ratios, mut apart) = ([Vec::new(), Vec::new()], Vec::new());
    for path in &paths {
        let name = path.file_stem().unwrap().to_string_lossy();
        let bytes = std::fs::read(path).unwrap();
        let spans = spans(&serde_json::from_slice(&bytes).unwrap());
        let geometry = surface::geometry(&bytes, Reading::default()).unwrap();
        let Some(first) = flattened(&geometry, None) else {
            println!("{name}: not flattened");
            continue;
        };
        let positions = &first.mesh.positions;
        let low = positions.iter().fold(glam::DVec3::INFINITY, |m, p| m.min(*p));
        let diagonal = low.distance(positions.iter().fold(glam::DVec3::NEG_INFINITY, |m, p| m.max(*p)));
        let (Some(fitted), Some(reference)) =
            (flattened(&geometry, Some(TOLERANCE * diagonal)), flattened(&geometry, Some(REFERENCE * diagonal)))
        else {
            println!("{name}: not flattened");
            continue;
        };
        let curves = fitted.report.pattern.as_ref().unwrap().curves.unwrap();
        let entities = [curves.arcs.entities, curves.spline.entities];
        for (ratios, entities) in ratios.iter_mut().zip(entities) {
            ratios.push(entities as f64 / spans as f64);
        }
        // Another mesh is another map: what was drawn of it is no reference.
        let off = (fitted.flat == reference.flat).then(|| deviations(&fitted, &reference).map(|d| 1e4 * d / diagonal));
        println!("{name}: {spans} spans, {entities:?} entities, off by {off:.2?} ten-thousandths of the diagonal");
        apart.extend(off.into_iter().flatten().map(|d| 1e-4 * d));
    }
    let medians = ratios.map(|mut of| {
        of.sort_by(f64::total_cmp);
        (of[of.len() / 2], of.len())
    });
    let worst = apart.iter().copied().fold(0.0, f64::max);
    println!("entities a span in the median, and patterns: arcs {:?}, spline {:?}", medians[0], medians[1]);
    println!("{} fits held against the mapped curve: off by {worst:.2e} of the diagonal at the most", apart.len());
    assert!(medians.iter().all(|m| m.0 <= MOST && m.1 > 40) && apart.len() > 40, "{medians:?} {}", apart.len());
    // The polyline that stands for the mapped curve leaves it by its own tolerance.
    assert!(worst <= TOLERANCE + REFERENCE, "{worst}");
}

fn flattened(geometry: &Geometry, tolerance: Option<f64>) -> Option<Outcome> {
    let mut options = json!({
        "triangulation": { "method": "tracing", "grid": [41, 41] }, "flattening": { "method": "isometric", "domain": "trimmed" },
    });
    if let Some(tolerance) = tolerance {
        options["curve_tolerance_mm"] = json!(tolerance);
    }
    let options: JobOptions = serde_json::from_value(options).unwrap();
    pipeline::run(JobKind::Flatten, geometry.input(), &options, &Unobserved).ok().filter(|o| o.pattern.is_some())
}

/// Spans of the trimming curves between different knots, chords of polylines; four sides where there are no curves.
fn spans(surface: &Value) -> usize {
    let of = |curve: &Value| {
        if let Some(points) = curve["points"].as_array() {
            return points.len() - 1;
        }
        let mut knots: Vec<f64> = curve["knots"].as_array().unwrap().iter().map(|k| k.as_f64().unwrap()).collect();
        knots.dedup();
        knots.len() - 1
    };
    let loops = surface["trims"].as_array().map_or(&[][..], Vec::as_slice);
    let count: usize = loops.iter().flat_map(|l| l.as_array().unwrap()).map(of).sum();
    if count == 0 { 4 } else { count }
}

/// Greatest distances between the fits of a pattern and the polylines of another one, both ways, for both forms.
fn deviations(fitted: &Outcome, reference: &Outcome) -> [f64; 2] {
    // Both begin at their own (0, 0): the flattening's origin says how they lie to each other.
    let origin = |of: &Outcome| DVec2::from(of.report.placement.as_ref().unwrap().origin_mm);
    let shift = origin(reference) - origin(fitted);
    let contours = |of: &Outcome| -> Vec<Contour> {
        let pieces = of.pattern.iter().flat_map(|p| p.pieces.clone());
        pieces.flat_map(|p| std::iter::once(p.outline).chain(p.holes)).collect()
    };
    let (ours, theirs) = (contours(fitted), contours(reference));
    assert_eq!(ours.len(), theirs.len());
    let worst = |of: fn(&Contour) -> &Option<Fit>| {
        ours.iter().zip(&theirs).map(|(a, b)| apart(of(a).as_ref().unwrap(), shift, &b.points)).fold(0.0, f64::max)
    };
    [worst(|c| &c.fits.arcs), worst(|c| &c.fits.spline)]
}

fn apart(fit: &Fit, shift: DVec2, mapped: &[DVec2]) -> f64 {
    let each = (6000 / fit.segments.len()).clamp(16, 1500);
    let mut start = fit.start;
    let mut points = vec![start + shift];
    for segment in &fit.segments {
        points.extend((1..=each).map(|k| place(start, segment, k as f64 / each as f64) + shift));
        start = segment.to();
    }
    let mut closed = mapped.to_vec();
    closed.push(closed[0]);
    let few: Vec<DVec2> = points.iter().copied().step_by(points.len().div_ceil(SAMPLES)).collect();
    let samples: Vec<DVec2> = mapped.iter().copied().step_by(mapped.len().div_ceil(SAMPLES)).collect();
    farthest(&few, &closed).max(farthest(&samples, &points))
}

/// The greatest distance of points from a polyline.
fn farthest(points: &[DVec2], line: &[DVec2]) -> f64 {
    let distance = |p: DVec2| {
        let squares = line.windows(2).map(|w| {
            let (edge, to) = (w[1] - w[0], p - w[0]);
            let x = (to.dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            to.distance_squared(edge * x)
        });
        squares.fold(f64::INFINITY, f64::min)
    };
    points.iter().map(|&p| distance(p)).fold(0.0, f64::max).sqrt()
}

fn place(start: DVec2, segment: &Segment, t: f64) -> DVec2 {
    match *segment {
        Segment::Line { to } => start.lerp(to, t),
        Segment::Arc { to, bulge } => {
            // The chord from the start to the place at a share of the sweep turns as the angle at the circumference does.
            let half = 2.0 * bulge.atan();
            start + DVec2::from_angle((t - 1.0) * half).rotate(to - start) * ((t * half).sin() / half.sin())
        }
        Segment::Cubic { a, b, to } => {
            let (ab, bc, cd) = (start.lerp(a, t), a.lerp(b, t), b.lerp(to, t));
            ab.lerp(bc, t).lerp(bc.lerp(cd, t), t)
        }
    }
}
