//! Where problems come from: errors of the lower floors and of the framework, mapped here and nowhere else.

use std::any::Any;

use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::response::{IntoResponse, Response};

use super::{Kind, Problem};
use crate::formats::faults::Fault;
use crate::store::{EnqueueError, StoreError};

/// The answer to a request whose handler panicked. The panic's own words go to the log, not to the client.
#[expect(clippy::needless_pass_by_value, reason = "the signature that the layer calls")]
pub fn panicked(panic: Box<dyn Any + Send + 'static>) -> Response {
    let words = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no words");
    tracing::error!(panic = words, "a request handler panicked: {words}");
    Problem::internal().into_response()
}

impl Problem {
    /// A fault of the service. The cause must have been logged.
    #[must_use]
    pub fn internal() -> Self {
        Self::new(Kind::Internal, "Something in the service itself went wrong; nothing is wrong with your request.")
    }

    /// JSON that does not parse, with the place where reading stopped.
    #[must_use]
    pub fn json(error: &serde_json::Error) -> Self {
        let text = error.to_string();
        let text = text.split(" at line ").next().unwrap_or(&text);
        Self::new(Kind::InvalidJson, format!("Line {}, column {}: {text}.", error.line(), error.column()))
    }
}

/// What a client is told to wait when the database did not answer, seconds.
const STORAGE_RETRY_S: u32 = 5;
/// What a client is told to wait when the queue is full, seconds: some jobs end in that time.
const QUEUE_RETRY_S: u32 = 10;

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Busy => {
                tracing::warn!(%error, "the database did not answer in time");
                Self::new(Kind::StorageUnavailable, "The database did not answer in time.").retry_after(STORAGE_RETRY_S)
            }
            StoreError::Full => {
                tracing::error!(%error, "there is no room left to write to");
                Self::new(Kind::StorageFull, "There is no room left to keep what was sent. Nothing was stored.")
            }
            StoreError::Interrupted => {
                Self::new(Kind::Draining, "The service is shutting down.").retry_after(STORAGE_RETRY_S)
            }
            error => {
                tracing::error!(%error, "the store failed: {error}");
                Self::internal()
            }
        }
    }
}

impl From<EnqueueError> for Problem {
    fn from(error: EnqueueError) -> Self {
        match error {
            EnqueueError::QueueFull { waiting } => Self::new(
                Kind::QueueFull,
                format!("{waiting} jobs are waiting already, and no more are taken. Nothing was stored."),
            )
            .retry_after(QUEUE_RETRY_S),
            EnqueueError::NoSurface(id) => Self::new(Kind::InvalidParameters, "The job's parameters have faults.")
                .with_faults(vec![Fault {
                    pointer: "/surface".to_owned(),
                    detail: format!("there is no surface {id}: send it first, with POST /v1/surfaces"),
                    place: None,
                }]),
            EnqueueError::KeyReused { key } => Self::new(
                Kind::KeyReused,
                format!("The idempotency key {key:?} came with another body before. Take a new key for a new job."),
            ),
            EnqueueError::Draining => Self::new(Kind::Draining, "The service is shutting down and takes nothing new.")
                .retry_after(STORAGE_RETRY_S),
            EnqueueError::Store(error) => error.into(),
        }
    }
}

impl From<QueryRejection> for Problem {
    fn from(rejection: QueryRejection) -> Self {
        Self::new(Kind::BadRequest, format!("The query cannot be read: {}.", rejection.body_text()))
    }
}

impl From<PathRejection> for Problem {
    fn from(rejection: PathRejection) -> Self {
        Self::new(Kind::BadRequest, format!("The address cannot be read: {}.", rejection.body_text()))
    }
}
