//! From a mesh in space to the plane (thesis chapter 4).

mod error;
mod options;
mod outcome;

pub use error::FlatteningError;
pub use options::{
    Anchor, Average, Check, FlatteningDomain, FlatteningMethod, FlatteningOptions, Order, Parent, Readings, SeedChoice,
};
pub use outcome::{Flattening, LevelCounts};
