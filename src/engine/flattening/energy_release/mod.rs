//! Flattening by the release of energy: the mesh is laid triangle by triangle, its edges are springs, and vertices move as
//! long as that lowers the springs' energy.
//!
//! [`mccartney`] (thesis 4.1; McCartney, Hinds, Seow 1999) lays all of the mesh by intersecting circles and then moves one
//! vertex after the other by a small step in one of four directions. [`wang`] (Wang, Smith, Yuen 2002, our reading: the
//! paper's equations are not in the thesis) has masses at the vertices and lets the part that lies already come to rest
//! while the mesh is laid. Both have the energy (4.2) and end when no vertex, moved alone, releases more than a threshold.
//!
//! Neither has anything in its energy against a triangle that is turned over, so only the last state is judged: by the
//! exact predicate, and a flattening with a flip is an error. Lengths and energies are millimetres; vertices and triangles
//! are numbered as in the mesh. Only the seed's piece is reached: a mesh of several pieces is an error here.

mod history;
mod laying;
pub mod mccartney;
mod springs;
#[cfg(test)]
mod tests;
pub mod wang;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::{FlatteningError, Order};
use crate::engine::error::Place;
use crate::engine::mesh::{Mesh, MeshFault, Topology};
use history::History;
use laying::Laying;
use springs::Springs;

/// The threshold where none is given, as a share of the mean energy of a vertex, as it is then. What is left above the least
/// energy is in long waves of strain, by which each vertex alone gains little: with this share some tenths of a percent.
/// Less takes longer, in proportion to the waves' length.
pub const DEFAULT_THRESHOLD: f64 = 3e-6;
/// The threshold where none is given is no less than this share of the mean length of an edge, so that rounding is not
/// released: the energy of an edge with a strain of 4e-8.
pub const LEAST_THRESHOLD: f64 = 1e-15;
/// The first step where none is given, as a share of the mean length of the edges at the vertex.
pub const DEFAULT_STEP: f64 = 0.1;
/// Moves of vertices where no bound is given: so many for each vertex.
pub const DEFAULT_MOVES_PER_VERTEX: u64 = 4000;
/// Most moves that may be asked for: some minutes.
pub const MAX_MOVES: u64 = 1_000_000_000;

/// The `flattening.release` object of a job.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReleaseOptions {
    /// `E_t`: what one vertex must release by moving, mm. Absent: [`DEFAULT_THRESHOLD`] of
    /// the energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<f64>,
    /// The first step of `mccartney`, as a share of the mean length of the edges at the vertex. Absent: [`DEFAULT_STEP`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
    /// Most moves of single vertices. Absent: [`DEFAULT_MOVES_PER_VERTEX`] for each vertex.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_moves: Option<u64>,
}

/// How the energy was released.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ReleaseReport {
    /// `E_t` at the end, mm.
    pub threshold_mm: f64,
    /// Energy (4.2) of all edges as they were laid, mm; by `wang` before the last release.
    pub energy_before_mm: f64,
    /// The same at the end.
    pub energy_after_mm: f64,
    /// Vertices that were moved, each time counted.
    pub moves: u64,
    /// Vertices that were looked at, each time counted.
    pub tests: u64,
    /// Moves of all vertices together.
    pub joint_moves: u64,
    /// Whether no vertex releases more than the threshold any more. Else the moves were spent.
    pub settled: bool,
    /// Moves so far and the energy then, mm: from the start to the end, at most [`history::LENGTH`] pairs.
    pub history: Vec<(u64, f64)>,
}

/// A mesh in the plane after its energy was released.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Released {
    /// A place for each vertex, mm; NaN where a partial flattening did not get to.
    pub flat: Vec<DVec2>,
    /// Triangles that lie.
    pub flattened: u64,
    /// Triangles of each level of the mapping order.
    pub levels: Vec<u32>,
    /// How it went.
    pub report: ReleaseReport,
}

/// A flattening together with the reason why it cannot be used, if there is one.
pub type Outcome = (Released, Option<FlatteningError>);

/// What both methods begin with.
struct Start {
    springs: Springs,
    /// `E_t` as it was given, mm.
    threshold: Option<f64>,
    least_threshold: f64,
    most_moves: u64,
}

impl Start {
    /// Looks at the mesh.
    ///
    /// # Errors
    /// [`MeshFault::NotFinite`] and [`MeshFault::ZeroArea`], [`FlatteningError::SeedOutOfRange`].
    fn new(mesh: &Mesh, topology: &Topology, seed: u32, options: ReleaseOptions) -> Result<Self, FlatteningError> {
        if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
            return Err(MeshFault::NotFinite { vertex: vertex as u32 }.into());
        }
        let place = |v: u32| -> DVec3 { mesh.positions[v as usize] };
        let flat = |h: u32| {
            let [a, b, c] = [h, h + 1, h + 2].map(|h| place(topology.origin(h)));
            // Not so for NaN either.
            let has_area = (b - a).cross(c - a).length_squared() > 0.0;
            !has_area
        };
        let triangles = topology.triangle_count() as u32;
        if let Some(triangle) = (0..triangles).find(|t| flat(3 * t)) {
            return Err(MeshFault::ZeroArea { triangle }.into());
        }
        if seed >= triangles {
            return Err(FlatteningError::SeedOutOfRange { seed, triangles });
        }
        let springs = Springs::new(mesh, topology);
        let least_threshold = LEAST_THRESHOLD * springs.mean_length();
        let vertices = mesh.positions.len() as u64;
        let most_moves = options.max_moves.unwrap_or(DEFAULT_MOVES_PER_VERTEX * vertices).min(MAX_MOVES);
        Ok(Self { springs, threshold: options.threshold, least_threshold, most_moves })
    }

    /// `E_t` while so many vertices have this energy.
    fn threshold(&self, energy: f64, vertices: usize) -> f64 {
        let by_default = || (DEFAULT_THRESHOLD * energy / vertices.max(1) as f64).max(self.least_threshold);
        self.threshold.unwrap_or_else(by_default)
    }
}

/// The error of a flattening in which triangles lie turned over; `None` where none does.
fn flipped(mesh: &Mesh, seed: u32, flat: &[DVec2]) -> Option<FlatteningError> {
    let corner = |v: u32| robust::Coord { x: flat[v as usize].x, y: flat[v as usize].y };
    let upright = |t: &[u32; 3]| robust::orient2d(corner(t[0]), corner(t[1]), corner(t[2])) > 0.0;
    let mut all = mesh.triangles.iter().enumerate().filter(|(_, t)| !upright(t)).map(|(t, _)| t as u32);
    let triangle = all.next()?;
    let flips = 1 + all.count() as u32;
    let place = Box::new(place_of(mesh, triangle, flat));
    Some(FlatteningError::FlippedAtRest { triangle, flips, seed, total: mesh.triangles.len() as u32, place })
}

/// The middle of a triangle in all coordinates that there are.
fn place_of(mesh: &Mesh, triangle: u32, flat: &[DVec2]) -> Place {
    let corners = mesh.triangles[triangle as usize].map(|v| v as usize);
    let middle = |p: &[DVec2]| corners.iter().map(|&v| p[v]).sum::<DVec2>() / 3.0;
    let xy = middle(flat);
    Place {
        triangle: Some(triangle),
        uv: mesh.uv.as_deref().map(|uv| middle(uv).to_array()),
        xyz_mm: Some((corners.iter().map(|&v| mesh.positions[v]).sum::<DVec3>() / 3.0).to_array()),
        xy_mm: xy.is_finite().then(|| xy.to_array()),
        ..Place::default()
    }
}
