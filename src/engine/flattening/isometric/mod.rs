//! x
pub(crate) mod cholesky;
