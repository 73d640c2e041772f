//! What can go wrong with the data directory and its database, told apart as far as the caller acts on it.

use std::path::PathBuf;

/// Why the store could not do what was asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// Another process works on the data directory.
    #[error("the data directory {} is in use by another process: stop that one, or give this one a directory of its own", .0.display())]
    InUse(PathBuf),
    /// The data directory cannot be made, opened or locked.
    #[error("the data directory {} cannot be used: {source}", path.display())]
    Directory {
        /// The directory or the file in it.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The database was written by a newer version of the program.
    #[error(
        "the database has schema {found}, this version of the program knows schemas up to {known}: use the newer version, or a copy of the data from before it"
    )]
    NewerSchema {
        /// The database's schema.
        found: i64,
        /// The newest schema this program knows.
        known: i64,
    },
    /// A migration that was applied to the database differs from the one this program has.
    #[error("schema {0} of the database is not the one this program knows: it was written by an unreleased version")]
    AlteredSchema(i64),
    /// Another process holds the database's lock for longer than the store waits.
    #[error("the database is locked by another process")]
    Busy,
    /// The disk or the database's size limit is reached.
    #[error("there is no room left to write to")]
    Full,
    /// A row that the program cannot read.
    #[error("the database holds something unreadable: {0}")]
    Corrupt(String),
    /// The transaction's task was stopped: the program is going down.
    #[error("the write was interrupted")]
    Interrupted,
    /// Anything else the database says.
    #[error("the database failed: {0}")]
    Sql(sqlx::Error),
}

/// Primary result codes of SQLite that the caller acts on (the low byte of an extended code).
const BUSY: i32 = 5;
const FULL: i32 = 13;

impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> Self {
        if matches!(error, sqlx::Error::PoolTimedOut) {
            return Self::Busy;
        }
        let primary = error
            .as_database_error()
            .and_then(sqlx::error::DatabaseError::code)
            .and_then(|code| code.parse::<i32>().ok())
            .map(|code| code & 0xff);
        match primary {
            Some(BUSY) => Self::Busy,
            Some(FULL) => Self::Full,
            _ => Self::Sql(error),
        }
    }
}

impl From<serde_json::Error> for StoreError {
    fn from(error: serde_json::Error) -> Self {
        Self::Corrupt(error.to_string())
    }
}
