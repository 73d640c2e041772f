//! Problem documents (RFC 9457): every error answer of the service is made here.
//!
//! A handler returns a [`Problem`]; it travels as an extension of the response, and [`finish()`] writes the document, with
//! the request's path as `instance`, when the answer leaves. The same layer turns error answers that were made below
//! this service's code into problems.

mod codes;
mod finish;
mod kinds;
mod sources;

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

use crate::engine::error::{Located, Place, Remedy};
use crate::formats::faults::Fault;

pub use codes::{CODES, meaning};
pub use finish::finish;
pub use kinds::Kind;
pub use sources::panicked;

/// Most faults that one answer lists: a file with a million faults is not helped by a longer list.
pub const MAX_FAULTS: usize = 200;

/// What is wrong with a request, or with the service.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem(Box<Parts>);

#[derive(Debug, Clone, PartialEq)]
struct Parts {
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
        Self(Box::new(Parts {
            kind,
            detail: detail.into(),
            code: None,
            place: None,
            remedies: Vec::new(),
            errors: Vec::new(),
            headers: HeaderMap::new(),
        }))
    }

    /// The same with all the faults that were found. Beyond [`MAX_FAULTS`] their number is given.
    #[must_use]
    pub fn with_faults(mut self, mut faults: Vec<Fault>) -> Self {
        let found = faults.len();
        if found > MAX_FAULTS {
            faults.truncate(MAX_FAULTS);
            self.0.detail = format!("{} The first {MAX_FAULTS} of {found} faults are listed.", self.0.detail);
        }
        if self.0.place.is_none() {
            self.0.place = faults.iter().find_map(|fault| fault.place.clone());
        }
        self.0.errors = faults;
        self
    }

    /// The same with what the engine says of its error: code, place, remedies.
    #[must_use]
    pub fn located(mut self, error: &dyn Located) -> Self {
        self.0.code = Some(error.code().to_owned());
        let place = error.place();
        self.0.place = (place != Place::default()).then_some(place);
        self.0.remedies = error.remedies();
        self
    }

    /// The same with a code, place and remedies that were stored.
    #[must_use]
    pub fn stored(mut self, code: String, place: Option<Place>, remedies: Vec<Remedy>) -> Self {
        self.0.code = Some(code);
        self.0.place = place;
        self.0.remedies = remedies;
        self
    }

    /// The same with something to try.
    #[must_use]
    pub fn with_remedy(mut self, remedy: Remedy) -> Self {
        self.0.remedies.push(remedy);
        self
    }

    /// The same with a header.
    #[must_use]
    pub fn with_header(mut self, name: HeaderName, value: HeaderValue) -> Self {
        self.0.headers.insert(name, value);
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
        self.0.kind
    }

    /// The document, about the resource at `instance`.
    #[must_use]
    pub fn document<'a>(&'a self, instance: &'a str) -> Document<'a> {
        Document {
            kind: format!("/problems/{}", self.0.kind.slug()),
            title: self.0.kind.title(),
            status: self.0.kind.status().as_u16(),
            detail: &self.0.detail,
            instance,
            request_id: None,
            code: self.0.code.as_deref().unwrap_or(self.0.kind.slug()),
            place: self.0.place.as_ref(),
            remedies: &self.0.remedies,
            errors: &self.0.errors,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    request_id: Option<&'a str>,
    code: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<&'a Place>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    remedies: &'a [Remedy],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    errors: &'a [Fault],
}

impl<'a> Document<'a> {
    /// The same as the answer to the request with this id.
    #[must_use]
    pub fn to(mut self, request_id: Option<&'a str>) -> Self {
        self.request_id = request_id;
        self
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut response = self.0.kind.status().into_response();
        response.headers_mut().extend(self.0.headers.clone());
        response.extensions_mut().insert(std::sync::Arc::new(self));
        response
    }
}
