//! The filters that the list and the feed share.

use crate::api::parameters::KINDS;
use crate::api::problem::Problem;
use crate::api::request::Query;
use crate::engine::job::JobKind;
use crate::store::{JobFilter, State as JobState, SurfaceId};

/// The filter of a query that may also have the parameters `others`, and the same as the canonical text that cursors
/// and links carry.
pub(super) fn filter(query: &Query, others: &[&'static str]) -> Result<(JobFilter, String), Problem> {
    let mut known: Vec<&str> = others.to_vec();
    known.extend(["state", "kind", "surface", "verdict"]);
    known.extend(query.names().filter(|name| name.starts_with("label.")));
    query.only(&known)?;
    let state = query.parsed::<JobState>("state", "queued, running, succeeded, failed or cancelled")?;
    let kind = query.get("kind").map(str::to_owned);
    query.word::<JobKind>("kind", KINDS)?;
    let surface = query.parsed::<SurfaceId>("surface", "the id of a surface")?;
    let verdict = query.get("verdict").map(str::to_owned);
    if let Some(verdict) = &verdict
        && !["pass", "fail", "unchecked"].contains(&verdict.as_str())
    {
        return Err(Problem::query("verdict", "must be pass, fail or unchecked"));
    }
    let labels = query
        .names()
        .filter_map(|name| Some((name.strip_prefix("label.")?.to_owned(), query.get(name)?.to_owned())))
        .collect();
    let text = query.canonical_without(others);
    Ok((JobFilter { state, kind, surface, verdict, labels }, text))
}
