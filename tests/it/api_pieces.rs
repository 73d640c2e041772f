//! What the pieces of a pattern are given, through the service.

use std::sync::Arc;

use planish::queue::EngineRunner;
use serde_json::{Value, json};

use crate::support::api::{Live, settings};

#[tokio::test(flavor = "multi_thread")]
async fn a_pair_is_left_and_right_compensated_alike_and_the_report_says_so() {
    let live = Live::start(Arc::new(EngineRunner), &settings(|_| {})).await;
    let path = format!("{}/examples/parts/cone-with-holes.json", env!("CARGO_MANIFEST_DIR"));
    let surface: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let id = live.post("/v1/surfaces", &surface).await.expect(201).json()["id"].as_str().unwrap().to_owned();
    let plain = live.job(&json!({ "kind": "flatten", "surface": id })).await;
    let both = json!({ "along_percent": 2, "across_percent": -1 });
    let paired = live.job(&json!({ "kind": "flatten", "surface": id, "compensation": both, "pair": "mirror" })).await;
    let document = live.ended(&paired).await;
    live.ended(&plain).await;
    assert_eq!(document["parameters"]["pair"], "mirror");
    let report = async |job: &str| live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    let (before, after) = (report(&plain).await, report(&paired).await);
    assert_eq!(before["distortion"], after["distortion"], "distortion is that of the flattening");
    assert_eq!(after["pattern"]["compensation"], json!({ "along_percent": 2.0, "across_percent": -1.0 }));
    assert_eq!(before["pattern"].get("compensation"), None);
    let area = |report: &Value| report["pattern"]["area_mm2"].as_f64().unwrap();
    assert!((area(&after) / area(&before) - 2.0 * 1.02 * 0.99).abs() < 1e-9);
    let pattern = live.get(&format!("/v1/jobs/{paired}/pattern.json")).await.expect(200).json();
    let pieces = pattern["pieces"].as_array().unwrap();
    let names: Vec<_> = pieces.iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["piece 1_L", "piece 1_R"]);
    let points = |k: usize| -> Vec<[f64; 2]> { serde_json::from_value(pieces[k]["outline"].clone()).unwrap() };
    let (left, mut right) = (points(0), points(1));
    right[1..].reverse();
    let c = left[0][0] + right[0][0];
    assert!(left.iter().zip(&right).all(|(l, r)| c - l[0] == r[0] && l[1] == r[1]), "mirrored to the last bit");
    assert_eq!(left.len(), right.len());
}
