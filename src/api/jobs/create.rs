//! `POST /v1/jobs`: always 202, so that clients have one way to go.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::submit::faulty;
use super::{Part, Submission, composed, document, submit};
use crate::api::App;
use crate::api::parameters;
use crate::api::problem::Problem;
use crate::api::request::{Media, Query, key, receive};
use crate::api::surfaces;
use crate::formats::faults::Fault;
use crate::store::Digest;

/// What is said of an id that no surface has.
pub(super) const ABSENT: &str = "there is no surface with this id: send it first, with POST /v1/surfaces";

/// Longest job, bytes: some hundred times one with every parameter.
pub(crate) const MAX_JOB_BYTES: usize = 256 * 1024;

/// Queues a job on a stored surface.
pub(crate) async fn create(
    State(app): State<App>,
    query: Query,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    app.admit()?;
    query.only(&[])?;
    let received = receive(app.bodies(), MAX_JOB_BYTES, &[Media::Json], &headers, body).await?;
    let idempotency = key(&headers, "POST /v1/jobs", || Digest::of(&received.bytes))?;
    let value = serde_json::from_slice(&received.bytes).map_err(|error| Problem::json(&error))?;
    let (request, mut faults) = parameters::read(value);
    let needed = format!("the kind of work is needed: {}", parameters::KINDS);
    require(request.kind.is_some(), "/kind", &needed, &mut faults);
    let surface = match &request.surfaces {
        Some(ids) => {
            if request.surface.is_some() {
                faults.push(fault("/surface", "give either one surface or a list of surfaces, not both"));
            }
            composed::composed(&app, ids, &mut faults).await?
        }
        // A list that could not be read has its fault already.
        None if faults.iter().any(|fault| fault.pointer == "/surfaces") => None,
        None => named(&app, request.surface.as_deref(), &mut faults).await?,
    };
    let domain = match &surface {
        Some(Part::Stored(surface)) => surfaces::domain(surface),
        Some(Part::New(_)) | None => None,
    };
    faults.extend(parameters::check(&request.options, domain));
    faults.extend(request.kind.into_iter().flat_map(|kind| parameters::check_kind(kind, &request.options)));
    let (Some(kind), Some(surface), true) = (request.kind, surface, faults.is_empty()) else {
        return Err(faulty(faults));
    };
    let enqueued = submit(&app, Submission { kind, request, surface, idempotency }).await?;
    let job = enqueued.job();
    let headers = [
        (
            header::LOCATION,
            HeaderValue::from_str(&format!("/v1/jobs/{}", job.id)).unwrap_or(HeaderValue::from_static("/")),
        ),
        (header::RETRY_AFTER, HeaderValue::from(1)),
    ];
    Ok((StatusCode::ACCEPTED, headers, Json(document(job, &[]))).into_response())
}

/// The surface that a job names.
async fn named(app: &App, id: Option<&str>, faults: &mut Vec<Fault>) -> Result<Option<Part>, Problem> {
    require(id.is_some(), "/surface", "the id of a surface is needed, as POST /v1/surfaces gave it", faults);
    let surface = match id.and_then(|text| text.parse().ok()) {
        Some(id) => app.store().surface(&id).await?,
        None => None,
    };
    require(surface.is_some(), "/surface", ABSENT, faults);
    Ok(surface.map(|surface| Part::Stored(Box::new(surface))))
}

/// Adds a fault when something is not there, unless one at the same place says why.
fn require(there: bool, pointer: &str, detail: &str, faults: &mut Vec<Fault>) {
    if !there && !faults.iter().any(|fault| fault.pointer == pointer || fault.pointer.is_empty()) {
        faults.push(fault(pointer, detail));
    }
}

pub(super) fn fault(pointer: &str, detail: &str) -> Fault {
    Fault { pointer: pointer.to_owned(), detail: detail.to_owned(), place: None }
}
