//! Pinned points and kept lengths: what is asked, and how the least is found under it.
//!
//! # Pins
//! The free map is moved rigidly so that its points come nearest to their targets. Where that does not meet them, the
//! energy is made least under the condition that each point lies at its target, by augmented Lagrangians (Hestenes 1969,
//! Powell 1969): to the energy comes `k/2 |p - t|^2` and a force for each point; each turn makes the sum least by the same
//! Newton's method with the same line search, then adds to the forces what the points still lacked, and stiffens k. The
//! gaps fall by about k a turn, so that k need not be large and the systems stay as good as they were. A map with flips is
//! never passed through, so that pins which ask for one leave a gap that no longer falls: an error names the worst.
//!
//! A point in the plane has no resistance of its own: the finer the mesh, the less energy it takes to move a single point,
//! and the closer to the point that energy is.
//!
//! # Lengths
//! Each edge of a kept border adds `weight l0 (l / l0 - 1)^2 / perimeter` to the mean energy: as a strip along the border
//! of the width area / perimeter would with an energy of `weight` times its strain's square, where the sheet has about 4
//! (`balanced`) or 1 (`arap`). Not the sum of the lengths is kept but each edge's: what is sewn together point by point
//! stays so.

mod terms;
#[cfg(test)]
mod tests;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use self::terms::Edge;
pub(super) use self::terms::{Point, Terms};
use super::cholesky::Symbolic;
use super::energy::Energy;
use super::options::IsometricOptions;
use super::shape::Shape;
use super::solver::{Run, Solver, tolerance};
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningError;
use crate::engine::flattening::rigid::Rigid;
use crate::engine::mesh::{Mesh, Topology};

/// Distance from its target, as a part of the root of the mesh's area, at which a point is met. Rounding of a million
/// vertices leaves some 1e-12.
const MET: f64 = 1e-10;

/// The same where no further turn brings points nearer: below what a cutter can follow, and the report says how much it is.
const NEARLY_MET: f64 = 1e-7;

/// The first stiffness, beside an energy whose curvature is near 8. Larger, and points that are far from their targets pull
/// spikes out of the mesh on the way; smaller, and a turn more is needed.
const FIRST: f64 = 1e2;

/// What it grows by at each turn.
const STIFFER: f64 = 10.0;

/// The greatest: gaps then fall by some 1e4 a turn. With more, rounding in the systems would show in the map.
const GREATEST: f64 = 1e6;

/// Turns at the greatest stiffness in which the gap does not halve, after which it is taken to stay. One can be chance.
const PATIENCE: usize = 3;

/// Most turns. Pins that can be met need four to eight.
const MAX_TURNS: usize = 40;

/// Most rounds in a turn.
const TURN_ROUNDS: usize = 60;

/// What a step must promise in all turns but the last ones, as a part of the energy.
const ROUGH: f64 = 1e-3;

/// A point of the mesh that is to lie at a place of the plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// The triangle.
    pub triangle: u32,
    /// Weights of its corners, with the sum 1. A little below 0: the triangle's map is continued beyond it.
    pub weights: [f64; 3],
    /// Where the point is to lie, mm.
    pub to: DVec2,
}

/// Which border's lengths are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeptCurve {
    /// All of them.
    Borders,
    /// One, in the numbers of the topology.
    Border(u32),
}

/// A border whose lengths are kept.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// Which.
    pub curve: KeptCurve,
    /// How much it weighs beside the energy of the triangles.
    pub weight: f64,
}

/// What weights may differ from 1 by in sum: rounding.
const SUM: f64 = 1e-9;

/// Why constraints cannot be used, if they cannot.
pub(super) fn check(mesh: &Mesh, topology: &Topology, options: &IsometricOptions) -> Result<(), EngineError> {
    let refuse =
        |name: &str, detail: String| Err(EngineError::Parameter { name: format!("flattening.{name}"), detail });
    for (k, pin) in options.pins.iter().enumerate() {
        let off = (pin.weights.iter().sum::<f64>() - 1.0).abs();
        if pin.triangle as usize >= mesh.triangles.len() || off.is_nan() || off > SUM || !pin.to.is_finite() {
            return refuse("pins", format!("pin {k} lies in no triangle of the mesh, or its target is not finite"));
        }
    }
    for kept in &options.keep {
        if !(kept.weight.is_finite() && kept.weight >= 0.0) {
            return refuse("keep", format!("a weight is 0 or greater, not {}", kept.weight));
        }
        if let KeptCurve::Border(border) = kept.curve
            && border as usize >= topology.border_count()
        {
            return refuse("keep", format!("there is no border {border}: there are {}", topology.border_count()));
        }
    }
    Ok(())
}

/// The edges whose lengths are kept, each once, weights added up.
pub(super) fn edges(
    (mesh, topology): (&Mesh, &Topology),
    (shape, symbolic): (&Shape, &Symbolic<2>),
    options: &IsometricOptions,
) -> Vec<Edge> {
    if options.keep.is_empty() {
        return Vec::new();
    }
    let rest = |h: u32| {
        let [a, b] = [topology.origin(h), topology.target(h)].map(|v| mesh.positions[v as usize]);
        a.distance(b) / shape.unit
    };
    let perimeter: f64 = topology.borders().flatten().map(|&h| rest(h)).sum();
    let mut edges = Vec::new();
    for (border, halfedges) in topology.borders().enumerate() {
        let holds = |kept: &&Kept| match kept.curve {
            KeptCurve::Borders => true,
            KeptCurve::Border(one) => one as usize == border,
        };
        let weight: f64 = options.keep.iter().filter(holds).map(|kept| kept.weight).sum();
        if weight <= 0.0 {
            continue;
        }
        edges.extend(halfedges.iter().filter(|&&h| rest(h) > 0.0).filter_map(|&h| {
            let ends = [topology.origin(h), topology.target(h)].map(|v| symbolic.rank[v as usize]);
            Edge::new(symbolic, ends, rest(h), weight / (perimeter * rest(h)))
        }));
    }
    edges
}

/// The points to pin, targets in the lengths of the shape. `None` when corners of a triangle are no neighbours in the
/// structure.
pub(super) fn points(mesh: &Mesh, (shape, symbolic): (&Shape, &Symbolic<2>), pins: &[Pin]) -> Option<Vec<Point>> {
    pins.iter()
        .map(|pin| {
            let corners = mesh.triangles[pin.triangle as usize].map(|v| symbolic.rank[v as usize]);
            Point::new(symbolic, corners, pin.weights, (pin.to / shape.unit).to_array())
        })
        .collect()
}

/// Brings the solver's points to their targets, from a map of least energy without them.
///
/// # Errors
/// [`FlatteningError::PinsNotMet`], [`EngineError::Cancelled`].
pub(super) fn meet(
    solver: &mut Solver,
    points: Vec<Point>,
    energy: Energy,
    flat: &mut Vec<[f64; 2]>,
    run: &mut Run,
) -> Result<(), EngineError> {
    move_near(&points, flat);
    solver.terms.points = points;
    solver.terms.stiffness = FIRST;
    let mut gap = solver.terms.worst(flat).1;
    let (mut idle, mut exact) = (0, gap <= MET);
    for _ in 0..MAX_TURNS {
        if exact && gap <= MET {
            return Ok(());
        }
        let stiffness = solver.terms.stiffness;
        exact = stiffness >= GREATEST || gap <= MET;
        let asked = if exact { tolerance(energy) } else { ROUGH };
        let turn = solver.minimise_to(energy, flat, TURN_ROUNDS, asked)?;
        run.rounds += turn.rounds;
        run.kept += turn.kept;
        run.converged = turn.converged;
        let now = solver.terms.worst(flat).1;
        idle = if stiffness >= GREATEST && now > 0.5 * gap && now > MET { idle + 1 } else { 0 };
        gap = now;
        if idle >= PATIENCE {
            break;
        }
        solver.terms.push(flat);
        solver.terms.stiffen((STIFFER * stiffness).min(GREATEST));
    }
    let (pin, gap) = solver.terms.worst(flat);
    if gap <= NEARLY_MET {
        return Ok(());
    }
    let residual_mm = gap * solver.shape.unit;
    Err(FlatteningError::PinsNotMet { pin: pin as u32, residual_mm, place: Box::default() }.into())
}

/// Whether moving and turning a map is all that its points need.
pub(super) fn are_met_rigidly(points: &[Point], flat: &[[f64; 2]]) -> bool {
    let mut moved = flat.to_vec();
    move_near(points, &mut moved);
    let gap = |p: &Point| DVec2::from_array(p.place(&moved)).distance(DVec2::from_array(p.target()));
    points.iter().all(|p| gap(p) <= MET)
}

/// The rigid motion that brings the points nearest to their targets.
fn move_near(points: &[Point], flat: &mut [[f64; 2]]) {
    let from: Vec<DVec2> = points.iter().map(|p| DVec2::from_array(p.place(flat))).collect();
    let to: Vec<DVec2> = points.iter().map(|p| DVec2::from_array(p.target())).collect();
    let motion = Rigid::fit(&from, &to);
    for place in flat {
        *place = motion.at(DVec2::from_array(*place)).to_array();
    }
}
