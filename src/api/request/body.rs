//! Reading a body with a bound on its length, its time, and the memory that all bodies in flight take together.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, HeaderValue, header};
use http_body_util::BodyExt;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::Instant;

use super::coding::{Coding, Unpacking};
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
    /// The bytes, unpacked.
    pub bytes: Bytes,
    /// What they are.
    pub media: Media,
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

/// Reads a body of one of the `accepted` types and of at most `longest` bytes (and at most what the service takes
/// anywhere), as it is sent and unpacked.
///
/// # Errors
/// 413, 415, 408, 503, or 400 when the client stopped sending or the body is not packed as it is said to be.
pub(crate) async fn receive(
    limits: &BodyLimits,
    longest: usize,
    accepted: &[Media],
    headers: &HeaderMap,
    mut body: Body,
) -> Result<Received, Problem> {
    let longest = longest.min(limits.longest);
    let told = told(headers, accepted)?;
    let coding = Coding::of(headers)?;
    let announced = headers.get(header::CONTENT_LENGTH).and_then(|v| v.to_str().ok()).and_then(|v| v.parse().ok());
    if announced.is_some_and(|length: usize| length > longest) {
        discard(&mut body).await;
        return Err(too_large(longest));
    }
    // How long a packed body becomes is known when it has been unpacked.
    let length = announced.filter(|_| coding.is_none());
    let share = u32::try_from(length.unwrap_or(longest).div_ceil(GRAIN).max(1)).unwrap_or(u32::MAX);
    let memory = tokio::time::timeout(limits.patience, Arc::clone(&limits.memory).acquire_many_owned(share)).await;
    let Ok(Ok(memory)) = memory else {
        return Err(Problem::new(Kind::Overloaded, "Too many bodies are being read at once; this one was not read.")
            .retry_after(RETRY_S));
    };
    let deadline = Instant::now() + limits.time;
    let mut bytes = Vec::with_capacity(length.unwrap_or(0));
    let read = match coding {
        None => tokio::time::timeout_at(deadline, plain(&mut body, longest, &mut bytes)).await,
        Some(coding) => tokio::time::timeout_at(deadline, coding.unpack(&mut body, longest, &mut bytes)).await,
    };
    match read {
        Ok(Ok(())) => {}
        Ok(Err(Unpacking::TooLong)) => {
            drop(bytes);
            discard(&mut body).await;
            return Err(too_large(longest));
        }
        Ok(Err(Unpacking::Damaged)) => {
            let detail = coding.map_or_else(
                || "The body ended before its announced end.".to_owned(),
                |coding| format!("The body is said to be packed with {} and cannot be unpacked.", coding.name()),
            );
            return Err(Problem::new(Kind::BadRequest, detail));
        }
        Err(_) => {
            let (seconds, read) = (limits.time.as_secs(), bytes.len());
            let detail = format!("The body was not there after {seconds} seconds; {read} bytes had come.");
            return Err(Problem::new(Kind::BodyTimeout, detail));
        }
    }
    let media = match told {
        Some(media) => as_told(media, &bytes, accepted)?,
        None => recognised(&bytes, accepted)?,
    };
    Ok(Received { bytes: bytes.into(), media, _memory: memory })
}

/// Reads a body that is not packed.
async fn plain(body: &mut Body, longest: usize, out: &mut Vec<u8>) -> Result<(), Unpacking> {
    while let Some(frame) = body.frame().await {
        let Ok(data) = frame.map_err(|_| Unpacking::Damaged)?.into_data() else { continue };
        if out.len() + data.len() > longest {
            return Err(Unpacking::TooLong);
        }
        out.extend_from_slice(&data);
    }
    Ok(())
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

/// A type of body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Media {
    /// JSON.
    Json,
    /// glTF binary.
    GltfBinary,
    /// glTF as JSON.
    GltfJson,
    /// Parts, as a form sends them; the whole type, which has the boundary between them.
    Multipart(HeaderValue),
}

impl Media {
    /// Parts, where it does not matter what stands between them: for lists of what is accepted.
    pub(crate) const PARTS: Self = Self::Multipart(HeaderValue::from_static("multipart/form-data"));

    /// The types of a surface.
    pub(crate) const SURFACES: [Self; 3] = [Self::Json, Self::GltfBinary, Self::GltfJson];

    const fn name(&self) -> &'static str {
        match self {
            Self::Json => "application/json",
            Self::GltfBinary => "model/gltf-binary",
            Self::GltfJson => "model/gltf+json",
            Self::Multipart(_) => "multipart/form-data",
        }
    }

    fn is_among(&self, accepted: &[Self]) -> bool {
        accepted.iter().any(|other| other.name() == self.name())
    }
}

/// What the header says of the body; none when it says nothing, or what curl says unasked.
fn told(headers: &HeaderMap, accepted: &[Media]) -> Result<Option<Media>, Problem> {
    let Some(value) = headers.get(header::CONTENT_TYPE) else { return Ok(None) };
    let text = value.to_str().unwrap_or_default();
    let essence = text.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    let media = match essence.as_str() {
        "application/json" | "text/json" => Media::Json,
        "model/gltf-binary" => Media::GltfBinary,
        "model/gltf+json" => Media::GltfJson,
        "multipart/form-data" => Media::Multipart(value.clone()),
        "" | "application/x-www-form-urlencoded" | "application/octet-stream" => return Ok(None),
        other => return Err(unsupported(&format!("The body is said to be {}.", other.escape_default()), accepted)),
    };
    if media.is_among(accepted) {
        return Ok(Some(media));
    }
    Err(unsupported(&format!("The body is said to be {essence}, which is not read here."), accepted))
}

/// What the body is said to be, unless its first bytes say otherwise.
fn as_told(media: Media, bytes: &[u8], accepted: &[Media]) -> Result<Media, Problem> {
    let binary = sniff(bytes) == Some(Sniffed::GltfBinary);
    match media {
        Media::Json | Media::GltfJson if binary => {
            Err(unsupported("The body is said to be JSON, and is glTF binary by its first bytes.", accepted))
        }
        Media::GltfBinary if !binary => {
            Err(unsupported("The body is said to be glTF binary and does not begin with `glTF`.", accepted))
        }
        media => Ok(media),
    }
}

/// What the body is by its first bytes.
fn recognised(bytes: &[u8], accepted: &[Media]) -> Result<Media, Problem> {
    let media = match sniff(bytes) {
        Some(Sniffed::Json) => Media::Json,
        Some(Sniffed::GltfBinary) => Media::GltfBinary,
        None => {
            return Err(unsupported(
                "The body has no type of its own and does not begin like JSON (with `{`).",
                accepted,
            ));
        }
    };
    if media.is_among(accepted) {
        return Ok(media);
    }
    Err(unsupported(&format!("The body is {} by its first bytes, which is not read here.", media.name()), accepted))
}

fn unsupported(what: &str, accepted: &[Media]) -> Problem {
    let names: Vec<&str> = accepted.iter().map(Media::name).collect();
    let problem = Problem::new(Kind::UnsupportedMediaType, format!("{what} Send {}.", names.join(" or ")));
    match HeaderValue::from_str(&names.join(", ")) {
        Ok(list) => problem.with_header(header::ACCEPT, list),
        Err(_) => problem,
    }
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
        receive(&limits, usize::MAX, &[Media::Json], &headers, Body::from(body))
            .await
            .map(|r| r.bytes)
            .map_err(|p| p.kind())
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

    async fn packed(coding: &'static str, bytes: Vec<u8>, longest: usize) -> Result<Bytes, Kind> {
        let limits = BodyLimits::new(longest, 1 << 30, Duration::from_mins(1));
        let mut headers = typed("application/json");
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static(coding));
        let read = receive(&limits, usize::MAX, &[Media::Json], &headers, Body::from(bytes)).await;
        read.map(|r| r.bytes).map_err(|p| p.kind())
    }

    async fn pack(coding: &str, plain: &[u8]) -> Vec<u8> {
        use async_compression::tokio::bufread::{GzipEncoder, ZstdEncoder};
        use tokio::io::AsyncReadExt as _;
        let mut out = Vec::new();
        match coding {
            "gzip" => GzipEncoder::new(plain).read_to_end(&mut out).await.unwrap(),
            _ => ZstdEncoder::new(plain).read_to_end(&mut out).await.unwrap(),
        };
        out
    }

    #[tokio::test]
    async fn a_packed_body_is_unpacked_and_bounded_on_both_sides() {
        for coding in ["gzip", "zstd"] {
            let text = format!("{{{}}}", " ".repeat(9_998));
            let sent = pack(coding, text.as_bytes()).await;
            assert_eq!(packed(coding, sent.clone(), 10_000).await, Ok(text.into()), "{coding}");
            // One byte more than may be, unpacked.
            assert_eq!(packed(coding, sent.clone(), 9_999).await, Err(Kind::BodyTooLarge));
            // 64 MiB in some kilobytes.
            let bomb = pack(coding, &vec![b' '; 64 << 20]).await;
            assert!(bomb.len() < 100_000);
            assert_eq!(packed(coding, bomb, 1 << 20).await, Err(Kind::BodyTooLarge));
            // Longer than may be as it is sent, and nothing when unpacked.
            let empty = pack(coding, b"").await.repeat(10_000);
            assert_eq!(packed(coding, empty, 10_000).await, Err(Kind::BodyTooLarge));
            // Not what it is said to be, or cut.
            assert_eq!(packed(coding, b"{}".to_vec(), 10_000).await, Err(Kind::BadRequest));
            assert_eq!(packed(coding, sent[..sent.len() - 5].to_vec(), 10_000).await, Err(Kind::BadRequest));
        }
        for other in ["br", "deflate", "gzip, gzip"] {
            assert_eq!(packed(other, b"{}".to_vec(), 10_000).await, Err(Kind::UnsupportedMediaType), "{other}");
        }
        assert_eq!(packed("identity", b"{}".to_vec(), 10_000).await, Ok("{}".into()));
    }

    #[tokio::test]
    async fn a_body_that_does_not_come_ends_in_a_timeout() {
        let body = Body::from_stream(futures_util::stream::pending::<Result<Bytes, std::io::Error>>());
        let limits = limits(10, 10);
        let problem = receive(&limits, 10, &[Media::Json], &HeaderMap::new(), body).await.unwrap_err();
        assert_eq!(problem.kind(), Kind::BodyTimeout);
    }

    #[tokio::test]
    async fn bodies_beyond_the_memory_are_told_to_come_again() {
        let limits = limits(2048, 2048);
        let long: String = format!("{{{}}}", " ".repeat(1500));
        let first = receive(&limits, 2048, &[Media::Json], &HeaderMap::new(), Body::from(long.clone())).await.unwrap();
        let second = receive(&limits, 2048, &[Media::Json], &HeaderMap::new(), Body::from(long.clone())).await;
        assert_eq!(second.unwrap_err().kind(), Kind::Overloaded);
        drop(first);
        assert!(receive(&limits, 2048, &[Media::Json], &HeaderMap::new(), Body::from(long)).await.is_ok());
    }
}
