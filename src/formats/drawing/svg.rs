//! A pattern as SVG in true size: one user unit is one millimetre, `width` and `height` say so.
//!
//! The layers are those of the DXF, as groups (`CUT`, `HOLE`, `TEXT`; Inkscape shows them as layers). Each line that is
//! to be cut stands in the file once. Holes run against their outline, so that an outline with its holes fills alike
//! under either fill rule. SVG's y points down: y is turned in the coordinates, without a mirroring transform, which
//! would mirror the text and be dropped by some cutters' readers. x is the pattern's own; y is its height less y.

use std::fmt::Write as _;

use glam::DVec2;

use super::extent;
use super::title::{TitleBlock, one_line};
use crate::engine::pattern::{Contour, Pattern};
use crate::formats::numbers::{WriteError, decimals, short};

/// White border against the larger side of the pattern.
const MARGIN: f64 = 0.02;
/// Width of lines against the larger side of the pattern: seen when the whole drawing fills a screen. Cutters follow the
/// line's middle and take its width for nothing.
const LINE_WIDTH: f64 = 0.0015;

/// The drawing.
///
/// # Errors
/// [`WriteError::NotFinite`].
pub fn write(pattern: &Pattern, title: &TitleBlock) -> Result<Vec<u8>, WriteError> {
    let [low, high] = extent(pattern)?;
    let laid = title.lay(low, high);
    let size = (high - low).max_element();
    let size = if size > 0.0 { size } else { 1.0 };
    let margin = MARGIN * size;
    let page = Page { top: high.y, decimals: decimals(low.abs().max(high.abs()).max_element()) };
    let n = |x: f64| short(x, page.decimals);
    let corner = DVec2::new(low.x - margin, -(laid.top - high.y) - margin);
    let width = high.x.max(laid.right) + margin - corner.x;
    let height = high.y - low.y + margin - corner.y;

    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
         width=\"{w}mm\" height=\"{h}mm\" viewBox=\"{x} {y} {w} {h}\">",
        w = n(width),
        h = n(height),
        x = n(corner.x),
        y = n(corner.y)
    );
    if let Some(name) = title.name() {
        let _ = writeln!(out, "<title>{}</title>", escaped(name));
    }
    let line = format!(
        "fill=\"none\" fill-rule=\"evenodd\" stroke-width=\"{}\" stroke-linejoin=\"round\"",
        n(LINE_WIDTH * size)
    );
    let _ = writeln!(out, "{} {line} stroke=\"#000000\">", layer("CUT"));
    for piece in &pattern.pieces {
        page.path(&mut out, std::slice::from_ref(&piece.outline));
    }
    let _ = writeln!(out, "</g>\n{} {line} stroke=\"#c00000\">", layer("HOLE"));
    for piece in &pattern.pieces {
        page.path(&mut out, &piece.holes);
    }
    let _ = writeln!(
        out,
        "</g>\n{} fill=\"#404040\" font-family=\"sans-serif\" font-size=\"{}\">",
        layer("TEXT"),
        n(laid.height)
    );
    for (at, text) in &laid.lines {
        page.text(&mut out, *at, text);
    }
    if pattern.pieces.len() > 1 {
        for piece in &pattern.pieces {
            if let Some(first) = piece.outline.points.first() {
                page.text(&mut out, *first, &one_line(&piece.name));
            }
        }
    }
    out.push_str("</g>\n</svg>\n");
    Ok(out.into_bytes())
}

fn layer(name: &str) -> String {
    format!("<g id=\"{name}\" inkscape:groupmode=\"layer\" inkscape:label=\"{name}\"")
}

struct Page {
    top: f64,
    decimals: usize,
}

impl Page {
    fn path(&self, out: &mut String, contours: &[Contour]) {
        if contours.iter().all(|c| c.points.is_empty()) {
            return;
        }
        out.push_str("<path d=\"");
        for contour in contours {
            for (i, p) in contour.points.iter().enumerate() {
                out.push_str(if i == 0 { "M" } else { "L" });
                let _ = write!(out, "{} {}", short(p.x, self.decimals), short(self.top - p.y, self.decimals));
            }
            out.push('Z');
        }
        out.push_str("\"/>\n");
    }

    fn text(&self, out: &mut String, at: DVec2, text: &str) {
        let (x, y) = (short(at.x, self.decimals), short(self.top - at.y, self.decimals));
        let _ = writeln!(out, "<text x=\"{x}\" y=\"{y}\">{}</text>", escaped(text));
    }
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&apos;"),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;
    use crate::engine::pattern::Piece;

    fn triangle() -> Pattern {
        let points = vec![DVec2::new(0.0, 0.0), DVec2::new(100.0, 0.0), DVec2::new(0.0, 40.0)];
        let outline = Contour { points, corners: vec![true; 3], ..Contour::default() };
        let piece = Piece { name: "part".into(), outline, ..Piece::default() };
        Pattern { pieces: vec![piece], bounding_box_mm: [100.0, 40.0], ..Pattern::default() }
    }

    #[test]
    fn a_unit_is_a_millimetre_and_y_points_up() {
        let text = String::from_utf8(write(&triangle(), &TitleBlock::default()).unwrap()).unwrap();
        assert!(text.contains("<path d=\"M0 40L100 40L0 0Z\"/>"), "{text}");
        let field = |name: &str| text.split(&format!(" {name}=\"")).nth(1).unwrap().split('"').next().unwrap();
        let view: Vec<&str> = field("viewBox").split(' ').collect();
        assert_eq!(format!("{}mm", view[2]), field("width"));
        assert_eq!(format!("{}mm", view[3]), field("height"));
        assert!(!text.contains("transform"));
    }

    proptest! {
        #[test]
        fn no_name_adds_markup(name in any::<String>(), value in "[<>&\"'a-z\\]!-]{0,40}") {
            let plain = write(&triangle(), &TitleBlock::new(Some("x"), &BTreeMap::from([("k".into(), "v".into())]))).unwrap();
            let named = write(&triangle(), &TitleBlock::new(Some(&format!("x{name}")), &BTreeMap::from([("k".into(), value)]))).unwrap();
            let tags = |b: &[u8]| String::from_utf8_lossy(b).matches('<').count();
            prop_assert_eq!(tags(&plain), tags(&named));
            prop_assert!(std::str::from_utf8(&named).unwrap().chars().all(|c| c == '\n' || !c.is_control()));
        }
    }
}
