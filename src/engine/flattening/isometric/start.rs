//! Maps to start from.
//!
//! - Conformal: least squares conformal map with two far border vertices held (Levy et al. 2002): nearly right for
//!   everything that is nearly developable, but it can flip on strongly curved meshes, and is then not taken.
//! - By way of coarser meshes ([`super::multilevel`]): for large meshes that are strongly curved, taken first.
//! - Convex ([`convex`]): cannot flip, but is far from isometric.
//!
//! The conformal and the convex one are scaled so that their symmetric Dirichlet energy is least; the lesser energy wins.

use super::BALANCED;
use super::convex::convex;
use super::energy::Derivatives;
use super::multilevel::{LEAST_LARGE, carry_over, smooth};
use super::shape::{Cell, Shape};
use super::solver::Solver;
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::{Mesh, Topology};

/// Mean energy of the conformal start above which another one is tried.
pub(super) const FAR_OFF: f64 = 1.0;

/// A map without flips, in the factorisation's numbering.
///
/// # Errors
/// [`FlatteningError::TooCurved`] when rounding leaves none; [`EngineError::Cancelled`].
pub(super) fn start(solver: &mut Solver, mesh: &Mesh, topology: &Topology) -> Result<Vec<[f64; 2]>, EngineError> {
    let shape = solver.shape;
    let scaled = |flat: &mut [[f64; 2]]| if scale(shape, flat) { shape.energy(BALANCED, flat) } else { f64::INFINITY };
    if mesh.positions.len() >= LEAST_LARGE
        && let Some(carried) = carried_over(solver, mesh, topology)?
    {
        return Ok(carried);
    }
    let mut flat = conformal(solver, mesh, topology)?;
    let energy = scaled(&mut flat);
    if energy < FAR_OFF {
        return Ok(flat);
    }
    let own = convex(mesh, topology, solver.observer)?;
    let mut other: Vec<[f64; 2]> = solver.symbolic.order.iter().map(|&v| own[v as usize]).collect();
    let least = scaled(&mut other);
    if least < energy {
        Ok(other)
    } else if energy < f64::INFINITY {
        Ok(flat)
    } else {
        Err(FlatteningError::TooCurved.into())
    }
}

/// A map by way of coarser meshes, when there is one.
fn carried_over(solver: &Solver, mesh: &Mesh, topology: &Topology) -> Result<Option<Vec<[f64; 2]>>, EngineError> {
    let Some(places) = carry_over(mesh, topology, solver.observer)? else { return Ok(None) };
    let (shape, order) = (solver.shape, &solver.symbolic.order);
    let mut flat: Vec<[f64; 2]> = order.iter().map(|&v| places[v as usize].map(|x| x / shape.unit)).collect();
    smooth(shape, &mut flat);
    Ok((shape.energy(BALANCED, &flat) < f64::INFINITY).then_some(flat))
}

/// The conformal map, of any size. It may flip.
fn conformal(solver: &mut Solver, mesh: &Mesh, topology: &Topology) -> Result<Vec<[f64; 2]>, EngineError> {
    let corners = || topology.borders().flatten().map(|&h| topology.origin(h));
    let far = |from: u32| {
        let distance = |v: u32| mesh.positions[v as usize].distance_squared(mesh.positions[from as usize]);
        corners().fold(from, |best, v| if distance(v) > distance(best) { v } else { best })
    };
    let one = far(corners().next().unwrap_or(0));
    let held = [one, far(one)].map(|v| solver.symbolic.rank[v as usize] as usize);
    let mut flat = vec![[0.0; 2]; mesh.positions.len()];
    flat[held[1]] = [1.0, 0.0];
    let form = |cell: &Cell| {
        let shear = cell.jet(&flat).shear;
        let mut hessian = [[0.0; 4]; 4];
        (hessian[2][2], hessian[3][3]) = (1.0, 1.0);
        Derivatives { gradient: [0.0, 0.0, shear[0], shear[1]], hessian }
    };
    solver.assembly.quadratic(solver.shape, form, &mut solver.matrix, &mut solver.gradient);
    solver.symbolic.hold(&mut solver.matrix, &held);
    for v in held {
        solver.gradient[v] = [0.0; 2];
    }
    solver.factor.factorise(solver.symbolic, &mut solver.matrix, (0, &mut |_, _| false), solver.observer)?;
    solver.direction.copy_from_slice(&solver.gradient);
    solver.factor.solve(solver.symbolic, &mut solver.direction);
    for (place, step) in flat.iter_mut().zip(&solver.direction) {
        *place = [place[0] - step[0], place[1] - step[1]];
    }
    Ok(flat)
}

/// Scales a map without flips so that its symmetric Dirichlet energy is least; false when no size does.
pub(super) fn scale(shape: &Shape, flat: &mut [[f64; 2]]) -> bool {
    let (mut forth, mut back) = (0.0, 0.0);
    for cell in &shape.cells {
        let jet = cell.jet(flat);
        let (norm, det) = (jet.norm_squared(), jet.determinant());
        forth += cell.weight * norm;
        back += cell.weight * norm / (det * det);
    }
    let factor = (back / forth).sqrt().sqrt();
    if !(factor.is_finite() && factor > 0.0) {
        return false;
    }
    for place in flat.iter_mut() {
        *place = place.map(|x| x * factor);
    }
    true
}
