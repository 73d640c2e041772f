//! A live service in this process: a real port, a real database in a folder of its own, and a runner that a test holds.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use glam::DVec2;
use planish::api::{App, router};
use planish::clock::Clock;
use planish::config::Settings;
use planish::engine::budget::Observer;
use planish::engine::distortion::Report;
use planish::engine::error::EngineError;
use planish::engine::mesh::Mesh;
use planish::engine::pattern::{Contour, Pattern, Piece};
use planish::engine::seed::{SeedLandscape, SeedOutcome};
use planish::formats::seeds;
use planish::formats::{MeshParts, report_json, stored};
use planish::queue::{self, Failed, FailureClass, Finished, NewResult, Queue, Runner, Task};
use planish::server::{ConnectionLimits, serve};
use planish::store::Store;
use reqwest::{Client, Method, RequestBuilder};
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

use super::contract::{Answer, judge};
use super::queue::Gate;

/// A service that lives as long as this.
pub(crate) struct Live {
    /// Where it listens: `http://127.0.0.1:PORT`.
    pub(crate) address: String,
    pub(crate) client: Client,
    pub(crate) app: App,
    pub(crate) store: Store,
    pub(crate) queue: Queue,
    /// Cancelling this is what SIGTERM does first.
    pub(crate) draining: CancellationToken,
    stop: CancellationToken,
    directory: Option<tempfile::TempDir>,
}

impl Drop for Live {
    fn drop(&mut self) {
        self.stop.cancel();
    }
}

/// Settings for a test: those of the command line, changed.
pub(crate) fn settings(change: impl FnOnce(&mut Settings)) -> Settings {
    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        settings: Settings,
    }
    let mut settings = <Line as clap::Parser>::parse_from(["planish"]).settings;
    change(&mut settings);
    settings
}

impl Live {
    /// Starts a service.
    pub(crate) async fn start(runner: Arc<dyn Runner>, settings: &Settings) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut live = Self::start_in(directory.path(), runner, settings, super::queue::settings()).await;
        live.directory = Some(directory);
        live
    }

    /// Starts a service on a folder, with a machine of its own settings.
    pub(crate) async fn start_in(
        directory: &Path,
        runner: Arc<dyn Runner>,
        settings: &Settings,
        machine: queue::Settings,
    ) -> Self {
        let store = Store::open(directory, Clock::system()).await.unwrap();
        let machine = queue::Settings { most_waiting: u64::from(settings.max_queued), ..machine };
        let queue = Queue::start(store.clone(), runner, machine).await.unwrap();
        let draining = CancellationToken::new();
        let app = App::new(store.clone(), queue.clone(), settings, draining.clone());
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = format!("http://{}", listener.local_addr().unwrap());
        let stop = CancellationToken::new();
        let limits = ConnectionLimits {
            connections: settings.max_connections,
            first_byte: Duration::from_secs(settings.first_byte_timeout_s),
            header: Duration::from_secs(settings.header_timeout_s),
            idle: Duration::from_secs(settings.idle_timeout_s),
        };
        tokio::spawn(serve(listener, router(app.clone()), limits, stop.clone()));
        Self { address, client: Client::new(), app, store, queue, draining, stop, directory: None }
    }

    /// The data directory.
    pub(crate) fn directory(&self) -> &std::path::Path {
        self.store.directory()
    }

    /// Sends a request as it is built by `build`; the answer is held against the contract.
    pub(crate) async fn send(
        &self,
        method: Method,
        path: &str,
        build: impl FnOnce(RequestBuilder) -> RequestBuilder,
    ) -> Answer {
        let request = build(self.client.request(method.clone(), format!("{}{path}", self.address)));
        judge(&method, path, request.send().await.expect("an answer")).await
    }

    pub(crate) async fn get(&self, path: &str) -> Answer {
        self.send(Method::GET, path, |request| request).await
    }

    pub(crate) async fn delete(&self, path: &str) -> Answer {
        self.send(Method::DELETE, path, |request| request).await
    }

    pub(crate) async fn post(&self, path: &str, body: &Value) -> Answer {
        self.send(Method::POST, path, |request| request.json(body)).await
    }

    /// Posts bytes as they are, without a type.
    pub(crate) async fn post_bytes(&self, path: &str, body: impl Into<reqwest::Body>) -> Answer {
        self.send(Method::POST, path, |request| request.body(body)).await
    }

    /// Stores a surface and gives its id.
    pub(crate) async fn surface(&self, surface: &Value) -> String {
        let answer = self.post("/v1/surfaces", surface).await;
        assert!(answer.status.is_success(), "{}", answer.text());
        answer.json()["id"].as_str().unwrap().to_owned()
    }

    /// Queues a job and gives its id.
    pub(crate) async fn job(&self, job: &Value) -> String {
        self.post("/v1/jobs", job).await.expect(202).json()["id"].as_str().unwrap().to_owned()
    }

    /// The job's document when it has ended.
    pub(crate) async fn ended(&self, job: &str) -> Value {
        let document = self.get(&format!("/v1/jobs/{job}?wait=60")).await.expect(200).json();
        assert!(document["finished_at"].is_string(), "{document}");
        document
    }
}

/// A flat square of 100 mm by 60 mm with a round-ish hole, in millimetres.
pub(crate) fn plate() -> Value {
    json!({
        "name": "plate",
        "units": "mm",
        "degree_u": 1, "degree_v": 1,
        "knots_u": [0, 0, 1, 1],
        "knots_v": [0, 0, 1, 1],
        "control_points": [[[0, 0, 0], [0, 60, 0]], [[100, 0, 0], [100, 60, 0]]],
        "trims": [
            [{ "points": [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]] }],
            [{ "points": [[0.4, 0.4], [0.4, 0.6], [0.6, 0.6], [0.6, 0.4], [0.4, 0.4]] }]
        ],
        "labels": { "part_number": "4711-A" }
    })
}

/// Does in a moment what the engine would do for a flat plate: two triangles and their outline, whatever comes in.
#[derive(Debug, Default)]
pub(crate) struct Sketch;

impl Runner for Sketch {
    fn run(&self, task: &Task, _observer: &dyn Observer) -> Result<Finished, Failed> {
        let corners = [[0.0, 0.0], [100.0, 0.0], [100.0, 60.0], [0.0, 60.0]].map(DVec2::from_array);
        let mesh = Mesh {
            positions: corners.map(|p| p.extend(0.0)).to_vec(),
            uv: None,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let parts = MeshParts { flat: Some(&corners), ..MeshParts::of(&mesh) };
        let report = report_json::write(&Report::default()).unwrap();
        let mut results = vec![
            NewResult::new("mesh", stored::MESH_MEDIA, stored::encode_mesh(&parts)),
            NewResult::new("report", "application/json", report),
        ];
        if task.kind == "flatten" {
            let outline = Contour { points: corners.to_vec(), corners: vec![true; 4], ..Contour::default() };
            let piece = Piece { name: "plate".to_owned(), outline, ..Piece::default() };
            let pattern = Pattern { pieces: vec![piece], bounding_box_mm: [100.0, 60.0], ..Pattern::default() };
            results.push(NewResult::new("pattern", stored::PATTERN_MEDIA, stored::encode_pattern(&pattern)));
        }
        if task.kind == "optimum-seed-search" {
            let landscape =
                SeedLandscape { seeds: vec![SeedOutcome::Untried; 2], best: vec![None], ..SeedLandscape::default() };
            results.push(NewResult::new("seeds", seeds::MEDIA, seeds::encode(&landscape)));
        }
        Ok(Finished { results, verdict: Some("unchecked".to_owned()), parameters: None })
    }
}

/// Does what `R` does, but a job whose label `test` says so waits at the gate, waits until it is cancelled, or panics.
#[derive(Default)]
pub(crate) struct Held<R> {
    pub(crate) gate: Gate,
    pub(crate) runner: R,
}

impl<R: Runner> Runner for Held<R> {
    fn run(&self, task: &Task, observer: &dyn Observer) -> Result<Finished, Failed> {
        match task.labels.get("test").map(String::as_str) {
            Some("gate") => self.gate.wait(),
            Some("panic") => panic!("a job panics"),
            Some("fail") => {
                let error =
                    EngineError::Parameter { name: "flattening.seed".to_owned(), detail: "is not wanted".to_owned() };
                return Err(Failed {
                    problem: planish::queue::problem(&error),
                    results: Vec::new(),
                    parameters: None,
                    class: FailureClass::Deterministic,
                });
            }
            Some("endless") => {
                while !observer.is_cancelled() {
                    std::thread::yield_now();
                }
                return Err(Failed {
                    problem: json!({ "code": "cancelled", "title": "Cancelled", "detail": EngineError::Cancelled.to_string() }),
                    results: Vec::new(),
                    parameters: None,
                    class: FailureClass::Interrupted,
                });
            }
            _ => {}
        }
        self.runner.run(task, observer)
    }
}
