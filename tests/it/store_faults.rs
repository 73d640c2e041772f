//! Whatever write fails, nothing is torn: the database refuses each write that an operation makes in turn, and the
//! operation must leave every row as it was, and succeed once the fault is gone.

use std::collections::BTreeSet;

use planish::queue::{IdempotencyKey, JobId, NewJob, NewResult};
use planish::store::{Claim, Digest, Ending, Lane, NewSurface, Store, SurfaceId};
use serde_json::json;
use sqlx::{AssertSqlSafe, Row, SqliteConnection};

use crate::support::queue::{LONG, new_job, open, surface};
use crate::support::{assert_whole, raw};

const TABLES: [&str; 7] = ["blobs", "surfaces", "jobs", "job_labels", "results", "idempotency", "counters"];

/// Every operation that writes, with every write it makes. The test holds that the list is whole.
const OPERATIONS: [(&str, &[&str]); 10] = [
    ("put", &["INSERT ON blobs", "INSERT ON surfaces"]),
    ("enqueue", &["INSERT ON jobs", "INSERT ON job_labels", "INSERT ON idempotency"]),
    ("claim", &["UPDATE ON jobs"]),
    ("progress", &["UPDATE ON jobs"]),
    ("give back", &["UPDATE ON jobs"]),
    ("succeed", &["UPDATE ON counters", "UPDATE ON jobs", "INSERT ON blobs", "INSERT ON results"]),
    ("fail", &["UPDATE ON counters", "UPDATE ON jobs", "INSERT ON blobs", "INSERT ON results"]),
    ("cancel", &["UPDATE ON counters", "UPDATE ON jobs"]),
    ("remove job", &["DELETE ON jobs", "DELETE ON job_labels", "DELETE ON results", "DELETE ON blobs"]),
    ("remove surface", &["DELETE ON surfaces", "DELETE ON blobs"]),
];

/// A store in which an operation has something to do.
struct Scene {
    store: Store,
    surface: SurfaceId,
    job: Option<JobId>,
    claim: Option<Claim>,
}

fn results() -> Vec<NewResult> {
    vec![NewResult::new("mesh", "text/plain", "a mesh"), NewResult::new("report", "text/plain", "{}")]
}

fn succeeded() -> Ending {
    Ending::Succeeded { results: results(), verdict: Some("pass".to_owned()), resolved: Some(json!({})) }
}

impl Scene {
    async fn set(store: Store, operation: &str) -> Self {
        let surface = surface(&store).await;
        let mut scene = Self { store, surface, job: None, claim: None };
        if ["claim", "progress", "give back", "succeed", "fail", "cancel", "remove job"].contains(&operation) {
            let labels = [("order".to_owned(), "1".to_owned())].into();
            let new = NewJob { labels, ..new_job(&scene.surface, json!({})) };
            scene.job = Some(scene.store.enqueue(new, Lane::Light, 10).await.unwrap().job().id);
        }
        if ["progress", "give back", "succeed", "fail", "remove job"].contains(&operation) {
            scene.claim = scene.store.claim(true, LONG).await.unwrap();
        }
        if operation == "remove job" {
            scene.store.finish(scene.claim.as_ref().unwrap(), succeeded(), None).await.unwrap();
        }
        scene
    }

    async fn operate(&self, operation: &str) -> Result<(), String> {
        let text = |error: planish::store::StoreError| error.to_string();
        let claim = || self.claim.clone().expect("this scene has a claim");
        let job = || self.job.expect("this scene has a job");
        match operation {
            "put" => {
                let new = NewSurface::new("another".into(), "application/json", "nurbs", "mm", json!({}));
                self.store.put_surface(new).await.map(drop).map_err(text)
            }
            "enqueue" => {
                let key = IdempotencyKey { scope: "s".to_owned(), key: "k".to_owned(), body: Digest::of(b"") };
                let labels = [("order".to_owned(), "1".to_owned())].into();
                let new = NewJob { labels, idempotency: Some(key), ..new_job(&self.surface, json!({})) };
                self.store.enqueue(new, Lane::Light, 10).await.map(drop).map_err(|error| error.to_string())
            }
            "claim" => self.store.claim(true, LONG).await.map(drop).map_err(text),
            "progress" => {
                let progress =
                    planish::store::Progress { fraction: 0.5, stage: Some("tracing"), remaining_ms: Some(7) };
                self.store.renew(vec![(claim(), Some(progress))], LONG * 2).await.map(drop).map_err(text)
            }
            "give back" => self.store.give_back(claim(), true).await.map(drop).map_err(text),
            "succeed" => self.store.finish(&claim(), succeeded(), Some(json!({}))).await.map(drop).map_err(text),
            "fail" => {
                let ending = Ending::Failed { problem: json!({ "code": "c" }), results: results(), resolved: None };
                self.store.finish(&claim(), ending, Some(json!({}))).await.map(drop).map_err(text)
            }
            "cancel" => self.store.cancel(job()).await.map(drop).map_err(text),
            "remove job" => self.store.remove_job(job()).await.map(drop).map_err(text),
            "remove surface" => self.store.remove_surface(&self.surface).await.map(drop).map_err(text),
            other => panic!("no operation {other}"),
        }
    }
}

async fn execute(raw: &mut SqliteConnection, sql: String) {
    sqlx::query(AssertSqlSafe(sql)).execute(raw).await.unwrap();
}

/// All rows of all tables as text.
async fn everything(raw: &mut SqliteConnection) -> String {
    let mut all = String::new();
    for table in TABLES {
        let columns =
            sqlx::query("SELECT group_concat('quote(' || name || ')', '||'',''||') FROM pragma_table_info(?1)");
        let columns: String = columns.bind(table).fetch_one(&mut *raw).await.unwrap().get(0);
        let rows = AssertSqlSafe(format!("SELECT {columns} FROM {table} ORDER BY 1"));
        for row in sqlx::query(rows).fetch_all(&mut *raw).await.unwrap() {
            all.extend([table, ": ", row.get(0), "\n"]);
        }
    }
    all
}

/// From now on every write is noted.
async fn note_writes(raw: &mut SqliteConnection) {
    execute(raw, "CREATE TABLE noted (write TEXT)".to_owned()).await;
    for table in TABLES {
        for write in ["INSERT", "UPDATE", "DELETE"] {
            let note = format!("INSERT INTO noted VALUES ('{write} ON {table}');");
            execute(raw, format!("CREATE TRIGGER note_{write}_{table} AFTER {write} ON {table} BEGIN {note} END"))
                .await;
        }
    }
}

#[tokio::test]
async fn an_operation_any_write_of_which_fails_changes_nothing_and_succeeds_when_the_fault_is_gone() {
    for (operation, writes) in OPERATIONS {
        let directory = tempfile::tempdir().unwrap();
        let scene = Scene::set(open(directory.path()).await, operation).await;
        let mut raw = raw(directory.path()).await;
        let before = everything(&mut raw).await;
        for write in writes {
            let refuse = "SELECT RAISE(ABORT, 'this write fails');";
            execute(&mut raw, format!("CREATE TRIGGER fault AFTER {write} BEGIN {refuse} END")).await;
            let message = scene.operate(operation).await.expect_err(&format!("{operation} without {write}"));
            assert!(message.contains("this write fails"), "{operation}: {message}");
            execute(&mut raw, "DROP TRIGGER fault".to_owned()).await;
            assert_eq!(everything(&mut raw).await, before, "{operation} with {write} refused");
        }
        note_writes(&mut raw).await;
        scene.operate(operation).await.unwrap();
        assert_ne!(everything(&mut raw).await, before, "{operation} did nothing");
        assert_whole(&mut raw).await;
        let noted = sqlx::query("SELECT DISTINCT write FROM noted").fetch_all(&mut raw).await.unwrap();
        let noted: BTreeSet<String> = noted.iter().map(|row| row.get(0)).collect();
        assert_eq!(noted, writes.iter().map(|&write| write.to_owned()).collect(), "the writes of {operation}");
    }
}
