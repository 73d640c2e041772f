//! What every request goes through and every answer carries: an id, a place in the log, a count, headers that keep
//! browsers safe.

use std::hash::{BuildHasher as _, RandomState};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::middleware::Next;
use axum::response::Response;
use tracing::Instrument as _;
use uuid::{Builder, Uuid};

use crate::telemetry::Metrics;

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
const TRACE_PARENT: HeaderName = HeaderName::from_static("traceparent");
/// Longest id that is taken over from a client.
const MAX_REQUEST_ID: usize = 128;
/// What is served is data: a browser that opens it runs nothing and asks nobody else. Drawings style themselves.
const CONTENT_POLICY: HeaderValue =
    HeaderValue::from_static("default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox");

/// The id of a request, among its extensions.
#[derive(Debug, Clone)]
pub(super) struct RequestId(HeaderValue);

impl RequestId {
    pub(super) fn as_str(&self) -> &str {
        // It is plain ASCII: taken over as such, or made here.
        self.0.to_str().unwrap_or_default()
    }
}

/// The outermost layer.
pub(super) async fn surround(State(metrics): State<Metrics>, mut request: Request, next: Next) -> Response {
    let id = request.headers().get(REQUEST_ID).filter(|id| is_plain(id)).cloned().unwrap_or_else(fresh_id);
    let id = RequestId(id);
    let method = request.method().clone();
    let uri = request.uri().clone();
    let route = request.extensions().get::<MatchedPath>().cloned();
    // At the level of errors, so that no filter takes the id away from the lines that it lets through.
    let span = tracing::error_span!(
        "request",
        id = id.as_str(),
        trace = tracing::field::Empty,
        parent = tracing::field::Empty
    );
    if let Some((trace, parent)) = trace(request.headers()) {
        span.record("trace", trace).record("parent", parent);
    }
    request.extensions_mut().insert(id.clone());
    let begun = std::time::Instant::now();
    let mut response = next.run(request).instrument(span.clone()).await;
    let headers = response.headers_mut();
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(CONTENT_POLICY);
    headers.entry(header::REFERRER_POLICY).or_insert(HeaderValue::from_static("no-referrer"));
    headers.insert(REQUEST_ID, id.0);
    let status = response.status().as_u16();
    let took = begun.elapsed();
    metrics.answered(method.as_str(), route.as_ref().map(MatchedPath::as_str), status, took);
    let (path, elapsed_ms) = (uri.path(), took.as_secs_f64() * 1000.0);
    span.in_scope(|| {
        if response.status().is_server_error() {
            tracing::warn!(%method, path, status, elapsed_ms, "{method} {path}: {status}");
        } else if method.is_safe() && !response.status().is_client_error() {
            // Reads, polls and probes that went well change nothing: they are counted, and told of to those who ask.
            tracing::debug!(%method, path, status, elapsed_ms, "{method} {path}: {status}");
        } else {
            tracing::info!(%method, path, status, elapsed_ms, "{method} {path}: {status}");
        }
    });
    response
}

/// An id that goes into logs and headers: visible ASCII without quotes.
fn is_plain(id: &HeaderValue) -> bool {
    let bytes = id.as_bytes();
    (1..=MAX_REQUEST_ID).contains(&bytes.len())
        && bytes.iter().all(|b| b.is_ascii_alphanumeric() || b"-_.:/+=".contains(b))
}

/// An id that no other request has: a version 7 UUID whose random part comes from a keyed hash of a count, with a key that
/// the system gave at the start. Asking the system for random bytes at each request would cost as much as a small answer.
fn fresh_id() -> HeaderValue {
    static KEY: LazyLock<RandomState> = LazyLock::new(RandomState::new);
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let (high, low) = (KEY.hash_one((count, 0_u8)), KEY.hash_one((count, 1_u8)));
    let mut random = [0; 10];
    random[..8].copy_from_slice(&high.to_le_bytes());
    random[8..].copy_from_slice(&low.to_le_bytes()[..2]);
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let id = Builder::from_unix_timestamp_millis(since.as_millis() as u64, &random).into_uuid();
    // A UUID is a header's value always.
    HeaderValue::from_str(id.hyphenated().encode_lower(&mut Uuid::encode_buffer()))
        .unwrap_or_else(|_| HeaderValue::from_static("none"))
}

/// The trace that a request belongs to and the caller's step in it (W3C Trace Context, 3.2), when both are sound.
fn trace(headers: &HeaderMap) -> Option<(&str, &str)> {
    let mut fields = headers.get(TRACE_PARENT)?.to_str().ok()?.split('-');
    let (version, trace, parent, flags) = (fields.next()?, fields.next()?, fields.next()?, fields.next()?);
    let hex = |text: &str, digits: usize| {
        text.len() == digits && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
    };
    let is_set = |text: &str| text.bytes().any(|b| b != b'0');
    // A later version may have more fields; the first one has these four.
    let sound = hex(version, 2) && version != "ff" && hex(trace, 32) && hex(parent, 16) && hex(flags, 2);
    let whole = version != "00" || fields.next().is_none();
    (sound && whole && is_set(trace) && is_set(parent)).then_some((trace, parent))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::io;
    use std::sync::{Arc, Mutex};

    use axum::Router;
    use axum::body::Body;
    use axum::http::StatusCode;
    use axum::middleware::from_fn_with_state;
    use axum::routing::get;
    use tower::ServiceExt as _;

    use super::*;

    /// A log that is read afterwards.
    #[derive(Clone, Default)]
    struct Lines(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[tokio::test]
    async fn the_log_tells_of_changes_and_refusals_and_at_debug_of_reads_that_went_well() {
        let router = Router::new()
            .route("/", get(|| async {}).post(|| async {}))
            .route("/failing", get(|| async { StatusCode::INTERNAL_SERVER_ERROR }))
            .layer(from_fn_with_state(Metrics::new(), surround));
        let router = &router;
        let log = async |level: tracing::Level| {
            let lines = Lines::default();
            let to = lines.clone();
            let log = tracing_subscriber::fmt().with_max_level(level).with_ansi(false).with_writer(move || to.clone());
            let _here = tracing::subscriber::set_default(log.finish());
            for (method, path) in [("GET", "/"), ("HEAD", "/"), ("POST", "/"), ("PUT", "/"), ("GET", "/failing")] {
                let request = Request::builder().method(method).uri(path).header(REQUEST_ID, "abc-1");
                router.clone().oneshot(request.body(Body::empty()).unwrap()).await.unwrap();
            }
            String::from_utf8(lines.0.lock().unwrap().clone()).unwrap()
        };
        let info = log(tracing::Level::INFO).await;
        let told = |log: &str, what: &str| log.lines().any(|line| line.contains(what) && line.contains("abc-1"));
        for what in ["POST /: 200", "PUT /: 405", "GET /failing: 500"] {
            assert!(told(&info, what), "{what} is not in {info}");
        }
        assert!(!told(&info, "GET /: 200") && !told(&info, "HEAD /: 200"), "{info}");
        let debug = log(tracing::Level::DEBUG).await;
        assert!(told(&debug, "GET /: 200") && told(&debug, "HEAD /: 200"), "{debug}");
    }

    fn traced(value: &'static str) -> bool {
        trace(&HeaderMap::from_iter([(TRACE_PARENT, HeaderValue::from_static(value))])).is_some()
    }

    #[test]
    fn ids_are_version_7_uuids_and_no_two_are_the_same() {
        let ids: HashSet<Uuid> = (0..10_000).map(|_| Uuid::parse_str(fresh_id().to_str().unwrap()).unwrap()).collect();
        assert_eq!(ids.len(), 10_000);
        assert!(ids.iter().all(|id| id.get_version_num() == 7));
    }

    #[test]
    fn a_trace_is_taken_over_when_it_is_whole() {
        assert!(traced("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"));
        assert!(traced("01-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more"));
        for bad in [
            "",
            "00",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more",
            "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
            "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e473\"-00f067aa0ba902b7-01",
        ] {
            assert!(!traced(bad), "{bad}");
        }
    }
}
