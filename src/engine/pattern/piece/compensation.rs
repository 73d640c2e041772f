//! Pieces made larger or smaller for a material that shrinks, or is stretched when it is put in place.
//!
//! A piece is scaled by `1 + percent / 100` along its grain and across it, or along x and y where it has no grain. Its
//! least corner stays where it was; pieces that lay side by side keep the distance that they had. Fits are dropped: an
//! arc does not stay one. Depths of notches and diameters of drill points are those of tools and stay; a notch's
//! direction stays normal to the outline. Distortion is measured of the flattening, before any of this.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::{bounds, each_point, extent};
use crate::engine::pattern::{Fits, Grain, Pattern, Piece};

/// The most that a piece is compensated by, percent either way. Knits are cut smaller by up to a quarter; beyond, a
/// factor was most likely taken for a percentage.
pub const GREATEST_COMPENSATION: f64 = 30.0;

/// The `compensation` object of a job.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Compensation {
    /// Along the grain (without one along x), percent; positive makes the piece longer.
    pub along_percent: f64,
    /// Across it, percent.
    pub across_percent: f64,
}

/// A scaling along an axis and across it.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    axis: DVec2,
    factors: DVec2,
}

impl Stretch {
    fn of(compensation: Compensation, grain: Option<&Grain>) -> Self {
        let axis = grain.and_then(|g| (g.to - g.from).try_normalize()).unwrap_or(DVec2::X);
        let percent = DVec2::new(compensation.along_percent, compensation.across_percent);
        Self { axis, factors: DVec2::ONE + percent / 100.0 }
    }

    fn vector(&self, d: DVec2) -> DVec2 {
        let local = DVec2::new(d.dot(self.axis), self.axis.perp_dot(d)) * self.factors;
        self.axis * local.x + self.axis.perp() * local.y
    }

    /// A direction that is normal to a line, normal to it still.
    fn normal(&self, n: DVec2) -> DVec2 {
        Self { factors: self.factors.recip(), ..*self }.vector(n).normalize_or(n)
    }
}

/// Compensates every piece, and the sides of the seams with them.
pub(super) fn apply(pattern: &mut Pattern, compensation: Compensation) {
    if compensation == Compensation::default() {
        return;
    }
    // Between neighbours as they lay; the shift of each piece is what those before it have grown by.
    let mut grown = 0.0;
    let maps: Vec<(Stretch, DVec2, DVec2)> = pattern
        .pieces
        .iter_mut()
        .map(|piece| {
            let [low, high] = bounds(piece);
            let stretch = Stretch::of(compensation, piece.grain.as_ref());
            // The corner of the box is found of the points themselves: a box does not stay one.
            let points = || piece.outline.points.iter().map(|&p| stretch.vector(p - low));
            let least = points().fold(DVec2::INFINITY, DVec2::min);
            let most = points().fold(DVec2::NEG_INFINITY, DVec2::max);
            let to = low - least + DVec2::new(grown, 0.0);
            if low.is_finite() && most.is_finite() {
                grown += (most.x - least.x) - (high.x - low.x);
                stretched(piece, stretch, low, to);
            }
            (stretch, low, to)
        })
        .collect();
    for side in pattern.seams.iter_mut().flat_map(|seam| &mut seam.sides) {
        let Some(&(stretch, low, to)) = maps.get(side.piece as usize) else { continue };
        let before = length(&side.points);
        side.points.iter_mut().for_each(|p| *p = stretch.vector(*p - low) + to);
        if before > 0.0 {
            side.length_mm *= length(&side.points) / before;
        }
    }
    pattern.bounding_box_mm = extent(&pattern.pieces);
}

fn stretched(piece: &mut Piece, stretch: Stretch, from: DVec2, to: DVec2) {
    each_point(piece, |p| *p = stretch.vector(*p - from) + to);
    let contours = std::iter::once(&mut piece.outline).chain(&mut piece.holes).chain(&mut piece.sew);
    contours.for_each(|c| c.fits = Fits::default());
    for mark in &mut piece.marks {
        mark.fits = Fits::default();
        mark.inward = mark.inward.map(|n| stretch.normal(n));
    }
}

fn length(points: &[DVec2]) -> f64 {
    points.windows(2).map(|w| w[0].distance(w[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::pattern::piece::{Finishing, finish};
    use crate::engine::pattern::{Contour, Mark, MarkKind, Seam, SeamSide, Sense};

    fn compensated(compensation: Compensation) -> Finishing {
        Finishing { compensation: Some(compensation), ..Finishing::default() }
    }

    fn square(side: f64, x: f64) -> Piece {
        let points = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]].map(|p| DVec2::from(p) + DVec2::X * x);
        let outline = Contour { points: points.to_vec(), corners: vec![true; 4], ..Contour::default() };
        Piece { name: "piece".into(), outline, ..Piece::default() }
    }

    #[test]
    fn two_percent_along_and_one_less_across_make_102_by_99() {
        let side = SeamSide { piece: 0, points: vec![DVec2::ZERO, DVec2::X * 100.0], length_mm: 100.0 };
        let across = SeamSide { piece: 0, points: vec![DVec2::ZERO, DVec2::Y * 100.0], length_mm: 100.0 };
        let seam = Seam { sides: [side, across], length_3d_mm: 100.0, ..Seam::default() };
        let mut pattern = Pattern { pieces: vec![square(100.0, 0.0)], seams: vec![seam], ..Pattern::default() };
        finish(&mut pattern, &compensated(Compensation { along_percent: 2.0, across_percent: -1.0 }));
        assert_eq!(pattern.bounding_box_mm, [102.0, 99.0]);
        assert!((pattern.seams[0].sides[0].length_mm - 102.0).abs() < 1e-12);
        assert!((pattern.seams[0].sides[1].length_mm - 99.0).abs() < 1e-12);
        assert_eq!(pattern.seams[0].length_3d_mm, 100.0, "the surface is as long as it was");
    }

    #[test]
    fn along_means_along_the_grain() {
        let mut piece = square(100.0, 0.0);
        piece.grain = Some(Grain { from: DVec2::new(50.0, 20.0), to: DVec2::new(50.0, 80.0), sense: Sense::OneWay });
        let mut pattern = Pattern { pieces: vec![piece], ..Pattern::default() };
        finish(&mut pattern, &compensated(Compensation { along_percent: 2.0, across_percent: -1.0 }));
        let [width, height] = pattern.bounding_box_mm;
        assert!((width - 99.0).abs() < 1e-12 && (height - 102.0).abs() < 1e-12, "{width} x {height}");
    }

    #[test]
    fn areas_grow_by_the_product_of_the_factors_whatever_the_grain() {
        let mut piece = square(100.0, 0.0);
        piece.grain = Some(Grain { from: DVec2::ZERO, to: DVec2::new(2.0, 1.0), sense: Sense::Either });
        let mut pattern = Pattern { pieces: vec![piece], ..Pattern::default() };
        finish(&mut pattern, &compensated(Compensation { along_percent: 2.0, across_percent: -1.0 }));
        let p = &pattern.pieces[0].outline.points;
        let area = 0.5 * (p[2] - p[0]).perp_dot(p[3] - p[1]);
        assert!((area - 1e4 * 1.02 * 0.99).abs() < 1e-9, "{area}");
        let [low, _] = bounds(&pattern.pieces[0]);
        assert!(low.length() < 1e-12, "the piece still lies from (0, 0) on: {low}");
    }

    #[test]
    fn a_notch_stays_on_its_edge_and_normal_to_it() {
        let mut piece = square(100.0, 0.0);
        piece.outline.points = [[50.0, 0.0], [100.0, 50.0], [50.0, 100.0], [0.0, 50.0]].map(DVec2::from).to_vec();
        piece.marks.push(Mark {
            kind: MarkKind::Notch,
            text: "a".into(),
            points: vec![DVec2::new(75.0, 25.0)],
            corners: vec![true],
            closed: false,
            inward: Some(DVec2::new(-1.0, 1.0).normalize()),
            size_mm: 4.0,
            fits: Fits::default(),
        });
        let mut pattern = Pattern { pieces: vec![piece], ..Pattern::default() };
        finish(&mut pattern, &compensated(Compensation { along_percent: 20.0, across_percent: -10.0 }));
        let piece = &pattern.pieces[0];
        let (mark, edge) = (&piece.marks[0], piece.outline.points[1] - piece.outline.points[0]);
        assert!((mark.points[0] - piece.outline.points[0]).perp_dot(edge).abs() < 1e-9);
        assert!(mark.inward.is_some_and(|n| n.dot(edge).abs() < 1e-12 && (n.length() - 1.0).abs() < 1e-12));
        assert!((mark.size_mm - 4.0).abs() < f64::EPSILON);
    }

    #[test]
    fn neighbours_keep_their_distance() {
        let mut pattern = Pattern { pieces: vec![square(100.0, 0.0), square(100.0, 105.0)], ..Pattern::default() };
        finish(&mut pattern, &compensated(Compensation { along_percent: 30.0, across_percent: 0.0 }));
        let [first, second] = [bounds(&pattern.pieces[0]), bounds(&pattern.pieces[1])];
        assert!((second[0].x - first[1].x - 5.0).abs() < 1e-9);
        assert!((second[1].x - second[0].x - 130.0).abs() < 1e-9);
    }

    #[test]
    fn nothing_asked_for_changes_no_bit() {
        let before = Pattern { pieces: vec![square(0.1, 0.3)], ..Pattern::default() };
        let mut after = before.clone();
        finish(&mut after, &compensated(Compensation::default()));
        assert_eq!(before, after);
    }
}
