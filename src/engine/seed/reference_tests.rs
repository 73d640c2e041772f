//! Cader's flattening, its measures and the seed search against the reference cases.

use glam::DVec2;
use serde_json::Value;

use super::test_cases::{cylinder_mesh, integers, load, numbers, readings, small_mesh, surface_mesh};
use crate::engine::flattening::cader::{self, CaderMesh, Scratch, Stop};
use crate::engine::mesh::Topology;
use crate::engine::mesh::test_meshes::Diagonal;

#[test]
fn small_flattenings_agree_in_sequence_counts_and_positions() {
    let Some(file) = load("flatten_small.json") else { return };
    let mut rows = 0;
    for case in file["flatten"].as_array().unwrap() {
        let Some(seed) = case.get("seed").and_then(Value::as_u64) else { continue };
        let mesh = small_mesh(&file, case["mesh"].as_str().unwrap());
        let topology = Topology::new(&mesh).unwrap();
        let (flattening, error) =
            cader::flatten_once(&mesh, &topology, readings(&case["options"]), seed as u32).unwrap();
        assert_eq!(error.is_none(), case["ok"].as_bool().unwrap());
        assert_eq!(flattening.sequence.len() as u64, case["n_flattened"].as_u64().unwrap());
        let levels: Vec<_> = flattening.levels.iter().map(|l| vec![l.triangles, l.averaged, l.duplicates]).collect();
        let expected: Vec<_> = case["levels"].as_array().unwrap().iter().map(integers).collect();
        assert_eq!(levels, expected, "levels of row {case}");
        if let Some(places) = case.get("P2") {
            assert_eq!(flattening.sequence, integers(&case["sequence"]));
            for (place, expected) in flattening.flat.iter().zip(places.as_array().unwrap()) {
                let expected = DVec2::from_slice(&numbers(expected));
                // 1e-8 of the model's size, which is about 15.
                assert!(place.distance(expected) < 1e-8 * 15.0, "{place} against {expected}");
            }
        }
        rows += 1;
    }
    assert_eq!(rows, 123);
}

#[test]
fn failures_on_a_hard_cap_stop_at_the_same_triangle_count() {
    let Some(file) = load("flatten_failures.json") else { return };
    for case in file["cases"].as_array().unwrap() {
        let diagonal = Diagonal::of_name(case["mesh"].as_str().unwrap()).unwrap();
        let mesh = surface_mesh(&file["surface"], 24, 24, diagonal);
        let prepared = CaderMesh::new(&mesh, &Topology::new(&mesh).unwrap()).unwrap();
        let readings = readings(&case["options"]);
        let mut scratch = Scratch::new();
        let mut successes = 0;
        for seed in 0..mesh.triangles.len() as u32 {
            successes += u64::from(cader::flatten(&prepared, readings, seed, &mut scratch).is_ok());
        }
        assert_eq!(successes, case["n_success"].as_u64().unwrap());
        let rows = integers(&case["seeds"]).into_iter().zip(integers(&case["ok"])).zip(integers(&case["n_flattened"]));
        for ((seed, ok), expected) in rows {
            let flattened = match cader::flatten(&prepared, readings, seed, &mut scratch) {
                Ok(()) => mesh.triangles.len() as u32,
                Err(Stop::Flipped { flattened, .. }) => flattened,
                Err(stop) => panic!("{stop:?}"),
            };
            assert_eq!((flattened, flattened == mesh.triangles.len() as u32), (expected, ok == 1), "seed {seed}");
        }
    }
}

#[test]
fn the_mapping_order_has_the_counts_of_tables_5_9_to_5_11() {
    let Some(file) = load("mesh_and_mapping.json") else { return };
    let fifo = readings(&Value::Null);
    for name in ["regular", "diamond", "chevron_row", "chevron_col"] {
        let case = &file[name];
        let diagonal = Diagonal::of_name(name).unwrap();
        // Any surface will do: a shallow saddle.
        let mesh = crate::engine::mesh::test_meshes::grid(60, 60, diagonal, |u, v| {
            glam::DVec3::new(u, v, 0.02 * (u - 0.5) * (v - 0.5))
        });
        let topology = Topology::new(&mesh).unwrap();
        assert_eq!(topology.edge_count() as u64, case["edges"].as_u64().unwrap());
        assert_eq!(mesh.triangles.len() as u64, case["triangles"].as_u64().unwrap());
        let first: Vec<_> = case["first_triangles"].as_array().unwrap().iter().map(integers).collect();
        assert_eq!(first, mesh.triangles[..8].iter().map(|t| t.to_vec()).collect::<Vec<_>>());
        let seed = case["table"]["seed"].as_u64().unwrap() as u32;
        let (flattening, error) = cader::flatten_once(&mesh, &topology, fifo, seed).unwrap();
        assert_eq!(error, None);
        let column = |of: fn(&crate::engine::flattening::LevelCounts) -> u32| -> Vec<u32> {
            flattening.levels[..12].iter().map(of).collect()
        };
        assert_eq!(column(|l| l.triangles), integers(&case["table"]["triangles_per_level"]));
        assert_eq!(column(|l| l.averaged), integers(&case["table"]["AP_per_level"]));
        assert_eq!(column(|l| l.duplicates), integers(&case["table"]["duplicate_AP"]));
    }
    let _ = cylinder_mesh;
}
