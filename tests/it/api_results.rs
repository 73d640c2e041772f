//! Results over HTTP: every form, the choice of form and coding, tags, and what is kept in memory.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use planish::engine::budget::Observer;
use planish::formats::stored;
use planish::queue::{EngineRunner, Failed, Finished, Runner, Task};
use planish::store::Standing;
use reqwest::Method;
use serde_json::{Value, json};

use crate::support::api::{Live, Sketch, plate, settings};

/// A shallow bowl with a square hole, so that strains are not zero.
fn bowl() -> Value {
    json!({
        "name": "bowl", "units": "mm", "degree_u": 2, "degree_v": 2,
        "knots_u": [0, 0, 0, 1, 1, 1], "knots_v": [0, 0, 0, 1, 1, 1],
        "control_points": [
            [[0, 0, 0], [0, 50, 10], [0, 100, 0]],
            [[50, 0, 10], [50, 50, 20], [50, 100, 10]],
            [[100, 0, 0], [100, 50, 10], [100, 100, 0]]
        ],
        "trims": [[{ "points": [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9], [0.1, 0.1]] }]],
        "labels": { "part_number": "4711-A" }
    })
}

/// A service with a flattened bowl: its job's address.
async fn flattened(live: &Live) -> String {
    let surface = live.surface(&bowl()).await;
    let job = json!({ "kind": "flatten", "surface": surface, "triangulation": { "grid": [9, 9] }, "flattening": { "seed": "centre" } });
    let job = live.job(&job).await;
    assert_eq!(live.ended(&job).await["state"], "succeeded");
    format!("/v1/jobs/{job}")
}

async fn engine() -> Live {
    Live::start(Arc::new(EngineRunner), &settings(|_| {})).await
}

#[tokio::test(flavor = "multi_thread")]
async fn every_form_says_the_same_of_part_and_waste() {
    let live = engine().await;
    let job = flattened(&live).await;
    let mesh = live.get(&format!("{job}/mesh.json")).await.expect(200).json();
    let part = mesh["part"].as_array().unwrap();
    let inside = part.iter().filter(|p| **p == true).count();
    assert!(inside > 0 && inside < part.len(), "the loop leaves waste: {inside} of {}", part.len());
    let strains = mesh["strain_percent"].as_array().unwrap();
    assert_eq!((part.len(), strains.len()), (128, 128));
    assert_eq!(mesh["flat"].as_array().unwrap().len(), 81);

    let table = live.get(&format!("{job}/report.csv")).await.expect(200);
    assert_eq!(table.header("content-disposition"), Some("attachment; filename=\"4711-A.csv\""));
    let table = table.text();
    let rows: Vec<Vec<&str>> = table.split_terminator("\r\n").map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 129);
    let column = |name: &str| rows[0].iter().position(|field| *field == name).unwrap();
    let (marked, least, area) = (column("part"), column("strain_min_percent"), column("area_3d_mm2"));
    for (row, (part, strain)) in rows[1..].iter().zip(part.iter().zip(strains)) {
        assert_eq!(row[marked] == "1", *part == true);
        assert_eq!(row[least].parse::<f64>().unwrap(), strain[0].as_f64().unwrap());
    }
    let report = live.get(&format!("{job}/report")).await.expect(200).json();
    let total: f64 = rows[1..].iter().map(|row| row[area].parse::<f64>().unwrap()).sum();
    assert!((total / report["triangulation"]["area_mm2"].as_f64().unwrap() - 1.0).abs() < 1e-12);
    let of_part = report["triangulation"]["part_area_mm2"].as_f64().unwrap();
    // z = f(u) + f(v) with slopes up to 0.16 within the loop: 6400 (1 + 0.02 * 2 * 0.64 / 3), and little of higher order.
    assert!((of_part / 6454.6 - 1.0).abs() < 1e-3, "{of_part}");
    assert!(of_part < 0.65 * report["triangulation"]["surface_area_mm2"].as_f64().unwrap());

    let obj = live.get(&format!("{job}/mesh.obj")).await.expect(200).text();
    let count = |start: &str| obj.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!((count("v "), count("vt "), count("vn "), count("f ")), (81, 81, 81, 128));
    let (_, waste) = obj.split_once("g waste\n").unwrap();
    assert_eq!(waste.lines().count(), 128 - inside);
    let stl = live.get(&format!("{job}/mesh.stl")).await.expect(200);
    assert_eq!(stl.body.len(), 84 + 50 * 128);
    let ply = live.get(&format!("{job}/mesh.ply")).await.expect(200);
    assert!(ply.body.starts_with(b"ply\nformat binary_little_endian 1.0\n"));
    let glb = live.get(&format!("{job}/mesh.glb")).await.expect(200);
    let document = gltf::Gltf::from_slice(&glb.body).unwrap();
    assert_eq!(document.meshes().next().unwrap().primitives().len(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_mesh_without_a_flattening_has_every_form_too() {
    let live = engine().await;
    let surface = live.surface(&bowl()).await;
    let job =
        live.job(&json!({ "kind": "triangulate", "surface": surface, "triangulation": { "grid": [5, 5] } })).await;
    let document = live.ended(&job).await;
    for link in document["results"].as_array().unwrap() {
        live.get(link["href"].as_str().unwrap()).await.expect(200);
    }
    let mesh = live.get(&format!("/v1/jobs/{job}/mesh.json")).await.expect(200).json();
    assert_eq!((&mesh["flat"], &mesh["strain_percent"], &mesh["part"]), (&Value::Null, &Value::Null, &Value::Null));
    let table = live.get(&format!("/v1/jobs/{job}/report.csv")).await.expect(200).text();
    assert!(table.lines().nth(1).unwrap().ends_with(",,,,,"), "{table}");
    // The other table of the same mesh is another one.
    let table = live.get(&format!("/v1/jobs/{job}/vertices.csv")).await.expect(200).text();
    assert!(table.starts_with("vertex,u,v,"), "{table}");
    live.get(&format!("/v1/jobs/{job}/pattern.dxf")).await.expect(404).problem("result-not-found");
}

#[tokio::test(flavor = "multi_thread")]
async fn accept_chooses_among_all_forms_and_what_there_is_not_is_listed() {
    let live = engine().await;
    let job = flattened(&live).await;
    let accepting = |path: &str, accept: &'static str| {
        let path = format!("{job}/{path}");
        let live = &live;
        async move { live.send(Method::GET, &path, |r| r.header("Accept", accept)).await }
    };
    for (path, accept, media) in [
        ("mesh", "*/*", "model/gltf-binary"),
        ("mesh", "model/*;q=0.5, model/stl", "model/stl"),
        ("mesh", "model/obj, application/json;q=0.9", "model/obj"),
        ("mesh", "application/x-ply", "application/x-ply"),
        ("report", "text/*", "text/csv"),
        ("report", "text/csv;q=0.5, application/json;q=0.4", "text/csv"),
        ("report", "*/*", "application/json"),
        ("mesh.ply", "application/json", "application/x-ply"),
    ] {
        let answer = accepting(path, accept).await.expect(200);
        assert_eq!(answer.header("content-type"), Some(media), "{path} {accept}");
        assert_eq!(answer.header("vary"), Some("accept, accept-encoding"));
    }
    for (path, form) in [("mesh", ".ply"), ("report", ".csv")] {
        let none = accepting(path, "application/pdf").await.expect(406).problem("not-acceptable");
        assert!(none["detail"].as_str().unwrap().contains(form), "{none}");
    }
    for path in ["mesh.step", "report.pdf"] {
        live.get(&format!("{job}/{path}")).await.expect(406).problem("not-acceptable");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn each_coding_has_its_own_tag_and_reads_back_to_the_same_bytes() {
    let live = engine().await;
    let job = flattened(&live).await;
    for form in ["mesh.glb", "mesh.obj", "mesh.stl", "mesh.ply", "mesh.json", "report.csv", "pattern.dxf"] {
        let path = format!("{job}/{form}");
        let plain = live.get(&path).await.expect(200);
        assert_eq!(plain.header("content-encoding"), None);
        let tag = plain.header("etag").unwrap().trim_matches('"').to_owned();
        for coding in ["gzip", "zstd"] {
            let answer = live.send(Method::GET, &path, |r| r.header("Accept-Encoding", coding)).await.expect(200);
            assert_eq!(answer.header("content-encoding"), Some(coding), "{form}");
            let own = format!("\"{tag}-{coding}\"");
            assert_eq!(answer.header("etag"), Some(own.as_str()));
            assert!(answer.decoded() == plain.body && answer.body.len() < plain.body.len(), "{form} {coding}");
            let same = live.send(Method::GET, &path, |r| r.header("If-None-Match", &own)).await.expect(304);
            assert_eq!(same.header("vary"), Some("accept, accept-encoding"));
        }
        let best = live.send(Method::GET, &path, |r| r.header("Accept-Encoding", "gzip, zstd;q=0.9, br")).await;
        assert_eq!(best.header("content-encoding"), Some("gzip"));
    }
    // Bytes as they are, where they are liked best: the compression layer leaves them so.
    let path = format!("{job}/mesh.ply");
    let plain = live.send(Method::GET, &path, |r| r.header("Accept-Encoding", "identity, gzip;q=0.5"));
    assert_eq!(plain.await.expect(200).header("content-encoding"), None);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_head_has_the_headers_of_the_answer_and_no_body() {
    let live = engine().await;
    let job = flattened(&live).await;
    for form in ["mesh.stl", "report.json", "pattern.svg", "mesh"] {
        let address = format!("{}{job}/{form}", live.address);
        let whole = live.client.get(&address).send().await.unwrap();
        let head = live.client.head(&address).send().await.unwrap();
        assert_eq!(head.status(), 200);
        for name in ["content-type", "content-length", "etag", "content-disposition", "vary", "cache-control"] {
            assert_eq!(head.headers().get(name), whole.headers().get(name), "{form} {name}");
        }
        assert!(head.headers().contains_key("content-length") && head.bytes().await.unwrap().is_empty());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_removed_job_is_gone_at_once_though_its_forms_were_in_memory() {
    let live = engine().await;
    for _ in 0..20 {
        let job = live.post("/v1/flatten", &plate()).await.expect(200).header("content-location").unwrap().to_owned();
        let path = format!("{job}/pattern.svg");
        let tag = live.get(&path).await.expect(200).header("etag").unwrap().to_owned();
        // Others read it while it is removed: what they see is the answer or that there is none, and nothing stays behind.
        let reader = async {
            for _ in 0..20 {
                let status = live.get(&path).await.status;
                assert!(status == 200 || status == 404, "{status}");
            }
        };
        let remover = async {
            live.delete(&job).await.expect(204);
            live.get(&path).await.expect(404).problem("job-not-found");
        };
        tokio::join!(reader, remover);
        live.get(&path).await.expect(404).problem("job-not-found");
        live.send(Method::GET, &path, |r| r.header("If-None-Match", &tag)).await.expect(404);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_has_not_ended_is_not_remembered_as_such() {
    let runner = Arc::new(crate::support::api::Held::<Sketch>::default());
    let live = Live::start(runner.clone(), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "gate" } })).await;
    let path = format!("/v1/jobs/{job}/report.json");
    live.get(&path).await.expect(409).problem("job-not-ended");
    let id = job.parse().unwrap();
    assert!(matches!(live.store.standing(id).await.unwrap(), Some(Standing::Open(_))));
    runner.gate.open();
    live.ended(&job).await;
    live.get(&path).await.expect(200);
    let Some(Standing::Ended(first)) = live.store.standing(id).await.unwrap() else { panic!("it has ended") };
    let Some(Standing::Ended(second)) = live.store.standing(id).await.unwrap() else { panic!("it has ended") };
    assert!(Arc::ptr_eq(&first, &second), "the second time it comes from memory");
}

/// A runner whose stored mesh cannot be read: writing any form of it is an error that can be counted.
struct Damaged(AtomicUsize);

impl Runner for Damaged {
    fn run(&self, task: &Task, observer: &dyn Observer) -> Result<Finished, Failed> {
        self.0.fetch_add(1, Ordering::Relaxed);
        let mut finished = Sketch.run(task, observer)?;
        finished.results[0] = planish::queue::NewResult::new("mesh", stored::MESH_MEDIA, b"PLNM".to_vec());
        Ok(finished)
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_form_that_cannot_be_written_is_an_error_each_time_and_holds_nobody_up() {
    let live = Live::start(Arc::new(Damaged(AtomicUsize::new(0))), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface })).await;
    live.ended(&job).await;
    let path = format!("/v1/jobs/{job}/mesh.glb");
    let asked = (0..8).map(|_| live.get(&path));
    for answer in futures_util::future::join_all(asked).await {
        answer.expect(500).problem("internal");
    }
    live.get(&format!("/v1/jobs/{job}/pattern.svg")).await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn many_who_ask_at_once_are_answered_from_one_writing() {
    let live = engine().await;
    let job = flattened(&live).await;
    assert_eq!(live.app.forms_written(), 0);
    let path = format!("{job}/mesh.obj");
    let answers = futures_util::future::join_all((0..50).map(|_| live.get(&path))).await;
    let (first, tag) = (answers[0].body.clone(), answers[0].header("etag").unwrap().to_owned());
    assert!(answers.into_iter().all(|answer| answer.expect(200).body == first));
    assert_eq!(live.app.forms_written(), 1);
    let packed = (0..50).map(|_| live.send(Method::GET, &path, |r| r.header("Accept-Encoding", "zstd")));
    for answer in futures_util::future::join_all(packed).await {
        assert_eq!(answer.header("content-encoding"), Some("zstd"));
    }
    assert_eq!(live.app.forms_written(), 2, "compressed once, from the form that was there");
    // Who has it already is told so without anything being written.
    live.send(Method::GET, &path, |r| r.header("If-None-Match", &tag)).await.expect(304);
    live.send(Method::GET, &format!("{job}/mesh.stl"), |r| r.header("If-None-Match", "*")).await.expect(304);
    assert_eq!(live.app.forms_written(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_cache_the_answers_are_the_same() {
    let live = Live::start(Arc::new(EngineRunner), &settings(|s| s.cache_mib = 0)).await;
    let job = flattened(&live).await;
    let path = format!("{job}/mesh.ply");
    let first = live.get(&path).await.expect(200);
    let second = live.get(&path).await.expect(200);
    assert_eq!((first.header("etag"), &first.body), (second.header("etag"), &second.body));
    let packed = live.send(Method::GET, &path, |r| r.header("Accept-Encoding", "zstd")).await.expect(200);
    assert_eq!(packed.header("content-encoding"), Some("zstd"));
    assert!(packed.decoded() == first.body);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pattern_beyond_what_plotters_count_has_no_hpgl_and_says_so() {
    let live = engine().await;
    let mut plate = plate();
    plate["units"] = json!("m");
    plate["control_points"] = json!([[[0, 0, 0], [0, 60, 0]], [[300, 0, 0], [300, 60, 0]]]);
    let answer = live.post("/v1/flatten?format=plt&wait=30", &plate).await.expect(404).problem("result-not-found");
    assert!(answer["detail"].as_str().unwrap().contains("plotter units"), "{answer}");
    live.post("/v1/flatten?format=dxf&wait=30", &plate).await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_failed_is_cut_by_only_where_that_is_allowed_and_says_so() {
    let live = engine().await;
    let surface = live.surface(&bowl()).await;
    let job = json!({
        "kind": "flatten", "surface": surface, "triangulation": { "grid": [9, 9] },
        "flattening": { "seed": "centre" }, "limits": { "stretch_percent": 0 }
    });
    let job = live.job(&job).await;
    assert_eq!(live.ended(&job).await["verdict"], "fail");
    let failed = format!("/v1/jobs/{job}");
    for form in ["dxf", "svg", "plt"] {
        let refused = live.get(&format!("{failed}/pattern.{form}")).await.expect(409).problem("pattern-rejected");
        assert!(refused["detail"].as_str().unwrap().contains("?allow=fail"), "{refused}");
        let given = live.get(&format!("{failed}/pattern.{form}?allow=fail")).await.expect(200);
        assert!(given.text().contains("REJECTED"), "{form}");
        live.get(&format!("{failed}/pattern.{form}")).await.expect(409);
        let wrong = live.get(&format!("{failed}/pattern.{form}?allow=all")).await.expect(400).problem("bad-request");
        assert!(wrong["detail"].as_str().unwrap().contains("`allow` must be fail"), "{wrong}");
    }
    live.get(&format!("{failed}/pattern")).await.expect(409).problem("pattern-rejected");
    for form in ["pattern.json", "report.json", "mesh.glb", "pattern.json?allow=fail"] {
        live.get(&format!("{failed}/{form}")).await.expect(200);
    }
    live.get(&format!("{failed}/report.json?allow=fail")).await.expect(400).problem("bad-request");
    let found = live.get("/v1/feed?verdict=fail").await.expect(200).json();
    assert_eq!(found["items"].as_array().unwrap().len(), 1);

    let passed = flattened(&live).await;
    let plain = live.get(&format!("{passed}/pattern.dxf")).await.expect(200);
    let allowed = live.get(&format!("{passed}/pattern.dxf?allow=fail")).await.expect(200);
    assert_eq!(plain.header("etag"), allowed.header("etag"));
    assert!(plain.body == allowed.body && !plain.text().contains("REJECTED"));

    let body = json!({ "surface": bowl(), "job": { "triangulation": { "grid": [9, 9] }, "flattening": { "seed": "centre" }, "limits": { "stretch_percent": 0 } } });
    let refused = live.post("/v1/flatten?format=svg", &body).await.expect(409);
    assert_eq!(refused.header("planish-verdict"), Some("fail"));
    assert!(refused.header("planish-job").is_some());
    refused.problem("pattern-rejected");
    let given = live.post("/v1/flatten?format=svg&allow=fail", &body).await.expect(200);
    assert!(given.text().contains("REJECTED"));
}
