//! `DELETE /v1/surfaces/{surface}`.

use axum::extract::{Path, State};
use axum::http::StatusCode;

use super::{absent, id_of};
use crate::api::App;
use crate::api::problem::{Kind, Problem};
use crate::api::request::Query;
use crate::store::Removal;

/// 204; 409 while a job needs it. Results of jobs that have ended stay.
pub(crate) async fn delete(
    State(app): State<App>,
    Path(id): Path<String>,
    query: Query,
) -> Result<StatusCode, Problem> {
    query.only(&[])?;
    match app.store().remove_surface(&id_of(&id)?).await? {
        Removal::Removed => Ok(StatusCode::NO_CONTENT),
        Removal::Absent => Err(absent()),
        Removal::InUse => Err(Problem::new(
            Kind::SurfaceInUse,
            "A job that waits or runs needs this surface. Wait for it, or cancel it.",
        )),
    }
}
