//! Meshes through the service: sent as glTF of either form, said what they are, flattened or refused with the reason.

use std::sync::Arc;

use planish::queue::EngineRunner;
use reqwest::Method;
use serde_json::{Value, json};

use crate::support::api::{Live, plate, settings};

async fn live() -> Live {
    Live::start(Arc::new(EngineRunner), &settings(|_| {})).await
}

/// A binary file of these triangles, lengths in metres.
fn glb(points: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let (vertices, corners) = (12 * points.len(), 12 * triangles.len());
    let json = json!({
        "asset": { "version": "2.0" },
        "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0, "name": "panel" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": points.len() },
            { "bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": 3 * triangles.len() },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": vertices }, { "buffer": 0, "byteOffset": vertices, "byteLength": corners },
        ],
        "buffers": [{ "byteLength": vertices + corners }],
    });
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    let word = |out: &mut Vec<u8>, x: usize| out.extend_from_slice(&(x as u32).to_le_bytes());
    word(&mut out, 28 + text.len() + vertices + corners);
    word(&mut out, text.len());
    out.extend_from_slice(b"JSON");
    out.extend_from_slice(&text);
    word(&mut out, vertices + corners);
    out.extend_from_slice(b"BIN\0");
    points.as_flattened().iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    triangles.as_flattened().iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    out
}

/// A square of 0.1 m with its corner at `x`.
fn square(x: f32) -> [[f32; 3]; 4] {
    [[x, 0.0, 0.0], [x + 0.1, 0.0, 0.0], [x + 0.1, 0.1, 0.0], [x, 0.1, 0.0]]
}

const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

/// A square, and beside it a tetrahedron, which is closed.
fn square_and_closed() -> Vec<u8> {
    let mut points = square(0.0).to_vec();
    points.extend([[1.0, 0.0, 0.0], [1.1, 0.0, 0.0], [1.0, 0.1, 0.0], [1.0, 0.0, 0.1]]);
    glb(&points, &[[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 5, 7], [5, 6, 7], [6, 4, 7]])
}

#[tokio::test(flavor = "multi_thread")]
async fn a_binary_mesh_goes_in_and_its_pattern_comes_out() {
    let live = live().await;
    let file = glb(&square(0.0), &HALVES);
    let stored = live
        .send(Method::POST, "/v1/surfaces", |r| r.header("Content-Type", "model/gltf-binary").body(file.clone()))
        .await
        .expect(201)
        .json();
    assert_eq!((&stored["kind"], &stored["media_type"]), (&json!("mesh"), &json!("model/gltf-binary")));
    assert_eq!((&stored["triangles"], &stored["border_count"]), (&json!(2), &json!(1)));
    assert_eq!((&stored["name"], &stored["units"]), (&json!("panel"), &json!("m")));
    assert_eq!(stored["inferred"], json!(["lengths are taken in metres, as glTF has them"]));
    let id = stored["id"].as_str().unwrap();
    let content = live.get(&format!("/v1/surfaces/{id}/content")).await.expect(200);
    assert!(content.body == file);
    assert!(content.header("content-disposition").unwrap().contains("panel.glb"));
    let job = live.job(&json!({ "kind": "flatten", "surface": id, "triangulation": { "grid": [9, 9] } })).await;
    let document = live.ended(&job).await;
    assert_eq!(document["state"], "succeeded", "{document:#}");
    let report = live.get(&format!("/v1/jobs/{job}/report")).await.expect(200).json();
    assert!((report["pattern"]["area_mm2"].as_f64().unwrap() - 1e4).abs() < 1e-2, "{report:#}");
    assert!(report["warnings"][0].as_str().unwrap().contains("no effect"), "{report:#}");
    let back = live.get(&format!("/v1/jobs/{job}/mesh.glb")).await.expect(200).body;
    let again = live.post_bytes("/v1/surfaces", back).await.expect(201).json();
    assert_eq!((&again["triangles"], &again["vertices"]), (&json!(2), &json!(4)));
    let area = again["area_mm2"].as_f64().unwrap();
    assert!((area - 1e4).abs() < 1e-2, "{area}");
}

#[tokio::test(flavor = "multi_thread")]
async fn one_call_knows_a_mesh_by_its_first_bytes() {
    let live = live().await;
    let file = glb(&square(0.0), &HALVES);
    let form = "application/x-www-form-urlencoded";
    let answer = live
        .send(Method::POST, "/v1/flatten?format=json&units=mm", |r| r.header("Content-Type", form).body(file.clone()))
        .await
        .expect(200)
        .json();
    let size = answer["bounding_box_mm"][0].as_f64().unwrap();
    assert!((size - 0.1).abs() < 1e-6, "units=mm: {size}");
    // The same as text, by itself and in an envelope with a job.
    let text = json!({
        "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }], "scenes": [{ "nodes": [0] }], "scene": 0,
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }],
    });
    for body in [text.clone(), json!({ "surface": text, "job": { "flattening": { "seed": 0 } } })] {
        let answer = live.post("/v1/flatten?format=json", &body).await.expect(200).json();
        assert_eq!(answer["bounding_box_mm"], json!([1000.0, 1000.0]));
    }
    let answer = live
        .send(Method::POST, "/v1/surfaces", |r| r.header("Content-Type", "model/gltf+json").body(text.to_string()))
        .await
        .expect(200)
        .json();
    assert_eq!(answer["media_type"], "model/gltf+json");
}

#[tokio::test(flavor = "multi_thread")]
async fn welding_is_a_part_of_how_a_mesh_is_read() {
    let live = live().await;
    let points = [square(0.0)[0], square(0.0)[1], square(0.0)[2], square(0.0)[0], square(0.0)[2], square(0.0)[3]];
    let file = glb(&points, &[[0, 1, 2], [3, 4, 5]]);
    let welded = live.post_bytes("/v1/surfaces", file.clone()).await.expect(201).json();
    assert_eq!((&welded["vertices"], &welded["piece_count"]), (&json!(4), &json!(1)));
    let apart = live.post_bytes("/v1/surfaces?weld=none", file.clone()).await.expect(201).json();
    assert_eq!((&apart["vertices"], &apart["piece_count"]), (&json!(6), &json!(2)));
    assert_eq!(apart["reading"], json!({ "weld": "none" }));
    assert_ne!(welded["id"], apart["id"]);
    let job = live.job(&json!({ "kind": "flatten", "surface": apart["id"] })).await;
    assert_eq!(live.ended(&job).await["state"], "succeeded");
    let pattern = live.get(&format!("/v1/jobs/{job}/pattern.json")).await.expect(200).json();
    assert_eq!(pattern["pieces"].as_array().unwrap().len(), 2, "laid side by side");
    live.post_bytes("/v1/surfaces?weld=maybe", file).await.expect(400);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_flattened_is_said_when_it_comes_and_fails_the_job_with_the_place() {
    let live = live().await;
    let stored = live.post_bytes("/v1/surfaces", square_and_closed()).await.expect(201).json();
    let codes: Vec<&str> = stored["warnings"].as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap()).collect();
    assert_eq!(codes, ["several-pieces", "mesh-closed"]);
    assert_eq!((&stored["pieces"][0]["fault"], &stored["pieces"][1]["fault"]), (&Value::Null, &json!("mesh-closed")));
    let job = live.job(&json!({ "kind": "flatten", "surface": stored["id"] })).await;
    let document = live.ended(&job).await;
    assert_eq!(document["state"], "failed");
    let problem = &document["problem"];
    assert_eq!(problem["code"], "mesh-closed", "{document:#}");
    assert_eq!(problem["place"]["triangle"], 2);
    assert!(problem["detail"].as_str().unwrap().starts_with("piece 2 of 2: the piece is closed"), "{problem:#}");
    let skip = problem["remedies"].as_array().unwrap().iter().find(|r| r["set"]["skip_bad_pieces"] == true);
    assert!(skip.is_some(), "{problem:#}");
    let job = live.job(&json!({ "kind": "flatten", "surface": stored["id"], "skip_bad_pieces": true })).await;
    assert_eq!(live.ended(&job).await["state"], "succeeded");
    let report = live.get(&format!("/v1/jobs/{job}/report")).await.expect(200).json();
    assert_eq!(report["pattern"]["pieces"], 1);
    assert!(report["warnings"][0].as_str().unwrap().starts_with("piece 2 is left out"), "{report:#}");
    let job = live.job(&json!({ "kind": "triangulate", "surface": stored["id"] })).await;
    assert_eq!(live.ended(&job).await["state"], "succeeded");
    // With nothing left, there is nothing to cut.
    let points = [[1.0, 0.0, 0.0], [1.1, 0.0, 0.0], [1.0, 0.1, 0.0], [1.0, 0.0, 0.1]];
    let closed = glb(&points, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
    let answer = live.post_bytes("/v1/flatten?set=skip_bad_pieces=true", closed).await.expect(422);
    assert_eq!(answer.json()["code"], "mesh-closed");
}

#[tokio::test(flavor = "multi_thread")]
async fn seeds_and_directions_that_a_mesh_does_not_have_are_refused_in_words() {
    let live = live().await;
    let mut points = square(0.0).to_vec();
    points.extend(square(1.0));
    let file = glb(&points, &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    let id = live.post_bytes("/v1/surfaces", file).await.expect(201).json()["id"].clone();
    for (settings, words) in [
        (json!({ "flattening": { "seed": { "uv": [0.5, 0.5] } } }), "no (u, v)"),
        (json!({ "placement": { "align": { "uv": [1, 0] } } }), "no (u, v)"),
        (json!({ "placement": { "align": { "xyz": [0, 0, 1] } } }), "normal to the mesh"),
        (json!({ "flattening": { "seed": 4 } }), "4 triangles"),
    ] {
        let mut job = settings;
        job["kind"] = json!("flatten");
        job["surface"] = id.clone();
        let job = live.job(&job).await;
        let document = live.ended(&job).await;
        assert_eq!(document["state"], "failed", "{words}");
        assert!(document["problem"]["detail"].as_str().unwrap().contains(words), "{document:#}");
    }
    // A seed belongs to its piece, by number or by place; the other piece takes the default.
    for (seed, want) in [(json!(3), 0), (json!({ "xyz": [1050.0, 80.0, 0.0] }), 0), (json!(1), 1)] {
        let job = live
            .job(&json!({
                "kind": "flatten", "surface": id, "flattening": { "seed": seed },
                "placement": { "align": { "xyz": [0, 1, 0] }, "view": "back" }
            }))
            .await;
        assert_eq!(live.ended(&job).await["state"], "succeeded");
        let report = live.get(&format!("/v1/jobs/{job}/report")).await.expect(200).json();
        assert_eq!((&report["flattening"]["seed"], &report["pattern"]["pieces"]), (&json!(want), &json!(2)));
        assert_eq!(report["placement"]["mirrored"], true);
        assert_eq!(report["distortion"]["boundary"].as_array().unwrap().len(), 2);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn bad_files_and_wrong_types_are_told_apart() {
    let live = live().await;
    let mut file = glb(&square(0.0), &HALVES);
    let typed = |kind: &'static str, body: Vec<u8>| {
        live.send(Method::POST, "/v1/surfaces", move |r| r.header("Content-Type", kind).body(body))
    };
    typed("application/json", file.clone()).await.expect(415).problem("unsupported-media-type");
    typed("model/gltf-binary", plate().to_string().into_bytes()).await.expect(415);
    typed("model/stl", file.clone()).await.expect(415);
    typed("model/gltf+json", b"{\"asset\":".to_vec()).await.expect(400);
    let answer =
        live.send(Method::POST, "/v1/jobs", |r| r.header("Content-Type", "model/gltf-binary").body(file.clone()));
    answer.await.expect(415);
    let lying = String::from_utf8_lossy(&file[20..]).find("\"VEC3\"").unwrap() + 20;
    file[lying + 4] = b'2';
    let cut = file.len() - 8;
    for path in ["/v1/surfaces", "/v1/flatten"] {
        let answer = live.post_bytes(path, file.clone()).await.expect(422);
        answer.problem("invalid-surface");
        assert_eq!(answer.pointers(), ["/accessors/0"]);
        let answer = live.post_bytes(path, file[..cut].to_vec()).await.expect(422);
        assert!(answer.json()["errors"][0]["detail"].as_str().unwrap().contains("cut off"), "{}", answer.text());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_ramp_that_lies_on_itself_is_laid_as_a_spiral_on_request() {
    let live = live().await;
    // A ramp of one turn and a half around its axis, 80 to 100 mm from it.
    let (along, across) = (60_u32, 3_u32);
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=along {
        let part = i as f32 / along as f32;
        let (sin, cos) = (3.0 * std::f32::consts::PI * part).sin_cos();
        points.extend((0..=across).map(|k| {
            let r = 0.1 - 0.02 * k as f32 / across as f32;
            [r * cos, r * sin, 0.1 * part]
        }));
    }
    for i in 0..along {
        for k in 0..across {
            let a = i * (across + 1) + k;
            triangles.extend([[a, a + across + 1, a + 1], [a + 1, a + across + 1, a + across + 2]]);
        }
    }
    let file = glb(&points, &triangles);
    let answer = live
        .send(Method::POST, "/v1/surfaces", |r| r.header("Content-Type", "model/gltf-binary").body(file.clone()))
        .await;
    let surface = answer.expect(201).json()["id"].as_str().unwrap().to_owned();
    let mut reports = Vec::new();
    for injective in [false, true] {
        let flattening = json!({ "injective": injective });
        let job = live.job(&json!({ "kind": "flatten", "surface": surface, "flattening": flattening })).await;
        let document = live.ended(&job).await;
        assert_eq!(document["parameters"]["flattening"]["injective"], injective);
        reports.push(live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json());
    }
    let [free, found] = [&reports[0], &reports[1]].map(|report| &report["flattening"]);
    assert_eq!((&free["overlaps"], &free["injective"]), (&json!(1), &Value::Null));
    assert_eq!((&found["overlaps"], &found["flips"]), (&json!(0), &json!(0)));
    assert_eq!(found["injective"]["continued"], true);
    assert_eq!(found["injective"]["energy_after"], found["solver"]["energy"]);
    assert!(found["injective"]["energy_after"].as_f64().unwrap() < 0.1, "{found}");
    assert!(reports[0]["warnings"][0].as_str().unwrap().contains("`flattening.injective: true`"));
    assert_eq!(reports[1]["warnings"], json!([]));
}
