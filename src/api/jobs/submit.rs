//! Queueing a job: what `POST /v1/jobs` and `POST /v1/flatten` share.

use crate::api::App;
use crate::api::parameters::{JobRequest, PartSize, cost};
use crate::api::problem::{Kind, Problem};
use crate::api::surfaces;
use crate::engine::job::JobKind;
use crate::formats::faults::Fault;
use crate::store::{Enqueued, IdempotencyKey, NewJob, Surface};

/// A job that can be queued.
#[derive(Debug)]
pub(crate) struct Submission {
    /// The kind of work.
    pub kind: JobKind,
    /// What was asked for.
    pub request: JobRequest,
    /// The surface.
    pub surface: Surface,
    /// The client's key.
    pub idempotency: Option<IdempotencyKey>,
}

/// The problem of parameters with these faults.
#[must_use]
pub(crate) fn faulty(faults: Vec<Fault>) -> Problem {
    Problem::new(Kind::InvalidParameters, "The job's parameters have faults. Nothing was stored.").with_faults(faults)
}

/// Queues a job whose parameters were checked. When this returns it is on disk.
///
/// # Errors
/// 503 when the queue is full.
pub(crate) async fn submit(app: &App, submission: Submission) -> Result<Enqueued, Problem> {
    let Submission { kind, request, surface, idempotency } = submission;
    // The labels of the file go along; those of the job go before them.
    let mut labels = surfaces::labels(&surface);
    labels.extend(request.labels);
    let cost = cost(kind, &request.options, PartSize::of(&surface.summary));
    let parameters = serde_json::to_value(&request.options).map_err(|error| {
        tracing::error!(%error, "options could not be written");
        Problem::internal()
    })?;
    let kind = match kind {
        JobKind::Triangulate => "triangulate",
        JobKind::Flatten => "flatten",
    };
    let new = NewJob { kind: kind.to_owned(), surface: surface.id, parameters, labels, cost, idempotency };
    Ok(app.queue().enqueue(new).await?)
}
