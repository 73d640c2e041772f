//! From checked loops to the polygonised domain (thesis 3.1): see `chord` for how points are placed.

use super::check::{MAX_POINTS, report};
use super::checked::CheckedTrims;
use super::chord::{Chords, Metric};
use super::crossing::{Outline, cross_free};
use super::mend::Frame;
use super::{BoundaryLoop, CurvePoint, TrimRegion, TrimmingError};
use crate::engine::nurbs::Surface;

/// The finest tolerance, relative to the surface's diagonal: what is asked below it is rounded up to it. Rounding in a
/// point of the surface is near 1e-15 of the diagonal, and a curve's deviation can be told from it down to about here.
const FINEST_TOLERANCE: f64 = 1e-10;

impl CheckedTrims {
    /// Polylines of the loops whose chords stay within `tolerance_mm` of the curves on `surface`, the surface that the
    /// trims were checked with. Loops in the order of the file; even depth anticlockwise, odd depth clockwise.
    ///
    /// Straight pieces along a line of constant u or v have no inner points (the grid cuts them), nor have straight ones
    /// on a plane. Points on the border of the domain are on it bit for bit. No two loops cross, at any tolerance.
    ///
    /// # Errors
    /// [`TrimmingError::TooIntricate`] when the tolerance asks for too many points; [`TrimmingError::SelfIntersection`] and
    /// [`TrimmingError::LoopsIntersect`] when polylines cross however fine they are made; [`TrimmingError::Empty`] when
    /// a loop has no three different points.
    pub fn polygonise(&self, surface: &Surface, tolerance_mm: f64) -> Result<TrimRegion, TrimmingError> {
        let frame = Frame::new(surface);
        let [low, high] = surface.bounding_box();
        // `max` also takes a tolerance that is not a number to the finest one.
        let tolerance = tolerance_mm.max(FINEST_TOLERANCE * low.distance(high));
        let mut outline = Outline::default();
        let mut chords = Chords::new(self, Metric::of(surface), tolerance);
        for (index, checked) in self.loops.iter().enumerate() {
            let start = outline.points.len();
            if !chords.whole(checked, &mut outline.points, MAX_POINTS) {
                return Err(TrimmingError::TooIntricate { what: "points on the loops", limit: MAX_POINTS });
            }
            let first = outline.points[start].uv;
            if !outline.close(index, start) {
                let loop_index = checked.source_loop.unwrap_or_default();
                return Err(TrimmingError::Empty { loop_index, place: frame.place(loop_index, None, None, first) });
            }
        }
        // Polylines that are the curves themselves have been looked at by the check.
        if outline.points.iter().any(|p| p.deviation > 0.0) {
            let verdict = cross_free(self, &mut outline, None)
                .map_err(|limit| TrimmingError::TooIntricate { what: "pairs of neighbouring segments", limit })?;
            let mut errors = Vec::new();
            report(&frame, self, &verdict.crossings, &mut errors);
            if let Some(error) = errors.into_iter().next() {
                return Err(error);
            }
        }
        Ok(self.region(&outline))
    }

    /// The region within an outline that has all loops.
    fn region(&self, outline: &Outline) -> TrimRegion {
        let loops = outline.loops.iter().map(|(index, range)| {
            let checked = &self.loops[*index];
            let points = &outline.points[range.clone()];
            let sources = if self.natural {
                Vec::new()
            } else {
                let source = |p: &super::chord::ChordPoint| CurvePoint {
                    curve: checked.curves[p.place as usize].curve as u32,
                    t: p.t[0],
                };
                points.iter().map(source).collect()
            };
            BoundaryLoop {
                points: points.iter().map(|p| p.uv).collect(),
                sources,
                corners: points.iter().map(|p| p.corner).collect(),
                source_loop: checked.source_loop,
                depth: checked.depth,
                parent: checked.parent,
            }
        });
        TrimRegion { loops: loops.collect(), natural: self.natural }
    }
}
