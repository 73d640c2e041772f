//! A piece by the map of least distortion: exactly where it is developable, and without overlaps where that is asked for.

use glam::DVec2;

use super::{Laid, PieceJob};
use crate::engine::budget::{Observer, Stage};
use crate::engine::distortion::{self, DevelopableReport, InjectiveReport, SolverReport};
use crate::engine::error::EngineError;
use crate::engine::flattening::developable::{self, UNFOLDED_STRAIN};
use crate::engine::flattening::isometric::{self, Injective, IsometricOptions};
use crate::engine::mesh::{Mesh, Topology, measures};

impl PieceJob<'_> {
    /// The map of least distortion; of a piece without curvature the one without any.
    pub(super) fn isometric(&self, observer: &dyn Observer, laid: &mut Laid) -> Result<Vec<DVec2>, EngineError> {
        let mesh = &self.piece.mesh;
        observer.enter(Stage::Flattening);
        observer.check()?;
        let pins = self.constraints.pins(self.piece);
        if self.is_surface
            && let Some(unfolded) = developable::unfold(mesh, self.topology, UNFOLDED_STRAIN, observer)?
            && let Some(hold) = pins.hold_exactly(mesh, &unfolded.flat)
        {
            laid.holds[self.number] = hold;
            let free = Free { flat: unfolded.flat, energy: 0.0 };
            return match self.without_overlaps(free, observer, laid)? {
                Continued::Not(flat) => {
                    let strain =
                        laid.developable.as_ref().map_or(unfolded.strain, |all| all.strain.max(unfolded.strain));
                    laid.developable = Some(DevelopableReport { kind: "mesh".to_owned(), strain });
                    laid.flattened += mesh.triangles.len() as u64;
                    Ok(flat)
                }
                Continued::Yes(found) => {
                    Ok(self.solved(found.flat, (found.rounds, found.energy_after), found.converged, laid))
                }
            };
        }
        let objective = self.options.flattening.objective();
        let outline = if self.constraints.asks_for_outline(self.topology) {
            let free = IsometricOptions { objective, ..IsometricOptions::default() };
            outline_of(self.topology, &isometric::flatten(mesh, self.topology, &free, observer)?.flat)
        } else {
            0
        };
        let topologies = (self.whole, self.topology);
        let keep = self.constraints.lengths((self.number, self.piece), topologies, outline);
        let asked = IsometricOptions { objective, pins: pins.to_solve(), keep };
        let found = isometric::flatten(mesh, self.topology, &asked, observer).map_err(|e| pins.whole(mesh, e))?;
        laid.holds[self.number] = pins.solved(mesh, &found.flat);
        let (rounds, energy, converged) = (found.run.rounds, found.run.energy, found.run.converged);
        match self.without_overlaps(Free { flat: found.flat, energy }, observer, laid)? {
            Continued::Not(flat) => Ok(self.solved(flat, (rounds, energy), converged, laid)),
            Continued::Yes(found) => {
                let rounds = rounds + found.rounds;
                Ok(self.solved(found.flat, (rounds, found.energy_after), found.converged, laid))
            }
        }
    }

    /// Notes how a map was found, and gives it back.
    fn solved(&self, flat: Vec<DVec2>, (rounds, energy): (usize, f64), converged: bool, laid: &mut Laid) -> Vec<DVec2> {
        let mesh = &self.piece.mesh;
        laid.flattened += mesh.triangles.len() as u64;
        let area = measures::total_area(mesh);
        let (all, before) =
            laid.solver.get_or_insert((SolverReport { converged: true, ..SolverReport::default() }, 0.0));
        all.rounds += rounds as u64;
        all.converged &= converged;
        all.energy = (all.energy * *before + energy * area) / (*before + area);
        *before += area;
        flat
    }

    /// The map as it is, or, where that is asked for and it lies on itself, one that does not.
    fn without_overlaps(&self, free: Free, observer: &dyn Observer, laid: &mut Laid) -> Result<Continued, EngineError> {
        if !self.options.flattening.injective() {
            return Ok(Continued::Not(free.flat));
        }
        let mesh = &self.piece.mesh;
        let part: Option<Vec<bool>> =
            self.part.map(|part| self.piece.triangle_of.iter().map(|&t| part.get(t as usize) == Some(&true)).collect());
        let asked = IsometricOptions { objective: self.options.flattening.objective(), ..IsometricOptions::default() };
        let mut failed = false;
        let found = if lies_on_itself((mesh, self.topology), part.as_deref(), &free.flat, observer)? {
            let found = isometric::flatten_injectively(mesh, self.topology, &asked, &free.flat, observer)?;
            let still = match &found {
                Some(found) => lies_on_itself((mesh, self.topology), part.as_deref(), &found.flat, observer)?,
                None => true,
            };
            if still {
                laid.warnings.push("no map was found that does not lie on itself: divide the part".to_owned());
            }
            failed = still;
            found.filter(|_| !still)
        } else {
            None
        };
        let area = measures::total_area(mesh);
        let (all, before) =
            laid.injective.get_or_insert((InjectiveReport { converged: true, ..InjectiveReport::default() }, 0.0));
        let mean = |all: f64, own: f64| (all * *before + own * area) / (*before + area);
        let own = found.as_ref().map_or([free.energy; 2], |found| [found.energy_before, found.energy_after]);
        all.energy_before = mean(all.energy_before, own[0]);
        all.energy_after = mean(all.energy_after, own[1]);
        *before += area;
        Ok(if let Some(found) = found {
            all.continued = true;
            all.rounds += found.rounds as u64;
            all.converged &= found.converged;
            Continued::Yes(Box::new(found))
        } else {
            all.converged &= !failed;
            Continued::Not(free.flat)
        })
    }
}

/// A map that may lie on itself.
struct Free {
    flat: Vec<DVec2>,
    energy: f64,
}

/// What became of it.
enum Continued {
    Not(Vec<DVec2>),
    Yes(Box<Injective>),
}

/// Whether the part of a flat mesh (all of it where none is named) lies on itself anywhere.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub(in crate::engine::pipeline) fn lies_on_itself(
    (mesh, topology): (&Mesh, &Topology),
    part: Option<&[bool]>,
    flat: &[DVec2],
    observer: &dyn Observer,
) -> Result<bool, EngineError> {
    let own = part.and_then(|part| {
        let triangles: Vec<[u32; 3]> =
            mesh.triangles.iter().zip(part).filter(|(_, belongs)| **belongs).map(|(t, _)| *t).collect();
        Topology::of_triangles(&triangles, mesh.positions.len()).ok()
    });
    let found = distortion::overlaps(flat, own.as_ref().unwrap_or(topology), observer)?;
    Ok(!(found.complete && found.regions.is_empty()))
}

/// The border that encloses the largest area in the plane, the first of equals.
fn outline_of(topology: &Topology, flat: &[DVec2]) -> usize {
    let area = |border: &[u32]| {
        let origin = border.first().map_or(DVec2::ZERO, |&h| flat[topology.origin(h) as usize]);
        let at = |v: u32| flat[v as usize] - origin;
        border.iter().map(|&h| at(topology.origin(h)).perp_dot(at(topology.target(h)))).sum::<f64>().abs()
    };
    let areas = topology.borders().map(area).enumerate();
    areas.fold((0, f64::NEG_INFINITY), |best, (k, area)| if area > best.1 { (k, area) } else { best }).0
}
