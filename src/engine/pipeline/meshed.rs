//! The first half of the way: loops checked and polygonised, density chosen, domain triangulated, mesh lifted to space.

use crate::engine::budget::{Observer, Stage};
use crate::engine::error::EngineError;
use crate::engine::flattening::{FlatteningDomain, FlatteningError, FlatteningMethod};
use crate::engine::job::{JobKind, JobOptions};
use crate::engine::mesh::Topology;
use crate::engine::nurbs::Surface;
use crate::engine::pattern::{self, DEFAULT_CURVE_TOLERANCE, Locator};
use crate::engine::triangulation::ampc::{self, AmpcCounts};
use crate::engine::triangulation::density::{self, DensityInput, DensityLimits, MAX_TRIANGLES};
use crate::engine::triangulation::{
    Configuration, Density, DomainMesh, GridLines, Lifted, TracingCounts, TriangulationError, TriangulationMethod,
    TriangulationOptions, aspect_of, fitted_mesh, grid_mesh, lift, random_mesh, trace,
};
use crate::engine::trimming::{CheckedTrims, TrimRegion, part_box};

use super::centred::Centred;
use super::piecewise;

/// Chord tolerance when neither a grid nor a tolerance is given, as a fraction of the part's diagonal.
pub const DEFAULT_CHORD_RELATIVE: f64 = 1e-3;
/// Sequential flattening fails on meshes that are too dense and says little on those that are too coarse: the default
/// density is brought into this range of triangles.
pub const CADER_TRIANGLES: (u64, u64) = (200, 7000);
/// The same for the map of least distortion: fewer triangles would not follow how strains change over the part, and more
/// add nothing that a cutter could follow.
pub const ISOMETRIC_TRIANGLES: (u64, u64) = (200, 400_000);
/// The share of an area tolerance that the polygonised boundary may use up; the rest is the curvature's.
const BOUNDARY_SHARE_OF_AREA: f64 = 0.25;
/// Relative accuracy of the surface's area where it only decides how finely loops are followed.
const ROUGH_AREA: f64 = 1e-3;
/// Points along each direction that a grid may have: beyond it the rows of a pattern lie closer than cutters resolve.
pub const MAX_GRID: u32 = 4096;

/// Fewest points each way on which lines of curvature are sampled where the grid is left to the program: two strips.
const LEAST_SAMPLING: u32 = 5;

/// A surface with its mesh.
pub(super) struct Meshed<'a> {
    pub surface: &'a Surface,
    pub trims: CheckedTrims,
    pub region: TrimRegion,
    pub lines: GridLines,
    pub counts: TracingCounts,
    /// What the method `ampc` counted.
    pub ampc: Option<AmpcCounts>,
    pub lifted: Lifted,
    pub topology: Topology,
    /// Chord tolerance of the pattern's curves, mm.
    pub curve_tolerance: f64,
    /// The options with what was chosen here filled in.
    pub options: JobOptions,
    /// True when the mesh is that of the part; false when it is that of the whole base surface.
    pub of_part: bool,
}

/// What a face of a part of several is meshed by, besides the options.
#[derive(Debug, Clone, Copy)]
pub(super) struct Share {
    /// Greatest chord tolerance of the loops, mm.
    pub border_mm: f64,
    /// The range of triangles that the density is brought into, if it is.
    pub clamp: Option<(u64, u64)>,
}

impl<'a> Meshed<'a> {
    pub(super) fn new(
        kind: JobKind,
        centred: &'a Centred,
        options: &JobOptions,
        observer: &dyn Observer,
    ) -> Result<Self, EngineError> {
        Self::within(kind, centred, options, None, observer)
    }

    /// The same for a face of several.
    pub(super) fn within(
        kind: JobKind,
        centred: &'a Centred,
        options: &JobOptions,
        share: Option<Share>,
        observer: &dyn Observer,
    ) -> Result<Self, EngineError> {
        let surface = &centred.part.surface;
        // A surface is checked whole when it is accepted, so a job meets the first fault only if it was not.
        let trims = centred.part.check().map_err(|faults| match faults.into_iter().next() {
            Some(fault) => EngineError::from(fault),
            None => EngineError::from(TriangulationError::NoArea),
        })?;
        let coarse = trims.polygonise(surface, rough_tolerance(surface))?;
        let [low, high] = part_box(surface, &coarse);
        let diagonal = low.distance(high);
        let of_part = !coarse.natural && of_part(kind, options)?;

        let mut filled = options.clone();
        let along_lines = options.triangulation.method == TriangulationMethod::Ampc;
        if of_part || along_lines {
            of_grid_alone(&options.triangulation)?;
        }
        let default_density = options.triangulation.grid.is_none() && options.triangulation.tolerance.is_none();
        if default_density {
            filled.triangulation.tolerance = Some(Density::ChordRelative(DEFAULT_CHORD_RELATIVE));
        }
        let clamp =
            (default_density && kind != JobKind::Triangulate).then(|| default_triangles(options.flattening.method()));
        let clamp = share.map_or(clamp, |share| share.clamp);
        let border = boundary_tolerance(&filled, surface, &coarse, diagonal);
        let region = trims.polygonise(surface, share.map_or(border, |share| border.min(share.border_mm)))?;
        observer.check()?;
        let lines = match (filled.triangulation.grid, filled.triangulation.tolerance) {
            (Some([m, n]), _) => uniform(surface, m, n)?,
            (None, tolerance) => density::plan(
                &DensityInput {
                    surface,
                    region: of_part.then_some(&region),
                    diagonal,
                    density: tolerance.unwrap_or(Density::ChordRelative(DEFAULT_CHORD_RELATIVE)),
                    configuration: filled.triangulation.configuration,
                    limits: DensityLimits { clamp, ..DensityLimits::default() },
                },
                observer,
            )?,
        };
        let lines = if along_lines { sampling(surface, &lines, &mut filled)? } else { lines };
        observer.check()?;
        let mut counted = None;
        let (configuration, phase) = (filled.triangulation.configuration, filled.triangulation.phase);
        let (domain, counts) = if of_part {
            observer.enter(Stage::Tracing);
            let traced = trace(&lines, &region, observer)?.with_aspect(aspect_of(surface, &lines));
            let counts = traced.counts();
            observer.enter(Stage::Triangulation);
            (traced.triangulate(configuration, phase)?, counts)
        } else {
            observer.enter(Stage::Triangulation);
            let counts = TracingCounts { cells: lines.cells(), ..TracingCounts::default() };
            let skew = filled.triangulation.skew.as_ref();
            let mut domain = match configuration {
                _ if along_lines => {
                    let asked = options.triangulation.ampc.unwrap_or_default();
                    let grid = [&lines.u, &lines.v].map(|lines| lines.len() as u32);
                    let made = ampc::ampc(surface, grid, &asked, observer)?;
                    if kind != JobKind::Triangulate {
                        keeps_the_part(surface, &region, made.dropped, &lines, observer)?;
                    }
                    counted = Some(made.counts);
                    made.domain
                }
                Configuration::Fitted => fitted_mesh(surface, &lines, skew, observer)?,
                Configuration::Random => random_mesh(&lines, filled.triangulation.random_seed.unwrap_or(0)),
                _ => grid_mesh(&lines, configuration, phase),
            };
            if let Some(skew) = skew {
                skew.apply(&mut domain, &lines)?;
            }
            (domain, counts)
        };
        observer.check()?;
        let lifted = lift(surface, domain, &lines);
        observer.check()?;
        if lifted.mesh.triangles.is_empty() {
            return Err(TriangulationError::NoArea.into());
        }
        let (lifted, topology) = piecewise::split_touching(lifted).map_err(FlatteningError::from)?;
        observer.check()?;
        let curve_tolerance = options.curve_tolerance_mm.unwrap_or(DEFAULT_CURVE_TOLERANCE * diagonal);
        Ok(Self {
            surface,
            trims,
            region,
            lines,
            counts,
            ampc: counted,
            lifted,
            topology,
            curve_tolerance,
            options: filled,
            of_part,
        })
    }

    /// What a person should know of the surface.
    pub(super) fn warnings(&self) -> Vec<String> {
        self.trims.warnings().iter().map(|warning| warning.detail.clone()).collect()
    }
}

/// Least and most triangles of the default density.
#[must_use]
pub const fn default_triangles(method: FlatteningMethod) -> (u64, u64) {
    match method {
        FlatteningMethod::Isometric => ISOMETRIC_TRIANGLES,
        FlatteningMethod::Cader | FlatteningMethod::Mccartney | FlatteningMethod::Wang => CADER_TRIANGLES,
    }
}

/// Whether the mesh is to be that of the part rather than that of the whole base surface.
fn of_part(kind: JobKind, options: &JobOptions) -> Result<bool, EngineError> {
    let traced = options.triangulation.method == TriangulationMethod::Tracing;
    match (kind, options.domain()) {
        (JobKind::Triangulate, _) => Ok(traced),
        (JobKind::Flatten | JobKind::OptimumSeedSearch, FlatteningDomain::Base) => Ok(false),
        (JobKind::Flatten | JobKind::OptimumSeedSearch, FlatteningDomain::Trimmed) if traced => Ok(true),
        (JobKind::Flatten | JobKind::OptimumSeedSearch, FlatteningDomain::Trimmed) => Err(EngineError::Parameter {
            name: "triangulation.method".into(),
            detail: format!(
                "`{}` makes a mesh of the whole base surface: with `flattening.domain: trimmed` take `tracing`",
                options.triangulation.method.name()
            ),
        }),
    }
}

/// What only the mesh of a whole grid can have.
fn of_grid_alone(asked: &TriangulationOptions) -> Result<(), EngineError> {
    let refused = |name: &str, detail: &str| Err(EngineError::Parameter { name: name.into(), detail: detail.into() });
    match asked.configuration {
        Configuration::Fitted | Configuration::Random => refused(
            "triangulation.configuration",
            "`fitted` and `random` place the diagonals of a whole grid: take the method `grid`",
        ),
        _ if asked.skew.is_some() => {
            refused("triangulation.skew", "the points of a whole grid are skewed: take the method `grid`")
        }
        _ => Ok(()),
    }
}

/// The uniform grid on which `ampc` samples: as many lines each way as the density asks for. They are filled in as a grid,
/// since a tolerance that placed them promises nothing of other lines.
fn sampling(surface: &Surface, planned: &GridLines, filled: &mut JobOptions) -> Result<GridLines, EngineError> {
    let most = |lines: &[f64]| (lines.len() as u32).clamp(LEAST_SAMPLING, ampc::MAX_POINTS);
    let [m, n] = filled.triangulation.grid.unwrap_or_else(|| [most(&planned.u), most(&planned.v)]);
    filled.triangulation.grid = Some([m, n]);
    filled.triangulation.tolerance = None;
    filled.triangulation.ampc = Some(filled.triangulation.ampc.unwrap_or_default());
    uniform(surface, m, n)
}

/// Whether a part can do without the triangles that were left out.
fn keeps_the_part(
    surface: &Surface,
    region: &TrimRegion,
    dropped: DomainMesh,
    lines: &GridLines,
    observer: &dyn Observer,
) -> Result<(), EngineError> {
    if dropped.triangles.is_empty() {
        return Ok(());
    }
    let dropped = lift(surface, dropped, lines);
    let locator = Locator::new(&dropped.domain, observer)?;
    let missed = pattern::triangles_of_part(&dropped, &locator, region, observer)?;
    match missed.iter().filter(|&&missed| missed).count() as u64 {
        0 => Ok(()),
        count => Err(TriangulationError::ThinInPart { count }.into()),
    }
}

fn uniform(surface: &Surface, m: u32, n: u32) -> Result<GridLines, EngineError> {
    if m.min(n) < 2 || m.max(n) > MAX_GRID {
        return Err(EngineError::Parameter {
            name: "triangulation.grid".into(),
            detail: format!("[{m}, {n}] points: 2 to {MAX_GRID} are possible along each direction"),
        });
    }
    let estimate = 2 * u64::from(m - 1) * u64::from(n - 1);
    if estimate > MAX_TRIANGLES {
        return Err(TriangulationError::TooManyTriangles { estimate, limit: MAX_TRIANGLES }.into());
    }
    Ok(GridLines::uniform(surface.domain(), m as usize, n as usize))
}

/// A tolerance to look at the loops with before the part's size is known.
pub(super) fn rough_tolerance(surface: &Surface) -> f64 {
    let [low, high] = surface.bounding_box();
    DEFAULT_CHORD_RELATIVE * low.distance(high)
}

/// How finely the loops are polygonised so that the mesh keeps what was asked for.
fn boundary_tolerance(options: &JobOptions, surface: &Surface, coarse: &TrimRegion, diagonal: f64) -> f64 {
    let default = DEFAULT_CHORD_RELATIVE * diagonal;
    if options.triangulation.grid.is_some() {
        return default;
    }
    let of_area = |area: f64| {
        let points = |l: &crate::engine::trimming::BoundaryLoop| -> f64 {
            let p: Vec<_> = l.points.iter().map(|uv| surface.point(uv.x, uv.y)).collect();
            (0..p.len()).map(|i| p[i].distance(p[(i + 1) % p.len()])).sum()
        };
        let perimeter: f64 = coarse.loops.iter().map(points).sum();
        default.min(BOUNDARY_SHARE_OF_AREA * area / perimeter.max(f64::MIN_POSITIVE))
    };
    match options.triangulation.tolerance {
        Some(Density::Chord(tolerance)) => tolerance,
        Some(Density::ChordRelative(share)) => share * diagonal,
        Some(Density::Area(area)) => of_area(area),
        Some(Density::AreaRelative(share)) => of_area(share * surface.area(ROUGH_AREA)),
        Some(Density::Edge(_)) | None => default,
    }
}
