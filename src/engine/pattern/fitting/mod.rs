//! Curves through samples: a dense polyline becomes lines with circular arcs, and lines with cubic Bezier curves.
//!
//! Between corners a run of samples is taken apart into what is straight by itself ([`straight`]) and what lies between.
//! There one segment after the other is made as long as the tolerance lets it: a cubic by least squares of its distances
//! from the samples ([`cubic`]), an arc or a pair of tangent arcs in closed form ([`arc`]). Joints lie on samples, and
//! both sides share the tangent there ([`run`]), so joints that are no corners are tangent. A closed curve that is a
//! circle within the tolerance becomes one ([`circle`]).
//!
//! Each segment is measured against its samples both ways: each sample to the segment, and points of the segment,
//! closer together than the samples, to the polyline of the samples. Where no curve fits within the tolerance
//! chords stand. So what is returned is always within it. Work is O(n log n) in the samples.
//!
//! Sources: Schneider (1990) and Plass and Stone (1983) for cubics by least squares with corrected parameters, Wang, Pottmann and Liu
//! (2006) for distances along normals; Bolton (1975) and Meek and Walton (1995) for biarcs; Kasa (1976) for circles; Piegl and Tiller (1997), 9.4,
//! for the longest segment first. Millimetres.

mod arc;
mod arcs;
mod circle;
mod clean;
mod cubic;
mod joined;
mod reach;
mod run;
mod spline;
mod straight;
#[cfg(test)]
mod tests;

use glam::DVec2;

use self::clean::Clean;
use self::joined::{Joined, Joint};
use self::run::Run;
use super::{Fit, Fits};

/// The part of the tolerance by which the mapped curve may leave the polyline of its samples; the rest is the fit's.
pub(super) const SAMPLED: f64 = 1.0 / 8.0;

/// A curve is fitted at least this finely relative to its own size, however coarse the tolerance: small holes keep their shape.
const OF_SIZE: f64 = 0.01;

/// The tolerance is at least this part of the greatest coordinate: below it distances are rounding.
const FINEST: f64 = 1e-12;

/// Directions that differ by less, radians, are one: far below what a machine turns by, far above rounding.
const TANGENT: f64 = 1e-4;

/// Fits a curve that is given by samples in both forms. Without at least two points that are apart, with numbers that
/// are not finite or without a positive tolerance there is nothing to fit, and both forms are left out.
///
/// `corners` tells which samples are corners; missing ones are none. A closed curve does not repeat its first point.
/// The fit leaves the polyline of the samples by less than `tolerance` (1 - [`SAMPLED`]); `deviation_mm` is by how much.
pub fn fits(points: &[DVec2], corners: &[bool], closed: bool, tolerance: f64) -> Fits {
    let Some(clean) = Clean::new(points, corners, closed, tolerance) else { return Fits::default() };
    if closed && let Some(fit) = circle::fit(&clean) {
        return Fits { arcs: Some(fit.clone()), spline: Some(fit) };
    }
    let runs = clean.runs();
    let form = |join: fn(&Run<'_>) -> Joined| {
        let mut fit = Fit { start: runs.first().map_or(DVec2::ZERO, |r| r.points()[0]), ..Fit::default() };
        for run in &runs {
            let tried = ASKED.iter().find_map(|&asked| {
                let joined = join(&run.asking(asked));
                let off = joined.measured(run);
                (off <= run.tolerance).then_some((joined, off))
            });
            let (joined, off) = tried.unwrap_or_else(|| {
                let joined = Joined::chords(run);
                let off = joined.measured(run);
                (joined, off)
            });
            fit.deviation_mm = fit.deviation_mm.max(off + clean.moved);
            for Joint { segment, corner, .. } in joined.joints {
                fit.segments.push(segment);
                fit.corners.push(corner);
            }
        }
        fit
    };
    Fits { arcs: Some(form(arcs::join)), spline: Some(form(spline::join)) }
}

/// Parts of the tolerance that are asked of what is measured coarsely, one after the other until what is measured finely is within
/// all of it.
const ASKED: [f64; 3] = [0.96, 0.85, 0.6];

/// Points of a segment that are measured at least, however few its samples are.
const LEAST_MEASURED: usize = 48;

/// Distance of a point from a segment.
fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (edge, to) = (b - a, p - a);
    let square = edge.length_squared();
    let x = if square > 0.0 { (to.dot(edge) / square).clamp(0.0, 1.0) } else { 0.0 };
    to.distance(edge * x)
}

/// The angle between two directions, from 0 to a half turn.
fn angle(a: DVec2, b: DVec2) -> f64 {
    a.perp_dot(b).atan2(a.dot(b)).abs()
}
