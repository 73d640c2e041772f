//! The way of a mesh: it is its own triangulation, so the work begins with the seed and ends with a pattern whose outlines
//! are the mesh's borders.
//!
//! A mesh has no domain: a seed or a direction in (u, v) is refused, settings of the triangulation have no effect and
//! are reported as such. Pieces that are no sheets (closed, one-sided, with handles, or with an edge of three triangles)
//! fail a flattening before it begins; a triangulation gives them back with their measures.

use glam::DVec3;

use super::centred::{Home, centred_mesh};
use super::constraints::Constraints;
use super::findings::Lying;
use super::flattened::{self, Laid, Sheet};
use super::of_faces::OfFaces;
use super::seams::{Seamed, seams};
use super::{Failure, Outcome, SurfaceMesh, reports};
use crate::engine::budget::{Observer, Stage};
use crate::engine::curvature::CurvatureReport;
use crate::engine::curvature::developability::DevelopabilityReport;
use crate::engine::distortion::{self, DistortionReport, FlatteningReport, Report};
use crate::engine::error::EngineError;
use crate::engine::flattening::{FlatteningDomain, FlatteningError, FlatteningOptions, SeedChoice};
use crate::engine::job::{JobKind, JobOptions};
use crate::engine::mesh::{Mesh, MeshFault, Topology};
use crate::engine::pattern::{self, MeshDrawInput};
use crate::engine::seed::locate;
use crate::engine::triangulation::{TriangulationError, TriangulationOptions};

/// A mesh at the origin with what every job needs of it.
struct Ready<'a> {
    mesh: &'a Mesh,
    topology: Topology,
    /// Edges of more than two triangles, and edges across which triangles cannot agree.
    faults: Vec<MeshFault>,
    warnings: Vec<String>,
    /// The faces that it was sewn of, where it was.
    faces: Option<&'a OfFaces>,
}

/// Does the work of a job on a mesh.
pub(super) fn run(
    kind: JobKind,
    surface: &SurfaceMesh,
    options: &JobOptions,
    observer: &dyn Observer,
) -> Result<Outcome, Failure> {
    run_sewn(kind, surface, options, None, observer)
}

/// The same on the mesh that faces were sewn to.
pub(super) fn run_sewn(
    kind: JobKind,
    surface: &SurfaceMesh,
    options: &JobOptions,
    faces: Option<&OfFaces>,
    observer: &dyn Observer,
) -> Result<Outcome, Failure> {
    let (mesh, home) = centred_mesh(&surface.mesh);
    let ready = ready(&mesh, options, faces)?;
    observer.check()?;
    match kind {
        JobKind::Triangulate => {
            let mut outcome = meshed(kind, &ready, options);
            let foretold = DevelopabilityReport::of(ready.mesh, &ready.topology, None);
            outcome.report.triangulation.developability = Some(foretold);
            Ok(home.outcome_back(outcome))
        }
        JobKind::Flatten | JobKind::OptimumSeedSearch => {
            let seed = named_seed(&ready, options, home.offset)?;
            flatten(kind, &ready, (surface, home), seed, options, observer)
                .map(|outcome| home.outcome_back(outcome))
                .map_err(|failure| home.failure_back(failure))
        }
    }
}

fn ready<'a>(mesh: &'a Mesh, options: &JobOptions, faces: Option<&'a OfFaces>) -> Result<Ready<'a>, EngineError> {
    if mesh.triangles.is_empty() {
        return Err(TriangulationError::NoArea.into());
    }
    let (topology, faults) = Topology::cut(&mesh.triangles, mesh.positions.len()).map_err(FlatteningError::from)?;
    let mut warnings = Vec::new();
    if let Some(faces) = faces {
        warnings.extend(faces.sewn.report.warnings());
    } else if options.triangulation != TriangulationOptions::default() {
        warnings.push("the settings under `triangulation` have no effect: the surface is a mesh already".to_owned());
    }
    Ok(Ready { mesh, topology, faults, warnings, faces })
}

/// The seed as a triangle of the mesh, where the options name one.
fn named_seed(ready: &Ready, options: &JobOptions, offset: DVec3) -> Result<Option<u32>, EngineError> {
    let seed = match options.flattening.seed {
        Some(SeedChoice::Index(seed)) => locate::by_index(ready.mesh, seed)?,
        Some(SeedChoice::Vertices(corners)) => locate::by_vertices(ready.mesh, corners)?,
        Some(SeedChoice::Xyz(xyz)) => locate::by_xyz(ready.mesh, DVec3::from(xyz) - offset)?,
        Some(SeedChoice::Uv(_)) => {
            return Err(EngineError::Parameter {
                name: "flattening.seed".into(),
                detail: "a mesh has no (u, v): name the seed by a triangle's index, by { \"xyz\": [x, y, z] }, as \
                         `centre`, `predicted` or `optimum`"
                    .into(),
            });
        }
        Some(SeedChoice::Centre | SeedChoice::Optimum | SeedChoice::Predicted) | None => return Ok(None),
    };
    Ok(Some(seed))
}

/// The outcome of a job that ends with the mesh.
fn meshed(kind: JobKind, ready: &Ready, options: &JobOptions) -> Outcome {
    let mut triangulation = reports::of_mesh(ready.mesh, &ready.topology);
    if let Some(faces) = ready.faces {
        triangulation.surface_area_mm2 = faces.surface_area_mm2;
        triangulation.part_area_mm2 = Some(faces.surface_area_mm2);
        triangulation.chord_error_mm = faces.chord_error_mm;
        triangulation.cells = faces.cells;
    }
    if reports::tells_curvature(kind, options.flattening.method()) {
        triangulation.curvature = Some(CurvatureReport::of(ready.mesh, &ready.topology, None));
    }
    Outcome {
        mesh: ready.mesh.clone(),
        normals: normals(ready.mesh),
        report: Report {
            warnings: ready.warnings.iter().cloned().chain(reports::area_warning(&triangulation)).collect(),
            triangulation,
            sewing: ready.faces.map(|faces| faces.sewn.report.clone()),
            ..Report::default()
        },
        options: options.clone(),
        ..Outcome::default()
    }
}

/// The outcome of a job that goes on to the pattern.
fn flatten(
    kind: JobKind,
    ready: &Ready,
    (surface, home): (&SurfaceMesh, Home),
    seed: Option<u32>,
    options: &JobOptions,
    observer: &dyn Observer,
) -> Result<Outcome, Failure> {
    let (mesh, topology) = (ready.mesh, &ready.topology);
    let constraints = Constraints::of_mesh((mesh, topology), (options, surface.side, home), observer)?;
    let sheet = Sheet {
        mesh,
        topology,
        sound: ready.faults.is_empty(),
        is_surface: true,
        seed,
        part: None,
        landscape: kind == JobKind::OptimumSeedSearch,
        constraints: &constraints,
    };
    let laid = flattened::flatten(&sheet, options, observer).map_err(|stopped| {
        let partial = stopped.partial.map(|laid| {
            let mut outcome = meshed(kind, ready, options);
            outcome.strain_percent = Some(reports::strains(mesh, &laid.flat));
            outcome.report.flattening = Some(report(mesh, &laid, options));
            outcome.report.seed_search.clone_from(&laid.search);
            outcome.report.warnings.extend(laid.warnings.iter().cloned());
            outcome.seeds = laid.landscape;
            outcome.options.flattening = filled(options);
            outcome.options.flattening.seed = laid.seed_choice;
            outcome.movement = laid.movement;
            outcome.flat = Some(laid.flat);
            Box::new(outcome)
        });
        Failure { error: stopped.error, partial }
    })?;
    observer.enter(Stage::Pattern);
    observer.check()?;
    let mut drawn = pattern::draw_mesh(
        &MeshDrawInput {
            mesh,
            topology,
            side: surface.side,
            flat: &laid.flat,
            placement: &options.placement,
            holds: &laid.holds,
            curve_tolerance_mm: options.curve_tolerance_mm,
        },
        observer,
    )?;
    if let Some(faces) = ready.faces {
        let on = Seamed {
            mesh,
            topology,
            flat: &laid.flat,
            transform: &drawn.transform,
            origin_of: &faces.sewn.assembled.origin_of,
        };
        drawn.pattern.seams = seams(&faces.sewn.runs, &on);
    }
    drawn.finish(&options.finishing(), observer)?;
    let flat = drawn.transform.apply(&laid.flat);
    observer.check()?;
    let measures = distortion::measure(mesh, topology, &flat, None, options.thresholds);
    observer.check()?;
    let verdict = distortion::verdict(&options.limits, &measures, &drawn.boundary);
    let lying = Lying { mesh, topology, flat: &flat, mirrored: drawn.transform.mirrored, part: None };
    let mut flattening = report(mesh, &laid, options);
    lying.overlaps(&mut flattening, observer)?;
    flattening.pins = constraints.report(options, topology, (&laid.flat, None), &drawn.transform);
    let verdict = verdict.of_overlaps(flattening.overlaps);
    let hot_spots = lying.hot_spots(&options.limits);
    observer.check()?;
    let mut outcome = meshed(kind, ready, options);
    outcome.movement = laid.movement;
    outcome.report.warnings.extend(laid.warnings.iter().cloned());
    outcome.report.warnings.extend(Lying::warning(&flattening, options.flattening.is_constrained()));
    outcome.options.flattening = filled(options);
    outcome.options.flattening.seed = laid.seed_choice;
    outcome.strain_percent = Some(lying.strains());
    outcome.report.flattening = Some(flattening);
    outcome.report.seed_search = laid.search;
    outcome.seeds = laid.landscape;
    outcome.report.placement = Some(drawn.placement);
    outcome.report.verdict = Some(verdict);
    outcome.report.distortion = Some(DistortionReport {
        part: measures,
        base: None,
        iso_lines: None,
        boundary: drawn.boundary,
        thresholds: options.thresholds,
        hot_spots,
    });
    if let Some(told) = &mut outcome.report.sewing {
        told.tell_seams(&drawn.pattern.seams);
    }
    outcome.report.pattern = Some(drawn.report);
    outcome.pattern = Some(drawn.pattern);
    outcome.flat = Some(flat);
    Ok(outcome)
}

/// The flattening: of the mesh itself, since there is no base surface behind it.
fn report(mesh: &Mesh, laid: &Laid, options: &JobOptions) -> FlatteningReport {
    FlatteningReport { domain: "trimmed".to_owned(), ..reports::flattening(mesh, laid, options) }
}

/// The options as they were taken: behind a mesh there is no base.
fn filled(options: &JobOptions) -> FlatteningOptions {
    FlatteningOptions { domain: Some(FlatteningDomain::Trimmed), ..options.filled_flattening() }
}

/// Unit normals at the vertices: the mean of those of the triangles, weighted by their areas; zero where they cancel.
fn normals(mesh: &Mesh) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.positions.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
        let normal = (b - a).cross(c - a);
        for &v in corners {
            normals[v as usize] += normal;
        }
    }
    for normal in &mut normals {
        *normal = normal.normalize_or_zero();
    }
    normals
}
