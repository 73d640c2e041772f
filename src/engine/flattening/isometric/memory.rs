//! What steps with a kept factor teach about the energy's curvature: limited-memory BFGS (Nocedal 1980) around it.
//!
//! A factor that is no longer that of the Hessian, or was made of a Hessian with its negative eigenvalues taken away, errs
//! mostly in few directions. Each step tells what it got wrong along that step; so corrected, the factor serves for
//! several times as many steps.

/// Steps that are remembered. More hardly help, and each costs a pass over all unknowns.
const REMEMBERED: usize = 10;

/// Least cosine between a step and the change of the gradient along it: below, the energy is not convex there.
const LEAST_COSINE: f64 = 1e-6;

#[derive(Debug, Default)]
pub(super) struct Memory {
    pairs: Vec<Pair>,
    /// How many are in use, oldest first.
    used: usize,
}

#[derive(Debug, Default)]
struct Pair {
    step: Vec<[f64; 2]>,
    change: Vec<[f64; 2]>,
    inverse: f64,
    share: f64,
}

fn dot(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]).sum()
}

fn add(to: &mut [[f64; 2]], factor: f64, what: &[[f64; 2]]) {
    for (to, what) in to.iter_mut().zip(what) {
        *to = [to[0] + factor * what[0], to[1] + factor * what[1]];
    }
}

impl Memory {
    /// Forgets all steps.
    pub(super) fn clear(&mut self) {
        self.used = 0;
    }

    /// Remembers `factor` times a direction, along which the gradient changed from `before` to `after`.
    pub(super) fn remember(&mut self, factor: f64, direction: &[[f64; 2]], before: &[[f64; 2]], after: &[[f64; 2]]) {
        if self.used == REMEMBERED {
            self.pairs[..REMEMBERED].rotate_left(1);
            self.used -= 1;
        }
        if self.pairs.len() == self.used {
            self.pairs.push(Pair::default());
        }
        let pair = &mut self.pairs[self.used];
        pair.step.clear();
        pair.step.extend(direction.iter().map(|d| d.map(|x| factor * x)));
        pair.change.clear();
        pair.change.extend(after.iter().zip(before).map(|(a, b)| [a[0] - b[0], a[1] - b[1]]));
        let along = dot(&pair.step, &pair.change);
        let sizes = dot(&pair.step, &pair.step) * dot(&pair.change, &pair.change);
        if along > LEAST_COSINE * sizes.sqrt() {
            pair.inverse = along.recip();
            self.used += 1;
        }
    }

    /// Applies the inverse Hessian to a gradient, where `solve` applies the factor's.
    pub(super) fn apply(&mut self, gradient: &mut [[f64; 2]], solve: impl FnOnce(&mut [[f64; 2]])) {
        for pair in self.pairs[..self.used].iter_mut().rev() {
            pair.share = pair.inverse * dot(&pair.step, gradient);
            add(gradient, -pair.share, &pair.change);
        }
        solve(gradient);
        for pair in &self.pairs[..self.used] {
            let share = pair.share - pair.inverse * dot(&pair.change, gradient);
            add(gradient, share, &pair.step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_is_learnt_from_as_many_steps_as_directions_in_which_the_factor_errs() {
        // Hessian diag(1, .., 1, 7, 0.2), factor of the unit matrix: with exact steps along the line two are enough.
        let hessian = [[1.0, 1.0], [1.0, 1.0], [7.0, 0.2]];
        let gradient = |x: &[[f64; 2]; 3]| -> [[f64; 2]; 3] {
            std::array::from_fn(|i| std::array::from_fn(|d| hessian[i][d] * x[i][d]))
        };
        let mut memory = Memory::default();
        let mut x = [[1.0, -2.0], [0.5, 3.0], [1.0, -1.0]];
        for _ in 0..3 {
            let before = gradient(&x);
            let mut direction = before;
            memory.apply(&mut direction, |_| {});
            let image = gradient(&direction);
            let length = dot(&direction, &before) / dot(&direction, &image);
            add(&mut x, -length, &direction);
            memory.remember(-length, &direction, &before, &gradient(&x));
        }
        assert!(dot(&x, &x).sqrt() < 1e-12, "{x:?}");
        // With the memory gone the factor alone speaks.
        memory.clear();
        let mut direction = [[1.0, 2.0]];
        memory.apply(&mut direction, |x| x[0] = [3.0, 4.0]);
        assert_eq!(direction, [[3.0, 4.0]]);
    }

    #[test]
    fn steps_against_the_curvature_are_not_remembered() {
        let mut memory = Memory::default();
        memory.remember(1.0, &[[1.0, 0.0]], &[[0.0, 0.0]], &[[-1.0, 0.0]]);
        assert_eq!(memory.used, 0);
    }
}
