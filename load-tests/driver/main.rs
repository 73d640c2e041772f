//! Load on a running service, and the same load on a handler that does next to nothing, in one run.
//!
//! `cargo bench --bench load -- PROFILE…` with the profiles of [`profiles`]; `all` runs every one. `--check` makes a missed
//! threshold a failure (exit code 1). `--url ADDRESS` drives a service that runs already; otherwise the driver starts the
//! program on a folder of its own. `--binary PATH` takes another build of the program.
//!
//! Load is open-loop: requests go out at their times whether or not earlier ones have been answered, and a latency is
//! counted from the time at which its request was *meant* to go out, so a stall is felt by all that it held up. Beside
//! every figure stands that of a bare axum handler in a process of its own (see [`bare`]): ratios of one run mean
//! something on any machine, times do not.

#![expect(clippy::print_stdout, reason = "the tables are what the program is for")]

mod bare;
mod client;
mod figures;
mod parts;
mod process;
mod profiles;
mod schedule;

use std::process::ExitCode;

use anyhow::{Context as _, bail};

use figures::Figures;
use profiles::Target;

/// What the command line asks for.
#[derive(Debug, Default)]
struct Line {
    profiles: Vec<String>,
    check: bool,
    url: Option<String>,
    binary: Option<String>,
}

fn line() -> anyhow::Result<Line> {
    let mut line = Line::default();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            // What `cargo bench` adds of itself.
            "--bench" => {}
            "--check" => line.check = true,
            "--url" => line.url = Some(arguments.next().context("--url needs an address")?),
            "--binary" => line.binary = Some(arguments.next().context("--binary needs a path")?),
            option if option.starts_with('-') => bail!("there is no option {option}"),
            profile => line.profiles.push(profile.to_owned()),
        }
    }
    if line.profiles.is_empty() {
        line.profiles.push("smoke".to_owned());
    }
    Ok(line)
}

fn main() -> anyhow::Result<ExitCode> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    if let Some(folder) = bare::asked_for() {
        runtime.block_on(bare::serve(&folder))?;
        return Ok(ExitCode::SUCCESS);
    }
    let line = line()?;
    let target = match (line.url, line.binary) {
        (Some(url), _) => Target::Running(url),
        (None, Some(path)) => Target::Program(path),
        (None, None) => Target::Program(env!("CARGO_BIN_EXE_planish").to_owned()),
    };
    let mut figures = Figures::default();
    for profile in &line.profiles {
        runtime
            .block_on(profiles::run(profile, &target, &mut figures))
            .with_context(|| format!("profile {profile}"))?;
    }
    println!("{figures}");
    let missed = figures.missed();
    for threshold in &missed {
        println!("missed: {threshold}");
    }
    Ok(if line.check && !missed.is_empty() { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
