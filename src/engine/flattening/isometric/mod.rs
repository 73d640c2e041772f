//! Flattening with the least distortion that there is.

mod assembly;
pub(crate) mod cholesky;
mod energy;
mod options;
mod search;
mod shape;
pub mod solver;
mod start;

use glam::DVec2;

pub use options::{IsometricOptions, Objective, Pin};

use self::assembly::Assembly;
use self::cholesky::{Graph, Symbolic};
use self::shape::{Shape, enlarged};
use self::solver::{MAX_ROUNDS, Run, Solver};
use super::FlatteningError;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, Topology};

/// Mean energy of the conformal start above which the convex one is tried as well.
const FAR_OFF: f64 = 1.0;

/// A map with the least distortion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Isometric {
    /// A place for each vertex, millimetres.
    pub flat: Vec<DVec2>,
    /// How it came about.
    pub run: solver::Run,
}

/// Flattens one piece.
pub fn flatten(
    mesh: &Mesh,
    topology: &Topology,
    options: &IsometricOptions,
    observer: &dyn Observer,
) -> Result<Isometric, EngineError> {
    let energy = options.objective.energy().ok_or(FlatteningError::SeedNotFound)?;
    let fail = || EngineError::from(FlatteningError::SeedNotFound);
    if topology.border_count() == 0 || topology.piece_count() != 1 || topology.euler_characteristic() != 2 - topology.border_count() as i64 {
        return Err(fail());
    }
    let graph = Graph::of_edges(mesh.positions.len(), (0..topology.edge_count() as u32).map(|e| topology.edge_vertices(e)));
    let symbolic = Symbolic::<2>::new(&mesh.positions, &graph);
    let shape = Shape::new(mesh, &symbolic.rank).ok_or_else(fail)?;
    let assembly = Assembly::new(&shape, &symbolic).ok_or_else(fail)?;
    let mut solver = Solver::new(&shape, &symbolic, &assembly);
    let mut flat = vec![[0.0; 2]; mesh.positions.len()];
    // Start.
    let places: Vec<glam::DVec3> = symbolic.order.iter().map(|&v| mesh.positions[v as usize]).collect();
    let border: Vec<u32> = topology.borders().flatten().map(|&h| symbolic.rank[topology.origin(h) as usize]).collect();
    start::conformal(&mut solver, &places, &border, &mut flat);
    let trace = std::env::var("ISO_TRACE").is_ok();
    let which = std::env::var("ISO_START").unwrap_or_default();
    let balanced = Objective::Balanced.energy().unwrap();
    let mut value = if start::scale(&shape, &mut flat) { shape.energy(balanced, &flat) } else { f64::INFINITY };
    if trace { eprintln!("conformal {value:.4e}"); }
    if (!(value < FAR_OFF) && which != "c") || which == "t" {
        let tutte = start::convex(mesh, topology);
        let mut other: Vec<[f64; 2]> = symbolic.order.iter().map(|&v| tutte[v as usize]).collect();
        let v2 = if start::scale(&shape, &mut other) { shape.energy(balanced, &other) } else { f64::INFINITY };
        if trace { eprintln!("convex {v2:.4e}"); }
        if v2 < value || which == "t" { flat = other; value = v2; }
    }
    if !(value < f64::INFINITY) { return Err(fail()); }
    let mut energy = energy;
    if let Ok(r) = std::env::var("ROBUST") {
        let x: Vec<f64> = r.split(':').map(|x| x.parse().unwrap()).collect();
        let run = solver.minimise(balanced, &mut flat, MAX_ROUNDS, observer)?;
        // rms of area change and shear
        let (mut a, mut b) = (0.0, 0.0);
        for c in &shape.cells { let j = c.jet(&flat); a += c.weight * (j.determinant() - 1.0).powi(2); b += c.weight * (j.shear[0].powi(2) + j.shear[1].powi(2)); }
        let rms = (run.energy / 8.0).sqrt();
        if trace { eprintln!("rms {rms:.3e} area {:.3e} shear {:.3e}", a.sqrt(), b.sqrt()); }
        energy = energy::Energy::Robust { area: x[0], shape: x[1], soft: [x[2] * rms, x[3] * rms], barrier: x[4] };
    }
    let run = solver.minimise(energy, &mut flat, MAX_ROUNDS, observer)?;
    if !shape.lies_upright(&flat) { return Err(fail()); }
    Ok(Isometric { flat: enlarged(&flat, shape.unit, &symbolic.rank), run })
}
