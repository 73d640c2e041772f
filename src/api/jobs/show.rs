//! `GET /v1/jobs/{job}`: how a job stands, at once or when it has ended.

use axum::Json;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};

use super::{absent, document, id_of, tag};
use crate::api::App;
use crate::api::problem::Problem;
use crate::api::request::{Query, Wait};

/// 200 also for a failed job: the poll succeeded. With `wait` the answer comes when the job has ended or time is up.
pub(crate) async fn show(
    State(app): State<App>,
    Path(id): Path<String>,
    query: Query,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    query.only(&["wait"])?;
    let wait = Wait::of(&query, &headers)?;
    let id = id_of(&id)?;
    let job = match wait {
        Some(wait) => app.ended(id, wait).await?,
        None => app.store().job(id).await?,
    }
    .ok_or_else(absent)?;
    let tag = tag(&job);
    let mut answer = if let Some(answer) = tag.not_modified(&headers) {
        answer
    } else {
        let results = if job.state.has_ended() { app.store().results(id).await? } else { Vec::new() };
        let headers =
            [(header::ETAG, tag.header()), (header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache"))];
        (headers, Json(document(&job, &results))).into_response()
    };
    if let Some(wait) = wait {
        wait.acknowledge(answer.headers_mut());
    }
    if !job.state.has_ended() {
        answer.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(1));
    }
    Ok(answer)
}
