//! The integration tests, one binary with a module for each subject.

mod support;

mod queue_running;
