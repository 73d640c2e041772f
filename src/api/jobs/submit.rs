//! Queueing a job: what `POST /v1/jobs` and `POST /v1/flatten` share.

use serde_json::Value;

use crate::api::App;
use crate::api::parameters::{JobRequest, MAX_VISITS, PartSize, VISITS_PER_SECOND, cost};
use crate::api::problem::{Kind, Problem};
use crate::api::surfaces;
use crate::engine::error::{Remedy, SetValue};
use crate::engine::job::JobKind;
use crate::formats::faults::Fault;
use crate::store::{Enqueued, IdempotencyKey, NewJob, NewSurface, Surface, SurfaceId};

/// What a job is about.
#[derive(Debug)]
pub(crate) enum Part {
    /// A surface that is stored.
    Stored(Box<Surface>),
    /// One that is to be stored with the job.
    New(Box<NewSurface>),
}

impl Part {
    fn summary(&self) -> &Value {
        match self {
            Self::Stored(surface) => &surface.summary,
            Self::New(surface) => &surface.summary,
        }
    }

    fn name(&self) -> Option<&str> {
        match self {
            Self::Stored(surface) => surface.name.as_deref(),
            Self::New(surface) => surface.name.as_deref(),
        }
    }

    fn id(&self) -> &SurfaceId {
        match self {
            Self::Stored(surface) => &surface.id,
            Self::New(surface) => surface.id(),
        }
    }
}

/// A job that can be queued.
#[derive(Debug)]
pub(crate) struct Submission {
    /// The kind of work.
    pub kind: JobKind,
    /// What was asked for.
    pub request: JobRequest,
    /// The surface.
    pub surface: Part,
    /// The client's key.
    pub idempotency: Option<IdempotencyKey>,
}

/// The problem of parameters with these faults.
#[must_use]
pub(crate) fn faulty(faults: Vec<Fault>) -> Problem {
    Problem::new(Kind::InvalidParameters, "The job's parameters have faults. Nothing was stored.").with_faults(faults)
}

/// Why a job of this cost is not taken, when it is not.
fn too_large(cost: u64) -> Option<Problem> {
    if cost <= MAX_VISITS {
        return None;
    }
    let (minutes, most) = (cost / (60 * VISITS_PER_SECOND), MAX_VISITS / (60 * VISITS_PER_SECOND));
    let detail = format!(
        "Trying every seed of this mesh would take some {minutes} minutes, and a job may take {most}. Nothing was stored."
    );
    let predicted = Remedy::say("Let the shape tell which few seeds to try.")
        .with("search.strategy", SetValue::Text("predicted".to_owned()))
        .with("flattening.seed", SetValue::Nothing);
    let budget = Remedy::say("Give the search a budget: then the best seed found in it is taken.")
        .with("search.budget_s", SetValue::Number(60.0));
    Some(
        Problem::new(Kind::TooLarge, detail)
            .with_remedy(budget)
            .with_remedy(predicted)
            .with_remedy(Remedy::say("Take a coarser triangulation: the time goes with the square of its triangles.")),
    )
}

/// Queues a job whose parameters were checked. When this returns it is on disk.
///
/// # Errors
/// 422 when it would take too long, 503 when the queue is full.
pub(crate) async fn submit(app: &App, submission: Submission) -> Result<Enqueued, Problem> {
    let Submission { kind, request, surface, idempotency } = submission;
    // The labels of the file go along; those of the job go before them.
    let mut labels = surfaces::labels_of(surface.summary(), surface.name());
    labels.extend(request.labels);
    let cost = cost(kind, &request.options, PartSize::of(surface.summary()));
    if let Some(problem) = too_large(cost) {
        return Err(problem);
    }
    let parameters = serde_json::to_value(&request.options).map_err(|error| {
        tracing::error!(%error, "options could not be written");
        Problem::internal()
    })?;
    let new =
        NewJob { kind: kind.name().to_owned(), surface: surface.id().clone(), parameters, labels, cost, idempotency };
    Ok(match surface {
        Part::Stored(_) => app.queue().enqueue(new).await?,
        Part::New(surface) => app.queue().enqueue_with_surface(*surface, new).await?,
    })
}
