//! A start for parts that wind around a place by more than a full turn: the map that overlaps, drawn out to a spiral.
//!
//! Around a centre that the map does not cover, every point has a distance r and, followed through the part, an angle t
//! that goes on beyond a full turn. The spiral takes t to t' and r to r + p t' / 2 pi: what lay one turn apart lies p
//! apart, and with p as wide as the part nothing meets. t' keeps the lengths at the mean distance R from the centre:
//! R t' + p t'^2 / 4 pi = t R. That is far nearer to the least than the convex map; and since one end goes inside of the
//! other, it does not end with both ends pressed against each other.
//!
//! Whether it really does not overlap, the sweep over its borders tells.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use crate::engine::budget::Observer;
use crate::engine::distortion::overlaps;
use crate::engine::error::EngineError;
use crate::engine::flattening::isometric::BALANCED;
use crate::engine::flattening::isometric::cholesky::Graph;
use crate::engine::flattening::isometric::shape::Shape;
use crate::engine::mesh::Topology;

/// Places along each side of the map's box that are tried as the centre.
const PLACES: usize = 32;

/// Halvings between no pitch and the greatest that could be needed.
const HALVINGS: usize = 7;

/// The pitch is greater than the least that was found by this part, so that borders do not start with touching.
const MARGIN: f64 = 0.02;

/// Angles of one vertex that differ by less are the same.
const SAME: f64 = 1e-6;

/// Spirals of a map, one for each end that can be the inner one, which have neither flips nor overlaps.
///
/// # Errors
/// [`EngineError::Cancelled`].
pub(super) fn spirals(
    (shape, topology): (&Shape, &Topology),
    free: &[DVec2],
    observer: &dyn Observer,
) -> Result<Vec<Vec<[f64; 2]>>, EngineError> {
    let mut found = Vec::new();
    let Some(centre) = centre(topology, free, observer)? else { return Ok(found) };
    let Some(polar) = Polar::new(topology, free, centre) else { return Ok(found) };
    for inward in [false, true] {
        found.extend(polar.spiral(shape, topology, inward, observer)?);
    }
    Ok(found)
}

/// The place farthest from all borders around which these wind by more than a full turn, there and back.
fn centre(topology: &Topology, free: &[DVec2], observer: &dyn Observer) -> Result<Option<DVec2>, EngineError> {
    let nodes = || topology.borders().flatten().map(|&h| free[topology.origin(h) as usize]);
    let low = nodes().fold(DVec2::INFINITY, DVec2::min);
    let high = nodes().fold(DVec2::NEG_INFINITY, DVec2::max);
    let mut best = (0.0, None);
    for j in 0..PLACES {
        observer.check()?;
        for i in 0..PLACES {
            let part = DVec2::new(i as f64 + 0.5, j as f64 + 0.5) / PLACES as f64;
            let place = low + part * (high - low);
            let clear = nodes().map(|p| p.distance_squared(place)).fold(f64::INFINITY, f64::min);
            if clear > best.0 && winds(topology, free, place) {
                best = (clear, Some(place));
            }
        }
    }
    Ok(best.1)
}

/// Whether the angles of a border around a place span more than a full turn, while no border goes around it once and for
/// all (it would be covered, or in a hole that cannot be opened).
fn winds(topology: &Topology, free: &[DVec2], place: DVec2) -> bool {
    let mut span: f64 = 0.0;
    for border in topology.borders() {
        let (mut angle, mut least, mut most) = (0.0_f64, 0.0_f64, 0.0_f64);
        for &h in border {
            angle += turn(free, [topology.origin(h), topology.target(h)], place);
            (least, most) = (least.min(angle), most.max(angle));
        }
        if angle.abs() > PI {
            return false;
        }
        span = span.max(most - least);
    }
    span > TAU
}

/// The angle from one vertex to another as seen from a place.
fn turn(free: &[DVec2], [a, b]: [u32; 2], place: DVec2) -> f64 {
    (free[a as usize] - place).angle_to(free[b as usize] - place)
}

/// Distances from the centre, and angles that go on beyond a full turn. NaN for vertices of no triangle.
struct Polar {
    distance: Vec<f64>,
    angle: Vec<f64>,
}

impl Polar {
    /// `None` when the angles do not fit together.
    fn new(topology: &Topology, free: &[DVec2], centre: DVec2) -> Option<Self> {
        let edges = || (0..topology.edge_count() as u32).map(|e| topology.edge_vertices(e));
        let graph = Graph::of_edges(free.len(), edges());
        let mut angle = vec![f64::NAN; free.len()];
        let first = topology.triangles().first()?[0];
        angle[first as usize] = 0.0;
        let mut open = vec![first];
        while let Some(a) = open.pop() {
            for &b in graph.of(a) {
                if angle[b as usize].is_nan() {
                    angle[b as usize] = angle[a as usize] + turn(free, [a, b], centre);
                    open.push(b);
                }
            }
        }
        let fits = |[a, b]: [u32; 2]| (angle[b as usize] - angle[a as usize] - turn(free, [a, b], centre)).abs() < SAME;
        let distance = free.iter().map(|p| p.distance(centre)).collect();
        edges().all(fits).then_some(Self { distance, angle })
    }

    /// The spiral with the least pitch at which nothing meets.
    fn spiral(
        &self,
        shape: &Shape,
        topology: &Topology,
        inward: bool,
        observer: &dyn Observer,
    ) -> Result<Option<Vec<[f64; 2]>>, EngineError> {
        let known = || self.distance.iter().zip(&self.angle).filter(|(_, t)| !t.is_nan());
        let width = known().fold(0.0, |most: f64, (r, _)| most.max(*r))
            - known().fold(f64::INFINITY, |least: f64, (r, _)| least.min(*r));
        let sound = |pitch: f64| -> Result<Option<Vec<[f64; 2]>>, EngineError> {
            let flat = self.drawn_out(pitch, inward);
            if shape.energy(BALANCED, &flat) == f64::INFINITY {
                return Ok(None);
            }
            let places: Vec<DVec2> = flat.iter().map(|&p| p.into()).collect();
            let found = overlaps(&places, topology, observer)?;
            Ok((found.complete && found.regions.is_empty()).then_some(flat))
        };
        // The greatest pitch, with room for the chords of the border.
        let (mut low, mut high) = (0.0, 2.0 * width);
        let mut best = sound(high)?;
        if best.is_none() {
            return Ok(None);
        }
        for _ in 0..HALVINGS {
            let pitch = 0.5 * (low + high);
            match sound(pitch)? {
                Some(_) => high = pitch,
                None => low = pitch,
            }
        }
        if let Some(closer) = sound((1.0 + MARGIN) * high)? {
            best = Some(closer);
        }
        Ok(best)
    }

    fn drawn_out(&self, pitch: f64, inward: bool) -> Vec<[f64; 2]> {
        let known = || self.distance.iter().zip(&self.angle).filter(|(_, t)| !t.is_nan());
        let least = known().fold(f64::INFINITY, |least: f64, (_, t)| least.min(*t));
        let most = known().fold(f64::NEG_INFINITY, |most: f64, (_, t)| most.max(*t));
        let (sum, number) = known().fold((0.0, 0_usize), |(sum, number), (r, _)| (sum + r, number + 1));
        let mean = sum / number.max(1) as f64;
        let rise = pitch / TAU;
        self.distance
            .iter()
            .zip(&self.angle)
            .map(|(r, t)| {
                if t.is_nan() {
                    return [0.0; 2];
                }
                let along = if inward { most - t } else { t - least };
                // The positive root of rise / 2 x^2 + mean x = mean along, without cancellation.
                let x = 2.0 * mean * along / (mean + (mean * mean + 2.0 * rise * mean * along).sqrt());
                let place = (r + rise * x) * DVec2::from_angle(if inward { -x } else { x });
                place.to_array()
            })
            .collect()
    }
}
