//! Threads: each worker has a small rayon pool of its own.
//!
//! In one shared pool rayon would take a newly injected job only when its own deques are empty, so one large `par_iter`
//! would hold up every job behind it. Separate pools leave the sharing of cores to the system, which is fair.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use tokio::sync::oneshot;

use super::monitor::Monitor;
use super::runner::{Failed, Finished, Runner, Task};

/// Stack of a worker's thread. Recursion in the engine is bounded far below it; an overflow would end the process.
const STACK_BYTES: usize = 8 << 20;

/// How an attempt came out.
#[derive(Debug)]
pub(super) enum Outcome {
    /// The runner returned.
    Returned(Result<Finished, Failed>),
    /// It panicked, with this message.
    Panicked(String),
}

/// Makes a worker's threads.
pub(super) fn pool(worker: usize, threads: usize) -> Result<ThreadPool, ThreadPoolBuildError> {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK_BYTES)
        .thread_name(move |thread| format!("worker-{worker}-{thread}"))
        // Without this a panic in a task that the work spawned and did not wait for would end the process.
        .panic_handler(|panic| tracing::error!(message = message(&*panic), "a detached task of a job panicked"))
        .build()
}

/// Runs the work on the pool's threads; the receiver gets the outcome, also of a panic.
pub(super) fn spawn(
    pool: &ThreadPool,
    runner: Arc<dyn Runner>,
    task: Task,
    monitor: Arc<Monitor>,
) -> oneshot::Receiver<Outcome> {
    let (sender, receiver) = oneshot::channel();
    pool.spawn(move || {
        let outcome = match catch_unwind(AssertUnwindSafe(|| runner.run(&task, &*monitor))) {
            Ok(returned) => Outcome::Returned(returned),
            Err(panic) => Outcome::Panicked(message(&*panic)),
        };
        // The machine may have given the attempt up; then no one listens.
        let _ = sender.send(outcome);
    });
    receiver
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message").to_owned()
}
