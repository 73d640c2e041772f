//! Every mesh and every grid of other people's making: what is said of it when it is sent, and what becomes of a flattening.
//!
//! `real_meshes.json` names each file with the warnings of its summary and the outcome of a `flatten` job with the
//! defaults: `flat`, or the code of the failure. Where Cader's method stops, that flip is what is expected of it.

use std::path::Path;

use bytes::Bytes;
use planish::engine::budget::Unobserved;
use planish::engine::error::Located as _;
use planish::engine::flattening::FlatteningMethod;
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::mesh::Topology;
use planish::engine::pipeline;
use planish::formats::surface::{self, ReadSurface, Reading};
use serde_json::{Map, Value, json};

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data");
const EXPECTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/it/real_meshes.json");

/// The files of a folder, by name; `None`, with a line that says so, when it is not there.
fn files(folder: &str) -> Option<Vec<(String, Bytes)>> {
    let path = Path::new(DATA).join(folder);
    let Ok(entries) = std::fs::read_dir(&path) else {
        println!("skipped: {} is not there", path.display());
        return None;
    };
    let mut files: Vec<_> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "glb"))
        .map(|path| (path.file_stem().unwrap().to_string_lossy().into_owned(), std::fs::read(&path).unwrap().into()))
        .collect();
    files.sort();
    Some(files)
}

fn expected(folder: &str) -> Map<String, Value> {
    let all: Value = serde_json::from_slice(&std::fs::read(EXPECTED).unwrap()).unwrap();
    all[folder].as_object().unwrap().clone()
}

/// What is seen of a file: counts and warnings of its summary, and the outcome of a flattening.
fn seen(bytes: &Bytes) -> Value {
    let read = surface::read(bytes, Reading::default(), "").unwrap_or_else(|faults| panic!("{faults:?}"));
    let summary = &read.summary;
    let codes = |list: &Value| -> Vec<String> {
        list.as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap().to_owned()).collect()
    };
    let mut seen = json!({
        "triangles": summary["triangles"], "vertices": summary["vertices"], "borders": summary["border_count"],
        "pieces": summary["piece_count"], "warnings": codes(&summary["warnings"]),
    });
    for (name, method) in [("isometric", FlatteningMethod::Isometric), ("cader", FlatteningMethod::Cader)] {
        let mut options = JobOptions::default();
        options.flattening.method = Some(method);
        seen[name] = json!(outcome(&read, &options));
    }
    seen
}

/// What becomes of a flattening.
fn outcome(read: &ReadSurface, options: &JobOptions) -> String {
    let summary = &read.summary;
    match pipeline::run(JobKind::Flatten, read.geometry.input(), options, &Unobserved) {
        Ok(outcome) => {
            let pattern = outcome.pattern.unwrap();
            let holes: usize = pattern.pieces.iter().map(|p| p.holes.len()).sum();
            assert_eq!(pattern.pieces.len() as u64, summary["piece_count"].as_u64().unwrap());
            assert_eq!((pattern.pieces.len() + holes) as u64, summary["border_count"].as_u64().unwrap());
            let flattening = outcome.report.flattening.unwrap();
            assert_eq!((flattening.flips, flattening.flattened), (0, summary["triangles"].as_u64().unwrap()));
            "flat".to_owned()
        }
        Err(failure) => {
            assert_ne!(failure.error.place().triangle, None, "{}", failure.error);
            assert_ne!(failure.error.place().xyz_mm, None, "{}", failure.error);
            assert!(!failure.error.remedies().is_empty());
            failure.error.code().to_owned()
        }
    }
}

fn compare(folder: &str) {
    let Some(files) = files(folder) else { return };
    let expected = expected(folder);
    let mut found = Map::new();
    for (name, bytes) in &files {
        found.insert(name.clone(), seen(bytes));
    }
    assert!(found == expected, "{:#}", Value::Object(found));
}

#[test]
fn every_real_mesh_is_flattened_or_refused_with_the_right_reason() {
    compare("meshes");
}

#[test]
fn every_real_grid_is_flattened_or_refused_with_the_right_reason() {
    compare("grids");
}

#[test]
fn what_is_wrong_with_a_real_mesh_is_said_in_words_that_name_the_place() {
    let Some(files) = files("meshes") else { return };
    let mut told = 0;
    for (name, code, words) in [
        ("boxes", "mesh-closed", "closed"),
        ("spot_closed", "mesh-closed", "5856 triangles"),
        ("moebius", "mesh-not-orientable", "one side only"),
        ("triple_vierbein", "mesh-non-manifold-edge", "triangles share the edge"),
        ("punctured_torus", "mesh-handles", "1 handle"),
        ("beetle_car", "several-borders", "11 borders"),
    ] {
        let Some((_, bytes)) = files.iter().find(|(file, _)| file == name) else { continue };
        let summary = surface::read(bytes, Reading::default(), "").unwrap().summary;
        let warnings = summary["warnings"].as_array().unwrap();
        let warning = warnings.iter().find(|w| w["code"] == code).unwrap_or_else(|| panic!("{name}: {warnings:?}"));
        assert!(warning["detail"].as_str().unwrap().contains(words), "{name}: {warning}");
        if code != "several-borders" {
            assert!(warning["place"]["triangle"].is_u64() && warning["place"]["xyz"].is_array(), "{name}: {warning}");
        }
        told += 1;
    }
    assert_eq!(told, 6);
}

#[test]
fn a_triangulation_gives_every_real_mesh_back_with_its_measures() {
    for folder in ["meshes", "grids"] {
        let Some(files) = files(folder) else { return };
        for (name, bytes) in files {
            let read = surface::read(&bytes, Reading::default(), "").unwrap();
            let outcome =
                pipeline::run(JobKind::Triangulate, read.geometry.input(), &JobOptions::default(), &Unobserved)
                    .unwrap();
            let report = &outcome.report.triangulation;
            assert_eq!(json!(report.triangles), read.summary["triangles"], "{name}");
            assert_eq!(json!(report.pieces), read.summary["piece_count"], "{name}");
            let area = read.summary["area_mm2"].as_f64().unwrap();
            assert!((report.area_mm2 / area - 1.0).abs() < 1e-6, "{name}: {} {area}", report.area_mm2);
            assert_eq!(outcome.normals.len(), outcome.mesh.positions.len());
            let oriented = Topology::cut(&outcome.mesh.triangles, outcome.mesh.positions.len()).unwrap();
            let faulty = ["moebius", "triple_vierbein"].contains(&name.as_str());
            assert_eq!(!oriented.1.is_empty(), faulty, "{name}: {:?}", oriented.1);
        }
    }
}
