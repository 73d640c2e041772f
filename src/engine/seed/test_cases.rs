//! The reference cases, read in place, for tests: meshes, readings, surfaces.

use glam::DVec3;
use serde_json::Value;

use crate::engine::flattening::{Anchor, Average, Check, Order, Parent, Readings};
use crate::engine::mesh::Mesh;
use crate::engine::mesh::test_meshes::{Diagonal, grid, grid_triangles};

/// A case file, or `None` (with one line of explanation) where the reference folder is missing.
pub(crate) fn load(name: &str) -> Option<Value> {
    let path = format!("{}/../shared/reference/cases/{name}", env!("CARGO_MANIFEST_DIR"));
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: {name} is not in ../shared/reference/cases");
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

pub(crate) fn integers(value: &Value) -> Vec<u32> {
    value.as_array().unwrap().iter().map(|x| x.as_u64().unwrap() as u32).collect()
}

/// Readings of a case. What is not named is fifo, first, start, pair, incident.
pub(crate) fn readings(options: &Value) -> Readings {
    let named = |key: &str| options.get(key).and_then(Value::as_str);
    Readings {
        order: if named("order") == Some("index") { Order::Index } else { Order::Fifo },
        parent: if named("parent") == Some("last") { Parent::Last } else { Parent::First },
        anchor: if named("start") == Some("end") { Anchor::End } else { Anchor::Start },
        average: if named("average") == Some("running") { Average::Running } else { Average::Pair },
        check: match named("check") {
            Some("current") => Check::Current,
            Some("final") => Check::Final,
            _ => Check::Incident,
        },
    }
}

/// A mesh of `flatten_small.json`: triangles are compared with ours where the diagonals have a name.
pub(crate) fn small_mesh(file: &Value, name: &str) -> Mesh {
    let positions = file["X"].as_array().unwrap().iter().map(|p| DVec3::from_slice(&numbers(p))).collect();
    let given = file["meshes"][name]["triangles"].as_array().unwrap();
    let triangles: Vec<[u32; 3]> = given.iter().map(|t| integers(t).try_into().unwrap()).collect();
    if let Some(diagonal) = Diagonal::of_name(name) {
        assert_eq!(triangles, grid_triangles(11, 9, diagonal));
    }
    Mesh { positions, triangles, uv: None }
}

/// A mesh of `cylinder.json`: its points evaluated, regular diagonals.
pub(crate) fn cylinder_mesh(file: &Value, case: &Value) -> Mesh {
    let (theta, length) = (file["theta"].as_f64().unwrap(), file["length"].as_f64().unwrap());
    let lift = |p: &Value| {
        let (u, angle) = (p[0].as_f64().unwrap(), (p[1].as_f64().unwrap() - 0.5) * theta);
        DVec3::new(length * u, angle.sin(), angle.cos())
    };
    let positions = case["uv"].as_array().unwrap().iter().map(lift).collect();
    Mesh { positions, triangles: grid_triangles(20, 20, Diagonal::Regular), uv: None }
}

/// A uniform grid on a non-rational surface of a case file. Small and slow: by the definition of the basis functions.
pub(crate) fn surface_mesh(surface: &Value, m: usize, n: usize, diagonal: Diagonal) -> Mesh {
    let (knots_u, knots_v) = (numbers(&surface["knots_u"]), numbers(&surface["knots_v"]));
    let degree = |key: &str| surface[key].as_u64().unwrap() as usize;
    let (p, q) = (degree("degree_u"), degree("degree_v"));
    let rows = surface["control_points"].as_array().unwrap();
    let net: Vec<Vec<DVec3>> = rows
        .iter()
        .map(|row| row.as_array().unwrap().iter().map(|c| DVec3::from_slice(&numbers(c))).collect())
        .collect();
    grid(m, n, diagonal, |u, v| {
        let at = |i: usize, j: usize| basis(&knots_u, i, p, u) * basis(&knots_v, j, q, v);
        let mut point = DVec3::ZERO;
        for (i, row) in net.iter().enumerate() {
            for (j, control) in row.iter().enumerate() {
                point += *control * at(i, j);
            }
        }
        point
    })
}

/// Basis function (1.2) with half-open spans, the last one closed.
fn basis(knots: &[f64], i: usize, degree: usize, t: f64) -> f64 {
    if degree == 0 {
        let last = knots[knots.len() - 1];
        let within = knots[i] <= t && t < knots[i + 1];
        let at_end = t == last && knots[i] < last && knots[i + 1] == last;
        return f64::from(u8::from(within || at_end));
    }
    let share = |numerator: f64, span: f64| if span > 0.0 { numerator / span } else { 0.0 };
    share(t - knots[i], knots[i + degree] - knots[i]) * basis(knots, i, degree - 1, t)
        + share(knots[i + degree + 1] - t, knots[i + degree + 1] - knots[i + 1]) * basis(knots, i + 1, degree - 1, t)
}
