//! The accept loop: HTTP/1.1 over TCP with a bound on everything that a client could hold open.
//!
//! - At most `connections` are open; the next ones wait in the kernel's backlog and are accepted when one closes.
//! - A connection must send its first byte within `first_byte`, and a whole header within `header` of the header's first
//!   byte. hyper's own timer counts the time between two requests of a connection as a part of the second one's header, so
//!   it is not used: a connection that is kept between requests has `idle`.
//! - A connection on which no byte moves in either direction for `idle`, while no request is being worked on, is closed:
//!   an idle keep-alive, or a client that does not read its answer.
//!
//! A request that is no HTTP is answered by hyper itself, before there is a request: `400` (or `431`) without a body.
//!
//! When told to stop, the listener closes, idle connections close at once, and requests that are being answered get
//! [`LINGER`] to end.

use std::io;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes};
use hyper::Request;
use hyper::body::{Body as HttpBody, Frame, Incoming, SizeHint};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tower::ServiceExt;

/// How long answers that are on their way may take after the listener has closed. Short: results are read from disk and
/// a client that is slower than this can ask again.
const LINGER: Duration = Duration::from_secs(5);
/// Pause after `accept` failed (out of descriptors, most likely): long enough for a connection to close.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);
/// How often a connection is looked at, as a part of the shorter of its two timeouts.
const CHECKS: u32 = 4;

/// What a client may hold open, and for how long.
#[derive(Debug, Clone, Copy)]
pub struct ConnectionLimits {
    /// Connections open at once.
    pub connections: usize,
    /// Until the first byte.
    pub first_byte: Duration,
    /// For a whole request header.
    pub header: Duration,
    /// Without any byte moving.
    pub idle: Duration,
}

/// Serves `router` on `listener` until `stop`, then lets the answers that are on their way end.
pub async fn serve(listener: TcpListener, router: Router, limits: ConnectionLimits, stop: CancellationToken) {
    let slots = Arc::new(Semaphore::new(limits.connections));
    let open = TaskTracker::new();
    loop {
        let slot = tokio::select! {
            biased;
            () = stop.cancelled() => break,
            slot = Arc::clone(&slots).acquire_owned() => slot,
        };
        let Ok(slot) = slot else { break };
        let accepted = tokio::select! {
            biased;
            () = stop.cancelled() => break,
            accepted = listener.accept() => accepted,
        };
        match accepted {
            Ok((stream, _)) => {
                let (router, stop) = (router.clone(), stop.clone());
                open.spawn(async move {
                    connection(stream, router, limits, stop).await;
                    drop(slot);
                });
            }
            Err(error) => {
                tracing::warn!(%error, "a connection could not be accepted");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
    drop(listener);
    open.close();
    if tokio::time::timeout(LINGER, open.wait()).await.is_err() {
        tracing::warn!(connections = open.len(), "connections were cut off at shutdown");
    }
}

async fn connection(stream: TcpStream, router: Router, limits: ConnectionLimits, stop: CancellationToken) {
    let first = tokio::select! {
        () = stop.cancelled() => return,
        first = tokio::time::timeout(limits.first_byte, stream.readable()) => first,
    };
    if !matches!(first, Ok(Ok(()))) {
        return;
    }
    // Answers are small or large, never many small writes: delaying them only costs.
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!(%error, "no TCP_NODELAY");
    }
    let activity = Arc::new(Activity::new());
    let service = service_fn({
        let activity = Arc::clone(&activity);
        move |request: Request<Incoming>| {
            activity.header_is_whole();
            let activity = Arc::clone(&activity);
            let working = Working::begin(&activity);
            let answer = router.clone().oneshot(request.map(Body::new));
            async move {
                let answer = answer.await;
                drop(working);
                let answering = Answering(Arc::clone(&activity));
                answer.map(|answer| answer.map(|body| Answered { body, _answering: answering }))
            }
        }
    });
    let io = TokioIo::new(Watched { stream, activity: Arc::clone(&activity) });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(None);
    let mut http = pin!(http.serve_connection(io, service));
    let mut checks = tokio::time::interval(limits.idle.min(limits.header) / CHECKS);
    let mut stopping = false;
    loop {
        tokio::select! {
            ended = http.as_mut() => {
                if let Err(error) = ended {
                    tracing::debug!(%error, "a connection ended early");
                }
                return;
            }
            () = stop.cancelled(), if !stopping => {
                stopping = true;
                http.as_mut().graceful_shutdown();
            }
            _ = checks.tick() => {
                if activity.idle() >= limits.idle || activity.in_header() >= limits.header {
                    return;
                }
            }
        }
    }
}

/// When a byte last moved on a connection, how many requests are being worked on, and since when a header is coming in.
#[derive(Debug)]
struct Activity {
    start: Instant,
    moved_ms: AtomicU64,
    working: AtomicUsize,
    /// [`NOTHING`], [`REQUEST`], or the time at which the first byte of a header came.
    header_ms: AtomicU64,
}

/// No byte of a request has come since the last one was answered.
const NOTHING: u64 = u64::MAX;
/// A whole header has come and its answer is not yet sent.
const REQUEST: u64 = u64::MAX - 1;

impl Activity {
    fn new() -> Self {
        Self {
            start: Instant::now(),
            moved_ms: AtomicU64::new(0),
            working: AtomicUsize::new(0),
            header_ms: AtomicU64::new(NOTHING),
        }
    }

    fn now_ms(&self) -> u64 {
        u64::try_from(self.start.elapsed().as_millis()).unwrap_or(REQUEST).min(REQUEST - 1)
    }

    fn moved(&self) {
        self.moved_ms.store(self.now_ms(), Ordering::Relaxed);
    }

    /// Bytes came in. The first ones after an answer are those of the next header.
    fn received(&self) {
        let now = self.now_ms();
        self.moved_ms.store(now, Ordering::Relaxed);
        // It fails where a header or a body is under way already.
        let _ = self.header_ms.compare_exchange(NOTHING, now, Ordering::Relaxed, Ordering::Relaxed);
    }

    fn header_is_whole(&self) {
        self.header_ms.store(REQUEST, Ordering::Relaxed);
    }

    fn answered(&self) {
        self.moved();
        self.header_ms.store(NOTHING, Ordering::Relaxed);
    }

    /// How long the present header has been coming in; zero when none is.
    fn in_header(&self) -> Duration {
        match self.header_ms.load(Ordering::Relaxed) {
            NOTHING | REQUEST => Duration::ZERO,
            since => self.start.elapsed().saturating_sub(Duration::from_millis(since)),
        }
    }

    /// Time since a byte moved; none while a request is being worked on.
    fn idle(&self) -> Duration {
        if self.working.load(Ordering::Relaxed) > 0 {
            return Duration::ZERO;
        }
        self.start.elapsed().saturating_sub(Duration::from_millis(self.moved_ms.load(Ordering::Relaxed)))
    }
}

/// Marks a request as being worked on, also when its future is dropped half-way.
struct Working(Arc<Activity>);

impl Working {
    fn begin(activity: &Arc<Activity>) -> Self {
        activity.working.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(activity))
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        self.0.moved();
        self.0.working.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Marks an answer as being sent, until its body has ended or is given up.
struct Answering(Arc<Activity>);

impl Drop for Answering {
    fn drop(&mut self) {
        self.0.answered();
    }
}

/// The body of an answer.
struct Answered {
    body: Body,
    _answering: Answering,
}

impl HttpBody for Answered {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// A stream that notes when bytes move.
struct Watched {
    stream: TcpStream,
    activity: Arc<Activity>,
}

impl AsyncRead for Watched {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let polled = Pin::new(&mut self.stream).poll_read(cx, buffer);
        if buffer.filled().len() > before {
            self.activity.received();
        }
        polled
    }
}

impl AsyncWrite for Watched {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write(cx, bytes);
        if matches!(polled, Poll::Ready(Ok(n)) if n > 0) {
            self.activity.moved();
        }
        polled
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write_vectored(cx, slices);
        if matches!(polled, Poll::Ready(Ok(n)) if n > 0) {
            self.activity.moved();
        }
        polled
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use axum::routing::get;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;

    const LIMITS: ConnectionLimits = ConnectionLimits {
        connections: 400,
        first_byte: Duration::from_millis(200),
        header: Duration::from_millis(200),
        idle: Duration::from_millis(400),
    };

    /// How long the server is waited for before a test fails: ten times any limit above.
    const PATIENCE: Duration = Duration::from_secs(4);

    async fn start(limits: ConnectionLimits) -> (std::net::SocketAddr, CancellationToken, tokio::task::JoinHandle<()>) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let router = Router::new().route("/", get(|| async { "here" })).route(
            "/slow",
            get(|| async {
                tokio::time::sleep(Duration::from_millis(900)).await;
                "at last"
            }),
        );
        let stop = CancellationToken::new();
        let served = tokio::spawn(serve(listener, router, limits, stop.clone()));
        (address, stop, served)
    }

    async fn closed_without_words(stream: &mut TcpStream) {
        let mut rest = Vec::new();
        let read = tokio::time::timeout(PATIENCE, stream.read_to_end(&mut rest)).await.expect("still open");
        assert!(rest.is_empty() || rest.starts_with(b"HTTP/1.1 408"), "{read:?} {}", String::from_utf8_lossy(&rest));
    }

    #[tokio::test]
    async fn a_silent_socket_is_closed() {
        let (address, ..) = start(LIMITS).await;
        closed_without_words(&mut TcpStream::connect(address).await.unwrap()).await;
    }

    #[tokio::test]
    async fn dribbled_headers_are_cut_off_while_others_are_served() {
        let (address, ..) = start(LIMITS).await;
        let mut dribblers = Vec::new();
        for _ in 0..300 {
            let mut stream = TcpStream::connect(address).await.unwrap();
            stream.write_all(b"GET / HTTP/1.1\r\nHost: x\r\nX-A: ").await.unwrap();
            dribblers.push(stream);
        }
        let mut good = TcpStream::connect(address).await.unwrap();
        good.write_all(b"GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n").await.unwrap();
        let mut answer = String::new();
        tokio::time::timeout(PATIENCE, good.read_to_string(&mut answer)).await.unwrap().unwrap();
        assert!(answer.ends_with("here"), "{answer}");
        for stream in &mut dribblers {
            closed_without_words(stream).await;
        }
    }

    #[tokio::test]
    async fn a_connection_that_is_kept_between_requests_has_the_idle_time_and_its_next_header_the_header_time() {
        let limits = ConnectionLimits { idle: Duration::from_mins(1), ..LIMITS };
        let (address, ..) = start(limits).await;
        let mut stream = TcpStream::connect(address).await.unwrap();
        for path in ["/", "/slow", "/"] {
            stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: x\r\n\r\n").as_bytes()).await.unwrap();
            let mut head = [0; 12];
            stream.read_exact(&mut head).await.unwrap();
            assert_eq!(&head, b"HTTP/1.1 200");
            let mut rest = [0; 4096];
            while !rest.windows(4).any(|four| four == b"here" || four == b"last") {
                assert!(stream.read(&mut rest).await.unwrap() > 0, "{path}");
            }
            // Longer than a header may take, several times.
            tokio::time::sleep(limits.header * 4).await;
        }
        stream.write_all(b"GET / HTTP/1.1\r\nHo").await.unwrap();
        closed_without_words(&mut stream).await;
    }

    #[tokio::test]
    async fn an_idle_connection_is_closed_and_a_slow_handler_is_not() {
        let (address, ..) = start(LIMITS).await;
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(b"GET /slow HTTP/1.1\r\nHost: x\r\n\r\n").await.unwrap();
        let mut answer = String::new();
        // The answer comes although the handler takes longer than the idle limit; then the kept connection is closed.
        tokio::time::timeout(PATIENCE, stream.read_to_string(&mut answer)).await.expect("still open").unwrap();
        assert!(answer.ends_with("at last"), "{answer}");
    }

    #[tokio::test]
    async fn no_more_connections_are_served_than_allowed_and_the_next_one_waits() {
        let (address, ..) = start(ConnectionLimits { connections: 1, ..LIMITS }).await;
        let first = TcpStream::connect(address).await.unwrap();
        let mut second = TcpStream::connect(address).await.unwrap();
        second.write_all(b"GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n").await.unwrap();
        let mut answer = String::new();
        // The first one is silent, is closed after its deadline, and makes room.
        tokio::time::timeout(PATIENCE, second.read_to_string(&mut answer)).await.unwrap().unwrap();
        assert!(answer.ends_with("here"), "{answer}");
        drop(first);
    }

    #[tokio::test]
    async fn stopping_lets_an_answer_end_and_closes_the_idle() {
        let (address, stop, served) = start(ConnectionLimits { idle: Duration::from_mins(1), ..LIMITS }).await;
        let mut busy = TcpStream::connect(address).await.unwrap();
        busy.write_all(b"GET /slow HTTP/1.1\r\nHost: x\r\n\r\n").await.unwrap();
        let mut idle = TcpStream::connect(address).await.unwrap();
        idle.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n").await.unwrap();
        let mut some = [0; 16];
        idle.read_exact(&mut some).await.unwrap();
        stop.cancel();
        let mut answer = String::new();
        tokio::time::timeout(PATIENCE, busy.read_to_string(&mut answer)).await.unwrap().unwrap();
        assert!(answer.ends_with("at last"), "{answer}");
        tokio::time::timeout(PATIENCE, served).await.expect("still serving").unwrap();
        assert!(TcpStream::connect(address).await.is_err());
    }
}
