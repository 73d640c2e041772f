//! Which triangles of a base mesh belong to the part, and where its middle is.
//!
//! With `domain: base` the whole underlying surface is meshed and flattened (thesis 4.4.3); the part is what lies inside
//! the trimming loops. A triangle meets the part when a loop passes through its interior, or when it lies inside: each
//! chord of a loop is tested against the triangles along it (separating lines, exact signs), and a triangle that no chord
//! enters is inside when its centroid is, by the parity of crossings. A loop that runs along edges enters neither side.

use glam::DVec2;

use super::locator::{Locator, orientation};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::triangulation::Lifted;
use crate::engine::trimming::TrimRegion;

/// For each triangle of the mesh (`lifted.mesh`) whether it meets the part that `region` bounds.
///
/// For the mesh of a trimmed domain every triangle does; this is for meshes of the whole base surface. `locator` is that
/// of the domain mesh.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub fn triangles_of_part(
    lifted: &Lifted,
    locator: &Locator<'_>,
    region: &TrimRegion,
    observer: &dyn Observer,
) -> Result<Vec<bool>, EngineError> {
    let mut part = vec![false; lifted.mesh.triangles.len()];
    if region.natural {
        part.fill(true);
        return Ok(part);
    }
    let chords = Chords::new(region);
    let mut entered = vec![false; lifted.domain.triangles.len()];
    for (k, &[a, b]) in chords.list.iter().enumerate() {
        if k.is_multiple_of(BETWEEN_CHECKS) {
            observer.check()?;
        }
        locator.along(a, b, |t| {
            let seen = &mut entered[t as usize];
            *seen = *seen || enters([a, b], locator.corners(t));
        });
    }
    for (t, &to) in lifted.triangle_of.iter().enumerate() {
        if t.is_multiple_of(BETWEEN_CHECKS) {
            observer.check()?;
        }
        if let Some(belongs) = part.get_mut(to as usize) {
            *belongs = entered[t] || {
                let [a, b, c] = locator.corners(t as u32);
                chords.contain((a + b + c) / 3.0)
            };
        }
    }
    Ok(part)
}

/// The area centroid of the part in the domain, for each of `count` pieces of the mesh: triangles' middles in (u, v),
/// weighted by their areas in space. `None` where no triangle of the piece belongs to the part.
pub(super) fn area_centroids(lifted: &Lifted, part: &[bool], piece_of: &[u32], count: usize) -> Vec<Option<DVec2>> {
    let mut sums = vec![(DVec2::ZERO, 0.0); count];
    for (corners, &to) in lifted.domain.triangles.iter().zip(&lifted.triangle_of) {
        let Some(triangle) = lifted.mesh.triangles.get(to as usize) else { continue };
        if !part.get(to as usize).copied().unwrap_or(false) {
            continue;
        }
        let [a, b, c] = triangle.map(|k| lifted.mesh.positions[k as usize]);
        let size = (b - a).cross(c - a).length();
        let middle: DVec2 = corners.iter().map(|&k| lifted.domain.uv[k as usize]).sum::<DVec2>() / 3.0;
        let (sum, area) = &mut sums[piece_of[to as usize] as usize];
        *sum += middle * size;
        *area += size;
    }
    sums.into_iter().map(|(sum, area)| (area > 0.0).then(|| sum / area)).collect()
}

/// True when a chord meets the interior of a triangle: no line along an edge or along the chord separates them.
fn enters(chord: [DVec2; 2], corners: [DVec2; 3]) -> bool {
    let [a, b] = chord;
    if a == b {
        return false;
    }
    let beyond_edge = (0..3).any(|e| chord.iter().all(|&p| orientation(corners[e], corners[(e + 1) % 3], p) <= 0.0));
    let sides = corners.map(|c| orientation(a, b, c));
    let one_side = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
    !beyond_edge && !one_side
}

/// Chords or triangles that are looked at between two questions whether to go on: a chord may run along thousands of
/// triangles, so few.
const BETWEEN_CHECKS: usize = 256;

/// The chords of all loops, in strips of v for fast crossing counts.
struct Chords {
    list: Vec<[DVec2; 2]>,
    low: f64,
    /// Strips per unit of v.
    rate: f64,
    /// For each strip the chords that reach into it.
    strips: Vec<Vec<u32>>,
}

/// The most strips; more would only cost memory.
const MOST_STRIPS: usize = 4096;

impl Chords {
    fn new(region: &TrimRegion) -> Self {
        let mut list = Vec::new();
        for l in &region.loops {
            let next = l.points.iter().skip(1).chain(l.points.first());
            list.extend(l.points.iter().zip(next).map(|(&a, &b)| [a, b]));
        }
        let heights = || list.iter().flatten().map(|p| p.y);
        let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let count = list.len().clamp(1, MOST_STRIPS);
        let rate = if high > low { count as f64 / (high - low) } else { 0.0 };
        let mut chords = Self { list, low, rate, strips: vec![Vec::new(); count] };
        for (k, &[a, b]) in chords.list.iter().enumerate() {
            let (first, last) = (chords.strip(a.y.min(b.y)), chords.strip(a.y.max(b.y)));
            for strip in &mut chords.strips[first..=last] {
                strip.push(k as u32);
            }
        }
        chords
    }

    /// The strip of a height. Monotone in `v`, which is all that correctness needs.
    fn strip(&self, v: f64) -> usize {
        (((v - self.low) * self.rate) as usize).min(self.strips.len() - 1)
    }

    /// True when an odd number of chords cross the ray from `p` towards +u.
    fn contain(&self, p: DVec2) -> bool {
        let crossed = self.strips[self.strip(p.y)].iter().filter(|&&k| {
            let [a, b] = self.list[k as usize];
            // Half open in v, so that a vertex on the ray counts once or twice as it should.
            (a.y <= p.y) != (b.y <= p.y) && (orientation(a, b, p) > 0.0) == (a.y < b.y)
        });
        crossed.count() % 2 == 1
    }
}
