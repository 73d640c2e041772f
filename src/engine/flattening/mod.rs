//! From a mesh in space to the plane: sequentially ([`cader`], thesis chapter 4) or with the least distortion there is
//! ([`isometric`]).

pub mod cader;
#[cfg(test)]
mod closed_forms;
mod constraints;
pub mod developable;
pub mod energy_release;
mod error;
pub mod isometric;
mod mapping_order;
mod options;
mod outcome;
pub mod rigid;
mod rings;
mod symmetric;
#[cfg(test)]
mod symmetric_tests;
mod unfolding;

pub use constraints::{
    DEFAULT_KEEP_WEIGHT, Keep, KeepCurve, KeepLength, MAX_KEEP_WEIGHT, MAX_KEEPS, MAX_PINS, MAX_TARGET, PinAt, PinPlace,
};
pub use error::FlatteningError;
pub use options::{
    Anchor, Average, Check, FlatteningDomain, FlatteningMethod, FlatteningOptions, Order, Parent, Readings, Scheme,
    SeedChoice, Weights,
};
pub use outcome::{Flattening, LevelCounts};
