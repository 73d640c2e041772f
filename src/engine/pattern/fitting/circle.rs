//! A closed curve that is one circle within the tolerance.

use glam::DVec2;

use super::clean::Clean;
use super::distance_to_segment;
use crate::engine::pattern::{Fit, Segment};

/// Samples that a circle is laid through at the most; all are measured.
const THROUGH: usize = 4096;

/// The circle of all samples, as two arcs of half a turn. `None` where it leaves them by more than the tolerance.
pub(super) fn fit(clean: &Clean) -> Option<Fit> {
    let (centre, radius) = circle(clean.points())?;
    // The polyline of the samples, from each point, to points of the circle: the samples themselves and what lies farthest
    // between them.
    let (mut worst, mut turned) = (0.0_f64, 0.0);
    for w in clean.points().windows(2) {
        let out = [w[0] - centre, w[1] - centre];
        worst = worst.max((out[0].length() - radius).abs());
        let middle =
            centre + (out[0].normalize_or(DVec2::X) + out[1].normalize_or(DVec2::X)).normalize_or(DVec2::X) * radius;
        worst = worst.max(distance_to_segment(middle, w[0], w[1]));
        if worst.is_nan() || worst > clean.tolerance {
            return None;
        }
        turned += out[0].perp_dot(out[1]).atan2(out[0].dot(out[1]));
    }
    // Once around, and not there and back.
    let bulge = if (turned.abs() - std::f64::consts::TAU).abs() < 1.0 { turned.signum() } else { return None };
    let out = (clean.points()[0] - centre).normalize_or(DVec2::X) * radius;
    let start = centre + out;
    Some(Fit {
        start,
        segments: vec![Segment::Arc { to: centre - out, bulge }, Segment::Arc { to: start, bulge }],
        circle: Some((centre, radius)),
        corners: vec![false; 2],
        deviation_mm: worst + clean.moved,
    })
}

/// The circle of least squares in the squared radius (Kasa 1976), its radius in the middle of what the samples' are.
fn circle(points: &[DVec2]) -> Option<(DVec2, f64)> {
    let step = points.len().div_ceil(THROUGH);
    let taken = || points.iter().copied().step_by(step);
    let count = taken().count() as f64;
    let middle = taken().sum::<DVec2>() / count;
    let (mut xx, mut xy, mut yy, mut cubes) = (0.0, 0.0, 0.0, DVec2::ZERO);
    for d in taken().map(|p| p - middle) {
        (xx, xy, yy) = (xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y);
        cubes += d * d.length_squared();
    }
    let determinant = xx * yy - xy * xy;
    // Half of the normal equations' solution.
    let from_middle = DVec2::new(cubes.x * yy - cubes.y * xy, cubes.y * xx - cubes.x * xy) / (2.0 * determinant);
    let centre = middle + from_middle;
    let radii = || points.iter().map(|p| p.distance(centre));
    let (least, most) = (radii().fold(f64::INFINITY, f64::min), radii().fold(0.0, f64::max));
    let radius = 0.5 * (least + most);
    (centre.is_finite() && radius.is_finite() && radius > 0.0).then_some((centre, radius))
}
