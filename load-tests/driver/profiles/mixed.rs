//! Small jobs beside large ones, and beside searches over twenty thousand seeds.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use anyhow::ensure;
use serde_json::{Value, json};

use super::{Service, Target};
use crate::client::Api;
use crate::figures::{Bar, Figures, Times};
use crate::parts::{panel, panel_bytes};
use crate::schedule::at_rate;

const NAME: &str = "mixed";
/// Small jobs a second, and how many beside each sort of large one.
const RATE: f64 = 20.0;
const COUNT: usize = 240;
/// The bar: 99th percentile of a small job while a search runs, ms.
const BESIDE_SEARCH: f64 = 100.0;

pub(super) async fn run(target: &Target, figures: &mut Figures) -> anyhow::Result<()> {
    let service = Service::of(target, &[])?;
    let api = Api::new(&service.address)?;
    let surface = api.post("/v1/surfaces", &panel(0)).await?["id"].clone();
    for n in 0..20 {
        api.clone().flatten(panel_bytes(n)).await?;
    }
    let alone: Times = small(&api, 1000).await?.into_iter().collect();
    figures.times(NAME, "small job by itself", &alone);

    // Points so chosen that there are exactly 20 000 triangles, each of them a seed.
    let job = |kind: &str| {
        json!({ "kind": kind, "surface": surface, "triangulation": { "grid": [101, 101] },
            "flattening": { "seed": "optimum" } })
    };
    let mut search = job("optimum-seed-search");
    if api.post("/v1/jobs", &search).await.is_err() {
        // An older build has no such kind of job; the search within a flattening is the same work, cut short.
        search = job("flatten");
    }
    let (times, ended) = beside(&api, vec![search], 2000).await?;
    figures.times(NAME, &format!("small job while a search of 20 000 seeds runs ({ended} searches ended)"), &times);
    figures.judge(NAME, "p99 of it", times.quantile(0.99), " ms", Bar::AtMost(BESIDE_SEARCH));

    let large = |points: u32| {
        json!({ "kind": "flatten", "surface": surface, "triangulation": { "grid": [points, points] },
            "flattening": { "seed": "centre" } })
    };
    let (times, ended) = beside(&api, vec![large(300), large(400), large(500)], 3000).await?;
    figures.times(
        NAME,
        &format!("small job while three large ones run ({ended} ended, up to 498 002 triangles)"),
        &times,
    );
    Ok(())
}

/// Small jobs at their rate.
async fn small(api: &Api, from: usize) -> anyhow::Result<Vec<Duration>> {
    at_rate(RATE, COUNT, |n| api.clone().flatten(panel_bytes(from + n))).await
}

/// Small jobs while these large ones run, each posted again when it has ended. Gives the small ones' times and how many
/// large ones ended.
async fn beside(api: &Api, large: Vec<Value>, from: usize) -> anyhow::Result<(Times, usize)> {
    let (over, ended) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
    let mut running = tokio::task::JoinSet::new();
    for job in large {
        let (api, over, ended) = (api.clone(), over.clone(), ended.clone());
        running.spawn(async move {
            while !over.load(Ordering::Relaxed) {
                let id = api.post("/v1/jobs", &job).await?["id"].as_str().unwrap_or_default().to_owned();
                let done = api.ended(&id).await?;
                // A large one may be one that cannot be flattened; it worked all the same.
                ensure!(done["state"] == "succeeded" || done["state"] == "failed", "a large job ended so: {done}");
                ended.fetch_add(1, Ordering::Relaxed);
            }
            Ok(())
        });
    }
    // They are to be under way.
    tokio::time::sleep(Duration::from_millis(500)).await;
    let times = small(api, from).await?;
    over.store(true, Ordering::Relaxed);
    while let Some(done) = running.join_next().await {
        done??;
    }
    Ok((times.into_iter().collect(), ended.load(Ordering::Relaxed)))
}
