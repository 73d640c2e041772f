//! Times of day as the API writes them: RFC 3339, UTC, milliseconds.

use time::OffsetDateTime;
use time::macros::format_description;

/// Microseconds since 1970 as a text such as `2026-11-23T10:15:00.250Z`.
#[must_use]
pub(super) fn rfc3339(us: i64) -> String {
    let form = format_description!(version = 2, "[year]-[month]-[day]T[hour]:[minute]:[second].[subsecond digits:3]Z");
    OffsetDateTime::from_unix_timestamp_nanos(i128::from(us) * 1000)
        .ok()
        .and_then(|time| time.format(&form).ok())
        // Beyond the year 9999: the clock is at fault, and the epoch says so plainly.
        .unwrap_or_else(|| "1970-01-01T00:00:00.000Z".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_in_utc_with_milliseconds() {
        assert_eq!(rfc3339(0), "1970-01-01T00:00:00.000Z");
        assert_eq!(rfc3339(1_795_427_700_250_999), "2026-11-23T09:55:00.250Z");
        assert_eq!(rfc3339(i64::MAX), "1970-01-01T00:00:00.000Z");
    }
}
