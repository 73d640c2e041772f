//! `GET /v1/jobs`: jobs, newest first, page by page, filtered.

use axum::Json;
use axum::extract::State;
use serde_json::{Value, json};

use super::document;
use super::filter::filter;
use crate::api::App;
use crate::api::cursor;
use crate::api::problem::Problem;
use crate::api::request::Query;

/// A page.
pub(crate) async fn list(State(app): State<App>, query: Query) -> Result<Json<Value>, Problem> {
    let (filter, text) = filter(&query, &["limit", "cursor"])?;
    let limit = cursor::limit(&query)?;
    let before = query.get("cursor").map(|cursor| cursor::read(cursor, &text)).transpose()?;
    // One more than asked for tells whether there is a next page.
    let mut jobs = app.store().jobs(&filter, before, limit + 1).await?;
    let more = jobs.len() > limit as usize;
    jobs.truncate(limit as usize);
    let next = jobs.last().filter(|_| more).map(|last| {
        let separator = if text.is_empty() { "" } else { "&" };
        format!("/v1/jobs?{text}{separator}limit={limit}&cursor={}", cursor::write(last.seq, &text))
    });
    Ok(Json(json!({ "items": jobs.iter().map(|job| document(job, &[])).collect::<Vec<_>>(), "next": next })))
}
