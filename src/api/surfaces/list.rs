//! `GET /v1/surfaces`: all surfaces, newest first, page by page.

use axum::Json;
use axum::extract::State;
use serde_json::{Value, json};

use super::document;
use crate::api::App;
use crate::api::cursor;
use crate::api::problem::Problem;
use crate::api::request::Query;

/// A page.
pub(crate) async fn list(State(app): State<App>, query: Query) -> Result<Json<Value>, Problem> {
    query.only(&["limit", "cursor"])?;
    let limit = cursor::limit(&query)?;
    let before = query.get("cursor").map(|text| cursor::read(text, "surfaces")).transpose()?;
    // One more than asked for tells whether there is a next page.
    let mut surfaces = app.store().surfaces(before, limit + 1).await?;
    let more = surfaces.len() > limit as usize;
    surfaces.truncate(limit as usize);
    let next = surfaces
        .last()
        .filter(|_| more)
        .map(|last| format!("/v1/surfaces?limit={limit}&cursor={}", cursor::write(last.seq, "surfaces")));
    Ok(Json(json!({ "items": surfaces.iter().map(document).collect::<Vec<_>>(), "next": next })))
}
