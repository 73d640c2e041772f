//! Faults of an input file, each with the JSON Pointer of the place it is at.

use serde::{Deserialize, Serialize};

use crate::engine::error::Place;

/// One fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// JSON Pointer (RFC 6901) into the document, such as `/knots_u/5`.
    pub pointer: String,
    /// What is wrong and what would do, in words.
    pub detail: String,
    /// Place in the geometry, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
}
