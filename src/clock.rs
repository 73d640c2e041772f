//! Time behind a handle: the wall's for what people read, a steady one for what the machine decides by.
//!
//! Wall time may step (a correction by an hour must not make leases run out), so nothing in the program decides by it.
//! *Steady* time starts at the wall's time when the clock is made and from then on follows the monotonic clock: it can be
//! stored beside wall times and compared within one process, and it never jumps. All times are microseconds since 1970.
//! A fake clock stands still until a test moves it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// A clock; clones tell the same time.
#[derive(Debug, Clone)]
pub struct Clock(Arc<Source>);

#[derive(Debug)]
enum Source {
    System { wall_us: i64, since: Instant },
    Fake(Mutex<Times>),
}

#[derive(Debug, Clone, Copy)]
struct Times {
    wall_us: i64,
    steady_us: i64,
}

impl Clock {
    /// The machine's clock.
    #[must_use]
    pub fn system() -> Self {
        Self(Arc::new(Source::System { wall_us: wall_us(), since: Instant::now() }))
    }

    /// A clock that stands at `start_us` until its other handle moves it.
    #[must_use]
    pub fn fake(start_us: i64) -> (Self, FakeClock) {
        let times = Times { wall_us: start_us, steady_us: start_us };
        let clock = Self(Arc::new(Source::Fake(Mutex::new(times))));
        (clock.clone(), FakeClock(clock))
    }

    /// The wall's time: for stamps that people read.
    #[must_use]
    pub fn wall_us(&self) -> i64 {
        match &*self.0 {
            Source::System { .. } => wall_us(),
            Source::Fake(times) => times.lock().unwrap_or_else(PoisonError::into_inner).wall_us,
        }
    }

    /// Steady time: for leases and durations within this process.
    #[must_use]
    pub fn steady_us(&self) -> i64 {
        match &*self.0 {
            Source::System { wall_us, since } => {
                wall_us.saturating_add(i64::try_from(since.elapsed().as_micros()).unwrap_or(i64::MAX))
            }
            Source::Fake(times) => times.lock().unwrap_or_else(PoisonError::into_inner).steady_us,
        }
    }
}

impl Default for Clock {
    fn default() -> Self {
        Self::system()
    }
}

/// The handle that moves a fake clock.
#[derive(Debug, Clone)]
pub struct FakeClock(Clock);

impl FakeClock {
    /// Lets time pass: wall and steady time go on together.
    pub fn advance(&self, by: Duration) {
        let by = i64::try_from(by.as_micros()).unwrap_or(i64::MAX);
        self.change(|times| {
            times.wall_us = times.wall_us.saturating_add(by);
            times.steady_us = times.steady_us.saturating_add(by);
        });
    }

    /// Someone sets the wall clock, forwards or back; steady time goes on as before.
    pub fn step_wall(&self, by_us: i64) {
        self.change(|times| times.wall_us = times.wall_us.saturating_add(by_us));
    }

    fn change(&self, change: impl FnOnce(&mut Times)) {
        if let Source::Fake(times) = &*self.0.0 {
            change(&mut times.lock().unwrap_or_else(PoisonError::into_inner));
        }
    }
}

fn wall_us() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_micros()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steady_time_does_not_follow_a_step_of_the_wall() {
        let (clock, hand) = Clock::fake(1_000);
        hand.advance(Duration::from_micros(5));
        hand.step_wall(-3_600_000_000);
        assert_eq!(clock.steady_us(), 1_005);
        assert_eq!(clock.wall_us(), 1_005 - 3_600_000_000);
        hand.advance(Duration::from_micros(5));
        assert_eq!(clock.steady_us(), 1_010);
    }

    #[test]
    fn the_system_clock_goes_forward_and_both_times_agree_at_the_start() {
        let clock = Clock::system();
        let first = clock.steady_us();
        assert!((clock.wall_us() - first).abs() < 60_000_000);
        assert!(clock.steady_us() >= first);
    }
}
