//! A job as the API tells of it.

use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::api::answer::{Form, Tag};
use crate::api::parameters::with_defaults;
use crate::api::problem::{Kind, Problem};
use crate::api::results::ResultKind;
use crate::api::times::rfc3339;
use crate::engine::error::{Place, Remedy};
use crate::engine::job::JobOptions;
use crate::store::{Job, JobId, StoredResult};

/// Why a job failed, as it was stored.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(crate) struct Failure {
    /// The engine's code.
    #[serde(default = "unknown")]
    pub code: String,
    /// In words.
    #[serde(default = "unknown")]
    pub detail: String,
    /// Where.
    #[serde(default)]
    pub place: Option<Place>,
    /// What to try.
    #[serde(default)]
    pub remedies: Vec<Remedy>,
}

fn unknown() -> String {
    "unknown".to_owned()
}

impl Failure {
    /// Why this job failed; none when it did not.
    #[must_use]
    pub(crate) fn of(job: &Job) -> Option<Self> {
        Self::stored(job.id, job.problem.as_ref())
    }

    /// The failure that was stored as this problem of a job.
    #[must_use]
    pub(crate) fn stored(job: JobId, problem: Option<&Value>) -> Option<Self> {
        Some(serde_json::from_value(problem?.clone()).unwrap_or_else(|error| {
            tracing::error!(%job, %error, "the problem of a job cannot be read");
            Self { code: unknown(), detail: "The reason was lost.".to_owned(), place: None, remedies: Vec::new() }
        }))
    }

    /// As a problem of this kind.
    #[must_use]
    pub(crate) fn into_problem(self, kind: Kind) -> Problem {
        Problem::new(kind, self.detail).stored(self.code, self.place, self.remedies)
    }
}

/// The tag of a job's document: it changes with every change of the job.
#[must_use]
pub(crate) fn tag(job: &Job) -> Tag {
    Tag::of(&[job.id.to_string().as_bytes(), &job.revision.to_le_bytes(), env!("CARGO_PKG_VERSION").as_bytes()])
}

/// The document. `results` are the stored ones; a listing leaves them out.
#[must_use]
pub(crate) fn document(job: &Job, results: &[StoredResult]) -> Value {
    let address = format!("/v1/jobs/{}", job.id);
    let mut document = Map::new();
    let mut put = |name: &str, value: Value| document.insert(name.to_owned(), value);
    put("id", json!(job.id));
    put("kind", json!(job.kind));
    put("state", json!(job.state));
    put("surface", json!(job.surface));
    put("labels", json!(job.labels));
    put("parameters", parameters(job));
    let remaining = job.remaining_ms.map(|ms| ms as f64 / 1e3);
    put("progress", json!({ "fraction": job.progress, "stage": job.stage, "remaining_s": remaining }));
    put("attempts", json!(job.attempt));
    put("cancel_requested", json!(job.cancel_requested));
    put("verdict", json!(job.verdict));
    put("created_at", json!(rfc3339(job.created_us)));
    put("started_at", json!(job.started_us.map(rfc3339)));
    put("finished_at", json!(job.finished_us.map(rfc3339)));
    put("timings_ms", job.timings.clone().unwrap_or_else(|| json!({})));
    if let Some(failure) = Failure::of(job) {
        put("problem", json!(failure.into_problem(Kind::JobFailed).document(&address)));
    }
    put("results", Value::Array(results.iter().flat_map(|result| links(&address, result)).collect()));
    put(
        "links",
        json!({ "self": address, "cancel": format!("{address}/cancel"), "surface": format!("/v1/surfaces/{}", job.surface) }),
    );
    Value::Object(document)
}

/// The parameters with the defaults that were taken: those that the work found, or as far as they are known before.
fn parameters(job: &Job) -> Value {
    let known = job.resolved.as_ref().unwrap_or(&job.parameters);
    match serde_json::from_value::<JobOptions>(known.clone()) {
        Ok(options) => Value::Object(with_defaults(&options)),
        Err(error) => {
            tracing::error!(job = %job.id, %error, "the parameters of a job cannot be read");
            known.clone()
        }
    }
}

/// A link to each form of a result, and of what is made of it alone.
fn links(address: &str, result: &StoredResult) -> Vec<Value> {
    let link = |kind: ResultKind, form: &Form| json!({ "rel": kind.name(), "href": format!("{address}/{}.{}", kind.name(), form.suffix()), "type": form.media() });
    let made_of_it = |kind: &ResultKind| kind.forms().first().is_some_and(|form| kind.stored_as(*form) == result.name);
    let kinds = ResultKind::ALL.into_iter().filter(made_of_it);
    kinds.flat_map(|kind| kind.forms().iter().map(move |form| link(kind, form))).collect()
}
