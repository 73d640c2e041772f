//! The title block: who a pattern is, in a few lines of text above it.
//!
//! Names and labels come from clients. Here they lose what no drawing should carry (control characters, direction
//! overrides, endless length); each writer then escapes what its own format would read as markup.

use std::collections::BTreeMap;

use glam::DVec2;

/// Longest line in a drawing. Longer ones end in dots; the JSON forms and the job keep the whole text.
const MAX_LINE: usize = 80;
/// Most lines in a drawing.
const MAX_LINES: usize = 24;
/// Height of letters against the larger side of the pattern: legible on a plot, small beside the part.
const TEXT_HEIGHT: f64 = 0.02;
/// Width of a letter against its height, on the wide side for the fonts that plotters use.
const LETTER_WIDTH: f64 = 0.65;
/// Distance between baselines against the height of letters.
const LINE_SPACING: f64 = 1.6;

/// Lines of text for a drawing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TitleBlock {
    name: Option<String>,
    lines: Vec<String>,
    rejected: bool,
}

/// What a drawing of a rejected pattern says.
const REJECTED: &str = "REJECTED";

impl TitleBlock {
    /// The part's name, then `key: value` for each label, then the units.
    #[must_use]
    pub fn new(name: Option<&str>, labels: &BTreeMap<String, String>) -> Self {
        let name = name.map(one_line).filter(|n| !n.is_empty());
        let mut lines: Vec<String> = name.iter().map(|n| shortened(n)).collect();
        lines.extend(labels.iter().map(|(key, value)| shortened(&one_line(&format!("{key}: {value}")))));
        lines.truncate(MAX_LINES - 1);
        lines.push("units: mm".to_owned());
        Self { name: name.map(|n| shortened(&n)), lines, rejected: false }
    }

    /// The same for a drawing that is, or is not, to say that it is rejected.
    #[must_use]
    pub fn rejecting(mut self, rejected: bool) -> Self {
        if rejected && !self.rejected {
            self.lines.insert(0, REJECTED.to_owned());
        }
        self.rejected |= rejected;
        self
    }

    /// The part's name, when it has one.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// The lines from top to bottom.
    #[must_use]
    pub fn lines(&self) -> &[String] {
        &self.lines
    }

    /// Lays the lines above a pattern that spans `low` to `high`.
    pub(super) fn lay(&self, low: DVec2, high: DVec2) -> LaidTitle<'_> {
        let size = (high - low).max_element();
        // A pattern without extent has no letters to measure by: any size does.
        let size = if size > 0.0 { size } else { 1.0 };
        let longest = self.lines.iter().map(|l| l.chars().count()).max().unwrap_or(0).max(1);
        let height = (TEXT_HEIGHT * size).min(size / (LETTER_WIDTH * longest as f64));
        let step = LINE_SPACING * height;
        let count = self.lines.len();
        let lines = self
            .lines
            .iter()
            .enumerate()
            .map(|(i, text)| (DVec2::new(low.x, high.y + step * (count - i) as f64), text.as_str()))
            .collect();
        LaidTitle {
            height,
            lines,
            top: high.y + step * (count + 1) as f64,
            right: low.x + LETTER_WIDTH * height * longest as f64,
        }
    }
}

/// Lines with their places.
pub(super) struct LaidTitle<'a> {
    /// Height of letters, mm.
    pub(super) height: f64,
    /// Left end of each baseline, and the text.
    pub(super) lines: Vec<(DVec2, &'a str)>,
    /// Upper end of the block.
    pub(super) top: f64,
    /// Right end of the longest line, estimated.
    pub(super) right: f64,
}

/// One line of harmless text: control characters and line breaks become a space, direction overrides and characters
/// that name nothing vanish, white space does not repeat.
pub(super) fn one_line(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        let code = u32::from(c);
        let vanishes = matches!(code, 0x202A..=0x202E | 0x2060..=0x206F | 0xFEFF | 0xFFF9..=0xFFFB | 0xFDD0..=0xFDEF)
            || code & 0xFFFE == 0xFFFE
            || (0xE000..0xF900).contains(&code)
            || code >= 0xE0000;
        if vanishes {
            continue;
        }
        if c.is_control() || c.is_whitespace() {
            if !out.ends_with(' ') && !out.is_empty() {
                out.push(' ');
            }
        } else {
            out.push(c);
        }
    }
    out.truncate(out.trim_end().len());
    out
}

fn shortened(text: &str) -> String {
    if text.chars().count() <= MAX_LINE {
        return text.to_owned();
    }
    let mut out: String = text.chars().take(MAX_LINE - 3).collect();
    out.push_str("...");
    out
}

/// Longest file name that [`file_stem`] makes.
const MAX_STEM: usize = 60;

/// A file name without its suffix, safe in a header and in any file system: letters, digits, `-`, `_` of ASCII.
#[must_use]
pub fn file_stem(name: Option<&str>, otherwise: &str) -> String {
    let mut out = String::new();
    for c in name.unwrap_or_default().chars() {
        if out.len() == MAX_STEM {
            break;
        }
        if c.is_ascii_alphanumeric() || c == '_' {
            out.push(c);
        } else if !out.ends_with('-') && !out.is_empty() {
            out.push('-');
        }
    }
    let stem = out.trim_end_matches('-');
    if stem.is_empty() { otherwise.to_owned() } else { stem.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_title_is_one_harmless_line_each() {
        let labels = BTreeMap::from([("part\nnumber".to_owned(), "47\u{202E}11\u{0}-A\r\n  x".to_owned())]);
        let title = TitleBlock::new(Some(" a\tb "), &labels);
        assert_eq!(title.lines(), ["a b", "part number: 4711 -A x", "units: mm"]);
    }

    #[test]
    fn long_names_end_in_dots_and_many_labels_end() {
        let labels = (0..100).map(|i| (format!("{i}"), "x".repeat(300))).collect();
        let title = TitleBlock::new(Some(&"ä".repeat(300)), &labels);
        assert_eq!(title.lines().len(), MAX_LINES);
        assert!(title.lines().iter().all(|l| l.chars().count() <= MAX_LINE));
        assert!(title.lines()[0].ends_with("..."));
    }

    #[test]
    fn a_title_stands_above_the_pattern_and_is_no_wider() {
        let title = TitleBlock::new(Some(&"x".repeat(79)), &BTreeMap::new());
        let laid = title.lay(DVec2::ZERO, DVec2::new(100.0, 30.0));
        assert!(laid.lines.iter().all(|(at, _)| at.y > 30.0 && at.y < laid.top));
        assert!(laid.right <= 100.0 + 1e-9);
    }

    #[test]
    fn file_names_are_plain() {
        assert_eq!(file_stem(Some("Rück/../leuchte \"4711\"\r\n"), "x"), "R-ck-leuchte-4711");
        assert_eq!(file_stem(Some("日本"), "pattern"), "pattern");
        assert_eq!(file_stem(None, "pattern"), "pattern");
    }
}
