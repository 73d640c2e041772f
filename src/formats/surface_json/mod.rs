//! The trimmed-surface JSON: reads it and writes it.
//!
//! Reading goes in two passes: [`draft`] pulls every field into arrays and notes what is wrong with each value by
//! itself; [`check`] holds the fields against each other and makes the engine's types. All faults come out together,
//! each with its JSON Pointer. Lengths come out in millimetres. Numbers keep their last bit when the file is in
//! millimetres. Work and memory are linear in the size of the text, within [`limits`].

mod check;
mod draft;
mod envelope;
pub mod limits;
mod text;
mod write;

use std::collections::BTreeMap;

pub use envelope::{Envelope, envelope, is_gltf};
pub use limits::{MAX_LABEL_NAME, MAX_LABELS, MAX_TEXT, ReadLimits};
pub use write::{write, write_part};

use super::faults::{Fault, FaultList, Step, pointer};
use super::sniff::BYTE_ORDER_MARK;
use super::units::Units;
use crate::engine::error::Located as _;
use crate::engine::sewing::Part;
use crate::engine::trimming::{CheckedTrims, Side, TrimmedSurface, TrimmingError};

/// How a file is to be read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadOptions {
    /// Unit of length; goes before what the file says.
    pub units: Option<Units>,
    /// The show side; goes before what the file says.
    pub side: Option<Side>,
    /// What the file may hold at most.
    pub limits: ReadLimits,
    /// Stands before every pointer: `/surface` when the surface is a part of a larger document.
    pub pointer_prefix: String,
}

/// A surface as read.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadSurface {
    /// Its name in the file.
    pub name: Option<String>,
    /// The unit that the file's lengths were taken in.
    pub units: Units,
    /// The labels in the file.
    pub labels: BTreeMap<String, String>,
    /// The surface, in millimetres.
    pub trimmed: TrimmedSurface,
    /// Its loops as checked: mended, nested, with warnings.
    pub checked: CheckedTrims,
    /// What the file did not say outright, in words.
    pub inferred: Vec<String>,
}

/// The faces of a part as read.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadPart {
    /// Its name in the file.
    pub name: Option<String>,
    /// The unit that the file's lengths were taken in.
    pub units: Units,
    /// The labels in the file.
    pub labels: BTreeMap<String, String>,
    /// The faces, in millimetres.
    pub part: Part,
    /// Their loops as checked, face by face.
    pub checked: Vec<CheckedTrims>,
    /// What the file did not say outright, in words.
    pub inferred: Vec<String>,
}

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum ReadContent {
    /// One trimmed surface.
    Surface(Box<ReadSurface>),
    /// A part of several faces.
    Part(ReadPart),
}

/// Reads one trimmed surface.
///
/// # Errors
/// As [`read_content`]; a part of several faces is refused.
pub fn read(bytes: &[u8], options: &ReadOptions) -> Result<ReadSurface, Vec<Fault>> {
    match read_content(bytes, options)? {
        ReadContent::Surface(surface) => Ok(*surface),
        ReadContent::Part(_) => Err(vec![Fault {
            pointer: pointer(&options.pointer_prefix, &[Step::Field("faces")]),
            detail: "one surface is needed here, this is a part of several faces".to_owned(),
            place: None,
        }]),
    }
}

/// Reads a trimmed surface, or a part of several faces.
///
/// # Errors
/// All faults that were found (at most [`super::faults::MAX_FAULTS`] are listed). Text that is not JSON ends the search
/// with a fault that names line and column; faults before it are listed all the same.
pub fn read_content(bytes: &[u8], options: &ReadOptions) -> Result<ReadContent, Vec<Fault>> {
    let mut faults = FaultList::default();
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let place = line_and_column(bytes, error.valid_up_to());
            faults.add(options.pointer_prefix.clone(), format!("{place}: the text is not UTF-8"));
            return Err(faults.into_faults());
        }
    };
    match draft::read(text, &options.pointer_prefix, &options.limits, &mut faults) {
        Err((error, pointer)) => {
            let place = line_and_column(bytes, error.at);
            faults.add(pointer, format!("{place}: {}", error.detail));
            Err(faults.into_faults())
        }
        Ok(draft) => finish(draft, options, faults),
    }
}

/// The second pass and the engine's own checklist of the loops.
fn finish(draft: draft::SurfaceDraft, options: &ReadOptions, mut faults: FaultList) -> Result<ReadContent, Vec<Fault>> {
    let Some(sound) = check::check(draft, options, &mut faults) else { return Err(faults.into_faults()) };
    let (name, units, labels, inferred) = (sound.name, sound.units, sound.labels, sound.inferred);
    let mut judged = |surface: &TrimmedSurface, prefix: &str| match surface.check() {
        Ok(checked) => Some(checked),
        Err(errors) => {
            for error in &errors {
                faults.push(loop_fault(error, prefix));
            }
            None
        }
    };
    let content = match sound.content {
        check::Content::Surface(trimmed) => judged(&trimmed, &options.pointer_prefix).map(|checked| {
            ReadContent::Surface(Box::new(ReadSurface { name, units, labels, trimmed, checked, inferred }))
        }),
        check::Content::Faces(faces) => {
            let mut checked = Vec::with_capacity(faces.len());
            for (k, face) in faces.iter().enumerate() {
                checked.extend(judged(face, &format!("{}/faces/{k}", options.pointer_prefix)));
            }
            (checked.len() == faces.len()).then_some(ReadContent::Part(ReadPart {
                name,
                units,
                labels,
                part: Part { faces },
                checked,
                inferred,
            }))
        }
    };
    content.ok_or_else(|| faults.into_faults())
}

/// A fault of the loops with its pointer: `/trims/L/C`, `/trims/L`, or `/trims`.
fn loop_fault(error: &TrimmingError, prefix: &str) -> Fault {
    let place = error.place();
    let mut steps = vec![Step::Field("trims")];
    if let Some(loop_index) = place.loop_index {
        steps.push(Step::Index(loop_index));
        steps.extend(place.curve.map(Step::Index));
    }
    let mut detail = error.to_string();
    for remedy in error.remedies() {
        detail.push_str(". ");
        detail.push_str(&remedy.say);
    }
    Fault { pointer: pointer(prefix, &steps), detail, place: Some(place) }
}

/// A byte offset as a person finds it: both counted from 1, columns in characters.
fn line_and_column(bytes: &[u8], at: usize) -> String {
    let before = &bytes[..at.min(bytes.len())];
    let line = before.split(|b| *b == b'\n').count();
    let start = before.iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
    let column = String::from_utf8_lossy(&before[start..]).chars().count() + 1;
    format!("line {line}, column {column}")
}

#[cfg(test)]
mod tests;
