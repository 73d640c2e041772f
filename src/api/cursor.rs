//! Cursors of lists: where the next page begins. Opaque to clients; they carry a version and the filter they belong to.

use std::fmt::Write as _;

use super::problem::Problem;
use super::request::Query;

/// Version of the form below.
const VERSION: &str = "1";
/// Hexadecimal digits of the filter's digest: enough that a mix-up is seen.
const FILTER_DIGITS: usize = 16;
/// Rows of a page when nothing is said.
pub(super) const DEFAULT_LIMIT: u32 = 50;
/// Most rows of a page.
pub(super) const MAX_LIMIT: u32 = 100;

/// The cursor that continues after the row `seq` of the list with this filter.
#[must_use]
pub(super) fn write(seq: i64, filter: &str) -> String {
    let mut text = String::from(VERSION);
    // Writing to a string cannot fail.
    let _ = write!(text, "-{seq:x}-{}", digest(filter));
    text
}

/// Where a cursor points; it must be of the list with this filter.
///
/// # Errors
/// 400 for anything that [`write()`] did not give for this filter.
pub(super) fn read(text: &str, filter: &str) -> Result<i64, Problem> {
    let mut parts = text.split('-');
    let fields = (parts.next(), parts.next(), parts.next(), parts.next());
    let (Some(VERSION), Some(seq), Some(of), None) = fields else {
        return Err(Problem::query("cursor", "is not one that this service gave"));
    };
    if of != digest(filter) {
        return Err(Problem::query("cursor", "belongs to a list with other filters: keep them while you turn pages"));
    }
    i64::from_str_radix(seq, 16)
        .ok()
        .filter(|seq| *seq >= 0)
        .ok_or_else(|| Problem::query("cursor", "is not one that this service gave"))
}

/// How many rows a page is to have.
///
/// # Errors
/// 400 for anything but 1 to [`MAX_LIMIT`].
pub(super) fn limit(query: &Query) -> Result<u32, Problem> {
    let limit = query.parsed("limit", "a number from 1 to 100")?.unwrap_or(DEFAULT_LIMIT);
    if (1..=MAX_LIMIT).contains(&limit) { Ok(limit) } else { Err(Problem::query("limit", "must be from 1 to 100")) }
}

fn digest(filter: &str) -> String {
    blake3::hash(filter.as_bytes()).to_hex().chars().take(FILTER_DIGITS).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_cursor_survives_the_way_through_text(seq in 0_i64.., filter in ".*") {
            prop_assert_eq!(read(&write(seq, &filter), &filter).unwrap(), seq);
        }

        #[test]
        fn anything_else_is_refused_without_a_panic(text in ".*") {
            prop_assert!(read(&text, "state=queued").is_err());
        }
    }

    #[test]
    fn a_cursor_of_another_list_is_refused() {
        assert!(read(&write(7, "state=queued"), "state=failed").is_err());
    }
}
