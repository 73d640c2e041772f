//! Flattening by an energy model (Wang, Smith, Yuen 2002), our reading: masses and springs, at rest while the mesh is laid.
//!
//! The thesis names the method and not its equations; what follows is built from general knowledge of it. Vertices are
//! masses, edges are springs with the energy (4.2). Triangles are laid in mapping order; a vertex that lies already moves to
//! the mean of its positions. After each level the part that lies is let go for a few steps of time, and at the end for as
//! many as it takes to come to rest. A triangle that is turned over is pushed back by a further spring, whose length is how
//! far its corner is beyond the longest edge.
//!
//! What we settled: a step of time is 1 and the masses are the least with which such steps are stable anywhere (a vertex at
//! rest lies where it lies, whatever it weighs); motion is stopped whenever the energy rises, and the step is then undone; at
//! rest means that no vertex, moved alone, would release more than `E_t`. Cuts along lines of great strain are not made.

use glam::DVec2;

use super::laying::Laying;
use super::springs::Spoke;
use super::{History, Order, Outcome, ReleaseOptions, ReleaseReport, Released, Start, flipped};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::{Mesh, Topology};

/// Steps of time after each level: more hold the front together better, and cost so much more.
const STEPS_PER_LEVEL: usize = 20;
/// Share of the least stable mass, above 1 since stiffness turns with the edges.
const MASS_FACTOR: f64 = 1.1;

/// Flattens a mesh from one seed. `step` of the options has no meaning here.
///
/// # Errors
/// A mesh or a seed that cannot be worked with; [`EngineError::Cancelled`]. That a triangle lies turned over at the end
/// comes beside what there is.
pub fn flatten(
    mesh: &Mesh,
    topology: &Topology,
    seed: u32,
    options: ReleaseOptions,
    observer: &dyn Observer,
) -> Result<Outcome, EngineError> {
    let start = Start::new(mesh, topology, seed, options)?;
    observer.check()?;
    let total = mesh.triangles.len() as u32;
    let mut levels = vec![1];
    let mut flat = vec![DVec2::NAN; mesh.positions.len()];
    let mut laying = Laying::begin(mesh, topology, seed, &mut flat);
    let mut positions = vec![0_u32; mesh.positions.len()];
    for v in topology.triangles()[seed as usize] {
        positions[v as usize] = 1;
    }
    let mut motion = Motion::new(mesh, &start, seed);
    loop {
        let level = laying.next_level(Order::Fifo);
        if level.is_empty() {
            break;
        }
        for unfolding in &level {
            let new = laying.over_edge(unfolding.corners, &flat);
            let apex = unfolding.corners[2] as usize;
            positions[apex] += 1;
            if positions[apex] == 1 {
                flat[apex] = new;
                motion.lies.push(apex as u32);
            } else {
                let old = flat[apex];
                flat[apex] = old + (new - old) / f64::from(positions[apex]);
            }
        }
        motion.triangles.extend(level.iter().map(|u| u.triangle));
        levels.push(level.len() as u32);
        motion.let_go(&mut flat, STEPS_PER_LEVEL, None, observer)?;
    }
    let energy = start.springs.energy(&flat);
    let flattened = laying.given() as u64;
    if laying.given() < total as usize {
        let report = ReleaseReport { energy_before_mm: energy, energy_after_mm: energy, ..ReleaseReport::default() };
        let error = FlatteningError::SeveralPieces { unreached: total - laying.given() as u32, total };
        return Ok((Released { flat, flattened, levels, report }, Some(error)));
    }
    let mut history = History::begin(energy, 1 + mesh.positions.len() as u64);
    let moves_before = motion.moves;
    let settled = motion.let_go(&mut flat, usize::MAX, Some((&mut history, moves_before)), observer)?;
    let after = start.springs.energy(&flat);
    let report = ReleaseReport {
        threshold_mm: start.threshold(after, mesh.positions.len()),
        energy_before_mm: energy,
        energy_after_mm: after,
        moves: motion.moves,
        tests: motion.tests,
        joint_moves: 0,
        settled,
        history: history.end(motion.moves - moves_before, after),
    };
    let error = flipped(mesh, seed, &flat);
    Ok((Released { flat, flattened, levels, report }, error))
}

/// What lies, and how it moves.
struct Motion<'a> {
    mesh: &'a Mesh,
    start: &'a Start,
    /// Vertices that lie, in the order in which they were laid.
    lies: Vec<u32>,
    /// Triangles that lie.
    triangles: Vec<u32>,
    /// Longest edge of each triangle in space, mm.
    longest: Vec<f64>,
    /// Of each vertex.
    mass: Vec<f64>,
    velocity: Vec<DVec2>,
    force: Vec<DVec2>,
    old: Vec<DVec2>,
    moves: u64,
    tests: u64,
}

impl<'a> Motion<'a> {
    fn new(mesh: &'a Mesh, start: &'a Start, seed: u32) -> Self {
        let springs = &start.springs;
        let vertices = mesh.positions.len();
        let place = |v: u32| mesh.positions[v as usize];
        let longest = |&[a, b, c]: &[u32; 3]| {
            let lengths = [(a, b), (b, c), (c, a)].map(|(a, b)| place(a).distance(place(b)));
            lengths.into_iter().fold(0.0, f64::max)
        };
        // Half of the greatest frequency's square is at most the stiffness at a vertex by its mass: a step of 1 is stable
        // up to 4 = frequency^2.
        let stiffness = |v: u32| springs.of(v).iter().map(|s| 2.0 * s.half).sum::<f64>();
        Self {
            mesh,
            start,
            lies: mesh.triangles[seed as usize].to_vec(),
            triangles: vec![seed],
            longest: mesh.triangles.iter().map(longest).collect(),
            mass: (0..vertices as u32).map(|v| MASS_FACTOR * 0.5 * stiffness(v)).collect(),
            velocity: vec![DVec2::ZERO; vertices],
            force: vec![DVec2::ZERO; vertices],
            old: vec![DVec2::ZERO; vertices],
            moves: 0,
            tests: 0,
        }
    }

    /// Steps of time until rest, as many as allowed, or as moves allow. True when it is at rest.
    fn let_go(
        &mut self,
        flat: &mut [DVec2],
        steps: usize,
        mut history: Option<(&mut History, u64)>,
        observer: &dyn Observer,
    ) -> Result<bool, EngineError> {
        let mut least = f64::INFINITY;
        let (mut pace, mut from_rest) = (1.0, 0);
        for &v in &self.lies {
            self.velocity[v as usize] = DVec2::ZERO;
            self.old[v as usize] = flat[v as usize];
        }
        for _ in 0..steps {
            observer.check()?;
            let (energy, most) = self.forces(flat);
            self.tests += self.lies.len() as u64;
            if energy > least {
                // Back to where it was least, and at rest there.
                for &v in &self.lies {
                    let v = v as usize;
                    flat[v] = self.old[v];
                    self.velocity[v] = DVec2::ZERO;
                }
                least = f64::INFINITY;
                // A step from rest that raises the energy is too long: stiffness turns with the edges, and triangles that
                // are turned over add to it.
                if from_rest == 1 {
                    pace *= 0.5;
                }
                from_rest = 0;
                continue;
            }
            least = energy;
            if most <= self.start.threshold(energy, self.lies.len()) {
                return Ok(true);
            }
            if self.moves + self.lies.len() as u64 > self.start.most_moves {
                return Ok(false);
            }
            for &v in &self.lies {
                let v = v as usize;
                self.old[v] = flat[v];
                self.velocity[v] += pace * self.force[v] / self.mass[v];
                flat[v] += pace * self.velocity[v];
            }
            from_rest += 1;
            self.moves += self.lies.len() as u64;
            if let Some((history, since)) = &mut history {
                history.tell(self.moves - *since, energy);
            }
        }
        Ok(false)
    }

    /// Forces on what lies; the energy, and the most that one vertex would release, moved alone: half of the force's
    /// square by the stiffness.
    fn forces(&mut self, flat: &[DVec2]) -> (f64, f64) {
        let mut twice = 0.0;
        let mut most = 0.0_f64;
        for &v in &self.lies {
            let place = flat[v as usize];
            let (mut force, mut stiffness) = (DVec2::ZERO, 0.0);
            for &Spoke { to, length, half } in self.start.springs.of(v) {
                let d = flat[to as usize] - place;
                let now = d.length();
                // NaN where the other end does not lie yet.
                if now > 0.0 {
                    let off = now - length;
                    twice += half * off * off;
                    force += d * (2.0 * half * off / now);
                    stiffness += 2.0 * half;
                }
            }
            self.force[v as usize] = force;
            most = most.max(force.length_squared() / (2.0 * stiffness));
        }
        (0.5 * twice + self.push_back(flat), most)
    }
}

impl Motion<'_> {
    /// The forces on the corners of triangles that are turned over, and their energy.
    fn push_back(&mut self, flat: &[DVec2]) -> f64 {
        let mut energy = 0.0;
        for &t in &self.triangles {
            let corners = self.mesh.triangles[t as usize].map(|v| v as usize);
            let [a, b, c] = corners.map(|v| flat[v]);
            let twice_area = (b - a).perp_dot(c - a);
            if twice_area < 0.0 {
                let longest = self.longest[t as usize];
                let beyond = -twice_area / longest;
                // Its stiffness is that of an edge of the triangle.
                let push = beyond / longest;
                energy += 0.5 * push * beyond;
                for (v, across) in [(corners[0], c - b), (corners[1], a - c), (corners[2], b - a)] {
                    // The area grows along the normal of the opposite edge.
                    self.force[v] += across.perp() * (push / longest);
                }
            }
        }
        energy
    }
}
