//! The way of a part of several faces: each is meshed by itself, inside its borders; the meshes are sewn, and what comes out
//! goes the way of a mesh.
//!
//! Tolerances are those of the part: what is relative is so to the diagonal of all faces. There is no base surface and no
//! (u, v). Faces are meshed side by side and collected in their order, so that threads decide nothing.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::centred::Centred;
use super::meshed::{DEFAULT_CHORD_RELATIVE, Meshed, Share, default_triangles, rough_tolerance};
use super::{Failure, Outcome, SurfaceMesh, of_mesh};
use crate::engine::budget::{Observer, Stage};
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningDomain;
use crate::engine::job::{JobKind, JobOptions};
use crate::engine::pattern::DEFAULT_CURVE_TOLERANCE;
use crate::engine::sewing::{
    CutPoints, DEFAULT_SEWING_TOLERANCE, Face, GREATEST_SEWING_TOLERANCE, OFF_FACE, Part, SewingOptions, Sewn,
    Tolerances, sew,
};
use crate::engine::triangulation::density::MAX_TRIANGLES;
use crate::engine::triangulation::{
    Density, Lifted, TriangulationError, TriangulationMethod, observed_area, observed_chord_error,
};
use crate::engine::trimming::{Side, TrimmedSurface, part_box};

/// Border curves are followed no finer than this part of the diagonal: points beyond it are none that a cutter could tell
/// apart, and there would be millions.
const FINEST_BORDER: f64 = 1e-6;

/// The share of the border's chord tolerance that the loops in the domain may use up; the rest is the mesh's.
const LOOP_SHARE: f64 = 0.5;

/// Faces as one mesh, with what only the faces know.
pub(super) struct OfFaces {
    /// What sewing came to.
    pub sewn: Sewn,
    /// Area of the faces by their surfaces, mm^2.
    pub surface_area_mm2: f64,
    /// Greatest distance of a face's mesh from its surface, by sampling, mm.
    pub chord_error_mm: f64,
    /// Cells of the grids of all faces.
    pub cells: u64,
}

/// Does the work of a job on a part.
pub(super) fn run(
    kind: JobKind,
    part: &Part,
    options: &JobOptions,
    observer: &dyn Observer,
) -> Result<Outcome, Failure> {
    accepted(options)?;
    let faces = different(&part.faces);
    let doubled = (part.faces.len() - faces.len()) as u64;
    let diagonal = diagonal(&faces, observer)?;
    let tolerances = tolerances(options, diagonal)?;
    let mut filled = options.clone();
    filled.sewing = Some(SewingOptions { join: tolerances.join, tolerance_mm: Some(tolerances.sewing_mm) });
    if options.triangulation.grid.is_none() {
        filled.triangulation.tolerance = match options.triangulation.tolerance {
            None => Some(Density::Chord(DEFAULT_CHORD_RELATIVE * diagonal)),
            Some(Density::ChordRelative(share)) => Some(Density::Chord(share * diagonal)),
            given => given,
        };
    }
    let default = options.triangulation.grid.is_none() && options.triangulation.tolerance.is_none();
    let share = Share {
        border_mm: LOOP_SHARE * tolerances.chord_mm,
        clamp: (default && kind != JobKind::Triangulate).then(|| {
            let (least, most) = default_triangles(options.flattening.method());
            let count = faces.len().max(1) as u64;
            (least.div_ceil(count), most.div_ceil(count))
        }),
    };
    observer.enter(Stage::Triangulation);
    let mut of_faces = meshed(&faces, &filled, share, tolerances, observer)?;
    of_faces.sewn.report.faces += doubled;
    of_faces.sewn.report.faces_doubled = doubled;
    let surface = SurfaceMesh { mesh: std::mem::take(&mut of_faces.sewn.assembled.mesh), side: Side::Normal };
    of_mesh::run_sewn(kind, &surface, &filled, Some(&of_faces), observer)
}

/// Whether the options can be kept on a part of several faces.
fn accepted(options: &JobOptions) -> Result<(), EngineError> {
    let refused = |name: &str, detail: &str| Err(EngineError::Parameter { name: name.into(), detail: detail.into() });
    if options.triangulation.method != TriangulationMethod::Tracing {
        return refused(
            "triangulation.method",
            "a part of several faces is meshed inside their borders: take `tracing`, or leave this out",
        );
    }
    if options.flattening.domain == Some(FlatteningDomain::Base) {
        return refused(
            "flattening.domain",
            "a part of several faces has no base surface: take `trimmed`, or leave this out",
        );
    }
    Ok(())
}

/// The faces, each once: of those that are the same number for number the first.
fn different(faces: &[TrimmedSurface]) -> Vec<&TrimmedSurface> {
    let mut kept: Vec<&TrimmedSurface> = Vec::with_capacity(faces.len());
    for face in faces {
        let same = |other: &&TrimmedSurface| other.surface == face.surface && other.loops == face.loops;
        if !kept.iter().any(same) {
            kept.push(face);
        }
    }
    kept
}

/// Diagonal of the box of all faces, mm.
fn diagonal(faces: &[&TrimmedSurface], observer: &dyn Observer) -> Result<f64, EngineError> {
    let boxes: Vec<[DVec3; 2]> = faces
        .par_iter()
        .map(|face| {
            observer.check()?;
            let surface = &face.surface;
            let trims = face.check().map_err(|faults| first_fault(faults.into_iter().next()))?;
            Ok(part_box(surface, &trims.polygonise(surface, rough_tolerance(surface))?))
        })
        .collect::<Result<_, EngineError>>()?;
    let whole = boxes.into_iter().reduce(|[low, high], b| [low.min(b[0]), high.max(b[1])]);
    whole.map(|[low, high]| low.distance(high)).ok_or_else(|| TriangulationError::NoArea.into())
}

fn first_fault(fault: Option<crate::engine::trimming::TrimmingError>) -> EngineError {
    fault.map_or_else(|| TriangulationError::NoArea.into(), EngineError::from)
}

fn tolerances(options: &JobOptions, diagonal: f64) -> Result<Tolerances, EngineError> {
    let asked = options.sewing.unwrap_or_default();
    let sewing_mm = asked.tolerance_mm.unwrap_or(DEFAULT_SEWING_TOLERANCE * diagonal);
    let greatest = GREATEST_SEWING_TOLERANCE * diagonal;
    if !(sewing_mm > 0.0 && sewing_mm <= greatest) {
        return Err(EngineError::Parameter {
            name: "sewing.tolerance_mm".into(),
            detail: format!(
                "{sewing_mm} mm: a length greater than 0 and at most {greatest:.4} mm, a hundredth of this part's diagonal, \
                 is needed"
            ),
        });
    }
    let finest = FINEST_BORDER * diagonal;
    let chord_mm = options.curve_tolerance_mm.unwrap_or(DEFAULT_CURVE_TOLERANCE * diagonal).max(finest);
    Ok(Tolerances { sewing_mm, chord_mm, diagonal_mm: diagonal, join: asked.join })
}

/// A face with its mesh and what was measured of it.
struct Measured {
    lifted: Lifted,
    offset: DVec3,
    area: f64,
    chord: f64,
    cells: u64,
}

fn meshed(
    faces: &[&TrimmedSurface],
    options: &JobOptions,
    share: Share,
    tolerances: Tolerances,
    observer: &dyn Observer,
) -> Result<OfFaces, EngineError> {
    let measured: Vec<Measured> = faces
        .par_iter()
        .map(|face| {
            observer.check()?;
            let centred = Centred::new(face);
            let meshed = Meshed::within(JobKind::Triangulate, &centred, options, Some(share), observer)?;
            Ok(Measured {
                offset: centred.home.offset,
                area: observed_area(meshed.surface, &meshed.lifted.domain, observer)?,
                chord: observed_chord_error(meshed.surface, &meshed.lifted, observer)?,
                cells: meshed.counts.cells,
                lifted: meshed.lifted,
            })
        })
        .collect::<Result<_, EngineError>>()?;
    let count: u64 = measured.iter().map(|m| m.lifted.mesh.triangles.len() as u64).sum();
    if count > MAX_TRIANGLES {
        return Err(TriangulationError::TooManyTriangles { estimate: count, limit: MAX_TRIANGLES }.into());
    }
    let surface_area_mm2 = measured.iter().map(|m| m.area).sum();
    let chord_error_mm = measured.iter().map(|m| m.chord).fold(0.0, f64::max);
    let cells = measured.iter().map(|m| m.cells).sum();
    let cuts = placed_cuts(faces, &measured, options, tolerances, observer)?;
    let cut = faces.iter().zip(&measured).zip(&cuts);
    let cut = cut.map(|((face, m), cuts)| Face::new(face, &m.lifted, m.offset, cuts, observer));
    let sewn = sew(cut.collect::<Result<_, _>>()?, tolerances, observer)?;
    Ok(OfFaces { sewn, surface_area_mm2, chord_error_mm, cells })
}

/// For each face the cuts on it, in its domain.
fn placed_cuts(
    faces: &[&TrimmedSurface],
    meshes: &[Measured],
    options: &JobOptions,
    tolerances: Tolerances,
    observer: &dyn Observer,
) -> Result<Vec<Vec<Vec<DVec2>>>, EngineError> {
    let mut cuts = vec![Vec::new(); faces.len()];
    let refused = |k: usize, detail: String| Err(EngineError::Parameter { name: format!("cuts.{k}"), detail });
    for (k, cut) in options.cuts.iter().enumerate() {
        observer.check()?;
        if let Some(face) = cut.face
            && face as usize >= faces.len()
        {
            return refused(
                k,
                format!("there is no face {face}: the part has {} of them, counted from 0", faces.len()),
            );
        }
        let (face, points) = match &cut.points {
            CutPoints::Uv(points) => {
                if cut.face.is_none() && faces.len() > 1 {
                    return refused(k, "points in (u, v) need the `face` that they are on, counted from 0".to_owned());
                }
                (cut.face.unwrap_or(0) as usize, points.iter().copied().map(DVec2::from).collect::<Vec<_>>())
            }
            CutPoints::Xyz(points) => {
                let on = |f: usize| -> (f64, Vec<DVec2>) {
                    let near =
                        |p: &[f64; 3]| Face::nearest(faces[f], &meshes[f].lifted, meshes[f].offset, DVec3::from(*p));
                    let found: Vec<(DVec2, f64)> = points.iter().map(near).collect();
                    (found.iter().map(|(_, d)| *d).fold(0.0, f64::max), found.into_iter().map(|(uv, _)| uv).collect())
                };
                let asked = cut.face.map(|face| face as usize);
                let candidates = asked.map_or(0..faces.len(), |face| face..face + 1);
                let all: Vec<(f64, Vec<DVec2>)> = candidates.clone().into_par_iter().map(on).collect();
                let mut best: Option<(usize, f64, Vec<DVec2>)> = None;
                for (face, (off, places)) in candidates.zip(all) {
                    if best.as_ref().is_none_or(|(_, least, _)| off < *least) {
                        best = Some((face, off, places));
                    }
                }
                let most = OFF_FACE * tolerances.diagonal_mm;
                match best {
                    Some((face, off, places)) if off <= most => (face, places),
                    Some((_, off, _)) => {
                        return refused(
                            k,
                            format!(
                                "no face has all of its points: one lies {off:.4} mm off the nearest, and {most:.4} mm are \
                                 possible. Give a cut for each face that it runs over"
                            ),
                        );
                    }
                    None => continue,
                }
            }
        };
        cuts[face].push(points);
    }
    Ok(cuts)
}
