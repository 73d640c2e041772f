//! `GET /v1/feed?after=SEQ`: ended jobs in the order of ending, each once: what a cutting line's MES pulls.
//!
//! The number of an ending is given in the transaction that ends the job, and transactions that write follow one another;
//! so who has read up to a number has missed nothing before it. `next` is where to go on: the last entry's number, or,
//! where the page holds all there is, the last number that was given out, so that a reader whose filter rarely fits does
//! not walk over the same endings again and again.

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};
use tokio::sync::broadcast;
use tokio::sync::broadcast::error::{RecvError, TryRecvError};
use tokio::time::{Instant, timeout_at};

use super::document;
use super::filter::filter;
use crate::api::App;
use crate::api::cursor;
use crate::api::problem::Problem;
use crate::api::request::{Query, Wait};
use crate::store::{Change, Job, JobFilter};

/// A page; with `wait` the answer comes when a job has ended that fits, or time is up.
pub(crate) async fn feed(State(app): State<App>, query: Query, headers: HeaderMap) -> Result<Response, Problem> {
    let (filter, text) = filter(&query, &["after", "limit", "wait"])?;
    let limit = cursor::limit(&query)?;
    let after = query.parsed::<i64>("after", "a number that this feed gave as `next`, or 0")?.unwrap_or(0);
    if after < 0 {
        return Err(Problem::query("after", "must be 0 or more"));
    }
    let wait = Wait::of(&query, &headers)?;
    let page = match wait {
        Some(wait) => awaited(&app, &filter, after, limit, wait).await?,
        None => Page::read(&app, &filter, after, limit).await?,
    };
    let document = page.document(&app, &text, limit).await?;
    let mut answer =
        ([(header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache"))], Json(document)).into_response();
    if let Some(wait) = wait {
        wait.acknowledge(answer.headers_mut());
    }
    Ok(answer)
}

/// Reads the feed, and again at every ending while it has nothing, until time is up or the service shuts down.
async fn awaited(app: &App, filter: &JobFilter, after: i64, limit: u32, wait: Wait) -> Result<Page, Problem> {
    let deadline = Instant::now() + wait.duration();
    // Subscribed before the rows are read, so no ending between the two is missed.
    let mut changes = app.queue().subscribe();
    loop {
        let page = Page::read(app, filter, after, limit).await?;
        // A number beyond the last one comes of data that went back: the client is to know at once.
        if !page.jobs.is_empty() || page.last < after {
            return Ok(page);
        }
        let ended = app.draining().run_until_cancelled(timeout_at(deadline, an_ending(&mut changes))).await;
        if !matches!(ended, Some(Ok(()))) {
            return Ok(page);
        }
    }
}

/// Waits until a job has ended, or changes were missed. Endings that came together count as one.
async fn an_ending(changes: &mut broadcast::Receiver<Change>) {
    loop {
        match changes.recv().await {
            Ok(change) if !change.state.has_ended() => {}
            Ok(_) | Err(RecvError::Lagged(_)) => break,
            // The store is closed: there is nothing more to come.
            Err(RecvError::Closed) => std::future::pending().await,
        }
    }
    while !matches!(changes.try_recv(), Err(TryRecvError::Empty | TryRecvError::Closed)) {}
}

/// What the feed has after a number.
struct Page {
    jobs: Vec<Job>,
    next: i64,
    last: i64,
}

impl Page {
    async fn read(app: &App, filter: &JobFilter, after: i64, limit: u32) -> Result<Self, Problem> {
        // The number first: every ending up to it is among the rows that are read next.
        let last = app.store().last_end().await?;
        let jobs = app.store().feed(filter, after, limit).await?;
        let read_to = jobs.last().and_then(|job| job.end_seq);
        let next = match read_to {
            Some(read_to) if jobs.len() == limit as usize => read_to,
            Some(read_to) => read_to.max(last),
            None => last,
        };
        Ok(Self { jobs, next, last: read_to.map_or(last, |read_to| read_to.max(last)) })
    }

    async fn document(&self, app: &App, filter: &str, limit: u32) -> Result<Value, Problem> {
        let numbers: Vec<i64> = self.jobs.iter().map(|job| job.seq).collect();
        let results = app.store().results_of(&numbers).await?;
        let entry = |job: &Job| {
            let stored = results.get(&job.seq).map_or(&[][..], Vec::as_slice);
            json!({ "seq": job.end_seq, "job": document(job, stored) })
        };
        let separator = if filter.is_empty() { "" } else { "&" };
        let address = format!("/v1/feed?{filter}{separator}limit={limit}&after={}", self.next);
        Ok(json!({
            "items": self.jobs.iter().map(entry).collect::<Vec<_>>(),
            "next": self.next,
            "last": self.last,
            "links": { "next": address },
        }))
    }
}
