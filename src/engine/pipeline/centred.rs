//! A surface moved to the origin, and the way back for everything that names a place in space.

use glam::DVec3;

use super::{Failure, Outcome};
use crate::engine::distortion::{DistortionMeasures, Report};
use crate::engine::error::{EngineError, Place};
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::Mesh;
use crate::engine::triangulation::TriangulationError;
use crate::engine::trimming::{TrimmedSurface, TrimmingError};

/// A surface whose net is centred at the origin.
pub(super) struct Centred {
    /// The surface.
    pub part: TrimmedSurface,
    /// The way back.
    pub home: Home,
}

/// The way back to where a surface really is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Home {
    /// What was subtracted, mm.
    pub offset: DVec3,
}

impl Centred {
    pub(super) fn new(surface: &TrimmedSurface) -> Self {
        let [low, high] = surface.surface.bounding_box();
        let offset = low.midpoint(high);
        let part = TrimmedSurface {
            surface: surface.surface.translated(-offset),
            loops: surface.loops.clone(),
            side: surface.side,
        };
        Self { part, home: Home { offset } }
    }
}

/// A mesh whose box is centred at the origin.
pub(super) fn centred_mesh(mesh: &Mesh) -> (Mesh, Home) {
    let places = || mesh.positions.iter().copied();
    let (Some(low), Some(high)) = (places().reduce(DVec3::min), places().reduce(DVec3::max)) else {
        return (mesh.clone(), Home { offset: DVec3::ZERO });
    };
    let offset = low.midpoint(high);
    (Mesh { positions: places().map(|p| p - offset).collect(), ..mesh.clone() }, Home { offset })
}

impl Home {
    /// The outcome where the surface really is.
    pub(super) fn outcome_back(&self, mut outcome: Outcome) -> Outcome {
        for p in &mut outcome.mesh.positions {
            *p += self.offset;
        }
        self.report_back(&mut outcome.report);
        outcome
    }

    /// The failure where the surface really is.
    pub(super) fn failure_back(&self, mut failure: Failure) -> Failure {
        match &mut failure.error {
            EngineError::Trimming(error) => self.trimming_back(error),
            EngineError::Triangulation(TriangulationError::Polygon { place }) => self.place_back(place),
            EngineError::Flattening(error) => self.flattening_back(error),
            _ => {}
        }
        failure.partial = failure.partial.map(|outcome| Box::new(self.outcome_back(*outcome)));
        failure
    }

    fn report_back(&self, report: &mut Report) {
        let back = |xyz_mm: &mut [f64; 3]| *xyz_mm = (DVec3::from(*xyz_mm) + self.offset).to_array();
        if let Some(flattening) = &mut report.flattening {
            flattening.overlap_places.iter_mut().flat_map(|o| &mut o.sides).for_each(|side| back(&mut side.xyz_mm));
        }
        if let Some(distortion) = &mut report.distortion {
            distortion.hot_spots.iter_mut().for_each(|spot| back(&mut spot.at.xyz_mm));
            self.measures_back(&mut distortion.part);
            if let Some(base) = &mut distortion.base {
                self.measures_back(base);
            }
        }
    }

    fn measures_back(&self, measures: &mut DistortionMeasures) {
        let strain = &mut measures.strain_percent;
        for place in [&mut strain.at_min, &mut strain.at_max] {
            place.xyz_mm = (DVec3::from(place.xyz_mm) + self.offset).to_array();
        }
    }

    fn place_back(&self, place: &mut Place) {
        if let Some(xyz) = &mut place.xyz_mm {
            *xyz = (DVec3::from(*xyz) + self.offset).to_array();
        }
    }

    fn trimming_back(&self, error: &mut TrimmingError) {
        if let Some(place) = error.place_mut() {
            self.place_back(place);
        }
    }

    fn flattening_back(&self, error: &mut FlatteningError) {
        match error {
            FlatteningError::Flipped { place, .. }
            | FlatteningError::Piece { place, .. }
            | FlatteningError::PinsNotMet { place, .. }
            | FlatteningError::PinOffSurface { place, .. }
            | FlatteningError::PinsContradict { place, .. } => self.place_back(place),
            FlatteningError::NoSeed { furthest, .. }
            | FlatteningError::BudgetSpent { furthest, .. }
            | FlatteningError::NonePredicted { furthest, .. } => self.flattening_back(furthest),
            _ => {}
        }
    }
}
