//! Idempotency keys: with one, the same request sent again makes nothing a second time.

use axum::http::{HeaderMap, HeaderName};

use crate::api::problem::Problem;
use crate::store::{Digest, IdempotencyKey};

/// Longest key.
const MAX_KEY: usize = 255;
const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

/// The client's key for a request of this `scope` (method and route), whose content `digest` stands for.
///
/// # Errors
/// 400 for a key that is none.
pub(crate) fn key(
    headers: &HeaderMap,
    scope: &str,
    digest: impl FnOnce() -> Digest,
) -> Result<Option<IdempotencyKey>, Problem> {
    let Some(value) = headers.get(IDEMPOTENCY_KEY) else { return Ok(None) };
    let Some(text) = value.to_str().ok().and_then(bare) else {
        let rule = format!(
            "must be 1 to {MAX_KEY} visible ASCII characters without quotation marks, or the same between two of them"
        );
        return Err(Problem::header("Idempotency-Key", &rule));
    };
    Ok(Some(IdempotencyKey { scope: scope.to_owned(), key: text.to_owned(), body: digest() }))
}

/// The key without the quotation marks that a client may put around it; `None` where it is no key.
fn bare(text: &str) -> Option<&str> {
    let inner = text.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(text);
    let fits = (1..=MAX_KEY).contains(&inner.len()) && inner.bytes().all(|b| b.is_ascii_graphic() && b != b'"');
    fits.then_some(inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_visible_characters_and_may_stand_between_quotation_marks() {
        for (text, key) in [("order-2231-1", "order-2231-1"), ("\"a/b\"", "a/b"), ("~", "~")] {
            assert_eq!(bare(text), Some(key), "{text}");
        }
        let longest = "k".repeat(MAX_KEY);
        assert_eq!(bare(&longest), Some(longest.as_str()));
        for text in ["", "\"\"", "a b", "a\"b", "\"a", "a\"", "\"", "\"\"a\"\"", "a\tb", &"k".repeat(MAX_KEY + 1)] {
            assert_eq!(bare(text), None, "{text:?}");
        }
    }
}
