//! Large jobs are cancelled at times spread over their run: how long until each has stopped.

use std::time::{Duration, Instant};

use anyhow::{Context as _, ensure};
use serde_json::{Value, json};

use super::{Service, Target};
use crate::client::Api;
use crate::figures::{Bar, Figures, Times, digits};
use crate::parts::{half_cylinder, panel};

const NAME: &str = "cancel";
/// Cancellations of each job.
const COUNT: u32 = 40;
/// Vertices of the long trimming loop.
const LOOP: usize = 100_000;
/// The bars: what a client is promised for every cancellation, and the aim for the 99th percentile, ms.
const PROMISED: f64 = 1000.0;
const AIM: f64 = 250.0;

pub(super) async fn run(target: &Target, figures: &mut Figures) -> anyhow::Result<()> {
    let service = Service::of(target, &[])?;
    let api = Api::new(&service.address)?;
    // Something small first: the service is warm then.
    api.clone().flatten(panel(0).to_string().into_bytes()).await?;
    let grid = |points: [u32; 2]| json!({ "triangulation": { "grid": points }, "flattening": { "seed": "centre" } });
    let cases = [
        ("flattening of a million triangles", "flatten", half_cylinder(720), grid([124, 4096])),
        ("triangulation of a million triangles", "triangulate", half_cylinder(720), grid([124, 4096])),
        ("triangulation with a loop of 100 000 points", "triangulate", half_cylinder(LOOP), grid([200, 200])),
    ];
    for (what, kind, surface, mut job) in cases {
        job["kind"] = json!(kind);
        job["surface"] = api.post("/v1/surfaces", &surface).await?["id"].clone();
        let begun = Instant::now();
        let done = api.ended(&posted(&api, &job).await?).await?;
        ensure!(done["state"] == "succeeded", "a large job ended so: {done}");
        let whole = begun.elapsed();
        let mut took = Vec::new();
        for k in 0..COUNT {
            took.extend(cancelled(&api, &job, whole.mul_f64((f64::from(k) + 0.5) / f64::from(COUNT))).await?);
        }
        let times: Times = took.into_iter().collect();
        figures.times(
            NAME,
            &format!("{what} ({} s): cancelled until it has stopped", digits(whole.as_secs_f64())),
            &times,
        );
        figures.judge(NAME, "worst of it", times.quantile(1.0), " ms", Bar::AtMost(PROMISED));
        figures.judge(NAME, "p99 of it", times.quantile(0.99), " ms", Bar::AtMost(AIM));
    }
    Ok(())
}

async fn posted(api: &Api, job: &Value) -> anyhow::Result<String> {
    let document = api.post("/v1/jobs", job).await?;
    Ok(document["id"].as_str().context("a job without id")?.to_owned())
}

/// Starts a job, cancels it after a while, and gives how long it took to stop; none when it had ended before.
async fn cancelled(api: &Api, job: &Value, after: Duration) -> anyhow::Result<Option<Duration>> {
    let id = posted(api, job).await?;
    tokio::time::sleep(after).await;
    let begun = Instant::now();
    if api.post(&format!("/v1/jobs/{id}/cancel"), &json!({})).await.is_err() {
        api.ended(&id).await?;
        return Ok(None);
    }
    let done = api.ended(&id).await?;
    ensure!(done["state"] == "cancelled", "a cancelled job ended so: {done}");
    Ok(Some(begun.elapsed()))
}
