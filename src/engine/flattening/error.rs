//! Why a mesh could not be flattened.

use crate::engine::error::{Located, Place, Remedy, SetValue};
use crate::engine::mesh::MeshFault;

/// Why there is no flattening.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FlatteningError {
    /// A triangle turned over (thesis 4.4.1, 4.4.2).
    #[error(
        "triangle {triangle} flipped at level {level} after {flattened} of {total} triangles were flattened from seed {seed}"
    )]
    Flipped {
        /// The triangle that turned over.
        triangle: u32,
        /// The level that was being processed.
        level: u32,
        /// The seed.
        seed: u32,
        /// Triangles flattened before.
        flattened: u32,
        /// All triangles.
        total: u32,
        /// Where it is.
        place: Box<Place>,
    },
    /// Two circles whose intersection a triangle needs do not meet (thesis 4.1.1).
    #[error(
        "the circles of triangle {triangle} do not meet at level {level}, after {flattened} of {total} triangles were \
         flattened from seed {seed}"
    )]
    CirclesMiss {
        /// The triangle that cannot be laid.
        triangle: u32,
        /// The level that was being processed.
        level: u32,
        /// The seed.
        seed: u32,
        /// Triangles flattened before.
        flattened: u32,
        /// All triangles.
        total: u32,
        /// Where it is.
        place: Box<Place>,
    },
    /// Triangles lie turned over when no more energy is released.
    #[error(
        "{flips} of {total} triangles, the first of them {triangle}, lie turned over when the energy has been released \
         from seed {seed}"
    )]
    FlippedAtRest {
        /// The first of them.
        triangle: u32,
        /// How many there are.
        flips: u32,
        /// The seed.
        seed: u32,
        /// All triangles.
        total: u32,
        /// Where the first is.
        place: Box<Place>,
    },
    /// No seed succeeds: the surface is not "almost developable" (thesis 4.4.2).
    #[error("none of the {tried} seed triangles flattens this mesh without a flip")]
    NoSeed {
        /// How many were tried.
        tried: u32,
        /// The failure of the seed that got furthest.
        furthest: Box<FlatteningError>,
    },
    /// No seed has succeeded in the time that the search was given.
    #[error(
        "none of the {tried} seed triangles (of {seeds}) that were tried in the time given flattens this mesh without a flip"
    )]
    BudgetSpent {
        /// How many were tried.
        tried: u32,
        /// How many there are.
        seeds: u32,
        /// The failure of the seed that got furthest.
        furthest: Box<FlatteningError>,
    },
    /// None of the seeds that the shape points to succeeds.
    #[error(
        "none of the {tried} seed triangles (of {seeds}) that the shape points to flattens this mesh without a flip"
    )]
    NonePredicted {
        /// How many were tried.
        tried: u32,
        /// How many there are.
        seeds: u32,
        /// The failure of the seed that got furthest.
        furthest: Box<FlatteningError>,
    },
    /// The seed does not exist.
    #[error("seed triangle {seed} does not exist: the mesh has {triangles} triangles")]
    SeedOutOfRange {
        /// The seed.
        seed: u32,
        /// How many triangles there are.
        triangles: u32,
    },
    /// The seed is given by a place that lies in no triangle, or by three vertices that are not the corners of one.
    #[error("the seed names no triangle of the mesh: its place lies outside, or no triangle has these corners")]
    SeedNotFound,
    /// Some triangles cannot be reached from the seed over shared edges.
    #[error("{unreached} of {total} triangles cannot be reached from the seed: the mesh has several pieces")]
    SeveralPieces {
        /// How many are left.
        unreached: u32,
        /// All triangles.
        total: u32,
    },
    /// The mesh is no disc: closed, with a handle, or with parts that only touch.
    #[error(
        "the mesh is no disc, with holes or without: it has {borders} borders and the Euler characteristic {characteristic}"
    )]
    NotADisc {
        /// How many borders it has.
        borders: u32,
        /// Vertices - edges + triangles.
        characteristic: i64,
    },
    /// Every start collapses within the precision of numbers.
    #[error("the mesh is curved so strongly that no map without a flip can be held in numbers of sixteen digits")]
    TooCurved,
    /// Pinned points cannot all come to lie at their targets.
    #[error(
        "no map without a flip was found that brings pin {pin} to where it is to lie: {residual_mm:.3e} mm are left, more than \
         for any other pin"
    )]
    PinsNotMet {
        /// The pin that lacks most.
        pin: u32,
        /// What it lacks, mm.
        residual_mm: f64,
        /// Where it is.
        place: Box<Place>,
    },
    /// A pin's place is not on the part.
    #[error("pin {pin} is not on the part{}", away_mm.map_or_else(String::new, |away| format!(": {away:.6} mm away from it")))]
    PinOffSurface {
        /// The pin.
        pin: u32,
        /// How far the part is, where that can be told, mm.
        away_mm: Option<f64>,
        /// Where it is.
        place: Box<Place>,
    },
    /// Two pins contradict each other.
    #[error("pins {} and {} are at one place and are to lie at two", pins[0], pins[1])]
    PinsContradict {
        /// The pins.
        pins: [u32; 2],
        /// Where they are.
        place: Box<Place>,
    },
    /// The mesh itself is at fault.
    #[error(transparent)]
    Mesh(#[from] MeshFault),
    /// A piece of the mesh is at fault.
    #[error("{}{fault}", if *pieces > 1 { format!("piece {} of {pieces}: ", piece + 1) } else { String::new() })]
    Piece {
        /// Which, counted from 0.
        piece: u32,
        /// How many pieces there are.
        pieces: u32,
        /// What is wrong with it, in the numbers of the whole mesh.
        fault: MeshFault,
        /// Where.
        place: Box<Place>,
    },
}

/// What helps where pins are close together.
const FINER: &str = "Take a finer mesh: many pins on few triangles hold these fast.";

/// What helps most flattenings that fail.
const COARSER: &str = "Flatten a coarser mesh: sequential flattening fails on dense ones.";

/// The method that never fails for a flip, without the settings that belong to the other.
fn least_distortion() -> Remedy {
    Remedy::say("Take the method that turns no triangle over, whatever the curvature.")
        .with("flattening.method", SetValue::Text("isometric".into()))
        .with("flattening.seed", SetValue::Nothing)
        .with("flattening.readings", SetValue::Nothing)
        .with("flattening.release", SetValue::Nothing)
}

/// The free map tells where points lie of themselves.
fn without_pins() -> Remedy {
    Remedy::say("Flatten without pins: the free pattern shows where the points lie of themselves.")
        .with("flattening.pins", SetValue::Nothing)
}

impl Located for FlatteningError {
    fn code(&self) -> &'static str {
        match self {
            Self::Flipped { .. } | Self::FlippedAtRest { .. } => "triangle-flipped",
            Self::CirclesMiss { .. } => "circles-miss",
            Self::NoSeed { .. } => "no-seed-succeeds",
            Self::BudgetSpent { .. } => "budget-spent",
            Self::NonePredicted { .. } => "no-predicted-seed-succeeds",
            Self::SeedOutOfRange { .. } => "seed-out-of-range",
            Self::SeedNotFound => "seed-not-found",
            Self::SeveralPieces { .. } => "several-pieces",
            Self::NotADisc { .. } => "not-a-disc",
            Self::TooCurved => "too-curved",
            Self::PinsNotMet { .. } => "pins-not-met",
            Self::PinOffSurface { .. } => "pin-off-surface",
            Self::PinsContradict { .. } => "pins-contradict",
            Self::Mesh(fault) | Self::Piece { fault, .. } => fault.code(),
        }
    }

    fn place(&self) -> Place {
        match self {
            Self::Flipped { place, .. }
            | Self::CirclesMiss { place, .. }
            | Self::FlippedAtRest { place, .. }
            | Self::Piece { place, .. }
            | Self::PinsNotMet { place, .. }
            | Self::PinOffSurface { place, .. }
            | Self::PinsContradict { place, .. } => (**place).clone(),
            Self::NoSeed { furthest, .. }
            | Self::BudgetSpent { furthest, .. }
            | Self::NonePredicted { furthest, .. } => furthest.place(),
            Self::Mesh(fault) => fault.place(),
            _ => Place::default(),
        }
    }

    fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::Flipped { .. } => vec![
                least_distortion(),
                Remedy::say("Let every seed be tried.").with("flattening.seed", SetValue::Text("optimum".into())),
                Remedy::on_grid(COARSER, [30, 30]),
            ],
            Self::CirclesMiss { .. } => vec![
                least_distortion(),
                Remedy::say("Take the method that lays triangles without circles and releases energy as it goes.")
                    .with("flattening.method", SetValue::Text("wang".into()))
                    .with("flattening.release", SetValue::Nothing),
                Remedy::on_grid(COARSER, [30, 30]),
            ],
            Self::FlippedAtRest { .. } => vec![
                least_distortion(),
                Remedy::on_grid(COARSER, [30, 30]),
                Remedy::say("Divide the part: this much curvature cannot lie flat without great distortion."),
            ],
            Self::NoSeed { .. } => vec![
                least_distortion(),
                Remedy::on_grid(COARSER, [20, 20]),
                Remedy::say("Divide the part: this much curvature cannot lie flat without great distortion."),
            ],
            Self::NonePredicted { .. } => vec![
                least_distortion(),
                Remedy::say("Let every seed be tried.")
                    .with("flattening.seed", SetValue::Text("optimum".into()))
                    .with("search.strategy", SetValue::Nothing),
                Remedy::on_grid(COARSER, [30, 30]),
            ],
            Self::BudgetSpent { .. } => vec![
                least_distortion(),
                Remedy::say("Let the search take the time it needs.").with("search.budget_s", SetValue::Nothing),
                Remedy::on_grid(COARSER, [20, 20]),
            ],
            Self::SeedOutOfRange { .. } | Self::SeedNotFound => vec![
                Remedy::say("Take the triangle at the centre.")
                    .with("flattening.seed", SetValue::Text("centre".into())),
            ],
            Self::SeveralPieces { .. } => Vec::new(),
            Self::NotADisc { borders: 0, .. } => {
                vec![Remedy::say("Cut the closed surface open, so that it has a border.")]
            }
            Self::NotADisc { .. } => {
                vec![Remedy::say("Cut handles open, and divide the mesh where parts of it touch at a vertex only.")]
            }
            Self::TooCurved => vec![Remedy::say("Divide the part, or cut darts into it.")],
            Self::PinsNotMet { .. } => vec![
                Remedy::say(
                    "Move the targets nearer to how the points lie without pins, or take the pin out: pins that are to lie \
                     in another order than on the part turn it over.",
                ),
                without_pins(),
                Remedy::on_grid(FINER, [120, 120]),
            ],
            Self::PinOffSurface { .. } => {
                vec![Remedy::say("Move the pin onto the part, inside its trimming loops."), without_pins()]
            }
            Self::PinsContradict { .. } => vec![Remedy::say("Take one of the two out."), without_pins()],
            Self::Mesh(fault) => fault.remedies(),
            Self::Piece { fault, pieces, .. } => {
                let mut remedies = fault.remedies();
                if *pieces > 1 {
                    let skip = Remedy::say("Leave out the pieces that cannot be flattened.");
                    remedies.push(skip.with("skip_bad_pieces", SetValue::Flag(true)));
                }
                remedies
            }
        }
    }
}
