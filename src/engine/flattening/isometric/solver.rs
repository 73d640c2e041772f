//! Projected Newton with a factor that is kept as long as it serves.
//!
//! Each round assembles the projected Hessian, factorises it, and steps. While the energy's curvature changes little the
//! same factor then gives further steps from new gradients, at a fraction of the price (Shamanskii 1967); when such a
//! step no longer promises much less than the one before, the next round begins.
//!
//! Stops when a step promises to lower the energy by less than [`TOLERANCE`] of it (or [`RESOLUTION`]), takes that step,
//! and is done: near the least the true error is then far below the promise, since Newton's steps square it.

use super::assembly::{Assembly, gradient_of};
use super::cholesky::{Factor, Matrix, Symbolic};
use super::energy::{Curvature, Energy};
use super::search::search;
use super::shape::Shape;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// Part of the energy that a step must promise to be worth another one. The map's error is then about its root, 1e-4 of
/// the strain that is there anyhow.
pub(super) const TOLERANCE: f64 = 1e-8;

/// Mean energy below which nothing is asked: strains of 1e-11, the rounding of coordinates of a fine mesh.
pub(super) const RESOLUTION: f64 = 1e-22;

/// Most factorisations. Surfaces that engineers flatten take two to six, heads that are closed but for the neck up to
/// fifty; what is not done then is stuck.
pub(super) const MAX_ROUNDS: usize = 200;

/// A step with a kept factor is taken when it promises at most this part of what the step before promised.
const STILL_SERVES: f64 = 0.1;

/// Most steps with one factor.
const MAX_KEPT: usize = 12;

/// Mean energy from which a map counts as far from the least.
const FAR: f64 = 0.5;
const PROJECTED: Curvature = Curvature::Newton { clamped: 1.0 };
const LEAST_CLAMPED: f64 = 0.1;
const LOWERED: f64 = 0.3;
const SLOW: f64 = 0.3;
const NEAR: f64 = 0.03;
/// Moving and turning the whole.
const RIGID: usize = 3;
fn trace() -> bool { std::env::var("ISO_TRACE").is_ok() }

/// What a run came to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Run {
    /// Mean energy reached.
    pub energy: f64,
    /// Factorisations.
    pub rounds: usize,
    /// Steps with a factor that was there already.
    pub kept: usize,
    /// Whether the criterion was met (else: stuck, or out of rounds).
    pub converged: bool,
}

/// All that steps need, allocated once.
pub(super) struct Solver<'a> {
    pub(super) shape: &'a Shape,
    pub(super) symbolic: &'a Symbolic<2>,
    pub(super) assembly: &'a Assembly,
    pub(super) matrix: Matrix<2>,
    pub(super) factor: Factor<2>,
    pub(super) held: Option<Vec<bool>>,
    pub(super) gradient: Vec<[f64; 2]>,
    pub(super) direction: Vec<[f64; 2]>,
    pub(super) next: Vec<[f64; 2]>,
}

impl<'a> Solver<'a> {
    pub(super) fn new(shape: &'a Shape, symbolic: &'a Symbolic<2>, assembly: &'a Assembly) -> Self {
        let room = vec![[0.0; 2]; symbolic.vertex_count()];
        Self {
            shape,
            symbolic,
            assembly,
            matrix: symbolic.matrix(),
            factor: Factor::new(symbolic),
            held: None,
            gradient: room.clone(),
            direction: room.clone(),
            next: room,
        }
    }

    /// Lowers the energy of a map without flips as far as it goes.
    pub(super) fn minimise(
        &mut self,
        energy: Energy,
        flat: &mut Vec<[f64; 2]>,
        max_rounds: usize,
        observer: &dyn Observer,
    ) -> Result<Run, EngineError> {
        let mut run = Run { energy: self.shape.energy(energy, flat), ..Run::default() };
        let mut curvature = if run.energy > FAR || energy.is_robust() { Curvature::Secant } else { PROJECTED };
        let tolerance = if energy.is_robust() { std::env::var("RT").map_or(1e-4, |x| x.parse().unwrap()) } else { TOLERANCE };
        let mut before = f64::INFINITY;
        let mut wait = 0_usize;
        for round in 0..max_rounds {
            observer.check()?;
            observer.progress(round as f64 / (round + 4) as f64);
            let gain = (before - run.energy) / before;
            before = run.energy;
            curvature = match curvature {
                Curvature::Secant if gain < if energy.is_robust() { std::env::var("RG").map_or(0.01, |x| x.parse().unwrap()) } else { SLOW } => PROJECTED,
                Curvature::Newton { clamped } if gain < NEAR && wait == 0 => {
                    Curvature::Newton { clamped: if clamped > LEAST_CLAMPED { LOWERED * clamped } else { 0.0 } }
                }
                same => same,
            };
            wait = wait.saturating_sub(1);
            loop {
                self.assembly.hessian(self.shape, (energy, curvature), flat, &mut self.matrix, &mut self.gradient);
                self.hold();
                run.rounds += 1;
                let Curvature::Newton { clamped } = curvature else {
                    self.factor.factorise(self.symbolic, &self.matrix, usize::MAX);
                    break;
                };
                let allowed = if clamped < 1.0 { RIGID } else { usize::MAX };
                if self.factor.factorise(self.symbolic, &self.matrix, allowed) {
                    break;
                }
                if trace() { eprintln!("not positive: {clamped}"); }
                curvature = Curvature::Newton { clamped: if clamped == 0.0 { LEAST_CLAMPED } else { (clamped / LOWERED).min(1.0) } };
                wait = 2;
            }
            let mut promise = self.promise();
            for kept in 0..=MAX_KEPT {
                let enough = promise <= tolerance * run.energy + RESOLUTION;
                let Some((reached, step)) =
                    search(self.shape, energy, flat, &self.direction, (run.energy, -2.0 * promise), &mut self.next)
                else {
                    // Nothing lower that rounding would show: the end, unless a fresh factor knows better.
                    if kept == 0 || enough {
                        run.converged = enough;
                        return Ok(run);
                    }
                    break;
                };
                if trace() { eprintln!("{curvature:?} round {round} kept {kept} E {:.6e} -> {reached:.6e} promise {promise:.2e} step {step:.3e}", run.energy); }
                std::mem::swap(flat, &mut self.next);
                run.energy = reached;
                run.kept += usize::from(kept > 0);
                if enough {
                    run.converged = true;
                    return Ok(run);
                }
                if step < 1.0 || kept == MAX_KEPT {
                    break;
                }
                observer.check()?;
                gradient_of(self.shape, energy, flat, &mut self.gradient);
                self.hold_gradient();
                let now = self.promise();
                if now > STILL_SERVES * promise && now > tolerance * run.energy + RESOLUTION {
                    break;
                }
                promise = now;
            }
        }
        Ok(run)
    }

    /// The step from the gradient and the factor that are there; half of what its slope promises.
    fn promise(&mut self) -> f64 {
        for (d, g) in self.direction.iter_mut().zip(&self.gradient) {
            *d = [-g[0], -g[1]];
        }
        self.factor.solve(self.symbolic, &mut self.direction);
        let slope: f64 = self.direction.iter().zip(&self.gradient).map(|(d, g)| d[0] * g[0] + d[1] * g[1]).sum();
        -0.5 * slope
    }

    /// Takes held places out of the system.
    pub(super) fn hold(&mut self) {
        if let Some(held) = &self.held {
            self.symbolic.hold(&mut self.matrix, held);
        }
        self.hold_gradient();
    }

    fn hold_gradient(&mut self) {
        if let Some(held) = &self.held {
            for (g, held) in self.gradient.iter_mut().zip(held) {
                if *held {
                    *g = [0.0; 2];
                }
            }
        }
    }
}
