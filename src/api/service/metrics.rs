//! `GET /metrics`: the service in numbers, as `OpenMetrics` text.

use std::time::Duration;

use axum::extract::State;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};

use crate::api::App;
use crate::api::problem::Problem;
use crate::api::request::Query;
use crate::store::{State as JobState, StoreError};
use crate::telemetry::{Standing, Stored};

const MEDIA: HeaderValue = HeaderValue::from_static("application/openmetrics-text; version=1.0.0; charset=utf-8");

/// The numbers. They are given also when the database does not answer, without those that it knows.
pub(crate) async fn metrics(State(app): State<App>, query: Query) -> Result<Response, Problem> {
    query.only(&[])?;
    let stored = match stored(&app).await {
        Ok(stored) => Some(stored),
        Err(error) => {
            tracing::warn!(%error, "the database does not answer to the metrics");
            None
        }
    };
    let (workers, stuck) = app.queue().workers();
    let standing = Standing { stored, workers, stuck, streams: app.streams_open() };
    let text = app.store().metrics().text(&standing).map_err(|error| {
        tracing::error!(%error, "the metrics could not be written");
        Problem::internal()
    })?;
    Ok(([(header::CONTENT_TYPE, MEDIA), (header::CACHE_CONTROL, HeaderValue::from_static("no-store"))], text)
        .into_response())
}

async fn stored(app: &App) -> Result<Stored, StoreError> {
    let open = app.store().open_jobs().await?;
    let (database_bytes, log_bytes) = app.store().size().await?;
    let oldest = open.iter().filter(|open| open.state == JobState::Queued).map(|open| open.oldest_us).min();
    let age_us = oldest.map_or(0, |oldest| app.store().clock().wall_us().saturating_sub(oldest));
    Ok(Stored {
        open: open.into_iter().map(|open| (open.kind, open.state.name(), open.jobs)).collect(),
        queue_age: Duration::from_micros(u64::try_from(age_us).unwrap_or(0)),
        database_bytes,
        log_bytes,
    })
}
