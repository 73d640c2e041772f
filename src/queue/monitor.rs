//! The observer of one attempt: how far it is, how long each stage took, and whether it is to stop and why.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::{Map, Value};

use crate::clock::Clock;
use crate::engine::budget::{Observer, Stage};
use crate::store::Progress;

/// Why an attempt is to stop. The first reason stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Stop {
    /// Someone cancelled the job.
    Cancelled = 1,
    /// It took too long.
    TimedOut = 2,
    /// The service stops.
    Draining = 3,
    /// Its lease was lost: another attempt is under way.
    Lost = 4,
}

/// What the worker's thread writes and the machine reads.
#[derive(Debug)]
pub(super) struct Monitor {
    stop: AtomicU8,
    fraction: AtomicU64,
    /// Estimated milliseconds that the present stage will take yet; [`UNKNOWN`] where there is no saying.
    remaining_ms: AtomicU64,
    /// Seconds that the present stage may take, as bits; infinite where there is no limit.
    budget_s: AtomicU64,
    laps: Mutex<Laps>,
    clock: Clock,
}

/// No estimate.
const UNKNOWN: u64 = u64::MAX;

/// Longest estimate that is given, milliseconds: some thirty years are as good as never.
const LONGEST_ESTIMATE: f64 = 1e12;

#[derive(Debug, Default)]
struct Laps {
    present: Option<(Stage, i64)>,
    /// Microseconds by stage, in the order in which they were first entered.
    done: Vec<(Stage, i64)>,
}

impl Laps {
    fn close(&mut self, now: i64) {
        if let Some((stage, since)) = self.present.take() {
            let took = now - since;
            match self.done.iter_mut().find(|(known, _)| *known == stage) {
                Some((_, sum)) => *sum += took,
                None => self.done.push((stage, took)),
            }
        }
    }
}

impl Monitor {
    pub(super) fn new(clock: Clock) -> Self {
        Self {
            stop: AtomicU8::new(0),
            fraction: AtomicU64::new(0),
            remaining_ms: AtomicU64::new(UNKNOWN),
            budget_s: AtomicU64::new(f64::INFINITY.to_bits()),
            laps: Mutex::default(),
            clock,
        }
    }

    /// Asks the attempt to stop, unless it was asked before.
    pub(super) fn stop(&self, why: Stop) {
        let _ = self.stop.compare_exchange(0, why as u8, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Why it was asked to stop.
    pub(super) fn stopped(&self) -> Option<Stop> {
        match self.stop.load(Ordering::Relaxed) {
            1 => Some(Stop::Cancelled),
            2 => Some(Stop::TimedOut),
            3 => Some(Stop::Draining),
            4 => Some(Stop::Lost),
            _ => None,
        }
    }

    /// How far it is.
    pub(super) fn progress(&self) -> Progress {
        let stage = self.laps().present.map(|(stage, _)| stage.name());
        let fraction = f64::from_bits(self.fraction.load(Ordering::Relaxed));
        let remaining = self.remaining_ms.load(Ordering::Relaxed);
        Progress {
            fraction: if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 },
            stage,
            remaining_ms: (remaining != UNKNOWN).then_some(remaining),
        }
    }

    /// Ends the present stage and gives `timings_ms`: the stages that ran, the wait before, and all together.
    pub(super) fn timings(&self, queued_us: i64, total_us: i64) -> Value {
        let mut laps = self.laps();
        laps.close(self.clock.steady_us());
        let milliseconds = |us: i64| Value::from(us.max(0) as f64 / 1e3);
        let mut timings = Map::new();
        timings.insert("queued".to_owned(), milliseconds(queued_us));
        for &(stage, us) in &laps.done {
            timings.insert(stage.name().to_owned(), milliseconds(us));
        }
        timings.insert("total".to_owned(), milliseconds(queued_us.max(0) + total_us));
        Value::Object(timings)
    }

    fn laps(&self) -> MutexGuard<'_, Laps> {
        // A panic while it was held leaves at worst one lap unmeasured.
        self.laps.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Monitor {
    fn enter(&self, stage: Stage) {
        let now = self.clock.steady_us();
        let mut laps = self.laps();
        laps.close(now);
        laps.present = Some((stage, now));
        drop(laps);
        self.fraction.store(0, Ordering::Relaxed);
        self.remaining_ms.store(UNKNOWN, Ordering::Relaxed);
        self.budget_s.store(f64::INFINITY.to_bits(), Ordering::Relaxed);
    }

    fn progress(&self, fraction: f64) {
        self.fraction.store(fraction.to_bits(), Ordering::Relaxed);
        let now = self.clock.steady_us();
        let Some(took_us) = self.laps().present.map(|(_, since)| (now - since).max(0)) else { return };
        let took_ms = took_us as f64 / 1e3;
        // As fast as so far, but no longer than the budget.
        let budget_ms = 1e3 * f64::from_bits(self.budget_s.load(Ordering::Relaxed)) - took_ms;
        let estimate = (took_ms * (1.0 - fraction) / fraction).min(budget_ms).max(0.0);
        let known = fraction > 0.0 && fraction <= 1.0 && estimate <= LONGEST_ESTIMATE;
        self.remaining_ms.store(if known { estimate as u64 } else { UNKNOWN }, Ordering::Relaxed);
    }

    fn out_of_time(&self, budget_s: f64) -> bool {
        self.budget_s.store(budget_s.to_bits(), Ordering::Relaxed);
        let now = self.clock.steady_us();
        let laps = self.laps();
        let Some((stage, since)) = laps.present else { return false };
        let before = laps.done.iter().find(|(known, _)| *known == stage).map_or(0, |(_, us)| *us);
        (before + now - since) as f64 >= 1e6 * budget_s
    }

    fn is_cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed) != 0
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn stages_are_timed_and_a_stage_that_comes_twice_is_summed() {
        let (clock, hand) = Clock::fake(0);
        let monitor = Monitor::new(clock);
        for (stage, ms) in [(Stage::Tracing, 2), (Stage::Flattening, 3), (Stage::Tracing, 5)] {
            monitor.enter(stage);
            hand.advance(Duration::from_millis(ms));
        }
        let timings = monitor.timings(400, 11_000);
        assert_eq!(timings, serde_json::json!({ "queued": 0.4, "tracing": 7.0, "flattening": 3.0, "total": 11.4 }));
    }

    #[test]
    fn what_is_left_is_estimated_from_what_was_done_and_is_no_more_than_the_budget() {
        let (clock, hand) = Clock::fake(0);
        let monitor = Monitor::new(clock);
        monitor.enter(Stage::SeedSearch);
        assert_eq!(monitor.progress().remaining_ms, None);
        hand.advance(Duration::from_secs(2));
        Observer::progress(&monitor, 0.25);
        assert_eq!(monitor.progress().remaining_ms, Some(6000));
        assert!(!monitor.out_of_time(5.0) && monitor.out_of_time(2.0) && !monitor.out_of_time(5.0));
        Observer::progress(&monitor, 0.25);
        assert_eq!(monitor.progress().remaining_ms, Some(3000));
        // The stage comes again for another piece: its time counts on.
        monitor.enter(Stage::Flattening);
        hand.advance(Duration::from_secs(9));
        monitor.enter(Stage::SeedSearch);
        assert_eq!(monitor.progress().remaining_ms, None);
        assert!(!monitor.out_of_time(5.0));
        hand.advance(Duration::from_secs(3));
        assert!(monitor.out_of_time(5.0));
    }

    #[test]
    fn the_first_reason_to_stop_stands() {
        let monitor = Monitor::new(Clock::system());
        assert!(!monitor.is_cancelled());
        monitor.stop(Stop::TimedOut);
        monitor.stop(Stop::Cancelled);
        assert!(monitor.is_cancelled());
        assert_eq!(monitor.stopped(), Some(Stop::TimedOut));
    }

    #[test]
    fn a_fraction_that_is_no_number_is_not_written() {
        let monitor = Monitor::new(Clock::system());
        monitor.enter(Stage::Pattern);
        for (told, read) in [(f64::NAN, 0.0), (f64::INFINITY, 0.0), (1.5, 1.0), (-1.0, 0.0), (0.25, 0.25)] {
            Observer::progress(&monitor, told);
            let told = monitor.progress();
            assert_eq!((told.fraction, told.stage), (read, Some("pattern")));
        }
    }
}
