//! HTTP: the face of the service. No geometry, no SQL.
//!
//! | module | what |
//! |---|---|
//! | `routes` | every address on one page, and what surrounds the handlers |
//! | `surfaces`, `jobs`, `results`, `flatten`, `service` | the handlers, one endpoint a file |
//! | [`parameters`] | a job's parameters: read, checked, set by dotted name, with all faults at once |
//! | [`problem`] | every error answer, RFC 9457 |
//! | `request`, `answer` | bodies, queries, preferences; forms, entity tags, file names |
//!
//! A request is bounded in its length, its time and the memory and threads that it may take; what is refused says why and
//! when to come again. Work that takes long runs on threads of its own ([`App::on_a_thread`]).

mod answer;
mod app;
mod cursor;
mod flatten;
mod jobs;
mod layers;
pub mod parameters;
pub mod problem;
mod request;
mod results;
mod routes;
mod service;
mod surfaces;
mod times;

pub use answer::Form;
pub use app::App;
pub use results::{ResultKind, Source, render};
pub use routes::{paths, router};
pub use service::contract::CONTRACT;
pub use surfaces::{CheckedSurface, NAME, Reading, SurfaceFaults, domain_of, labels_of, read};
