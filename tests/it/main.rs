//! The integration tests, one binary with a module for each subject.

#![expect(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod formats_parts;
mod formats_programs;
mod support;

mod api_calls;
mod api_events;
mod api_faces;
mod api_faults;
mod api_feed;
mod api_meshes;
mod api_methods;
mod api_pieces;
mod api_results;
mod architecture;
mod contract;
mod queue_bounds;
mod queue_crashes;
mod queue_drain;
mod queue_edges;
mod queue_leases;
mod queue_running;
mod real_meshes;
mod real_surfaces;
mod seed_search;
mod serving;
mod storage_faults;
mod store_contents;
mod store_directory;
mod store_faults;
mod store_lists;
mod triangulation_real;
