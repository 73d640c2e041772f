//! The reference loops with exact areas and depths.

use serde_json::Value;

use super::samples::{polygon, shared, square, trimmed};

#[test]
fn reference_loops_have_their_exact_areas_and_depths() {
    let Some(path) = shared("reference/cases/trimmed.json") else { return };
    let cases: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    for (name, case) in cases["cases"].as_object().unwrap() {
        let loops: Vec<Vec<[f64; 2]>> = serde_json::from_value(case["loops"].clone()).unwrap();
        let face = trimmed(square(0.0, 100.0), loops.iter().map(|l| polygon(l)).collect());
        let trims = face.check().unwrap();
        let region = trims.polygonise(&face.surface, 0.1).unwrap();
        let exact = case["exact_area"].as_f64().unwrap();
        assert!((region.area() - exact).abs() < 1e-12, "{name}: {} for {exact}", region.area());
        let depths: Vec<u32> = region.loops.iter().map(|l| l.depth).collect();
        for run in case["runs"].as_array().unwrap() {
            let known: Vec<u32> = serde_json::from_value(run["depth"].clone()).unwrap();
            assert_eq!(depths, known, "{name}");
        }
    }
}
