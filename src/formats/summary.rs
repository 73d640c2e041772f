//! What is said of a surface when it is sent: what was understood, how large it is, and what a person would want to know.
//!
//! Size and area are those of the *part*, inside its trimming loops, as the engine's [`survey`] finds them: to about a
//! thousandth, since the loops are followed to a thousandth of the diagonal.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::surface_json::ReadSurface;
use super::units::Units;
use crate::engine::error::Place;
use crate::engine::nurbs::{KnotVector, Surface};
use crate::engine::pipeline::survey;
use crate::engine::trimming::{Side, TrimWarning};

/// The kind of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceKind {
    /// A trimmed NURBS surface.
    TrimmedSurface,
    /// A triangle mesh.
    Mesh,
    /// A part of several trimmed faces.
    Part,
}

/// What an edge of the domain is in space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BorderKind {
    /// An edge of the surface.
    Edge,
    /// The same line as the opposite edge: the surface closes there. It stays a cut.
    Seam,
    /// One point.
    Pole,
}

/// The four edges of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Borders {
    /// Where u is least.
    pub u_first: BorderKind,
    /// Where u is greatest.
    pub u_last: BorderKind,
    /// Where v is least.
    pub v_first: BorderKind,
    /// Where v is greatest.
    pub v_last: BorderKind,
}

/// Something a person would want to know.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceWarning {
    /// Stable code in kebab case.
    pub code: String,
    /// In words.
    pub detail: String,
    /// Where.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
}

impl From<&TrimWarning> for SurfaceWarning {
    fn from(warning: &TrimWarning) -> Self {
        Self { code: warning.code.to_owned(), detail: warning.detail.clone(), place: Some(warning.place.clone()) }
    }
}

/// The summary of a surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Its name in the file.
    pub name: Option<String>,
    /// What it is.
    pub kind: SurfaceKind,
    /// The unit that the file's lengths were taken in. Everything below is in millimetres.
    pub units: Units,
    /// The show side.
    pub side: Side,
    /// Least and greatest corner of the part, by sampling.
    pub bounding_box_mm: [[f64; 3]; 2],
    /// Length of the box's diagonal.
    pub diagonal_mm: f64,
    /// Area of the part, where it could be had; else there is a warning.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_mm2: Option<f64>,
    /// Triangles that the default tolerance makes, roughly, where the part could be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default_triangles: Option<u64>,
    /// Along u and v.
    pub degrees: [usize; 2],
    /// Rows and columns of the net.
    pub control_points: [usize; 2],
    /// Non-empty knot spans along u and v.
    pub knot_spans: [usize; 2],
    /// Domain in u and in v.
    pub domain: [[f64; 2]; 2],
    /// Whether it has weights.
    pub rational: bool,
    /// The edges of the domain.
    pub borders: Borders,
    /// Trimming loops; none: the whole domain is the part.
    pub loops: usize,
    /// Trimming curves in all loops.
    pub curves: usize,
    /// What was mended or looks odd.
    pub warnings: Vec<SurfaceWarning>,
    /// What the file did not say outright.
    pub inferred: Vec<String>,
}

/// A part whose diagonal is longer, millimetres (200 m), was probably sent in another unit than was said: no cutter has
/// a bed for it, though roofs have panels half as long.
const LARGE_MM: f64 = 2e5;
/// The same of a part that is smaller (a tenth of a millimetre).
const SMALL_MM: f64 = 0.1;

/// Sums up a surface.
#[must_use]
pub fn summarise(read: &ReadSurface) -> Summary {
    let surface = &read.trimmed.surface;
    let (u, v) = (surface.knots_u(), surface.knots_v());
    let mut warnings: Vec<SurfaceWarning> = read.checked.warnings().iter().map(SurfaceWarning::from).collect();
    let mut warn = |code: &str, detail: String| {
        warnings.push(SurfaceWarning { code: code.to_owned(), detail, place: None });
    };
    let ([low, high], area_mm2, default_triangles) = match survey(&read.trimmed, &read.checked) {
        Ok(survey) => (survey.bounding_box, Some(survey.area), Some(survey.triangles)),
        Err(error) => {
            let detail = format!("the part could not be measured, so the box is that of the control net: {error}");
            warn("not-measured", detail);
            (surface.bounding_box(), None, None)
        }
    };
    let diagonal_mm = low.distance(high);
    warnings.extend(unusual_size(diagonal_mm, read.units));
    Summary {
        name: read.name.clone(),
        kind: SurfaceKind::TrimmedSurface,
        units: read.units,
        side: read.trimmed.side,
        bounding_box_mm: [low.to_array(), high.to_array()],
        diagonal_mm,
        area_mm2,
        default_triangles,
        degrees: [u.degree(), v.degree()],
        control_points: [u.control_count(), v.control_count()],
        knot_spans: [spans(u), spans(v)],
        domain: [u.domain(), v.domain()],
        rational: surface.weights().is_some(),
        borders: borders(surface),
        loops: read.trimmed.loops.len(),
        curves: read.trimmed.loops.iter().map(|l| l.curves.len()).sum(),
        warnings,
        inferred: read.inferred.clone(),
    }
}

/// A warning when a part is larger or smaller than parts are: the units may be wrong.
pub(super) fn unusual_size(diagonal_mm: f64, units: Units) -> Option<SurfaceWarning> {
    if (SMALL_MM..=LARGE_MM).contains(&diagonal_mm) {
        return None;
    }
    let (size, unit) = if diagonal_mm > LARGE_MM { (diagonal_mm * 1e-3, "m") } else { (diagonal_mm, "mm") };
    let said = units.symbol();
    let detail = format!("taken in {said}, the part's diagonal is {size:.4} {unit}: check the units");
    Some(SurfaceWarning { code: "unusual-size".to_owned(), detail, place: None })
}

/// Spans of the domain that are not empty.
fn spans(knots: &KnotVector) -> usize {
    knots.breaks().len() - 1
}

/// Distance within which two points are one, against the diagonal of the control net: above the rounding of files that
/// keep 8 digits, below any gap that is meant.
const SAME_PLACE: f64 = 1e-7;
/// Samples along an edge of the domain at least; there are no fewer than two a knot span.
const SAMPLES_LEAST: usize = 24;

/// Parameters along an edge, at and between the knots.
fn samples(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    let pieces = SAMPLES_LEAST.div_ceil(breaks.len() - 1).max(2);
    let span = |s: &[f64]| {
        let [from, to] = [s[0], s[1]];
        (0..pieces).map(move |k| from + (to - from) * (k as f64 / pieces as f64))
    };
    breaks.windows(2).flat_map(span).chain(breaks.last().copied()).collect()
}

/// What the edges of the domain are.
fn borders(surface: &Surface) -> Borders {
    let [low, high] = surface.bounding_box();
    let tolerance = SAME_PLACE * low.distance(high);
    let poles = surface.degenerate_edges(tolerance);
    let domain = surface.domain();
    let meets = |others: &KnotVector, first: &dyn Fn(f64) -> DVec3, last: &dyn Fn(f64) -> DVec3| {
        samples(others).iter().all(|t| first(*t).distance(last(*t)) <= tolerance)
    };
    let seam_u = meets(surface.knots_v(), &|t| surface.point(domain.u[0], t), &|t| surface.point(domain.u[1], t));
    let seam_v = meets(surface.knots_u(), &|t| surface.point(t, domain.v[0]), &|t| surface.point(t, domain.v[1]));
    let kind = |pole: bool, seam: bool| match (pole, seam) {
        (true, _) => BorderKind::Pole,
        (false, true) => BorderKind::Seam,
        (false, false) => BorderKind::Edge,
    };
    Borders {
        u_first: kind(poles[0], seam_u),
        u_last: kind(poles[1], seam_u),
        v_first: kind(poles[2], seam_v),
        v_last: kind(poles[3], seam_v),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::formats::surface_json::{ReadOptions, read};

    fn summary(text: &str) -> Summary {
        summarise(&read(text.as_bytes(), &ReadOptions::default()).unwrap())
    }

    /// A whole cylinder of radius 1 and height 2 in metres, by four rational quadratic arcs.
    fn cylinder(trims: &str) -> String {
        let square = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]];
        let rows: Vec<String> = square.iter().map(|[x, y]| format!("[[{x},{y},0],[{x},{y},2]]")).collect();
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let weights: Vec<String> =
            (0..9).map(|i| if i % 2 == 0 { "[1,1]".into() } else { format!("[{w},{w}]") }).collect();
        format!(
            r#"{{"units":"m","degree_u":2,"degree_v":1,"knots_u":[0,0,0,1,1,2,2,3,3,4,4,4],"knots_v":[0,0,2,2],
            "control_points":[{}],"weights":[{}],"trims":{trims}}}"#,
            rows.join(","),
            weights.join(",")
        )
    }

    /// The box as it should be, but for the sampling.
    fn near(s: &Summary, want: [f64; 6]) {
        for (found, want) in s.bounding_box_mm.as_flattened().iter().zip(want) {
            assert!((found - want).abs() < 1e-3 * s.diagonal_mm, "{:?}", s.bounding_box_mm);
        }
    }

    #[test]
    fn a_cylinder_has_its_area_its_box_and_a_seam() {
        let s = summary(&cylinder("[]"));
        assert!((s.area_mm2.unwrap() / (4e6 * PI) - 1.0).abs() < 1e-6, "{:?}", s.area_mm2);
        near(&s, [-1000.0, -1000.0, 0.0, 1000.0, 1000.0, 2000.0]);
        let (edge, seam) = (BorderKind::Edge, BorderKind::Seam);
        assert_eq!(s.borders, Borders { u_first: seam, u_last: seam, v_first: edge, v_last: edge });
        assert_eq!((s.degrees, s.knot_spans, s.control_points), ([2, 1], [4, 1], [9, 2]));
        assert!(s.rational && s.warnings.is_empty() && s.loops == 0);
    }

    #[test]
    fn size_and_area_are_those_of_the_part_not_of_the_base() {
        let s = summary(&cylinder("[[{\"points\":[[1,0.5],[2,0.5],[2,1],[1,1],[1,0.5]]}]]"));
        assert!((s.area_mm2.unwrap() / (0.25e6 * PI) - 1.0).abs() < 1e-6, "{:?}", s.area_mm2);
        near(&s, [-1000.0, 0.0, 500.0, 0.0, 1000.0, 1000.0]);
    }

    #[test]
    fn a_wrong_unit_shows_in_the_warnings() {
        let metres = cylinder("[]").replace("2]]", "2000]]");
        let s = summary(&metres);
        assert_eq!(s.warnings[0].code, "unusual-size");
        assert!(s.warnings[0].detail.contains("taken in m"), "{:?}", s.warnings);
    }

    #[test]
    fn the_real_surfaces_have_their_areas() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/surfaces");
        let Ok(entries) = std::fs::read_dir(folder) else {
            println!("skipped: {folder} is not there");
            return;
        };
        let mut wrong = Vec::new();
        for entry in entries {
            let path = entry.unwrap().path();
            let bytes = std::fs::read(&path).unwrap();
            let extra = &serde_json::from_slice::<serde_json::Value>(&bytes).unwrap()["extra"];
            let s = summarise(&read(&bytes, &ReadOptions::default()).unwrap());
            let want = extra["area_occt"].as_f64().unwrap();
            let error = s.area_mm2.map(|a| (a / want - 1.0).abs());
            if error.is_none_or(|e| e > 1e-3) {
                wrong.push(format!("{}: {error:?} {:?}", path.display(), s.warnings));
            }
            let poles = extra["n_degenerate_edges"].as_u64().unwrap();
            let b = s.borders;
            let found = [b.u_first, b.u_last, b.v_first, b.v_last].iter().filter(|k| **k == BorderKind::Pole).count();
            if (found as u64) < poles {
                wrong.push(format!("{}: {found} poles of {poles}", path.display()));
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
    }
}
