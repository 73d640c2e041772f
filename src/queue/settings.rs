//! Every number of the job machine, with the trade-off it settles.

use std::num::NonZero;
use std::time::Duration;

/// Most heavy workers by default: each holds a mesh and its scratch, so memory grows with them.
const MOST_WORKERS: usize = 8;
/// Most threads a job has by default: beyond this the seed search, the one stage that uses them, gains little.
const MOST_THREADS: usize = 16;

/// Most threads of all workers together: each has a stack of its own, and beyond some for each core they only wait.
const MOST_THREADS_IN_ALL: usize = 256;

/// The job machine's settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Jobs of any size that run at once. Each worker has threads of its own, so a large job never keeps a claimed one
    /// from starting; they share the cores by the system's time slices.
    pub workers: usize,
    /// Further jobs that run at once, of the light lane alone: small jobs get through while large ones fill `workers`.
    pub light_workers: usize,
    /// Threads that one heavy job may use; fewer where there are so many workers that it would be 256 in all. Results do
    /// not depend on it.
    pub threads: usize,
    /// A job of at most this cost is light. Cost is in triangle visits (20 for each triangle, 520 where the least
    /// distortion is looked for, and triangles times seeds tried); a million are every seed of 990 triangles (some
    /// ten milliseconds of the search), the least distortion of 1900, or a mesh of 50 000.
    pub light_cost: u64,
    /// Jobs that may wait. At this many, new ones are refused rather than accepted and forgotten.
    pub most_waiting: u64,
    /// Times that a job is started before it is given up: enough to outlive two crashes it did not cause, few enough
    /// that an input which kills the process stops doing so.
    pub most_attempts: u32,
    /// How long a claim holds without renewal.
    pub lease: Duration,
    /// How often it is renewed: several times within a lease, so one slow commit loses nothing.
    pub renew_every: Duration,
    /// How often leases that have run out are looked for.
    pub sweep_every: Duration,
    /// How often idle workers ask anew for a job, beside being given each that comes.
    pub poll_every: Duration,
    /// How often progress and cancellations are looked at. Well under the second within which a cancelled job stops.
    pub tick_every: Duration,
    /// How often the progress of a job is written: each is a commit.
    pub progress_every: Duration,
    /// How often room of deleted rows is given back to the file system.
    pub tidy_every: Duration,
    /// How long one attempt may take.
    pub timeout: Duration,
    /// How long a job that was told to stop may go on before it counts as stuck.
    pub stuck_after: Duration,
    /// How long a worker waits before a job with a transient fault is tried again.
    pub retry_pause: Duration,
    /// How long drained jobs may take to stop after their grace, before they are released without waiting for them.
    pub release_after: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
        Self {
            workers: cores.min(MOST_WORKERS),
            light_workers: cores.div_ceil(4).min(MOST_WORKERS),
            threads: cores.min(MOST_THREADS),
            light_cost: 1_000_000,
            most_waiting: 10_000,
            most_attempts: 3,
            lease: Duration::from_secs(30),
            renew_every: Duration::from_secs(10),
            sweep_every: Duration::from_secs(10),
            poll_every: Duration::from_secs(1),
            tick_every: Duration::from_millis(100),
            progress_every: Duration::from_millis(500),
            tidy_every: Duration::from_mins(1),
            timeout: Duration::from_mins(10),
            stuck_after: Duration::from_secs(10),
            retry_pause: Duration::from_millis(500),
            release_after: Duration::from_secs(5),
        }
    }
}

impl Settings {
    /// The settings with what would make the machine stand still set right: at least one worker, thread, attempt, and
    /// millisecond between ticks; not more threads than a process should have.
    #[must_use]
    pub(super) fn sound(mut self) -> Self {
        self.workers = self.workers.max(1);
        self.threads = self.threads.min(MOST_THREADS_IN_ALL / self.workers).max(1);
        self.most_attempts = self.most_attempts.max(1);
        self.tick_every = self.tick_every.max(Duration::from_millis(1));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_under_which_nothing_would_run_are_set_right() {
        let zero =
            Settings { workers: 0, threads: 0, most_attempts: 0, tick_every: Duration::ZERO, ..Settings::default() };
        let sound = zero.sound();
        assert_eq!((sound.workers, sound.threads, sound.most_attempts), (1, 1, 1));
        assert!(sound.tick_every > Duration::ZERO);
    }

    #[test]
    fn many_workers_share_the_threads_that_a_process_may_have() {
        for (workers, threads) in [(1, 256), (4, 64), (64, 4), (1000, 1)] {
            let sound = Settings { workers, threads: 1000, ..Settings::default() }.sound();
            assert_eq!((sound.workers, sound.threads), (workers, threads));
        }
    }
}
