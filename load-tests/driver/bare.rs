//! The measure: an axum server that commits one row for each `POST /row` and gives back the bytes of a file on
//! `GET /bytes`, and does nothing else. Its database has the settings of the service's.

use std::path::{Path, PathBuf};

use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, State};
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::{get, post};
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous};

/// Set in the process that is to be the bare server: its folder.
pub(crate) const FOLDER: &str = "PLANISH_LOAD_BARE";
/// The bytes that `GET /bytes` gives.
pub(crate) const BYTES: &str = "bytes";
/// Their media type, in a file beside them.
pub(crate) const MEDIA: &str = "media";

/// The folder, in the process that is to be the bare server.
pub(crate) fn asked_for() -> Option<PathBuf> {
    std::env::var_os(FOLDER).map(PathBuf::from)
}

/// Serves until it is killed; tells its address as the service does.
#[expect(clippy::print_stdout, reason = "the first line tells the address")]
pub(crate) async fn serve(folder: &Path) -> anyhow::Result<()> {
    let options = SqliteConnectOptions::new()
        .filename(folder.join("bare.db"))
        .create_if_missing(true)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full);
    let pool = SqlitePoolOptions::new().max_connections(1).connect_with(options).await?;
    sqlx::query("CREATE TABLE rows (seq INTEGER PRIMARY KEY, bytes BLOB NOT NULL) STRICT").execute(&pool).await?;
    // Read once: the handler is to do nothing but answer.
    let bytes = std::fs::read(folder.join(BYTES)).unwrap_or_default();
    let media = std::fs::read_to_string(folder.join(MEDIA)).unwrap_or_else(|_| "application/octet-stream".to_owned());
    let (bytes, media) = (Bytes::from(bytes), header::HeaderValue::from_str(&media)?);
    let same = move || std::future::ready(([(header::CONTENT_TYPE, media.clone())], bytes.clone()).into_response());
    let router = Router::new()
        .route("/row", post(row))
        .route("/bytes", get(same))
        .layer(DefaultBodyLimit::disable())
        .with_state(pool);
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await?;
    println!("listening on http://{}", listener.local_addr()?);
    axum::serve(listener, router).await?;
    Ok(())
}

async fn row(State(pool): State<SqlitePool>, body: Bytes) -> StatusCode {
    match sqlx::query("INSERT INTO rows (bytes) VALUES (?1)").bind(body.as_ref()).execute(&pool).await {
        Ok(_) => StatusCode::CREATED,
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR,
    }
}
