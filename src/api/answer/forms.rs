//! The forms of results, and which one a client gets: by suffix, by `?format=`, or by `Accept` (RFC 9110, 12.5.1).

use axum::http::{HeaderMap, header};

use crate::api::problem::{Kind, Problem};

/// A form of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// Drawing to look at and to cut, real millimetres.
    Svg,
    /// Drawing to cut.
    Dxf,
    /// Drawing for plotters: HPGL.
    Plt,
    /// Numbers in full.
    Json,
    /// Rows for a spreadsheet.
    Csv,
    /// Mesh to look at.
    Glb,
    /// Mesh as text.
    Obj,
    /// Mesh as bare triangles.
    Stl,
    /// Mesh with everything that is known of it.
    Ply,
}

impl Form {
    /// Its suffix and its name in `?format=`.
    #[must_use]
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Dxf => "dxf",
            Self::Plt => "plt",
            Self::Json => "json",
            Self::Csv => "csv",
            Self::Glb => "glb",
            Self::Obj => "obj",
            Self::Stl => "stl",
            Self::Ply => "ply",
        }
    }

    /// Its media type.
    #[must_use]
    pub const fn media(self) -> &'static str {
        match self {
            Self::Svg => "image/svg+xml",
            Self::Dxf => "image/vnd.dxf",
            Self::Plt => "application/vnd.hp-hpgl",
            Self::Json => "application/json",
            Self::Csv => "text/csv",
            Self::Glb => "model/gltf-binary",
            Self::Obj => "model/obj",
            Self::Stl => "model/stl",
            // No type of PLY is registered; this is what programs write.
            Self::Ply => "application/x-ply",
        }
    }

    /// Whether machines cut, or people trace, by it: a drawing of a pattern.
    #[must_use]
    pub const fn is_cut_by(self) -> bool {
        matches!(self, Self::Svg | Self::Dxf | Self::Plt)
    }

    /// The form with this suffix.
    #[must_use]
    pub fn by_suffix(suffix: &str, offered: &[Self]) -> Option<Self> {
        offered.iter().copied().find(|form| form.suffix() == suffix)
    }
}

/// The form that `Accept` likes best; of equals the first of `offered`, and that one too when nothing is said.
///
/// # Errors
/// 406 with the forms that there are.
pub(crate) fn choose(headers: &HeaderMap, offered: &[Form]) -> Result<Form, Problem> {
    let accept: Vec<&str> = headers.get_all(header::ACCEPT).iter().filter_map(|v| v.to_str().ok()).collect();
    let accept = accept.join(",");
    let ranges: Vec<Range<'_>> = accept.split(',').filter_map(Range::parse).collect();
    if ranges.is_empty() {
        return offered.first().copied().ok_or_else(|| not_acceptable(offered));
    }
    let mut best: Option<(Form, u16)> = None;
    for form in offered {
        let quality = quality(form.media(), &ranges);
        if quality > 0 && best.is_none_or(|(_, other)| quality > other) {
            best = Some((*form, quality));
        }
    }
    best.map(|(form, _)| form).ok_or_else(|| not_acceptable(offered))
}

/// The problem of a form that there is not.
pub(crate) fn not_acceptable(offered: &[Form]) -> Problem {
    let list: Vec<String> = offered.iter().map(|form| format!("{} (.{})", form.media(), form.suffix())).collect();
    Problem::new(Kind::NotAcceptable, format!("The forms of this result are: {}.", list.join(", ")))
}

/// One media range of `Accept`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Range<'a> {
    main: &'a str,
    sub: &'a str,
    /// Thousandths.
    quality: u16,
}

impl<'a> Range<'a> {
    fn parse(text: &'a str) -> Option<Self> {
        let mut parts = text.split(';');
        let (main, sub) = parts.next()?.trim().split_once('/')?;
        let quality = parts
            .filter_map(|p| p.trim().split_once('='))
            .find(|(name, _)| name.trim().eq_ignore_ascii_case("q"))
            .map_or(Some(1.0), |(_, value)| value.trim().parse::<f64>().ok())
            .filter(|q| (0.0..=1.0).contains(q))?;
        Some(Self { main, sub, quality: (quality * 1000.0).round() as u16 })
    }

    /// How closely the range names the type: 2 exactly, 1 its family, 0 anything.
    fn closeness(&self, media: &str) -> Option<u8> {
        let (main, sub) = media.split_once('/')?;
        match (self.main, self.sub) {
            ("*", "*") => Some(0),
            (m, "*") if m.eq_ignore_ascii_case(main) => Some(1),
            (m, s) if m.eq_ignore_ascii_case(main) && s.eq_ignore_ascii_case(sub) => Some(2),
            _ => None,
        }
    }
}

/// What the closest range says of a type, thousandths; 0: not wanted.
fn quality(media: &str, ranges: &[Range<'_>]) -> u16 {
    ranges.iter().filter_map(|range| Some((range.closeness(media)?, range.quality))).max().map_or(0, |(_, q)| q)
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    const PATTERN: [Form; 3] = [Form::Svg, Form::Dxf, Form::Json];

    fn chosen(accept: &str) -> Option<Form> {
        let headers = HeaderMap::from_iter([(header::ACCEPT, HeaderValue::from_str(accept).unwrap())]);
        choose(&headers, &PATTERN).ok()
    }

    #[test]
    fn silence_and_anything_give_the_first_form() {
        assert_eq!(choose(&HeaderMap::new(), &PATTERN).unwrap(), Form::Svg);
        assert_eq!(chosen("*/*"), Some(Form::Svg));
    }

    #[test]
    fn the_closest_range_counts_and_then_its_quality() {
        assert_eq!(chosen("image/vnd.dxf"), Some(Form::Dxf));
        assert_eq!(chosen("application/json, image/*;q=0.5"), Some(Form::Json));
        assert_eq!(chosen("image/*, image/svg+xml;q=0.1"), Some(Form::Dxf));
        assert_eq!(chosen("*/*, image/svg+xml;q=0"), Some(Form::Dxf));
        assert_eq!(chosen("text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"), Some(Form::Svg));
        assert_eq!(chosen("IMAGE/VND.DXF;version=12;q=1.0"), Some(Form::Dxf));
    }

    #[test]
    fn a_form_that_there_is_not_is_refused() {
        assert_eq!(chosen("application/pdf"), None);
        assert_eq!(chosen("*/*;q=0"), None);
    }
}
