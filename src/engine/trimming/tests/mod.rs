//! Tests of the whole way from loops to a region.

mod real;
mod samples;
