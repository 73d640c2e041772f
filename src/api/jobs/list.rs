//! `GET /v1/jobs`: jobs, newest first, page by page, filtered.

use axum::Json;
use axum::extract::State;
use serde_json::{Value, json};

use super::document;
use crate::api::App;
use crate::api::cursor;
use crate::api::problem::Problem;
use crate::api::request::Query;
use crate::engine::job::JobKind;
use crate::store::{JobFilter, State as JobState, SurfaceId};

/// A page.
pub(crate) async fn list(State(app): State<App>, query: Query) -> Result<Json<Value>, Problem> {
    let (filter, text) = filter(&query)?;
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

/// The filter of a query, and the same as the canonical text that cursors and links carry.
fn filter(query: &Query) -> Result<(JobFilter, String), Problem> {
    let mut known = vec!["limit", "cursor", "state", "kind", "surface", "verdict"];
    known.extend(query.names().filter(|name| name.starts_with("label.")));
    query.only(&known)?;
    let state = query.parsed::<JobState>("state", "queued, running, succeeded, failed or cancelled")?;
    let kind = query.get("kind").map(str::to_owned);
    query.word::<JobKind>("kind", "triangulate or flatten")?;
    let surface = query.parsed::<SurfaceId>("surface", "the id of a surface")?;
    let verdict = query.get("verdict").map(str::to_owned);
    if let Some(verdict) = &verdict
        && !["pass", "fail", "unchecked"].contains(&verdict.as_str())
    {
        return Err(Problem::query("verdict", "must be pass, fail or unchecked"));
    }
    let labels = query
        .names()
        .filter_map(|name| Some((name.strip_prefix("label.")?.to_owned(), query.get(name)?.to_owned())))
        .collect();
    let text = query.canonical_without(&["limit", "cursor"]);
    Ok((JobFilter { state, kind, surface, verdict, labels }, text))
}
