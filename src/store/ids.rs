//! The names of things: jobs, surfaces, contents.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::StoreError;

/// A job's name: a version 7 UUID, so names sort roughly by age.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct JobId(Uuid);

impl JobId {
    /// A name that no other job has.
    #[must_use]
    pub fn fresh() -> Self {
        Self(Uuid::now_v7())
    }

    pub(super) fn bytes(&self) -> &[u8] {
        self.0.as_bytes()
    }

    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Self, StoreError> {
        Uuid::from_slice(bytes).map(Self).map_err(|e| StoreError::Corrupt(format!("job id: {e}")))
    }
}

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.hyphenated().fmt(f)
    }
}

/// A text that names nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not an id")]
pub struct NotAnId;

impl FromStr for JobId {
    type Err = NotAnId;

    /// The hyphenated form alone, in lower case: one job, one address.
    fn from_str(text: &str) -> Result<Self, NotAnId> {
        let id = Self(Uuid::parse_str(text).map_err(|_| NotAnId)?);
        let mut buffer = Uuid::encode_buffer();
        if id.0.hyphenated().encode_lower(&mut buffer) == text { Ok(id) } else { Err(NotAnId) }
    }
}

impl Serialize for JobId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for JobId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// The blake3 digest of some bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Digest(blake3::Hash);

impl Digest {
    /// The digest of `bytes`. Takes about a millisecond a megabyte: not for an async thread.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self(blake3::hash(bytes))
    }

    /// The digest itself.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.0.as_bytes()
    }

    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Self, StoreError> {
        let bytes: [u8; 32] =
            bytes.try_into().map_err(|_| StoreError::Corrupt("a digest that is not 32 bytes".to_owned()))?;
        Ok(Self(blake3::Hash::from_bytes(bytes)))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.to_hex())
    }
}

/// Hexadecimal digits of a surface's name: 160 bits, enough that no two contents share one by chance or by effort.
const SURFACE_ID_DIGITS: usize = 40;

/// A surface's name: derived from its bytes and from how they are read, so the same again has the same name.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct SurfaceId(String);

impl SurfaceId {
    /// The name of the content with this digest, read as the canonical text `reading` says (units, side, name, ...).
    #[must_use]
    pub fn derive(content: Digest, reading: &str) -> Self {
        let mut hasher = blake3::Hasher::new_derive_key("planish surface id 1");
        hasher.update(content.bytes());
        hasher.update(reading.as_bytes());
        let hex = hasher.finalize().to_hex();
        Self(hex.chars().take(SURFACE_ID_DIGITS).collect())
    }

    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for SurfaceId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for SurfaceId {
    type Err = NotAnId;

    fn from_str(text: &str) -> Result<Self, NotAnId> {
        let hex = |c: u8| c.is_ascii_digit() || (b'a'..=b'f').contains(&c);
        if text.len() == SURFACE_ID_DIGITS && text.bytes().all(hex) { Ok(Self(text.to_owned())) } else { Err(NotAnId) }
    }
}

impl<'de> Deserialize<'de> for SurfaceId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_is_named_by_its_bytes_and_by_how_they_are_read() {
        let (a, b) = (Digest::of(b"a"), Digest::of(b"b"));
        assert_eq!(SurfaceId::derive(a, "mm"), SurfaceId::derive(a, "mm"));
        assert_ne!(SurfaceId::derive(a, "mm"), SurfaceId::derive(a, "m"));
        assert_ne!(SurfaceId::derive(a, "mm"), SurfaceId::derive(b, "mm"));
    }

    #[test]
    fn names_survive_the_way_through_text_and_nothing_else_is_a_name() {
        let job = JobId::fresh();
        assert_eq!(job.to_string().parse(), Ok(job));
        assert_eq!(job.to_string().to_uppercase().parse::<JobId>(), Err(NotAnId));
        assert_eq!(job.to_string().replace('-', "").parse::<JobId>(), Err(NotAnId));
        let surface = SurfaceId::derive(Digest::of(b""), "");
        assert_eq!(surface.as_str().parse(), Ok(surface.clone()));
        for wrong in ["", "3f9c", "../../../../../../../../../../../../etc/x", &"G".repeat(40)] {
            assert_eq!(wrong.parse::<SurfaceId>(), Err(NotAnId));
            assert_eq!(wrong.parse::<JobId>(), Err(NotAnId));
        }
    }
}
