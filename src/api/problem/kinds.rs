//! The registry of problem types: every error answer of the service is one of these.
//!
//! A slug is for ever: clients branch on `type`, which is `/problems/{slug}` and opens as a readable text.

use axum::http::StatusCode;

macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident: $slug:literal, $status:ident, $title:literal, $text:literal;)*) => {
        /// A type of problem.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Kind {
            $(#[doc = $title] $name,)*
        }

        impl Kind {
            /// All of them, in the order of their statuses.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];

            /// Name in `type`.
            #[must_use]
            pub const fn slug(self) -> &'static str {
                match self { $(Self::$name => $slug,)* }
            }

            /// HTTP status.
            #[must_use]
            pub const fn status(self) -> StatusCode {
                match self { $(Self::$name => StatusCode::$status,)* }
            }

            /// One line, the same for every occurrence.
            #[must_use]
            pub const fn title(self) -> &'static str {
                match self { $(Self::$name => $title,)* }
            }

            /// What it means and what to do.
            #[must_use]
            pub const fn text(self) -> &'static str {
                match self { $(Self::$name => $text,)* }
            }
        }
    };
}

kinds! {
    InvalidJson: "invalid-json", BAD_REQUEST, "The body is not JSON",
        "The request body could not be read as JSON. `detail` gives the line and the column where reading stopped.";
    BadRequest: "bad-request", BAD_REQUEST, "The request cannot be understood",
        "A header, a part of the address or a query parameter has no meaning here. `errors` names each.";
    NotFound: "not-found", NOT_FOUND, "There is nothing at this address",
        "The path is not one of this service. /openapi.yaml lists them all.";
    SurfaceNotFound: "surface-not-found", NOT_FOUND, "There is no such surface",
        "No surface has this id: it was never sent, or it has been deleted. Send it again; it will have the same id.";
    JobNotFound: "job-not-found", NOT_FOUND, "There is no such job",
        "No job has this id: it was never made, or it has been deleted.";
    ResultNotFound: "result-not-found", NOT_FOUND, "The job has no such result",
        "The job has ended without this result: a `triangulate` job has no pattern, and a failed job has at most the \
         mesh and the report of what was reached.";
    MethodNotAllowed: "method-not-allowed", METHOD_NOT_ALLOWED, "The address does not know this method",
        "The header `Allow` lists the methods that it knows.";
    NotAcceptable: "not-acceptable", NOT_ACCEPTABLE, "The result has none of the forms asked for",
        "Neither `Accept` nor the suffix names a form that this result has. `detail` lists the forms.";
    BodyTimeout: "body-timeout", REQUEST_TIMEOUT, "The body came too slowly",
        "The request body was not there in time. Send it again over a faster line.";
    SurfaceInUse: "surface-in-use", CONFLICT, "A job needs the surface",
        "A surface can be deleted when no job that waits or runs needs it. Wait for those jobs, or cancel them.";
    JobFinal: "job-final", CONFLICT, "The job has ended",
        "A job that has ended cannot be cancelled. It can be deleted.";
    JobNotEnded: "job-not-ended", CONFLICT, "The job has not ended",
        "Results can be had, and a job deleted, when it has ended. Poll the job (`?wait=30` waits for the end), or \
         cancel it first.";
    JobCancelled: "job-cancelled", CONFLICT, "The job was cancelled",
        "Somebody cancelled the job before it ended, so there is no result.";
    PatternRejected: "pattern-rejected", CONFLICT, "The pattern is not fit to be cut",
        "The verdict on the pattern is `fail`: a limit of the job is not kept, or the pattern lies on itself. Files to cut by are \
         given only with `?allow=fail`, and then say REJECTED; `pattern.json` and the report can be read without.";
    BodyTooLarge: "body-too-large", PAYLOAD_TOO_LARGE, "The body is too large",
        "The request body is longer than this service takes. `detail` gives the limit, which the operator sets.";
    UnsupportedMediaType: "unsupported-media-type", UNSUPPORTED_MEDIA_TYPE, "The body has a type that is not read here",
        "`detail` lists the types of bodies that this address reads.";
    TooLarge: "too-large", UNPROCESSABLE_ENTITY, "The job is too large",
        "The work was estimated before it was accepted, and would take longer than a job may. `remedies` say what makes \
         it smaller; a search can be given a budget of time.";
    InvalidSurface: "invalid-surface", UNPROCESSABLE_ENTITY, "The surface has faults",
        "The body is JSON, but not a surface that can be worked on. `errors` lists every fault with a JSON Pointer to \
         its place; `place` says where it is on the surface. Nothing was stored.";
    InvalidParameters: "invalid-parameters", UNPROCESSABLE_ENTITY, "The job's parameters have faults",
        "`errors` lists every fault with a JSON Pointer to the parameter. Nothing was stored.";
    KeyReused: "key-reused", UNPROCESSABLE_ENTITY, "The idempotency key stands for another request",
        "The same `Idempotency-Key` came with another body before. A key stands for one request; a new one needs a new key.";
    JobFailed: "job-failed", UNPROCESSABLE_ENTITY, "The job has failed",
        "The work was begun and could not be ended. `code` names the reason, `place` says where it happened, and \
         `remedies` lists what to try next, with the settings that do it.";
    TooManyHeaders: "too-many-headers", REQUEST_HEADER_FIELDS_TOO_LARGE, "The request's header is too large",
        "The header of the request is larger than this service reads.";
    Internal: "internal", INTERNAL_SERVER_ERROR, "The service has a fault",
        "This is not your doing. The service has logged it under the id in the header `X-Request-Id`; tell the operator.";
    QueueFull: "queue-full", SERVICE_UNAVAILABLE, "Too many jobs are waiting",
        "The job was not taken. Ask again after the time in `Retry-After`.";
    Overloaded: "overloaded", SERVICE_UNAVAILABLE, "The service is busy",
        "Too many requests are being read at once. Ask again after the time in `Retry-After`.";
    Draining: "draining", SERVICE_UNAVAILABLE, "The service is shutting down",
        "Nothing new is taken. Jobs that were taken before are kept and run when the service is back.";
    StorageUnavailable: "storage-unavailable", SERVICE_UNAVAILABLE, "The database cannot be reached",
        "The database did not answer in time, most likely since another program holds it. Ask again after the time in \
         `Retry-After`.";
    StorageFull: "storage-full", INSUFFICIENT_STORAGE, "The disk is full",
        "There is no room to keep what was sent. Nothing was stored. Delete jobs and surfaces, or tell the operator.";
}

impl Kind {
    /// The type with this slug.
    #[must_use]
    pub fn by_slug(slug: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.slug() == slug)
    }

    /// The type that says what a bare status says, for answers that were made below this service's own code.
    #[must_use]
    pub fn of_status(status: StatusCode) -> Self {
        match status {
            StatusCode::NOT_FOUND => Self::NotFound,
            StatusCode::METHOD_NOT_ALLOWED => Self::MethodNotAllowed,
            StatusCode::NOT_ACCEPTABLE => Self::NotAcceptable,
            StatusCode::REQUEST_TIMEOUT => Self::BodyTimeout,
            StatusCode::PAYLOAD_TOO_LARGE => Self::BodyTooLarge,
            StatusCode::UNSUPPORTED_MEDIA_TYPE => Self::UnsupportedMediaType,
            StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE => Self::TooManyHeaders,
            StatusCode::SERVICE_UNAVAILABLE => Self::Overloaded,
            status if status.is_client_error() => Self::BadRequest,
            _ => Self::Internal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slugs_are_distinct_and_plain() {
        for (i, kind) in Kind::ALL.iter().enumerate() {
            assert!(kind.slug().chars().all(|c| c.is_ascii_lowercase() || c == '-'), "{kind:?}");
            assert!(!Kind::ALL[..i].iter().any(|other| other.slug() == kind.slug()), "{kind:?}");
            assert_eq!(Kind::by_slug(kind.slug()), Some(*kind));
        }
    }

    #[test]
    fn every_kind_is_an_error_status() {
        for kind in Kind::ALL {
            assert!(kind.status().is_client_error() || kind.status().is_server_error(), "{kind:?}");
        }
    }
}
