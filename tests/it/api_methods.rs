//! The methods of flattening through the service: what each takes, what its report says, and what belongs to the other.

use std::sync::Arc;

use planish::queue::EngineRunner;
use serde_json::{Value, json};

use crate::support::api::{Live, settings};

async fn live() -> Live {
    Live::start(Arc::new(EngineRunner), &settings(|_| {})).await
}

/// Stores one of the example parts.
async fn stored(live: &Live, name: &str) -> String {
    let path = format!("{}/examples/parts/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let surface: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    live.post("/v1/surfaces", &surface).await.expect(201).json()["id"].as_str().unwrap().to_owned()
}

/// The job's document and the report of a flattening with these options.
async fn flattened(live: &Live, surface: &str, flattening: Value) -> (Value, Value) {
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "flattening": flattening })).await;
    let document = live.ended(&job).await;
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    (document, report)
}

#[tokio::test(flavor = "multi_thread")]
async fn the_default_is_the_least_distortion_and_objectives_trade_area_against_shape() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    let (document, balanced) = flattened(&live, &surface, json!({})).await;
    let taken = json!({ "method": "isometric", "domain": "trimmed", "objective": "balanced" });
    assert_eq!(document["parameters"]["flattening"], taken);
    let found = &balanced["flattening"];
    assert_eq!((&found["method"], &found["flips"], &found["seed"]), (&json!("isometric"), &json!(0), &Value::Null));
    assert_eq!((&found["solver"]["converged"], &found["developable"]), (&json!(true), &Value::Null));

    let (_, sequential) = flattened(&live, &surface, json!({ "method": "cader", "domain": "trimmed" })).await;
    let change = |report: &Value, of: &str| report["distortion"][of].as_f64().unwrap();
    for of in ["area_change_percent", "shape_change_percent"] {
        assert!(change(&balanced, of) < change(&sequential, of), "{of}");
    }

    let (document, area) = flattened(&live, &surface, json!({ "objective": "area" })).await;
    assert_eq!(document["parameters"]["flattening"]["objective"], "area");
    assert!(change(&area, "area_change_percent") < change(&balanced, "area_change_percent"));
    // The same as weights.
    let (document, weighted) = flattened(&live, &surface, json!({ "weights": { "area": 20 } })).await;
    assert_eq!(document["parameters"]["flattening"]["weights"], json!({ "area": 20.0, "shape": 1.0 }));
    assert_eq!(weighted["flattening"]["objective"], "weights");
    assert!(change(&weighted, "area_change_percent") < change(&balanced, "area_change_percent"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_developable_part_is_laid_flat_without_strain_and_the_report_says_what_it_is() {
    let live = live().await;
    let surface = stored(&live, "cone-with-holes").await;
    let (_, report) = flattened(&live, &surface, json!({})).await;
    let found = &report["flattening"]["developable"];
    assert_eq!((&found["kind"], &report["flattening"]["solver"]), (&json!("cone"), &Value::Null));
    assert!(found["strain"].as_f64().unwrap() < 1e-10, "{found}");
    assert_eq!(report["distortion"]["hot_spots"], json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_belongs_to_one_method_is_refused_by_the_other() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    for (flattening, pointers) in [
        (json!({ "method": "isometric", "seed": "centre" }), vec!["/flattening/seed"]),
        (json!({ "method": "isometric", "readings": { "order": "fifo" } }), vec!["/flattening/readings"]),
        (json!({ "seed": "centre", "objective": "area" }), vec!["/flattening/objective"]),
        (json!({ "method": "cader", "weights": { "area": 2 } }), vec!["/flattening/weights"]),
        (json!({ "objective": "area", "weights": { "area": 2 } }), vec!["/flattening/weights"]),
        (json!({ "weights": { "area": -1 } }), vec!["/flattening/weights"]),
        (json!({ "method": "cader", "injective": true }), vec!["/flattening/injective"]),
        (json!({ "seed": "centre", "injective": false }), vec!["/flattening/injective"]),
        (json!({ "injective": 1 }), vec!["/flattening/injective"]),
        (json!({ "objective": "minimal" }), vec!["/flattening/objective"]),
    ] {
        let job = json!({ "kind": "flatten", "surface": surface, "flattening": flattening });
        assert_eq!(live.post("/v1/jobs", &job).await.expect(422).pointers(), pointers, "{flattening}");
    }
    let search = json!({ "kind": "optimum-seed-search", "surface": surface, "flattening": { "method": "isometric" } });
    assert_eq!(live.post("/v1/jobs", &search).await.expect(422).pointers(), ["/flattening/method"]);
    // What stands for nothing is as good as absent.
    let job = json!({ "kind": "flatten", "surface": surface, "flattening": { "method": "isometric", "seed": null } });
    live.post("/v1/jobs", &job).await.expect(202);
}
