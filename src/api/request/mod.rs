//! What a request carries: its body, its query, its preferences.

mod body;
mod query;
mod wait;

pub(crate) use body::{BodyLimits, Received, receive};
pub(crate) use query::Query;
pub(crate) use wait::Wait;
