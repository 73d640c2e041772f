//! Small surfaces flattened in one call, beside commits of one row of the same size.

use super::{Service, Target, bare};
use crate::client::Api;
use crate::figures::{Bar, Figures, Times, digits};
use crate::parts::panel_bytes;
use crate::schedule::{as_fast_as, at_rate};

const NAME: &str = "smoke";
/// Requests a second of each sort: some tenth of what a small machine can do, so that latencies are not those of waiting.
const RATE: f64 = 15.0;
/// Requests of each sort.
const COUNT: usize = 300;
/// Clients and requests of the capacity measurement.
const CLIENTS: usize = 16;
const CAPACITY_COUNT: usize = 600;
/// Requests before anything is measured.
const WARM_UP: usize = 30;
/// The bar: a small surface's flattening in hand within so many one-row commits' time, at the median.
const COMMITS: f64 = 6.0;

pub(super) async fn run(target: &Target, figures: &mut Figures) -> anyhow::Result<()> {
    let service = Service::of(target, &[])?;
    let (rows, _folder) = bare(|_| Ok(()))?;
    let (api, row) = (Api::new(&service.address)?, Api::new(&rows.address)?);
    for n in 0..WARM_UP {
        api.clone().flatten(panel_bytes(n)).await?;
        row.clone().row(panel_bytes(n)).await?;
    }
    // By turns: what disturbs one disturbs the other.
    let took = at_rate(2.0 * RATE, 2 * COUNT, |n| {
        let (api, row, body) = (api.clone(), row.clone(), panel_bytes(WARM_UP + n));
        async move { if n % 2 == 0 { row.row(body).await } else { api.flatten(body).await } }
    })
    .await?;
    let commits: Times = took.iter().step_by(2).copied().collect();
    let flattenings: Times = took.iter().skip(1).step_by(2).copied().collect();
    figures.times(NAME, "one row committed by a bare handler", &commits);
    figures.times(NAME, "small surface in, DXF back", &flattenings);
    let ratio = flattenings.quantile(0.5) / commits.quantile(0.5);
    figures.judge(NAME, "p50 of the two", ratio, " commits", Bar::AtMost(COMMITS));

    let from = WARM_UP + 2 * COUNT;
    let bare_rate = as_fast_as(CLIENTS, CAPACITY_COUNT, move |n| row.clone().row(panel_bytes(from + n))).await?;
    let rate = as_fast_as(CLIENTS, CAPACITY_COUNT, move |n| api.clone().flatten(panel_bytes(from + n))).await?;
    figures.note(
        NAME,
        format!("{CLIENTS} clients: jobs/s, commits/s of the bare handler, ratio"),
        format!("{} · {} · {}", digits(rate), digits(bare_rate), digits(rate / bare_rate)),
    );
    if let Some(peak) = service.peak_mb() {
        figures.note(NAME, "peak memory of the service", format!("{} MB", digits(peak)));
    }
    Ok(())
}
