//! Stored results read again and again with `wrk`, beside a bare handler that gives the same bytes.

use std::process::Command;

use anyhow::{Context as _, ensure};

use super::{Service, Target, bare};
use crate::bare::{BYTES, MEDIA};
use crate::client::Api;
use crate::figures::{Bar, Figures, digits};
use crate::parts::panel;

const NAME: &str = "reads";
/// Connections that `wrk` holds, over one thread.
const CONNECTIONS: &str = "16";
/// Length of a measurement, and how many of each, by turns; the median counts.
const SECONDS: &str = "2s";
const ROUNDS: usize = 3;
/// The bar: share of the bare handler's requests a second.
const SHARE: f64 = 0.6;

pub(super) async fn run(target: &Target, figures: &mut Figures) -> anyhow::Result<()> {
    if Command::new("wrk").arg("-v").output().is_err() {
        figures.note(NAME, "reading of stored results", "not measured: `wrk` is not installed");
        return Ok(());
    }
    let service = Service::of(target, &[])?;
    let api = Api::new(&service.address)?;
    let surface = api.post("/v1/surfaces", &panel(0)).await?["id"].clone();
    let job = serde_json::json!({ "kind": "flatten", "surface": surface });
    let id = api.post("/v1/jobs", &job).await?["id"].as_str().context("a job without id")?.to_owned();
    let done = api.ended(&id).await?;
    ensure!(done["state"] == "succeeded", "the job ended so: {done}");
    for result in ["pattern.dxf", "report.json", "mesh.glb"] {
        let path = format!("/v1/jobs/{id}/{result}");
        let bytes = api.get(&path).await?;
        let (server, _folder) = bare(|folder| {
            std::fs::write(folder.join(BYTES), &bytes)?;
            Ok(std::fs::write(folder.join(MEDIA), "application/octet-stream")?)
        })?;
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            theirs.push(requests_a_second(&format!("{}/bytes", server.address))?);
            ours.push(requests_a_second(&api.url(&path))?);
        }
        let (ours, theirs) = (median(ours), median(theirs));
        figures.note(
            NAME,
            format!("{result}, {} bytes: requests/s, those of the bare handler", bytes.len()),
            format!("{} · {}", digits(ours), digits(theirs)),
        );
        figures.judge(NAME, format!("{result}: share"), ours / theirs, "", Bar::AtLeast(SHARE));
    }
    Ok(())
}

fn requests_a_second(url: &str) -> anyhow::Result<f64> {
    let output = Command::new("wrk").args(["-t1", "-c", CONNECTIONS, "-d", SECONDS, url]).output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    ensure!(output.status.success() && !text.contains("Non-2xx"), "wrk on {url} says: {text}");
    let line = text.lines().find_map(|line| line.trim().strip_prefix("Requests/sec:"));
    Ok(line.context("wrk gives no rate")?.trim().parse()?)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
