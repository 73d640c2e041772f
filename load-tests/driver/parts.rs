//! Surfaces to send: each with its own number in it, so that no two are the same to the service.

use serde_json::{Value, json};

/// A domed panel of 300 mm by 200 mm, biquadratic, with a round hole: the smallest thing that is still a part. The number
/// lifts one control point by some micrometres.
pub(crate) fn panel(number: usize) -> Value {
    let height = |i: usize, j: usize| match (i, j) {
        (1, 1) => 60.0 + number as f64 * 1e-6,
        (1, _) | (_, 1) => 20.0,
        _ => 0.0,
    };
    let points: Vec<Vec<[f64; 3]>> =
        (0..3).map(|i| (0..3).map(|j| [150.0 * i as f64, 100.0 * j as f64, height(i, j)]).collect()).collect();
    let circle = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / 32.0;
        [0.6 + 0.1 * angle.cos(), 0.5 + 0.15 * angle.sin()]
    };
    let mut hole: Vec<[f64; 2]> = (0..32).map(circle).collect();
    hole.push(circle(0));
    json!({
        "name": "panel",
        "units": "mm",
        "degree_u": 2, "degree_v": 2,
        "knots_u": [0, 0, 0, 1, 1, 1],
        "knots_v": [0, 0, 0, 1, 1, 1],
        "control_points": points,
        "trims": [
            [{ "points": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]] }],
            [{ "points": hole }]
        ],
        "labels": { "part_number": format!("panel-{number}") }
    })
}

/// The panel as a body.
pub(crate) fn panel_bytes(number: usize) -> Vec<u8> {
    panel(number).to_string().into_bytes()
}

/// A half cylinder of radius 100 mm and length 400 mm (rational quadratic), trimmed by an oval of so many points.
pub(crate) fn half_cylinder(points: usize) -> Value {
    let corner = std::f64::consts::FRAC_1_SQRT_2;
    let arc = [(1.0, 0.0, 1.0), (1.0, 1.0, corner), (0.0, 1.0, 1.0), (-1.0, 1.0, corner), (-1.0, 0.0, 1.0)];
    let net: Vec<_> = arc.iter().map(|&(x, y, _)| [0.0, 400.0].map(|z| [100.0 * x, 100.0 * y, z])).collect();
    let weights: Vec<_> = arc.iter().map(|&(_, _, w)| [w, w]).collect();
    let oval = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / points as f64;
        [1.0 + 0.98 * angle.cos(), 0.5 + 0.49 * angle.sin()]
    };
    let mut border: Vec<[f64; 2]> = (0..points).map(oval).collect();
    border.push(oval(0));
    json!({
        "name": "trimmed half cylinder",
        "units": "mm",
        "degree_u": 2, "degree_v": 1,
        "knots_u": [0, 0, 0, 1, 1, 2, 2, 2],
        "knots_v": [0, 0, 1, 1],
        "control_points": net,
        "weights": weights,
        "trims": [[{ "points": border }]]
    })
}
