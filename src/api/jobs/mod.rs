//! Jobs: what was asked for.

mod cancel;
mod composed;
mod create;
mod delete;
mod document;
mod events;
mod feed;
mod filter;
mod list;
mod show;
mod submit;

use crate::api::problem::{Kind, Problem};
use crate::store::JobId;

pub(crate) use cancel::cancel;
pub(crate) use create::{MAX_JOB_BYTES, create};
pub(crate) use delete::delete;
pub(crate) use document::{Failure, document, tag};
pub(crate) use events::events;
pub(crate) use feed::feed;
pub(crate) use list::list;
pub(crate) use show::show;
pub(crate) use submit::{Part, Submission, faulty, submit};

/// The id of a job from an address. What is no id names no job.
pub(crate) fn id_of(text: &str) -> Result<JobId, Problem> {
    text.parse().map_err(|_| absent())
}

/// There is no such job.
#[must_use]
pub(crate) fn absent() -> Problem {
    Problem::new(Kind::JobNotFound, "No job has this id: it was never made, or it has been deleted.")
}
