//! Ten thousand jobs that wait: all are accepted, all end, and the service stays small.

use std::time::Instant;

use anyhow::{Context as _, ensure};
use serde_json::json;

use super::{Service, Target};
use crate::client::Api;
use crate::figures::{Bar, Figures, digits};
use crate::parts::panel;
use crate::schedule::as_fast_as;

const NAME: &str = "queue";
/// Jobs that wait.
const JOBS: usize = 10_000;
/// Surfaces that they are about.
const SURFACES: usize = 100;
/// Clients that post them.
const CLIENTS: usize = 16;
/// The bar: peak memory of the service, MB.
const MEMORY: f64 = 300.0;
/// What keeps the workers busy while the jobs are posted: searches over some ten thousand seeds each.
const PLUGS: usize = 2;

pub(super) async fn run(target: &Target, figures: &mut Figures) -> anyhow::Result<()> {
    let service = Service::of(target, &["--max-queued", "10000"])?;
    let api = Api::new(&service.address)?;
    let mut surfaces = Vec::new();
    for n in 0..SURFACES {
        surfaces.push(api.post("/v1/surfaces", &panel(n)).await?["id"].clone());
    }
    for surface in &surfaces[..PLUGS] {
        let plug = json!({ "kind": "flatten", "surface": surface, "triangulation": { "grid": [91, 91] },
            "flattening": { "seed": "optimum" } });
        api.post("/v1/jobs", &plug).await?;
    }
    // Small in work, and in the lane of the large ones, so that they wait behind the plugs.
    let job = |n: usize| {
        json!({ "kind": "flatten", "surface": surfaces[n % SURFACES], "triangulation": { "grid": [24, 25] },
            "flattening": { "seed": "optimum" }, "labels": { "number": n.to_string() } })
    };
    let jobs: std::sync::Arc<Vec<_>> = std::sync::Arc::new((0..JOBS).map(job).collect());
    let begun = Instant::now();
    let accepted = as_fast_as(CLIENTS, JOBS, {
        let (api, jobs) = (api.clone(), jobs.clone());
        move |n| {
            let (api, jobs) = (api.clone(), jobs.clone());
            async move { api.post("/v1/jobs", &jobs[n]).await.map(drop) }
        }
    })
    .await?;
    let posted = begun.elapsed().as_secs_f64();
    figures.note(
        NAME,
        format!("{JOBS} jobs accepted over {CLIENTS} clients"),
        format!("{} a second", digits(accepted)),
    );
    let ended_meanwhile = ended(&api, 0).await?.0;
    figures.note(NAME, "of them waiting when the last was accepted", format!("{}", JOBS + PLUGS - ended_meanwhile));
    let (mut count, mut after) = (0, 0);
    while count < JOBS + PLUGS {
        let (more, last) = ended(&api, after).await?;
        (count, after) = (count + more, last);
        if more == 0 {
            tokio::time::sleep(std::time::Duration::from_millis(200)).await;
        }
    }
    ensure!(count == JOBS + PLUGS, "{count} jobs ended, {} were accepted", JOBS + PLUGS);
    let drained = begun.elapsed().as_secs_f64();
    figures.note(NAME, "all ended, each once; jobs a second from the first POST", digits(JOBS as f64 / drained));
    figures.note(NAME, "time to post, and until all had ended", format!("{} · {} s", digits(posted), digits(drained)));
    if let Some(peak) = service.peak_mb() {
        figures.judge(NAME, "peak memory of the service", peak, " MB", Bar::AtMost(MEMORY));
    }
    Ok(())
}

/// How many jobs have ended after this place in the order of ending, and the last place. A job that did not succeed is an
/// error.
async fn ended(api: &Api, after: u64) -> anyhow::Result<(usize, u64)> {
    let (mut count, mut after) = (0, after);
    loop {
        let page = api.json(&format!("/v1/feed?after={after}&limit=100")).await?;
        let items = page["items"].as_array().map_or(&[][..], Vec::as_slice);
        for item in items {
            ensure!(item["job"]["state"] == "succeeded", "a job ended so: {}", item["job"]);
        }
        if items.is_empty() {
            return Ok((count, after));
        }
        count += items.len();
        after = page["next"].as_u64().context("the feed gives no next")?;
    }
}
