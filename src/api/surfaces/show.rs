//! `GET /v1/surfaces/{surface}`: what is known of a surface.

use axum::Json;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};

use super::{absent, document, id_of};
use crate::api::App;
use crate::api::answer::Tag;
use crate::api::problem::Problem;
use crate::api::request::Query;

/// The summary.
pub(crate) async fn show(
    State(app): State<App>,
    Path(id): Path<String>,
    query: Query,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    query.only(&[])?;
    let surface = app.store().surface(&id_of(&id)?).await?.ok_or_else(absent)?;
    let document = document(&surface);
    let tag = Tag::of(&[document.to_string().as_bytes()]);
    if let Some(answer) = tag.not_modified(&headers) {
        return Ok(answer);
    }
    Ok(([(header::ETAG, tag.header())], Json(document)).into_response())
}
