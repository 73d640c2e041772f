//! What can be wrong with trimming loops, and what a person should be told though it is not wrong.

use crate::engine::error::{Located, Place, Remedy};

/// Why loops do not bound a region. All faults of a surface are reported at once.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrimmingError {
    /// A curve ends too far from where the next one starts.
    #[error(
        "trimming loop {loop_index}: curve {curve} ends {gap_mm:.6} mm from the start of the next curve (tolerance {tolerance_mm:.6} mm)"
    )]
    Gap {
        /// The loop.
        loop_index: usize,
        /// The curve after which the gap is.
        curve: usize,
        /// Its size in space, millimetres.
        gap_mm: f64,
        /// The largest gap that would have been closed.
        tolerance_mm: f64,
        /// Where it is.
        place: Box<Place>,
    },
    /// A curve leaves the surface's domain.
    #[error("trimming loop {loop_index}: curve {curve} leaves the surface's domain")]
    OutsideDomain {
        /// The loop.
        loop_index: usize,
        /// The curve.
        curve: usize,
        /// Where it is.
        place: Box<Place>,
    },
    /// A loop crosses itself.
    #[error("trimming loop {loop_index} crosses itself")]
    SelfIntersection {
        /// The loop.
        loop_index: usize,
        /// Where it is.
        place: Box<Place>,
    },
    /// Two loops cross.
    #[error("trimming loops {loop_index} and {other} cross")]
    LoopsIntersect {
        /// One loop.
        loop_index: usize,
        /// The other.
        other: usize,
        /// Where it is.
        place: Box<Place>,
    },
    /// A loop encloses no area.
    #[error("trimming loop {loop_index} encloses no area")]
    Empty {
        /// The loop.
        loop_index: usize,
        /// Where it is.
        place: Box<Place>,
    },
    /// Two loops are the same.
    #[error("trimming loops {loop_index} and {other} are the same")]
    Twins {
        /// One loop.
        loop_index: usize,
        /// The other.
        other: usize,
        /// A point of it.
        place: Box<Place>,
    },
    /// The loops are larger than can be worked on.
    #[error("the trimming loops are too intricate: more than {limit} {what}")]
    TooIntricate {
        /// What there is too much of.
        what: &'static str,
        /// How many are allowed.
        limit: usize,
    },
}

impl TrimmingError {
    /// The place, for a caller that worked on a moved copy of the surface.
    pub(in crate::engine) fn place_mut(&mut self) -> Option<&mut Place> {
        match self {
            Self::Gap { place, .. }
            | Self::OutsideDomain { place, .. }
            | Self::SelfIntersection { place, .. }
            | Self::LoopsIntersect { place, .. }
            | Self::Empty { place, .. }
            | Self::Twins { place, .. } => Some(place),
            Self::TooIntricate { .. } => None,
        }
    }
}

/// Something that was mended or looks odd.
#[derive(Debug, Clone, PartialEq)]
pub struct TrimWarning {
    /// Stable code in kebab case, such as `gap-closed`.
    pub code: &'static str,
    /// What, in words.
    pub detail: String,
    /// Where.
    pub place: Place,
}

impl Located for TrimmingError {
    fn code(&self) -> &'static str {
        match self {
            Self::Gap { .. } => "loop-gap",
            Self::OutsideDomain { .. } => "loop-outside-domain",
            Self::SelfIntersection { .. } => "loop-self-intersection",
            Self::LoopsIntersect { .. } => "loops-intersect",
            Self::Empty { .. } => "loop-empty",
            Self::Twins { .. } => "loops-identical",
            Self::TooIntricate { .. } => "loops-too-intricate",
        }
    }

    fn place(&self) -> Place {
        match self {
            Self::Gap { place, .. }
            | Self::OutsideDomain { place, .. }
            | Self::SelfIntersection { place, .. }
            | Self::LoopsIntersect { place, .. }
            | Self::Empty { place, .. }
            | Self::Twins { place, .. } => (**place).clone(),
            Self::TooIntricate { .. } => Place::default(),
        }
    }

    fn remedies(&self) -> Vec<Remedy> {
        let say = match self {
            Self::Gap { .. } => "Extend or trim the two curves so that they meet, or put a curve between them.",
            Self::OutsideDomain { .. } => {
                "Trim the curve at the border of the surface's domain, or extend the surface."
            }
            Self::SelfIntersection { .. } => {
                "Trim the curves of the loop at the place given, or split it into two loops."
            }
            Self::LoopsIntersect { .. } => "Move the loops apart, or join them into one outline.",
            Self::Empty { .. } => "Remove the loop, or close it around an area.",
            Self::Twins { .. } => "Remove one of the two loops.",
            Self::TooIntricate { .. } => "Send the part in pieces, or with simpler trimming curves.",
        };
        vec![Remedy::say(say)]
    }
}
