//! A body `{ "surface": {...}, "job": {...} }`: where its two parts lie.
//!
//! The surface's own bytes are what is stored and read; they are not parsed into a tree on the way.

use std::ops::Range;

use super::line_and_column;
use super::text::{JsonText, Kind, SyntaxError};
use crate::formats::faults::Fault;
use crate::formats::sniff::BYTE_ORDER_MARK;

/// Byte ranges of the parts of a body. `None` for a part that is not there.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Envelope {
    /// The surface.
    pub surface: Option<Range<usize>>,
    /// The job.
    pub job: Option<Range<usize>>,
    /// Other fields at the top, in order.
    pub others: Vec<String>,
}

/// The most names of other fields that are kept.
const MAX_OTHERS: usize = 32;

/// Finds the parts of a body. `None` when the body has no field `surface` at the top: then it is a surface itself.
///
/// # Errors
/// A fault with line and column when the text is not JSON, or a part is given twice.
#[expect(clippy::result_large_err, reason = "one fault a request, handed straight to the list of faults")]
pub fn envelope(bytes: &[u8]) -> Result<Option<Envelope>, Fault> {
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let mark = bytes.len() - text.len();
    let fault = |at: usize, detail: &str| Fault {
        pointer: String::new(),
        detail: format!("{}: {detail}", line_and_column(text, at)),
        place: None,
    };
    let read = std::str::from_utf8(text).map_err(|e| fault(e.valid_up_to(), "the text is not UTF-8"))?;
    let mut found = parts(read).map_err(|e| fault(e.at, e.detail))?;
    for part in [&mut found.surface, &mut found.job].into_iter().flatten() {
        *part = part.start + mark..part.end + mark;
    }
    Ok(found.surface.is_some().then_some(found))
}

/// Whether a JSON text is glTF: among its fields `asset` comes before any that a trimmed surface must have.
#[must_use]
pub fn is_gltf(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let Ok(text) = std::str::from_utf8(text) else { return false };
    has_asset(text).unwrap_or(false)
}

fn has_asset(text: &str) -> Result<bool, SyntaxError> {
    let mut json = JsonText::new(text);
    if json.kind()? != Kind::Object {
        return Ok(false);
    }
    json.enter_object()?;
    let mut first = true;
    while let Some(name) = json.next_field(first)? {
        first = false;
        match &*name {
            "asset" => return Ok(true),
            "degree_u" | "degree_v" | "knots_u" | "knots_v" | "control_points" | "surface" | "faces" => {
                return Ok(false);
            }
            _ => json.skip()?,
        }
    }
    Ok(false)
}

fn parts(text: &str) -> Result<Envelope, SyntaxError> {
    let mut found = Envelope::default();
    let mut json = JsonText::new(text);
    if json.kind()? != Kind::Object {
        return Ok(found);
    }
    json.enter_object()?;
    let mut first = true;
    while let Some(name) = json.next_field(first)? {
        first = false;
        json.skip_white();
        let start = json.offset();
        json.skip()?;
        let part = match &*name {
            "surface" => &mut found.surface,
            "job" => &mut found.job,
            _ => {
                if found.others.len() < MAX_OTHERS {
                    found.others.push(name.chars().take(100).collect());
                }
                continue;
            }
        };
        if part.replace(start..json.offset()).is_some() {
            return Err(SyntaxError { at: start, detail: "this field is given twice: keep one of them" });
        }
    }
    json.end()?;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_are_found_whatever_stands_around_them() {
        let body = "\u{feff} {\"job\" : {\"kind\":\"flatten\"}, \"surface\":{\"a\":[1,\"}\"]} }".as_bytes();
        let found = envelope(body).unwrap().unwrap();
        assert_eq!(&body[found.surface.unwrap()], br#"{"a":[1,"}"]}"#);
        assert_eq!(&body[found.job.unwrap()], br#"{"kind":"flatten"}"#);
    }

    #[test]
    fn a_surface_by_itself_is_no_envelope() {
        assert_eq!(envelope(br#"{"units":"mm"}"#).unwrap(), None);
        assert_eq!(envelope(b"[1]").unwrap(), None);
    }

    #[test]
    fn what_is_not_json_is_a_fault_with_its_line() {
        let fault = envelope(b"{\n\"surface\": }").unwrap_err();
        assert!(fault.detail.starts_with("line 2, column 12"), "{}", fault.detail);
        assert!(envelope(br#"{"surface":1,"surface":2}"#).is_err());
    }
}
