//! A pattern as a drawing: DXF, SVG and HPGL for cutters, JSON for programs.

pub mod dxf;
pub mod hpgl;
pub mod pattern_json;
pub mod svg;
mod title;

use glam::DVec2;

pub use title::{TitleBlock, file_stem};

use super::numbers::WriteError;
use crate::engine::pattern::Pattern;

/// Refuses a pattern with a coordinate that is not finite; gives its least and greatest corner (zero when empty).
fn extent(pattern: &Pattern) -> Result<[DVec2; 2], WriteError> {
    let mut low = DVec2::INFINITY;
    let mut high = DVec2::NEG_INFINITY;
    for (i, piece) in pattern.pieces.iter().enumerate() {
        for contour in std::iter::once(&piece.outline).chain(&piece.holes) {
            for p in &contour.points {
                if !p.is_finite() {
                    return Err(WriteError::NotFinite { what: format!("a point of piece {i} of the pattern") });
                }
                low = low.min(*p);
                high = high.max(*p);
            }
        }
    }
    if low.x > high.x {
        return Ok([DVec2::ZERO; 2]);
    }
    Ok([low, high])
}
