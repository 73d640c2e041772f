//! What each command does. Exit codes: 0 it is done, 1 it could not be done (the problem is on standard error), 2 it was
//! asked for in a way that makes no sense, 3 it is done and the pattern breaks a limit.

mod check;
mod health;
mod input;
mod run;
mod serve;

use std::io::Write as _;

use planish::api::problem::Problem;

pub(crate) use check::{CheckArguments, check};
pub(crate) use health::{HealthArguments, health};
pub(crate) use run::{RunArguments, run};
pub(crate) use serve::serve;

/// Exit code: the work could not be done.
pub(crate) const FAILED: u8 = 1;
/// Exit code: asked for in a way that makes no sense, or the files cannot be read or written.
pub(crate) const USAGE: u8 = 2;
/// Exit code: done, and the verdict is `fail`.
pub(crate) const VERDICT_FAIL: u8 = 3;

/// Writes a line to standard error. When that is closed there is nobody to tell.
pub(crate) fn complain(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Writes a line to standard output.
fn say(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout();
    writeln!(out, "{text}")?;
    out.flush()
}

/// Writes a problem to standard error, as the document that the API would answer with.
fn complain_of(problem: &Problem, instance: &str) {
    match serde_json::to_string_pretty(&problem.document(instance)) {
        Ok(text) => complain(&text),
        Err(error) => complain(&error.to_string()),
    }
}
