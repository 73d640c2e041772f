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
    let text = value.to_str().unwrap_or_default().trim_matches('"');
    if !(1..=MAX_KEY).contains(&text.len()) {
        return Err(Problem::header("Idempotency-Key", &format!("must be 1 to {MAX_KEY} visible ASCII characters")));
    }
    Ok(Some(IdempotencyKey { scope: scope.to_owned(), key: text.to_owned(), body: digest() }))
}
