//! Coarser meshes of the same disc: vertices are drawn into neighbours until few are left.
//!
//! Method: in passes. Each pass ranks the vertices by what drawing one into its best neighbour costs: the volume swept
//! (the quadric of the planes around it, Garland and Heckbert 1997, without memory), plus a little for length, so that
//! triangles stay of one size where the surface is flat. The cheapest go first; the ring of a vertex that has gone rests
//! until the next pass. A vertex goes only where the result is a disc again (link condition, Dey et al. 1999; border
//! vertices go along their border) and no triangle turns or becomes a sliver.
//!
//! Each removal keeps the ring of its vertex, so that the way back needs no search ([`super::refine`]). The result
//! depends on the mesh and its numbering alone.

use glam::{DMat3, DVec3};

use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, Topology};

/// Weight of an edge's length beside the volume that it sweeps: small, for shape first; not nought, for triangles of one
/// size on flat ground.
const LENGTH_WEIGHT: f64 = 1e-3;

/// Greatest share of the vertices that goes in one pass: more, and dear ones go before cheap ones of the next pass.
const MOST_A_PASS: f64 = 0.3;

/// Least share; below it the mesh is as coarse as it can be made.
const LEAST_A_PASS: f64 = 0.01;

/// Neighbours that a vertex may get: stars of more are slow to make and bad to solve on.
const MOST_NEIGHBOURS: usize = 12;

/// Least cosine between a new triangle and the surface around the vertex that goes.
const LEAST_COSINE: f64 = 0.3;

/// Least height over longest edge of a new triangle, where the old ones were no worse.
const LEAST_HEIGHT: f64 = 0.1;

/// A vertex that went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Removal {
    /// The vertex.
    pub(super) vertex: u32,
    /// The neighbour that it was drawn into.
    pub(super) into: u32,
    /// Its ring, anticlockwise, in [`Coarsening::rings`].
    pub(super) ring: [u32; 2],
    /// Whether the ring is closed: the vertex was inside.
    pub(super) closed: bool,
}

/// A coarser mesh on the way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Level {
    /// Triangles, over the vertices of the whole mesh.
    pub(super) triangles: Vec<[u32; 3]>,
    /// How many removals lead to it.
    pub(super) removals: usize,
}

/// All coarser meshes, finest first.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Coarsening {
    pub(super) levels: Vec<Level>,
    pub(super) removals: Vec<Removal>,
    pub(super) rings: Vec<u32>,
}

/// Coarsens a disc to `least` vertices or as far as it goes; a level is kept whenever `step` times fewer are left.
///
/// # Errors
/// [`EngineError::Cancelled`].
pub(super) fn coarsen(
    mesh: &Mesh,
    topology: &Topology,
    (least, step): (usize, usize),
    observer: &dyn Observer,
) -> Result<Coarsening, EngineError> {
    let mut work = Work::new(mesh, topology);
    let mut found = Coarsening::default();
    let mut alive = work.stars.iter().filter(|star| !star.is_empty()).count();
    let mut next = alive / step;
    while alive > least {
        observer.check()?;
        let gone = work.pass((alive as f64 * MOST_A_PASS) as usize, &mut found);
        alive -= gone;
        let stuck = (gone as f64) < LEAST_A_PASS * alive as f64;
        if alive <= next.max(least) || stuck {
            let removals = found.removals.len();
            // Stuck at once: nothing would be won.
            if found.levels.last().is_none_or(|level| level.removals < removals) && removals > 0 {
                found.levels.push(Level { triangles: work.triangles(), removals });
            }
            next = alive / step;
        }
        if stuck {
            break;
        }
    }
    Ok(found)
}

struct Work<'a> {
    places: &'a [DVec3],
    corners: Vec<[u32; 3]>,
    alive: Vec<bool>,
    /// For each vertex its triangles.
    stars: Vec<Vec<u32>>,
    /// The pass in which a vertex was last near a removal.
    touched: Vec<u32>,
    pass: u32,
    ring: Vec<u32>,
    choices: Vec<(f64, u32)>,
}

impl<'a> Work<'a> {
    fn new(mesh: &'a Mesh, topology: &Topology) -> Self {
        let count = mesh.positions.len();
        let corners = topology.triangles().to_vec();
        let mut stars = vec![Vec::new(); count];
        for (t, corners) in corners.iter().enumerate() {
            for &v in corners {
                stars[v as usize].push(t as u32);
            }
        }
        Self {
            places: &mesh.positions,
            alive: vec![true; corners.len()],
            corners,
            stars,
            touched: vec![0; count],
            pass: 0,
            ring: Vec::new(),
            choices: Vec::new(),
        }
    }

    fn triangles(&self) -> Vec<[u32; 3]> {
        self.corners.iter().zip(&self.alive).filter(|(_, alive)| **alive).map(|(corners, _)| *corners).collect()
    }

    /// Removes up to `most` vertices, no two of them neighbours; gives how many.
    fn pass(&mut self, most: usize, found: &mut Coarsening) -> usize {
        self.pass += 1;
        let mut ranked = Vec::new();
        for v in 0..self.stars.len() as u32 {
            if !self.stars[v as usize].is_empty()
                && let Some(closed) = self.find_ring(v)
            {
                self.rank_choices(v, closed);
                if let Some(&(cost, _)) = self.choices.first() {
                    ranked.push((cost, v));
                }
            }
        }
        ranked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut gone = 0;
        for (_, v) in ranked {
            if gone == most {
                break;
            }
            if self.touched[v as usize] == self.pass {
                continue;
            }
            let Some(closed) = self.find_ring(v) else { continue };
            self.rank_choices(v, closed);
            let choices = std::mem::take(&mut self.choices);
            if let Some(&(_, into)) = choices.iter().find(|&&(_, into)| self.may_go(v, into, closed)) {
                self.remove(v, into, closed, found);
                gone += 1;
            }
            self.choices = choices;
        }
        gone
    }

    /// Finds the ring of a vertex; whether it is closed. `None` when it is longer than any that may go.
    fn find_ring(&mut self, v: u32) -> Option<bool> {
        let star = &self.stars[v as usize];
        if star.len() > MOST_NEIGHBOURS {
            return None;
        }
        let mut sides = [[0_u32; 2]; MOST_NEIGHBOURS];
        for (side, &t) in sides.iter_mut().zip(star) {
            let corners = self.corners[t as usize];
            let at = corners.iter().position(|&w| w == v)?;
            *side = [corners[(at + 1) % 3], corners[(at + 2) % 3]];
        }
        let sides = &sides[..star.len()];
        // An open ring begins where no side ends.
        let open = sides.iter().find(|side| sides.iter().all(|other| other[1] != side[0]));
        let first = open.or(sides.first())?[0];
        self.ring.clear();
        self.ring.push(first);
        let mut last = first;
        for _ in sides {
            last = sides.iter().find(|side| side[0] == last)?[1];
            self.ring.push(last);
        }
        if open.is_none() {
            self.ring.pop();
        }
        Some(open.is_none())
    }

    /// The neighbours that the vertex of the ring at hand may be drawn into, cheapest first.
    fn rank_choices(&mut self, v: u32, closed: bool) {
        let place = self.places[v as usize];
        let (mut quadric, mut area) = (DMat3::ZERO, 0.0);
        let count = self.ring.len();
        for i in 0..if closed { count } else { count - 1 } {
            let [a, b] = [self.ring[i], self.ring[(i + 1) % count]].map(|w| self.places[w as usize] - place);
            let normal = a.cross(b);
            let size = normal.length();
            if size > 0.0 {
                quadric += DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z) * size.recip();
                area += size;
            }
        }
        self.choices.clear();
        let (first, last) = (self.ring[0], self.ring[count - 1]);
        for &u in &self.ring {
            let step = self.places[u as usize] - place;
            let mut cost = step.dot(quadric * step) + LENGTH_WEIGHT * area * step.length_squared();
            if !closed {
                if count < 3 || (u != first && u != last) {
                    continue;
                }
                let other = self.places[if u == first { last } else { first } as usize] - place;
                let chord = (other - step).normalize_or_zero();
                cost += area * squared_distance(step, chord);
            }
            self.choices.push((cost, u));
        }
        self.choices.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// Whether the disc stays one, and its triangles sound, when the vertex of the ring at hand is drawn into `u`.
    fn may_go(&self, v: u32, u: u32, closed: bool) -> bool {
        let (count, star) = (self.ring.len(), &self.stars[u as usize]);
        let is_neighbour = |w: u32| star.iter().any(|&t| self.corners[t as usize].contains(&w));
        let common = self.ring.iter().filter(|&&w| w != u && is_neighbour(w)).count();
        let killed = if closed { 2 } else { 1 };
        if common != killed || star.len() + count - 2 * killed > MOST_NEIGHBOURS {
            return false;
        }
        let place = |w: u32| self.places[w as usize];
        let sides = || (0..if closed { count } else { count - 1 }).map(|i| [self.ring[i], self.ring[(i + 1) % count]]);
        let height = |a: DVec3, b: DVec3, c: DVec3| {
            let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
            let normal = (b - a).cross(c - a);
            (normal, normal.length() / longest)
        };
        let (mut mean, mut worst) = (DVec3::ZERO, f64::INFINITY);
        for [a, b] in sides() {
            let (normal, height) = height(place(v), place(a), place(b));
            mean += normal;
            worst = worst.min(height);
        }
        let mean = mean.normalize_or_zero();
        sides().filter(|side| !side.contains(&u)).all(|[a, b]| {
            let (normal, height) = height(place(u), place(a), place(b));
            height >= LEAST_HEIGHT.min(worst) && height > 0.0 && normal.dot(mean) >= LEAST_COSINE * normal.length()
        })
    }

    fn remove(&mut self, v: u32, into: u32, closed: bool, found: &mut Coarsening) {
        let start = found.rings.len() as u32;
        found.rings.extend(&self.ring);
        found.removals.push(Removal { vertex: v, into, ring: [start, found.rings.len() as u32], closed });
        for t in std::mem::take(&mut self.stars[v as usize]) {
            let corners = &mut self.corners[t as usize];
            if corners.contains(&into) {
                self.alive[t as usize] = false;
                for w in *corners {
                    self.stars[w as usize].retain(|&other| other != t);
                }
            } else {
                *corners = corners.map(|w| if w == v { into } else { w });
                self.stars[into as usize].push(t);
            }
        }
        for &w in &self.ring {
            self.touched[w as usize] = self.pass;
        }
    }
}

/// The squared distance of a place from a line through the origin.
fn squared_distance(place: DVec3, direction: DVec3) -> f64 {
    (place - direction * place.dot(direction)).length_squared()
}
