//! Entity tags: an answer that the client has already costs a header (RFC 9110, 8.8.3 and 13.1.2).
//!
//! A tag names a representation's bytes. A compressed representation has other bytes, so it has the same tag with the
//! coding's name appended; [`finish_tags`] sees to that behind the compression layer, and [`Tag::coded`] for answers that
//! have made their own choice of a coding.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::{Coded, Coding};

/// Codings that answers may be compressed with.
const CODINGS: [&str; 2] = ["gzip", "zstd"];
/// Hexadecimal digits of a tag: 128 bits.
const DIGITS: usize = 32;

/// A strong entity tag; clones share it.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Tag(Arc<str>);

impl Tag {
    /// The tag of what these parts, in this order, determine.
    #[must_use]
    pub(crate) fn of(parts: &[&[u8]]) -> Self {
        let mut hasher = blake3::Hasher::new();
        for part in parts {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        Self(hasher.finalize().to_hex()[..DIGITS].into())
    }

    /// As a header's value.
    #[must_use]
    pub(crate) fn header(&self) -> HeaderValue {
        // Hexadecimal digits in quotes are a header's value always.
        HeaderValue::from_str(&format!("\"{}\"", self.0)).unwrap_or_else(|_| HeaderValue::from_static("\"\""))
    }

    /// As a header's value for the bytes in this coding.
    #[must_use]
    pub(crate) fn coded(&self, coding: Coding) -> HeaderValue {
        match coding {
            Coding::Identity => self.header(),
            // As above.
            _ => HeaderValue::from_str(&format!("\"{}-{}\"", self.0, coding.name()))
                .unwrap_or_else(|_| HeaderValue::from_static("\"\"")),
        }
    }

    /// `304` when the client has what this tag names, in whatever coding.
    #[must_use]
    pub(crate) fn not_modified(&self, headers: &HeaderMap) -> Option<Response> {
        let listed = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|v| v.to_str().ok());
        let matched = listed.flat_map(|v| v.split(',')).map(str::trim).find(|tag| self.is_named_by(tag))?;
        let tag = if matched == "*" { self.header() } else { HeaderValue::from_str(matched).ok()? };
        let headers = [
            (header::ETAG, tag),
            (header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache")),
            (header::VARY, HeaderValue::from_static("accept, accept-encoding")),
        ];
        Some((StatusCode::NOT_MODIFIED, headers).into_response())
    }

    fn is_named_by(&self, listed: &str) -> bool {
        if listed == "*" {
            return true;
        }
        let quoted = listed.strip_prefix("W/").unwrap_or(listed);
        let Some(tag) = quoted.strip_prefix('"').and_then(|t| t.strip_suffix('"')) else { return false };
        let plain = CODINGS.iter().find_map(|coding| tag.strip_suffix(coding)?.strip_suffix('-')).unwrap_or(tag);
        plain == &*self.0
    }
}

/// Gives compressed answers tags of their own. Stands outside the compression layer, whose answers alone it changes.
pub(crate) async fn finish_tags(request: Request, next: Next) -> Response<Body> {
    let mut response = next.run(request).await;
    if response.extensions().get::<Coded>().is_some() {
        return response;
    }
    let headers = response.headers_mut();
    if let Some(coding) = headers.get(header::CONTENT_ENCODING).and_then(|v| v.to_str().ok())
        && let Some(tag) = headers.get(header::ETAG).and_then(|v| v.to_str().ok()?.strip_suffix('"'))
        && let Ok(own) = HeaderValue::from_str(&format!("{tag}-{coding}\""))
    {
        headers.insert(header::ETAG, own);
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(tag: &Tag, listed: &str) -> Option<StatusCode> {
        let headers = HeaderMap::from_iter([(header::IF_NONE_MATCH, HeaderValue::from_str(listed).unwrap())]);
        tag.not_modified(&headers).map(|r| r.status())
    }

    #[test]
    fn a_client_that_has_it_in_any_coding_is_told_so() {
        let tag = Tag::of(&[b"a"]);
        let Tag(text) = &tag;
        for listed in [
            format!("\"{text}\""),
            format!("W/\"{text}\""),
            format!("\"other\", \"{text}-gzip\""),
            format!("\"{text}-zstd\""),
            "*".to_owned(),
        ] {
            assert_eq!(status(&tag, &listed), Some(StatusCode::NOT_MODIFIED), "{listed}");
        }
        for listed in [format!("\"{text}x\""), text.to_string(), "\"\"".to_owned(), format!("\"{text}-br\"")] {
            assert_eq!(status(&tag, &listed), None, "{listed}");
        }
    }

    #[test]
    fn the_borders_between_parts_count() {
        assert_ne!(Tag::of(&[b"ab", b"c"]), Tag::of(&[b"a", b"bc"]));
    }
}
