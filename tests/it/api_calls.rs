//! The calls of the API as clients make them: polling, waiting, forms, the one-call form, lists.

use std::sync::Arc;

use planish::queue::EngineRunner;
use reqwest::Method;
use serde_json::{Value, json};

use crate::support::api::{Held, Live, Sketch, plate, settings};

async fn sketching() -> Live {
    Live::start(Arc::new(Held::<Sketch>::default()), &settings(|_| {})).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_surface_goes_in_and_a_pattern_of_its_true_size_comes_out() {
    let live = Live::start(Arc::new(EngineRunner), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "triangulation": { "grid": [6, 6] } })).await;
    let document = live.ended(&job).await;
    assert_eq!(document["state"], "succeeded", "{document:#}");
    assert_eq!(document["labels"], json!({ "name": "plate", "part_number": "4711-A" }));
    let svg = live.get(&format!("/v1/jobs/{job}/pattern.svg")).await.expect(200);
    assert!(svg.text().contains("<svg"));
    assert_eq!(svg.header("content-disposition"), Some("inline; filename=\"4711-A.svg\""));
    let report = live.get(&format!("/v1/jobs/{job}/report")).await.expect(200).json();
    let area = report["pattern"]["area_mm2"].as_f64().unwrap();
    assert!((area - (6000.0 - 20.0 * 12.0)).abs() < 1e-6, "{area}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_same_input_gives_the_same_bytes_and_tags() {
    let live = Live::start(Arc::new(EngineRunner), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let mut first: Vec<(String, Vec<u8>)> = Vec::new();
    for _ in 0..2 {
        let job =
            live.job(&json!({ "kind": "flatten", "surface": surface, "triangulation": { "grid": [9, 7] } })).await;
        live.ended(&job).await;
        let mut bytes = Vec::new();
        for form in ["mesh.glb", "mesh.json", "pattern.svg", "pattern.dxf", "pattern.json", "report.json"] {
            let answer = live.get(&format!("/v1/jobs/{job}/{form}")).await.expect(200);
            bytes.push((answer.header("etag").unwrap().to_owned(), answer.body));
        }
        if first.is_empty() {
            first = bytes;
        } else {
            assert!(first == bytes);
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn one_call_takes_a_surface_and_gives_the_pattern() {
    let live = sketching().await;
    // What curl sends: the type of a form, and anything accepted.
    let answer = live
        .send(Method::POST, "/v1/flatten?format=dxf&set=flattening.seed=centre&set=labels.order=2231", |r| {
            r.header("Content-Type", "application/x-www-form-urlencoded").body(plate().to_string())
        })
        .await
        .expect(200);
    assert_eq!(answer.header("content-type"), Some("image/vnd.dxf"));
    assert_eq!(answer.header("planish-verdict"), Some("unchecked"));
    assert!(answer.text().contains("SECTION"));
    let job = live.get(&format!("/v1/jobs/{}", answer.header("planish-job").unwrap())).await.expect(200).json();
    assert_eq!(job["parameters"]["flattening"]["seed"], "centre");
    assert_eq!(job["labels"]["order"], "2231");
    // Without a type at all, by Accept, and with the job in the body.
    let body =
        json!({ "surface": plate(), "job": { "labels": { "order": "7" }, "triangulation": { "grid": [3, 3] } } });
    let answer = live
        .send(Method::POST, "/v1/flatten", |r| r.header("Accept", "application/json").body(body.to_string()))
        .await
        .expect(200);
    assert_eq!(answer.json()["bounding_box_mm"], json!([100.0, 60.0]));
    let job = live.get(answer.header("content-location").unwrap()).await.expect(200).json();
    assert_eq!(job["parameters"]["triangulation"]["grid"], json!([3, 3]));
    // The surface is the same as if it had been sent by itself.
    assert_eq!(live.post("/v1/surfaces", &plate()).await.json()["id"].as_str().unwrap().len(), 40);
}

#[tokio::test(flavor = "multi_thread")]
async fn one_call_that_takes_too_long_says_where_the_job_is() {
    let runner = Arc::new(Held::<Sketch>::default());
    let live = Live::start(runner.clone(), &settings(|_| {})).await;
    let answer = live
        .send(Method::POST, "/v1/flatten?set=labels.test=gate", |r| r.header("Prefer", "wait=0").json(&plate()))
        .await
        .expect(202);
    assert_eq!(answer.header("preference-applied"), Some("wait=0"));
    let address = answer.header("location").unwrap().to_owned();
    assert_eq!(address, format!("/v1/jobs/{}", answer.header("planish-job").unwrap()));
    runner.gate.open();
    let job = live.get(&format!("{address}?wait=60")).await.expect(200).json();
    assert_eq!(job["state"], "succeeded");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_failed_job_is_a_good_answer_with_a_problem_inside() {
    let live = sketching().await;
    let surface = live.surface(&plate()).await;
    for (test, code) in [("fail", "parameter"), ("panic", "panicked")] {
        let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": test } })).await;
        let document = live.ended(&job).await;
        assert_eq!(document["state"], "failed", "{document:#}");
        assert_eq!(document["problem"]["code"], code, "{document:#}");
        assert_eq!(document["problem"]["instance"], format!("/v1/jobs/{job}"));
        assert_eq!(document["problem"]["type"], "/problems/job-failed");
        let none = live.get(&format!("/v1/jobs/{job}/pattern.dxf")).await.expect(404).problem("result-not-found");
        assert_eq!(none["code"], code);
    }
    let answer = live.post("/v1/flatten?set=labels.test=fail", &plate()).await.expect(422);
    assert_eq!(answer.problem("job-failed")["code"], "parameter");
    assert!(answer.header("planish-job").is_some());
    // The panic of a job is that job's alone.
    live.post("/v1/flatten", &plate()).await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn polling_with_a_tag_costs_a_header_until_the_job_moves() {
    let runner = Arc::new(Held::<Sketch>::default());
    let live = Live::start(runner.clone(), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "gate" } })).await;
    let path = format!("/v1/jobs/{job}");
    let mut tag = None;
    // The job starts and its progress is written; then nothing moves.
    for _ in 0..1000 {
        let answer = live.get(&path).await.expect(200);
        let now = answer.header("etag").unwrap().to_owned();
        if answer.json()["state"] == "running" && tag.as_ref() == Some(&now) {
            break;
        }
        tag = Some(now);
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    let tag = tag.unwrap();
    let unchanged = live.send(Method::GET, &path, |r| r.header("If-None-Match", &tag)).await.expect(304);
    assert_eq!(unchanged.header("retry-after"), Some("1"));
    let waiting = live.send(Method::GET, &path, |r| r.header("If-None-Match", &tag).header("Prefer", "wait=60"));
    let (answer, ()) = tokio::join!(waiting, async { runner.gate.open() });
    assert_eq!(answer.status, 200);
    assert_eq!(answer.header("preference-applied"), Some("wait=60"));
    assert_eq!(answer.json()["state"], "succeeded");
    assert_eq!(answer.header("retry-after"), None);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_form_of_a_result_follows_accept_and_suffix() {
    let live = sketching().await;
    let answer = live.post("/v1/flatten", &plate()).await.expect(200);
    let job = answer.header("content-location").unwrap().to_owned();
    let accepting = |path: &str, accept: &'static str| {
        let path = format!("{job}/{path}");
        let live = &live;
        async move { live.send(Method::GET, &path, |r| r.header("Accept", accept)).await }
    };
    assert_eq!(accepting("pattern", "image/vnd.dxf").await.header("content-type"), Some("image/vnd.dxf"));
    assert_eq!(accepting("pattern", "text/html,*/*;q=0.8").await.header("content-type"), Some("image/svg+xml"));
    assert_eq!(accepting("mesh", "application/json").await.header("content-type"), Some("application/json"));
    accepting("pattern", "application/pdf").await.expect(406).problem("not-acceptable");
    // A suffix goes before Accept.
    assert_eq!(accepting("pattern.dxf", "image/svg+xml").await.header("content-type"), Some("image/vnd.dxf"));
    let none = live.get(&format!("{job}/pattern.pdf")).await.expect(406).problem("not-acceptable");
    assert!(none["detail"].as_str().unwrap().contains(".dxf"), "{none}");
    live.post("/v1/flatten?format=pdf", &plate()).await.expect(406).problem("not-acceptable");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_compressed_answer_has_a_tag_of_its_own_which_is_known_again() {
    let live = sketching().await;
    let (plain, packed) = (live.get("/openapi.yaml").await.expect(200), "/openapi.yaml");
    let tag = plain.header("etag").unwrap().trim_matches('"').to_owned();
    for coding in ["gzip", "zstd"] {
        let answer = live.send(Method::GET, packed, |r| r.header("Accept-Encoding", coding)).await.expect(200);
        assert_eq!(answer.header("content-encoding"), Some(coding));
        assert!(answer.body.len() < plain.body.len() / 2);
        let own = format!("\"{tag}-{coding}\"");
        assert_eq!(answer.header("etag"), Some(own.as_str()));
        live.send(Method::GET, packed, |r| r.header("If-None-Match", &own)).await.expect(304);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_of_a_list_show_each_job_once_and_keep_their_filters() {
    let live = sketching().await;
    let surface = live.surface(&plate()).await;
    let mut jobs = Vec::new();
    for i in 0..7 {
        let order = if i % 2 == 0 { "even" } else { "odd" };
        jobs.push(live.job(&json!({ "kind": "triangulate", "surface": surface, "labels": { "order": order } })).await);
    }
    let mut listed = Vec::new();
    let mut next = Some("/v1/jobs?limit=2&label.order=even".to_owned());
    while let Some(path) = next {
        let page = live.get(&path).await.expect(200).json();
        listed.extend(page["items"].as_array().unwrap().iter().map(|job| job["id"].as_str().unwrap().to_owned()));
        next = page["next"].as_str().map(str::to_owned);
    }
    let expected: Vec<String> = jobs.iter().step_by(2).rev().cloned().collect();
    assert_eq!(listed, expected);
    let page = live.get("/v1/jobs?limit=2").await.json();
    let cursor = page["next"].as_str().unwrap().split("cursor=").nth(1).unwrap().to_owned();
    live.get(&format!("/v1/jobs?kind=flatten&cursor={cursor}")).await.expect(400).problem("bad-request");
    live.get("/v1/jobs?cursor=nonsense").await.expect(400).problem("bad-request");
    let surfaces = live.get("/v1/surfaces").await.json();
    assert_eq!((surfaces["items"].as_array().unwrap().len(), &surfaces["next"]), (1, &Value::Null));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_idempotency_key_stands_for_one_request() {
    let live = sketching().await;
    let surface = live.surface(&plate()).await;
    let body = json!({ "kind": "triangulate", "surface": surface });
    let send = |key: &'static str, body: Value| {
        let live = &live;
        async move { live.send(Method::POST, "/v1/jobs", |r| r.header("Idempotency-Key", key).json(&body)).await }
    };
    let first = send("order-1", body.clone()).await.expect(202).json()["id"].clone();
    assert_eq!(send("order-1", body.clone()).await.expect(202).json()["id"], first);
    assert_ne!(send("order-2", body.clone()).await.expect(202).json()["id"], first);
    send("order-1", json!({ "kind": "flatten", "surface": surface })).await.expect(422).problem("key-reused");
    send("", body).await.expect(400).problem("bad-request");
}

#[tokio::test(flavor = "multi_thread")]
async fn fifty_identical_requests_at_once_make_one_thing() {
    let live = Arc::new(sketching().await);
    let surface = live.surface(&plate()).await;
    let other = {
        let mut other = plate();
        other["name"] = json!("another plate");
        other
    };
    let job = json!({ "kind": "flatten", "surface": surface, "labels": { "from": "jobs" } });
    let calls = [("/v1/jobs", job), ("/v1/flatten?set=labels.from=flatten", plate()), ("/v1/surfaces", other.clone())];
    for (path, body) in calls {
        let mut asked = tokio::task::JoinSet::new();
        for _ in 0..50 {
            let (live, body) = (live.clone(), body.clone());
            asked.spawn(async move {
                let answer =
                    live.send(Method::POST, path, |r| r.header("Idempotency-Key", "\"one\"").json(&body)).await;
                let id = match answer.header("planish-job") {
                    Some(id) => id.to_owned(),
                    None => answer.json()["id"].as_str().unwrap().to_owned(),
                };
                (answer.status.as_u16(), id)
            });
        }
        let answers = asked.join_all().await;
        assert!(answers.iter().all(|(_, id)| *id == answers[0].1), "{path}: {answers:?}");
        let created = answers.iter().filter(|(status, _)| *status == 201).count();
        assert_eq!(created, usize::from(path == "/v1/surfaces"), "{path}: {answers:?}");
    }
    for from in ["jobs", "flatten"] {
        let listed = live.get(&format!("/v1/jobs?label.from={from}")).await.expect(200).json();
        assert_eq!(listed["items"].as_array().unwrap().len(), 1, "{from}");
    }
    assert_eq!(live.get("/v1/surfaces").await.json()["items"].as_array().unwrap().len(), 2);
    // Another request under the same key: another surface, another setting. How the answer is to look does not matter.
    let again = |path: &'static str, body: Value| {
        let live = live.clone();
        async move { live.send(Method::POST, path, |r| r.header("Idempotency-Key", "one").json(&body)).await }
    };
    again("/v1/flatten?set=labels.from=flatten", other).await.expect(422).problem("key-reused");
    again("/v1/flatten?set=labels.from=elsewhere", plate()).await.expect(422).problem("key-reused");
    again("/v1/flatten?set=labels.from=flatten&format=dxf&wait=9", plate()).await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn one_call_takes_a_form_of_two_parts_in_any_order() {
    let live = sketching().await;
    let part = |name: &str, text: &str, more: &str| {
        format!("--b0und\r\nContent-Disposition: form-data; name=\"{name}\"{more}\r\n\r\n{text}\r\n")
    };
    let surface = part("surface", &plate().to_string(), "; filename=\"p.json\"\r\nContent-Type: application/json");
    let job = part("job", r#"{ "labels": { "order": "7" } }"#, "");
    let send = |body: String| {
        let live = &live;
        async move {
            live.send(Method::POST, "/v1/flatten?format=svg", |r| {
                r.header("Content-Type", "multipart/form-data; boundary=b0und").body(format!("{body}--b0und--\r\n"))
            })
            .await
        }
    };
    for body in [format!("{surface}{job}"), format!("{job}{surface}")] {
        let answer = send(body).await.expect(200);
        assert_eq!(answer.header("content-type"), Some("image/svg+xml"));
        assert_eq!(answer.header("planish-verdict"), Some("unchecked"));
        let job = live.get(answer.header("content-location").unwrap()).await.expect(200).json();
        assert_eq!((&job["labels"]["order"], job["id"].as_str()), (&json!("7"), answer.header("planish-job")));
    }
    let answer = send(format!("{surface}{}{}", part("colour", "red", ""), part("job", r#"{ "sed": 1 }"#, ""))).await;
    assert_eq!(answer.expect(422).pointers(), ["/colour", "/job/sed"]);
    assert_eq!(send(job.clone()).await.expect(422).pointers(), ["/surface"]);
    send(format!("{surface}{surface}")).await.expect(400).problem("bad-request");
    send(format!("{surface}{}", part("job", "{", ""))).await.expect(400).problem("invalid-json");
    send(format!("{}{job}", part("surface", "{", ""))).await.expect(400).problem("invalid-json");
    let long = format!("{{\"labels\": {{\"a\": \"{}\"}}}}", "x".repeat(300_000));
    send(format!("{surface}{}", part("job", &long, ""))).await.expect(413).problem("body-too-large");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_metrics_count_what_was_done_by_its_route_and_kind() {
    let runner = Arc::new(Held::<Sketch>::default());
    let live = Live::start(runner.clone(), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let ask = |kind: &str, test: &str| {
        let job = json!({ "kind": kind, "surface": surface, "labels": { "test": test } });
        let live = &live;
        async move { live.job(&job).await }
    };
    for (kind, test) in [("flatten", ""), ("flatten", "fail"), ("triangulate", "")] {
        let job = ask(kind, test).await;
        live.ended(&job).await;
    }
    let waits = ask("flatten", "gate").await;
    while live.get(&format!("/v1/jobs/{waits}")).await.json()["state"] != "running" {}
    for path in ["/nowhere", "/nowhere/else", "/v1/jobs/x"] {
        live.get(path).await.expect(404);
    }
    let answer = live.get("/metrics").await.expect(200);
    let text = answer.text();
    for line in [
        r#"planish_jobs_ended_total{kind="flatten",state="succeeded"} 1"#,
        r#"planish_jobs_ended_total{kind="flatten",state="failed"} 1"#,
        r#"planish_job_duration_seconds_count{kind="triangulate"} 1"#,
        r#"planish_jobs{kind="flatten",state="running"} 1"#,
        r#"planish_jobs{kind="flatten",state="queued"} 0"#,
        r#"planish_http_requests_total{method="POST",route="/v1/surfaces",status="201"} 1"#,
        r#"planish_http_requests_total{method="GET",route="/v1/jobs/{job}",status="404"} 1"#,
        r#"planish_http_requests_total{method="GET",route="other",status="404"} 2"#,
        "planish_workers_stuck 0",
        "planish_store_readable 1",
    ] {
        assert!(text.lines().any(|l| l == line), "{line} is not in\n{text}");
    }
    let value = |name: &str| {
        let line = text.lines().find(|l| l.split(' ').next() == Some(name)).unwrap_or_else(|| panic!("no {name}"));
        line.split(' ').nth(1).unwrap().parse::<f64>().unwrap()
    };
    assert!(value("planish_database_bytes") >= 4096.0);
    // A surface, four jobs and three ends, at the least.
    assert!(value("planish_store_write_duration_seconds_count") >= 8.0);
    assert!(value("process_start_time_seconds") > 1.7e9);
    assert!(!text.contains(&waits) && !text.contains(&surface), "an id became a label");
    runner.gate.open();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_packed_surface_is_the_same_surface() {
    use tokio::io::AsyncReadExt as _;
    let live = sketching().await;
    let plain = live.post("/v1/surfaces", &plate()).await.expect(201).json();
    let text = plate().to_string();
    let mut packed = Vec::new();
    async_compression::tokio::bufread::ZstdEncoder::new(text.as_bytes()).read_to_end(&mut packed).await.unwrap();
    let answer = live
        .send(Method::POST, "/v1/surfaces", |r| {
            r.header("Content-Encoding", "zstd").header("Content-Type", "application/json").body(packed)
        })
        .await
        .expect(200);
    assert_eq!(answer.json()["id"], plain["id"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_surface_read_in_other_units_is_another_surface() {
    let live = sketching().await;
    let mm = live.post("/v1/surfaces", &plate()).await.expect(201).json();
    let inches = live.post("/v1/surfaces?units=in", &plate()).await.expect(201).json();
    assert_ne!(mm["id"], inches["id"]);
    assert_eq!(mm["bounding_box_mm"], json!([[0.0, 0.0, 0.0], [100.0, 60.0, 0.0]]));
    let far = inches["bounding_box_mm"][1][0].as_f64().unwrap();
    assert!((far - 2540.0).abs() < 1e-9, "{far}");
}
