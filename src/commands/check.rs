//! `planish check SURFACE_FILE`: the whole checklist, and the summary that the service would give.

use std::process::ExitCode;

use anyhow::Context as _;
use clap::Args;

use super::input::SurfaceArguments;
use super::{FAILED, complain_of, say};

/// What `check` takes.
#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    #[command(flatten)]
    surface: SurfaceArguments,
}

/// Prints the summary, or every fault.
pub(crate) fn check(arguments: &CheckArguments) -> anyhow::Result<ExitCode> {
    let bytes = arguments.surface.bytes()?;
    match planish::api::read(&bytes, arguments.surface.reading(), "") {
        Ok(read) => {
            say(&format!("{:#}", read.new.summary)).context("standard output cannot be written")?;
            Ok(ExitCode::SUCCESS)
        }
        Err(faults) => {
            complain_of(&faults.into_problem(&bytes), &arguments.surface.name());
            Ok(ExitCode::from(FAILED))
        }
    }
}
