//! The reference cases, read in place, for tests: meshes, readings, surfaces.

use glam::DVec3;
use serde_json::Value;

use crate::engine::flattening::{Anchor, Average, Check, Order, Parent, Readings, Scheme};
use crate::engine::mesh::Mesh;
use crate::engine::mesh::test_meshes::{Diagonal, grid, grid_triangles};
use crate::engine::nurbs::{KnotVector, Surface};

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
        scheme: Scheme::InTurn,
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

/// A non-rational surface of a case file.
pub(crate) fn case_surface(surface: &Value) -> Surface {
    let knots = |direction: &str| {
        let degree = surface[format!("degree_{direction}")].as_u64().unwrap() as usize;
        KnotVector::new(degree, numbers(&surface[format!("knots_{direction}")]), "knots").unwrap()
    };
    let rows = surface["control_points"].as_array().unwrap();
    let control = rows.iter().flat_map(|row| row.as_array().unwrap());
    let control = control.map(|c| DVec3::from_slice(&numbers(c))).collect();
    Surface::new(knots("u"), knots("v"), control, None).unwrap()
}

/// A uniform grid on a non-rational surface over the unit square of a case file.
pub(crate) fn surface_mesh(surface: &Value, m: usize, n: usize, diagonal: Diagonal) -> Mesh {
    let surface = case_surface(surface);
    grid(m, n, diagonal, |u, v| surface.point(u, v))
}
