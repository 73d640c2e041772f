//! Why a domain could not be triangulated as asked.

use super::ampc::Along;
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
    /// Lines of curvature lead out of every strip.
    #[error(
        "no line of curvature runs through the domain along {}: with {strips} strips and with any fewer each of them leaves \
         its strip",
        if *.along == Along::U { "u" } else { "v" }
    )]
    NoPolyline {
        /// Which way they were to run.
        along: Along,
        /// How many strips there were at first.
        strips: u32,
    },
    /// Lines of both families are out of order.
    #[error("the lines of curvature of both families meet out of order, so that they make no grid")]
    LinesTangle {
        /// Where.
        place: Box<Place>,
    },
    /// Thin triangles that were to be left out belong to the part.
    #[error("{count} thin triangles that were to be left out belong to the part")]
    ThinInPart {
        /// How many.
        count: u64,
    },
}

impl Located for TriangulationError {
    fn code(&self) -> &'static str {
        match self {
            Self::TooManyTriangles { .. } => "too-many-triangles",
            Self::Polygon { .. } => "polygon",
            Self::SkewTurnsOver { .. } => "skew-turns-over",
            Self::NoArea => "no-area",
            Self::NoPolyline { .. } => "no-polyline",
            Self::LinesTangle { .. } => "lines-tangle",
            Self::ThinInPart { .. } => "thin-in-part",
        }
    }

    fn place(&self) -> Place {
        match self {
            Self::Polygon { place } | Self::LinesTangle { place } | Self::SkewTurnsOver { place, .. } => {
                (**place).clone()
            }
            _ => Place::default(),
        }
    }

    fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::TooManyTriangles { .. } => vec![Remedy::on_grid("Ask for a coarser mesh.", [60, 60])],
            Self::SkewTurnsOver { .. } => {
                vec![Remedy::say("Sample without skew.").with("triangulation.skew", SetValue::Nothing)]
            }
            Self::NoPolyline { along, .. } => {
                let other = if *along == Along::U { "v" } else { "u" };
                let text = |value: &str| SetValue::Text(value.to_owned());
                vec![
                    Remedy::say(format!("Follow the lines along {other}."))
                        .with("triangulation.ampc.direction", text(other))
                        .with("triangulation.ampc.families", text("one")),
                    Remedy::say("Take a uniform grid.")
                        .with("triangulation.method", text("grid"))
                        .with("triangulation.ampc", SetValue::Nothing),
                ]
            }
            Self::LinesTangle { .. } => vec![
                Remedy::say("Follow the lines of minimum curvature alone.")
                    .with("triangulation.ampc.families", SetValue::Text("one".to_owned())),
            ],
            Self::ThinInPart { .. } => vec![
                Remedy::say("Keep the thin triangles.").with("triangulation.ampc.drop_thin", SetValue::Flag(false)),
            ],
            _ => Vec::new(),
        }
    }
}
