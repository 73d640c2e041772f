//! How large a trimmed part is in space: the box of samples of its boundary and of its inside.
//!
//! The box is a scale for tolerances and a figure for people, not a bound: a bulge between samples may stick out of it.

use glam::{DVec2, DVec3};

use super::TrimRegion;
use crate::engine::nurbs::Surface;

/// Samples between two neighbouring points of a loop: straight iso-parametric pieces have no points of their own.
const ALONG: usize = 8;
/// Rows across the region, and samples in each stretch of a row that lies inside.
const ACROSS: usize = 16;

/// Least and greatest corner of the part, in the surface's own coordinates.
#[must_use]
pub fn part_box(surface: &Surface, region: &TrimRegion) -> [DVec3; 2] {
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    let mut add = |uv: DVec2| {
        let p = surface.point(uv.x, uv.y);
        low = low.min(p);
        high = high.max(p);
    };
    let mut bounds = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    for [a, b] in region.loops.iter().flat_map(super::BoundaryLoop::segments) {
        bounds = [bounds[0].min(a), bounds[1].max(a)];
        let steps = if a.x == b.x || a.y == b.y { ALONG } else { 1 };
        for i in 0..steps {
            add(a.lerp(b, i as f64 / steps as f64));
        }
    }
    let mut crossings = Vec::new();
    for row in 0..ACROSS {
        let v = bounds[0].y + (bounds[1].y - bounds[0].y) * (row as f64 + 0.5) / ACROSS as f64;
        crossings.clear();
        for [a, b] in region.loops.iter().flat_map(super::BoundaryLoop::segments) {
            if (a.y > v) != (b.y > v) {
                crossings.push(a.x + (b.x - a.x) * (v - a.y) / (b.y - a.y));
            }
        }
        crossings.sort_unstable_by(f64::total_cmp);
        for inside in crossings.chunks_exact(2) {
            for i in 1..ACROSS {
                add(DVec2::new(inside[0] + (inside[1] - inside[0]) * i as f64 / ACROSS as f64, v));
            }
        }
    }
    if low.cmple(high).all() { [low, high] } else { surface.bounding_box() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::nurbs::KnotVector;
    use crate::engine::trimming::{Side, TrimmedSurface};

    #[test]
    fn a_dome_is_as_high_as_its_middle_and_not_as_its_net() {
        let knots = || KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], "knots").unwrap();
        let height = |i: usize, j: usize| if i == 1 && j == 1 { 4.0 } else { 0.0 };
        let control = (0..9).map(|k| DVec3::new((k / 3) as f64, (k % 3) as f64, height(k / 3, k % 3))).collect();
        let surface = Surface::new(knots(), knots(), control, None).unwrap();
        let whole = TrimmedSurface { surface: surface.clone(), loops: Vec::new(), side: Side::Normal };
        let region = whole.check().unwrap().polygonise(&surface, 0.01).unwrap();
        let [low, high] = part_box(&surface, &region);
        assert_eq!(low, DVec3::ZERO);
        assert_eq!((high.x, high.y), (2.0, 2.0));
        // The middle of the dome is at a quarter of the middle control point.
        assert!((high.z - 1.0).abs() < 0.02, "{high}");
    }
}
