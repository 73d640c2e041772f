//! `GET /problems` and `GET /problems/{slug}`: what the types of problems mean, as readable texts.

use std::fmt::Write as _;

use axum::extract::Path;

use crate::api::problem::{CODES, Kind, Problem, meaning};
use crate::api::request::Query;

/// All types.
pub(crate) async fn list(query: Query) -> Result<String, Problem> {
    query.only(&[])?;
    let mut text = String::from("Problems that this service answers with (application/problem+json, RFC 9457)\n\n");
    for kind in Kind::ALL {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}  /problems/{}\n     {}", kind.status().as_u16(), kind.slug(), kind.title());
    }
    text.push_str("\nCodes that say why a job has failed (`code` of a problem)\n\n");
    for (code, _) in CODES {
        let _ = writeln!(text, "     /problems/{code}");
    }
    Ok(text)
}

/// One type, or one code.
pub(crate) async fn show(Path(slug): Path<String>, query: Query) -> Result<String, Problem> {
    query.only(&[])?;
    if let Some(meaning) = meaning(&slug) {
        return Ok(format!("{slug} (why a job has failed)\n\n{meaning}\n"));
    }
    let kind = Kind::by_slug(&slug)
        .ok_or_else(|| Problem::new(Kind::NotFound, "No problem has this name; /problems lists them all."))?;
    Ok(format!("{} ({})\n\n{}\n", kind.title(), kind.status(), kind.text()))
}
