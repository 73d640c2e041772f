//! What the service tells of itself: its log, and its [metrics](Metrics).
//!
//! Log lines go to standard error; standard output belongs to the address line and to `run` and `check`.

mod metrics;

pub use metrics::{Metrics, Standing, Stored, kind_label};

use tracing_subscriber::EnvFilter;

use crate::config::LogFormat;

/// Starts logging for this process.
///
/// # Errors
/// A text when the filter does not parse or logging was started before.
pub fn start(filter: &str, format: LogFormat) -> Result<(), String> {
    let filter = EnvFilter::try_new(filter).map_err(|e| format!("--log {filter:?} is not a filter: {e}"))?;
    let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    match format {
        LogFormat::Text => builder.with_ansi(false).try_init(),
        LogFormat::Json => builder.json().try_init(),
    }
    .map_err(|e| format!("logging could not be started: {e}"))
}
