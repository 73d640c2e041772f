//! Reading a body with a bound on its length, its time, and the memory that all bodies in flight take together.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, header};
use http_body_util::BodyExt;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::Instant;

use crate::api::problem::{Kind, Problem};
use crate::formats::sniff::{Sniffed, sniff};

/// Grain of the memory account, bytes: small enough that a small body costs little, large enough that the largest
/// account stays in range of a semaphore's `u32`.
const GRAIN: usize = 1024;
/// How long a request waits for memory before it is told to come again.
const MEMORY_PATIENCE: Duration = Duration::from_secs(10);
/// After a body was refused for its length, so much of it is read and thrown away, so that a client which first sends
/// and then listens gets the answer.
const DISCARDED: usize = 8 << 20;
/// And for so long.
const DISCARD_TIME: Duration = Duration::from_secs(2);
/// What a client is told to wait when memory ran out.
const RETRY_S: u32 = 5;

/// Bounds on bodies, shared by all requests.
#[derive(Debug, Clone)]
pub(crate) struct BodyLimits {
    longest: usize,
    time: Duration,
    patience: Duration,
    memory: Arc<Semaphore>,
}

/// A body that was read. It keeps its share of the memory account until it is dropped.
#[derive(Debug)]
pub(crate) struct Received {
    /// The bytes.
    pub bytes: Bytes,
    _memory: OwnedSemaphorePermit,
}

impl BodyLimits {
    /// At most `longest` bytes a body, `memory` bytes in all bodies in flight, and `time` for a body to come in.
    #[must_use]
    pub(crate) fn new(longest: usize, memory: usize, time: Duration) -> Self {
        let grains = (memory / GRAIN).clamp(1, (u32::MAX as usize).min(Semaphore::MAX_PERMITS));
        Self { longest, time, patience: MEMORY_PATIENCE, memory: Arc::new(Semaphore::new(grains)) }
    }
}

/// Reads a JSON body of at most `longest` bytes (and at most what the service takes anywhere).
///
/// # Errors
/// 413, 415, 408, 503, or 400 when the client stopped sending.
pub(crate) async fn receive(
    limits: &BodyLimits,
    longest: usize,
    headers: &HeaderMap,
    mut body: Body,
) -> Result<Received, Problem> {
    let longest = longest.min(limits.longest);
    let form = content_form(headers)?;
    let announced = headers.get(header::CONTENT_LENGTH).and_then(|v| v.to_str().ok()).and_then(|v| v.parse().ok());
    if announced.is_some_and(|length: usize| length > longest) {
        discard(&mut body).await;
        return Err(too_large(longest));
    }
    let share = u32::try_from(announced.unwrap_or(longest).div_ceil(GRAIN).max(1)).unwrap_or(u32::MAX);
    let memory = tokio::time::timeout(limits.patience, Arc::clone(&limits.memory).acquire_many_owned(share)).await;
    let Ok(Ok(memory)) = memory else {
        return Err(Problem::new(Kind::Overloaded, "Too many bodies are being read at once; this one was not read.")
            .retry_after(RETRY_S));
    };
    let deadline = Instant::now() + limits.time;
    let mut bytes = Vec::with_capacity(announced.unwrap_or(0));
    loop {
        let Ok(frame) = tokio::time::timeout_at(deadline, body.frame()).await else {
            return Err(Problem::new(
                Kind::BodyTimeout,
                format!(
                    "The body was not there after {} seconds; {} bytes had come.",
                    limits.time.as_secs(),
                    bytes.len()
                ),
            ));
        };
        let Some(frame) = frame else { break };
        let frame = frame.map_err(|_| Problem::new(Kind::BadRequest, "The body ended before its announced end."))?;
        let Ok(data) = frame.into_data() else { continue };
        if bytes.len() + data.len() > longest {
            drop(bytes);
            discard(&mut body).await;
            return Err(too_large(longest));
        }
        bytes.extend_from_slice(&data);
    }
    form.admit(&bytes)?;
    Ok(Received { bytes: bytes.into(), _memory: memory })
}

fn too_large(longest: usize) -> Problem {
    Problem::new(Kind::BodyTooLarge, format!("A body here has at most {longest} bytes."))
}

/// Reads what still comes and throws it away, within bounds.
async fn discard(body: &mut Body) {
    let mut left = DISCARDED;
    let reading = async {
        while let Some(Ok(frame)) = body.frame().await {
            let length = frame.data_ref().map_or(0, Bytes::len);
            if length > left {
                break;
            }
            left -= length;
        }
    };
    // Either way the answer goes out next.
    let _ = tokio::time::timeout(DISCARD_TIME, reading).await;
}

/// What the header says of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// JSON.
    Json,
    /// Nothing, or what curl says unasked: the first bytes tell.
    Untold,
}

impl Form {
    fn admit(self, bytes: &[u8]) -> Result<(), Problem> {
        match (self, sniff(bytes)) {
            (Self::Json, _) | (Self::Untold, Some(Sniffed::Json)) => Ok(()),
            (Self::Untold, Some(Sniffed::GltfBinary)) => {
                Err(unsupported("The body is glTF binary (it begins with `glTF`), and meshes are not read here."))
            }
            (Self::Untold, None) => {
                Err(unsupported("The body has no type of its own and does not begin like JSON (with `{`)."))
            }
        }
    }
}

fn content_form(headers: &HeaderMap) -> Result<Form, Problem> {
    if let Some(encoding) = headers.get(header::CONTENT_ENCODING)
        && !encoding.as_bytes().eq_ignore_ascii_case(b"identity")
    {
        return Err(unsupported("The body is compressed, and compressed bodies are not read here."));
    }
    let Some(value) = headers.get(header::CONTENT_TYPE) else { return Ok(Form::Untold) };
    let text = value.to_str().unwrap_or_default();
    let essence = text.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    match essence.as_str() {
        "application/json" | "text/json" => Ok(Form::Json),
        "" | "application/x-www-form-urlencoded" | "application/octet-stream" => Ok(Form::Untold),
        other => Err(unsupported(&format!("The body is said to be {}.", other.escape_default()))),
    }
}

fn unsupported(what: &str) -> Problem {
    Problem::new(Kind::UnsupportedMediaType, format!("{what} Send JSON, as application/json."))
        .with_header(header::ACCEPT, axum::http::HeaderValue::from_static("application/json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(longest: usize, memory: usize) -> BodyLimits {
        let patience = Duration::from_millis(20);
        BodyLimits { patience, ..BodyLimits::new(longest, memory, Duration::from_millis(20)) }
    }

    fn typed(media: &'static str) -> HeaderMap {
        HeaderMap::from_iter([(header::CONTENT_TYPE, axum::http::HeaderValue::from_static(media))])
    }

    async fn kind_of(headers: HeaderMap, body: &'static str) -> Result<Bytes, Kind> {
        let limits = limits(10, 10);
        receive(&limits, usize::MAX, &headers, Body::from(body)).await.map(|r| r.bytes).map_err(|p| p.kind())
    }

    #[tokio::test]
    async fn json_is_taken_under_its_name_and_recognised_without_one() {
        assert_eq!(kind_of(typed("application/json; charset=utf-8"), "{}").await, Ok("{}".into()));
        assert_eq!(kind_of(HeaderMap::new(), " {}").await, Ok(" {}".into()));
        assert_eq!(kind_of(typed("application/x-www-form-urlencoded"), "{}").await, Ok("{}".into()));
        assert_eq!(kind_of(HeaderMap::new(), "solid").await, Err(Kind::UnsupportedMediaType));
        assert_eq!(kind_of(HeaderMap::new(), "glTF").await, Err(Kind::UnsupportedMediaType));
        assert_eq!(kind_of(typed("model/step"), "{}").await, Err(Kind::UnsupportedMediaType));
    }

    #[tokio::test]
    async fn a_body_of_the_longest_length_is_taken_and_one_byte_more_is_not() {
        assert_eq!(kind_of(HeaderMap::new(), "{        }").await, Ok("{        }".into()));
        assert_eq!(kind_of(HeaderMap::new(), "{         }").await, Err(Kind::BodyTooLarge));
    }

    #[tokio::test]
    async fn a_compressed_body_is_refused_by_its_header() {
        let mut headers = typed("application/json");
        headers.insert(header::CONTENT_ENCODING, axum::http::HeaderValue::from_static("gzip"));
        assert_eq!(kind_of(headers, "{}").await, Err(Kind::UnsupportedMediaType));
    }

    #[tokio::test]
    async fn a_body_that_does_not_come_ends_in_a_timeout() {
        let body = Body::from_stream(futures_util::stream::pending::<Result<Bytes, std::io::Error>>());
        let limits = limits(10, 10);
        let problem = receive(&limits, 10, &HeaderMap::new(), body).await.unwrap_err();
        assert_eq!(problem.kind(), Kind::BodyTimeout);
    }

    #[tokio::test]
    async fn bodies_beyond_the_memory_are_told_to_come_again() {
        let limits = limits(2048, 2048);
        let long: String = format!("{{{}}}", " ".repeat(1500));
        let first = receive(&limits, 2048, &HeaderMap::new(), Body::from(long.clone())).await.unwrap();
        let second = receive(&limits, 2048, &HeaderMap::new(), Body::from(long.clone())).await;
        assert_eq!(second.unwrap_err().kind(), Kind::Overloaded);
        drop(first);
        assert!(receive(&limits, 2048, &HeaderMap::new(), Body::from(long)).await.is_ok());
    }
}
