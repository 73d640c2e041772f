//! A start for large meshes: the map of a coarse mesh of the same disc, carried over level by level.
//!
//! The energy of a coarse mesh is least near where that of the fine one is, at a fraction of the price; what differs is
//! of short waves, which [`refine`] takes away vertex by vertex, so that few of the dear steps on the fine mesh remain.
//! No level has a flip. Where something fails (a mesh that cannot be coarsened, rounding), and where the surface is so
//! nearly developable that the conformal map does as well, there is no such start.

mod coarsen;
mod refine;
#[cfg(test)]
mod tests;

use self::coarsen::{Coarsening, coarsen};
use self::refine::{Incidence, put_back, sweep};
use super::assembly::Assembly;
use super::cholesky::{Graph, Symbolic};
use super::shape::Shape;
use super::solver::{MAX_ROUNDS, Solver};
use super::{BALANCED, start};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, Topology};

/// Meshes of fewer vertices are solved as they are: the detour would take longer.
pub(super) const LEAST_LARGE: usize = 8_000;

/// Vertices of the coarsest mesh, and how many times fewer each level has than the one before.
const COARSEST: usize = 2000;
const STEP: usize = 4;

/// What a step of a level between must promise, as part of the energy: the next level differs by more.
const LEVEL_TOLERANCE: f64 = 1e-3;

/// Sweeps over all vertices of a level before its first step.
const SWEEPS: usize = 4;

/// A map without flips in the mesh's numbering (millimetres), near the least symmetric Dirichlet energy.
///
/// # Errors
/// [`EngineError::Cancelled`].
pub(super) fn carry_over(
    mesh: &Mesh,
    topology: &Topology,
    observer: &dyn Observer,
) -> Result<Option<Vec<[f64; 2]>>, EngineError> {
    let coarsening = coarsen(mesh, topology, (COARSEST, STEP), observer)?;
    let mut flat = vec![[f64::NAN; 2]; mesh.positions.len()];
    for (number, level) in coarsening.levels.iter().enumerate().rev() {
        let coarsest = number + 1 == coarsening.levels.len();
        if !coarsest && !return_to(mesh, &coarsening, number + 1, &mut flat) {
            return Ok(None);
        }
        if !solve_level(mesh, &level.triangles, coarsest, &mut flat, observer)? {
            return Ok(None);
        }
    }
    let found = !coarsening.levels.is_empty() && return_to(mesh, &coarsening, 0, &mut flat);
    Ok(found.then_some(flat))
}

/// Puts back what lies between the level at hand and the one before.
fn return_to(mesh: &Mesh, coarsening: &Coarsening, number: usize, flat: &mut [[f64; 2]]) -> bool {
    let range = if number == 0 {
        [0, coarsening.levels[0].removals]
    } else {
        [coarsening.levels[number - 1].removals, coarsening.levels[number].removals]
    };
    put_back(&mesh.positions, coarsening, range, flat)
}

/// Lowers the energy of one level's map; false when that level has no map, or needs none.
fn solve_level(
    mesh: &Mesh,
    triangles: &[[u32; 3]],
    coarsest: bool,
    flat: &mut [[f64; 2]],
    observer: &dyn Observer,
) -> Result<bool, EngineError> {
    // The level as a mesh of its own.
    let mut number = vec![u32::MAX; mesh.positions.len()];
    for &v in triangles.as_flattened() {
        number[v as usize] = 0;
    }
    let kept: Vec<u32> = (0..mesh.positions.len() as u32).filter(|&v| number[v as usize] == 0).collect();
    for (new, &old) in kept.iter().enumerate() {
        number[old as usize] = new as u32;
    }
    let part = Mesh {
        positions: kept.iter().map(|&v| mesh.positions[v as usize]).collect(),
        uv: None,
        triangles: triangles.iter().map(|t| t.map(|v| number[v as usize])).collect(),
    };
    let Ok(topology) = Topology::new(&part) else { return Ok(false) };
    let edges = (0..topology.edge_count() as u32).map(|e| topology.edge_vertices(e));
    let graph = Graph::of_edges(part.positions.len(), edges);
    let symbolic = Symbolic::<2>::new(&part.positions, &graph, observer)?;
    let Ok(shape) = Shape::new(&part, &symbolic.rank) else { return Ok(false) };
    let Some(assembly) = Assembly::new(&shape, &symbolic) else { return Ok(false) };
    let mut solver = Solver::new(&shape, &symbolic, &assembly, observer);
    let mut own = if coarsest {
        match start::start(&mut solver, &part, &topology) {
            // Nearly developable: the conformal map of the whole mesh costs less than all levels.
            Ok(own) if shape.energy(BALANCED, &own) < start::FAR_OFF => return Ok(false),
            Ok(own) => own,
            Err(EngineError::Cancelled) => return Err(EngineError::Cancelled),
            Err(_) => return Ok(false),
        }
    } else {
        symbolic.order.iter().map(|&v| flat[kept[v as usize] as usize].map(|x| x / shape.unit)).collect()
    };
    if !coarsest {
        smooth(&shape, &mut own);
    }
    if shape.energy(BALANCED, &own) == f64::INFINITY {
        return Ok(false);
    }
    solver.minimise_to(BALANCED, &mut own, MAX_ROUNDS, LEVEL_TOLERANCE)?;
    for (place, &v) in own.iter().zip(&symbolic.order) {
        flat[kept[v as usize] as usize] = place.map(|x| x * shape.unit);
    }
    Ok(true)
}

/// Takes short waves out of a map.
pub(super) fn smooth(shape: &Shape, flat: &mut [[f64; 2]]) {
    let incident = Incidence::new(&shape.cells, flat.len());
    for _ in 0..SWEEPS {
        sweep(&shape.cells, &incident, flat);
    }
}
