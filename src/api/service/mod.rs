//! Around the work: is it alive, is it ready, what does it speak.

pub(super) mod contract;
pub(super) mod docs;
pub(super) mod health;
pub(super) mod metrics;
pub(super) mod problems;
