//! A pattern as DXF R12 (AC1009), which every cutter reads: closed polylines on layers, millimetres.
//!
//! | layer | holds |
//! |---|---|
//! | `CUT` | outlines |
//! | `HOLE` | holes |
//! | `TEXT` | the title block above the pattern, piece names when there are several; not to be cut |
//!
//! Curves are polylines (R12 knows no splines); the pattern's own chord tolerance holds. y points up, as in the pattern.
//! R12 has no word for units: `$INSUNITS` (4 = mm) and `$MEASUREMENT` say it to programs that look, the title to people.

use std::fmt::Display;

use glam::DVec2;

use super::extent;
use super::title::TitleBlock;
use crate::engine::pattern::{Contour, Pattern};
use crate::formats::numbers::{WriteError, decimals, fixed};

const CUT: &str = "CUT";
const HOLE: &str = "HOLE";
const TEXT: &str = "TEXT";
/// Layer name and colour number (7 black or white, 1 red, 3 green).
const LAYERS: [(&str, u8); 4] = [("0", 7), (CUT, 7), (HOLE, 1), (TEXT, 3)];
/// Longest text that R12 keeps, in bytes.
const MAX_TEXT: usize = 250;

/// The drawing.
///
/// # Errors
/// [`WriteError::NotFinite`].
pub fn write(pattern: &Pattern, title: &TitleBlock) -> Result<Vec<u8>, WriteError> {
    let [low, high] = extent(pattern)?;
    let laid = title.lay(low, high);
    let far = DVec2::new(high.x.max(laid.right), laid.top);
    let mut dxf = Dxf { out: String::new(), decimals: decimals(low.abs().max(high.abs()).max_element()) };
    dxf.header(low, far);
    dxf.tables();
    dxf.section("ENTITIES");
    for piece in &pattern.pieces {
        dxf.polyline(CUT, &piece.outline);
        for hole in &piece.holes {
            dxf.polyline(HOLE, hole);
        }
    }
    for (at, text) in &laid.lines {
        dxf.text(*at, laid.height, text);
    }
    if pattern.pieces.len() > 1 {
        for piece in &pattern.pieces {
            if let Some(first) = piece.outline.points.first() {
                dxf.text(*first, laid.height, &super::title::one_line(&piece.name));
            }
        }
    }
    dxf.pair(0, "ENDSEC");
    dxf.pair(0, "EOF");
    Ok(dxf.out.into_bytes())
}

struct Dxf {
    out: String,
    decimals: usize,
}

impl Dxf {
    /// A group code and its value, a line each.
    fn pair(&mut self, code: u16, value: impl Display) {
        use std::fmt::Write as _;
        let _ = write!(self.out, "{code:>3}\r\n{value}\r\n");
    }

    fn number(&mut self, code: u16, x: f64) {
        let text = fixed(x, self.decimals);
        self.pair(code, text);
    }

    fn section(&mut self, name: &str) {
        self.pair(0, "SECTION");
        self.pair(2, name);
    }

    fn header(&mut self, low: DVec2, high: DVec2) {
        self.section("HEADER");
        self.pair(9, "$ACADVER");
        self.pair(1, "AC1009");
        self.pair(9, "$DWGCODEPAGE");
        self.pair(3, "ANSI_1252");
        self.pair(9, "$INSUNITS");
        self.pair(70, 4);
        self.pair(9, "$MEASUREMENT");
        self.pair(70, 1);
        for (name, at) in [("$EXTMIN", low), ("$EXTMAX", high)] {
            self.pair(9, name);
            self.number(10, at.x);
            self.number(20, at.y);
            self.number(30, 0.0);
        }
        self.pair(0, "ENDSEC");
    }

    fn tables(&mut self) {
        self.section("TABLES");
        self.table("LTYPE", 1);
        self.pair(0, "LTYPE");
        self.pair(2, "CONTINUOUS");
        self.pair(70, 0);
        self.pair(3, "Solid line");
        self.pair(72, 65);
        self.pair(73, 0);
        self.pair(40, "0.0");
        self.pair(0, "ENDTAB");
        self.table("LAYER", LAYERS.len());
        for (name, colour) in LAYERS {
            self.pair(0, "LAYER");
            self.pair(2, name);
            self.pair(70, 0);
            self.pair(62, colour);
            self.pair(6, "CONTINUOUS");
        }
        self.pair(0, "ENDTAB");
        self.table("STYLE", 1);
        self.pair(0, "STYLE");
        self.pair(2, "STANDARD");
        self.pair(70, 0);
        self.pair(40, "0.0");
        self.pair(41, "1.0");
        self.pair(50, "0.0");
        self.pair(71, 0);
        self.pair(42, "1.0");
        self.pair(3, "txt");
        self.pair(4, "");
        self.pair(0, "ENDTAB");
        self.pair(0, "ENDSEC");
    }

    fn table(&mut self, name: &str, entries: usize) {
        self.pair(0, "TABLE");
        self.pair(2, name);
        self.pair(70, entries);
    }

    fn polyline(&mut self, layer: &str, contour: &Contour) {
        if contour.points.is_empty() {
            return;
        }
        self.pair(0, "POLYLINE");
        self.pair(8, layer);
        self.pair(66, 1);
        self.point(DVec2::ZERO);
        self.pair(70, 1);
        for p in &contour.points {
            self.pair(0, "VERTEX");
            self.pair(8, layer);
            self.point(*p);
        }
        self.pair(0, "SEQEND");
        self.pair(8, layer);
    }

    fn point(&mut self, p: DVec2) {
        self.number(10, p.x);
        self.number(20, p.y);
        self.number(30, 0.0);
    }

    fn text(&mut self, at: DVec2, height: f64, text: &str) {
        self.pair(0, "TEXT");
        self.pair(8, TEXT);
        self.point(at);
        self.number(40, height);
        self.pair(1, escaped(text));
    }
}

/// ASCII alone: other letters as `\U+XXXX`, which CAD programs show as the letter; what DXF reads as a code of its own
/// (`%%`, `^`, `\`) stands for itself or becomes something plain.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        let piece = match c {
            '%' | '^' | '\\' => " ".to_owned(),
            ' '..='~' => c.to_string(),
            c if u32::from(c) <= 0xFFFF => format!("\\U+{:04X}", u32::from(c)),
            _ => "?".to_owned(),
        };
        if out.len() + piece.len() > MAX_TEXT {
            break;
        }
        out.push_str(&piece);
    }
    out
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;
    use crate::engine::pattern::Piece;

    fn contour(points: &[[f64; 2]]) -> Contour {
        Contour {
            points: points.iter().map(|p| DVec2::from_array(*p)).collect(),
            corners: vec![true; points.len()],
            ..Contour::default()
        }
    }

    fn pattern() -> Pattern {
        let outline = contour(&[[0.0, 0.0], [100.0, -0.0], [100.0, 50.0], [0.0, 50.0]]);
        let holes = vec![contour(&[[10.0, 10.0], [10.0, 20.0], [20.0, 20.0]])];
        let piece = Piece { name: "part".into(), outline, holes, ..Piece::default() };
        Pattern { pieces: vec![piece], bounding_box_mm: [100.0, 50.0], ..Pattern::default() }
    }

    fn groups(bytes: &[u8]) -> Vec<(u16, String)> {
        let lines: Vec<&str> = std::str::from_utf8(bytes).unwrap().split("\r\n").collect();
        assert_eq!(lines.len() % 2, 1, "pairs of lines and an empty rest");
        lines.chunks_exact(2).map(|p| (p[0].trim().parse().unwrap(), p[1].to_owned())).collect()
    }

    #[test]
    fn outlines_and_holes_are_closed_polylines_on_their_layers() {
        let title = TitleBlock::new(Some("part"), &BTreeMap::new());
        let groups = groups(&write(&pattern(), &title).unwrap());
        let layers: Vec<_> = groups.windows(2).filter(|w| w[0].1 == "POLYLINE").map(|w| w[1].1.clone()).collect();
        assert_eq!(layers, ["CUT", "HOLE"]);
        assert_eq!(groups.iter().filter(|g| g.1 == "VERTEX").count(), 7);
        assert_eq!(groups.last().unwrap(), &(0, "EOF".to_owned()));
    }

    #[test]
    fn numbers_have_fixed_decimals_without_exponent_or_minus_zero() {
        let mut tiny = pattern();
        for p in &mut tiny.pieces[0].outline.points {
            *p *= -1e-7;
        }
        let text = write(&tiny, &TitleBlock::default()).unwrap();
        for (code, value) in groups(&text) {
            if (10..=40).contains(&code) {
                assert!(!value.contains(['e', 'E']), "{value}");
                assert!(!value.starts_with("-0.") || value.contains(|c: char| ('1'..='9').contains(&c)), "{value}");
            }
        }
    }

    #[test]
    fn a_point_that_is_not_finite_is_refused() {
        let mut broken = pattern();
        broken.pieces[0].holes[0].points[1].y = f64::NAN;
        assert!(matches!(write(&broken, &TitleBlock::default()), Err(WriteError::NotFinite { .. })));
    }

    proptest! {
        #[test]
        fn no_name_breaks_the_file(name in any::<String>(), key in any::<String>(), value in "\\PC{0,300}") {
            let title = TitleBlock::new(Some(&name), &BTreeMap::from([(key, value)]));
            let bytes = write(&pattern(), &title).unwrap();
            prop_assert!(bytes.is_ascii());
            for (_, value) in groups(&bytes) {
                prop_assert!(value.len() <= MAX_TEXT && !value.contains(['\n', '\r', '%', '^']));
            }
        }
    }
}
