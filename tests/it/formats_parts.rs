//! The sample parts: the files are what the program makes, and each can be read and summed up.

#[path = "../../examples/make_parts/parts.rs"]
mod parts;
#[path = "../../examples/make_parts/shapes.rs"]
mod shapes;
#[path = "../../examples/make_parts/trims.rs"]
mod trims;

use std::path::{Path, PathBuf};

use planish::formats::{summary, surface_json};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/parts")
}

#[test]
fn the_files_are_what_the_program_makes() {
    let mut names = Vec::new();
    for part in parts::all() {
        let kept = std::fs::read_to_string(folder().join(part.file)).expect(part.file);
        assert_eq!(kept, part.json(), "{}: run `cargo run --example make_parts`", part.file);
        assert!(kept.len() < 20_000, "{} has {} bytes", part.file, kept.len());
        names.push(part.file.to_owned());
    }
    let mut kept: Vec<String> = std::fs::read_dir(folder())
        .expect("the folder of parts")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    kept.sort();
    assert_eq!(kept, names, "no part is missing and none is left over");
}

#[test]
fn every_part_is_read_without_fault_or_warning() {
    for part in parts::all() {
        let read = surface_json::read(part.json().as_bytes(), &surface_json::ReadOptions::default())
            .unwrap_or_else(|faults| panic!("{}: {faults:?}", part.file));
        let summary = summary::summarise(&read);
        let odd: &[&str] = if part.file == "micro-lens.json" { &["unusual-size"] } else { &[] };
        assert_eq!(summary.warnings.iter().map(|w| w.code.as_str()).collect::<Vec<_>>(), odd, "{}", part.file);
        assert!(summary.area_mm2.is_some_and(|a| a > 1e-7), "{}: {:?}", part.file, summary.area_mm2);
        assert!(summary.inferred.is_empty(), "{}: {:?}", part.file, summary.inferred);
        assert!(summary.diagonal_mm > 1e-3 && summary.diagonal_mm < 2e5, "{}: {}", part.file, summary.diagonal_mm);
    }
}
