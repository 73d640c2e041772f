//! What is said of a part of several faces when it is sent. Sizes are of the faces inside their trimming loops, as a summary of
//! one surface gives them; which borders meet is not known before a job sews them.

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::summary::{SurfaceKind, SurfaceWarning, unusual_size};
use super::surface_json::ReadPart;
use super::units::Units;
use crate::engine::pipeline::survey;

/// Warnings of single faces that are listed; there may be thousands.
const MAX_TOLD: usize = 20;

/// The summary of a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartSummary {
    /// Its name in the file.
    pub name: Option<String>,
    /// What it is.
    pub kind: SurfaceKind,
    /// The unit that the file's lengths were taken in. Everything below is in millimetres.
    pub units: Units,
    /// Least and greatest corner, by sampling.
    pub bounding_box_mm: [[f64; 3]; 2],
    /// Length of the box's diagonal.
    pub diagonal_mm: f64,
    /// Area of all faces, where it could be had; else there is a warning.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_mm2: Option<f64>,
    /// Triangles that the default tolerance makes of the faces one by one, roughly, where they could be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default_triangles: Option<u64>,
    /// Faces.
    pub faces: usize,
    /// Trimming loops of all faces.
    pub loops: usize,
    /// Trimming curves in all loops.
    pub curves: usize,
    /// What was mended or looks odd.
    pub warnings: Vec<SurfaceWarning>,
    /// What the file did not say outright.
    pub inferred: Vec<String>,
}

/// Sums up a part.
#[must_use]
pub fn summarise(read: &ReadPart) -> PartSummary {
    let faces = &read.part.faces;
    let surveys: Vec<_> = faces.par_iter().zip(&read.checked).map(|(face, checked)| survey(face, checked)).collect();
    let mut warnings: Vec<SurfaceWarning> = Vec::new();
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let (mut area_mm2, mut default_triangles) = (Some(0.0), Some(0));
    for (k, ((face, checked), surveyed)) in faces.iter().zip(&read.checked).zip(surveys).enumerate() {
        warnings.extend(checked.warnings().iter().map(|warning| {
            let mut warning = SurfaceWarning::from(warning);
            warning.detail = format!("face {k}: {}", warning.detail);
            warning
        }));
        let [low, high] = match surveyed {
            Ok(found) => {
                area_mm2 = area_mm2.map(|sum| sum + found.area);
                default_triangles = default_triangles.map(|sum| sum + found.triangles);
                found.bounding_box
            }
            Err(error) => {
                (area_mm2, default_triangles) = (None, None);
                let detail = format!("face {k} could not be measured, so its box is that of the control net: {error}");
                warnings.push(SurfaceWarning { code: "not-measured".to_owned(), detail, place: None });
                face.surface.bounding_box()
            }
        };
        bounds = [bounds[0].min(low), bounds[1].max(high)];
    }
    if warnings.len() > MAX_TOLD {
        let more = warnings.len() - MAX_TOLD;
        warnings.truncate(MAX_TOLD);
        let detail = format!("{more} more warnings of single faces");
        warnings.push(SurfaceWarning { code: "more-warnings".to_owned(), detail, place: None });
    }
    let diagonal_mm = bounds[0].distance(bounds[1]);
    warnings.extend(unusual_size(diagonal_mm, read.units));
    PartSummary {
        name: read.name.clone(),
        kind: SurfaceKind::Part,
        units: read.units,
        bounding_box_mm: bounds.map(|corner| corner.to_array()),
        diagonal_mm,
        area_mm2,
        default_triangles,
        faces: faces.len(),
        loops: faces.iter().map(|face| face.loops.len()).sum(),
        curves: faces.iter().flat_map(|face| &face.loops).map(|l| l.curves.len()).sum(),
        warnings,
        inferred: read.inferred.clone(),
    }
}
