//! Left and right: each piece with its exact mirror image after it.
//!
//! The image is `x' = c - x`. Such a difference is exact when all three numbers are multiples of one power of two and
//! none needs more than 53 digits of it; so the x of the given pieces are first rounded to that grain, which is the last
//! digit of the widest coordinate (some 1e-13 mm on a part of a metre). Then left and right agree to the bit, and the
//! image of an image is the piece again. Closed outlines are walked backwards, so that they stay anticlockwise (holes
//! clockwise). Texts are moved, not mirrored.

use glam::DVec2;

use super::{GAP, bounds, each_point, extent};
use crate::engine::pattern::{Contour, Fit, Pattern, Piece, Seam, Segment};

/// Gives every piece its image: piece `k` becomes `2 k`, its image `2 k + 1`. The images lie to the right of all pieces,
/// in their order.
pub(super) fn mirror(pattern: &mut Pattern) {
    let boxes: Vec<[DVec2; 2]> = pattern.pieces.iter().map(bounds).collect();
    let widest = boxes.iter().map(|[low, high]| high.x - low.x).fold(0.0, f64::max);
    let farthest = boxes.iter().flatten().map(|p| p.x.abs()).fold(0.0, f64::max);
    let sum = boxes.iter().map(|[low, high]| high.x - low.x + GAP * widest).sum::<f64>();
    if !(widest > 0.0 && (farthest + sum).is_finite()) {
        return;
    }
    let grain = last_digit(2.0 * (2.0 * farthest + sum));
    let whole = |x: f64| (x / grain).round() * grain;
    let mut right = boxes.iter().map(|b| b[1].x).fold(f64::NEG_INFINITY, f64::max);
    let mut axes = Vec::with_capacity(boxes.len());
    let mut both = Vec::with_capacity(2 * boxes.len());
    for (mut piece, [low, high]) in std::mem::take(&mut pattern.pieces).into_iter().zip(boxes) {
        each_point(&mut piece, |p| p.x = whole(p.x));
        each_fit_point(&mut piece, |p| p.x = whole(p.x));
        let c = whole(right + GAP * widest + high.x);
        right = c - low.x;
        let mut image = image(&piece, c);
        image.name = format!("{}_R", piece.name);
        image.mirrored = true;
        piece.name.push_str("_L");
        axes.push(c);
        both.extend([piece, image]);
    }
    pattern.pieces = both;
    let seams = std::mem::take(&mut pattern.seams);
    let images: Vec<Seam> = seams.iter().map(|seam| seam_image(seam, &axes)).collect();
    pattern.seams = seams.into_iter().chain(images).collect();
    let given = pattern.seams.len() / 2;
    for side in pattern.seams[..given].iter_mut().flat_map(|seam| &mut seam.sides) {
        side.piece *= 2;
        side.points.iter_mut().for_each(|p| p.x = whole(p.x));
    }
    pattern.bounding_box_mm = extent(&pattern.pieces);
}

/// The power of two that a number's last binary digit stands for, or the one above.
fn last_digit(x: f64) -> f64 {
    2.0_f64.powi(x.log2().ceil() as i32 - 52)
}

fn at(p: DVec2, c: f64) -> DVec2 {
    DVec2::new(c - p.x, p.y)
}

/// The image of a piece; its name is the piece's.
fn image(piece: &Piece, c: f64) -> Piece {
    let mut image = piece.clone();
    each_point(&mut image, |p| *p = at(*p, c));
    each_fit_point(&mut image, |p| *p = at(*p, c));
    for contour in std::iter::once(&mut image.outline).chain(&mut image.holes).chain(&mut image.sew) {
        backwards(contour);
    }
    for mark in &mut image.marks {
        // Marks keep their way; their arcs turn the other way.
        let arcs = mark.fits.arcs.iter_mut().chain(&mut mark.fits.spline).flat_map(|fit| &mut fit.segments);
        for segment in arcs {
            if let Segment::Arc { bulge, .. } = segment {
                *bulge = -*bulge;
            }
        }
        mark.inward = mark.inward.map(|n| DVec2::new(-n.x, n.y));
    }
    image
}

fn seam_image(seam: &Seam, axes: &[f64]) -> Seam {
    let mut image = seam.clone();
    for side in &mut image.sides {
        let c = axes.get(side.piece as usize).copied().unwrap_or(0.0);
        side.points.iter_mut().for_each(|p| *p = at(*p, c));
        side.piece = 2 * side.piece + 1;
    }
    image
}

/// Walks a closed contour the other way, from the same point.
fn backwards(contour: &mut Contour) {
    if let Some(rest) = contour.points.get_mut(1..) {
        rest.reverse();
    }
    if let Some(rest) = contour.corners.get_mut(1..) {
        rest.reverse();
    }
    for fit in contour.fits.arcs.iter_mut().chain(&mut contour.fits.spline) {
        let count = fit.segments.len();
        let begins = |k: usize| if k == 0 { fit.start } else { fit.segments[k - 1].to() };
        // Mirroring turned the arcs, walking back turns them again.
        let segments = (0..count).rev().map(|k| match fit.segments[k] {
            Segment::Line { .. } => Segment::Line { to: begins(k) },
            Segment::Arc { bulge, .. } => Segment::Arc { to: begins(k), bulge },
            Segment::Cubic { a, b, .. } => Segment::Cubic { a: b, b: a, to: begins(k) },
        });
        let segments = segments.collect();
        if let Some(rest) = count.checked_sub(1).and_then(|last| fit.corners.get_mut(..last)) {
            rest.reverse();
        }
        fit.segments = segments;
    }
}

/// Every point of a piece's fits.
fn each_fit_point(piece: &mut Piece, mut change: impl FnMut(&mut DVec2)) {
    let contours = std::iter::once(&mut piece.outline).chain(&mut piece.holes).chain(&mut piece.sew);
    let fits = contours.map(|c| &mut c.fits).chain(piece.marks.iter_mut().map(|m| &mut m.fits));
    for Fit { start, segments, circle, .. } in fits.flat_map(|f| f.arcs.iter_mut().chain(&mut f.spline)) {
        change(start);
        if let Some((middle, _)) = circle {
            change(middle);
        }
        for segment in segments {
            match segment {
                Segment::Line { to } | Segment::Arc { to, .. } => change(to),
                Segment::Cubic { a, b, to } => [a, b, to].into_iter().for_each(&mut change),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::pattern::piece::{Finishing, Pair, finish};
    use crate::engine::pattern::{Fits, Grain, Mark, MarkKind, SeamSide, Sense};

    fn piece(points: Vec<DVec2>) -> Piece {
        let corners = (0..points.len()).map(|k| k % 3 == 0).collect();
        Piece { name: "front".into(), outline: Contour { points, corners, ..Contour::default() }, ..Piece::default() }
    }

    fn area(points: &[DVec2]) -> f64 {
        (0..points.len()).map(|k| 0.5 * points[k].perp_dot(points[(k + 1) % points.len()])).sum()
    }

    fn paired(piece: Piece) -> Pattern {
        let mut pattern = Pattern { pieces: vec![piece], ..Pattern::default() };
        finish(&mut pattern, &Finishing { pair: Some(Pair::Mirror), ..Finishing::default() });
        pattern
    }

    #[test]
    fn a_piece_becomes_left_and_right_side_by_side() {
        let mut given = piece([[0.0, 0.0], [100.0, 0.0], [0.0, 50.0]].map(DVec2::from).to_vec());
        given.grain = Some(Grain { from: DVec2::new(10.0, 5.0), to: DVec2::new(40.0, 15.0), sense: Sense::OneWay });
        let text = "<b>\nΣ\u{202e}".to_owned() + &"x".repeat(300);
        given.marks.push(Mark {
            kind: MarkKind::Notch,
            text: text.clone(),
            points: vec![DVec2::new(0.0, 25.0)],
            corners: vec![true],
            closed: false,
            inward: Some(DVec2::X),
            size_mm: 4.0,
            fits: Fits::default(),
        });
        let pattern = paired(given);
        let [left, right] = &pattern.pieces[..] else { panic!("{} pieces", pattern.pieces.len()) };
        assert_eq!((left.name.as_str(), right.name.as_str()), ("front_L", "front_R"));
        assert!(!left.mirrored && right.mirrored);
        assert_eq!(pattern.bounding_box_mm, [205.0, 50.0]);
        assert!(area(&left.outline.points) > 0.0 && area(&right.outline.points) > 0.0);
        assert_eq!(right.outline.points[0], DVec2::new(205.0, 0.0));
        assert_eq!(right.outline.corners[0], left.outline.corners[0]);
        assert_eq!(right.grain.map(|g| g.to - g.from), Some(DVec2::new(-30.0, 10.0)));
        assert_eq!((right.marks[0].points[0], right.marks[0].inward), (DVec2::new(205.0, 25.0), Some(DVec2::NEG_X)));
        assert_eq!(right.marks[0].text, text, "texts stay readable and unharmed");
    }

    #[test]
    fn arcs_bulge_to_the_same_side_of_the_material() {
        // A half disc: a line along x and half a turn back above it.
        let mut given = piece([[0.0, 0.0], [20.0, 0.0], [10.0, 10.0]].map(DVec2::from).to_vec());
        given.outline.fits.arcs = Some(Fit {
            start: DVec2::ZERO,
            segments: vec![Segment::Line { to: DVec2::new(20.0, 0.0) }, Segment::Arc { to: DVec2::ZERO, bulge: 1.0 }],
            corners: vec![true, false],
            ..Fit::default()
        });
        let pattern = paired(given);
        let fit = pattern.pieces[1].outline.fits.arcs.clone().unwrap_or_default();
        let [start, end] = [DVec2::new(41.0, 0.0), DVec2::new(21.0, 0.0)];
        assert_eq!(fit.start, start);
        assert_eq!(fit.segments, [Segment::Arc { to: end, bulge: 1.0 }, Segment::Line { to: start }]);
        assert_eq!(fit.corners, [true, false]);
    }

    #[test]
    fn seams_are_those_of_both_hands() {
        let square = |x: f64| piece([[x, 0.0], [x + 10.0, 0.0], [x + 10.0, 10.0]].map(DVec2::from).to_vec());
        let side =
            |piece, x| SeamSide { piece, points: vec![DVec2::new(x, 0.0), DVec2::new(x, 10.0)], length_mm: 10.0 };
        let seam = Seam { name: "a".into(), sides: [side(0, 10.0), side(1, 15.0)], length_3d_mm: 10.0 };
        let mut pattern = Pattern { pieces: vec![square(0.0), square(15.0)], seams: vec![seam], ..Pattern::default() };
        finish(&mut pattern, &Finishing { pair: Some(Pair::Mirror), ..Finishing::default() });
        let pieces: Vec<_> = pattern.seams.iter().map(|s| s.sides.each_ref().map(|side| side.piece)).collect();
        assert_eq!(pieces, [[0, 2], [1, 3]]);
        let on = |seam: usize, s: usize| {
            let side = &pattern.seams[seam].sides[s];
            let [low, high] = bounds(&pattern.pieces[side.piece as usize]);
            side.points.iter().all(|p| p.x >= low.x && p.x <= high.x)
        };
        assert!((0..2).all(|seam| (0..2).all(|s| on(seam, s))));
    }

    proptest! {
        #[test]
        fn the_image_of_the_image_is_the_piece_to_the_bit(
            points in prop::collection::vec((-3e3_f64..3e3, -3e3_f64..3e3), 3..40),
        ) {
            let given = piece(points.iter().map(|&(x, y)| DVec2::new(x, y)).collect());
            let pattern = paired(given.clone());
            prop_assume!(pattern.pieces.len() == 2);
            let [left, right] = [&pattern.pieces[0], &pattern.pieces[1]];
            let c = left.outline.points[0].x + right.outline.points[0].x;
            let again = image(right, c);
            prop_assert_eq!(&again.outline, &left.outline);
            for (before, after) in given.outline.points.iter().zip(&left.outline.points) {
                prop_assert!(before.distance(*after) < 1e-11);
            }
        }
    }
}
