//! What the methods promise on whole parts, without the service: a binary of its own, since its meshes are large and other
//! tests watch their process's memory.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod against_cader;
mod against_readings;
mod ampc;
mod configurations;
mod curve_fitting;
mod energy_release;
mod outlines;
mod predicted_seed;
mod sewn_faces;
