//! What can be said of a surface before any job: whether its loops hold, how large it is, what was mended.

use glam::DVec3;

use super::centred::Centred;
use super::meshed::rough_tolerance;
use crate::engine::budget::Unobserved;
use crate::engine::error::EngineError;
use crate::engine::triangulation::density::{self, DensityInput, DensityLimits};
use crate::engine::triangulation::{Configuration, Density, TriangulationError, trace, trimmed_area};
use crate::engine::trimming::{TrimWarning, TrimmedSurface, TrimmingError, part_box};

/// Chord tolerance of the mesh that the area is integrated over, as a fraction of the diagonal. The integrand is exact
/// on each triangle's own patch of the surface, so the mesh only has to follow the boundary.
const AREA_CHORD: f64 = 1e-3;

/// What a survey found.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Least and greatest corner of the part, by sampling, mm.
    pub bounding_box: [DVec3; 2],
    /// Length of the box's diagonal, mm.
    pub diagonal: f64,
    /// Area inside the trimming loops, mm^2; `None` where it could not be had at this tolerance.
    pub area: Option<f64>,
    /// What was mended or looks odd.
    pub warnings: Vec<TrimWarning>,
}

/// Checks a surface whole and measures it.
///
/// # Errors
/// All faults of its trimming loops.
pub fn survey(surface: &TrimmedSurface) -> Result<Survey, Vec<TrimmingError>> {
    let centred = Centred::new(surface);
    let back = |faults: Vec<TrimmingError>| -> Vec<_> {
        faults.into_iter().map(|fault| centred.trimming_back(fault)).collect()
    };
    let trims = centred.part.check().map_err(&back)?;
    let base = &centred.part.surface;
    let region = trims.polygonise(base, rough_tolerance(base)).map_err(|fault| back(vec![fault]))?;
    let [low, high] = part_box(base, &region);
    let diagonal = low.distance(high);
    let area = || -> Result<f64, EngineError> {
        let region = trims.polygonise(base, AREA_CHORD * diagonal)?;
        let lines = density::plan(
            &DensityInput {
                surface: base,
                region: Some(&region),
                diagonal,
                density: Density::ChordRelative(AREA_CHORD),
                configuration: Configuration::Regular,
                limits: DensityLimits::default(),
            },
            &Unobserved,
        )?;
        let domain = trace(&lines, &region, &Unobserved)?.triangulate(Configuration::Regular, 0)?;
        let area = trimmed_area(base, &domain);
        if area.is_finite() { Ok(area) } else { Err(TriangulationError::NoArea.into()) }
    };
    Ok(Survey {
        bounding_box: [low + centred.offset, high + centred.offset],
        diagonal,
        area: area().ok(),
        warnings: trims.warnings().iter().cloned().map(|w| centred.warning_back(w)).collect(),
    })
}
