//! Tests of the whole way from loops to a region.

mod closed_forms;
mod faults;
mod random;
mod real;
mod reference;
pub(crate) mod samples;
