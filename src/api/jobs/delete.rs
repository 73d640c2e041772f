//! `DELETE /v1/jobs/{job}`: removes an ended job and its results.

use axum::extract::{Path, State};
use axum::http::StatusCode;

use super::{absent, id_of};
use crate::api::App;
use crate::api::problem::{Kind, Problem};
use crate::api::request::Query;
use crate::store::Removal;

/// 204; 409 while it waits or runs.
pub(crate) async fn delete(
    State(app): State<App>,
    Path(id): Path<String>,
    query: Query,
) -> Result<StatusCode, Problem> {
    query.only(&[])?;
    match app.store().remove_job(id_of(&id)?).await? {
        Removal::Removed => Ok(StatusCode::NO_CONTENT),
        Removal::Absent => Err(absent()),
        Removal::InUse => Err(Problem::new(
            Kind::JobNotEnded,
            "The job waits or runs. Cancel it first (POST to its /cancel), or wait for its end.",
        )),
    }
}
