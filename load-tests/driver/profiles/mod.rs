//! The profiles, each a function that adds its figures.

mod cancel;
mod mixed;
mod order;
mod queue;
mod reads;
mod smoke;

use std::path::Path;

use super::figures::Figures;
use super::process::Server;

/// What is driven.
#[derive(Debug, Clone)]
pub(crate) enum Target {
    /// A service that runs already.
    Running(String),
    /// A build of the program, started afresh for each profile.
    Program(String),
}

/// Every profile.
const ALL: [&str; 6] = ["smoke", "mixed", "order", "reads", "cancel", "queue"];

/// A service under load; it ends with this.
#[derive(Debug)]
pub(crate) struct Service {
    /// Where it is.
    pub(crate) address: String,
    server: Option<Server>,
    _folder: Option<tempfile::TempDir>,
}

impl Service {
    /// The service that the target names, or a new one with these options.
    pub(crate) fn of(target: &Target, options: &[&str]) -> anyhow::Result<Self> {
        match target {
            Target::Running(url) => Ok(Self { address: url.clone(), server: None, _folder: None }),
            Target::Program(binary) => {
                let folder = tempfile::tempdir()?;
                let server = Server::program(binary, folder.path(), options)?;
                Ok(Self { address: server.address.clone(), server: Some(server), _folder: Some(folder) })
            }
        }
    }

    /// Its peak memory, MB, where it is a child of this program and the system tells.
    pub(crate) fn peak_mb(&self) -> Option<f64> {
        self.server.as_ref().and_then(Server::peak_mb)
    }
}

/// A bare server on a folder of its own.
pub(crate) fn bare(fill: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<(Server, tempfile::TempDir)> {
    let folder = tempfile::tempdir()?;
    fill(folder.path())?;
    Ok((Server::bare(folder.path())?, folder))
}

/// Runs a profile.
pub(crate) async fn run(profile: &str, target: &Target, figures: &mut Figures) -> anyhow::Result<()> {
    match profile {
        "smoke" => smoke::run(target, figures).await,
        "mixed" => mixed::run(target, figures).await,
        "order" => order::run(target, figures).await,
        "reads" => reads::run(target, figures).await,
        "cancel" => cancel::run(target, figures).await,
        "queue" => queue::run(target, figures).await,
        "all" => {
            for profile in ALL {
                Box::pin(run(profile, target, figures)).await?;
            }
            Ok(())
        }
        other => anyhow::bail!("there is no profile {other}: take {}, or all", ALL.join(", ")),
    }
}
