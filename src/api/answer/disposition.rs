//! The name under which a client saves an answer.

use axum::http::HeaderValue;

use crate::formats::file_stem;

/// `Content-Disposition` with a name of letters, digits, `-` and `_` alone, made of `name` (else `otherwise`).
#[must_use]
pub(crate) fn disposition(name: &str, otherwise: &str, suffix: &str, inline: bool) -> HeaderValue {
    let stem = file_stem(Some(name), otherwise);
    let what = if inline { "inline" } else { "attachment" };
    // A stem of ASCII letters and digits is a header's value always.
    HeaderValue::from_str(&format!("{what}; filename=\"{stem}.{suffix}\""))
        .unwrap_or_else(|_| HeaderValue::from_static("attachment"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hostile_name_comes_out_harmless() {
        let value = disposition("a\"; filename=\"../../etc/passwd\r\nX: y", "pattern", "dxf", false);
        let text = value.to_str().unwrap();
        assert!(text.starts_with("attachment; filename=\"a"), "{text}");
        assert!(!text[22..text.len() - 1].contains(['"', '/', '\r', '\n', ';']), "{text}");
        assert_eq!(disposition("", "pattern", "svg", true), "inline; filename=\"pattern.svg\"");
    }
}
