//! From a mesh in space to the plane: sequentially ([`cader`], thesis chapter 4) or with the least distortion there is
//! ([`isometric`]).

pub mod cader;
#[cfg(test)]
mod closed_forms;
pub mod developable;
mod error;
pub mod isometric;
mod mapping_order;
mod options;
mod outcome;
mod rings;
mod unfolding;

pub use error::FlatteningError;
pub use options::{
    Anchor, Average, Check, FlatteningDomain, FlatteningMethod, FlatteningOptions, Order, Parent, Readings, SeedChoice,
    Weights,
};
pub use outcome::{Flattening, LevelCounts};
