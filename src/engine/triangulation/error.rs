//! Why a domain could not be triangulated as asked.

use crate::engine::error::{Located, Place, Remedy, SetValue};

/// Why there is no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TriangulationError {
    /// The density asks for more triangles than are allowed.
    #[error("this density needs about {estimate} triangles, more than the {limit} that are allowed")]
    TooManyTriangles {
        /// How many, estimated.
        estimate: u64,
        /// How many are allowed.
        limit: u64,
    },
    /// A cell's polygon could not be triangulated (an internal fault: please report it).
    #[error("a polygon of the trimmed domain could not be triangulated")]
    Polygon {
        /// Where.
        place: Box<Place>,
    },
    /// Sampling was skewed so far that triangles of the domain turned over.
    #[error("this skew turns {triangles} triangles of the domain over")]
    SkewTurnsOver {
        /// How many.
        triangles: u64,
        /// The first of them.
        place: Box<Place>,
    },
    /// The surface has no area where it is trimmed.
    #[error("the surface has no area inside its trimming loops")]
    NoArea,
}

impl Located for TriangulationError {
    fn code(&self) -> &'static str {
        match self {
            Self::TooManyTriangles { .. } => "too-many-triangles",
            Self::Polygon { .. } => "polygon",
            Self::SkewTurnsOver { .. } => "skew-turns-over",
            Self::NoArea => "no-area",
        }
    }

    fn place(&self) -> Place {
        match self {
            Self::Polygon { place } | Self::SkewTurnsOver { place, .. } => (**place).clone(),
            _ => Place::default(),
        }
    }

    fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::TooManyTriangles { .. } => vec![Remedy::on_grid("Ask for a coarser mesh.", [60, 60])],
            Self::SkewTurnsOver { .. } => {
                vec![Remedy::say("Sample without skew.").with("triangulation.skew", SetValue::Nothing)]
            }
            _ => Vec::new(),
        }
    }
}
