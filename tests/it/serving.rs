//! The program as it is deployed: signals, restarts, memory, and the commands that work on files.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::{Value, json};

use crate::support::api::plate;
use crate::support::contract::judge;
use crate::support::service::{Service, program};

/// Longest time that an end may take which is to come at once, on a laden machine.
const AT_ONCE: Duration = Duration::from_secs(20);

fn part(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/parts").join(name)
}

/// A bump whose every seed is tried: the work of minutes.
fn long_job(surface: &str) -> Value {
    json!({
        "kind": "flatten", "surface": surface,
        "triangulation": { "method": "grid", "grid": [340, 340] },
        "flattening": { "seed": "optimum", "readings": { "check": "final" } }
    })
}

fn bump() -> Value {
    json!({
        "units": "mm", "degree_u": 2, "degree_v": 2,
        "knots_u": [0, 0, 0, 1, 1, 1], "knots_v": [0, 0, 0, 1, 1, 1],
        "control_points": [
            [[0, 0, 0], [0, 50, 0], [0, 100, 0]],
            [[50, 0, 0], [50, 50, 20], [50, 100, 0]],
            [[100, 0, 0], [100, 50, 0], [100, 100, 0]]
        ]
    })
}

/// Stores the bump, queues the long job, and waits until it runs. Gives the job's address.
async fn running_job(service: &Service) -> String {
    let surface = service.post("/v1/surfaces", &bump()).await.json()["id"].as_str().unwrap().to_owned();
    let job = service.post("/v1/jobs", &long_job(&surface)).await.expect(202);
    let address = job.header("location").unwrap().to_owned();
    for _ in 0..3000 {
        let job = service.get(&address).await.json();
        match job["state"].as_str().unwrap() {
            "running" => return address,
            "queued" => tokio::time::sleep(Duration::from_millis(10)).await,
            _ => panic!("the long job has ended: {job:#}"),
        }
    }
    panic!("the long job does not start");
}

#[tokio::test(flavor = "multi_thread")]
async fn on_sigterm_it_takes_nothing_new_gives_jobs_their_grace_and_loses_no_attempt() {
    let data = tempfile::tempdir().unwrap();
    let service = Service::start(data.path(), &["--grace-s", "3"]);
    let job = running_job(&service).await;
    let poll = format!("{job}?wait=60");
    let polling = service.get(&poll);
    let stopping = async {
        service.signal("TERM");
        // Readiness falls while the grace runs, and nothing new is taken.
        loop {
            let ready = service.get("/readyz").await;
            if ready.status == 503 {
                ready.problem("draining");
                break;
            }
        }
        let refused = service.post("/v1/surfaces", &plate()).await.expect(503);
        refused.problem("draining");
        assert!(refused.header("retry-after").is_some());
        service.get("/healthz").await.expect(200);
    };
    // Who waits for the job is answered, not cut off.
    let (polled, ()) = tokio::join!(polling, stopping);
    assert_eq!(polled.expect(200).json()["state"], "running");
    let (status, took) = service.ended();
    assert_eq!(status.code(), Some(0));
    assert!(took < AT_ONCE, "{took:?}");

    let service = Service::start(data.path(), &["--grace-s", "0"]);
    let mut document = service.get(&job).await.expect(200).json();
    while document["state"] == "queued" {
        assert_eq!(document["attempts"], 0, "{document:#}");
        document = service.get(&job).await.json();
    }
    assert_eq!((&document["state"], &document["attempts"]), (&json!("running"), &json!(1)), "{document:#}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_signal_ends_it_at_once_and_the_job_runs_again() {
    let data = tempfile::tempdir().unwrap();
    let service = Service::start(data.path(), &["--grace-s", "3000"]);
    let job = running_job(&service).await;
    service.signal("INT");
    while service.get("/readyz").await.status != 503 {}
    service.signal("TERM");
    let (status, took) = service.ended();
    assert_eq!(status.code(), Some(1));
    assert!(took < AT_ONCE, "{took:?}");
    let service = Service::start(data.path(), &["--grace-s", "0"]);
    let state = service.get(&job).await.expect(200).json()["state"].clone();
    assert!(state == "queued" || state == "running", "{state}");
}

#[tokio::test(flavor = "multi_thread")]
async fn many_large_bodies_at_once_take_no_more_memory_than_was_allowed() {
    const BODY: usize = 8 << 20;
    let data = tempfile::tempdir().unwrap();
    let service = Service::start(data.path(), &["--max-body-mib", "8", "--max-uploads-mib", "16", "--workers", "2"]);
    service.get("/healthz").await.expect(200);
    let before = service.peak_mib();
    let body = bytes::Bytes::from(format!("{{{}}}", " ".repeat(BODY - 2)));
    let client = reqwest::Client::new();
    let mut uploads = tokio::task::JoinSet::new();
    for _ in 0..60 {
        let request = client.post(format!("{}/v1/surfaces", service.address)).body(body.clone());
        uploads.spawn(async move {
            let answer = request.send().await.unwrap();
            judge(&reqwest::Method::POST, "/v1/surfaces", answer).await.status.as_u16()
        });
    }
    let mut read = 0;
    while let Some(answer) = uploads.join_next().await {
        match answer.unwrap() {
            422 => read += 1,
            status => assert_eq!(status, 503),
        }
    }
    assert!(read >= 2, "{read}");
    let grown = service.peak_mib() - before;
    // 60 bodies are 480 MiB. Allowed are 16 MiB of bodies; growing buffers and the allocator take some more.
    assert!(grown < 160, "{grown} MiB");
    service.get("/readyz").await.expect(200);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_command_line_writes_the_very_bytes_that_the_service_serves() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("data"), folder.path().join("out"));
    let file = part("cone-with-holes.json");
    let ran =
        program(&["run", "flatten"]).arg(&file).args(["--set", "flattening.seed=centre", "--out"]).arg(&out).output();
    let ran = ran.unwrap();
    assert_eq!(ran.status.code(), Some(0), "{}", String::from_utf8_lossy(&ran.stderr));
    let service = Service::start(&data, &[]);
    let surface: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    let surface = service.post("/v1/surfaces", &surface).await.json()["id"].clone();
    let job = json!({ "kind": "flatten", "surface": surface, "flattening": { "seed": "centre" } });
    let address = service.post("/v1/jobs", &job).await.expect(202).header("location").unwrap().to_owned();
    let job = service.get(&format!("{address}?wait=60")).await.json();
    let results = job["results"].as_array().unwrap();
    assert_eq!(results.len(), 12, "{job:#}");
    let told = String::from_utf8(ran.stdout).unwrap();
    assert_eq!(told.lines().count(), 1, "{told}");
    for link in results {
        let href = link["href"].as_str().unwrap();
        let name = href.rsplit('/').next().unwrap();
        let served = service.get(href).await.expect(200).body;
        assert!(told.contains(name), "{told}");
        assert!(std::fs::read(out.join(name)).unwrap() == served, "{name} differs");
    }
    let (status, _) = {
        service.signal("TERM");
        service.ended()
    };
    assert_eq!(status.code(), Some(0));
}

#[test]
fn exit_codes_tell_what_became_of_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let (out, bad) = (folder.path().join("out"), folder.path().join("bad.json"));
    std::fs::write(&bad, r#"{ "degree_u": 1 }"#).unwrap();
    let cap = part("sphere-cap.json");
    let run = |file: &Path, set: &str| {
        let output = program(&["run", "flatten"]).arg(file).args(["--set", set, "--out"]).arg(&out).output().unwrap();
        (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(run(&cap, "flattening.seed=centre").0, 0);
    let report: Value = serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["verdict"]["result"], "unchecked");
    // The pattern breaks a limit.
    let (code, text) = run(&cap, "limits.stretch_percent=0");
    assert_eq!(code, 3);
    assert!(text.starts_with("verdict fail: stretch_percent is ") && text.contains("(p99), the limit is 0"), "{text}");
    // The surface has faults: all of them are on standard error.
    let (code, text) = run(&bad, "flattening.seed=centre");
    let problem: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(code, 1);
    assert!(problem["errors"].as_array().unwrap().len() > 1, "{text}");
    // It was asked for in a way that makes no sense.
    let (code, text) = run(&cap, "flattening.sed=centre");
    assert_eq!(code, 2);
    assert!(text.contains("/flattening/sed"), "{text}");
    assert_eq!(run(&folder.path().join("absent.json"), "flattening.seed=centre").0, 2);
    // The kind of work, which the command line names, decides what belongs to it.
    let mut search = program(&["run", "optimum-seed-search"]);
    let search = search.arg(&cap).args(["--set", "flattening.objective=area", "--out"]).arg(&out).output().unwrap();
    assert_eq!(search.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&search.stderr).contains("/flattening/objective"));
    assert_eq!(program(&["run", "fold", "x.json", "--out", "y"]).output().unwrap().status.code(), Some(2));
    let open = program(&["serve", "--listen", "0.0.0.0:0"]).output().unwrap();
    assert_eq!(open.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&open.stderr).contains("--open"));
}

#[test]
fn check_sums_a_surface_up_or_lists_its_faults() {
    let good = program(&["check"]).arg(part("gasket.json")).output().unwrap();
    assert_eq!(good.status.code(), Some(0));
    let summary: Value = serde_json::from_slice(&good.stdout).unwrap();
    assert!(summary["area_mm2"].as_f64().unwrap() > 0.0, "{summary:#}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bad.json");
    std::fs::write(&file, "{\n  \"units\": }").unwrap();
    let bad = program(&["check"]).arg(&file).output().unwrap();
    assert_eq!(bad.status.code(), Some(1));
    let problem: Value = serde_json::from_slice(&bad.stderr).unwrap();
    assert_eq!(problem["type"], "/problems/invalid-json");
    assert!(problem["detail"].as_str().unwrap().starts_with("Line 2, column"), "{problem:#}");
}
