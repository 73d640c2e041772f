//! How an answer looks: the form that the client can read, its entity tag, its file name.

mod codings;
mod conditional;
mod disposition;
mod forms;

pub(crate) use codings::{Coded, Coding};
pub(crate) use conditional::{Tag, finish_tags};
pub(crate) use disposition::disposition;
pub use forms::Form;
pub(crate) use forms::{choose, not_acceptable};
