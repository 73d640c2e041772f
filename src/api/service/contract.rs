//! `GET /openapi.yaml`: the contract.

use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};

use crate::api::answer::Tag;
use crate::api::problem::Problem;
use crate::api::request::Query;

/// The contract's text, the very file of this project.
pub const CONTRACT: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/openapi.yaml"));

/// The contract.
pub(crate) async fn contract(query: Query, headers: HeaderMap) -> Result<Response, Problem> {
    query.only(&[])?;
    let tag = Tag::of(&[CONTRACT.as_bytes()]);
    if let Some(answer) = tag.not_modified(&headers) {
        return Ok(answer);
    }
    let headers = [
        (header::CONTENT_TYPE, axum::http::HeaderValue::from_static("application/yaml")),
        (header::ETAG, tag.header()),
        (header::CACHE_CONTROL, axum::http::HeaderValue::from_static("no-cache")),
    ];
    Ok((headers, CONTRACT).into_response())
}
