//! Planish flattens curved surfaces into cuttable 2D patterns.
//!
//! A trimmed NURBS surface goes in; it is triangulated, flattened, and its trimming loops come out as a pattern in
//! millimetres with a report of how much the material is distorted, and where. The library does the work; the binary
//! `planish` serves it over HTTP or runs it on files.
//!
//! # Floors
//! Each floor imports only floors below it (`tests/architecture.rs` holds that):
//!
//! | floor | knows |
//! |---|---|
//! | `api`, `server` | HTTP |
//! | `queue` | the durable job machine |
//! | `store` | SQL |
//! | [`formats`] | bytes to geometry and back |
//! | [`engine`] | geometry, pure and synchronous |

pub mod api;
pub mod clock;
pub mod config;
pub mod engine;
pub mod formats;
pub mod queue;
pub mod server;
pub mod store;
pub mod telemetry;
