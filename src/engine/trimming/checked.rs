//! Loops that have passed the checklist: mended, nested and oriented.

use std::ops::Range;

use glam::DVec2;

use super::TrimWarning;
use super::pieces::{Piece, Pieces, Run};
use crate::engine::nurbs::Domain;

/// The trimming loops of a surface after [`check`](super::TrimmedSurface::check): closed, free of crossings, nested, and
/// each walked with the region to its left. A surface without loops has one, the border of its domain.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedTrims {
    pub(super) domain: Domain,
    pub(super) loops: Vec<CheckedLoop>,
    pub(super) natural: bool,
    pub(super) warnings: Vec<TrimWarning>,
    pub(super) pieces: Pieces,
}

/// One loop. Its curves stand in walking order: anticlockwise at even depth, clockwise at odd depth.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedLoop {
    /// Index of the loop in the file; `None` for the natural boundary.
    pub source_loop: Option<usize>,
    /// How many other loops contain this one: even = outer boundary of a part, odd = hole.
    pub depth: u32,
    /// Index of the smallest loop that contains this one.
    pub parent: Option<usize>,
    /// The curves in walking order.
    pub curves: Vec<CheckedCurve>,
    /// True when the file's order of curves had to be reversed.
    pub flipped: bool,
}

/// One curve of a loop as it is walked, from `t_start` to `t_end`.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedCurve {
    /// Index of the curve in its loop (as sent).
    pub curve: usize,
    /// Parameter at which the walk enters it.
    pub t_start: f64,
    /// Parameter at which the walk leaves it; smaller than `t_start` when the curve is walked backwards.
    pub t_end: f64,
    /// True when the boundary has a corner where the walk enters this curve.
    pub corner_at_start: bool,
    /// True for a polyline: each of its inner vertices is a corner.
    pub polyline: bool,
    pub(super) pieces: Range<usize>,
}

impl CheckedCurve {
    /// True when it is walked against its parameter.
    #[must_use]
    pub fn backwards(&self) -> bool {
        self.t_end < self.t_start
    }
}

impl CheckedTrims {
    /// The loops, in the order of the file.
    #[must_use]
    pub fn loops(&self) -> &[CheckedLoop] {
        &self.loops
    }

    /// True when the surface has no trimming loops, so that the only loop is the border of its domain: four straight
    /// curves over [0, 1], starting at the corner of least u and v.
    #[must_use]
    pub const fn natural(&self) -> bool {
        self.natural
    }

    /// What was mended.
    #[must_use]
    pub fn warnings(&self) -> &[TrimWarning] {
        &self.warnings
    }

    /// The surface's domain.
    #[must_use]
    pub const fn domain(&self) -> Domain {
        self.domain
    }

    /// The point of curve `curve` (index as sent) of loop `loop_index` at its parameter `t`, as mended: ends that were
    /// joined are joined here too, and no point leaves the domain. `t` beyond the curve's ends gives its ends.
    ///
    /// # Panics
    /// When there is no such loop or curve.
    #[must_use]
    pub fn point(&self, loop_index: usize, curve: usize, t: f64) -> DVec2 {
        let curves = &self.loops[loop_index].curves;
        let place = if self.loops[loop_index].flipped { curves.len() - 1 - curve } else { curve };
        self.on_curve(&curves[place], t)
    }

    /// The point of a curve at its parameter.
    pub(super) fn on_curve(&self, curve: &CheckedCurve, t: f64) -> DVec2 {
        let (piece, s) = self.locate(&curve.pieces, t);
        self.evaluate(piece, s)
    }

    /// Whether a curve of a walk is straight around its parameter `t`.
    pub(super) fn is_straight(&self, loop_index: usize, place: usize, t: f64) -> bool {
        self.locate(&self.loops[loop_index].curves[place].pieces, t).0.run != Run::Curved
    }

    /// The piece in `range` that holds the curve's parameter `t`, with the piece's own parameter.
    fn locate(&self, range: &Range<usize>, t: f64) -> (&Piece, f64) {
        let list = &self.pieces.list[range.clone()];
        let piece = &list[list.partition_point(|p| p.t[1] < t).min(list.len() - 1)];
        (piece, piece.own(t))
    }

    /// The point of a piece, in the domain.
    pub(super) fn evaluate(&self, piece: &Piece, s: f64) -> DVec2 {
        clamp(&self.domain, self.pieces.point(piece, s))
    }
}

/// The nearest point of the domain.
pub(super) fn clamp(domain: &Domain, p: DVec2) -> DVec2 {
    DVec2::new(p.x.clamp(domain.u[0], domain.u[1]), p.y.clamp(domain.v[0], domain.v[1]))
}
