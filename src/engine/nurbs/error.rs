//! What can be wrong with a curve or a surface in itself.

use crate::engine::error::{Located, Place, Remedy};

/// A NURBS entity that has no meaning. `what` names the field as the surface file does (`knots_u`, `weights`, ...).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NurbsError {
    /// Degree 0, or above the supported maximum.
    #[error("{what} is {degree}: degrees from 1 to {max} are supported")]
    Degree {
        /// The field.
        what: &'static str,
        /// Its value.
        degree: usize,
        /// The largest supported degree.
        max: usize,
    },
    /// The number of knots does not fit the number of control points and the degree.
    #[error("{what} has {found} knots where {expected} are needed (control points + degree + 1)")]
    KnotCount {
        /// The field.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A knot is smaller than the one before it.
    #[error("{what}[{index}] is smaller than the knot before it")]
    KnotOrder {
        /// The field.
        what: &'static str,
        /// Index of the offending knot.
        index: usize,
    },
    /// A knot is repeated more often than the degree allows, or the domain is empty.
    #[error("{what}[{index}] is repeated more than degree + 1 times, or leaves the domain empty")]
    KnotMultiplicity {
        /// The field.
        what: &'static str,
        /// Index of the first knot of the group.
        index: usize,
    },
    /// A number is NaN, infinite, or beyond the magnitude that can be worked on.
    #[error("{what}[{index}] is not a finite number of workable size")]
    NotFinite {
        /// The field.
        what: &'static str,
        /// Flat index of the number.
        index: usize,
    },
    /// Too few control points for the degree, or rows of different length.
    #[error("{what}: {detail}")]
    Net {
        /// The field.
        what: &'static str,
        /// What is wrong with it.
        detail: String,
    },
    /// A weight is zero or negative.
    #[error("{what}[{index}] is not positive")]
    Weight {
        /// The field.
        what: &'static str,
        /// Flat index of the weight.
        index: usize,
    },
    /// A knot cannot be inserted: it lies outside the domain, or would be there more than degree + 1 times.
    #[error("{what}: a knot cannot be inserted {times} times at {value}")]
    Insertion {
        /// The direction: `t`, `u` or `v`.
        what: &'static str,
        /// The knot.
        value: f64,
        /// How often it was to be inserted.
        times: usize,
    },
}

impl Located for NurbsError {
    fn code(&self) -> &'static str {
        "invalid-nurbs"
    }

    fn place(&self) -> Place {
        Place::default()
    }

    fn remedies(&self) -> Vec<Remedy> {
        Vec::new()
    }
}
