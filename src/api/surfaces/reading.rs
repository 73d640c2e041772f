//! From bytes to a surface that can be stored: reading, the whole checklist, and the summary.

use axum::body::Bytes;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::api::problem::{Kind, Problem};
use crate::api::request::Query;
use crate::engine::trimming::{Side, TrimmedSurface};
use crate::formats::faults::Fault;
use crate::formats::summary::summarise;
use crate::formats::surface_json::{self, ReadOptions};
use crate::formats::units::Units;
use crate::store::NewSurface;

/// What decides, besides the bytes, what a surface is. It is stored with the surface and is a part of its id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Reading {
    /// Unit of length, before what the file says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<Units>,
    /// The show side, before what the file says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
}

impl Reading {
    /// What a query asks for.
    ///
    /// # Errors
    /// 400 for words that do not exist.
    pub(crate) fn of(query: &Query) -> Result<Self, Problem> {
        Ok(Self { units: query.word("units", "mm, cm, m, in or ft")?, side: query.word("side", "normal or reversed")? })
    }
}

/// A surface that passed the whole checklist.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedSurface {
    /// As it is stored.
    pub new: NewSurface,
    /// Its geometry.
    pub trimmed: TrimmedSurface,
}

/// What is wrong with a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFaults(pub Vec<Fault>);

impl SurfaceFaults {
    /// The problem: 400 when the body is no JSON at all, else 422 with every fault.
    #[must_use]
    pub fn into_problem(self, body: &[u8]) -> Problem {
        if let Err(error) = serde_json::from_slice::<serde::de::IgnoredAny>(body) {
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
    let options = ReadOptions {
        units: reading.units,
        side: reading.side,
        pointer_prefix: prefix.to_owned(),
        ..ReadOptions::default()
    };
    let surface = surface_json::read(bytes, &options).map_err(SurfaceFaults)?;
    let summary = summarise(&surface);
    let mut document = serde_json::to_value(&summary).unwrap_or(Value::Null);
    if let Value::Object(fields) = &mut document {
        fields.insert("labels".to_owned(), serde_json::to_value(&surface.labels).unwrap_or(Value::Null));
    }
    let reading = serde_json::to_value(reading).unwrap_or(Value::Null);
    let units = word(&surface.units);
    let mut new = NewSurface::new(bytes.clone(), "application/json", word(&summary.kind), units, reading);
    new.name = surface.name;
    new.summary = document;
    Ok(CheckedSurface { new, trimmed: surface.trimmed })
}

/// A word of a vocabulary as serde writes it.
fn word(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(Value::String(word)) => word,
        _ => String::new(),
    }
}
