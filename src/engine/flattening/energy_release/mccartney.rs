//! McCartney's flattening (thesis 4.1; McCartney, Hinds, Seow 1999): circles, then single vertices in four directions.
//!
//! The mesh is laid by intersecting circles (4.1.1). A vertex that comes to have several positions keeps the first: so the
//! tears and overlaps of Figure 4.4 are closed from the start, and what they held is strain of the edges that close them.
//! Then (4.1.2) each vertex is tried a step away in four orthogonal directions; the one that lowers the energy (4.3) of
//! its edges most is taken if it lowers it by more than `E_t` (4.4), and the vertex and its neighbours are tried again.
//!
//! What the paper leaves open: the step is a share of the mean length of the edges at the vertex; when no vertex moves any
//! more it is halved, until a step of that size could release `E_t` no more. Vertices wait in one queue, first come first
//! served. A move is never refused for turning a triangle over: only the last state counts.

use std::collections::VecDeque;

use glam::DVec2;

use super::Order;
use super::springs::{Spoke, Springs};
use super::{
    DEFAULT_STEP, History, Laying, Outcome, ReleaseOptions, ReleaseReport, Released, Start, flipped, place_of,
};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::{Mesh, Topology};

/// The step is halved at most so often: then it is below what sixteen digits resolve of any part.
const MOST_HALVINGS: u32 = 50;
/// A step of a share `s` of an edge of length `l` that leaves a vertex at rest has released about `k (s l)^2 / 2`; `k`, the
/// stiffness of all edges there, is about 3 / l. Half of the step with which that is `E_t` is still tried.
const LAST_STEP: f64 = 0.4;
/// Tests of each vertex from one joint move to the next: long waves show then, and the energy of all edges, which a joint
/// move needs some times, costs little beside.
const SWEEPS_BETWEEN: u64 = 4;
/// A joint move goes at most 2 to this power as far as the vertices went by themselves.
const MOST_DOUBLINGS: u32 = 8;
/// Vertices between two questions to the observer: well under a millisecond.
const BETWEEN_QUESTIONS: u64 = 4096;

/// Flattens a mesh from one seed.
///
/// # Errors
/// A mesh or a seed that cannot be worked with; [`EngineError::Cancelled`]. That circles miss each other, or that a
/// triangle lies turned over at the end, comes beside what there is.
pub fn flatten(
    mesh: &Mesh,
    topology: &Topology,
    seed: u32,
    options: ReleaseOptions,
    observer: &dyn Observer,
) -> Result<Outcome, EngineError> {
    let start = Start::new(mesh, topology, seed, options)?;
    observer.check()?;
    let (laid, error) = lay(mesh, topology, seed);
    let energy = start.springs.energy(&laid.flat);
    if error.is_some() {
        let report = ReleaseReport {
            threshold_mm: start.threshold(energy, mesh.positions.len()),
            energy_before_mm: energy,
            energy_after_mm: energy,
            ..ReleaseReport::default()
        };
        return Ok((Released { report, ..laid }, error));
    }
    let mut flat = laid.flat;
    let step = options.step.unwrap_or(DEFAULT_STEP);
    let report = release(&start, step, &mut flat, observer)?;
    let error = flipped(mesh, seed, &flat);
    Ok((Released { flat, report, ..laid }, error))
}

/// Lays the mesh (4.1.1); the first position of a vertex is kept.
pub(super) fn lay(mesh: &Mesh, topology: &Topology, seed: u32) -> (Released, Option<FlatteningError>) {
    let mut flat = vec![DVec2::NAN; mesh.positions.len()];
    let mut levels = vec![1];
    let total = mesh.triangles.len() as u32;
    let mut laying = Laying::begin(mesh, topology, seed, &mut flat);
    let mut flattened = 1;
    let mut error = None;
    loop {
        let level = laying.next_level(Order::Fifo);
        if level.is_empty() {
            break;
        }
        for unfolding in &level {
            let apex = unfolding.corners[2] as usize;
            if flat[apex].is_nan() {
                let Some(place) = laying.apex(unfolding.corners, &flat) else {
                    let number = levels.len() as u32;
                    let mut place = Box::new(place_of(mesh, unfolding.triangle, &flat));
                    place.level = Some(number);
                    let triangle = unfolding.triangle;
                    error =
                        Some(FlatteningError::CirclesMiss { triangle, level: number, seed, flattened, total, place });
                    break;
                };
                flat[apex] = place;
            }
            flattened += 1;
        }
        levels.push(level.len() as u32);
        if error.is_some() {
            break;
        }
    }
    if error.is_none() && flattened < total {
        error = Some(FlatteningError::SeveralPieces { unreached: total - flattened, total });
    }
    (Released { flat, flattened: u64::from(flattened), levels, report: ReleaseReport::default() }, error)
}

/// Releases energy (4.1.2).
///
/// # Errors
/// [`EngineError::Cancelled`].
fn release(
    start: &Start,
    step: f64,
    flat: &mut [DVec2],
    observer: &dyn Observer,
) -> Result<ReleaseReport, EngineError> {
    pulp::Arch::new().dispatch(|| run(start, step, flat, observer))
}

/// Vertices that wait for their turn, each once.
struct Queue {
    waiting: VecDeque<u32>,
    waits: Vec<bool>,
}

impl Queue {
    /// All vertices that have edges.
    fn fill(&mut self, springs: &Springs) {
        (0..springs.vertex_count() as u32).filter(|&v| !springs.of(v).is_empty()).for_each(|v| self.push(v));
    }

    fn push(&mut self, vertex: u32) {
        if !std::mem::replace(&mut self.waits[vertex as usize], true) {
            self.waiting.push_back(vertex);
        }
    }

    fn pop(&mut self) -> Option<u32> {
        let vertex = self.waiting.pop_front()?;
        self.waits[vertex as usize] = false;
        Some(vertex)
    }
}

#[inline(always)]
#[expect(clippy::inline_always, reason = "a function of its own would not have the instructions of its caller")]
fn run(start: &Start, step: f64, flat: &mut [DVec2], observer: &dyn Observer) -> Result<ReleaseReport, EngineError> {
    let springs = &start.springs;
    let vertices = springs.vertex_count();
    let lengths = springs.local_lengths();
    let before = springs.energy(flat);
    let mut history = History::begin(before, 1 + vertices as u64 / 8);
    let mut queue = Queue { waiting: VecDeque::with_capacity(vertices), waits: vec![false; vertices] };
    let mut joint = Joint::new(flat);
    let (mut moves, mut tests, mut energy) = (0, 0, before);
    let mut threshold = start.threshold(energy, vertices);
    let mut settled = true;
    let mut scale = step;
    'halvings: for _ in 0..=MOST_HALVINGS {
        queue.fill(springs);
        while let Some(v) = queue.pop() {
            if tests % BETWEEN_QUESTIONS == 0 {
                observer.check()?;
            }
            tests += 1;
            let (released, place) = best_of_four(springs, v, flat, scale * lengths[v as usize]);
            if released > threshold {
                if moves == start.most_moves {
                    settled = false;
                    break 'halvings;
                }
                moves += 1;
                flat[v as usize] = place;
                energy -= released;
                history.tell(moves, energy);
                queue.push(v);
                springs.of(v).iter().for_each(|spoke| queue.push(spoke.to));
            }
            if tests % (SWEEPS_BETWEEN * vertices as u64) == 0 && joint.try_on(springs, flat, threshold) {
                energy = joint.energy;
                history.tell(moves, energy);
                queue.fill(springs);
            }
        }
        energy = springs.energy(flat);
        threshold = start.threshold(energy, vertices);
        if scale < LAST_STEP * (threshold / springs.mean_length()).sqrt() {
            break;
        }
        scale *= 0.5;
    }
    let after = springs.energy(flat);
    Ok(ReleaseReport {
        threshold_mm: threshold,
        energy_before_mm: before,
        energy_after_mm: after,
        moves,
        tests,
        joint_moves: joint.done,
        settled,
        history: history.end(moves, after),
    })
}

/// Moves of all vertices together, as they have moved one by one since the last.
struct Joint {
    /// Where they lay then.
    base: Vec<DVec2>,
    trial: Vec<DVec2>,
    /// The energy after the last one that was made.
    energy: f64,
    done: u64,
}

impl Joint {
    fn new(flat: &[DVec2]) -> Self {
        Self { base: flat.to_vec(), trial: flat.to_vec(), energy: f64::INFINITY, done: 0 }
    }

    /// Moves all vertices on by what they have moved, twice, four times as far..., as long as that releases energy. True
    /// where it releases more than the threshold.
    fn try_on(&mut self, springs: &Springs, flat: &mut [DVec2], threshold: f64) -> bool {
        let before = springs.energy(flat);
        let (mut least, mut furthest) = (before, 0.0);
        let mut reach = 1.0;
        for _ in 0..MOST_DOUBLINGS {
            for ((trial, place), base) in self.trial.iter_mut().zip(&*flat).zip(&self.base) {
                *trial = *place + reach * (*place - *base);
            }
            let energy = springs.energy(&self.trial);
            // NaN is no less than anything.
            let falls = energy < least;
            if !falls {
                break;
            }
            (least, furthest) = (energy, reach);
            reach *= 2.0;
        }
        let moves = before - least > threshold;
        for (place, base) in flat.iter_mut().zip(&mut self.base) {
            let moved = *place + furthest * (*place - *base);
            *base = *place;
            if moves {
                *place = moved;
            }
        }
        if moves {
            self.energy = springs.energy(flat);
            self.done += 1;
        }
        moves
    }
}

/// The four directions.
const DIRECTIONS: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];

/// What a vertex releases at most by a step in one of four directions (4.4), and where it is then.
#[inline(always)]
#[expect(clippy::inline_always, reason = "as above")]
fn best_of_four(springs: &Springs, vertex: u32, flat: &[DVec2], step: f64) -> (f64, DVec2) {
    let place = flat[vertex as usize];
    let mut now = 0.0;
    let mut then = [0.0; 4];
    for &Spoke { to, length, half } in springs.of(vertex) {
        let d = place - flat[to as usize];
        let off = d.length() - length;
        now += half * off * off;
        for (sum, [x, y]) in then.iter_mut().zip(DIRECTIONS) {
            let (x, y) = (d.x + step * x, d.y + step * y);
            let off = (x * x + y * y).sqrt() - length;
            *sum += half * off * off;
        }
    }
    let mut best = 0;
    for k in 1..4 {
        if then[k] < then[best] {
            best = k;
        }
    }
    (now - then[best], place + step * DVec2::from_array(DIRECTIONS[best]))
}
