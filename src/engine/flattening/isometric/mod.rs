//! Flattening with the least distortion there is: a map of a disc (with or without holes) into the plane whose energy
//! over all triangles is least, without a flip.
//!
//! # Method
//! A start that has no flips ([`start`]), then Newton's method on the energy of the objective ([`energy`], [`solver`]),
//! with a sparse Cholesky factorisation made for it ([`cholesky`]) and a line search that cannot pass a flip
//! ([`search`]). Flips are judged by the exact predicate wherever rounding could decide. The energy never rises.
//!
//! The result depends on the mesh and its numbering alone; sums run in one order. Moving, turning or scaling the mesh by
//! a power of two changes nothing but rounding.
//!
//! # Units and limits
//! Positions and results are millimetres. Vertices of no triangle get no place (NaN). Far parts of the pattern may
//! overlap: that is not asked here. Pinned points and kept lengths: [`constraints`]. Memory is about 1.5 KB a vertex at a million triangles.

mod assembly;
mod cholesky;
mod constraints;
mod convex;
mod energy;
mod injective;
mod memory;
mod multilevel;
mod options;
mod search;
mod shape;
mod solver;
mod start;
#[cfg(test)]
mod tests;

use glam::DVec2;

pub use constraints::{Kept, KeptCurve, Pin};
pub use injective::{Injective, flatten_injectively};
pub use options::{IsometricOptions, Objective};
pub use solver::Run;

use self::assembly::Assembly;
use self::cholesky::{Graph, Symbolic};
use self::constraints::Point;
use self::energy::Energy;
use self::shape::Shape;
use self::solver::{MAX_ROUNDS, RESOLUTION, Solver};
use super::FlatteningError;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, MeshFault, Topology};

/// The symmetric Dirichlet energy.
const BALANCED: Energy = Energy::Weighted { area: 1.0, shape: 1.0 };

/// Rounds after which the ARAP energy, which does not keep triangles from collapsing, is taken to be jammed by them. Where
/// it is not, it needs one to seven.
const ARAP_ROUNDS: usize = 10;

/// What a step must promise, as part of the ARAP energy. Near its least this energy is flatter than the balanced one, and the
/// last steps come nearer by less than they promise.
const ARAP_TOLERANCE: f64 = 1e-10;

/// Parts of the symmetric Dirichlet energy that keep triangles open where ARAP alone jams, one after the other. A smaller
/// last one lowers the ARAP energy by less than a thousandth, and triangles come closer to collapsing.
const ARAP_BARRIERS: [f64; 3] = [1e-2, 1e-4, 1e-6];

/// What a step must promise there, as part of the energy. Less, and it takes longer to gain a few hundred-thousandths.
const JAMMED: f64 = 1e-3;

/// The same for the balanced map from which it starts.
const ROUGH: f64 = 1e-2;

/// Part of the symmetric Dirichlet energy that keeps triangles open beside energies of sizes. Smaller, and triangles get closer to collapsing before it is felt.
const BARRIER: f64 = 1e-3;

/// Changes count by their size rather than their square from this part of the balanced map's mean strain on. Smaller, and
/// the solver takes longer to no visible gain; larger, and a few triangles weigh as much as all others.
const SOFT: f64 = 0.5;

/// Where the balanced map's mean strain is below this, there is nothing to trade between area and shape.
const NO_STRAIN: f64 = 1e-7;

/// A map with the least distortion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Isometric {
    /// A place for each vertex of the mesh, millimetres.
    pub flat: Vec<DVec2>,
    /// How it was found.
    pub run: Run,
}

/// Flattens a mesh of one piece that is a disc, with holes or without.
///
/// # Errors
/// [`FlatteningError::SeveralPieces`], [`FlatteningError::NotADisc`], a [`MeshFault`] for a triangle that is a point or
/// has coordinates that are no numbers, [`FlatteningError::TooCurved`] when no map without flips can be written in
/// numbers of sixteen digits, [`EngineError::Parameter`] for weights, pins or kept borders that cannot
/// be used, [`FlatteningError::PinsNotMet`], [`EngineError::Cancelled`].
pub fn flatten(
    mesh: &Mesh,
    topology: &Topology,
    options: &IsometricOptions,
    observer: &dyn Observer,
) -> Result<Isometric, EngineError> {
    let weights = options
        .objective
        .weights()
        .map_err(|detail| EngineError::Parameter { name: "flattening.weights".to_owned(), detail })?;
    check_disc(topology)?;
    constraints::check(mesh, topology, options)?;
    let edges = (0..topology.edge_count() as u32).map(|e| topology.edge_vertices(e));
    let graph = Graph::of_edges(mesh.positions.len(), edges);
    let symbolic = Symbolic::<2>::new(&mesh.positions, &graph, observer)?;
    let shape = Shape::new(mesh, &symbolic.rank)?;
    let assembly = Assembly::new(&shape, &symbolic).ok_or_else(|| mismatch(topology))?;
    let mut solver = Solver::new(&shape, &symbolic, &assembly, observer);
    let start = start::start(&mut solver, mesh, topology)?;
    solver.terms.edges = constraints::edges((mesh, topology), (&shape, &symbolic), options);
    let points = constraints::points(mesh, (&shape, &symbolic), &options.pins).ok_or_else(|| mismatch(topology))?;
    let (mut flat, mut run, mut energy) = match (options.objective, weights) {
        (_, Some(weights)) => weighted(&mut solver, start, weights)?,
        (Objective::Arap, None) => arap(&mut solver, start)?,
        _ => {
            let mut flat = start;
            let run = solver.minimise(BALANCED, &mut flat, MAX_ROUNDS)?;
            (flat, run, BALANCED)
        }
    };
    if !options.pins.is_empty() {
        if let Some(weights) = weights
            && !constraints::are_met_rigidly(&points, &flat)
        {
            // Most of the strain may be the pins': what is small is known when they are met.
            run = solver.minimise(BALANCED, &mut flat, MAX_ROUNDS)?;
            pinned(&mut solver, points.clone(), BALANCED, &mut flat, &mut run)?;
            energy = sizes(&solver, &flat, weights);
        }
        pinned(&mut solver, points, energy, &mut flat, &mut run)?;
    }
    if !(options.pins.is_empty() && options.keep.is_empty()) {
        run.energy = shape.energy(energy, &flat);
    }
    Ok(Isometric { flat: shape.enlarged(&flat, &symbolic.rank, topology), run })
}

/// The map, how it was found, and the energy that was made least.
type Found = (Vec<[f64; 2]>, Run, Energy);

/// The map with its points at their targets. Where ARAP alone lets triangles collapse on the way, something keeps them
/// open.
fn pinned(
    solver: &mut Solver,
    points: Vec<Point>,
    energy: Energy,
    flat: &mut Vec<[f64; 2]>,
    run: &mut Run,
) -> Result<(), EngineError> {
    let bare = energy == Energy::Arap { barrier: 0.0 };
    let free = if bare { flat.clone() } else { Vec::new() };
    let met = constraints::meet(solver, points.clone(), energy, flat, run);
    match met {
        Ok(()) if bare && !run.converged => {
            *flat = free;
            constraints::meet(solver, points, Energy::Arap { barrier: ARAP_BARRIERS[2] }, flat, run)
        }
        Err(EngineError::Flattening(FlatteningError::PinsNotMet { .. })) if bare => {
            *flat = free;
            constraints::meet(solver, points, Energy::Arap { barrier: ARAP_BARRIERS[2] }, flat, run)
        }
        other => other,
    }
}

/// ARAP from the start; where triangles collapse on the way, from the balanced map, with something that keeps them open.
fn arap(solver: &mut Solver, start: Vec<[f64; 2]>) -> Result<Found, EngineError> {
    let mut flat = start.clone();
    let energy = Energy::Arap { barrier: 0.0 };
    let run = solver.minimise_to(energy, &mut flat, ARAP_ROUNDS, ARAP_TOLERANCE)?;
    if run.converged {
        return Ok((flat, run, energy));
    }
    let mut flat = start;
    let mut run = solver.minimise_to(BALANCED, &mut flat, MAX_ROUNDS, ROUGH)?;
    let mut energy = energy;
    for barrier in ARAP_BARRIERS {
        energy = Energy::Arap { barrier };
        run = solver.minimise_to(energy, &mut flat, MAX_ROUNDS, JAMMED)?;
    }
    Ok((flat, run, energy))
}

/// Mean sizes of changes, from the balanced map, whose mean strain says what is small.
fn weighted(solver: &mut Solver, start: Vec<[f64; 2]>, weights: [f64; 2]) -> Result<Found, EngineError> {
    let mut flat = start;
    let balanced = solver.minimise(BALANCED, &mut flat, MAX_ROUNDS)?;
    let energy = sizes(solver, &flat, weights);
    if energy == BALANCED {
        return Ok((flat, balanced, BALANCED));
    }
    let run = solver.minimise(energy, &mut flat, MAX_ROUNDS)?;
    Ok((flat, run, energy))
}

/// The energy of sizes around a balanced map, whose mean strain says what is small; of a map without strain its own.
fn sizes(solver: &Solver, flat: &[[f64; 2]], [area, shape]: [f64; 2]) -> Energy {
    // Near a rigid map the energy is four times the sum of both strains' squares.
    let strain = (solver.shape.energy(BALANCED, flat) / 8.0).sqrt();
    if strain < NO_STRAIN {
        return BALANCED;
    }
    Energy::Robust { area, shape, soft: SOFT * strain, barrier: BARRIER }
}

/// Whether the mesh is one disc, holes allowed. Every handle lowers the characteristic by two and every vertex where
/// fans only touch by one, so that no other mesh passes.
fn check_disc(topology: &Topology) -> Result<(), FlatteningError> {
    let total = topology.triangle_count();
    if topology.piece_count() != 1 {
        let unreached = topology.piece_of().iter().filter(|&&piece| piece != 0).count();
        return Err(FlatteningError::SeveralPieces { unreached: unreached as u32, total: total as u32 });
    }
    let (borders, characteristic) = (topology.border_count(), topology.euler_characteristic());
    if borders == 0 || characteristic != 2 - borders as i64 {
        return Err(FlatteningError::NotADisc { borders: borders as u32, characteristic });
    }
    Ok(())
}

/// The mesh has triangles that its topology does not know.
fn mismatch(topology: &Topology) -> EngineError {
    let vertices = topology.vertex_count() as u32;
    FlatteningError::from(MeshFault::VertexOutOfRange { triangle: 0, vertex: vertices, vertices }).into()
}

const _: () = assert!(RESOLUTION < NO_STRAIN * NO_STRAIN);
