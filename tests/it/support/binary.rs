//! The real binary, serving on a free port of the loopback with a data folder of its own.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use tempfile::TempDir;

/// A running service; it is killed when this is dropped.
pub(crate) struct Service {
    child: Child,
    address: String,
    /// Kept so that the folder lives as long as the service.
    _data: Option<TempDir>,
}

impl Service {
    /// Starts the service with further arguments and an empty data folder.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let data = TempDir::new().expect("a temporary folder");
        let mut service = Self::start_in(data.path(), arguments);
        service._data = Some(data);
        service
    }

    /// Starts the service on a data folder that is there already.
    pub(crate) fn start_in(data: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_planish"))
            .args(["serve", "--listen", "127.0.0.1:0", "--log", "warn", "--data"])
            .arg(data)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .expect("the binary starts");
        let mut first = String::new();
        let stdout = child.stdout.take().expect("a piped standard output");
        BufReader::new(stdout).read_line(&mut first).expect("the service says where it listens");
        let address = first.trim().strip_prefix("listening on ").expect(&first).to_owned();
        Self { child, address, _data: None }
    }

    /// The full address of a path.
    pub(crate) fn url(&self, path: &str) -> String {
        format!("{}{path}", self.address)
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
