//! The whole way from a surface to its pattern: the one function that a worker and the command line call. A trimmed
//! surface is meshed first; a mesh is worked on as it is; the faces of a part are meshed one by one and sewn to a mesh.
//!
//! The surface is moved so that its net's centre is the origin before anything is computed (coordinates far from the
//! origin would cost digits) and everything that comes out is moved back. Stages are announced to the observer as they
//! begin. What comes out holds no clock, id or timing: the same input gives the same bytes.

mod centred;
mod constraints;
mod findings;
mod flattened;
mod meshed;
mod of_faces;
mod of_mesh;
mod piecewise;
mod reports;
mod seams;
mod survey;
mod unrolled;

use glam::{DVec2, DVec3};

use super::budget::{Observer, Stage};
use super::curvature::CurvatureReport;
use super::distortion::{self, DistortionReport, InjectiveReport, Report, TriangulationReport};
use super::error::EngineError;
use super::flattening::{FlatteningMethod, SeedChoice};
use super::job::{JobKind, JobOptions, SearchStrategy};
use super::mesh::Mesh;
use super::pattern::{self, DrawInput, Locator, Pattern};
use super::seed::SeedLandscape;
use super::sewing::Part;
use super::triangulation::TriangulationMethod;
use super::trimming::{Side, TrimmedSurface};
use centred::Centred;
use constraints::Constraints;
use findings::Lying;
use flattened::{Laid, Sheet};
use meshed::Meshed;

pub use flattened::{OPTIMUM_UP_TO, optimum_up_to};
pub use meshed::{CADER_TRIANGLES, DEFAULT_CHORD_RELATIVE, ISOMETRIC_TRIANGLES, MAX_GRID, default_triangles};
pub use reports::AREA_WARNING;
pub use survey::{Survey, survey};

/// A mesh as a surface that a job works on: its vertices welded, its triangles oriented alike as far as they can be (see
/// [`super::mesh::assembly`]).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// The show side: `normal` is the side from which its triangles are anticlockwise.
    pub side: Side,
}

/// What a job works on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Input<'a> {
    /// A trimmed surface.
    Trimmed(&'a TrimmedSurface),
    /// A mesh.
    Mesh(&'a SurfaceMesh),
    /// A part of several faces.
    Part(&'a Part),
}

impl<'a> From<&'a TrimmedSurface> for Input<'a> {
    fn from(surface: &'a TrimmedSurface) -> Self {
        Self::Trimmed(surface)
    }
}

impl<'a> From<&'a Part> for Input<'a> {
    fn from(part: &'a Part) -> Self {
        Self::Part(part)
    }
}

impl<'a> From<&'a SurfaceMesh> for Input<'a> {
    fn from(surface: &'a SurfaceMesh) -> Self {
        Self::Mesh(surface)
    }
}

/// Everything that a job results in.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// The mesh.
    pub mesh: Mesh,
    /// Unit normals at its vertices.
    pub normals: Vec<DVec3>,
    /// Its flattening as placed in the pattern; NaN where a partial one did not get to.
    pub flat: Option<Vec<DVec2>>,
    /// The surface's own Gaussian curvature at each vertex, 1/mm^2, where the job is about curvature.
    pub gaussian: Option<Vec<f64>>,
    /// How far averaging moved each vertex, mm; NaN where a partial flattening did not get to.
    pub movement: Option<Vec<f64>>,
    /// Principal strains of each triangle `[least, greatest]`, percent; NaN where a partial flattening did not get to.
    pub strain_percent: Option<Vec<[f64; 2]>>,
    /// Which triangles meet the part, where the mesh is that of the whole base surface and the part is less than that.
    pub part: Option<Vec<bool>>,
    /// The pattern.
    pub pattern: Option<Pattern>,
    /// What became of each seed, after a search for the optimum.
    pub seeds: Option<SeedLandscape>,
    /// The report.
    pub report: Report,
    /// The options with every default filled in.
    pub options: JobOptions,
}

/// Why a job failed, and what can be read all the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// The reason.
    pub error: EngineError,
    /// What there is of a result: the mesh, and what of it was flattened.
    pub partial: Option<Box<Outcome>>,
}

impl From<EngineError> for Failure {
    fn from(error: EngineError) -> Self {
        Self { error, partial: None }
    }
}

/// Does the work of a job.
///
/// # Errors
/// [`Failure`] with the engine's error and, where a flattening stopped half-way, the mesh with what was flattened.
pub fn run<'a>(
    kind: JobKind,
    surface: impl Into<Input<'a>>,
    options: &JobOptions,
    observer: &dyn Observer,
) -> Result<Outcome, Failure> {
    observer.enter(Stage::Preparation);
    observer.check()?;
    let mut searching;
    let mut options = options;
    if kind == JobKind::OptimumSeedSearch {
        // A search for the best seed is not told where to begin.
        searching = options.clone();
        searching.flattening.method = Some(FlatteningMethod::Cader);
        let predicted = options.flattening.seed == Some(SeedChoice::Predicted)
            || options.search.strategy == SearchStrategy::Predicted;
        searching.flattening.seed = Some(if predicted { SeedChoice::Predicted } else { SeedChoice::Optimum });
        options = &searching;
    }
    match surface.into() {
        Input::Trimmed(surface) if !options.cuts.is_empty() => {
            // What is cut is a mesh: its pieces have no domain to themselves.
            of_faces::run(kind, &Part { faces: vec![surface.clone()] }, options, observer)
        }
        Input::Mesh(_) if !options.cuts.is_empty() => Err(EngineError::Parameter {
            name: "cuts".into(),
            detail: "a mesh is cut before it is sent: leave this out".into(),
        }
        .into()),
        Input::Trimmed(surface) => of_surface(kind, surface, options, observer),
        Input::Mesh(surface) => of_mesh::run(kind, surface, options, observer),
        Input::Part(part) => of_faces::run(kind, part, options, observer),
    }
}

/// The work on a trimmed surface.
fn of_surface(
    kind: JobKind,
    surface: &TrimmedSurface,
    options: &JobOptions,
    observer: &dyn Observer,
) -> Result<Outcome, Failure> {
    let centred = Centred::new(surface);
    let meshed =
        Meshed::new(kind, &centred, options, observer).map_err(|error| centred.home.failure_back(error.into()))?;
    match kind {
        JobKind::Triangulate => match triangulated(kind, &meshed, observer) {
            Ok(mut outcome) => {
                observer.check()?;
                outcome.report.triangulation.developability = Some(reports::developability(&meshed));
                Ok(centred.home.outcome_back(outcome))
            }
            Err(error) => Err(error.into()),
        },
        JobKind::Flatten | JobKind::OptimumSeedSearch => match flatten(kind, &meshed, options, &centred, observer) {
            Ok(outcome) => Ok(centred.home.outcome_back(outcome)),
            Err(failure) => Err(centred.home.failure_back(failure)),
        },
    }
}

/// The outcome of a job that ends with the mesh.
fn triangulated(kind: JobKind, meshed: &Meshed, observer: &dyn Observer) -> Result<Outcome, EngineError> {
    let (gaussian, triangulation) = triangulation(kind, meshed, observer)?;
    let warnings = meshed.warnings().into_iter().chain(reports::area_warning(&triangulation)).collect();
    Ok(Outcome {
        gaussian,
        mesh: meshed.lifted.mesh.clone(),
        normals: meshed.lifted.normals.clone(),
        report: Report { triangulation, warnings, ..Report::default() },
        options: meshed.options.clone(),
        ..Outcome::default()
    })
}

/// What is said of the mesh, and the surface's own curvature at its vertices where the job is about that.
fn triangulation(
    kind: JobKind,
    meshed: &Meshed,
    observer: &dyn Observer,
) -> Result<(Option<Vec<f64>>, TriangulationReport), EngineError> {
    let mut report = reports::triangulation(meshed, observer)?;
    if !reports::tells_curvature(kind, meshed.options.flattening.method()) {
        return Ok((None, report));
    }
    let own = reports::own_curvature(meshed, observer)?;
    report.curvature = Some(CurvatureReport::of(&meshed.lifted.mesh, &meshed.topology, Some(&own)));
    Ok((Some(own), report))
}

/// The outcome of a job that goes on to the pattern.
fn flatten(
    kind: JobKind,
    meshed: &Meshed,
    options: &JobOptions,
    centred: &Centred,
    observer: &dyn Observer,
) -> Result<Outcome, Failure> {
    let locator = Locator::new(&meshed.lifted.domain, observer)?;
    let inside = if meshed.of_part {
        vec![true; meshed.lifted.mesh.triangles.len()]
    } else {
        pattern::triangles_of_part(&meshed.lifted, &locator, &meshed.region, observer)?
    };
    let part = Some(inside.as_slice()).filter(|inside| inside.contains(&false));
    let asked = (options, centred.part.side, centred.home);
    let constraints = Constraints::of_surface(meshed, &locator, asked, observer)?;
    let sheet = Sheet {
        mesh: &meshed.lifted.mesh,
        topology: &meshed.topology,
        sound: true,
        is_surface: false,
        seed: flattened::named_seed(meshed, options, centred, part)?,
        part,
        landscape: kind == JobKind::OptimumSeedSearch,
        constraints: &constraints,
    };
    let exact =
        if unrolled::takes_exact(options.flattening.method()) { unrolled::unrolled(meshed, observer)? } else { None };
    // What is exact but lies on itself gives way to a map that does not, where that is asked for.
    let exact = match exact {
        Some((_, laid))
            if options.flattening.injective()
                && flattened::lies_on_itself((sheet.mesh, sheet.topology), part, &laid.flat, observer)? =>
        {
            None
        }
        Some((exact, mut laid)) => {
            let without = InjectiveReport { converged: true, ..InjectiveReport::default() };
            laid.injective = options.flattening.injective().then_some((without, 0.0));
            Some((exact, laid))
        }
        None => None,
    };
    // Where pins leave a gap it must be strained all the same.
    let exact = exact.and_then(|(exact, laid)| {
        let holds = constraints.hold_exactly(&meshed.topology, |uv| exact.map(uv))?;
        Some((exact, Laid { holds, ..laid }))
    });
    let (exact, laid) = match exact {
        Some((exact, laid)) => (Some(exact), Ok(laid)),
        None => (None, flattened::flatten(&sheet, options, observer)),
    };
    let laid = laid.map_err(|stopped| {
        let partial = stopped.partial.and_then(|laid| {
            // Nobody reads what there is of a job that was cancelled meanwhile.
            let mut outcome = triangulated(kind, meshed, observer).ok()?;
            outcome.part = part.map(<[bool]>::to_vec);
            outcome.strain_percent = Some(reports::strains(&meshed.lifted.mesh, &laid.flat));
            outcome.report.flattening = Some(reports::flattening(&meshed.lifted.mesh, &laid, options));
            outcome.report.seed_search.clone_from(&laid.search);
            outcome.report.warnings.extend(laid.warnings.iter().cloned());
            outcome.seeds = laid.landscape;
            outcome.options.flattening = options.filled_flattening();
            outcome.options.flattening.seed = laid.seed_choice;
            outcome.movement = laid.movement;
            outcome.flat = Some(laid.flat);
            Some(Box::new(outcome))
        });
        Failure { error: stopped.error, partial }
    })?;
    observer.enter(Stage::Pattern);
    observer.check()?;
    let input = DrawInput {
        surface: &centred.part.surface,
        side: centred.part.side,
        trims: &meshed.trims,
        lifted: &meshed.lifted,
        topology: &meshed.topology,
        locator: &locator,
        exact: exact.as_ref(),
        flat: &laid.flat,
        part: &inside,
        placement: &options.placement,
        holds: &laid.holds,
        curve_tolerance_mm: Some(meshed.curve_tolerance),
    };
    let mut drawn = pattern::draw(&input, observer)?;
    drawn.finish(&options.finishing(), observer)?;
    drop(locator);
    let flat = drawn.transform.apply(&laid.flat);
    observer.check()?;
    let mesh = &meshed.lifted.mesh;
    let measure = |part: Option<&[bool]>| match &exact {
        Some(exact) => unrolled::measured(exact, mesh, &meshed.topology, &flat, part, options.thresholds),
        None => distortion::measure(mesh, &meshed.topology, &flat, part, options.thresholds),
    };
    let measures = measure(part);
    observer.check()?;
    let base = part.map(|_| measure(None));
    observer.check()?;
    let verdict = distortion::verdict(&options.limits, &measures, &drawn.boundary);
    let lying = Lying { mesh, topology: &meshed.topology, flat: &flat, mirrored: drawn.transform.mirrored, part };
    let mut flattening = reports::flattening(mesh, &laid, options);
    lying.overlaps(&mut flattening, observer)?;
    let place = exact.as_ref().map(|exact| |uv| exact.map(uv));
    let place = place.as_ref().map(|place| place as &dyn Fn(DVec2) -> DVec2);
    flattening.pins = constraints.report(options, &meshed.topology, (&laid.flat, place), &drawn.transform);
    let verdict = verdict.of_overlaps(flattening.overlaps);
    // Strains of an exact map are those of rounding; the mesh's chords are none of the material's.
    let hot_spots = if exact.is_some() { Vec::new() } else { lying.hot_spots(&options.limits) };
    observer.check()?;
    let mut warnings = meshed.warnings();
    warnings.extend(laid.warnings.iter().cloned());
    warnings.extend(Lying::warning(&flattening, options.flattening.is_constrained()));
    let mut filled = meshed.options.clone();
    filled.flattening = options.filled_flattening();
    filled.flattening.seed = laid.seed_choice;
    filled.curve_tolerance_mm = Some(meshed.curve_tolerance);
    // Skewed points and lines of curvature lie on no iso-parameter lines.
    let asked = &meshed.options.triangulation;
    let follows_lines = asked.method != TriangulationMethod::Ampc && asked.skew.is_none();
    let iso_lines = if exact.is_none() && follows_lines {
        distortion::iso_lines(mesh, &meshed.topology, &flat, part)
    } else {
        None
    };
    let (gaussian, triangulation) = triangulation(kind, meshed, observer)?;
    warnings.extend(reports::area_warning(&triangulation));
    Ok(Outcome {
        mesh: mesh.clone(),
        normals: meshed.lifted.normals.clone(),
        gaussian,
        movement: laid.movement,
        strain_percent: Some(match &exact {
            Some(_) => reports::strains(&unrolled::on_surface(mesh, &flat), &flat),
            None => lying.strains(),
        }),
        part: part.map(<[bool]>::to_vec),
        report: Report {
            triangulation,
            flattening: Some(flattening),
            seed_search: laid.search,
            placement: Some(drawn.placement),
            verdict: Some(verdict),
            distortion: Some(DistortionReport {
                part: measures,
                base,
                iso_lines,
                boundary: drawn.boundary,
                thresholds: options.thresholds,
                hot_spots,
            }),
            pattern: Some(drawn.report),
            sewing: None,
            warnings,
        },
        pattern: Some(drawn.pattern),
        seeds: laid.landscape,
        flat: Some(flat),
        options: filled,
    })
}

#[cfg(test)]
mod tests;
