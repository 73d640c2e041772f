//! Where problems come from: errors of the lower floors and of the framework, mapped here and nowhere else.

use std::any::Any;

use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::response::{IntoResponse, Response};

use super::{Kind, Problem};

/// The answer to a request whose handler panicked. The panic's own words go to the log, not to the client.
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
