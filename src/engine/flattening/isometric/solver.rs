//! Newton's method for maps without flips, with a factor that is kept as long as it serves.
//!
//! Each round assembles a quadratic that stands for the energy, factorises it and steps:
//! - far from the least, one whose parabolas touch the energy from afar ([`Curvature::Secant`]), since Newton's method
//!   opens collapsed triangles by a third of their size a step;
//! - then the Hessian with negative eigenvalues set to nought, a share of which is given back step by step until it is
//!   the Hessian itself. The exact one converges fastest but need not be positive; where the factorisation finds that it
//!   is not, the triangles around lose all their negative eigenvalues, and only that part is factorised again.
//!
//! The same factor gives further steps from new gradients at a fraction of the price (Shamanskii 1967), corrected by what
//! the steps before it showed ([`super::memory`]); when these no longer pay, the next round begins.
//!
//! Stops when a step promises to lower the energy by less than [`TOLERANCE`] of it (or [`RESOLUTION`]), takes that step,
//! and is done: near the least the true error is then far below the promise, since Newton's steps square it.

use std::ops::Range;

use super::assembly::{Assembly, gradient_of};
use super::cholesky::{Factor, Matrix, Symbolic};
use super::constraints::Terms;
use super::energy::{Curvature, Energy};
use super::memory::Memory;
use super::search::search;
use super::shape::Shape;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// Part of the energy that a step must promise to be worth another one. The map's error is then about its root, 1e-4 of
/// the strain that is there anyhow.
const TOLERANCE: f64 = 1e-8;

/// The same for energies of sizes, whose least value is flat: more would not be seen in their means.
const ROBUST_TOLERANCE: f64 = 1e-3;

/// Mean energy below which nothing is asked: strains of 1e-11, the rounding of coordinates of a fine mesh.
pub(super) const RESOLUTION: f64 = 1e-22;

/// Most rounds. Surfaces that engineers flatten take one to three, heads that are closed but for the neck about twenty.
pub(super) const MAX_ROUNDS: usize = 200;

/// What a step with a kept factor costs beside a round with one.
const PRICE: f64 = 0.2;

/// Least rate (logarithm of the promise over price) at which steps with a kept factor go on.
const LEAST_RATE: f64 = 1.0;

/// Most steps with one factor.
const MAX_KEPT: usize = 12;

/// Mean energy from which a map counts as far from the least.
const FAR: f64 = 1.0;

/// Secants give way to the Hessian when a round lowers the energy by less than this part; the Hessian's clamped share
/// falls when a round lowers it by less than [`NEAR`].
const SLOW: f64 = 0.3;
/// The same for energies of sizes, which secants suit better.
const ROBUST_SLOW: f64 = 0.05;
const NEAR: f64 = 0.1;

/// How the clamped share falls, and the least before it is dropped.
const LOWERED: f64 = 0.3;
const LEAST_CLAMPED: f64 = 0.1;

/// Where less than this part of a step can be taken, the share rises again: the exact Hessian looks too far.
const SHORT: f64 = 0.6;

/// Where less than this part of a step can be taken in as many rounds in turn, ARAP, which does not keep triangles from
/// collapsing, is taken to be jammed by one. Once may be an energy that is far from its parabola.
const JAM: f64 = 0.1;
const JAMMED_ROUNDS: usize = 2;

/// Unknowns that may lack a positive pivot: moving and turning the whole costs no energy.
const RIGID: usize = 3;

pub(super) const PROJECTED: Curvature = Curvature::Newton { clamped: 1.0 };

/// How a map was found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Run {
    /// Area-weighted mean of the objective's energy; for `Balanced` the symmetric Dirichlet energy less 4. What pins and kept
    /// lengths ask for is not in it.
    pub energy: f64,
    /// Factorisations.
    pub rounds: usize,
    /// Steps with a factor that was there already.
    pub kept: usize,
    /// Whether the energy is the least within the tolerance. Else the map is valid, but a better one may exist.
    pub converged: bool,
}

/// All that steps need, allocated once.
pub(super) struct Solver<'a> {
    pub(super) shape: &'a Shape,
    pub(super) symbolic: &'a Symbolic<2>,
    pub(super) assembly: &'a Assembly,
    pub(super) observer: &'a dyn Observer,
    pub(super) matrix: Matrix<2>,
    pub(super) factor: Factor<2>,
    pub(super) gradient: Vec<[f64; 2]>,
    pub(super) direction: Vec<[f64; 2]>,
    /// What is asked beside the energy of the triangles.
    pub(super) terms: Terms,
    next: Vec<[f64; 2]>,
    done: Vec<bool>,
    last: Vec<[f64; 2]>,
    memory: Memory,
}

impl<'a> Solver<'a> {
    pub(super) fn new(
        shape: &'a Shape,
        symbolic: &'a Symbolic<2>,
        assembly: &'a Assembly,
        observer: &'a dyn Observer,
    ) -> Self {
        let room = vec![[0.0; 2]; symbolic.vertex_count()];
        Self {
            shape,
            symbolic,
            assembly,
            observer,
            matrix: symbolic.matrix(),
            factor: Factor::new(symbolic),
            gradient: room.clone(),
            direction: room.clone(),
            terms: Terms::default(),
            next: room.clone(),
            last: room,
            memory: Memory::default(),
            done: vec![false; shape.cells.len()],
        }
    }

    /// Lowers the energy of a map without flips as far as it goes, in at most `max_rounds`.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`].
    pub(super) fn minimise(
        &mut self,
        energy: Energy,
        flat: &mut Vec<[f64; 2]>,
        max_rounds: usize,
    ) -> Result<Run, EngineError> {
        self.minimise_to(energy, flat, max_rounds, tolerance(energy))
    }

    /// The same until a step promises less than a given part of the energy.
    pub(super) fn minimise_to(
        &mut self,
        energy: Energy,
        flat: &mut Vec<[f64; 2]>,
        max_rounds: usize,
        tolerance: f64,
    ) -> Result<Run, EngineError> {
        let mut run = Run { energy: self.shape.energy(energy, flat) + self.terms.energy(flat), ..Run::default() };
        let robust = energy.is_robust();
        let slow = if robust { ROBUST_SLOW } else { SLOW };
        let (mut before, mut last_step, mut jammed) = (f64::INFINITY, 1.0, 0);
        let mut promises = Vec::with_capacity(MAX_KEPT + 2);
        let mut curvature = if robust || run.energy > FAR { Curvature::Secant } else { PROJECTED };
        while run.rounds < max_rounds {
            self.observer.check()?;
            self.observer.progress(run.rounds as f64 / (run.rounds + 4) as f64);
            jammed = if last_step < JAM { jammed + 1 } else { 0 };
            if jammed == JAMMED_ROUNDS && energy == (Energy::Arap { barrier: 0.0 }) {
                return Ok(run);
            }
            let gain = (before - run.energy) / before;
            before = run.energy;
            curvature = match curvature {
                Curvature::Secant if gain < slow => PROJECTED,
                Curvature::Newton { clamped } if last_step < SHORT => {
                    Curvature::Newton { clamped: (clamped.max(LEAST_CLAMPED * LOWERED) / LOWERED).min(1.0) }
                }
                Curvature::Newton { clamped } if last_step == 1.0 && gain < NEAR => {
                    Curvature::Newton { clamped: if clamped > LEAST_CLAMPED { LOWERED * clamped } else { 0.0 } }
                }
                same => same,
            };
            self.factorise(energy, curvature, flat)?;
            run.rounds += 1;
            self.memory.clear();
            let mut promise = self.promise();
            promises.clear();
            promises.push(promise);
            for kept in 0..=MAX_KEPT {
                let enough = promise <= tolerance * run.energy + RESOLUTION;
                let at_start = (run.energy, -2.0 * promise);
                let Some((reached, step)) =
                    search((self.shape, &self.terms), energy, flat, &self.direction, at_start, &mut self.next)
                else {
                    // Nothing lower that rounding would show: the end, unless a fresh factor knows better.
                    if kept == 0 || enough {
                        run.converged = enough;
                        return Ok(run);
                    }
                    break;
                };
                std::mem::swap(flat, &mut self.next);
                run.energy = reached;
                if kept == 0 {
                    last_step = step;
                }
                run.kept += usize::from(kept > 0);
                if enough {
                    run.converged = true;
                    return Ok(run);
                }
                if step < 1.0 || kept == MAX_KEPT {
                    break;
                }
                self.observer.check()?;
                std::mem::swap(&mut self.gradient, &mut self.last);
                gradient_of(self.shape, energy, flat, &mut self.gradient);
                self.terms.add_gradient(flat, &mut self.gradient);
                self.memory.remember(step, &self.direction, &self.last, &self.gradient);
                let now = self.promise();
                promises.push(now);
                if !still_serves(&promises) && now > tolerance * run.energy + RESOLUTION {
                    break;
                }
                promise = now;
            }
        }
        Ok(run)
    }

    /// Assembles and factorises. Where the matrix turns out not to be positive, the triangles around lose all negative
    /// eigenvalues, those and no others.
    fn factorise(&mut self, energy: Energy, curvature: Curvature, flat: &[[f64; 2]]) -> Result<(), EngineError> {
        let Self { shape, symbolic, assembly, matrix, factor, gradient, done, terms, .. } = self;
        assembly.hessian(shape, (energy, curvature), flat, matrix, gradient);
        terms.add_gradient(flat, gradient);
        terms.add_hessian(flat, curvature, matrix);
        done.fill(false);
        let mut repair = |range: Range<u32>, matrix: &mut Matrix<2>| match curvature {
            Curvature::Newton { clamped } if clamped < 1.0 => {
                let edges = terms.clamp(flat, clamped, &range, matrix);
                assembly.clamp(shape, (energy, clamped), flat, (range, done), matrix) || edges
            }
            _ => false,
        };
        factor.factorise(symbolic, matrix, (RIGID, &mut repair), self.observer)
    }

    /// The step from the gradient and the factor that are there; gives half of what its slope promises.
    fn promise(&mut self) -> f64 {
        let Self { symbolic, factor, gradient, direction, memory, .. } = self;
        for (d, g) in direction.iter_mut().zip(&*gradient) {
            *d = g.map(|x| -x);
        }
        memory.apply(direction, |x| factor.solve(symbolic, x));
        let slope: f64 = self.direction.iter().zip(&self.gradient).map(|(d, g)| d[0] * g[0] + d[1] * g[1]).sum();
        -0.5 * slope
    }
}

/// Part of an energy that a step must promise to be worth another one.
pub(super) const fn tolerance(energy: Energy) -> f64 {
    if energy.is_robust() { ROBUST_TOLERANCE } else { TOLERANCE }
}

/// Whether the factor at hand is worth a further step: as long as the last two lowered the promise faster, for their
/// price, than the round as a whole (Charnov's marginal value), and fast enough.
fn still_serves(promises: &[f64]) -> bool {
    let [first, .., now] = promises else { return true };
    let steps = promises.len() - 1;
    let late = steps.min(2);
    let rate = |from: f64, price: f64| (from / now).ln() / price;
    let of_late = rate(promises[steps - late], PRICE * late as f64);
    of_late >= rate(*first, 1.0 + PRICE * steps as f64).max(LEAST_RATE)
}
