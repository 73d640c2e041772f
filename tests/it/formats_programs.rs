//! What we write, seen by programs of other people's making: ezdxf, trimesh, the glTF validator, a renderer of SVG.
//!
//! `PLANISH_PYTHON` names a Python that has ezdxf and trimesh (otherwise `python3` is tried), `NODE_PATH` a folder that has
//! gltf-validator. Where a program is missing, a test says so in one line and passes.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use glam::{DVec2, DVec3};
use planish::engine::mesh::Mesh;
use planish::engine::pattern::{Contour, Pattern, Piece};
use planish::formats::{MeshParts, TitleBlock, dxf, glb, obj, ply, stl, svg, triangles_csv};
use serde_json::Value;

/// The letter F, 70 x 100, with a hole in its stem.
const LETTER: [[f64; 2]; 10] = [
    [0.0, 0.0],
    [20.0, 0.0],
    [20.0, 40.0],
    [50.0, 40.0],
    [50.0, 60.0],
    [20.0, 60.0],
    [20.0, 80.0],
    [70.0, 80.0],
    [70.0, 100.0],
    [0.0, 100.0],
];
const LETTER_AREA: f64 = 70.0 * 20.0 + 20.0 * 80.0 + 30.0 * 20.0;
const HOLE: [[f64; 2]; 4] = [[5.0, 5.0], [5.0, 15.0], [15.0, 15.0], [15.0, 5.0]];

fn contour(points: &[[f64; 2]]) -> Contour {
    Contour {
        points: points.iter().map(|p| DVec2::from_array(*p)).collect(),
        corners: vec![true; points.len()],
        ..Contour::default()
    }
}

fn letter() -> Pattern {
    let piece = Piece { name: "F".into(), outline: contour(&LETTER), holes: vec![contour(&HOLE)], ..Piece::default() };
    Pattern { pieces: vec![piece], bounding_box_mm: [70.0, 100.0], ..Pattern::default() }
}

fn title() -> TitleBlock {
    let labels = BTreeMap::from([
        ("order".to_owned(), "2231 <b>&amp;\n0\nEOF".to_owned()),
        ("part_number".to_owned(), "Rücklicht 日本 😀 %%d ^J \\U+0041".to_owned()),
    ]);
    TitleBlock::new(Some(&format!("letter \"F\" {}", "x".repeat(300))), &labels)
}

/// Runs a checking program; `None`, with a line that says so, when it is not installed.
fn run(command: &mut Command, what: &str) -> Option<Value> {
    let output = match command.output() {
        Ok(output) if output.status.code() != Some(3) => output,
        _ => {
            println!("skipped: {what} is not installed");
            return None;
        }
    };
    assert!(output.status.success(), "{what}: {}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).expect("the checker prints JSON"))
}

fn python(kind: &str, file: &Path, what: &str) -> Option<Value> {
    let python = std::env::var("PLANISH_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tools/check_files.py");
    run(Command::new(python).arg(script).arg(kind).arg(file), what)
}

#[test]
fn ezdxf_finds_nothing_to_repair_in_a_drawing_and_reads_it_as_meant() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("letter.dxf");
    std::fs::write(&file, dxf::write(&letter(), &title()).expect("a drawing")).expect("written");
    let Some(seen) = python("dxf", &file, "ezdxf") else { return };
    assert_eq!((&seen["errors"], &seen["fixes"]), (&Value::from(0), &Value::from(0)), "{seen}");
    assert_eq!((&seen["version"], &seen["units"], &seen["metric"]), (&"AC1009".into(), &4.into(), &1.into()));
    assert_eq!(seen["layers"], serde_json::json!(["0", "CUT", "Defpoints", "HOLE", "TEXT"]), "ezdxf adds Defpoints");
    let loops = seen["loops"].as_array().expect("loops");
    assert_eq!((&loops[0]["layer"], &loops[0]["closed"]), (&"CUT".into(), &true.into()));
    assert_eq!(loops[0]["area"], LETTER_AREA, "anticlockwise, in millimetres");
    assert_eq!((&loops[1]["layer"], &loops[1]["area"]), (&"HOLE".into(), &(-100.0).into()));
    let texts = seen["texts"].as_array().expect("texts");
    assert_eq!(texts.len(), 4, "{texts:?}");
    // CAD programs show \U+00FC as the letter; ezdxf hands it on as it stands in R12.
    let number = texts[2].as_str().expect("a text");
    assert!(number.starts_with("part_number: R\\U+00FCcklicht \\U+65E5\\U+672C ?"), "{number}");
    assert!(seen["extent"][1][1].as_f64().is_some_and(|y| y > 100.0), "the title lies within the extent: {seen}");
}

#[test]
fn ezdxf_accepts_drawings_of_tiny_and_huge_parts() {
    for scale in [1e-5, 1e3] {
        let mut pattern = letter();
        for p in pattern.pieces.iter_mut().flat_map(|p| std::iter::once(&mut p.outline).chain(&mut p.holes)) {
            p.points.iter_mut().for_each(|p| *p *= scale);
        }
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("letter.dxf");
        std::fs::write(&file, dxf::write(&pattern, &title()).expect("a drawing")).expect("written");
        let Some(seen) = python("dxf", &file, "ezdxf") else { return };
        assert_eq!((&seen["errors"], &seen["fixes"]), (&Value::from(0), &Value::from(0)), "{seen}");
        let area = seen["loops"][0]["area"].as_f64().expect("an area");
        assert!((area / (LETTER_AREA * scale * scale) - 1.0).abs() < 1e-6, "{area}");
    }
}

/// A quarter of a cylinder of 100 mm radius and 50 height, 1e6 mm from the origin, with its exact flattening.
fn quarter() -> (Mesh, Vec<DVec3>, Vec<DVec2>, Vec<[f64; 2]>) {
    let (columns, rows) = (31, 6);
    let (mut mesh, mut normals, mut flat) = (Mesh::default(), Vec::new(), Vec::new());
    for j in 0..rows {
        for i in 0..columns {
            let angle = std::f64::consts::FRAC_PI_2 * f64::from(i) / f64::from(columns - 1);
            let (sin, cos) = angle.sin_cos();
            let height = 10.0 * f64::from(j);
            mesh.positions.push(DVec3::new(1e6 + 100.0 * cos, 100.0 * sin, height));
            normals.push(DVec3::new(cos, sin, 0.0));
            flat.push(DVec2::new(100.0 * angle, height));
        }
    }
    for j in 0..rows as u32 - 1 {
        for i in 0..columns as u32 - 1 {
            let a = j * columns as u32 + i;
            let (b, c, d) = (a + 1, a + 1 + columns as u32, a + columns as u32);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let strain = (0..mesh.triangles.len()).map(|t| [-1.0, t as f64 * 0.01]).collect();
    (mesh, normals, flat, strain)
}

#[test]
fn trimesh_and_the_gltf_validator_accept_a_mesh_and_see_it_as_meant() {
    let (mesh, normals, flat, strain) = quarter();
    let parts =
        MeshParts { normals: &normals, flat: Some(&flat), strain_percent: Some(&strain), ..MeshParts::of(&mesh) };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("quarter.glb");
    std::fs::write(&file, glb::write(&parts, Some("quarter \"\n日本")).expect("a mesh")).expect("written");

    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tools/check_glb.cjs");
    if let Some(seen) = run(Command::new("node").arg(script).arg(&file), "gltf-validator") {
        // What remains is a note that no texture uses the coordinates: they are the flattening itself.
        for count in ["numErrors", "numWarnings", "numHints"] {
            assert_eq!(seen[count], 0, "{seen}");
        }
    }
    let Some(seen) = python("glb", &file, "trimesh") else { return };
    assert_eq!((&seen["triangles"], &seen["vertices"]), (&300.into(), &186.into()));
    let bound = |which: &str, k: usize| seen[which][k].as_f64().expect("a bound");
    for (k, (low, high)) in [(1000.0, 1000.1), (0.0, 0.1), (0.0, 0.05)].into_iter().enumerate() {
        assert!((bound("low", k) - low).abs() < 1e-6 && (bound("high", k) - high).abs() < 1e-6, "metres: {seen}");
    }
    let mm_per_uv = seen["extras"]["mm_per_uv"].as_f64().expect("the scale");
    let flat_area = seen["flat_area"].as_f64().expect("an area") * mm_per_uv * mm_per_uv;
    let want = 50.0 * 50.0 * std::f64::consts::PI;
    assert!((flat_area / want - 1.0).abs() < 1e-5, "not mirrored, in millimetres: {flat_area} against {want}");
}

/// What a program sees must be what was written, within rounding.
fn assert_near(seen: &Value, want: &[f64], what: &str) {
    let seen: Vec<f64> = seen.as_array().expect("numbers").iter().map(|x| x.as_f64().expect("a number")).collect();
    assert_eq!(seen.len(), want.len(), "{what}: {seen:?}");
    for (seen, want) in seen.iter().zip(want) {
        assert!((seen - want).abs() <= 1e-9 * want.abs().max(1.0), "{what}: {seen} for {want}");
    }
}

#[test]
fn the_gltf_validator_accepts_part_and_waste_and_what_was_not_reached() {
    let (mesh, normals, mut flat, mut strain) = quarter();
    let part: Vec<bool> = (0..mesh.triangles.len()).map(|t| t >= 60).collect();
    flat[..31].fill(DVec2::NAN);
    strain[..60].fill([f64::NAN; 2]);
    let parts = MeshParts {
        normals: &normals,
        flat: Some(&flat),
        strain_percent: Some(&strain),
        part: Some(&part),
        ..MeshParts::of(&mesh)
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("partial.glb");
    std::fs::write(&file, glb::write(&parts, Some("partial")).expect("a mesh")).expect("written");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tools/check_glb.cjs");
    if let Some(seen) = run(Command::new("node").arg(script).arg(&file), "gltf-validator") {
        for count in ["numErrors", "numWarnings", "numHints"] {
            assert_eq!(seen[count], 0, "{seen}");
        }
    }
    let Some(seen) = python("glb", &file, "trimesh") else { return };
    assert_eq!(
        (&seen["geometries"], &seen["triangles"], &seen["all_triangles"]),
        (&2.into(), &240.into(), &300.into())
    );
    let attributes = &seen["attributes"];
    assert_near(&attributes["_PLACED"], &[0.0, 1.0], "placed");
    assert_near(&attributes["_STRAIN_MIN"], &[-1.0, 0.0], "least strains, 0 where there are none");
    assert!(attributes["_STRAIN_MAX"][1].as_f64().is_some_and(|s| s > 2.5), "{attributes}");
}

#[test]
fn other_programs_read_obj_stl_ply_and_csv_as_meant() {
    let (mut mesh, normals, flat, strain) = quarter();
    // Nearer than a kilometre: STL has single precision and no offset.
    mesh.positions.iter_mut().for_each(|p| p.x -= 1e6);
    let part: Vec<bool> = (0..mesh.triangles.len()).map(|t| t >= 60).collect();
    let parts = MeshParts {
        normals: &normals,
        flat: Some(&flat),
        strain_percent: Some(&strain),
        part: Some(&part),
        ..MeshParts::of(&mesh)
    };
    let folder = tempfile::tempdir().expect("a folder");
    let seen = |kind: &str, bytes: Vec<u8>, what: &str| {
        let file = folder.path().join(format!("quarter.{kind}"));
        std::fs::write(&file, bytes).expect("written");
        python(kind, &file, what)
    };
    let want = 50.0 * 50.0 * std::f64::consts::PI;
    // Chords of 30 steps: sin(x)/x of half a step.
    let half = std::f64::consts::FRAC_PI_2 / 60.0;
    let area = want * half.sin() / half;
    if let Some(table) = seen("csv", triangles_csv::write(&parts).expect("a table"), "python") {
        assert_eq!((&table["rows"], &table["part"]), (&300.into(), &240.into()));
        assert_eq!(table["columns"].as_array().map(Vec::len), Some(15));
        assert_near(&serde_json::json!([table["area_3d"], table["area_2d"]]), &[area, want], "areas");
        assert_near(&table["strain"], &[-1.0, 2.99], "strains");
    }
    let flat_high = [50.0 * std::f64::consts::PI, 50.0];
    if let Some(mesh) = seen("obj", obj::write(&parts, "quarter").expect("a mesh"), "trimesh") {
        assert_eq!(mesh["triangles"], 300);
        assert_near(&mesh["high"], &[100.0, 100.0, 50.0], "corner");
        assert_near(&serde_json::json!([mesh["area"]]), &[area], "area");
        assert_near(&mesh["flat_high"], &flat_high, "place in the pattern, millimetres");
    }
    if let Some(mesh) = seen("ply", ply::write(&parts).expect("a mesh"), "trimesh") {
        assert_eq!((&mesh["triangles"], &mesh["vertices"], &mesh["part"]), (&300.into(), &186.into(), &240.into()));
        assert_near(&mesh["high"], &[100.0, 100.0, 50.0], "corner");
        assert_near(&mesh["flat_high"], &flat_high, "place in the pattern, millimetres");
        assert_near(&mesh["strain"], &[-1.0, 2.99], "strains");
        assert_near(&serde_json::json!([mesh["normal_x"]]), &[1.0], "normals");
    }
    if let Some(mesh) = seen("stl", stl::write(&parts).expect("a mesh"), "trimesh") {
        assert_eq!(mesh["triangles"], 300);
        let close = |key: &str| mesh[key].as_f64().is_some_and(|a| (a / area - 1.0).abs() < 1e-5);
        assert!(close("area") && close("normals"), "{mesh}");
    }
}

#[test]
fn a_renderer_shows_the_letter_upright_and_in_true_size() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("letter.svg");
    let text = svg::write(&letter(), &title()).expect("a drawing");
    std::fs::write(&file, &text).expect("written");
    // 25.4 dots an inch: a dot is a millimetre.
    let png = folder.path().join("letter.png");
    let render = Command::new("rsvg-convert")
        .args(["-d", "25.4", "-p", "25.4", "-b", "white", "-o"])
        .arg(&png)
        .arg(&file)
        .output();
    let Ok(output) = render else {
        println!("skipped: rsvg-convert is not installed");
        return;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let bytes = std::fs::read(&png).expect("a picture");
    let side = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let field = |name: &str| -> f64 {
        let text = std::str::from_utf8(&text).expect("UTF-8");
        let value = text.split(&format!(" {name}=\"")).nth(1).and_then(|t| t.split("mm\"").next());
        value.and_then(|v| v.parse().ok()).expect("a length in millimetres")
    };
    assert!((f64::from(side(16)) - field("width")).abs() <= 1.0, "{} {}", side(16), field("width"));
    assert!((f64::from(side(20)) - field("height")).abs() <= 1.0, "{} {}", side(20), field("height"));
}
