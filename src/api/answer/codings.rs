//! Content codings: what an answer is compressed with (RFC 9110, 8.4 and 12.5.3).

use std::io::Write as _;

use axum::http::{HeaderMap, HeaderValue, header};

/// How bytes are coded on their way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Coding {
    /// As they are.
    Identity,
    /// RFC 1952.
    Gzip,
    /// RFC 8878.
    Zstd,
}

/// Marks an answer that is in the coding of its choice already, be it none, and has the tag of that (as an extension of
/// the response).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coded;

/// What is offered, the best first.
const OFFERED: [Coding; 3] = [Coding::Zstd, Coding::Gzip, Coding::Identity];
/// Level of gzip, of 9. A result is compressed once and read many times; beyond this level the gain is below a percent.
const GZIP_LEVEL: u32 = 6;
/// Level of zstd, of 22; beyond it the time doubles with every percent.
const ZSTD_LEVEL: i32 = 6;

impl Coding {
    /// Its name in headers.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Identity => "identity",
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
        }
    }

    /// The coding that `Accept-Encoding` likes best: of equals zstd, then gzip, then none. Bytes as they are when the
    /// header is absent or refuses everything.
    #[must_use]
    pub(crate) fn choose(headers: &HeaderMap) -> Self {
        if !headers.contains_key(header::ACCEPT_ENCODING) {
            return Self::Identity;
        }
        let listed = || {
            let values = headers.get_all(header::ACCEPT_ENCODING).iter().filter_map(|v| v.to_str().ok());
            values.flat_map(|v| v.split(',')).filter_map(parse)
        };
        let mut best = (Self::Identity, 0);
        for coding in OFFERED {
            let named = listed().find(|(name, _)| name.eq_ignore_ascii_case(coding.name()));
            let quality = match named.or_else(|| listed().find(|(name, _)| *name == "*")) {
                Some((_, quality)) => quality,
                // Bytes as they are need not be named, but what is named is liked better.
                None => 0,
            };
            if quality > best.1 {
                best = (coding, quality);
            }
        }
        best.0
    }

    /// The bytes in this coding. Takes long for many bytes: not for an async thread.
    ///
    /// # Errors
    /// What the library says; it has no reason to for bytes in memory.
    pub(crate) fn encode(self, bytes: &[u8]) -> std::io::Result<Vec<u8>> {
        match self {
            Self::Identity => Ok(bytes.to_vec()),
            Self::Gzip => {
                let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::new(GZIP_LEVEL));
                encoder.write_all(bytes)?;
                encoder.finish()
            }
            Self::Zstd => zstd::bulk::compress(bytes, ZSTD_LEVEL),
        }
    }

    /// As the value of `Content-Encoding`; none for bytes as they are.
    #[must_use]
    pub(crate) const fn header(self) -> Option<HeaderValue> {
        match self {
            Self::Identity => None,
            Self::Gzip | Self::Zstd => Some(HeaderValue::from_static(self.name())),
        }
    }
}

/// A coding's name and its quality in thousandths.
fn parse(text: &str) -> Option<(&str, u16)> {
    let mut parts = text.split(';');
    let name = parts.next()?.trim();
    let quality = parts
        .filter_map(|p| p.trim().split_once('='))
        .find(|(name, _)| name.trim().eq_ignore_ascii_case("q"))
        .map_or(Some(1.0), |(_, value)| value.trim().parse::<f64>().ok())
        .filter(|q| (0.0..=1.0).contains(q))?;
    (!name.is_empty()).then_some((name, (quality * 1000.0).round() as u16))
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    fn chosen(accept: &str) -> Coding {
        let headers = HeaderMap::from_iter([(header::ACCEPT_ENCODING, HeaderValue::from_str(accept).unwrap())]);
        Coding::choose(&headers)
    }

    #[test]
    fn what_is_liked_best_is_taken_and_silence_means_bytes_as_they_are() {
        assert_eq!(Coding::choose(&HeaderMap::new()), Coding::Identity);
        assert_eq!(chosen("gzip, deflate, br"), Coding::Gzip);
        assert_eq!(chosen("gzip, deflate, br, zstd"), Coding::Zstd);
        assert_eq!(chosen("GZIP;q=0.9, zstd;q=0.1"), Coding::Gzip);
        assert_eq!(chosen("*"), Coding::Zstd);
        assert_eq!(chosen("*;q=0.5, zstd;q=0"), Coding::Gzip);
        assert_eq!(chosen("gzip;q=0.5, identity"), Coding::Identity);
    }

    #[test]
    fn what_is_refused_or_unknown_is_not_taken() {
        assert_eq!(chosen("br"), Coding::Identity);
        assert_eq!(chosen("gzip;q=0"), Coding::Identity);
        assert_eq!(chosen("identity;q=0, *;q=0"), Coding::Identity, "something must be sent");
        assert_eq!(chosen("gzip;q=2"), Coding::Identity, "no quality at all");
    }

    #[test]
    fn what_is_coded_reads_back() {
        let bytes = b"0.0,0.0,0.0,".repeat(500);
        let zstd = Coding::Zstd.encode(&bytes).unwrap();
        assert!(zstd.len() < 200);
        assert_eq!(zstd::bulk::decompress(&zstd, bytes.len()).unwrap(), bytes);
        let gzip = Coding::Gzip.encode(&bytes).unwrap();
        assert!(gzip.len() < 200);
        let mut back = Vec::new();
        flate2::read::GzDecoder::new(gzip.as_slice()).read_to_end(&mut back).unwrap();
        assert_eq!(back, bytes);
        assert_eq!(gzip, Coding::Gzip.encode(&bytes).unwrap(), "no clock in it");
    }
}
