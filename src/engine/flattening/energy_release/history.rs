//! The course of the energy over the moves, in bounded memory.

/// Most pairs of a history: enough for a picture.
pub(super) const LENGTH: usize = 200;

/// Moves and energies as they come; when there are too many, every second one is forgotten and half as many are taken from
/// there on.
#[derive(Debug, Clone)]
pub(super) struct History {
    kept: Vec<(u64, f64)>,
    /// Moves from one pair to the next.
    every: u64,
}

impl History {
    /// Begins with the energy before the first move. `every` is how many moves lie between two pairs at first.
    pub(super) fn begin(energy: f64, every: u64) -> Self {
        let mut kept = Vec::with_capacity(LENGTH);
        kept.push((0, energy));
        Self { kept, every: every.max(1) }
    }

    /// Tells the energy after so many moves.
    #[inline]
    pub(super) fn tell(&mut self, moves: u64, energy: f64) {
        if moves >= self.kept.last().map_or(0, |last| last.0) + self.every {
            self.keep(moves, energy);
        }
    }

    #[cold]
    fn keep(&mut self, moves: u64, energy: f64) {
        // One place is for the end.
        if self.kept.len() + 1 >= LENGTH {
            let mut number = 0;
            self.kept.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.every = self.every.saturating_mul(2);
        }
        self.kept.push((moves, energy));
    }

    /// All of it, with the end.
    pub(super) fn end(mut self, moves: u64, energy: f64) -> Vec<(u64, f64)> {
        if self.kept.last().is_some_and(|last| last.0 == moves && moves > 0) {
            self.kept.pop();
        }
        self.kept.push((moves, energy));
        self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_history_is_bounded_and_has_both_ends_in_order() {
        for moves in [0, 1, 150, 199, 200, 12_345] {
            let mut history = History::begin(1.0, 1);
            for k in 1..=moves {
                history.tell(k, 1.0 / (1 + k) as f64);
            }
            let all = history.end(moves, 0.5);
            assert!(all.len() <= LENGTH && all.len() >= 2, "{}", all.len());
            assert_eq!((all[0], all[all.len() - 1]), ((0, 1.0), (moves, 0.5)));
            assert!(all.windows(2).all(|w| w[0].0 < w[1].0 || moves == 0));
            if moves > 1000 {
                assert!(all.len() >= LENGTH / 3);
            }
        }
    }
}
