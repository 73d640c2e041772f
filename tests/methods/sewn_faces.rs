//! Real faces that share borders come out as one piece, or as pieces whose seams fit each other.

use std::collections::BTreeMap;
use std::path::Path;

use planish::engine::budget::Unobserved;
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::pipeline::{self, Outcome};
use planish::engine::sewing::{Join, SewingOptions};
use planish::formats::surface::{self, Reading};
use serde_json::{Value, json};

/// The faces of one model by its name, or a line that says why there are none.
fn faces() -> BTreeMap<String, Vec<(String, Value)>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: there is no {}", folder.display());
        return BTreeMap::new();
    };
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    names.sort();
    let mut models: BTreeMap<String, Vec<(String, Value)>> = BTreeMap::new();
    for path in names {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let Some((model, _)) = name.rsplit_once("_f") else { continue };
        let face: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        models.entry(model.to_owned()).or_default().push((name, face));
    }
    models
}

fn part(faces: &[(String, Value)]) -> surface::ReadSurface {
    let units = faces[0].1["units"].clone();
    let faces: Vec<Value> = faces
        .iter()
        .map(|(_, face)| {
            let mut face = face.clone();
            let fields = face.as_object_mut().unwrap();
            fields.remove("units");
            fields.remove("labels");
            face
        })
        .collect();
    surface::read(json!({ "units": units, "faces": faces }).to_string().as_bytes(), Reading::default(), "").unwrap()
}

fn sewn(read: &surface::ReadSurface, join: Join, kind: JobKind) -> Result<Outcome, String> {
    let sewing = Some(SewingOptions { join, tolerance_mm: None });
    let options = JobOptions { sewing, ..JobOptions::default() };
    pipeline::run(kind, read.geometry.input(), &options, &Unobserved).map_err(|failure| failure.error.to_string())
}

/// Least length that counts as a shared border, as a part of the tolerance: shorter ones are corners that touch.
const LEAST: f64 = 10.0;

#[test]
fn faces_of_one_model_that_share_borders_come_out_as_one_piece() {
    let models = faces();
    for (model, strain) in [("sunglasses_lens_igs", 4.0), ("nacelle_stp", 30.0), ("modern_cooker_1_brep", 0.01)] {
        let Some(faces) = models.get(model) else { continue };
        let outcome = sewn(&part(faces), Join::All, JobKind::Flatten).unwrap();
        let told = outcome.report.sewing.as_ref().unwrap();
        let pattern = outcome.pattern.as_ref().unwrap();
        println!(
            "{model}: {} borders, greatest gap {:.2e} mm within {:.4} mm",
            told.joined_borders, told.greatest_gap_mm, told.tolerance_mm
        );
        assert_eq!(pattern.pieces.len(), 1, "{model}: {told:?}");
        assert_eq!(
            told.joined_borders as usize,
            faces.len() - usize::from(model != "modern_cooker_1_brep"),
            "{model}: {told:?}"
        );
        assert!(told.greatest_gap_mm <= told.tolerance_mm);
        let found = &outcome.report.distortion.as_ref().unwrap().part.strain_percent;
        assert!(found.max < strain && found.min > -strain, "{model}: {} to {}", found.min, found.max);
        assert_eq!(outcome.report.flattening.as_ref().unwrap().flips, 0);
    }
}

#[test]
fn lenses_kept_apart_have_seams_that_fit_to_a_tenth_of_a_millimetre() {
    let models = faces();
    let Some(faces) = models.get("sunglasses_lens_igs") else { return };
    let outcome = sewn(&part(faces), Join::None, JobKind::Flatten).unwrap();
    let pattern = outcome.pattern.as_ref().unwrap();
    assert_eq!((pattern.pieces.len(), pattern.seams.len()), (4, 3));
    for seam in &pattern.seams {
        println!("{}: {:.4} mm, mismatch {:.4} mm", seam.name, seam.length_3d_mm, seam.mismatch_mm());
        assert!(seam.mismatch_mm() < 0.1, "{seam:?}");
    }
}

#[test]
fn no_model_is_torn_or_crowded_by_sewing() {
    for (model, faces) in faces().iter().filter(|(_, faces)| faces.len() > 1) {
        let read = part(faces);
        let outcome = sewn(&read, Join::All, JobKind::Triangulate).unwrap();
        let told = outcome.report.sewing.as_ref().unwrap();
        let topology =
            planish::engine::mesh::Topology::new(&outcome.mesh).unwrap_or_else(|fault| panic!("{model}: {fault}"));
        // A stretch that is shared joins its two faces.
        let mut joined: Vec<[u32; 2]> = Vec::new();
        for border in told.borders.iter().filter(|border| border.length_mm > LEAST * told.tolerance_mm) {
            joined.push(border.faces);
        }
        joined.sort_unstable();
        joined.dedup();
        assert!(topology.piece_count() + joined.len() >= faces.len(), "{model}: {told:?}");
        let [mesh, surface] = [outcome.report.triangulation.area_mm2, outcome.report.triangulation.surface_area_mm2];
        assert!((mesh - surface).abs() < 0.05 * surface, "{model}: {mesh} of {surface}");
    }
}

/// A wavy sheet in `count` x `count` patches, each a face with its own grid.
fn patches(count: usize) -> Value {
    let height = |x: f64, y: f64| 20.0 * (x / 60.0).sin() * (y / 80.0).cos();
    let size = 300.0 / count as f64;
    // Each patch interpolates the sheet's values along straight borders, so that neighbours meet.
    let face = |i: usize, j: usize| {
        let (x, y) = (i as f64 * size, j as f64 * size);
        let at = |s: f64, t: f64| {
            let (px, py) = (x + s * size, y + t * size);
            let z = height(x, y) * (1.0 - s) * (1.0 - t)
                + height(x + size, y) * s * (1.0 - t)
                + height(x, y + size) * (1.0 - s) * t
                + height(x + size, y + size) * s * t;
            let bulge = 2.0 * s * (1.0 - s) * t * (1.0 - t) * ((i + 2 * j) % 3) as f64;
            [px, py, z + bulge]
        };
        let rows: Vec<Vec<[f64; 3]>> =
            (0..4).map(|r| (0..4).map(|c| at(f64::from(r) / 3.0, f64::from(c) / 3.0)).collect()).collect();
        json!({ "degree_u": 3, "degree_v": 3, "knots_u": [0, 0, 0, 0, 1, 1, 1, 1], "knots_v": [0, 0, 0, 0, 1, 1, 1, 1], "control_points": rows })
    };
    let faces: Vec<Value> = (0..count * count).map(|k| face(k / count, k % count)).collect();
    json!({ "units": "mm", "faces": faces })
}

#[test]
fn many_patches_are_one_sheet() {
    let text = patches(7).to_string();
    let read = surface::read(text.as_bytes(), Reading::default(), "").unwrap();
    let started = std::time::Instant::now();
    let outcome = sewn(&read, Join::All, JobKind::Flatten).unwrap();
    println!(
        "49 faces sewn and flattened in {:.3} s, {} triangles",
        started.elapsed().as_secs_f64(),
        outcome.mesh.triangles.len()
    );
    let told = outcome.report.sewing.as_ref().unwrap();
    assert_eq!((outcome.pattern.as_ref().unwrap().pieces.len(), told.joined_borders), (1, 84), "{told:?}");
    assert_eq!(outcome.report.triangulation.borders, 1);
}

#[test]
fn ten_thousand_faces_are_refused_and_a_thousand_that_nearly_meet_are_bounded_work() {
    let plate = |k: usize, gap: f64| {
        let (x, y) = ((k % 40) as f64 * (10.0 + gap), (k / 40) as f64 * (10.0 + gap));
        json!({
            "degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
            "control_points": [[[x, y, 0], [x, y + 10.0, 0]], [[x + 10.0, y, 0], [x + 10.0, y + 10.0, 0]]],
        })
    };
    let part = |count: usize, gap: f64| {
        let faces: Vec<Value> = (0..count).map(|k| plate(k, gap)).collect();
        json!({ "units": "mm", "faces": faces }).to_string()
    };
    let faults = surface::read(part(10_000, 0.0).as_bytes(), Reading::default(), "").unwrap_err();
    assert!(faults[0].detail.contains("more than 1000 faces"), "{faults:?}");
    for (gap, pieces) in [(0.01, 1), (0.2, 1000)] {
        let read = surface::read(part(1000, gap).as_bytes(), Reading::default(), "").unwrap();
        let started = std::time::Instant::now();
        let outcome = sewn(&read, Join::All, JobKind::Flatten).unwrap();
        println!("1000 faces {gap} mm apart: {} pieces in {:.3} s", pieces, started.elapsed().as_secs_f64());
        assert_eq!(outcome.pattern.as_ref().unwrap().pieces.len(), pieces);
    }
}
