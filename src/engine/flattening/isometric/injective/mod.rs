//! A map without flips and without overlaps: the scaffold of Jiang, Schaefer and Panozzo 2017 (Simplicial Complex
//! Augmentation Framework for Bijective Maps).
//!
//! # Method
//! Starts from a map that is injective: the convex one ([`super::convex`]). The part is surrounded by a [`mod@scaffold`] within
//! a frame, and the energy of both is lowered for a few steps ([`system`]); then the scaffold is made anew around the part
//! as it now lies, until the part's energy falls no further. No triangle of part and scaffold turns over within a convex
//! frame, so the map is injective at every time; the exact predicate judges that.
//!
//! # Units and limits
//! Millimetres. The energy is that of a local least: which stretch of a part ends on which side of another is settled by
//! the way there. The number of scaffolds is bounded; memory is in proportion to the mesh.

mod scaffold;
mod spiral;
mod system;
#[cfg(test)]
mod tests;

use glam::DVec2;

use self::scaffold::scaffold;
use self::spiral::spirals;
use self::system::System;
use super::convex::convex;
use super::energy::Energy;
use super::shape::Shape;
use super::start::scale;
use super::{BALANCED, BARRIER, IsometricOptions, NO_STRAIN, Objective, SOFT};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, Topology};

/// Factorisations with one scaffold.
const ROUNDS: usize = 3;

/// Points of the scaffold are no closer to each other than this, in roots of the part's area. Closer, and they are in the
/// border's way, which can move by about this much a step; farther apart, and the border is held by too long triangles.
const SPACING: f64 = 0.1;

/// The least that the scaffold weighs for its area.
const LEAST_WEIGHT: f64 = 1e-9;

/// How well a map is to be known, and with how heavy a scaffold.
#[derive(Debug, Clone, Copy)]
struct Stage {
    /// What the scaffold weighs for its area, as part of the part's mean energy. More, and it is felt; less, and the border
    /// runs into itself at once, and steps are short.
    weight: f64,
    /// Done when the energy changes by less than this part of it [`IDLE`] times in turn.
    tolerance: f64,
    /// Scaffolds, at most.
    scaffolds: usize,
}

/// To find out which start is the best, to come near, and to the end.
const ROUGH: Stage = Stage { weight: 1e-2, tolerance: 1e-2, scaffolds: 25 };
const NEAR: Stage = Stage { weight: 1e-2, tolerance: 1e-3, scaffolds: 200 };
const FINE: Stage = Stage { weight: 1e-3, tolerance: 1e-4, scaffolds: 100 };

const IDLE: usize = 3;

/// Part of the symmetric Dirichlet energy that keeps triangles open for ARAP: pressed borders collapse them sooner than
/// curvature does.
const ARAP_BARRIER: f64 = 1e-4;

/// A map without overlaps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Injective {
    /// A place for each vertex of the mesh, millimetres.
    pub flat: Vec<DVec2>,
    /// Factorisations.
    pub rounds: usize,
    /// Area-weighted mean of the objective's energy of the map that may overlap.
    pub energy_before: f64,
    /// The same of this map.
    pub energy_after: f64,
    /// Whether the energy fell no further. Else the map is injective, but a better one may exist.
    pub converged: bool,
}

/// Flattens a mesh of one piece that is a disc, with holes or without, so that it lies on itself nowhere. `free` is its map
/// of least distortion, which may. `None` when rounding leaves no injective map to start from.
///
/// # Errors
/// As [`super::flatten`].
pub fn flatten_injectively(
    mesh: &Mesh,
    topology: &Topology,
    options: &IsometricOptions,
    free: &[DVec2],
    observer: &dyn Observer,
) -> Result<Option<Injective>, EngineError> {
    let weights = options
        .objective
        .weights()
        .map_err(|detail| EngineError::Parameter { name: "flattening.weights".to_owned(), detail })?;
    super::check_disc(topology)?;
    let same: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let shape = Shape::new(mesh, &same)?;
    let free: Vec<DVec2> = free.iter().map(|&p| p / shape.unit).collect();
    let borders = topology.borders().map(|b| b.iter().map(|&h| topology.origin(h)).collect()).collect();
    let mut way = Way { mesh, topology, borders, shape, free, flat: Vec::new(), rounds: 0, converged: false, observer };
    let mut best = way.best_of(spirals((&way.shape, topology), &way.free, observer)?)?;
    if best.is_none() {
        let mut round = convex(mesh, topology, observer)?;
        if scale(&way.shape, &mut round) && way.shape.energy(BALANCED, &round) < f64::INFINITY {
            best = way.best_of(vec![round])?;
        }
    }
    let Some(flat) = best else { return Ok(None) };
    way.flat = flat;
    way.lower(BALANCED, NEAR)?;
    way.lower(BALANCED, FINE)?;
    let energy = way.shape.energy(BALANCED, &way.flat);
    let strain = (energy / 8.0).sqrt();
    let goal = match (options.objective, weights) {
        (_, Some([area, shape])) if strain >= NO_STRAIN => {
            Energy::Robust { area, shape, soft: SOFT * strain, barrier: BARRIER }
        }
        (Objective::Arap, None) => Energy::Arap { barrier: ARAP_BARRIER },
        _ => BALANCED,
    };
    if goal != BALANCED {
        way.lower(goal, FINE)?;
    }
    let before: Vec<[f64; 2]> = way.free.iter().map(DVec2::to_array).collect();
    Ok(Some(Injective {
        flat: way.shape.enlarged(&way.flat, &same, topology),
        rounds: way.rounds,
        energy_before: way.shape.energy(goal, &before),
        energy_after: way.shape.energy(goal, &way.flat),
        converged: way.converged,
    }))
}

/// A map on its way.
struct Way<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    borders: Vec<Vec<u32>>,
    shape: Shape,
    /// The map that may overlap, in the shape's unit.
    free: Vec<DVec2>,
    /// The map, in the shape's unit.
    flat: Vec<[f64; 2]>,
    rounds: usize,
    converged: bool,
    observer: &'a dyn Observer,
}

impl Way<'_> {
    /// What the start with the least energy comes to, roughly. `None` when there is a scaffold around none of them.
    fn best_of(&mut self, starts: Vec<Vec<[f64; 2]>>) -> Result<Option<Vec<[f64; 2]>>, EngineError> {
        let mut best: Option<(f64, Vec<[f64; 2]>)> = None;
        for start in starts {
            self.flat = start;
            if self.lower(BALANCED, ROUGH)? {
                let energy = self.shape.energy(BALANCED, &self.flat);
                if best.as_ref().is_none_or(|(least, _)| energy < *least) {
                    best = Some((energy, self.flat.clone()));
                }
            }
        }
        Ok(best.map(|(_, flat)| flat))
    }

    /// Lowers an energy of the part as far as it goes; false when not even a first scaffold could be made. Where a later one
    /// cannot, because rounding lets borders touch, the last map that had one stands.
    fn lower(&mut self, energy: Energy, stage: Stage) -> Result<bool, EngineError> {
        let (mut before, mut idle) = (f64::INFINITY, 0);
        let mut sound: Option<Vec<[f64; 2]>> = None;
        self.converged = false;
        for made in 0..stage.scaffolds {
            self.observer.check()?;
            self.observer.progress(made as f64 / (made + 10) as f64);
            let sheet = (self.mesh, self.topology);
            let system = match scaffold(&self.flat, &self.borders, SPACING) {
                Some(scaffold) => System::new(sheet, &self.flat, &self.free, &scaffold, self.observer)?,
                None => None,
            };
            let lowered = match system {
                Some(mut system) => {
                    system.weigh((stage.weight * system.energy(BALANCED)).max(LEAST_WEIGHT));
                    Some((system.lower(energy, ROUNDS)?, system.flat()))
                        .filter(|(lowered, _)| lowered.energy.is_finite())
                }
                None => None,
            };
            let Some((lowered, flat)) = lowered else {
                let found = sound.is_some();
                self.flat = sound.unwrap_or_default();
                return Ok(found);
            };
            sound = Some(std::mem::replace(&mut self.flat, flat));
            self.rounds += lowered.rounds;
            idle = if (before - lowered.energy).abs() < stage.tolerance * lowered.energy { idle + 1 } else { 0 };
            before = lowered.energy;
            if idle == IDLE || lowered.energy < NO_STRAIN * NO_STRAIN {
                self.converged = true;
                break;
            }
        }
        Ok(true)
    }
}
