//! Errors of a piece, told in the numbers of the whole mesh.

use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::{MeshFault, Piece};

/// Why a piece is left out, without its number.
pub(super) fn reason(error: &FlatteningError) -> String {
    match error {
        FlatteningError::Piece { fault, .. } => fault.to_string(),
        other => other.to_string(),
    }
}

/// The fault of a piece in the numbers of the whole mesh, with its place.
pub(super) fn piece_fault(fault: MeshFault, piece: &Piece, number: usize, pieces: usize) -> FlatteningError {
    let mut place = fault.place_in(&piece.mesh);
    let fault = fault.in_whole(piece);
    place.triangle = fault.triangle();
    FlatteningError::Piece { piece: number as u32, pieces: pieces as u32, fault, place: Box::new(place) }
}

/// The seed that got furthest when none succeeds.
pub(super) fn furthest(error: &FlatteningError) -> u32 {
    match error {
        FlatteningError::Flipped { seed, .. } => *seed,
        FlatteningError::NoSeed { furthest: error, .. }
        | FlatteningError::BudgetSpent { furthest: error, .. }
        | FlatteningError::NonePredicted { furthest: error, .. } => furthest(error),
        _ => 0,
    }
}

/// An error of a piece with the triangles of the whole mesh.
pub(super) fn whole_mesh(error: FlatteningError, piece: &Piece) -> FlatteningError {
    let of_whole = |t: u32| piece.triangle_of.get(t as usize).copied().unwrap_or(t);
    match error {
        FlatteningError::Flipped { triangle, level, seed, flattened, total, mut place } => {
            place.triangle = place.triangle.map(of_whole);
            FlatteningError::Flipped {
                triangle: of_whole(triangle),
                level,
                seed: of_whole(seed),
                flattened,
                total,
                place,
            }
        }
        FlatteningError::CirclesMiss { triangle, level, seed, flattened, total, mut place } => {
            place.triangle = place.triangle.map(of_whole);
            FlatteningError::CirclesMiss {
                triangle: of_whole(triangle),
                level,
                seed: of_whole(seed),
                flattened,
                total,
                place,
            }
        }
        FlatteningError::FlippedAtRest { triangle, flips, seed, total, mut place } => {
            place.triangle = place.triangle.map(of_whole);
            FlatteningError::FlippedAtRest { triangle: of_whole(triangle), flips, seed: of_whole(seed), total, place }
        }
        FlatteningError::NoSeed { tried, furthest } => {
            FlatteningError::NoSeed { tried, furthest: Box::new(whole_mesh(*furthest, piece)) }
        }
        FlatteningError::BudgetSpent { tried, seeds, furthest } => {
            FlatteningError::BudgetSpent { tried, seeds, furthest: Box::new(whole_mesh(*furthest, piece)) }
        }
        FlatteningError::NonePredicted { tried, seeds, furthest } => {
            FlatteningError::NonePredicted { tried, seeds, furthest: Box::new(whole_mesh(*furthest, piece)) }
        }
        other => other,
    }
}
