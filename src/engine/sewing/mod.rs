//! Several trimmed faces sewn to one mesh.
//!
//! Each face is triangulated by itself; here borders that two faces share are found and made to carry the same vertices, so
//! that the meshes can be welded without cracks, or kept apart as seams that are sampled alike.
//!
//! Method: a border edge of a face's mesh stands for a curve on its surface, the image of the segment between its ends in
//! (u, v), and all distances are measured to these curves, not to their chords.
//! 1. Border vertices of two faces that are each other's nearest within the tolerance are one ([`meetings`]).
//! 2. A border vertex of one face that lies on the border of another, away from its vertices, is put into the triangle
//!    there, which is split as a fan. So one long edge meets two short ones, in whole or in part, and no T-junction is left.
//! 3. Edges between the same two vertices are shared if the curves agree between them; all that will be outline is then refined
//!    to the tolerance of the pattern's curves, both sides of a seam alike ([`refine`]).
//! 4. Faces are turned to agree, shared vertices are moved to the middle of what they join, and triangles renumbered
//!    ([`weld`]).
//!
//! Faces may be cut open along polylines before ([`cuts`]); the two sides of a cut stay apart.
//!
//! A face is never sewn to itself: where it closes on itself its seam stays open. Of faces that are the same number for
//! number the first is kept. Lengths are millimetres. The result does not depend on the number of threads.
//!
//! Limits: distances are taken from border vertices and from points between them, not everywhere; an edge at which more
//! than two faces meet is left to the mesh's own checks, which refuse to flatten it.

mod border;
mod cuts;
mod face;
mod meetings;
mod near;
mod options;
mod refine;
mod report;
#[cfg(test)]
mod tests;
mod weld;

pub use cuts::{Cut, CutPoints, MAX_CUT_POINTS, MAX_CUTS, OFF_FACE};
pub use face::Face;
pub use options::{DEFAULT_SEWING_TOLERANCE, GREATEST_SEWING_TOLERANCE, Join, SewingOptions};
pub use report::{JoinedBorder, NearMisses, SeamReport, SewingReport};
pub use weld::{Run, Sewn};

use super::budget::Observer;
use super::error::EngineError;
use super::triangulation::TriangulationError;
use super::triangulation::density::MAX_TRIANGLES;
use super::trimming::TrimmedSurface;

/// A part of several faces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Part {
    /// Its faces, each with its own show side.
    pub faces: Vec<TrimmedSurface>,
}

/// Most faces of a part. Parts that are cut from one sheet have some dozens; a thousand are sewn in seconds.
pub const MAX_FACES: usize = 1000;

/// What sewing is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Borders at most so far apart are shared, mm.
    pub sewing_mm: f64,
    /// Chord tolerance of border edges, mm.
    pub chord_mm: f64,
    /// Diagonal of the part, mm.
    pub diagonal_mm: f64,
    /// Whether shared borders are welded.
    pub join: Join,
}

/// Sews the meshes of faces.
///
/// # Errors
/// [`EngineError::Parameter`] when so many borders lie within the tolerance of each other that it must be too large;
/// [`EngineError::Cancelled`] when the observer asks for it; a fault of the mesh when it is too large to be numbered.
pub fn sew(mut faces: Vec<Face<'_>>, tolerances: Tolerances, observer: &dyn Observer) -> Result<Sewn, EngineError> {
    let mut nodes = meetings::meet(&mut faces, tolerances, observer)?;
    observer.check()?;
    let shared = refine::refine(&mut faces, &mut nodes, tolerances, observer)?;
    let count: u64 = faces.iter().map(|face| face.triangle_count() as u64).sum();
    if count > MAX_TRIANGLES {
        return Err(TriangulationError::TooManyTriangles { estimate: count, limit: MAX_TRIANGLES }.into());
    }
    observer.check()?;
    weld::weld(&faces, &mut nodes, &shared, tolerances, observer)
}
