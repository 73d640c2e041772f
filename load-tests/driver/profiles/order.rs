//! One order of five hundred pieces: a CAD system sends them, a cutting line follows the feed and fetches every pattern.

use std::time::{Duration, Instant};

use anyhow::{Context as _, ensure};
use serde_json::json;

use super::{Service, Target};
use crate::client::Api;
use crate::figures::{Figures, Times, digits};
use crate::parts::panel;
use crate::schedule::at_rate;

const NAME: &str = "order";
/// Pieces of the order.
const PIECES: usize = 500;
/// Pieces sent a second.
const RATE: f64 = 50.0;

pub(super) async fn run(target: &Target, figures: &mut Figures) -> anyhow::Result<()> {
    let service = Service::of(target, &[])?;
    let api = Api::new(&service.address)?;
    // Unlike any other order, also on a service that has seen this program before.
    let order = format!("order-{}", std::process::id());
    let begun = Instant::now();
    let pulling = tokio::spawn(pull(api.clone(), order.clone(), begun));
    let sent = at_rate(RATE, PIECES, |n| {
        let (api, order) = (api.clone(), order.clone());
        async move {
            let job = json!({ "labels": { "order": order, "piece": n.to_string() } });
            api.post("/v1/flatten?wait=0", &json!({ "surface": panel(n), "job": job })).await.map(drop)
        }
    })
    .await?;
    let fetched = pulling.await??;
    let accepted: Times = sent.into_iter().collect();
    figures.times(NAME, "piece sent until it is accepted", &accepted);
    // From the time at which the piece was meant to be sent until its DXF was in hand.
    let in_hand = |(n, at): (usize, Duration)| at.saturating_sub(Duration::from_secs_f64(n as f64 / RATE));
    let in_hand: Times = fetched.iter().copied().map(in_hand).collect();
    figures.times(NAME, "piece sent until its DXF is fetched by way of the feed", &in_hand);
    let last = fetched.iter().map(|&(_, at)| at).max().unwrap_or_default().as_secs_f64();
    figures.note(
        NAME,
        format!("all {PIECES} patterns fetched, sent at {RATE} a second"),
        format!("{} s", digits(last)),
    );
    if let Some(peak) = service.peak_mb() {
        figures.note(NAME, "peak memory of the service", format!("{} MB", digits(peak)));
    }
    Ok(())
}

/// Follows the feed of the order and fetches each pattern; gives the pieces with the times at which they were in hand.
async fn pull(api: Api, order: String, begun: Instant) -> anyhow::Result<Vec<(usize, Duration)>> {
    let mut fetched = Vec::with_capacity(PIECES);
    let mut after = 0;
    while fetched.len() < PIECES {
        let page = api.json(&format!("/v1/feed?label.order={order}&after={after}&limit=100&wait=30")).await?;
        after = page["next"].as_u64().context("the feed gives no next")?;
        for item in page["items"].as_array().map_or(&[][..], Vec::as_slice) {
            let job = &item["job"];
            ensure!(job["state"] == "succeeded", "a piece ended so: {job}");
            let id = job["id"].as_str().context("a job without id")?;
            let dxf = api.get(&format!("/v1/jobs/{id}/pattern.dxf")).await?;
            ensure!(!dxf.is_empty(), "an empty pattern");
            let piece = job["labels"]["piece"].as_str().and_then(|text| text.parse().ok());
            fetched.push((piece.context("a piece without its label")?, begun.elapsed()));
        }
    }
    Ok(fetched)
}
