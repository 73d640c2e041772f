//! `planish health`: asks a running service whether it is ready. For health checks of containers, which have no curl.

use std::io::{Read as _, Write as _};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpStream};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use super::{FAILED, complain, say};

/// How long the service may take to answer, seconds.
const PATIENCE: Duration = Duration::from_secs(2);
/// The answer's first line fits into this many bytes.
const FIRST_LINE: u64 = 64;

/// What is asked.
#[derive(Debug, Clone, Args)]
pub(crate) struct HealthArguments {
    /// Address that the service listens on
    #[arg(long, env = "PLANISH_LISTEN", value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
}

/// Exits with 0 when the service is ready, with 1 when it is not or does not answer.
pub(crate) fn health(arguments: &HealthArguments) -> anyhow::Result<ExitCode> {
    match status(reachable(arguments.listen)) {
        Ok(line) if line.contains(" 200 ") => {
            say("ready")?;
            Ok(ExitCode::SUCCESS)
        }
        Ok(line) => {
            complain(&format!("not ready: {}", line.trim()));
            Ok(ExitCode::from(FAILED))
        }
        Err(error) => {
            complain(&format!("no answer from {}: {error}", arguments.listen));
            Ok(ExitCode::from(FAILED))
        }
    }
}

/// A service that listens on every address is asked on the loopback.
fn reachable(mut address: SocketAddr) -> SocketAddr {
    if address.ip().is_unspecified() {
        address.set_ip(match address.ip() {
            IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
        });
    }
    address
}

/// The first line of the answer to `GET /readyz`.
fn status(address: SocketAddr) -> std::io::Result<String> {
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    write!(stream, "GET /readyz HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n")?;
    let mut answer = Vec::new();
    stream.take(FIRST_LINE).read_to_end(&mut answer)?;
    let text = String::from_utf8_lossy(&answer).into_owned();
    Ok(text.lines().next().unwrap_or_default().to_owned() + " ")
}
