//! Every setting of the service in one place: its flag, its `PLANISH_*` variable, default, unit and meaning.
//!
//! The settings are validated together: a combination that cannot work is refused before anything is opened, with a text
//! that names the flags.

use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};

/// Form of the log lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// Settings of `planish serve`.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct Settings {
    /// Address to listen on; port 0 takes a free one
    #[arg(long, env = "PLANISH_LISTEN", value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
    pub listen: SocketAddr,
    /// Folder of the database, made if it is not there; one process at a time
    #[arg(long, env = "PLANISH_DATA", value_name = "DIR", default_value = "./planish-data")]
    pub data: PathBuf,
    /// Threads that do geometry [default: one a core]
    #[arg(long, env = "PLANISH_WORKERS", value_name = "N")]
    pub workers: Option<usize>,
    /// Allow an address that other machines can reach: whoever reaches it may use it
    #[arg(long, env = "PLANISH_OPEN")]
    pub open: bool,
    /// Longest request body, MiB
    #[arg(long, env = "PLANISH_MAX_BODY_MIB", value_name = "MIB", default_value_t = 64)]
    pub max_body_mib: usize,
    /// Memory for request bodies in flight, all together, MiB
    #[arg(long, env = "PLANISH_MAX_UPLOADS_MIB", value_name = "MIB", default_value_t = 256)]
    pub max_uploads_mib: usize,
    /// Memory for written forms of results, so that those asked for often need not be written again, MiB; 0 keeps none
    #[arg(long, env = "PLANISH_CACHE_MIB", value_name = "MIB", default_value_t = 64)]
    pub cache_mib: usize,
    /// Jobs that may wait; more are answered with 503
    #[arg(long, env = "PLANISH_MAX_QUEUED", value_name = "N", default_value_t = 10_000)]
    pub max_queued: u32,
    /// Connections open at once; more wait to be accepted
    #[arg(long, env = "PLANISH_MAX_CONNECTIONS", value_name = "N", default_value_t = 1024)]
    pub max_connections: usize,
    /// Streams of events open at once; more are answered with 503
    #[arg(long, env = "PLANISH_MAX_STREAMS", value_name = "N", default_value_t = 256)]
    pub max_streams: usize,
    /// Longest wait for the first byte of a connection, seconds
    #[arg(long, env = "PLANISH_FIRST_BYTE_TIMEOUT_S", value_name = "S", default_value_t = 5)]
    pub first_byte_timeout_s: u64,
    /// Longest time that a request's header may take, seconds
    #[arg(long, env = "PLANISH_HEADER_TIMEOUT_S", value_name = "S", default_value_t = 3)]
    pub header_timeout_s: u64,
    /// Longest time that a request's body may take, seconds
    #[arg(long, env = "PLANISH_BODY_TIMEOUT_S", value_name = "S", default_value_t = 60)]
    pub body_timeout_s: u64,
    /// A connection on which nothing moves for so long is closed, seconds
    #[arg(long, env = "PLANISH_IDLE_TIMEOUT_S", value_name = "S", default_value_t = 75)]
    pub idle_timeout_s: u64,
    /// Time that running jobs get to end after SIGTERM before they are put back, seconds
    #[arg(long, env = "PLANISH_GRACE_S", value_name = "S", default_value_t = 25)]
    pub grace_s: u64,
    /// What is logged to standard error, as in `info,planish::queue=debug`
    #[arg(long, env = "PLANISH_LOG", value_name = "FILTER", default_value = "info")]
    pub log: String,
    /// Form of the log lines
    #[arg(long, env = "PLANISH_LOG_FORMAT", value_name = "FORMAT", value_enum, default_value_t)]
    pub log_format: LogFormat,
}

/// Most geometry threads that may be asked for: beyond this a number is a slip of the pen.
const MAX_WORKERS: usize = 1024;
/// Longest grace, seconds: service managers kill long before.
const MAX_GRACE_S: u64 = 3600;
/// Most memory for bodies that may be asked for, MiB (1 TiB: keeps arithmetic in range).
const MAX_UPLOADS_MIB: usize = 1 << 20;
/// Bytes of one MiB.
const MIB: usize = 1 << 20;

/// A combination of settings that cannot work.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SettingsError {
    /// Not loopback, and `--open` was not given.
    #[error(
        "--listen {0} can be reached from other machines, and there are no access keys: listen on 127.0.0.1, or give --open \
         (PLANISH_OPEN=true) if a proxy or a firewall decides who may come"
    )]
    NotOpen(SocketAddr),
    /// A number outside its range.
    #[error("{flag} is {value}, but must be from {least} to {greatest}")]
    Range {
        /// The flag.
        flag: &'static str,
        /// What was given.
        value: u64,
        /// Least.
        least: u64,
        /// Greatest.
        greatest: u64,
    },
    /// One body alone would not fit.
    #[error(
        "--max-body-mib {body} does not fit into --max-uploads-mib {uploads}: no request of that size could ever be read"
    )]
    BodyBeyondUploads {
        /// MiB a body.
        body: usize,
        /// MiB in all.
        uploads: usize,
    },
}

impl Settings {
    /// Checks the settings together.
    ///
    /// # Errors
    /// [`SettingsError`] names the flags and what would do.
    pub fn validate(&self) -> Result<(), SettingsError> {
        if !self.listen.ip().is_loopback() && !self.open {
            return Err(SettingsError::NotOpen(self.listen));
        }
        let ranges = [
            ("--workers", self.worker_count() as u64, 1, MAX_WORKERS as u64),
            ("--max-body-mib", self.max_body_mib as u64, 1, MAX_UPLOADS_MIB as u64),
            ("--max-uploads-mib", self.max_uploads_mib as u64, 1, MAX_UPLOADS_MIB as u64),
            ("--cache-mib", self.cache_mib as u64, 0, MAX_UPLOADS_MIB as u64),
            ("--max-queued", u64::from(self.max_queued), 1, u64::from(u32::MAX)),
            ("--max-connections", self.max_connections as u64, 1, 1 << 20),
            ("--max-streams", self.max_streams as u64, 1, 1 << 20),
            ("--first-byte-timeout-s", self.first_byte_timeout_s, 1, MAX_GRACE_S),
            ("--header-timeout-s", self.header_timeout_s, 1, MAX_GRACE_S),
            ("--body-timeout-s", self.body_timeout_s, 1, MAX_GRACE_S),
            ("--idle-timeout-s", self.idle_timeout_s, 1, MAX_GRACE_S),
            ("--grace-s", self.grace_s, 0, MAX_GRACE_S),
        ];
        for (flag, value, least, greatest) in ranges {
            if !(least..=greatest).contains(&value) {
                return Err(SettingsError::Range { flag, value, least, greatest });
            }
        }
        if self.max_body_mib > self.max_uploads_mib {
            return Err(SettingsError::BodyBeyondUploads { body: self.max_body_mib, uploads: self.max_uploads_mib });
        }
        Ok(())
    }

    /// Geometry threads: as asked, or one a core.
    #[must_use]
    pub fn worker_count(&self) -> usize {
        self.workers.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, NonZeroUsize::get))
    }

    /// Longest body in bytes.
    #[must_use]
    pub const fn max_body(&self) -> usize {
        self.max_body_mib.saturating_mul(MIB)
    }

    /// Memory for bodies in flight, bytes.
    #[must_use]
    pub const fn max_uploads(&self) -> usize {
        self.max_uploads_mib.saturating_mul(MIB)
    }

    /// Memory for written forms, bytes.
    #[must_use]
    pub const fn cache(&self) -> usize {
        self.cache_mib.saturating_mul(MIB)
    }

    /// Time for running jobs after SIGTERM.
    #[must_use]
    pub const fn grace(&self) -> Duration {
        Duration::from_secs(self.grace_s)
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        settings: Settings,
    }

    fn parse(arguments: &[&str]) -> Settings {
        Line::try_parse_from(std::iter::once("planish").chain(arguments.iter().copied())).unwrap().settings
    }

    #[test]
    fn the_defaults_are_loopback_and_valid() {
        let settings = parse(&[]);
        assert_eq!(settings.validate(), Ok(()));
        assert!(settings.listen.ip().is_loopback());
        assert_eq!(settings.grace(), Duration::from_secs(25));
    }

    #[test]
    fn an_address_for_others_needs_open() {
        for address in ["0.0.0.0:80", "192.168.1.4:80", "[::]:80"] {
            assert!(matches!(parse(&["--listen", address]).validate(), Err(SettingsError::NotOpen(_))), "{address}");
            assert_eq!(parse(&["--listen", address, "--open"]).validate(), Ok(()), "{address}");
        }
        assert_eq!(parse(&["--listen", "[::1]:0"]).validate(), Ok(()));
    }

    #[test]
    fn numbers_that_cannot_work_are_refused_by_name() {
        for (flag, value) in [("--workers", "0"), ("--max-queued", "0"), ("--header-timeout-s", "0")] {
            let text = parse(&[flag, value]).validate().unwrap_err().to_string();
            assert!(text.contains(flag), "{text}");
        }
    }

    #[test]
    fn a_body_must_fit_into_the_uploads() {
        let text = parse(&["--max-body-mib", "300"]).validate().unwrap_err().to_string();
        assert!(text.contains("--max-uploads-mib"), "{text}");
    }

    #[test]
    fn every_flag_has_a_variable() {
        use clap::CommandFactory;
        for argument in Line::command().get_arguments().filter(|a| !["help", "version"].contains(&a.get_id().as_str()))
        {
            let flag = argument.get_long().unwrap();
            let variable = argument.get_env().unwrap().to_str().unwrap();
            assert_eq!(variable, format!("PLANISH_{}", flag.to_uppercase().replace('-', "_")));
        }
    }
}
