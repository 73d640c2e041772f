//! The outline in the pattern is the part's and not its mesh's: it hardly depends on the triangulation, the density, the
//! numbering or how the surface is written down, and what dependence there is goes away as meshes get denser.

use std::path::Path;

use glam::DVec2;
use planish::engine::budget::Unobserved;
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::pipeline;
use planish::formats::surface::{self, Reading};
use serde_json::{Value, json};

/// Part of the outline's diagonal that outlines of one part may differ by.
const APART: f64 = 1e-4;

/// Points of one outline that are held against another.
const SAMPLES: usize = 400;

/// Shifts of the start that are tried before the fit is made exact.
const SHIFTS: usize = 400;

/// A strongly curved panel, biquadratic, with a wavy trimming loop and a slot.
fn panel() -> Value {
    let height = |i: usize, j: usize| match (i, j) {
        (1, 1) => 90.0,
        (1, _) | (_, 1) => 25.0,
        (2, 2) => 30.0,
        _ => 0.0,
    };
    let points: Vec<Vec<[f64; 3]>> =
        (0..3).map(|i| (0..3).map(|j| [150.0 * i as f64, 100.0 * j as f64, height(i, j)]).collect()).collect();
    let ring = |waves: f64, size: [f64; 2]| -> Vec<[f64; 2]> {
        (0..=120)
            .map(|k| {
                let angle = std::f64::consts::TAU * f64::from(k % 120) / 120.0;
                let radius = 1.0 + 0.1 * (waves * angle).sin();
                [0.5 + radius * size[0] * angle.cos(), 0.5 + radius * size[1] * angle.sin()]
            })
            .collect()
    };
    json!({
        "name": "panel", "units": "mm", "degree_u": 2, "degree_v": 2,
        "knots_u": [0, 0, 0, 1, 1, 1], "knots_v": [0, 0, 0, 1, 1, 1], "control_points": points,
        "trims": [[{ "points": ring(3.0, [0.42, 0.4]) }], [{ "points": ring(0.0, [0.2, 0.05]) }]],
    })
}

/// The panel and real faces, or a line that says why there are none of these.
fn parts() -> Vec<Value> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/surfaces");
    let mut found = vec![panel()];
    for name in ["nacelle_stp_f005", "simple_xml_f000", "sunglasses_lens_igs_f004"] {
        match std::fs::read(folder.join(name).with_extension("json")) {
            Ok(bytes) => found.push(serde_json::from_slice(&bytes).unwrap()),
            Err(_) => println!("skipped: there is no {name} in {}", folder.display()),
        }
    }
    found
}

/// The same part with u and v in each other's place. Its normal points the other way.
fn swapped(part: &Value) -> Value {
    let mut part = part.clone();
    for name in ["degree", "knots"] {
        let (u, v) = (format!("{name}_u"), format!("{name}_v"));
        let of_u = part[&u].take();
        part[&u] = part[&v].take();
        part[&v] = of_u;
    }
    let rows = part["control_points"].as_array().unwrap();
    let transposed: Vec<Vec<&Value>> =
        (0..rows[0].as_array().unwrap().len()).map(|j| rows.iter().map(|row| &row[j]).collect()).collect();
    part["control_points"] = json!(transposed);
    for curve in part["trims"].as_array_mut().unwrap().iter_mut().flat_map(|l| l.as_array_mut().unwrap()) {
        for name in ["points", "control_points"] {
            for point in curve[name].as_array_mut().into_iter().flatten() {
                point.as_array_mut().unwrap().swap(0, 1);
            }
            if curve[name].is_null() {
                curve.as_object_mut().unwrap().remove(name);
            }
        }
    }
    part["side"] = json!("reversed");
    part
}

fn numbers(of: &Value) -> Vec<f64> {
    of.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// The same surface with a knot more along u, at a share of the domain (Boehm 1980).
fn with_knot(part: &Value, share: f64) -> Value {
    let mut part = part.clone();
    let degree = part["degree_u"].as_u64().unwrap() as usize;
    let knots = numbers(&part["knots_u"]);
    let rows: Vec<Vec<Vec<f64>>> = part["control_points"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row.as_array().unwrap().iter().map(numbers).collect())
        .collect();
    assert!(part["weights"].is_null());
    let at = knots[degree] + share * (knots[rows.len()] - knots[degree]);
    let span = knots.iter().rposition(|&k| k <= at).unwrap();
    let mixed = |i: usize| -> Vec<Vec<f64>> {
        let weight = if i + degree <= span {
            1.0
        } else if i > span {
            0.0
        } else {
            (at - knots[i]) / (knots[i + degree] - knots[i])
        };
        let (new, old) = (&rows[i.min(rows.len() - 1)], &rows[i.saturating_sub(1)]);
        new.iter()
            .zip(old)
            .map(|(new, old)| new.iter().zip(old).map(|(n, o)| weight * n + (1.0 - weight) * o).collect())
            .collect()
    };
    part["control_points"] = json!((0..=rows.len()).map(mixed).collect::<Vec<_>>());
    let mut longer = knots;
    longer.insert(span + 1, at);
    part["knots_u"] = json!(longer);
    part
}

/// How a part is to be triangulated.
#[derive(Clone, Copy)]
struct Net {
    points: [u32; 2],
    configuration: &'static str,
}

/// The first piece's outline.
fn outline(part: &Value, net: Net) -> Vec<DVec2> {
    let job: JobOptions = serde_json::from_value(json!({
        "triangulation": { "method": "tracing", "grid": net.points, "configuration": net.configuration },
        "flattening": { "method": "isometric" },
    }))
    .unwrap();
    let geometry = surface::geometry(part.to_string().as_bytes(), Reading::default()).unwrap();
    let outcome = pipeline::run(JobKind::Flatten, geometry.input(), &job, &Unobserved).unwrap();
    outcome.pattern.unwrap().pieces[0].outline.points.clone()
}

fn diagonal(points: &[DVec2]) -> f64 {
    let low = points.iter().fold(DVec2::INFINITY, |m, p| m.min(*p));
    low.distance(points.iter().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p)))
}

/// Points at equal distances along a closed polyline.
fn spaced(points: &[DVec2]) -> Vec<DVec2> {
    let count = points.len();
    let lengths: Vec<f64> = (0..count).map(|k| points[k].distance(points[(k + 1) % count])).collect();
    let step = lengths.iter().sum::<f64>() / SAMPLES as f64;
    let (mut found, mut passed) = (Vec::new(), 0.0);
    for k in 0..count {
        while found.len() < SAMPLES && (found.len() as f64) * step <= passed + lengths[k] {
            let x = ((found.len() as f64) * step - passed) / lengths[k];
            found.push(points[k].lerp(points[(k + 1) % count], x));
        }
        passed += lengths[k];
    }
    found
}

/// The rigid motion that brings points nearest to others, in the mean of squares; never a reflection.
fn fitted(from: &[DVec2], to: &[DVec2]) -> Vec<DVec2> {
    let middle = |p: &[DVec2]| p.iter().sum::<DVec2>() / p.len() as f64;
    let (a, b) = (middle(from), middle(to));
    let turn: DVec2 = from
        .iter()
        .zip(to)
        .map(|(p, q)| DVec2::new((*p - a).dot(*q - b), (*p - a).perp_dot(*q - b)))
        .sum::<DVec2>()
        .normalize();
    from.iter().map(|p| turn.rotate(*p - a) + b).collect()
}

/// The nearest point of a closed polyline.
fn nearest(points: &[DVec2], p: DVec2) -> DVec2 {
    (0..points.len())
        .map(|k| {
            let (a, b) = (points[k], points[(k + 1) % points.len()]);
            a.lerp(b, ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0))
        })
        .min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p)))
        .unwrap()
}

/// The greatest distance between two outlines, after the best rigid motion, as a part of the diagonal.
fn apart(one: &[DVec2], other: &[DVec2]) -> f64 {
    let (from, to) = (spaced(one), spaced(other));
    let farthest = |moved: &[DVec2]| moved.iter().map(|&p| p.distance(nearest(other, p))).fold(0.0, f64::max);
    let shifted = |shift: usize| {
        let to: Vec<DVec2> = (0..SAMPLES).map(|k| to[(k + shift) % SAMPLES]).collect();
        fitted(&from, &to)
    };
    let sum = |moved: &[DVec2], shift: usize| -> f64 {
        moved.iter().enumerate().map(|(k, p)| p.distance_squared(to[(k + shift) % SAMPLES])).sum()
    };
    let best = (0..SHIFTS).min_by(|&a, &b| sum(&shifted(a), a).total_cmp(&sum(&shifted(b), b))).unwrap();
    let mut moved = shifted(best);
    let mut least = farthest(&moved);
    // Points slide along the outline: the fit to the nearest ones settles slowly, and each is a bound.
    for _ in 0..30 {
        let to: Vec<DVec2> = moved.iter().map(|&p| nearest(other, p)).collect();
        moved = fitted(&moved, &to);
        least = least.min(farthest(&moved));
    }
    least / diagonal(other)
}

/// Five triangulations: four configurations and lines that are not evenly spaced.
const NETS: [(&str, [u32; 2]); 5] = [
    ("regular", [1, 1]),
    ("regular-mirrored", [1, 1]),
    ("diamond", [1, 1]),
    ("chevron-rows", [1, 1]),
    ("chevron-columns", [3, 2]),
];

#[test]
fn outlines_agree_whatever_the_triangulation_and_converge() {
    for part in parts() {
        let best = outline(&part, Net { points: [321, 321], configuration: "diamond" });
        let worst = [60, 120, 240].map(|side| {
            let of = |(configuration, stretch): (&'static str, [u32; 2])| {
                // The last one has half as many lines more along u than along v.
                let points = [side * stretch[0] / stretch[1], side];
                apart(&outline(&part, Net { points, configuration }), &best)
            };
            NETS.map(of).into_iter().fold(0.0, f64::max)
        });
        println!("{}: {worst:?}", part["name"]);
        assert!(worst.iter().all(|&w| w < APART), "{}: {worst:?}", part["name"]);
        assert!(worst[2] < 0.5 * worst[0], "{}: {worst:?}", part["name"]);
    }
}

#[test]
fn outlines_do_not_depend_on_how_the_surface_is_written_down() {
    for part in parts() {
        let net = Net { points: [80, 80], configuration: "diamond" };
        let own = outline(&part, net);
        let of_swapped = apart(&outline(&swapped(&part), net), &own);
        let more_knots = apart(&outline(&with_knot(&with_knot(&part, 0.37), 0.61), net), &own);
        println!("{}: swapped {of_swapped:.1e}, with knots inserted {more_knots:.1e}", part["name"]);
        assert!(of_swapped < APART && more_knots < APART, "{}: {of_swapped} {more_knots}", part["name"]);
    }
}

#[test]
fn a_difference_between_outlines_is_seen() {
    let part = panel();
    let net = Net { points: [40, 40], configuration: "diamond" };
    let own = outline(&part, net);
    let turned: Vec<DVec2> = own.iter().map(|p| DVec2::from_angle(1.0).rotate(*p) + 7.0).collect();
    assert!(apart(&turned, &own) < 1e-9, "{}", apart(&turned, &own));
    let wider: Vec<DVec2> = own.iter().map(|p| *p * DVec2::new(1.002, 1.0)).collect();
    assert!(apart(&wider, &own) > 3.0 * APART);
    let mirrored: Vec<DVec2> = own.iter().rev().map(|p| DVec2::new(-p.x, p.y)).collect();
    assert!(apart(&mirrored, &own) > 1e-3);
}
