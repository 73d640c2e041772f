//! `POST /v1/flatten`: the one-call form. Stores the surface, queues the job, waits, and answers with the pattern.

use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

use super::App;
use super::answer::{Form, choose, not_acceptable};
use super::jobs::{Failure, MAX_JOB_BYTES, Part, Submission, document, faulty, submit};
use super::parameters::{self, JobRequest};
use super::problem::{Kind, Problem};
use super::request::{Media, Parts, Query, Received, Wait, key, parts, receive};
use super::results::{Choice, ResultKind, answer};
use super::surfaces::{self, Reading, SurfaceFaults};
use crate::engine::job::JobKind;
use crate::formats::faults::Fault;
use crate::formats::sniff::{Sniffed, sniff};
use crate::formats::surface_json::envelope;
use crate::store::{Digest, Job, NewSurface, State as JobState};

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
    query.only(&["format", "set", "units", "side", "weld", "wait", "allow"])?;
    let choice = Choice::read(&query)?;
    let form = form(&query, &headers)?;
    let wait = Wait::of(&query, &headers)?;
    let reading = Reading::of(&query)?;
    let mut accepted = Media::SURFACES.to_vec();
    accepted.push(Media::PARTS);
    let received = receive(app.bodies(), usize::MAX, &accepted, &headers, body).await?;
    let form_parts = match &received.media {
        Media::Multipart(media) => Some(parts(received.bytes.clone(), media, MAX_JOB_BYTES).await?),
        _ => None,
    };
    let codings = unconditional(&headers);
    let sent = app
        .on_a_thread(move || {
            let sent = Sent::of(&received, form_parts)?;
            let idempotency = key(&headers, "POST /v1/flatten", || sent.digest(&query))?;
            let (new, request) = sent.read(&query, reading)?;
            Ok((new, request, idempotency))
        })
        .await?;
    let (new, request, idempotency) = sent;
    let surface = Part::New(Box::new(new));
    let submission = Submission { kind: JobKind::Flatten, request, surface, idempotency };
    let enqueued = submit(&app, submission).await?;
    let id = enqueued.job().id;
    let job = app.ended(id, wait.unwrap_or(Wait::LONGEST)).await?.ok_or_else(super::jobs::absent)?;
    let mut response = match job.state {
        JobState::Succeeded => {
            let standing = app.store().standing(id).await?.ok_or_else(super::jobs::absent)?;
            // Refused, the answer still names the job.
            answer(&app, &standing, &codings, ResultKind::Pattern, form, choice)
                .await
                .unwrap_or_else(IntoResponse::into_response)
        }
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

/// The headers that the answer depends on beside the form. A call that makes a job is not answered by "you have it already".
fn unconditional(headers: &HeaderMap) -> HeaderMap {
    let codings = headers.get_all(header::ACCEPT_ENCODING).iter();
    codings.map(|value| (header::ACCEPT_ENCODING, value.clone())).collect()
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

/// What a body has in it: a surface by itself, or with a job beside it.
struct Sent {
    surface: Bytes,
    job: Option<Bytes>,
    /// Where the two stand in the body, for pointers.
    at: [&'static str; 2],
    faults: Vec<Fault>,
    /// What is JSON if anything of the body is.
    text: Bytes,
}

impl Sent {
    /// Takes the parts of a form, or those of `{ "surface": …, "job": … }`, or the whole as a surface.
    fn of(received: &Received, form: Option<Parts>) -> Result<Self, Problem> {
        let body = &received.bytes;
        let apart = ["/surface", "/job"];
        let alien = |name: &String| Fault {
            pointer: format!("/{name}"),
            detail: "a body with a surface has the parts surface and job, and no other".to_owned(),
            place: None,
        };
        if let Some(form) = form {
            let mut faults: Vec<Fault> = form.others.iter().map(alien).collect();
            let Some(surface) = form.surface else {
                let detail = "the part surface is needed: JSON, or glTF binary".to_owned();
                faults.insert(0, Fault { pointer: apart[0].to_owned(), detail, place: None });
                return Err(Problem::new(Kind::InvalidSurface, "The body has no surface.").with_faults(faults));
            };
            return Ok(Self { text: surface.clone(), surface, job: form.job, at: apart, faults });
        }
        let binary = sniff(body) == Some(Sniffed::GltfBinary);
        let found = if binary { Ok(None) } else { envelope(body) };
        let found = found.map_err(|fault| SurfaceFaults(vec![fault]).into_problem(body))?;
        let text = body.clone();
        let Some(found) = found else {
            return Ok(Self { surface: body.clone(), job: None, at: ["", ""], faults: Vec::new(), text });
        };
        Ok(Self {
            surface: found.surface.map_or_else(|| body.clone(), |range| body.slice(range)),
            job: found.job.map(|range| body.slice(range)),
            at: apart,
            faults: found.others.iter().map(alien).collect(),
            text,
        })
    }

    /// What makes this request another one than the next: surface, job and settings, not how the answer is to look.
    fn digest(&self, query: &Query) -> Digest {
        let job = self.job.as_ref().map_or(&b""[..], |job| job);
        let settings = query.in_order_without(&["format", "wait", "allow"]);
        Digest::of(format!("{} {} {settings}", Digest::of(&self.surface), Digest::of(job)).as_bytes())
    }

    /// The surface and the job, checked. All faults of both come together.
    fn read(mut self, query: &Query, reading: Reading) -> Result<(NewSurface, JobRequest), Problem> {
        let job = self.job.as_ref().map_or_else(|| Ok(json!({})), |job| serde_json::from_slice(job));
        let mut job = job.map_err(|error| Problem::json(&error))?;
        let surface = surfaces::read(&self.surface, reading, self.at[0])
            .map(|read| read.new)
            .map_err(|SurfaceFaults(found)| self.faults.extend(found));
        let request = request(&mut job, query, self.at[1], surface.as_ref().ok(), &mut self.faults);
        match surface {
            Ok(surface) if self.faults.is_empty() => Ok((surface, request)),
            Err(()) => Err(SurfaceFaults(self.faults).into_problem(&self.text)),
            Ok(_) => Err(faulty(self.faults)),
        }
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
    if request.surface.is_some() || request.surfaces.is_some() {
        let detail = "the surface is in the body: leave its id out, or use POST /v1/jobs".to_owned();
        let pointer = if request.surface.is_some() { "/surface" } else { "/surfaces" };
        found.push(Fault { pointer: pointer.to_owned(), detail, place: None });
    }
    let domain = surface.and_then(|surface| surfaces::domain_of(&surface.summary));
    found.extend(parameters::check(&request.options, domain));
    faults.extend(found.into_iter().map(|fault| Fault { pointer: format!("{prefix}{}", fault.pointer), ..fault }));
    request
}
