//! Tests of the whole: reference cases and properties that every curve and surface has; and shapes for all tests.

mod properties;
mod reference;
pub(crate) mod shapes;
