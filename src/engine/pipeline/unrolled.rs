//! Parts that lie flat without strain: laid flat from the surface itself, and measured on it.

use glam::DVec2;

use super::flattened::Laid;
use super::meshed::Meshed;
use crate::engine::budget::{Observer, Stage};
use crate::engine::distortion::{self, DevelopableReport, DistortionMeasures, StrainPlace, Thresholds};
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningMethod;
use crate::engine::flattening::developable::{DEVELOPABLE_STRAIN, Unrolled, unroll};
use crate::engine::mesh::{Mesh, Topology, measures};
use crate::engine::nurbs::Domain;

/// Whether a method takes the exact map where there is one: those that look for the least distortion do, those that follow
/// a published procedure do not.
pub(super) const fn takes_exact(method: FlatteningMethod) -> bool {
    match method {
        FlatteningMethod::Isometric => true,
        FlatteningMethod::Cader | FlatteningMethod::Mccartney | FlatteningMethod::Wang => false,
    }
}

/// The map of the part's surface to the plane with the places of the mesh's vertices, where the surface is developable.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub(super) fn unrolled(meshed: &Meshed, observer: &dyn Observer) -> Result<Option<(Unrolled, Laid)>, EngineError> {
    let Some(uv) = meshed.lifted.mesh.uv.as_deref() else { return Ok(None) };
    observer.enter(Stage::Flattening);
    let Some(exact) = unroll(meshed.surface, window(meshed), DEVELOPABLE_STRAIN, observer)? else { return Ok(None) };
    let developable = DevelopableReport { kind: exact.kind().name().to_owned(), strain: exact.strain() };
    let laid = Laid {
        flattened: meshed.lifted.mesh.triangles.len() as u64,
        developable: Some(developable),
        ..Laid::at(uv.iter().map(|&uv| exact.map(uv)).collect())
    };
    // Triangles so large that their chords cut across the part's curves could turn over; then another method is to lay them.
    let upright = super::reports::flips(&meshed.lifted.mesh, &laid.flat) == 0;
    Ok(upright.then_some((exact, laid)))
}

/// The box of what is flattened in the domain.
fn window(meshed: &Meshed) -> Domain {
    if !meshed.of_part {
        return meshed.surface.domain();
    }
    let points = || meshed.region.loops.iter().flat_map(|l| l.points.iter().copied());
    let (low, high) = (points().fold(DVec2::INFINITY, DVec2::min), points().fold(DVec2::NEG_INFINITY, DVec2::max));
    Domain { u: [low.x, high.x], v: [low.y, high.y] }
}

/// The mesh as it is on the surface: its edges have the lengths of the surface's curves and not of their chords, which in
/// the plane they have.
pub(super) fn on_surface(mesh: &Mesh, flat: &[DVec2]) -> Mesh {
    Mesh {
        positions: flat.iter().map(|p| p.extend(0.0)).collect(),
        uv: mesh.uv.clone(),
        triangles: mesh.triangles.clone(),
    }
}

/// The measures of a part that was unrolled: nothing changes but by the strain that was measured on the surface.
pub(super) fn measured(
    exact: &Unrolled,
    mesh: &Mesh,
    topology: &Topology,
    flat: &[DVec2],
    part: Option<&[bool]>,
    thresholds: Thresholds,
) -> DistortionMeasures {
    let mut found = distortion::measure(&on_surface(mesh, flat), topology, flat, part, thresholds);
    let percent = 100.0 * exact.strain();
    let strain = &mut found.strain_percent;
    [strain.min, strain.p01, strain.p99, strain.max] = [-percent, -percent, percent, percent];
    let back = |place: &mut StrainPlace| {
        if mesh.triangles.len() > place.triangle as usize {
            place.xyz_mm = measures::centroid(measures::corners(mesh, place.triangle)).to_array();
        }
    };
    back(&mut strain.at_min);
    back(&mut strain.at_max);
    found
}
