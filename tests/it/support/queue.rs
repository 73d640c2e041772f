//! A store with one surface in it, a queue, and runners that do what the job's parameters say.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use planish::clock::Clock;
use planish::engine::budget::{Observer, Stage};
use planish::queue::{
    Enqueued, Failed, FailureClass, Finished, Job, JobId, NewJob, NewResult, Queue, Runner, Settings, Task,
};
use planish::store::{NewSurface, Store, SurfaceId};
use serde_json::{Value, json};

/// Longer than anything here may take, even on a laden machine: a test that waits so long has failed.
pub(crate) const LONG: Duration = Duration::from_mins(1);

/// The bytes of the surface that the jobs are about. The machine does not read them.
pub(crate) const CONTENT: &[u8] = b"a surface";

/// Opens the store.
pub(crate) async fn open(directory: &Path) -> Store {
    Store::open(directory, Clock::system()).await.unwrap()
}

/// Stores the surface, or finds it there.
pub(crate) async fn surface(store: &Store) -> SurfaceId {
    let new = NewSurface::new(CONTENT.into(), "application/json", "nurbs", "mm", json!({ "units": "mm" }));
    store.put_surface(new).await.unwrap().0.id
}

/// Settings under which nothing waits for long.
pub(crate) fn settings() -> Settings {
    Settings {
        workers: 2,
        light_workers: 1,
        threads: 2,
        tick_every: Duration::from_millis(20),
        progress_every: Duration::from_millis(40),
        retry_pause: Duration::from_millis(5),
        release_after: Duration::from_secs(3),
        ..Settings::default()
    }
}

/// A job whose parameters tell the runner what to do.
pub(crate) fn new_job(surface: &SurfaceId, parameters: Value) -> NewJob {
    NewJob {
        kind: "triangulate".to_owned(),
        surface: surface.clone(),
        parameters,
        labels: BTreeMap::new(),
        cost: 1,
        idempotency: None,
    }
}

/// Accepts a job and gives its name.
pub(crate) async fn enqueue(queue: &Queue, surface: &SurfaceId, parameters: Value) -> JobId {
    match queue.enqueue(new_job(surface, parameters)).await.unwrap() {
        Enqueued::New(job) => job.id,
        Enqueued::Again(job) => panic!("{} was there before", job.id),
    }
}

/// Waits until the job has ended.
pub(crate) async fn ended(queue: &Queue, id: JobId) -> Job {
    let job = queue.wait_until_ended(id, LONG).await.unwrap().expect("the job is there");
    assert!(job.state.has_ended(), "{} is still {} after a minute", job.id, job.state);
    job
}

/// Waits until the job runs.
pub(crate) async fn running(queue: &Queue, id: JobId) {
    let mut changes = queue.subscribe();
    tokio::time::timeout(LONG, async {
        while queue.get(id).await.unwrap().unwrap().state != planish::queue::State::Running {
            let _ = changes.recv().await;
        }
    })
    .await
    .expect("the job starts");
}

/// A door that threads wait at until a test opens it.
#[derive(Debug, Default)]
pub(crate) struct Gate {
    open: Mutex<bool>,
    moved: Condvar,
}

impl Gate {
    pub(crate) fn open(&self) {
        *self.open.lock().unwrap() = true;
        self.moved.notify_all();
    }

    pub(crate) fn wait(&self) {
        let mut open = self.open.lock().unwrap();
        while !*open {
            open = self.moved.wait(open).unwrap();
        }
    }
}

/// Does what `parameters.do` says.
#[derive(Debug, Default)]
pub(crate) struct Puppet {
    /// Jobs that wait do so here.
    pub(crate) gate: Gate,
    /// How many attempts were started.
    pub(crate) started: AtomicU32,
}

impl Puppet {
    pub(crate) fn new() -> Arc<Self> {
        Arc::default()
    }
}

impl Runner for Puppet {
    fn run(&self, task: &Task, observer: &dyn Observer) -> Result<Finished, Failed> {
        self.started.fetch_add(1, Ordering::SeqCst);
        observer.enter(Stage::Preparation);
        assert_eq!(task.content, CONTENT);
        match task.parameters["do"].as_str() {
            Some("finish") | None => {}
            Some("panic") => panic!("as asked"),
            Some("panic in a scope") => rayon::scope(|scope| scope.spawn(|_| panic!("as asked, in a scope"))),
            Some("panic in a detached task") => rayon::spawn(|| panic!("as asked, detached")),
            Some("wait at the gate") => self.gate.wait(),
            Some("wait for cancellation") => {
                observer.enter(Stage::SeedSearch);
                observer.progress(0.5);
                while !observer.is_cancelled() {
                    std::thread::yield_now();
                }
                return Err(interrupted());
            }
            Some("fail") => return Err(failed("triangle-flipped", FailureClass::Deterministic)),
            Some("falter") => return Err(failed("storage-failed", FailureClass::Transient)),
            Some("falter once") => {
                if task.attempt == 1 {
                    return Err(failed("storage-failed", FailureClass::Transient));
                }
            }
            Some(other) => panic!("no puppet does {other:?}"),
        }
        Ok(finished(task))
    }
}

/// What a runner gives that has done its work: a function of the task's input alone.
pub(crate) fn finished(task: &Task) -> Finished {
    Finished {
        results: vec![
            NewResult::new("mesh", "application/json", format!("mesh of {}", task.parameters)),
            NewResult::new("report", "application/json", "{}"),
        ],
        verdict: Some("unchecked".to_owned()),
        parameters: Some(json!({ "resolved": task.parameters })),
    }
}

/// A failure with this code.
pub(crate) fn failed(code: &str, class: FailureClass) -> Failed {
    let results = vec![NewResult::new("mesh", "application/json", "what there is")];
    Failed { problem: json!({ "code": code, "title": code, "detail": code }), results, parameters: None, class }
}

/// What a runner gives that was told to stop.
pub(crate) fn interrupted() -> Failed {
    failed("cancelled", FailureClass::Interrupted)
}
