//! Part and scaffold as one mesh: a few of Newton's steps on the sum of their energies, with the frame held.
//!
//! The part's energy is that of the objective; the scaffold's is the symmetric Dirichlet energy over its shape at rest,
//! times a small weight; of scaffold triangles between stretches of the border, without vertices of their own, only the
//! change of area counts, so that stretches slide past each other freely. None can turn over, so the part can neither
//! flip nor overlap.
//!
//! At rest scaffold triangles are as they lie, but those between stretches of the border are at least [`GAP`] high (or as
//! high as the distance of the two in the map that may overlap, where that is less: what is close by nature stays so).
//! They push back, and the border ends a little before it touches itself.

use glam::{DVec2, DVec3};

use super::scaffold::{Scaffold, distance_to_segment};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::flattening::isometric::BALANCED;
use crate::engine::flattening::isometric::assembly::{Assembly, add_gradient_of, gradient_of};
use crate::engine::flattening::isometric::cholesky::{Factor, Graph, Matrix, Symbolic};
use crate::engine::flattening::isometric::energy::{Curvature, Energy};
use crate::engine::flattening::isometric::memory::Memory;
use crate::engine::flattening::isometric::search::first_flip;
use crate::engine::flattening::isometric::shape::{Cell, Shape, cell};
use crate::engine::flattening::isometric::solver::PROJECTED;
use crate::engine::mesh::{Mesh, Topology, measures};

/// Height at rest of scaffold triangles between stretches of the border, in roots of the part's area. The pattern ends with
/// gaps of a small part of it. Larger costs distortion, smaller costs rounds.
const GAP: f64 = 2e-2;

/// The scaffold between stretches of the border: sliding is free.
const SLIDING: Energy = Energy::Weighted { area: 1.0, shape: 0.0 };

/// What counts of the scaffold, and of what of it lies between stretches of the border.
const AROUND: [Energy; 2] = [BALANCED, SLIDING];

/// The least such height.
const LEAST_GAP: f64 = 1e-5;

/// Steps with one factor.
const MOST_KEPT: usize = 6;

/// Where less than this part of a step can be taken, the scaffold is in the way.
const SHORT: f64 = 0.5;

/// Mean energy above which the part's parabolas touch its energy from afar.
const FAR: f64 = 1.0;

/// Share of the way to the first flip that is gone at the most.
const BEFORE_FLIP: f64 = 0.8;

/// Part of the decrease that the slope promises which must come (Armijo).
const SUFFICIENT: f64 = 1e-4;

/// Most halvings of a step.
const HALVINGS: usize = 30;

/// Part and scaffold, ready for steps. All numbers are the factorisation's.
pub(super) struct System<'a> {
    symbolic: Symbolic<2>,
    /// The part, the scaffold, and what of it lies between stretches of the border.
    terms: [(Shape, Assembly); 3],
    held: Vec<usize>,
    matrix: Matrix<2>,
    factor: Factor<2>,
    observer: &'a dyn Observer,
    flat: Vec<[f64; 2]>,
    memory: Memory,
    /// Vertices of the mesh: those after them are the scaffold's.
    count: usize,
}

/// What the steps came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lowered {
    /// Mean energy of the part.
    pub(super) energy: f64,
    /// Factorisations.
    pub(super) rounds: usize,
    /// Greatest part of a whole step that could be taken.
    pub(super) step: f64,
}

impl<'a> System<'a> {
    /// Of a mesh at `flat` (in [`Shape`]'s unit) with its scaffold there, where `free` is the map that may overlap, in the
    /// same unit. `None` when the structure does not hold the mesh.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`], and what is wrong with the mesh's shape.
    pub(super) fn new(
        (mesh, topology): (&Mesh, &Topology),
        flat: &[[f64; 2]],
        free: &[DVec2],
        scaffold: &Scaffold,
        observer: &'a dyn Observer,
    ) -> Result<Option<Self>, EngineError> {
        let count = flat.len();
        let all: Vec<[f64; 2]> = flat.iter().chain(&scaffold.places).copied().collect();
        let places: Vec<DVec3> = all.iter().map(|&[x, y]| DVec3::new(x, y, 0.0)).collect();
        let edges =
            (0..topology.edge_count() as u32).map(|e| topology.edge_vertices(e)).chain(scaffold.edges.iter().copied());
        let graph = Graph::of_edges(all.len(), edges);
        let symbolic = Symbolic::<2>::new(&places, &graph, observer)?;
        let part = Shape::new(mesh, &symbolic.rank)?;
        let total = measures::total_area(mesh) / (part.unit * part.unit);
        let empty = || Shape { cells: Vec::with_capacity(scaffold.triangles.len()), unit: 1.0, masses: Vec::new() };
        let (mut air, mut between) = (empty(), empty());
        for t in &scaffold.triangles {
            let lies = t.map(|v| DVec2::from_array(all[v as usize]));
            let corners = t.map(|v| symbolic.rank[v as usize]);
            let solid = |rest: [DVec2; 3]| cell(rest.map(|p| p.extend(0.0)), corners, total);
            if t.iter().all(|&v| (v as usize) < count) {
                between.cells.extend(solid(at_rest(lies, t.map(|v| free[v as usize]), total.sqrt())));
            } else {
                air.cells.extend(solid(lies));
            }
        }
        let mut terms = Vec::with_capacity(3);
        for mut shape in [part, air, between] {
            shape.cells.sort_by_key(|cell| cell.corners.iter().copied().min());
            let Some(assembly) = Assembly::new(&shape, &symbolic) else { return Ok(None) };
            terms.push((shape, assembly));
        }
        let Ok(terms) = terms.try_into() else { return Ok(None) };
        let held = (count + scaffold.frame..all.len()).map(|v| symbolic.rank[v] as usize).collect();
        let flat = symbolic.order.iter().map(|&v| all[v as usize]).collect();
        let (matrix, factor) = (symbolic.matrix(), Factor::new(&symbolic));
        let memory = Memory::default();
        Ok(Some(Self { symbolic, terms, held, matrix, factor, observer, flat, memory, count }))
    }

    /// The part's mean energy.
    pub(super) fn energy(&self, energy: Energy) -> f64 {
        self.terms[0].0.energy(energy, &self.flat)
    }

    /// The places of the mesh's vertices.
    pub(super) fn flat(&self) -> Vec<[f64; 2]> {
        self.symbolic.rank[..self.count].iter().map(|&r| self.flat[r as usize]).collect()
    }

    /// Sets what the scaffold weighs for its area, where the part weighs one.
    pub(super) fn weigh(&mut self, weight: f64) {
        for cell in self.terms[1..].iter_mut().flat_map(|(shape, _)| &mut shape.cells) {
            cell.weight *= weight;
        }
    }

    /// Lowers the sum of both energies in at most `rounds` factorisations; stops early where the scaffold is in the way.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`].
    pub(super) fn lower(&mut self, energy: Energy, rounds: usize) -> Result<Lowered, EngineError> {
        let room = vec![[0.0; 2]; self.flat.len()];
        let (mut gradient, mut last, mut direction, mut next) = (room.clone(), room.clone(), room.clone(), room);
        let mut value = self.value(energy, &self.flat);
        let mut lowered = Lowered { energy: self.energy(energy), rounds: 0, step: 0.0 };
        // A sliver that rounding has turned over: any step would pass for a fall.
        if !value.is_finite() {
            return Ok(Lowered { energy: f64::INFINITY, ..lowered });
        }
        while lowered.rounds < rounds {
            self.observer.check()?;
            let far = energy.is_robust() || lowered.energy > FAR;
            let curvature = if far { Curvature::Secant } else { PROJECTED };
            let [(part, of_part), others @ ..] = &self.terms;
            of_part.hessian(part, (energy, curvature), &self.flat, &mut self.matrix, &mut gradient);
            for ((shape, assembly), energy) in others.iter().zip(AROUND) {
                let form = |cell: &Cell| energy.derivatives(&cell.jet(&self.flat), PROJECTED);
                assembly.add_quadratic(shape, form, &mut self.matrix, &mut gradient);
            }
            self.symbolic.hold(&mut self.matrix, &self.held);
            self.hold(&mut gradient);
            self.factor.factorise(&self.symbolic, &mut self.matrix, (0, &mut |_, _| false), self.observer)?;
            lowered.rounds += 1;
            self.memory.clear();
            let mut first_step = 0.0;
            for kept in 0..=MOST_KEPT {
                let promise = self.promise(&gradient, &mut direction);
                let Some((reached, step)) = self.search(energy, (value, -2.0 * promise), &direction, &mut next) else {
                    break;
                };
                std::mem::swap(&mut self.flat, &mut next);
                value = reached;
                lowered.step = lowered.step.max(step);
                if kept == 0 {
                    first_step = step;
                }
                if step < 1.0 {
                    break;
                }
                self.observer.check()?;
                std::mem::swap(&mut gradient, &mut last);
                gradient_of(&self.terms[0].0, energy, &self.flat, &mut gradient);
                for ((shape, _), energy) in self.terms[1..].iter().zip(AROUND) {
                    add_gradient_of(shape, energy, &self.flat, &mut gradient);
                }
                self.hold(&mut gradient);
                self.memory.remember(step, &direction, &last, &gradient);
            }
            lowered.energy = self.energy(energy);
            if first_step < SHORT {
                break;
            }
        }
        Ok(lowered)
    }

    fn value(&self, energy: Energy, flat: &[[f64; 2]]) -> f64 {
        self.terms
            .iter()
            .zip([energy, AROUND[0], AROUND[1]])
            .map(|((shape, _), energy)| shape.energy(energy, flat))
            .sum()
    }

    fn hold(&self, gradient: &mut [[f64; 2]]) {
        for &v in &self.held {
            gradient[v] = [0.0; 2];
        }
    }

    /// The step from the gradient; gives half of what its slope promises.
    fn promise(&mut self, gradient: &[[f64; 2]], direction: &mut [[f64; 2]]) -> f64 {
        let Self { symbolic, factor, memory, .. } = self;
        for (d, g) in direction.iter_mut().zip(gradient) {
            *d = g.map(|x| -x);
        }
        memory.apply(direction, |x| factor.solve(symbolic, x));
        -0.5 * direction.iter().zip(gradient).map(|(d, g)| d[0] * g[0] + d[1] * g[1]).sum::<f64>()
    }

    /// How far to go along a direction: never past a flip, never up.
    fn search(
        &self,
        energy: Energy,
        (at_start, slope): (f64, f64),
        direction: &[[f64; 2]],
        to: &mut [[f64; 2]],
    ) -> Option<(f64, f64)> {
        let flips = self.terms.iter().map(|(shape, _)| first_flip(shape, &self.flat, direction));
        let mut step = flips.map(|flip| BEFORE_FLIP * flip).fold(1.0, f64::min);
        for _ in 0..HALVINGS {
            for ((to, from), d) in to.iter_mut().zip(&self.flat).zip(direction) {
                *to = [from[0] + step * d[0], from[1] + step * d[1]];
            }
            let value = self.value(energy, to);
            if value <= at_start + SUFFICIENT * step * slope {
                return Some((value, step));
            }
            let least = -0.5 * slope * step * step / (value - at_start - slope * step);
            step = if value < f64::INFINITY { least.clamp(0.1 * step, 0.5 * step) } else { 0.5 * step };
        }
        None
    }
}

/// A scaffold triangle at rest, where `free` are its corners in the map that may overlap.
fn at_rest(corners: [DVec2; 3], free: [DVec2; 3], size: f64) -> [DVec2; 3] {
    let squared = [0, 1, 2].map(|k: usize| corners[(k + 1) % 3].distance_squared(corners[k]));
    let first = (0..3).fold(0, |best, k| if squared[k] > squared[best] { k } else { best });
    let [a, b, c] = [first, (first + 1) % 3, (first + 2) % 3];
    let natural = distance_to_segment(free[c], [free[a], free[b]]);
    let least = natural.clamp(LEAST_GAP * size, GAP * size);
    let base = corners[b] - corners[a];
    let up = base.perp() / base.length();
    let height = (corners[c] - corners[a]).dot(up);
    let mut rest = corners;
    if height < least {
        rest[c] += up * (least - height);
    }
    rest
}
