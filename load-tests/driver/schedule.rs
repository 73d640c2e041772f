//! When requests go out: at a rate (open loop), or as fast as so many clients can (closed loop, for capacity).

use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use tokio::task::JoinSet;

/// Sends `count` requests, `rate` a second, whatever becomes of those before. Gives for each how long it took from the
/// time at which it was meant to go out, in the order of those times; the first error ends the run.
pub(crate) async fn at_rate<F, Fut>(rate: f64, count: usize, request: F) -> anyhow::Result<Vec<Duration>>
where
    F: Fn(usize) -> Fut,
    Fut: Future<Output = anyhow::Result<()>> + Send + 'static,
{
    let mut under_way = JoinSet::new();
    let start = Instant::now();
    let handle = tokio::runtime::Handle::current();
    tokio::task::block_in_place(|| {
        for n in 0..count {
            let due = start + Duration::from_secs_f64(n as f64 / rate);
            // The thread sleeps and not the task: timers of tasks have a grain of a millisecond.
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            let answer = request(n);
            under_way.spawn_on(async move { answer.await.map(|()| (n, due.elapsed())) }, &handle);
        }
    });
    let mut took = vec![Duration::ZERO; count];
    while let Some(done) = under_way.join_next().await {
        let (n, time) = done??;
        took[n] = time;
    }
    Ok(took)
}

/// Sends `count` requests over `clients` clients, each as soon as its last one is answered; gives the requests a second.
pub(crate) async fn as_fast_as<F, Fut>(clients: usize, count: usize, request: F) -> anyhow::Result<f64>
where
    F: Fn(usize) -> Fut + Clone + Send + Sync + 'static,
    Fut: Future<Output = anyhow::Result<()>> + Send + 'static,
{
    let next = Arc::new(AtomicUsize::new(0));
    let start = Instant::now();
    let mut under_way = JoinSet::new();
    for _ in 0..clients {
        let (next, request) = (next.clone(), request.clone());
        under_way.spawn(async move {
            loop {
                let n = next.fetch_add(1, Ordering::Relaxed);
                if n >= count {
                    return anyhow::Ok(());
                }
                request(n).await?;
            }
        });
    }
    while let Some(done) = under_way.join_next().await {
        done??;
    }
    Ok(count as f64 / start.elapsed().as_secs_f64())
}
