//! The last step of drawing: curves are fitted through the samples of outlines, holes, sew lines and lines of marks, and the
//! polylines keep the points that their tolerance needs.
//!
//! All that is done to pieces before works on the samples and need not know of curves; mirror images are made after it
//! and are those of the curves.

use glam::DVec2;

use super::fitting::fits;
use super::outline::{OF_LOOP, SAME_POINT, thinned};
use super::{Contour, Fits, Pattern};
use crate::engine::budget::Observer;
use crate::engine::distortion::{CurvesReport, FormReport};
use crate::engine::error::EngineError;

/// The tolerances of a pattern's curves, millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CurveTolerances {
    /// Between the mapped curve and what is fitted; 0 where nothing is to be fitted.
    pub fitted: f64,
    /// Between the samples and the points that are kept of them; `None`: all are kept.
    pub kept: Option<f64>,
}

/// Fits and thins all contours, and fits the lines of marks.
pub(super) fn settle(
    pattern: &mut Pattern,
    tolerances: CurveTolerances,
    observer: &dyn Observer,
) -> Result<(), EngineError> {
    for piece in &mut pattern.pieces {
        let contours = std::iter::once(&mut piece.outline).chain(&mut piece.holes).chain(&mut piece.sew);
        for contour in contours {
            observer.check()?;
            contour.fits = fits(&contour.points, &contour.corners, true, tolerances.fitted);
            thin(contour, tolerances, observer)?;
        }
        for mark in &mut piece.marks {
            observer.check()?;
            mark.fits = fits(&mark.points, &mark.corners, mark.closed, tolerances.fitted);
        }
    }
    Ok(())
}

fn thin(contour: &mut Contour, tolerances: CurveTolerances, observer: &dyn Observer) -> Result<(), EngineError> {
    let Some(kept) = tolerances.kept else { return Ok(()) };
    // What is to be told apart is told apart by the first point.
    if contour.corners.len() != contour.points.len() {
        contour.corners.resize(contour.points.len(), false);
    }
    let size = size(&contour.points);
    let (points, corners) =
        thinned(&contour.points, &contour.corners, kept.min(0.5 * OF_LOOP * size), SAME_POINT * size, observer)?;
    if points.len() > 2 {
        (contour.points, contour.corners) = (points, corners);
    }
    Ok(())
}

/// The diagonal of the box about points.
pub(super) fn size(points: &[DVec2]) -> f64 {
    let low = points.iter().fold(DVec2::INFINITY, |m, p| m.min(*p));
    let high = points.iter().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p));
    if low.is_finite() { low.distance(high) } else { 0.0 }
}

/// What is told of the curves of outlines and holes; `None` where nothing was fitted.
pub(super) fn curves_report(pattern: &Pattern) -> Option<CurvesReport> {
    let contours = || pattern.pieces.iter().flat_map(|p| std::iter::once(&p.outline).chain(&p.holes));
    let form = |of: fn(&Fits) -> Option<&super::Fit>| {
        contours().map(|c| of(&c.fits)).try_fold(FormReport::default(), |so_far, fit| {
            let fit = fit?;
            Some(FormReport {
                entities: so_far.entities + if fit.circle.is_some() { 1 } else { fit.segments.len() as u64 },
                deviation_mm: so_far.deviation_mm.max(fit.deviation_mm),
            })
        })
    };
    Some(CurvesReport { arcs: form(|f| f.arcs.as_ref())?, spline: form(|f| f.spline.as_ref())? })
}
