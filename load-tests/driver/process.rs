//! Servers as child processes, killed when they are dropped.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::Context as _;

use super::bare;

/// A server that was started.
#[derive(Debug)]
pub(crate) struct Server {
    child: Child,
    /// `http://HOST:PORT`.
    pub(crate) address: String,
}

impl Server {
    /// Starts the program on this folder.
    pub(crate) fn program(binary: &str, folder: &Path, options: &[&str]) -> anyhow::Result<Self> {
        let mut command = Command::new(binary);
        command.args(["serve", "--listen", "127.0.0.1:0", "--log", "warn", "--data"]).arg(folder).args(options);
        Self::start(command).with_context(|| format!("{binary} does not serve"))
    }

    /// Starts the bare server on this folder.
    pub(crate) fn bare(folder: &Path) -> anyhow::Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        command.env(bare::FOLDER, folder);
        Self::start(command).context("the bare server does not serve")
    }

    fn start(mut command: Command) -> anyhow::Result<Self> {
        let mut child = command.stdout(Stdio::piped()).spawn()?;
        let output = child.stdout.take().context("no standard output")?;
        let mut line = String::new();
        BufReader::new(output).read_line(&mut line)?;
        let address =
            line.trim().strip_prefix("listening on ").with_context(|| format!("it said {line:?}"))?.to_owned();
        Ok(Self { child, address })
    }

    /// The most memory that it had at any time so far, MB; none where the system does not tell.
    pub(crate) fn peak_mb(&self) -> Option<f64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
        Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? * 1024.0 / 1e6)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Both fail only for a child that has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
