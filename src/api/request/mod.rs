//! What a request carries: its body, its query, its preferences.

mod body;
mod coding;
mod key;
mod parts;
mod query;
mod wait;

pub(crate) use body::{BodyLimits, Media, Received, receive};
pub(crate) use key::key;
pub(crate) use parts::{Parts, parts};
pub(crate) use query::Query;
pub(crate) use wait::Wait;
