//! The calls that the profiles make.

use std::time::Duration;

use anyhow::{Context as _, ensure};
use reqwest::{Client, RequestBuilder, Response, StatusCode};
use serde_json::Value;

/// A client of one server; clones share its connections.
#[derive(Debug, Clone)]
pub(crate) struct Api {
    client: Client,
    address: String,
}

impl Api {
    /// A client of the server at this address.
    pub(crate) fn new(address: &str) -> anyhow::Result<Self> {
        let client = Client::builder().pool_max_idle_per_host(1024).timeout(Duration::from_mins(5)).build()?;
        Ok(Self { client, address: address.trim_end_matches('/').to_owned() })
    }

    /// The full address of a path.
    pub(crate) fn url(&self, path: &str) -> String {
        format!("{}{path}", self.address)
    }

    /// Gets something.
    pub(crate) async fn get(&self, path: &str) -> anyhow::Result<Vec<u8>> {
        Ok(sent(self.client.get(self.url(path)), path).await?.bytes().await?.into())
    }

    /// Gets a JSON document.
    pub(crate) async fn json(&self, path: &str) -> anyhow::Result<Value> {
        Ok(serde_json::from_slice(&self.get(path).await?)?)
    }

    /// Posts a JSON body; gives the JSON answer.
    pub(crate) async fn post(&self, path: &str, body: &Value) -> anyhow::Result<Value> {
        Ok(sent(self.client.post(self.url(path)).json(body), path).await?.json().await?)
    }

    /// Commits one row on the bare server.
    pub(crate) async fn row(self, body: Vec<u8>) -> anyhow::Result<()> {
        let answer = sent(self.client.post(self.url("/row")).body(body), "/row").await?;
        answer.bytes().await?;
        Ok(())
    }

    /// Flattens a surface in one call: its DXF must come back.
    pub(crate) async fn flatten(self, body: Vec<u8>) -> anyhow::Result<()> {
        let path = "/v1/flatten?format=dxf";
        let request = self.client.post(self.url(path)).header("content-type", "application/json").body(body);
        let answer = sent(request, path).await?;
        ensure!(answer.status() == StatusCode::OK, "{path} answered {}", answer.status());
        let dxf = answer.bytes().await?;
        ensure!(dxf.ends_with(b"EOF\n") || dxf.ends_with(b"EOF\r\n"), "the pattern is no DXF file");
        Ok(())
    }

    /// The document of a job when it has ended.
    pub(crate) async fn ended(&self, job: &str) -> anyhow::Result<Value> {
        loop {
            let document = self.json(&format!("/v1/jobs/{job}?wait=60")).await?;
            if document["finished_at"].is_string() {
                return Ok(document);
            }
        }
    }
}

/// Sends a request; an error status is an error with what the server said.
async fn sent(request: RequestBuilder, path: &str) -> anyhow::Result<Response> {
    let answer = request.send().await.with_context(|| format!("no answer from {path}"))?;
    let status = answer.status();
    if status.is_client_error() || status.is_server_error() {
        let said = answer.text().await.unwrap_or_default();
        anyhow::bail!("{path} answered {status}: {said}");
    }
    Ok(answer)
}
