//! `POST /v1/surfaces`: checks a surface from end to end and stores it.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::{Reading, document, read};
use crate::api::App;
use crate::api::problem::Problem;
use crate::api::request::{Media, Query, receive};

/// 201 for a new surface, 200 for one that is there already; the id depends on the content and how it is read alone.
pub(crate) async fn create(
    State(app): State<App>,
    query: Query,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    app.admit()?;
    query.only(&["units", "side", "weld"])?;
    let reading = Reading::of(&query)?;
    let received = receive(app.bodies(), usize::MAX, &Media::SURFACES, &headers, body).await?;
    let new = app
        .on_a_thread(move || {
            let bytes = received.bytes.clone();
            read(&bytes, reading, "").map(|read| read.new).map_err(|faults| faults.into_problem(&received.bytes))
        })
        .await?;
    let (surface, is_new) = app.store().put_surface(new).await?;
    let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
    let location = format!("/v1/surfaces/{}", surface.id);
    Ok((status, [(header::LOCATION, location)], Json(document(&surface))).into_response())
}
