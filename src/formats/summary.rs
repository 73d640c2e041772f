//! What is said of a surface when it is sent.

use serde::{Deserialize, Serialize};

use super::surface_json::ReadSurface;
use super::units::Units;
use crate::engine::error::Place;
use crate::engine::nurbs::KnotVector;
use crate::engine::pipeline::survey;
use crate::engine::trimming::{Side, TrimWarning};

/// The kind of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceKind {
    /// A trimmed NURBS surface.
    TrimmedSurface,
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
    /// Area inside the trimming loops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_mm2: Option<f64>,
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
    /// Trimming loops.
    pub loops: usize,
    /// Trimming curves in all loops.
    pub curves: usize,
    /// What was mended or looks odd.
    pub warnings: Vec<SurfaceWarning>,
    /// What the file did not say outright.
    pub inferred: Vec<String>,
}

/// Sums up a surface.
#[must_use]
pub fn summarise(read: &ReadSurface) -> Summary {
    let surface = &read.trimmed.surface;
    let (u, v) = (surface.knots_u(), surface.knots_v());
    let mut warnings: Vec<_> = read.checked.warnings().iter().map(SurfaceWarning::from).collect();
    let survey = survey(&read.trimmed, &read.checked);
    let ([low, high], area_mm2) = match &survey {
        Ok(survey) => (survey.bounding_box, Some(survey.area)),
        Err(error) => {
            let detail = format!("the part could not be measured, so the box is that of the control net: {error}");
            warnings.push(SurfaceWarning { code: "not-measured".to_owned(), detail, place: None });
            (surface.bounding_box(), None)
        }
    };
    Summary {
        name: read.name.clone(),
        kind: SurfaceKind::TrimmedSurface,
        units: read.units,
        side: read.trimmed.side,
        bounding_box_mm: [low.to_array(), high.to_array()],
        diagonal_mm: low.distance(high),
        area_mm2,
        degrees: [u.degree(), v.degree()],
        control_points: [u.control_count(), v.control_count()],
        knot_spans: [spans(u), spans(v)],
        domain: [u.domain(), v.domain()],
        rational: surface.weights().is_some(),
        loops: read.trimmed.loops.len(),
        curves: read.trimmed.loops.iter().map(|l| l.curves.len()).sum(),
        warnings,
        inferred: read.inferred.clone(),
    }
}

/// Spans of the domain that are not empty.
fn spans(knots: &KnotVector) -> usize {
    let inside = &knots.knots()[knots.degree()..=knots.control_count()];
    inside.windows(2).filter(|w| w[0] < w[1]).count()
}
