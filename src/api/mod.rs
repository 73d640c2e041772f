//! HTTP: the face of the service. No geometry, no SQL.

pub mod parameters;
pub mod problem;
