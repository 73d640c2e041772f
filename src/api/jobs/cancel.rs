//! `POST /v1/jobs/{job}/cancel`.

use axum::Json;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use serde_json::Value;

use super::{absent, document, id_of};
use crate::api::App;
use crate::api::problem::{Kind, Problem};
use crate::api::request::Query;
use crate::store::Cancelled;

/// 202 also when it had been cancelled before; 409 when it has succeeded or failed.
pub(crate) async fn cancel(
    State(app): State<App>,
    Path(id): Path<String>,
    query: Query,
) -> Result<(StatusCode, Json<Value>), Problem> {
    query.only(&[])?;
    match app.queue().cancel(id_of(&id)?).await?.ok_or_else(absent)? {
        Cancelled::Ended(job) | Cancelled::Requested(job) => Ok((StatusCode::ACCEPTED, Json(document(&job, &[])))),
        Cancelled::TooLate(job) => {
            Err(Problem::new(Kind::JobFinal, format!("The job has {} and can no longer be cancelled.", job.state)))
        }
    }
}
