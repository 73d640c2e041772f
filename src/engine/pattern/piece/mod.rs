//! What is done to the pieces of a drawn pattern before they are reported and written: they are compensated for what the
//! material will do ([`Compensation`]) and, once curves are fitted, given their mirror images ([`Pair`]).
//!
//! All of it works in the plane of the pattern, in millimetres, and on everything that a piece carries: outline, holes,
//! sew line, grain, marks, and the sides of seams. Nothing of it changes the flattening or what is measured of it.

mod compensation;
mod pair;

use glam::DVec2;
use serde::{Deserialize, Serialize};

pub use compensation::{Compensation, GREATEST_COMPENSATION};

use super::{Pattern, Piece};

/// Pieces that are laid beside others keep this part of the widest one between.
const GAP: f64 = 0.05;

/// The second piece that each piece is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pair {
    /// Its mirror image.
    Mirror,
}

/// What is done to the pieces of a pattern once it lies as it is to lie.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Finishing {
    /// They are made larger or smaller.
    pub compensation: Option<Compensation>,
    /// Each is given a second one.
    pub pair: Option<Pair>,
}

/// What is done to the pieces before curves are fitted through their samples.
pub(super) fn change(pattern: &mut Pattern, asked: &Finishing) {
    if let Some(compensation) = asked.compensation {
        compensation::apply(pattern, compensation);
    }
}

/// What is done to them, and to their curves, after that.
pub(super) fn second(pattern: &mut Pattern, asked: &Finishing) {
    if asked.pair == Some(Pair::Mirror) {
        pair::mirror(pattern);
    }
}

/// All that is asked for, without curves.
#[cfg(test)]
fn finish(pattern: &mut Pattern, asked: &Finishing) {
    change(pattern, asked);
    second(pattern, asked);
}

/// The least and the greatest coordinates of an outline; infinite without points.
fn bounds(piece: &Piece) -> [DVec2; 2] {
    let points = || piece.outline.points.iter().copied();
    [points().fold(DVec2::INFINITY, DVec2::min), points().fold(DVec2::NEG_INFINITY, DVec2::max)]
}

/// Width and height of all pieces together.
fn extent(pieces: &[Piece]) -> [f64; 2] {
    let [low, high] = pieces
        .iter()
        .map(bounds)
        .fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], b| [low.min(b[0]), high.max(b[1])]);
    if low.is_finite() && high.is_finite() { (high - low).to_array() } else { [0.0; 2] }
}

/// Every point of a piece, fits left aside.
fn each_point(piece: &mut Piece, mut change: impl FnMut(&mut DVec2)) {
    let contours = std::iter::once(&mut piece.outline).chain(&mut piece.holes).chain(&mut piece.sew);
    contours.flat_map(|c| &mut c.points).for_each(&mut change);
    piece.marks.iter_mut().flat_map(|m| &mut m.points).for_each(&mut change);
    if let Some(grain) = &mut piece.grain {
        change(&mut grain.from);
        change(&mut grain.to);
    }
}
