//! From a mesh in space to the plane (thesis chapter 4).

pub mod cader;
#[cfg(test)]
mod closed_forms;
pub mod developable;
mod error;
mod mapping_order;
mod options;
mod outcome;
mod rings;
mod unfolding;

pub use error::FlatteningError;
pub use options::{
    Anchor, Average, Check, FlatteningDomain, FlatteningMethod, FlatteningOptions, Order, Parent, Readings, SeedChoice,
};
pub use outcome::{Flattening, LevelCounts};
