//! `planish serve`: opens the data, starts the workers, serves, and stops with grace.
//!
//! On SIGTERM or SIGINT: readiness goes to 503 and nothing new is taken; running jobs get the grace to end and are put
//! back after it without losing an attempt; open answers end; the database is closed; exit 0. A second signal ends the
//! process at once: jobs that were running are run again on the next start.

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use planish::api::{App, router};
use planish::clock::Clock;
use planish::config::Settings;
use planish::queue::{self, EngineRunner, Queue};
use planish::server::{self, ConnectionLimits};
use planish::store::Store;
use planish::telemetry;
use tokio::net::TcpListener;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio_util::sync::CancellationToken;

use super::say;

/// Serves until a signal comes.
pub(crate) fn serve(settings: &Settings) -> anyhow::Result<ExitCode> {
    settings.validate()?;
    telemetry::start(&settings.log, settings.log_format).map_err(anyhow::Error::msg)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().context("no async threads")?;
    runtime.block_on(serving(settings))?;
    // Jobs that did not stop when they were told to are left to the end of the process.
    runtime.shutdown_background();
    Ok(ExitCode::SUCCESS)
}

async fn serving(settings: &Settings) -> anyhow::Result<()> {
    let mut signals = Signals::new()?;
    let store = Store::open(&settings.data, Clock::system()).await?;
    let listener = TcpListener::bind(settings.listen)
        .await
        .with_context(|| format!("{} cannot be listened on", settings.listen))?;
    let address = listener.local_addr().context("the listener has no address")?;
    let queue = Queue::start(store.clone(), Arc::new(EngineRunner), machine(settings)).await?;
    let draining = CancellationToken::new();
    let app = App::new(store.clone(), queue.clone(), settings, draining.clone());
    let limits = ConnectionLimits {
        connections: settings.max_connections,
        first_byte: Duration::from_secs(settings.first_byte_timeout_s),
        header: Duration::from_secs(settings.header_timeout_s),
        idle: Duration::from_secs(settings.idle_timeout_s),
    };
    let closing = CancellationToken::new();
    let served = tokio::spawn(server::serve(listener, router(app), limits, closing.clone()));
    say(&format!("listening on http://{address}")).context("standard output cannot be written")?;
    tracing::info!(%address, data = %settings.data.display(), workers = settings.worker_count(), "listening on {address}");

    signals.next().await;
    tracing::info!("a signal came: nothing new is taken, running jobs get {} s", settings.grace_s);
    draining.cancel();
    let ending = async {
        queue.drain(settings.grace()).await;
        closing.cancel();
        served.await.context("the server's task ended early")?;
        store.close().await.context("the database could not be closed cleanly")
    };
    tokio::select! {
        ended = ending => ended?,
        () = signals.next() => {
            tracing::warn!("a second signal came: ending at once");
            std::process::exit(1);
        }
    }
    tracing::info!("stopped");
    Ok(())
}

/// The job machine's settings.
fn machine(settings: &Settings) -> queue::Settings {
    let defaults = queue::Settings::default();
    queue::Settings {
        workers: settings.workers.unwrap_or(defaults.workers),
        threads: settings.workers.unwrap_or(defaults.threads),
        most_waiting: u64::from(settings.max_queued),
        ..defaults
    }
}

/// The signals that end the service.
struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    fn new() -> anyhow::Result<Self> {
        let of = |kind| signal(kind).context("signals cannot be listened to");
        Ok(Self { terminate: of(SignalKind::terminate())?, interrupt: of(SignalKind::interrupt())? })
    }

    async fn next(&mut self) {
        tokio::select! {
            _ = self.terminate.recv() => {}
            _ = self.interrupt.recv() => {}
        }
    }
}
