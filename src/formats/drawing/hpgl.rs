//! A pattern as HPGL for plotters and knife tables: 40 units to the millimetre, a pen for each function.
//!
//! | pen | draws |
//! |---|---|
//! | 1 | outlines and holes: what is cut; the holes of a piece before its outline, so that nothing is cut in a loose piece |
//! | 2 | the title block above the pattern, piece names when there are several |
//!
//! HPGL knows whole units only: each point is rounded by itself, to at most 0.0125 mm in x and in y, so that nothing
//! adds up along a contour. Each contour ends with the very units it began with. y points up, as in the pattern.

use std::fmt::Write as _;

use glam::DVec2;

use super::extent;
use super::title::{TitleBlock, one_line};
use crate::engine::pattern::{Contour, Pattern};
use crate::formats::numbers::WriteError;

/// Plotter units in a millimetre.
const UNITS: f64 = 40.0;
/// What HPGL's numbers reach, in units: about 209 m from the origin.
const FURTHEST: f64 = 8_388_607.0;
const CUT: u8 = 1;
const TEXT: u8 = 2;
/// Points in one instruction: readers with small buffers take a contour in parts.
const POINTS_AT_ONCE: usize = 128;
/// What ends a label.
const END_OF_LABEL: char = '\u{3}';
/// Width of a letter against its height, as plotters draw them.
const LETTER: f64 = 0.6;

/// The drawing.
///
/// # Errors
/// [`WriteError::NotFinite`]; [`WriteError::TooLarge`] when the pattern reaches beyond what HPGL's numbers do.
pub fn write(pattern: &Pattern, title: &TitleBlock) -> Result<Vec<u8>, WriteError> {
    let [low, high] = extent(pattern)?;
    let laid = title.lay(low, high);
    let reach = UNITS * low.abs().max(high.abs()).max_element().max(laid.top.abs());
    if reach > FURTHEST {
        let detail = format!("it reaches {reach:.0} plotter units from the origin, HPGL knows {FURTHEST:.0}");
        return Err(WriteError::TooLarge { detail });
    }
    let mut out = format!("IN;SP{CUT};\n");
    for piece in &pattern.pieces {
        for contour in piece.holes.iter().chain(std::iter::once(&piece.outline)) {
            closed(&mut out, contour);
        }
    }
    // Letters in centimetres.
    let _ = writeln!(out, "SP{TEXT};SI{:.4},{:.4};", 0.1 * LETTER * laid.height, 0.1 * laid.height);
    for (at, text) in &laid.lines {
        label(&mut out, *at, text);
    }
    if pattern.pieces.len() > 1 {
        for piece in &pattern.pieces {
            if let Some(first) = piece.outline.points.first() {
                label(&mut out, *first, &one_line(&piece.name));
            }
        }
    }
    out.push_str("PU;SP0;\n");
    Ok(out.into_bytes())
}

/// A point in whole units.
fn units(p: DVec2) -> [i64; 2] {
    // Within FURTHEST, as was checked.
    (UNITS * p).to_array().map(|x| x.round() as i64)
}

/// A contour from its first point round to the same; points that round to the same units are one.
fn closed(out: &mut String, contour: &Contour) {
    let mut points: Vec<[i64; 2]> = contour.points.iter().map(|&p| units(p)).collect();
    points.dedup();
    let Some(&first @ [x, y]) = points.first() else { return };
    if points.last() != Some(&first) || points.len() == 1 {
        points.push(first);
    }
    let _ = writeln!(out, "PU{x},{y};");
    for run in points[1..].chunks(POINTS_AT_ONCE) {
        for (k, [x, y]) in run.iter().enumerate() {
            out.push_str(if k == 0 { "PD" } else { "," });
            let _ = write!(out, "{x},{y}");
        }
        out.push_str(";\n");
    }
    out.push_str("PU;\n");
}

fn label(out: &mut String, at: DVec2, text: &str) {
    let [x, y] = units(at);
    let _ = writeln!(out, "PU{x},{y};LB{}{END_OF_LABEL}", plain(text));
}

/// Plotters know the letters of ASCII; what they do not know is a question mark.
fn plain(text: &str) -> String {
    text.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;
    use crate::engine::pattern::Piece;

    type Strokes = Vec<(u8, Vec<[i64; 2]>)>;

    /// What a plotter does: the strokes of each pen, in units, and the labels.
    fn plotted(bytes: &[u8]) -> (Strokes, Vec<String>) {
        let text = std::str::from_utf8(bytes).unwrap();
        let (mut strokes, mut labels) = (Strokes::new(), Vec::new());
        let (mut pen, mut at) = (0, [0, 0]);
        let mut rest = text;
        while let Some(word) = rest.trim_start().get(..2) {
            rest = &rest.trim_start()[2..];
            let end = if word == "LB" { END_OF_LABEL } else { ';' };
            let (body, after) = rest.split_once(end).expect("every instruction ends");
            rest = after;
            let numbers = || body.split(',').filter(|n| !n.is_empty()).map(|n| n.parse::<i64>().unwrap());
            let pairs: Vec<i64> = if ["PU", "PD"].contains(&word) { numbers().collect() } else { Vec::new() };
            match word {
                "IN" | "SI" => {}
                "SP" => pen = body.parse().unwrap(),
                "LB" => labels.push(body.to_owned()),
                "PU" => {
                    strokes.push((pen, Vec::new()));
                    at = pairs.as_chunks::<2>().0.last().copied().unwrap_or(at);
                }
                "PD" => {
                    let stroke = &mut strokes.last_mut().expect("a pen is moved before it draws").1;
                    if stroke.is_empty() {
                        stroke.push(at);
                    }
                    stroke.extend(pairs.as_chunks::<2>().0);
                    at = *stroke.last().unwrap();
                }
                other => panic!("no instruction of ours: {other}"),
            }
        }
        strokes.retain(|(_, points)| !points.is_empty());
        (strokes, labels)
    }

    fn contour(points: &[[f64; 2]]) -> Contour {
        Contour {
            points: points.iter().map(|p| DVec2::from_array(*p)).collect(),
            corners: vec![true; points.len()],
            ..Contour::default()
        }
    }

    fn plate() -> Pattern {
        let outline = contour(&[[0.0, 0.0], [100.0, 0.0], [100.0, 50.01], [0.0, 50.01]]);
        let holes = vec![contour(&[[10.0, 10.0], [10.0, 20.0], [20.0, 20.0]])];
        Pattern {
            pieces: vec![Piece { name: "a".into(), outline, holes, ..Piece::default() }],
            bounding_box_mm: [100.0, 50.01],
            ..Pattern::default()
        }
    }

    #[test]
    fn holes_are_cut_before_their_outline_and_every_contour_closes() {
        let (strokes, labels) = plotted(&write(&plate(), &TitleBlock::new(Some("plate"), &BTreeMap::new())).unwrap());
        assert_eq!(strokes.len(), 2);
        assert_eq!(strokes[0], (1, vec![[400, 400], [400, 800], [800, 800], [400, 400]]));
        // 50.01 mm are 2000.4 units.
        assert_eq!(strokes[1], (1, vec![[0, 0], [4000, 0], [4000, 2000], [0, 2000], [0, 0]]));
        assert_eq!(labels, ["plate", "units: mm"]);
    }

    #[test]
    fn rounding_does_not_add_up_along_a_contour() {
        let mut round = plate();
        let corner = |k: u32| DVec2::new(300.0, 300.0) + 250.0 * DVec2::from_angle(f64::from(k) * 0.001);
        round.pieces[0].outline.points = (0..6283).map(corner).collect();
        let (strokes, _) = plotted(&write(&round, &TitleBlock::default()).unwrap());
        let drawn = &strokes[1].1;
        assert_eq!(drawn.first(), drawn.last());
        for (k, [x, y]) in drawn[..6283].iter().enumerate() {
            let apart = (DVec2::new(*x as f64, *y as f64) / UNITS - corner(k as u32)).abs();
            assert!(apart.max_element() <= 0.5 / UNITS + 1e-9, "point {k} is {apart} off");
        }
    }

    #[test]
    fn what_hpgl_cannot_say_is_refused() {
        let mut broken = plate();
        broken.pieces[0].outline.points[1].x = 209_716.0;
        assert!(matches!(write(&broken, &TitleBlock::default()), Err(WriteError::TooLarge { .. })));
        broken.pieces[0].outline.points[1].x = f64::NAN;
        assert!(matches!(write(&broken, &TitleBlock::default()), Err(WriteError::NotFinite { .. })));
    }

    proptest! {
        #[test]
        fn no_name_becomes_an_instruction(name in any::<String>(), value in "\\PC{0,300}") {
            let title = TitleBlock::new(Some(&name), &BTreeMap::from([("PU0,0;PD\u{3}".to_owned(), value)]));
            let (strokes, labels) = plotted(&write(&plate(), &title).unwrap());
            prop_assert_eq!(strokes.len(), 2);
            prop_assert_eq!(labels.len(), title.lines().len());
        }
    }
}
