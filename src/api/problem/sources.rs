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
        let said =
            JSON_WORDS.iter().find(|(theirs, _)| text.starts_with(theirs)).map_or("this is not JSON", |(_, ours)| ours);
        Self::new(Kind::InvalidJson, format!("Line {}, column {}: {said}.", error.line(), error.column()))
    }
}

/// What the JSON reader says, and what is said to people.
const JSON_WORDS: [(&str, &str); 20] = [
    ("EOF while parsing a list", "the text ends inside a list"),
    ("EOF while parsing an object", "the text ends inside an object"),
    ("EOF while parsing a string", "the text ends inside a text in quotes"),
    ("EOF while parsing a value", "the text ends where a value is expected"),
    ("expected `:`", "a colon is expected after the field's name"),
    ("expected `,` or `]`", "a comma or ] is expected here"),
    ("expected `,` or `}`", "a comma or } is expected here"),
    ("expected ident", "true, false, null or another value is expected here"),
    ("expected value", "a value is expected here"),
    ("expected `\"`", "a field's name in double quotes is expected here"),
    ("invalid escape", "there is no such escape in a text: \\ must be written as \\\\"),
    ("invalid number", "this is not a number"),
    ("number out of range", "the number is too large"),
    ("invalid unicode code point", "the text is not UTF-8"),
    ("control character", "a line break or another control character stands inside a text"),
    ("key must be a string", "a field's name in double quotes is expected here"),
    ("lone leading surrogate", "half of a character stands in an escape"),
    ("unexpected end of hex escape", "an escape ends too early"),
    ("trailing comma", "no comma may stand before the end of a list or an object"),
    ("trailing characters", "something follows after the end of the document"),
];

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_json_is_told_in_our_words() {
        let bad = [
            "",
            "{",
            "[1",
            "{\"a\"",
            "{\"a\":",
            "[1 2]",
            "{\"a\":1 2}",
            "{a:1}",
            "[,]",
            "tru",
            "\"\\x\"",
            "01",
            "-",
            "1e999",
            "\"\n\"",
            "\"\\ud800\"",
            "\"abc",
            "[1,]",
            "{\"a\":1,}",
            "1 2",
            "\"\\u12\"",
        ];
        for text in bad {
            let error = serde_json::from_str::<serde_json::Value>(text).unwrap_err();
            let problem = Problem::json(&error);
            let said = problem.document("/").to(None);
            let said = serde_json::to_value(said).unwrap()["detail"].as_str().unwrap().to_owned();
            assert!(said.starts_with("Line "), "{text}: {said}");
            for theirs in ["EOF", "parsing", "ident", "surrogate", "trailing"] {
                assert!(!said.contains(theirs), "{text}: {said}");
            }
            assert!(!said.contains("this is not JSON"), "{text} has no words of its own: {error}");
        }
    }
}
