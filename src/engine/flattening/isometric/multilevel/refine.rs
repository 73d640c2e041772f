//! Back from a coarse map to a finer one: each vertex returns into its ring, where the energy around it is least.
//!
//! A vertex that was drawn into a neighbour left a fan of triangles around that neighbour. As long as these lie the right
//! way up, the fan's outline can be seen as a whole from places near the neighbour, so that the vertex finds a place
//! without a flip whatever the map is (as in progressive parametrisations); from there Newton's method moves it alone.

use glam::DVec3;

use super::coarsen::{Coarsening, Removal};
use crate::engine::flattening::isometric::BALANCED;
use crate::engine::flattening::isometric::assembly::columns_of;
use crate::engine::flattening::isometric::energy::{Curvature, Derivatives};
use crate::engine::flattening::isometric::shape::{Cell, cell};
use crate::engine::flattening::isometric::solver::PROJECTED;

/// Steps of one vertex when it returns, and in a sweep: its neighbours move as well, so that more is wasted.
const RETURN_STEPS: usize = 3;
const SWEEP_STEPS: usize = 1;

/// Halvings of a step before a vertex stays where it is.
const HALVINGS: usize = 6;

/// Halvings of the distance to the neighbour in search of a place without a flip.
const APPROACHES: usize = 50;

/// Mean energy above which a star counts as far from its least.
const FAR: f64 = 1.0;

/// A step that lowers the energy by less than this part is the last one.
const ENOUGH: f64 = 1e-3;

/// Puts the removed vertices back, last first, down to the removal `until`. False when rounding leaves one no place.
pub(super) fn put_back(places: &[DVec3], coarsening: &Coarsening, range: [usize; 2], flat: &mut [[f64; 2]]) -> bool {
    let mut star = Star::default();
    coarsening.removals[range[0]..range[1]].iter().rev().all(|removal| {
        let ring = &coarsening.rings[removal.ring[0] as usize..removal.ring[1] as usize];
        star.collect(places, ring, removal, flat);
        let Some(place) = star.place(removal, ring, flat, places) else { return false };
        flat[removal.vertex as usize] = star.settle(place, RETURN_STEPS);
        true
    })
}

/// Moves each vertex in turn to where the energy of its triangles is less. `incident` gives the cells of each place.
pub(super) fn sweep(cells: &[Cell], incident: &Incidence, flat: &mut [[f64; 2]]) {
    let mut star = Star::default();
    for v in 0..flat.len() {
        star.cells.clear();
        for &at in incident.of(v) {
            let cell = &cells[at as usize];
            let [a, b, c] = cell.corners;
            // The moving corner's place is put in when it is known.
            star.cells.push((*cell, [a, b, c].map(|w| flat[w as usize]), cell.corner(v as u32)));
        }
        if !star.cells.is_empty() {
            flat[v] = star.settle(flat[v], SWEEP_STEPS);
        }
    }
}

/// For each place the cells around it.
#[derive(Debug, Clone, Default)]
pub(super) struct Incidence {
    starts: Vec<u32>,
    cells: Vec<u32>,
}

impl Incidence {
    pub(super) fn new(cells: &[Cell], count: usize) -> Self {
        let mut starts = vec![0_u32; count + 1];
        for v in cells.iter().flat_map(|cell| cell.corners) {
            starts[v as usize + 1] += 1;
        }
        for v in 0..count {
            starts[v + 1] += starts[v];
        }
        let mut fill = starts.clone();
        let mut list = vec![0; starts[count] as usize];
        for (at, cell) in cells.iter().enumerate() {
            for v in cell.corners {
                list[fill[v as usize] as usize] = at as u32;
                fill[v as usize] += 1;
            }
        }
        Self { starts, cells: list }
    }

    fn of(&self, v: usize) -> &[u32] {
        &self.cells[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

/// The triangles around one vertex, with their corners' places and which of them is the vertex.
#[derive(Default)]
struct Star {
    cells: Vec<(Cell, [[f64; 2]; 3], usize)>,
}

impl Star {
    /// The triangles of a removed vertex.
    fn collect(&mut self, places: &[DVec3], ring: &[u32], removal: &Removal, flat: &[[f64; 2]]) {
        self.cells.clear();
        for i in 0..if removal.closed { ring.len() } else { ring.len() - 1 } {
            let corners = [removal.vertex, ring[i], ring[(i + 1) % ring.len()]];
            if let Some(cell) = cell(corners.map(|v| places[v as usize]), corners, 1.0) {
                let corner = cell.corner(removal.vertex);
                self.cells.push((cell, cell.corners.map(|v| flat[v as usize]), corner));
            }
        }
    }

    fn energy(&mut self, place: [f64; 2]) -> f64 {
        let mut sum = 0.0;
        for (cell, corners, own) in &mut self.cells {
            corners[*own] = place;
            let [a, b, c] = *corners;
            let jet = cell.jet_of([[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]]);
            sum += cell.weight * BALANCED.value(&jet);
        }
        sum
    }

    /// A place for a vertex that returns: at the mean of its ring with its distances in space, else near its neighbour.
    fn place(&mut self, removal: &Removal, ring: &[u32], flat: &[[f64; 2]], places: &[DVec3]) -> Option<[f64; 2]> {
        let own = places[removal.vertex as usize];
        let at = |v: u32| flat[v as usize];
        let (mut sum, mut weights) = ([0.0; 2], 0.0);
        let count = ring.len();
        for (i, &w) in ring.iter().enumerate() {
            // Mean value coordinates (Floater 2003) in the flattened star; open stars have only one side at their ends.
            let to = places[w as usize] - own;
            let mut half_tangents = 0.0;
            for other in [(i + 1) % count, (i + count - 1) % count] {
                let wraps = !removal.closed && (i.abs_diff(other) != 1);
                if !wraps {
                    let (a, b) = (to, places[ring[other] as usize] - own);
                    let (sin, cos) = (a.cross(b).length(), a.dot(b));
                    half_tangents += sin / ((sin * sin + cos * cos).sqrt() + cos).max(f64::MIN_POSITIVE);
                }
            }
            let weight = half_tangents / to.length().max(f64::MIN_POSITIVE);
            let p = at(w);
            sum = [sum[0] + weight * p[0], sum[1] + weight * p[1]];
            weights += weight;
        }
        let mean = sum.map(|x| x / weights);
        if removal.closed && self.energy(mean) < f64::INFINITY {
            return Some(mean);
        }
        // Towards where both edges at the neighbour are on the left.
        let u = at(removal.into);
        let k = ring.iter().position(|&w| w == removal.into)?;
        let unit = |w: u32| {
            let d = [at(w)[0] - u[0], at(w)[1] - u[1]];
            let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
            (d.map(|x| x / length), length)
        };
        let (next, previous) = (ring[(k + 1) % count], ring[(k + count - 1) % count]);
        let (direction, mut length) = if removal.closed {
            let ((a, first), (b, second)) = (unit(next), unit(previous));
            ([b[1] - a[1], a[0] - b[0]], first.min(second))
        } else {
            // Along the chord of the border, a little outwards.
            let other = if k == 0 { ring[count - 1] } else { ring[0] };
            let (a, b) = (unit(other), unit(if k == 0 { next } else { previous }));
            let outward = if k == 0 { [-b.0[1], b.0[0]] } else { [b.0[1], -b.0[0]] };
            let share = own.distance(places[removal.into as usize])
                / (own.distance(places[removal.into as usize]) + own.distance(places[other as usize]));
            let along = [u[0] + share * a.1 * a.0[0], u[1] + share * a.1 * a.0[1]];
            if self.energy(along) < f64::INFINITY {
                return Some(along);
            }
            (outward, a.1.min(b.1))
        };
        for _ in 0..APPROACHES {
            let place = [u[0] + length * direction[0], u[1] + length * direction[1]];
            if self.energy(place) < f64::INFINITY {
                return Some(place);
            }
            length *= 0.5;
        }
        None
    }

    /// Newton's method for the one vertex.
    fn settle(&mut self, mut place: [f64; 2], steps: usize) -> [f64; 2] {
        let total: f64 = self.cells.iter().map(|(cell, ..)| cell.weight).sum();
        let mut energy = self.energy(place);
        for _ in 0..steps {
            if energy == f64::INFINITY {
                break;
            }
            let curvature = if energy > FAR * total { Curvature::Secant } else { PROJECTED };
            let Some(step) = self.step(place, curvature) else { break };
            let (mut share, before) = (1.0, energy);
            for _ in 0..HALVINGS {
                let next = [place[0] + share * step[0], place[1] + share * step[1]];
                let reached = self.energy(next);
                if reached < energy {
                    (place, energy) = (next, reached);
                    break;
                }
                share *= 0.5;
            }
            if energy > (1.0 - ENOUGH) * before {
                break;
            }
        }
        place
    }

    fn step(&mut self, place: [f64; 2], curvature: Curvature) -> Option<[f64; 2]> {
        let (mut slope, mut matrix) = ([0.0; 2], [0.0; 3]);
        for (cell, corners, own) in &mut self.cells {
            corners[*own] = place;
            let [a, b, c] = *corners;
            let jet = cell.jet_of([[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]]);
            let Derivatives { gradient, hessian } = BALANCED.derivatives(&jet, curvature);
            let rows = columns_of(cell.hat(*own));
            let images = rows.map(|row| hessian.map(|line| (0..4).map(|k| line[k] * row[k]).sum::<f64>()));
            let dot = |a: &[f64; 4], b: &[f64; 4]| (0..4).map(|k| a[k] * b[k]).sum::<f64>();
            for d in 0..2 {
                slope[d] += cell.weight * dot(&rows[d], &gradient);
            }
            matrix[0] += cell.weight * dot(&rows[0], &images[0]);
            matrix[1] += cell.weight * dot(&rows[0], &images[1]);
            matrix[2] += cell.weight * dot(&rows[1], &images[1]);
        }
        let [a, b, c] = matrix;
        let det = a * c - b * b;
        let step = [(b * slope[1] - c * slope[0]) / det, (b * slope[0] - a * slope[1]) / det];
        (det > 0.0 && step[0].is_finite() && step[1].is_finite()).then_some(step)
    }
}
