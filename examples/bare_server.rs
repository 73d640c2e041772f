//! A bare axum handler that serves a file from memory: what the service's answers are measured against.
//!
//! `bare_server FILE [MEDIA_TYPE]` prints `listening on http://ADDRESS` and answers every GET with the file's bytes.

use std::error::Error;

use axum::Router;
use axum::body::Bytes;
use axum::http::{HeaderValue, header};
use axum::routing::get;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("usage: bare_server FILE [MEDIA_TYPE]")?;
    let bytes = Bytes::from(std::fs::read(file)?);
    let media = HeaderValue::from_str(&arguments.next().unwrap_or_else(|| "application/octet-stream".to_owned()))?;
    let serve = move || async move { ([(header::CONTENT_TYPE, media)], bytes) };
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await?;
    println!("listening on http://{}", listener.local_addr()?);
    axum::serve(listener, Router::new().fallback(get(serve))).await?;
    Ok(())
}
