//! Parts of several faces through the service.

use std::sync::Arc;

use planish::queue::EngineRunner;
use serde_json::{Value, json};

use crate::support::api::{Live, settings};
use crate::support::service::program;

fn plate(low: [f64; 2], high: [f64; 2]) -> Value {
    let at = |x: f64, y: f64| json!([x, y, 0]);
    json!({
        "degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
        "control_points": [[at(low[0], low[1]), at(low[0], high[1])], [at(high[0], low[1]), at(high[0], high[1])]],
    })
}

fn plates() -> Value {
    json!({
        "name": "plates", "units": "mm", "labels": { "order": "2231" },
        "faces": [plate([0.0, 0.0], [100.0, 60.0]), plate([100.0, 0.0], [150.0, 25.0]), plate([100.0, 25.0], [150.0, 60.0])],
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn faces_are_one_sheet_or_pieces_with_seams() {
    let live = Live::start(Arc::new(EngineRunner), &settings(|_| {})).await;
    let stored = live.post("/v1/surfaces", &plates()).await.expect(201).json();
    assert_eq!((&stored["kind"], &stored["faces"], &stored["name"]), (&json!("part"), &json!(3), &json!("plates")));
    assert!((stored["area_mm2"].as_f64().unwrap() - 9000.0).abs() < 1e-6);
    let whole = live.job(&json!({ "kind": "flatten", "surface": stored["id"] })).await;
    let apart = live
        .job(&json!({ "kind": "flatten", "surface": stored["id"], "sewing": { "join": "none", "tolerance_mm": 0.01 } }))
        .await;
    let document = live.ended(&whole).await;
    assert_eq!(document["state"], "succeeded", "{document}");
    let taken = document["parameters"]["sewing"]["tolerance_mm"].as_f64().unwrap();
    assert!((taken - 1e-4 * 150.0_f64.hypot(60.0)).abs() < 1e-9, "{taken}");
    assert_eq!(live.ended(&apart).await["state"], "succeeded");
    let report = async |job: &str| live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    let one = report(&whole).await;
    assert_eq!((&one["pattern"]["pieces"], &one["sewing"]["joined_borders"]), (&json!(1), &json!(3)));
    assert!((one["pattern"]["area_mm2"].as_f64().unwrap() - 9000.0).abs() < 1e-6);
    let three = report(&apart).await;
    assert_eq!((&three["pattern"]["pieces"], &three["sewing"]["seam_count"]), (&json!(3), &json!(3)));
    let seams = three["sewing"]["seams"].as_array().unwrap();
    let length = |seam: &Value| seam["lengths_mm"][0].as_f64().unwrap();
    assert!((seams.iter().map(length).sum::<f64>() - 110.0).abs() < 1e-6, "{seams:?}");
    assert!(three["sewing"]["greatest_mismatch_mm"].as_f64().unwrap() < 1e-9);
    live.get(&format!("/v1/jobs/{whole}/pattern.dxf")).await.expect(200);
    live.get(&format!("/v1/jobs/{apart}/pattern.dxf")).await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn faults_of_a_face_and_of_settings_are_refused_where_they_are() {
    let live = Live::start(Arc::new(EngineRunner), &settings(|_| {})).await;
    let mut part = plates();
    part["faces"][1]["degree_u"] = json!(2);
    let problem = live.post("/v1/surfaces", &part).await.expect(422).json();
    let pointers: Vec<&str> =
        problem["errors"].as_array().unwrap().iter().filter_map(|e| e["pointer"].as_str()).collect();
    assert!(pointers.iter().all(|pointer| pointer.starts_with("/faces/1/")), "{pointers:?}");
    let id = live.post("/v1/surfaces", &plates()).await.expect(201).json()["id"].clone();
    let asked = json!({ "kind": "flatten", "surface": id, "sewing": { "tolerance_mm": -1 } });
    let problem = live.post("/v1/jobs", &asked).await.expect(422).json();
    assert_eq!(problem["errors"][0]["pointer"], "/sewing/tolerance_mm");
    let wide = live.job(&json!({ "kind": "flatten", "surface": id, "sewing": { "tolerance_mm": 100 } })).await;
    let ended = live.ended(&wide).await;
    assert_eq!(ended["state"], "failed");
    assert!(ended.to_string().contains("sewing.tolerance_mm"), "{ended}");
    let based = live.job(&json!({ "kind": "flatten", "surface": id, "flattening": { "domain": "base" } })).await;
    assert!(live.ended(&based).await.to_string().contains("no base surface"));
}

#[tokio::test(flavor = "multi_thread")]
async fn stored_surfaces_are_composed_to_one_part() {
    let live = Live::start(Arc::new(EngineRunner), &settings(|_| {})).await;
    let mut ids: Vec<Value> = Vec::new();
    for (k, mut face) in plates()["faces"].as_array().unwrap().iter().cloned().enumerate() {
        face["units"] = json!("mm");
        face["name"] = json!(format!("plate {k}"));
        ids.push(live.post("/v1/surfaces", &face).await.expect(201).json()["id"].clone());
    }
    let asked = json!({ "kind": "flatten", "surfaces": ids });
    let (first, again) = (live.job(&asked).await, live.job(&asked).await);
    let [first, again] = [live.ended(&first).await, live.ended(&again).await];
    assert_eq!((&first["state"], &first["surface"]), (&json!("succeeded"), &again["surface"]));
    assert_eq!(first["labels"]["name"], "plate 0 + plate 1 + plate 2", "{first}");
    let stored = live.get(&format!("/v1/surfaces/{}", first["surface"].as_str().unwrap())).await.expect(200).json();
    assert_eq!((&stored["kind"], &stored["faces"]), (&json!("part"), &json!(3)));
    let report = live.get(&format!("/v1/jobs/{}/report.json", first["id"].as_str().unwrap())).await.expect(200).json();
    assert_eq!((&report["pattern"]["pieces"], &report["sewing"]["joined_borders"]), (&json!(1), &json!(3)));
    let refused = async |asked: Value| {
        let problem = live.post("/v1/jobs", &asked).await.expect(422).json();
        problem["errors"]
            .as_array()
            .unwrap()
            .iter()
            .map(|e| e["pointer"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    let missing = "0".repeat(40);
    assert_eq!(
        refused(json!({ "kind": "flatten", "surfaces": [ids[0], missing, ids[0]] })).await,
        ["/surfaces/1", "/surfaces/2"]
    );
    assert_eq!(refused(json!({ "kind": "flatten", "surfaces": [] })).await, ["/surfaces"]);
    assert_eq!(refused(json!({ "kind": "flatten", "surfaces": "all" })).await, ["/surfaces"]);
    assert_eq!(refused(json!({ "kind": "flatten", "surface": ids[0], "surfaces": ids })).await, ["/surface"]);
    assert_eq!(refused(json!({ "kind": "flatten", "surfaces": vec![missing; 101] })).await, ["/surfaces"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_surface_is_cut_into_pieces_with_a_seam() {
    let live = Live::start(Arc::new(EngineRunner), &settings(|_| {})).await;
    let mut surface = plate([0.0, 0.0], [100.0, 60.0]);
    surface["units"] = json!("mm");
    let id = live.post("/v1/surfaces", &surface).await.expect(201).json()["id"].clone();
    for points in [json!([[0.5, -0.2], [0.5, 1.2]]), json!([[50.0, 0.0, 0.1], [50.0, 60.0, -0.1]])] {
        let job = live.job(&json!({ "kind": "flatten", "surface": id, "cuts": [{ "points": points }] })).await;
        let ended = live.ended(&job).await;
        assert_eq!(
            (&ended["state"], &ended["parameters"]["cuts"][0]["points"]),
            (&json!("succeeded"), &points),
            "{ended}"
        );
        let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
        assert_eq!((&report["pattern"]["pieces"], &report["sewing"]["seam_count"]), (&json!(2), &json!(1)));
        let seam = &report["sewing"]["seams"][0];
        assert!((seam["length_3d_mm"].as_f64().unwrap() - 60.0).abs() < 1e-6, "{seam}");
    }
    let one = json!({ "kind": "flatten", "surface": id, "cuts": [{ "points": [[0, 0]] }] });
    assert_eq!(live.post("/v1/jobs", &one).await.expect(422).json()["errors"][0]["pointer"], "/cuts/0/points");
    let mixed = json!({ "kind": "flatten", "surface": id, "cuts": [{ "points": [[0, 0], [1, 1, 1]] }] });
    let problem = live.post("/v1/jobs", &mixed).await.expect(422).json();
    assert!(problem["errors"][0]["detail"].as_str().unwrap().contains("[[u, v], …]"), "{problem}");
}

#[test]
fn several_files_are_one_part_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let files: Vec<_> = plates()["faces"]
        .as_array()
        .unwrap()
        .iter()
        .enumerate()
        .map(|(k, face)| {
            let path = folder.path().join(format!("plate-{k}.json"));
            std::fs::write(&path, face.to_string()).unwrap();
            path
        })
        .collect();
    let out = folder.path().join("out");
    let run = program(&["run", "flatten"]).args(&files).args(["--units", "cm", "--out"]).arg(&out).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let report: Value = serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap();
    assert_eq!((&report["pattern"]["pieces"], &report["sewing"]["faces"]), (&json!(1), &json!(3)));
    assert!((report["pattern"]["area_mm2"].as_f64().unwrap() - 900_000.0).abs() < 1e-3);
    let unknown = program(&["check"]).args(&files).output().unwrap();
    let said = String::from_utf8_lossy(&unknown.stderr).into_owned();
    assert!(!unknown.status.success() && said.contains("plate-0.json") && said.contains("/units"), "{said}");
}
