//! How long a client is willing to wait for an answer: `?wait=N`, or `Prefer: wait=N` (RFC 7240).

use std::str::FromStr;
use std::time::Duration;

use axum::http::{HeaderMap, HeaderName, HeaderValue};

use super::Query;
use crate::api::problem::Problem;

/// Longest wait, seconds. Most proxies cut a silent connection after one minute.
pub(crate) const MAX_WAIT: u64 = 60;

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

/// A wait that was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Wait {
    seconds: u64,
    by_header: bool,
}

/// A whole number of seconds, however many digits it has.
#[derive(Debug, Clone, Copy)]
struct Seconds(u64);

impl FromStr for Seconds {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let whole = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        whole.then(|| Self(text.parse().unwrap_or(u64::MAX))).ok_or(())
    }
}

impl Wait {
    /// What the request asks for; none when it does not. More than [`MAX_WAIT`] counts as [`MAX_WAIT`].
    ///
    /// # Errors
    /// A `wait` of the query that is no whole number. A header that cannot be read is ignored, as RFC 7240 demands.
    pub(crate) fn of(query: &Query, headers: &HeaderMap) -> Result<Option<Self>, Problem> {
        if let Some(seconds) = query.parsed::<Seconds>("wait", "a number of seconds, from 0 to 60")? {
            return Ok(Some(Self { seconds: seconds.0.min(MAX_WAIT), by_header: false }));
        }
        let preferences = headers.get_all(PREFER).iter().filter_map(|v| v.to_str().ok()).flat_map(|v| v.split(','));
        let mut asked = None;
        for preference in preferences {
            let (name, value) =
                preference.split(';').next().unwrap_or_default().split_once('=').unwrap_or((preference, ""));
            let value = value.trim().trim_matches('"');
            if asked.is_none() && name.trim().eq_ignore_ascii_case("wait") {
                asked = value.parse::<Seconds>().ok();
            }
        }
        Ok(asked.map(|Seconds(seconds)| Self { seconds: seconds.min(MAX_WAIT), by_header: true }))
    }

    /// The longest wait there is, for calls that wait unasked.
    pub(crate) const LONGEST: Self = Self { seconds: MAX_WAIT, by_header: false };

    /// As a duration.
    #[must_use]
    pub(crate) const fn duration(self) -> Duration {
        Duration::from_secs(self.seconds)
    }

    /// Tells the client that its preference was followed.
    pub(crate) fn acknowledge(self, headers: &mut HeaderMap) {
        if self.by_header
            && let Ok(value) = HeaderValue::from_str(&format!("wait={}", self.seconds))
        {
            headers.insert(PREFERENCE_APPLIED, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(prefer: &str) -> Option<u64> {
        let headers = HeaderMap::from_iter([(PREFER, HeaderValue::from_str(prefer).unwrap())]);
        Wait::of(&Query::default(), &headers).unwrap().map(|w| w.seconds)
    }

    #[test]
    fn the_header_is_read_in_all_its_forms() {
        assert_eq!(asked("wait=5"), Some(5));
        assert_eq!(asked("respond-async, Wait = \"7\"; x"), Some(7));
        assert_eq!(asked("wait=5, wait=6"), Some(5));
        assert_eq!(asked("wait=600"), Some(MAX_WAIT));
        // More digits than any number holds.
        assert_eq!(asked("wait=208881637390375976960"), Some(MAX_WAIT));
        for ignored in ["wait", "wait=", "wait=soon", "waiting=5", "respond-async"] {
            assert_eq!(asked(ignored), None, "{ignored}");
        }
    }

    #[test]
    fn only_a_preference_is_acknowledged() {
        let mut headers = HeaderMap::new();
        Wait { seconds: 3, by_header: false }.acknowledge(&mut headers);
        assert!(headers.is_empty());
        Wait { seconds: 3, by_header: true }.acknowledge(&mut headers);
        assert_eq!(headers[PREFERENCE_APPLIED], "wait=3");
    }
}
