//! `GET /v1/jobs/{job}/events`: how a job goes, as server-sent events (WHATWG HTML, 9.2).
//!
//! An event's id is the job's revision at that moment. States are stored as the job comes to them, so who was cut off and
//! comes back with `Last-Event-ID` gets every state since, in order and once; progress is not stored, the latest is what
//! counts. The last event is the state that the job ended in; then the stream ends, and a browser that comes back is
//! told by `204` to stay away.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::time::Duration;

use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::sse::{Event, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::stream::{Stream, unfold};
use serde_json::{Value, json};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{OwnedSemaphorePermit, broadcast};
use tokio::time::timeout;

use super::{absent, document, id_of};
use crate::api::App;
use crate::api::problem::Problem;
use crate::api::request::Query;
use crate::store::{Change, Job, JobId, State as JobState, StateEvent};

/// What a client is told to wait before it comes back after it was cut off.
const RETRY: Duration = Duration::from_secs(2);
const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");

/// The stream; 204 when the client has heard of the end already.
pub(crate) async fn events(
    State(app): State<App>,
    Path(id): Path<String>,
    query: Query,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    query.only(&[])?;
    let id = id_of(&id)?;
    let seen = last_seen(&headers)?;
    // Subscribed before the rows are read, so no change between the two is missed.
    let changes = app.queue().subscribe();
    let job = app.store().job(id).await?.ok_or_else(absent)?;
    if job.state.has_ended() && seen >= job.revision {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    let place = app.stream()?;
    // An id that the job has not come to is of other data, before a backup was restored: then all is told anew.
    let seen = if seen > job.revision { 0 } else { seen };
    let watch = Watch {
        id,
        seen,
        ready: VecDeque::from([Event::default().retry(RETRY)]),
        phase: Phase::Reading,
        changes,
        app,
        _place: place,
    };
    let headers = [
        (header::CACHE_CONTROL, HeaderValue::from_static("no-cache, no-transform")),
        // A proxy that collects answers before it passes them on (nginx) would hold events back.
        (HeaderName::from_static("x-accel-buffering"), HeaderValue::from_static("no")),
    ];
    Ok((headers, Sse::new(watch.events())).into_response())
}

/// The id of the last event that the client has; 0 when it has none.
fn last_seen(headers: &HeaderMap) -> Result<i64, Problem> {
    let Some(value) = headers.get(LAST_EVENT_ID) else { return Ok(0) };
    let text = value.to_str().unwrap_or_default();
    let number = (1..=18).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    match text.parse() {
        Ok(id) if number => Ok(id),
        _ => Err(Problem::header("Last-Event-ID", "must be the id of an event of this stream")),
    }
}

/// One client that follows one job.
struct Watch {
    app: App,
    id: JobId,
    /// The id of the last event that was sent.
    seen: i64,
    ready: VecDeque<Event>,
    phase: Phase,
    changes: broadcast::Receiver<Change>,
    _place: OwnedSemaphorePermit,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// There may be news in the database.
    Reading,
    /// All that is known was sent.
    Waiting,
    /// What is ready is the last.
    Ending,
}

impl Watch {
    fn events(self) -> impl Stream<Item = Result<Event, Infallible>> {
        unfold(self, |mut watch| async move {
            loop {
                if let Some(event) = watch.ready.pop_front() {
                    return Some((Ok(event), watch));
                }
                match watch.phase {
                    Phase::Ending => return None,
                    Phase::Reading => watch.read().await,
                    Phase::Waiting => watch.wait().await,
                }
            }
        })
    }

    /// Makes events of what has happened since the last one.
    async fn read(&mut self) {
        self.phase = Phase::Waiting;
        // The row first: a state that is stored after it is read is among the events or signalled later.
        let job = self.app.store().job(self.id).await;
        let states = self.app.store().events(self.id, self.seen).await;
        let (job, states) = match (job, states) {
            (Ok(Some(job)), Ok(states)) => (job, states),
            (Ok(None), _) => return self.end("the job was deleted"),
            (Err(error), _) | (_, Err(error)) => {
                tracing::warn!(job = %self.id, %error, "the events of a job could not be read");
                return self.end("the events could not be read: come again");
            }
        };
        let mut found: Vec<(i64, Event)> = Vec::with_capacity(states.len() + 1);
        let mut last = None;
        for event in &states {
            last = Some(event.state);
            found.push((event.revision, self.state(&job, event).await));
        }
        // A revision of the row that is no state's is progress, or the wish that the job be cancelled.
        let is_new = job.revision > self.seen && states.iter().all(|event| event.revision != job.revision);
        if is_new && job.state == JobState::Running {
            let data = json!({
                "id": job.id, "fraction": job.progress, "stage": job.stage,
                "remaining_s": job.remaining_ms.map(|ms| ms as f64 / 1e3), "cancel_requested": job.cancel_requested
            });
            found.push((job.revision, event("progress", job.revision, &data)));
        }
        found.sort_by_key(|(revision, _)| *revision);
        self.seen = found.last().map_or(self.seen, |(revision, _)| *revision);
        self.ready.extend(found.into_iter().map(|(_, event)| event));
        if last.is_some_and(JobState::has_ended) {
            self.phase = Phase::Ending;
        }
    }

    /// A state's event; that of the end holds the whole job, so that nothing need be asked after it.
    async fn state(&self, job: &Job, state: &StateEvent) -> Event {
        let mut data = json!({ "id": self.id, "state": state.state, "attempts": state.attempt });
        if state.state.has_ended()
            && let Ok(Some(job)) =
                if job.state.has_ended() { Ok(Some(job.clone())) } else { self.app.store().job(self.id).await }
        {
            let results = self.app.store().results(self.id).await.unwrap_or_default();
            data["job"] = document(&job, &results);
        }
        event("state", state.revision, &data)
    }

    /// Waits for a change of the job, and says that it is still there while there is none.
    async fn wait(&mut self) {
        let draining = self.app.draining().clone();
        let change = timeout(self.app.heartbeat(), self.a_change());
        match draining.run_until_cancelled(change).await {
            None => self.end("the service is shutting down: come again"),
            Some(Ok(())) => self.phase = Phase::Reading,
            Some(Err(_)) => self.ready.push_back(Event::default().comment("still here")),
        }
    }

    async fn a_change(&mut self) {
        loop {
            match self.changes.recv().await {
                Ok(change) if change.id != self.id || change.revision <= self.seen => {}
                Ok(_) | Err(RecvError::Lagged(_)) => return,
                Err(RecvError::Closed) => std::future::pending().await,
            }
        }
    }

    fn end(&mut self, why: &str) {
        self.ready.push_back(Event::default().comment(why));
        self.phase = Phase::Ending;
    }
}

fn event(name: &str, id: i64, data: &Value) -> Event {
    // JSON in one line has no line break, the one thing that a field of an event may not hold.
    Event::default().event(name).id(id.to_string()).data(data.to_string())
}
