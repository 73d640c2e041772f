//! Bad input of every kind: each gives the documented problem, with all its faults at once, and nothing is stored.

use std::sync::Arc;

use planish::store::{JobFilter, State};
use reqwest::Method;
use serde_json::{Value, json};

use crate::support::api::{Held, Live, Sketch, plate, settings};

async fn live() -> Live {
    Live::start(Arc::new(Held::<Sketch>::default()), &settings(|s| s.max_body_mib = 1)).await
}

/// Nothing was stored.
async fn nothing_stored(live: &Live) {
    assert_eq!(live.store.surfaces(None, 10).await.unwrap(), []);
    assert_eq!(live.store.jobs(&JobFilter::default(), None, 10).await.unwrap(), []);
}

#[tokio::test(flavor = "multi_thread")]
async fn text_that_is_no_json_is_told_by_line_and_column() {
    let live = live().await;
    for path in ["/v1/surfaces", "/v1/flatten", "/v1/jobs"] {
        let answer = live.post_bytes(path, "{\n  \"units\": \"mm\",\n  \"degree_u\": }").await.expect(400);
        let problem = answer.problem("invalid-json");
        assert!(problem["detail"].as_str().unwrap().starts_with("Line 3, column"), "{problem:#}");
    }
    let body = format!("{{ \"surface\": {}, \"job\": {{ }}", plate());
    live.post_bytes("/v1/flatten", body).await.expect(400).problem("invalid-json");
    // Nested deeper than anything real: a fault, not a crash.
    let deep = format!("{{\"extra\":{}{}}}", "[".repeat(100_000), "]".repeat(100_000));
    let answer = live.post_bytes("/v1/surfaces", deep).await;
    assert!(answer.status == 400 || answer.status == 422, "{}", answer.text());
    nothing_stored(&live).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn all_faults_of_a_surface_come_at_once() {
    let live = live().await;
    let mut surface = plate();
    surface.as_object_mut().unwrap().remove("units");
    surface["knots_u"] = json!([0, 1, 0, 1]);
    surface["colour"] = json!("red");
    surface["trims"][1][0]["points"][2] = json!([0.6, "x"]);
    let answer = live.post("/v1/surfaces", &surface).await.expect(422);
    answer.problem("invalid-surface");
    let pointers = answer.pointers();
    for expected in ["/units", "/knots_u", "/colour", "/trims/1/0/points/2/1"] {
        assert!(pointers.iter().any(|p| p.starts_with(expected)), "{expected} in {pointers:?}");
    }
    nothing_stored(&live).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn loops_that_bound_nothing_are_told_by_their_place() {
    let live = live().await;
    let mut surface = plate();
    surface["trims"] = json!([
        [{ "points": [[0.1, 0.1], [0.9, 0.9], [0.9, 0.1], [0.1, 0.9], [0.1, 0.1]] }],
        [{ "points": [[0.2, 0.2], [0.3, 0.2], [0.3, 1.5], [0.2, 0.2]] }]
    ]);
    let answer = live.post("/v1/surfaces", &surface).await.expect(422);
    let problem = answer.problem("invalid-surface");
    assert!(problem["place"]["loop"].is_number(), "{problem:#}");
    let pointers = answer.pointers();
    assert!(pointers.iter().any(|p| p.starts_with("/trims/0")), "{pointers:?}");
    assert!(pointers.iter().any(|p| p.starts_with("/trims/1")), "{pointers:?}");
    nothing_stored(&live).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn all_faults_of_a_job_come_at_once() {
    let live = live().await;
    let job = json!({
        "kind": "fold", "surface": "nowhere",
        "triangulation": { "grid": [1, 9], "tolerance": { "chord": -1 } },
        "flattening": { "seed": { "uv": [0.5, 0.5] } },
        "placement": { "to_deg": 1000 },
        "labels": { "a b": "x" }
    });
    let answer = live.post("/v1/jobs", &job).await.expect(422);
    answer.problem("invalid-parameters");
    let expected = [
        "/kind",
        "/labels/a b",
        "/placement/to_deg",
        "/surface",
        "/triangulation/grid/0",
        "/triangulation/tolerance",
        "/triangulation/tolerance/chord",
    ];
    assert_eq!(answer.pointers(), expected);
    let wrong = json!({ "kind": 3, "sruface": "x", "flattening": { "sed": 1, "readings": { "order": "up" } } });
    let answer = live.post("/v1/jobs", &wrong).await.expect(422);
    assert_eq!(answer.pointers(), ["/flattening/readings/order", "/flattening/sed", "/kind", "/sruface", "/surface"]);
    assert_eq!(live.post("/v1/jobs", &json!([])).await.expect(422).pointers(), [""]);
    nothing_stored(&live).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_seed_outside_the_surface_is_refused_before_the_job_is_queued() {
    let live = live().await;
    let surface = live.surface(&plate()).await;
    let job = json!({ "kind": "flatten", "surface": surface, "flattening": { "seed": { "uv": [0.5, 1.5] } } });
    assert_eq!(live.post("/v1/jobs", &job).await.expect(422).pointers(), ["/flattening/seed/uv/1"]);
    assert_eq!(live.store.count(State::Queued).await.unwrap(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_one_call_form_tells_the_faults_of_surface_and_job_together() {
    let live = live().await;
    let mut surface = plate();
    surface["degree_u"] = json!(0);
    let body = json!({ "surface": surface, "job": { "triangulation": { "phase": 7 }, "colour": 1 }, "other": 2 });
    let answer = live.post("/v1/flatten?set=limits.stretch_percent=-1", &body).await.expect(422);
    let pointers = answer.pointers();
    for expected in ["/surface/degree_u", "/job/colour", "/other"] {
        assert!(pointers.iter().any(|p| p == expected), "{expected} in {pointers:?}");
    }
    let answer = live.post("/v1/flatten?set=flattening.sed=centre&set=nonsense", &plate()).await.expect(422);
    assert_eq!(answer.pointers(), ["", "/flattening/sed"]);
    nothing_stored(&live).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn bodies_of_other_types_and_lengths_are_refused() {
    let live = live().await;
    for path in ["/v1/surfaces", "/v1/flatten", "/v1/jobs"] {
        let typed = |name: &'static str, value: &'static str| {
            let live = &live;
            async move { live.send(Method::POST, path, |r| r.header(name, value).body("{}")).await }
        };
        typed("Content-Type", "model/step").await.expect(415).problem("unsupported-media-type");
        let parts = typed("Content-Type", "multipart/form-data; boundary=x").await;
        parts.expect(if path == "/v1/flatten" { 400 } else { 415 });
        let coded = typed("Content-Encoding", "br").await.expect(415);
        assert_eq!(coded.header("accept-encoding"), Some("gzip, zstd"));
        coded.problem("unsupported-media-type");
        typed("Content-Encoding", "gzip").await.expect(400).problem("bad-request");
        let cut_off = if path == "/v1/jobs" { 415 } else { 422 };
        live.post_bytes(path, "glTF\u{2}").await.expect(cut_off);
        live.post_bytes(path, "").await.expect(415);
        // One with its length announced, one that turns out too long.
        let long = format!("{{{}}}", " ".repeat(1 << 20));
        live.post_bytes(path, long.clone()).await.expect(413).problem("body-too-large");
        let pieces =
            futures_util::stream::iter(long.into_bytes().chunks(65_536).map(<[u8]>::to_vec).collect::<Vec<_>>());
        let pieces = futures_util::StreamExt::map(pieces, Ok::<_, std::io::Error>);
        let body =
            reqwest::Body::wrap(http_body_util::StreamBody::new(futures_util::StreamExt::map(pieces, |piece| {
                piece.map(|bytes| hyper::body::Frame::data(bytes::Bytes::from(bytes)))
            })));
        live.post_bytes(path, body).await.expect(413).problem("body-too-large");
    }
    nothing_stored(&live).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn addresses_methods_and_queries_that_do_not_exist_are_told_so() {
    let live = live().await;
    for path in ["/", "/v1", "/v1/jobs/", "/v2/jobs", "/v1/jobs/x/y", "/v1/surfaces/x/y/z", "/problems/none"] {
        live.get(path).await.expect(404);
    }
    for id in ["x", "..%2f..%2fetc", "00000000-0000-0000-0000-000000000000", "%00"] {
        live.get(&format!("/v1/jobs/{id}")).await.expect(404).problem("job-not-found");
        live.get(&format!("/v1/surfaces/{id}")).await.expect(404).problem("surface-not-found");
        live.delete(&format!("/v1/surfaces/{id}")).await.expect(404);
        live.get(&format!("/v1/jobs/{id}/pattern.svg")).await.expect(404).problem("job-not-found");
    }
    let wrong = live.send(Method::PUT, "/v1/jobs", |r| r).await.expect(405);
    wrong.problem("method-not-allowed");
    let allowed = wrong.header("allow").unwrap();
    assert!(allowed.contains("GET") && allowed.contains("POST"), "{allowed}");
    let asked = live.send(Method::OPTIONS, "/v1/jobs", |r| r).await.expect(204);
    assert_eq!(asked.header("allow"), Some(allowed));
    live.send(Method::OPTIONS, "/nowhere", |r| r).await.expect(404);
    for path in ["/v1/jobs", "/healthz", "/openapi.yaml", "/v1/feed", "/metrics"] {
        live.send(Method::HEAD, path, |r| r).await.expect(200);
    }
    live.send(Method::HEAD, "/v1/jobs/x", |r| r).await.expect(404);
    for path in
        ["/v1/jobs?stat=queued", "/v1/jobs?state=lost", "/v1/jobs?limit=0", "/v1/surfaces?limit=x", "/problems?a=b"]
    {
        live.get(path).await.expect(400).problem("bad-request");
    }
    live.post("/v1/surfaces?units=furlong", &plate()).await.expect(400).problem("bad-request");
    live.post("/v1/flatten?wait=soon", &plate()).await.expect(400).problem("bad-request");
    nothing_stored(&live).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn damaged_bodies_never_become_a_fault_of_the_service() {
    let live = live().await;
    let text = json!({ "surface": plate(), "job": { "flattening": { "seed": "centre" } } }).to_string().into_bytes();
    for i in 0..text.len() {
        let mut cut = text.clone();
        cut.truncate(i);
        let mut flipped = text.clone();
        flipped[i] ^= 1 << (i % 7);
        for body in [cut, flipped] {
            let answer = live.post_bytes("/v1/flatten?wait=0", body).await;
            assert!(!answer.status.is_server_error(), "{i}: {}", answer.text());
        }
    }
    live.get("/readyz").await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_refuses_honestly_and_what_was_taken_is_done() {
    let runner = Arc::new(Held::<Sketch>::default());
    let live = Live::start(runner.clone(), &settings(|s| s.max_queued = 5)).await;
    let surface = live.surface(&plate()).await;
    let mut taken = Vec::new();
    let mut refused = 0;
    for _ in 0..30 {
        let job = json!({ "kind": "triangulate", "surface": surface, "labels": { "test": "gate" } });
        let answer = live.post("/v1/jobs", &job).await;
        if answer.status == 202 {
            taken.push(answer.json()["id"].as_str().unwrap().to_owned());
        } else {
            answer.problem("queue-full");
            assert!(answer.header("retry-after").is_some());
            refused += 1;
        }
    }
    assert!(taken.len() >= 5 && refused >= 20, "{} taken, {refused} refused", taken.len());
    runner.gate.open();
    for job in &taken {
        assert_eq!(live.ended(job).await["state"], "succeeded");
    }
    assert_eq!(live.store.count(State::Succeeded).await.unwrap(), taken.len() as u64);
}

#[tokio::test(flavor = "multi_thread")]
async fn who_waits_is_answered_when_the_service_shuts_down() {
    let runner = Arc::new(Held::<Sketch>::default());
    let live = Live::start(runner.clone(), &settings(|_| {})).await;
    let surface = live.surface(&plate()).await;
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "gate" } })).await;
    let path = format!("/v1/jobs/{job}?wait=60");
    let (answer, ()) = tokio::join!(live.get(&path), async { live.draining.cancel() });
    assert!(answer.expect(200).json()["finished_at"].is_null());
    live.get("/readyz").await.expect(503).problem("draining");
    live.post("/v1/flatten", &plate()).await.expect(503).problem("draining");
    live.get("/healthz").await.expect(200);
    runner.gate.open();
    assert!(live.queue.is_open());
}

#[tokio::test(flavor = "multi_thread")]
async fn an_id_that_a_client_sends_comes_back_and_a_strange_one_does_not() {
    let live = live().await;
    let answer = live.send(Method::GET, "/healthz", |r| r.header("X-Request-Id", "abc-123")).await;
    assert_eq!(answer.header("x-request-id"), Some("abc-123"));
    let lost = live.send(Method::GET, "/v1/jobs/x", |r| r.header("X-Request-Id", "abc-124")).await.expect(404);
    assert_eq!(lost.problem("job-not-found")["request_id"], "abc-124");
    let answer = live.send(Method::GET, "/healthz", |r| r.header("X-Request-Id", "a\"b c")).await;
    assert_eq!(answer.header("x-request-id").map(str::len), Some(36));
    let value: Value = answer.json();
    assert_eq!(value, json!({ "status": "alive" }));
}
