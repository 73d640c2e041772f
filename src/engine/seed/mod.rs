//! Seeds: candidates and the exhaustive search (thesis 4.4.4).
//!
//! A seed is the triangle that a sequential flattening starts from. [`locate`] finds one by a name or a place,
//! [`search`](search::search) tries them all, or those few that [`predicted`] names.

mod bound;
mod candidates;
mod landscape;
pub mod locate;
pub mod predicted;
pub mod search;

#[cfg(test)]
mod reference_tests;
#[cfg(test)]
pub(crate) mod test_cases;

pub use landscape::{Changes, Ranked, SeedLandscape, SeedOutcome, SeedSearch};
pub use search::{SearchSettings, search};
