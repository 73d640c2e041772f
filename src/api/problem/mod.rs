//! Problem documents (RFC 9457): every error answer of the service is made here.
//!
//! A handler returns a [`Problem`]; it travels as an extension of the response, and [`finish`] writes the document, with
//! the request's path as `instance`, when the answer leaves. The same layer turns error answers that were made below
//! this service's code into problems.

mod finish;
mod kinds;
mod sources;

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

use crate::engine::error::{Located, Place, Remedy};
use crate::formats::faults::Fault;

pub use finish::finish;
pub use kinds::Kind;
pub use sources::panicked;

/// Most faults that one answer lists: a file with a million faults is not helped by a longer list.
pub const MAX_FAULTS: usize = 200;

/// What is wrong with a request, or with the service.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    kind: Kind,
    detail: String,
    code: Option<String>,
    place: Option<Place>,
    remedies: Vec<Remedy>,
    errors: Vec<Fault>,
    headers: HeaderMap,
}

impl Problem {
    /// A problem of a kind, with what is the matter in this case, in words a CAD user understands.
    #[must_use]
    pub fn new(kind: Kind, detail: impl Into<String>) -> Self {
        Self {
            kind,
            detail: detail.into(),
            code: None,
            place: None,
            remedies: Vec::new(),
            errors: Vec::new(),
            headers: HeaderMap::new(),
        }
    }

    /// The same with all the faults that were found. Beyond [`MAX_FAULTS`] their number is given.
    #[must_use]
    pub fn with_faults(mut self, mut faults: Vec<Fault>) -> Self {
        let found = faults.len();
        if found > MAX_FAULTS {
            faults.truncate(MAX_FAULTS);
            self.detail = format!("{} The first {MAX_FAULTS} of {found} faults are listed.", self.detail);
        }
        if self.place.is_none() {
            self.place = faults.iter().find_map(|fault| fault.place.clone());
        }
        self.errors = faults;
        self
    }

    /// The same with what the engine says of its error: code, place, remedies.
    #[must_use]
    pub fn located(mut self, error: &dyn Located) -> Self {
        self.code = Some(error.code().to_owned());
        let place = error.place();
        self.place = (place != Place::default()).then_some(place);
        self.remedies = error.remedies();
        self
    }

    /// The same with a code, place and remedies that were stored.
    #[must_use]
    pub fn stored(mut self, code: String, place: Option<Place>, remedies: Vec<Remedy>) -> Self {
        self.code = Some(code);
        self.place = place;
        self.remedies = remedies;
        self
    }

    /// The same with something to try.
    #[must_use]
    pub fn with_remedy(mut self, remedy: Remedy) -> Self {
        self.remedies.push(remedy);
        self
    }

    /// The same with a header.
    #[must_use]
    pub fn with_header(mut self, name: HeaderName, value: HeaderValue) -> Self {
        self.headers.insert(name, value);
        self
    }

    /// The same, to be asked again after so many seconds.
    #[must_use]
    pub fn retry_after(self, seconds: u32) -> Self {
        self.with_header(header::RETRY_AFTER, HeaderValue::from(seconds))
    }

    /// The kind.
    #[must_use]
    pub const fn kind(&self) -> Kind {
        self.kind
    }

    /// The document, about the resource at `instance`.
    #[must_use]
    pub fn document<'a>(&'a self, instance: &'a str) -> Document<'a> {
        Document {
            kind: format!("/problems/{}", self.kind.slug()),
            title: self.kind.title(),
            status: self.kind.status().as_u16(),
            detail: &self.detail,
            instance,
            code: self.code.as_deref().unwrap_or(self.kind.slug()),
            place: self.place.as_ref(),
            remedies: &self.remedies,
            errors: &self.errors,
        }
    }
}

/// A problem as it is written.
#[derive(Debug, Serialize)]
pub struct Document<'a> {
    #[serde(rename = "type")]
    kind: String,
    title: &'static str,
    status: u16,
    detail: &'a str,
    instance: &'a str,
    code: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<&'a Place>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    remedies: &'a [Remedy],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    errors: &'a [Fault],
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut response = self.kind.status().into_response();
        response.headers_mut().extend(self.headers.clone());
        response.extensions_mut().insert(std::sync::Arc::new(self));
        response
    }
}
