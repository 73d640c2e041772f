//! Faces to test with: read from the shared folder, or made here.

use std::path::PathBuf;

use glam::{DVec2, DVec3};
use serde_json::Value;

use crate::engine::nurbs::{Curve2, KnotVector, Surface};
use crate::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};

/// A folder or file of the shared data; `None`, said in one line, when it is not there.
pub(super) fn shared(relative: &str) -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")).join(relative);
    if !path.exists() {
        println!("skipped: ../shared/{relative} is not there");
        return None;
    }
    Some(path)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn point2(value: &Value) -> DVec2 {
    DVec2::from_slice(&numbers(value))
}

fn knots(face: &Value, degree: &str, field: &str) -> KnotVector {
    KnotVector::new(face[degree].as_u64().unwrap() as usize, numbers(&face[field]), "knots").unwrap()
}

/// A face in the project's own JSON.
pub(super) fn face(json: &Value) -> TrimmedSurface {
    let rows = json["control_points"].as_array().unwrap();
    let control = rows.iter().flat_map(|r| r.as_array().unwrap()).map(|p| DVec3::from_slice(&numbers(p))).collect();
    let weights = json["weights"].as_array().map(|rows| rows.iter().flat_map(numbers).collect());
    let surface =
        Surface::new(knots(json, "degree_u", "knots_u"), knots(json, "degree_v", "knots_v"), control, weights).unwrap();
    let curve = |c: &Value| {
        let control = c["control_points"].as_array().unwrap().iter().map(point2).collect();
        let weights = c["weights"].is_array().then(|| numbers(&c["weights"]));
        TrimCurve {
            shape: TrimShape::Nurbs(Curve2::new(knots(c, "degree", "knots"), control, weights).unwrap()),
            reversed: c["reversed"].as_bool().unwrap_or(false),
        }
    };
    let trims = json["trims"].as_array().map_or(&[][..], Vec::as_slice);
    let loops = trims.iter().map(|l| TrimLoop { curves: l.as_array().unwrap().iter().map(curve).collect() }).collect();
    TrimmedSurface { surface, loops, side: Side::Normal }
}

/// All real faces with their names and the facts given about them.
pub(crate) fn real_faces() -> Vec<(String, TrimmedSurface, Value)> {
    let Some(folder) = shared("data/surfaces") else { return Vec::new() };
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
        .into_iter()
        .map(|path| {
            let json: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
            (path.file_stem().unwrap().to_string_lossy().into_owned(), face(&json), json["extra"].clone())
        })
        .collect()
}

/// A flat square with corners (0, 0, 0) and (`size`, `size`, 0) over the domain `[at, at + 1]` in u and v.
pub(super) fn square(at: f64, size: f64) -> Surface {
    let k = || KnotVector::new(1, vec![at, at, at + 1.0, at + 1.0], "knots").unwrap();
    let control = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0) * size);
    Surface::new(k(), k(), control.to_vec(), None).unwrap()
}

/// A loop of one polyline through `points`, which is closed here.
pub(super) fn polygon(points: &[[f64; 2]]) -> TrimLoop {
    let points = points.iter().chain(points.first()).map(|&p| DVec2::from_array(p)).collect();
    TrimLoop { curves: vec![TrimCurve { shape: TrimShape::Polyline(points), reversed: false }] }
}

/// An axis-parallel rectangle, anticlockwise.
pub(super) fn rectangle(low: [f64; 2], high: [f64; 2]) -> TrimLoop {
    polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]])
}

/// A circle as one closed rational quadratic of three arcs.
pub(super) fn circle(centre: [f64; 2], radius: f64) -> TrimLoop {
    let centre = DVec2::from_array(centre);
    let third = std::f64::consts::TAU / 3.0;
    let at = |k: usize| {
        let reach = if k.is_multiple_of(2) { radius } else { 2.0 * radius };
        centre + DVec2::from_angle(0.5 * third * k as f64) * reach
    };
    let mut control: Vec<DVec2> = (0..6).map(at).collect();
    control.push(control[0]);
    let weights = (0..7).map(|k| if k % 2 == 0 { 1.0 } else { 0.5 }).collect();
    let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 3.0], "knots").unwrap();
    let shape = TrimShape::Nurbs(Curve2::new(knots, control, Some(weights)).unwrap());
    TrimLoop { curves: vec![TrimCurve { shape, reversed: false }] }
}

/// The same loop walked the other way.
pub(super) fn backwards(mut trim: TrimLoop) -> TrimLoop {
    trim.curves.reverse();
    for c in &mut trim.curves {
        c.reversed = !c.reversed;
    }
    trim
}

/// A surface with loops.
pub(super) fn trimmed(surface: Surface, loops: Vec<TrimLoop>) -> TrimmedSurface {
    TrimmedSurface { surface, loops, side: Side::Normal }
}
