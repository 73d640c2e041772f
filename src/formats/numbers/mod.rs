//! Numbers on their way out: fixed decimals for drawings, JSON that never holds a silent `null`.

pub(super) mod finite;

use std::io::Write;

use serde::ser::{Error as _, SerializeSeq as _};
use serde::{Serialize, Serializer};

/// Why a result could not be written. None of these is the client's fault.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A number is NaN or infinite where the form has no word for it.
    #[error("{what} is not a finite number")]
    NotFinite {
        /// Which number.
        what: String,
    },
    /// The form cannot hold this much.
    #[error("the result is too large for this form: {detail}")]
    TooLarge {
        /// How much, and the limit.
        detail: String,
    },
    /// There is nothing to write.
    #[error("there is no {what} to write")]
    Empty {
        /// What is not there.
        what: &'static str,
    },
}

/// Decimals kept in drawings of parts of a metre or more: a nanometre. Cutters resolve a hundredth of a millimetre.
const DECIMALS_LEAST: usize = 6;
/// Decimals kept at most: what fits a DXF reader's double with some digits before the point.
const DECIMALS_MOST: usize = 15;
/// Digits that a drawing keeps of a part's own size, so that a part of a micrometre has a shape too.
const DIGITS: f64 = 9.0;

/// How many decimals a drawing needs whose largest coordinate is `size`.
pub(super) fn decimals(size: f64) -> usize {
    if !(size.is_finite() && size > 0.0) {
        return DECIMALS_LEAST;
    }
    let wanted = DIGITS - size.log10().floor();
    (wanted.max(0.0) as usize).clamp(DECIMALS_LEAST, DECIMALS_MOST)
}

/// `x` with fixed decimals; never an exponent, never minus zero.
pub(super) fn fixed(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| b == b'0' || b == b'.') => rest.to_owned(),
        _ => text,
    }
}

/// The same without trailing zeros.
pub(super) fn short(x: f64, decimals: usize) -> String {
    let text = fixed(x, decimals);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Finite coordinates as a JSON list; anything else is an error, since `serde_json` would write `null`.
pub(super) struct Coordinates<const N: usize>(pub(super) [f64; N]);

impl<const N: usize> Serialize for Coordinates<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut list = serializer.serialize_seq(Some(N))?;
        for x in self.0 {
            if !x.is_finite() {
                return Err(S::Error::custom("a coordinate"));
            }
            list.serialize_element(&x)?;
        }
        list.end()
    }
}

/// Compact JSON in which zero has no sign. Every number must be finite already or guard itself ([`Coordinates`]).
pub(super) fn compact_json(value: &impl Serialize) -> Result<Vec<u8>, WriteError> {
    let mut out = Vec::new();
    let mut serializer = serde_json::Serializer::with_formatter(&mut out, UnsignedZero);
    value.serialize(&mut serializer).map_err(|e| WriteError::NotFinite { what: e.to_string() })?;
    Ok(out)
}

struct UnsignedZero;

impl serde_json::ser::Formatter for UnsignedZero {
    fn write_f64<W: ?Sized + Write>(&mut self, writer: &mut W, value: f64) -> std::io::Result<()> {
        // Adding positive zero turns -0.0 into 0.0 and changes nothing else.
        serde_json::ser::CompactFormatter.write_f64(writer, value + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_decimals_have_no_exponent_and_no_minus_zero() {
        assert_eq!(fixed(-1e-9, 6), "0.000000");
        assert_eq!(fixed(1e9, 2), "1000000000.00");
        assert_eq!(fixed(-1.5, 3), "-1.500");
        assert_eq!(short(-0.0, 6), "0");
        assert_eq!(short(10.0, 0), "10");
        assert_eq!(short(10.250, 6), "10.25");
    }

    #[test]
    fn small_parts_get_more_decimals() {
        assert_eq!(decimals(1234.0), 6);
        assert_eq!(decimals(1e-3), 12);
        assert_eq!(decimals(0.0), 6);
        assert_eq!(decimals(1e-12), 15);
    }

    #[test]
    fn json_refuses_what_is_not_finite_and_drops_the_sign_of_zero() {
        assert_eq!(compact_json(&[Coordinates([-0.0, 1.5])]).unwrap(), b"[[0.0,1.5]]");
        assert!(compact_json(&[Coordinates([f64::NAN, 0.0])]).is_err());
    }
}
