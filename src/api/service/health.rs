//! `GET /healthz`: the process lives. `GET /readyz`: it can take work.

use axum::Json;
use axum::extract::State;
use serde_json::{Value, json};

use crate::api::App;
use crate::api::problem::Problem;

/// Alive.
pub(crate) async fn healthz() -> Json<Value> {
    Json(json!({ "status": "alive" }))
}

/// Ready: the database can be read and written, and the service is not shutting down.
pub(crate) async fn readyz(State(app): State<App>) -> Result<Json<Value>, Problem> {
    app.admit()?;
    app.store().ping().await?;
    Ok(Json(json!({ "status": "ready" })))
}
