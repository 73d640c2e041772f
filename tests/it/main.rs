//! The integration tests, one binary with a module for each subject.

mod formats_parts;
mod support;

mod queue_running;
