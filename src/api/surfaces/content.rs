//! `GET /v1/surfaces/{surface}/content`: the bytes as they were sent.

use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};

use super::{absent, id_of};
use crate::api::App;
use crate::api::answer::{Tag, disposition};
use crate::api::problem::Problem;
use crate::api::request::Query;
use crate::formats::surface::Media;

/// The bytes.
pub(crate) async fn content(
    State(app): State<App>,
    Path(id): Path<String>,
    query: Query,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    query.only(&[])?;
    let id = id_of(&id)?;
    let surface = app.store().surface(&id).await?.ok_or_else(absent)?;
    let tag = Tag::of(&[surface.digest.to_string().as_bytes()]);
    if let Some(answer) = tag.not_modified(&headers) {
        return Ok(answer);
    }
    let (surface, bytes) = app.store().surface_content(&id).await?.ok_or_else(absent)?;
    let media = HeaderValue::from_str(&surface.media).unwrap_or(HeaderValue::from_static("application/octet-stream"));
    let stem = surface.name.as_deref().unwrap_or_default();
    let headers = [
        (header::CONTENT_TYPE, media),
        (header::ETAG, tag.header()),
        (header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache")),
        (header::CONTENT_DISPOSITION, disposition(stem, "surface", Media::suffix(&surface.media), true)),
    ];
    Ok((headers, bytes).into_response())
}
