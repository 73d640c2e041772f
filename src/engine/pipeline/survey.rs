//! What can be said of a surface before any job: how large its part is in space.

use glam::DVec3;

use super::centred::Centred;
use super::meshed::{DEFAULT_CHORD_RELATIVE, rough_tolerance};
use crate::engine::budget::Unobserved;
use crate::engine::error::EngineError;
use crate::engine::triangulation::density::{self, DensityInput, DensityLimits};
use crate::engine::triangulation::{Configuration, Density, rough_trimmed_area, trace};
use crate::engine::trimming::{CheckedTrims, TrimmedSurface, part_box};

/// Chord tolerance of the mesh that the area is integrated over, as a fraction of the diagonal. The integrand is that of
/// the surface itself, so the mesh may be coarse inside. It is the default of a job, whose triangles are so foretold.
const AREA_CHORD: f64 = DEFAULT_CHORD_RELATIVE;

/// Chord tolerance of the loops, as a fraction of the diagonal. What their chords leave out is missing from the area: at
/// [`AREA_CHORD`] that would be more than a hundredth of a narrow part, at this it is below a thousandth.
const LOOP_CHORD: f64 = 1e-5;

/// A part that needs more triangles than this at [`AREA_CHORD`] is not measured: it would cost the answer to whoever
/// sends a surface seconds and hundreds of megabytes. Parts as people send them need hundreds to some ten thousand.
const MOST_TRIANGLES: u64 = 500_000;

/// What a survey found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// Least and greatest corner of the part, by sampling, mm.
    pub bounding_box: [DVec3; 2],
    /// Length of the box's diagonal, mm.
    pub diagonal: f64,
    /// Area inside the trimming loops, mm^2.
    pub area: f64,
    /// Triangles of the grid that the default tolerance makes: two for each cell of the domain, of which loops leave some
    /// out.
    pub triangles: u64,
}

/// Measures the part that the checked loops of a surface bound.
///
/// # Errors
/// Where the loops cannot be polygonised or the domain not be triangulated at the survey's own coarse tolerance.
pub fn survey(surface: &TrimmedSurface, trims: &CheckedTrims) -> Result<Survey, EngineError> {
    let centred = Centred::new(surface);
    let base = &centred.part.surface;
    let [low, high] = part_box(base, &trims.polygonise(base, rough_tolerance(base))?);
    let diagonal = low.distance(high);
    let region = trims.polygonise(base, LOOP_CHORD * diagonal)?;
    let input = DensityInput {
        surface: base,
        region: Some(&region),
        diagonal,
        density: Density::ChordRelative(AREA_CHORD),
        configuration: Configuration::Regular,
        limits: DensityLimits { max_triangles: MOST_TRIANGLES, ..DensityLimits::default() },
    };
    let lines = density::plan(&input, &Unobserved)?;
    let domain = trace(&lines, &region, &Unobserved)?.triangulate(Configuration::Regular, 0)?;
    Ok(Survey {
        bounding_box: [low + centred.home.offset, high + centred.home.offset],
        diagonal,
        area: rough_trimmed_area(base, &domain),
        triangles: 2 * lines.cells(),
    })
}
