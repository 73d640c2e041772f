//! Compressed request bodies: unpacked while they come in, with a bound on both their lengths.
//!
//! The bound on the length as it was sent alone would let two kilobytes become gigabytes; that on the unpacked length
//! alone would let an endless stream of empty frames go on. So both hold.

use std::io;
use std::pin::Pin;

use async_compression::tokio::bufread::{GzipDecoder, ZstdDecoder};
use async_compression::zstd::DParameter;
use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, HeaderValue, header};
use futures_util::stream::{Stream, unfold};
use http_body_util::BodyExt as _;
use tokio::io::{AsyncRead, AsyncReadExt as _};
use tokio_util::io::StreamReader;

use crate::api::problem::{Kind, Problem};

/// Largest window of a zstd frame, as a power of two: 8 MiB, which every decoder must know (RFC 8878, 3.1.1.1.2). The
/// sender chooses the window, and the decoder holds it in memory.
const ZSTD_WINDOW: u32 = 23;
/// Bytes that are unpacked at a time: between two of them other requests get their turn.
const STEP: usize = 64 * 1024;

/// A coding that bodies may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    /// RFC 1952.
    Gzip,
    /// RFC 8878.
    Zstd,
}

/// Why a packed body could not be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unpacking {
    /// Too long, as it was sent or unpacked.
    TooLong,
    /// It is not what it is said to be, or the client stopped sending.
    Damaged,
}

impl Coding {
    /// What the header says; none for a body that is not packed.
    ///
    /// # Errors
    /// 415 with the codings that there are.
    pub(super) fn of(headers: &HeaderMap) -> Result<Option<Self>, Problem> {
        let Some(value) = headers.get(header::CONTENT_ENCODING) else { return Ok(None) };
        match value.to_str().unwrap_or_default().trim().to_ascii_lowercase().as_str() {
            "" | "identity" => Ok(None),
            "gzip" | "x-gzip" => Ok(Some(Self::Gzip)),
            "zstd" => Ok(Some(Self::Zstd)),
            other => {
                let detail = format!(
                    "The body is packed with {}. Send it as it is, or packed with gzip or zstd.",
                    other.escape_default()
                );
                Err(Problem::new(Kind::UnsupportedMediaType, detail)
                    .with_header(header::ACCEPT_ENCODING, HeaderValue::from_static("gzip, zstd")))
            }
        }
    }

    /// Its name.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
        }
    }

    /// Reads a body and appends it, unpacked, to `out`: at most `longest` bytes on either side.
    pub(super) async fn unpack(self, body: &mut Body, longest: usize, out: &mut Vec<u8>) -> Result<(), Unpacking> {
        let packed = StreamReader::new(Box::pin(bounded(body, longest)));
        let mut unpacked: Pin<Box<dyn AsyncRead + Send + '_>> = match self {
            Self::Gzip => {
                let mut decoder = GzipDecoder::new(packed);
                // A gzip file may consist of several, one after the other.
                decoder.multiple_members(true);
                Box::pin(decoder)
            }
            Self::Zstd => {
                let mut decoder = ZstdDecoder::with_params(packed, &[DParameter::window_log_max(ZSTD_WINDOW)]);
                decoder.multiple_members(true);
                Box::pin(decoder)
            }
        };
        let mut step = vec![0; STEP];
        loop {
            let read = unpacked.read(&mut step).await.map_err(|error| match error.kind() {
                io::ErrorKind::FileTooLarge => Unpacking::TooLong,
                _ => Unpacking::Damaged,
            })?;
            if read == 0 {
                return Ok(());
            }
            if out.len() + read > longest {
                return Err(Unpacking::TooLong);
            }
            out.extend_from_slice(&step[..read]);
            tokio::task::consume_budget().await;
        }
    }
}

/// The pieces of a body, and an error when they are more than `longest` bytes.
fn bounded(body: &mut Body, longest: usize) -> impl Stream<Item = io::Result<Bytes>> + Send + '_ {
    unfold((body, longest), |(body, left)| async move {
        loop {
            let piece = match body.frame().await?.map(hyper::body::Frame::into_data) {
                Ok(Ok(piece)) => piece,
                Ok(Err(_trailers)) => continue,
                Err(_) => return Some((Err(io::ErrorKind::ConnectionAborted.into()), (body, left))),
            };
            return Some(match left.checked_sub(piece.len()) {
                Some(left) => (Ok(piece), (body, left)),
                None => (Err(io::ErrorKind::FileTooLarge.into()), (body, 0)),
            });
        }
    })
}
