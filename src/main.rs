//! The command line of Planish: `serve` (also without a word), `run`, `check`, `health`.

mod commands;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use planish::config::Settings;

/// Flattens trimmed NURBS surfaces into cuttable 2D patterns
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Line {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    settings: Settings,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serve over HTTP (this is also what happens without a command)
    Serve(Settings),
    /// Do one job on files, without a server
    Run(commands::RunArguments),
    /// Check a surface and sum it up
    Check(commands::CheckArguments),
    /// Ask a running service whether it is ready
    Health(commands::HealthArguments),
}

fn main() -> ExitCode {
    let line = Line::parse();
    let done = match line.command {
        Some(Command::Run(arguments)) => commands::run(&arguments),
        Some(Command::Check(arguments)) => commands::check(&arguments),
        Some(Command::Health(arguments)) => commands::health(&arguments),
        Some(Command::Serve(settings)) => commands::serve(&settings),
        None => commands::serve(&line.settings),
    };
    done.unwrap_or_else(|error| {
        commands::complain(&format!("planish: {error:#}"));
        ExitCode::from(commands::USAGE)
    })
}
