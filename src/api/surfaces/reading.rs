//! From bytes to a surface that can be stored: reading, the whole checklist, and the summary.

use axum::body::Bytes;
use serde::Serialize;
use serde_json::Value;

use crate::api::problem::{Kind, Problem};
use crate::api::request::Query;
use crate::formats::faults::Fault;
use crate::formats::sniff::{Sniffed, sniff};
use crate::formats::surface::{self, Geometry};
use crate::store::NewSurface;

pub use crate::formats::surface::Reading;

impl Reading {
    /// What a query asks for.
    ///
    /// # Errors
    /// 400 for words that do not exist.
    pub(crate) fn of(query: &Query) -> Result<Self, Problem> {
        Ok(Self {
            units: query.word("units", "mm, cm, m, in or ft")?,
            side: query.word("side", "normal or reversed")?,
            weld: query.word("weld", "position or none")?,
        })
    }
}

/// A surface that passed the whole checklist.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedSurface {
    /// As it is stored.
    pub new: NewSurface,
    /// Its geometry.
    pub geometry: Geometry,
}

/// What is wrong with a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFaults(pub Vec<Fault>);

impl SurfaceFaults {
    /// The problem: 400 when the body is meant to be JSON and is not, else 422 with every fault.
    #[must_use]
    pub fn into_problem(self, body: &[u8]) -> Problem {
        if sniff(body) != Some(Sniffed::GltfBinary)
            && let Err(error) = serde_json::from_slice::<serde::de::IgnoredAny>(body)
        {
            return Problem::json(&error);
        }
        Problem::new(Kind::InvalidSurface, "The surface has faults. Nothing was stored.").with_faults(self.0)
    }
}

/// Reads a surface and checks all of it. `prefix` stands before every pointer.
///
/// # Errors
/// Every fault that was found.
pub fn read(bytes: &Bytes, reading: Reading, prefix: &str) -> Result<CheckedSurface, SurfaceFaults> {
    let surface = surface::read(bytes, reading, prefix).map_err(SurfaceFaults)?;
    let mut document = surface.summary;
    let kind = document.get("kind").and_then(Value::as_str).unwrap_or_default().to_owned();
    if let Value::Object(fields) = &mut document {
        fields.insert("labels".to_owned(), serde_json::to_value(&surface.labels).unwrap_or(Value::Null));
    }
    let reading = serde_json::to_value(reading).unwrap_or(Value::Null);
    let units = word(&surface.units);
    let mut new = NewSurface::new(bytes.clone(), surface.media.name(), kind, units, reading);
    new.name = surface.name;
    new.summary = document;
    Ok(CheckedSurface { new, geometry: surface.geometry })
}

/// A word of a vocabulary as serde writes it.
fn word(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(Value::String(word)) => word,
        _ => String::new(),
    }
}
