//! What the report says of a mesh and of its flattening.

use glam::DVec2;
use rayon::prelude::*;

use super::flattened::Laid;
use super::meshed::Meshed;
use crate::engine::budget::Observer;
use crate::engine::curvature::developability::DevelopabilityReport;
use crate::engine::distortion::{self, AspectRatio, FlatteningReport, TriangulationReport};
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningMethod;
use crate::engine::job::{JobKind, JobOptions};
use crate::engine::mesh::{Mesh, Topology, measures};
use crate::engine::triangulation::{Configuration, observed_area, observed_chord_error, trace};

/// Vertices whose curvature is evaluated together.
const CURVATURE_BLOCK: usize = 1024;

/// The mesh.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub(super) fn triangulation(meshed: &Meshed, observer: &dyn Observer) -> Result<TriangulationReport, EngineError> {
    let (mesh, topology) = (&meshed.lifted.mesh, &meshed.topology);
    let surface_area_mm2 = observed_area(meshed.surface, &meshed.lifted.domain, observer)?;
    let part_area_mm2 = if meshed.of_part || meshed.region.natural {
        Some(surface_area_mm2)
    } else {
        let part = trace(&meshed.lines, &meshed.region, observer);
        observer.check()?;
        let domain = part.ok().and_then(|traced| traced.triangulate(Configuration::Regular, 0).ok());
        domain.map(|domain| observed_area(meshed.surface, &domain, observer)).transpose()?
    };
    Ok(TriangulationReport {
        vertices: mesh.positions.len() as u64,
        edges: topology.edge_count() as u64,
        triangles: mesh.triangles.len() as u64,
        area_mm2: measures::total_area(mesh),
        surface_area_mm2,
        part_area_mm2,
        chord_error_mm: observed_chord_error(meshed.surface, &meshed.lifted, observer)?,
        edge_max_mm: measures::edge_lengths(mesh, topology).into_iter().fold(0.0, f64::max),
        grid: [meshed.lines.u.len() as u32, meshed.lines.v.len() as u32],
        cells: meshed.counts.cells,
        cells_traced: meshed.counts.cells_traced,
        cells_distinct: meshed.counts.cells_distinct,
        borders: topology.border_count() as u64,
        pieces: topology.piece_count() as u64,
        aspect_ratio: AspectRatio::of(mesh),
        curvature: None,
        ampc: meshed.ampc,
        developability: None,
    })
}

/// What the mesh of a surface foretells of its flattening.
pub(super) fn developability(meshed: &Meshed) -> DevelopabilityReport {
    let own = |place: DVec2| meshed.surface.curvature(place.x, place.y);
    DevelopabilityReport::of(&meshed.lifted.mesh, &meshed.topology, Some(&own))
}

/// A mesh whose area is off the surface's by more than this share is told of: it is not the surface that was meant.
pub const AREA_WARNING: f64 = 0.05;

/// What is to be said of a mesh that is not its surface.
pub(super) fn area_warning(found: &TriangulationReport) -> Option<String> {
    let off = (found.area_mm2 - found.surface_area_mm2).abs() / found.surface_area_mm2;
    (off > AREA_WARNING).then(|| {
        format!(
            "the mesh's area is {:.0} % off the surface's: it has too few points, or its rows lie across the curvature",
            100.0 * off
        )
    })
}

/// A mesh that is the surface itself: nothing lies between the two, and no grid was laid.
pub(super) fn of_mesh(mesh: &Mesh, topology: &Topology) -> TriangulationReport {
    let area_mm2 = measures::total_area(mesh);
    TriangulationReport {
        vertices: mesh.positions.len() as u64,
        edges: topology.edge_count() as u64,
        triangles: mesh.triangles.len() as u64,
        area_mm2,
        surface_area_mm2: area_mm2,
        part_area_mm2: Some(area_mm2),
        edge_max_mm: measures::edge_lengths(mesh, topology).into_iter().fold(0.0, f64::max),
        borders: topology.border_count() as u64,
        pieces: topology.piece_count() as u64,
        aspect_ratio: AspectRatio::of(mesh),
        ..TriangulationReport::default()
    }
}

/// Whether curvature belongs to what a job is about: it is of no use to who only wants the pattern.
pub(super) const fn tells_curvature(kind: JobKind, method: FlatteningMethod) -> bool {
    match kind {
        JobKind::Triangulate | JobKind::OptimumSeedSearch => true,
        JobKind::Flatten => method.is_sequential(),
    }
}

/// The surface's own Gaussian curvature at each vertex of its mesh, 1/mm^2.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub(super) fn own_curvature(meshed: &Meshed, observer: &dyn Observer) -> Result<Vec<f64>, EngineError> {
    let places = meshed.lifted.mesh.uv.as_deref().unwrap_or_default();
    let blocks: Vec<Vec<f64>> = places
        .par_chunks(CURVATURE_BLOCK)
        .map(|block| {
            observer.check()?;
            Ok(block.iter().map(|p| meshed.surface.curvature(p.x, p.y).gaussian).collect())
        })
        .collect::<Result<_, EngineError>>()?;
    Ok(blocks.concat())
}

/// The flattening.
pub(super) fn flattening(mesh: &Mesh, laid: &Laid, options: &JobOptions) -> FlatteningReport {
    let method = options.flattening.method();
    FlatteningReport {
        method: method.name().to_owned(),
        domain: options.domain().name().to_owned(),
        objective: (method == FlatteningMethod::Isometric).then(|| options.flattening.objective().name().to_owned()),
        solver: laid.solver.map(|(solver, _)| solver),
        injective: laid.injective.map(|(injective, _)| injective),
        // Where something had to be looked for, not all of the part is without strain.
        developable: laid.developable.clone().filter(|_| laid.solver.is_none()),
        release: laid.release.clone(),
        seed: laid.seed,
        levels: method.is_sequential().then_some(laid.levels.len() as u64),
        level_counts: method
            .is_sequential()
            .then(|| laid.levels.iter().map(|level| [level.triangles, level.averaged, level.duplicates]).collect()),
        averaged_points: (method == FlatteningMethod::Cader).then_some(laid.averaged),
        greatest_movement_mm: laid.movement.as_ref().map(|all| all.iter().copied().fold(0.0, f64::max)),
        flattened: laid.flattened,
        flips: flips(mesh, &laid.flat),
        overlaps: None,
        overlap_places: Vec::new(),
        pins: Vec::new(),
    }
}

/// Principal strains of each triangle, percent; NaN where there are none.
pub(super) fn strains(mesh: &Mesh, flat: &[DVec2]) -> Vec<[f64; 2]> {
    distortion::strains(mesh, flat)
        .into_iter()
        .map(|strain| strain.map_or([f64::NAN; 2], distortion::TriangleStrain::percent))
        .collect()
}

/// Triangles of the plane that are not anticlockwise, exactly; those that were not reached do not count. Readings that do
/// not test every triangle may leave some behind.
pub(super) fn flips(mesh: &Mesh, flat: &[DVec2]) -> u64 {
    let coordinates = |v: u32| robust::Coord { x: flat[v as usize].x, y: flat[v as usize].y };
    let flipped = |t: &&[u32; 3]| {
        let [a, b, c] = t.map(coordinates);
        [a, b, c].iter().all(|p| p.x.is_finite() && p.y.is_finite()) && robust::orient2d(a, b, c) <= 0.0
    };
    mesh.triangles.iter().filter(flipped).count() as u64
}
