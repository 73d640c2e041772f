//! `POST /v1/flatten`: the one-call form. Stores the surface, queues the job, waits, and answers with the pattern.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

use super::App;
use super::answer::{Form, choose, not_acceptable};
use super::jobs::{Failure, Submission, document, faulty, submit};
use super::parameters::{self, JobRequest};
use super::problem::{Kind, Problem};
use super::request::{Query, Received, Wait, receive};
use super::results::{ResultKind, answer};
use super::surfaces::{self, Reading, SurfaceFaults};
use crate::engine::job::JobKind;
use crate::formats::faults::Fault;
use crate::formats::surface_json::envelope;
use crate::store::{Job, NewSurface, State as JobState};

const JOB: HeaderName = HeaderName::from_static("planish-job");
const VERDICT: HeaderName = HeaderName::from_static("planish-verdict");

/// The pattern (200), or where the job is when it has not ended in time (202).
pub(super) async fn flatten(
    State(app): State<App>,
    query: Query,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    app.admit()?;
    query.only(&["format", "set", "units", "side", "wait"])?;
    let form = form(&query, &headers)?;
    let wait = Wait::of(&query, &headers)?;
    let reading = Reading::of(&query)?;
    let received = receive(app.bodies(), usize::MAX, &headers, body).await?;
    let (new, request) = app.on_a_thread(move || parts(&received, &query, reading)).await?;
    let (surface, _) = app.store().put_surface(new).await?;
    let submission = Submission { kind: JobKind::Flatten, request, surface, idempotency: None };
    let enqueued = submit(&app, submission).await?;
    let id = enqueued.job().id;
    let job = app.ended(id, wait.unwrap_or(Wait::LONGEST)).await?.ok_or_else(super::jobs::absent)?;
    let mut response = match job.state {
        JobState::Succeeded => answer(&app, &job, &HeaderMap::new(), ResultKind::Pattern, form).await?,
        JobState::Failed => failed(&job).into_response(),
        JobState::Cancelled => {
            Problem::new(Kind::JobCancelled, "The job was cancelled before it ended.").into_response()
        }
        JobState::Queued | JobState::Running => {
            (StatusCode::ACCEPTED, [(header::RETRY_AFTER, HeaderValue::from(1))], Json(document(&job, &[])))
                .into_response()
        }
    };
    let headers = response.headers_mut();
    let address = format!("/v1/jobs/{id}");
    if let (Ok(id), Ok(address)) = (HeaderValue::from_str(&id.to_string()), HeaderValue::from_str(&address)) {
        headers.insert(JOB, id);
        headers.insert(
            if job.state == JobState::Succeeded { header::CONTENT_LOCATION } else { header::LOCATION },
            address,
        );
    }
    if let Some(verdict) = job.verdict.as_deref().and_then(|verdict| HeaderValue::from_str(verdict).ok()) {
        headers.insert(VERDICT, verdict);
    }
    if let Some(wait) = wait {
        wait.acknowledge(headers);
    }
    Ok(response)
}

/// The form of the pattern: what `format` says, else what `Accept` likes best.
fn form(query: &Query, headers: &HeaderMap) -> Result<Form, Problem> {
    let forms = ResultKind::Pattern.forms();
    match query.get("format") {
        Some(suffix) => Form::by_suffix(suffix, forms).ok_or_else(|| not_acceptable(forms)),
        None => choose(headers, forms),
    }
}

/// Why the job failed, as the answer to the call that made it.
fn failed(job: &Job) -> Problem {
    match Failure::of(job) {
        Some(failure) => failure.into_problem(Kind::JobFailed),
        None => Problem::internal(),
    }
}

/// The surface and the job of a body: `{ "surface": …, "job": … }`, or a surface by itself; with the query's settings.
/// All faults of both come together.
fn parts(received: &Received, query: &Query, reading: Reading) -> Result<(NewSurface, JobRequest), Problem> {
    let body = &received.bytes;
    let envelope = envelope(body).map_err(|fault| SurfaceFaults(vec![fault]).into_problem(body))?;
    let mut faults = Vec::new();
    let (surface, prefix, mut job) = match envelope {
        None => (body.clone(), "", json!({})),
        Some(parts) => {
            let alien = |name: &String| Fault {
                pointer: format!("/{name}"),
                detail: "a body with a surface has the fields surface and job, and no other".to_owned(),
                place: None,
            };
            faults.extend(parts.others.iter().map(alien));
            let job = parts.job.map_or_else(|| Ok(json!({})), |range| serde_json::from_slice(&body[range]));
            let surface = parts.surface.map_or_else(|| body.clone(), |range| body.slice(range));
            (surface, "/surface", job.map_err(|error| Problem::json(&error))?)
        }
    };
    let job_prefix = if prefix.is_empty() { "" } else { "/job" };
    let surface = surfaces::read(&surface, reading, prefix)
        .map(|read| read.new)
        .map_err(|SurfaceFaults(found)| faults.extend(found));
    let surface_faulty = surface.is_err();
    let request = request(&mut job, query, job_prefix, surface.as_ref().ok(), &mut faults);
    match surface {
        Ok(surface) if faults.is_empty() => Ok((surface, request)),
        _ if surface_faulty => Err(SurfaceFaults(faults).into_problem(body)),
        _ => Err(faulty(faults)),
    }
}

/// The job's parameters, checked; what is wrong with them is added to `faults`.
fn request(
    job: &mut Value,
    query: &Query,
    prefix: &str,
    surface: Option<&NewSurface>,
    faults: &mut Vec<Fault>,
) -> JobRequest {
    let mut found = query.assign_to(job).err().unwrap_or_default();
    let (request, read) = parameters::read(std::mem::take(job));
    found.extend(read);
    if request.kind.is_some_and(|kind| kind != JobKind::Flatten) {
        found.push(Fault {
            pointer: "/kind".to_owned(),
            detail: "this call flattens: leave the kind out".to_owned(),
            place: None,
        });
    }
    if request.surface.is_some() {
        let detail = "the surface is in the body: leave its id out, or use POST /v1/jobs".to_owned();
        found.push(Fault { pointer: "/surface".to_owned(), detail, place: None });
    }
    let domain = surface.and_then(|surface| surfaces::domain_of(&surface.summary));
    found.extend(parameters::check(&request.options, domain));
    faults.extend(found.into_iter().map(|fault| Fault { pointer: format!("{prefix}{}", fault.pointer), ..fault }));
    request
}
