//! Lines, counts, meshes and seed searches against the reference cases.

use glam::DVec2;
use serde_json::Value;

use super::{AmpcOptions, NpRule, ampc};
use crate::engine::budget::Unobserved;
use crate::engine::distortion::{Original, Thresholds};
use crate::engine::flattening::cader::{self, CaderMesh, Scratch};
use crate::engine::mesh::{Mesh, Topology};
use crate::engine::nurbs::Surface;
use crate::engine::seed::test_cases::{case_surface, integers, load, numbers, readings};
use crate::engine::triangulation::lift;

/// Every so many triangles of the large case are seeds there.
const EVERY: usize = 7;

#[test]
fn lines_counts_meshes_and_seeds_agree() {
    let Some(file) = load("ampc.json") else { return };
    let mut rows = 0;
    for (name, case) in file.as_object().unwrap() {
        let surface = case_surface(&case["surface"]);
        // Starts in the middle of equal parts are another reading.
        for run in case["runs"].as_array().unwrap().iter().filter(|run| run["starts"] == "closed") {
            agree(name, &surface, run);
            rows += 1;
        }
    }
    assert_eq!(rows, 9);
}

fn agree(name: &str, surface: &Surface, run: &Value) {
    let number = |key: &str| run[key].as_u64().unwrap() as u32;
    let options = AmpcOptions {
        starts: number("s"),
        np_rule: if run["np_rule"] == "printed" { NpRule::Printed } else { NpRule::Needed },
        drop_thin: !run["min_dist"].is_null(),
        min_distance_mm: run["min_dist"].as_f64().unwrap_or(1.0),
        ..AmpcOptions::default()
    };
    let made = ampc(surface, [number("m"), number("n")], &options, &Unobserved).unwrap();
    let (counts, info) = (made.counts, &run["info"]);
    assert_eq!(serde_json::to_value(counts.direction).unwrap(), run["direction"], "{name}");
    assert_eq!(serde_json::to_value(counts.votes).unwrap(), run["votes"], "{name}");
    let found = counts.minimum;
    for (count, key) in [
        (found.strips_initial, "strips_initial"),
        (found.strips_used, "strips_used"),
        (found.polylines_found, "polylines_found"),
        (found.polylines_inner, "polylines_inner"),
        (found.beyond[0], "offsets_left"),
        (found.beyond[1], "offsets_right"),
        (found.polylines_inner + found.beyond[0] + found.beyond[1], "columns"),
        (counts.cells_dropped as u32, "thin_cells_dropped"),
    ] {
        assert_eq!(u64::from(count), info[key].as_u64().unwrap(), "{name}: {key}");
    }
    let close = |p: DVec2, expected: &Value| {
        let expected = DVec2::from_slice(&numbers(expected));
        assert!(p.distance(expected) < 1e-9, "{name}: {p} against {expected}");
    };
    if let Some(lines) = run.get("polylines") {
        assert_eq!(made.polylines.len(), lines.as_array().unwrap().len());
        for (line, expected) in made.polylines.iter().zip(lines.as_array().unwrap()) {
            assert_eq!(line.len(), expected.as_array().unwrap().len());
            line.iter().zip(expected.as_array().unwrap()).for_each(|(p, expected)| close(*p, expected));
        }
        let uv = run["uv"].as_array().unwrap();
        assert_eq!(made.domain.uv.len(), uv.len());
        made.domain.uv.iter().zip(uv).for_each(|(p, expected)| close(*p, expected));
        let triangles = run["triangles"].as_array().unwrap().iter().map(integers);
        assert!(made.domain.triangles.iter().map(|t| t.to_vec()).eq(triangles), "{name}");
    } else {
        for (line, key) in made.polylines.iter().enumerate().flat_map(|line| [(line, 0), (line, 1)]) {
            let (k, line) = line;
            let p = if key == 0 { line[0] } else { line[line.len() - 1] };
            close(p, &run[["polyline_start_u", "polyline_end"][key]][k]);
        }
    }
    let lifted = lift(surface, made.domain, &made.lines);
    let topology = Topology::new(&lifted.mesh).unwrap();
    let counted = [lifted.mesh.positions.len(), topology.edge_count(), lifted.mesh.triangles.len()];
    assert_eq!(counted.map(|count| count as u32), ["V", "E", "T"].map(number), "{name}");
    let area: f64 = crate::engine::mesh::measures::total_area(&lifted.mesh);
    let expected = run["area3d"].as_f64().unwrap();
    assert!((area - expected).abs() < 1e-9 * expected, "{name}: {area} against {expected}");
    let every = if run.get("uv").is_some() { 1 } else { EVERY };
    seeds_agree(name, &lifted.mesh, &topology, every, &run["search"]);
}

/// Every so many seeds run to their end.
fn seeds_agree(name: &str, mesh: &Mesh, topology: &Topology, every: usize, expected: &Value) {
    let prepared = CaderMesh::new(mesh, topology).unwrap();
    let original = Original::new(mesh, topology, None);
    let readings = readings(&Value::Null);
    let mut scratch = Scratch::new();
    let mut areas: Vec<(f64, usize)> = Vec::new();
    let seeds: Vec<usize> = (0..mesh.triangles.len()).step_by(every).collect();
    for &seed in &seeds {
        if cader::flatten(&prepared, readings, seed as u32, &mut scratch).is_ok() {
            areas.push((original.area_change(scratch.flat(), Thresholds::default()).percent(), seed));
        }
    }
    assert_eq!(seeds.len() as u64, expected["n_seeds"].as_u64().unwrap());
    assert_eq!(areas.len() as u64, expected["n_success"].as_u64().unwrap(), "{name}");
    areas.sort_by(|a, b| a.0.total_cmp(&b.0));
    let number = |key: &str| expected[key].as_f64().unwrap();
    let (best, worst) = (areas[0], areas[areas.len() - 1].0);
    if number("max_DA_pct") < 1e-10 {
        assert!(worst < 1e-10, "{name} is developable, and so is the mesh: {worst}");
        return;
    }
    for (value, expected) in [(best.0, number("DA_pct")), (worst, number("max_DA_pct"))] {
        assert!((value - expected).abs() < 1e-6 * expected, "{name}: {value} against {expected}");
    }
    if every > 1 {
        assert_eq!(best.1 as u64, expected["best_seed"].as_u64().unwrap(), "{name}");
    }
}
