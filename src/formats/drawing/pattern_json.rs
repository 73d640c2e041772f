//! A pattern as JSON for programs: every coordinate to its last bit, millimetres.
//!
//! `{ "pieces": [{ "name", "outline": [[x, y]], "holes": [[[x, y]]], "marks": [] }], "bounding_box_mm": [w, h] }`.
//! Outlines are anticlockwise, holes clockwise; the first point is not repeated.

use serde::{Serialize, Serializer};

use crate::engine::pattern::{Contour, Pattern};
use crate::formats::numbers::{Coordinates, WriteError, compact_json};

#[derive(Serialize)]
struct PatternDocument<'a> {
    pieces: Vec<PieceDocument<'a>>,
    bounding_box_mm: Coordinates<2>,
}

#[derive(Serialize)]
struct PieceDocument<'a> {
    name: &'a str,
    outline: Points<'a>,
    holes: Vec<Points<'a>>,
    marks: [(); 0],
}

struct Points<'a>(&'a Contour);

impl Serialize for Points<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.points.iter().map(|p| Coordinates(p.to_array())))
    }
}

/// The document.
///
/// # Errors
/// [`WriteError::NotFinite`].
pub fn write(pattern: &Pattern) -> Result<Vec<u8>, WriteError> {
    compact_json(&PatternDocument {
        pieces: pattern
            .pieces
            .iter()
            .map(|p| PieceDocument {
                name: &p.name,
                outline: Points(&p.outline),
                holes: p.holes.iter().map(Points).collect(),
                marks: [],
            })
            .collect(),
        bounding_box_mm: Coordinates(pattern.bounding_box_mm),
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::engine::pattern::Piece;

    #[test]
    fn the_document_has_the_documented_shape() {
        let contour =
            |k: f64| Contour { points: vec![DVec2::new(0.1, -0.0), DVec2::new(k, 1.0)], ..Contour::default() };
        let piece = Piece { name: "a\"b".into(), outline: contour(1.0), holes: vec![contour(2.0)], ..Piece::default() };
        let pattern = Pattern { pieces: vec![piece], bounding_box_mm: [1.0, 1.0], ..Pattern::default() };
        let text = String::from_utf8(write(&pattern).unwrap()).unwrap();
        assert_eq!(
            text,
            r#"{"pieces":[{"name":"a\"b","outline":[[0.1,0.0],[1.0,1.0]],"holes":[[[0.1,0.0],[2.0,1.0]]],"marks":[]}],"bounding_box_mm":[1.0,1.0]}"#
        );
    }

    #[test]
    fn nothing_that_is_not_finite_gets_out() {
        let pattern = Pattern { pieces: vec![], bounding_box_mm: [f64::INFINITY, 1.0], ..Pattern::default() };
        assert!(matches!(write(&pattern), Err(WriteError::NotFinite { .. })));
    }
}
