//! A mesh's triangles as the energies see them: shape at rest, weight, and the matrix of a map of each.
//!
//! Lengths are divided by a power of two near the square root of the mesh's area, so that nothing depends on the unit and
//! nothing is lost in going back. Places are numbered in the order of the factorisation.

use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

use super::energy::{Energy, Jet};
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::{Mesh, MeshFault, Topology, measures};

/// Height over longest edge below which a triangle counts as this much higher. Its shape is then a little wrong, which
/// weighs nothing (so does its area), while true slivers would make the Hessian's entries differ beyond what numbers of
/// sixteen digits can hold.
const SLIVER: f64 = 1e-7;

/// Where the determinant is more than this part of the squared size of the map, rounding cannot have its sign wrong.
const SURE: f64 = 1e-12;

/// A triangle at rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    /// Corners in the factorisation's numbering.
    pub(super) corners: [u32; 3],
    /// Gradients of the second and the third corner's hat function in the triangle's plane; the first's is minus their sum.
    pub(super) gradients: [[f64; 2]; 2],
    /// Share of the mesh's area.
    pub(super) weight: f64,
}

/// All triangles.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub(super) cells: Vec<Cell>,
    /// Lengths of the mesh over lengths here: a power of two.
    pub(super) unit: f64,
    /// For each place its share of the area.
    pub(super) masses: Vec<f64>,
}

impl Shape {
    /// The triangles of a mesh whose vertices are numbered anew by `rank`.
    ///
    /// # Errors
    /// [`MeshFault::NotFinite`] and [`MeshFault::ZeroArea`]: the mesh has no area, or a triangle is a point.
    pub(super) fn new(mesh: &Mesh, rank: &[u32]) -> Result<Self, FlatteningError> {
        if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
            return Err(MeshFault::NotFinite { vertex: vertex as u32 }.into());
        }
        let area = measures::total_area(mesh);
        if !(area.is_finite() && area > f64::MIN_POSITIVE) {
            return Err(MeshFault::ZeroArea { triangle: 0 }.into());
        }
        let unit = area.sqrt().log2().round().exp2();
        let total = area / (unit * unit);
        let mut masses = vec![0.0; rank.len()];
        let mut cells = Vec::with_capacity(mesh.triangles.len());
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let places = measures::corners(mesh, t as u32).map(|p| p / unit);
            let Some(cell) = cell(places, corners.map(|v| rank[v as usize]), total) else {
                return Err(MeshFault::ZeroArea { triangle: t as u32 }.into());
            };
            for corner in cell.corners {
                masses[corner as usize] += cell.weight / 3.0;
            }
            cells.push(cell);
        }
        // Neighbours in the factorisation's numbering are neighbours in memory.
        cells.sort_by_key(|cell| cell.corners.iter().copied().min());
        Ok(Self { cells, unit, masses })
    }

    /// Area-weighted mean energy of a map; infinite as soon as one triangle turns over or collapses.
    pub(super) fn energy(&self, energy: Energy, flat: &[[f64; 2]]) -> f64 {
        let mut sum = 0.0;
        for cell in &self.cells {
            let jet = cell.jet(flat);
            let value = energy.value(&jet);
            if !value.is_finite() || !cell.is_upright(&jet, flat) {
                return f64::INFINITY;
            }
            sum += cell.weight * value;
        }
        sum
    }

    /// A map in lengths and in the numbering of the mesh; vertices of no triangle are nowhere.
    pub(super) fn enlarged(&self, flat: &[[f64; 2]], rank: &[u32], topology: &Topology) -> Vec<DVec2> {
        let mut places = vec![DVec2::NAN; rank.len()];
        for &v in topology.triangles().as_flattened() {
            places[v as usize] = DVec2::from_array(flat[rank[v as usize] as usize]) * self.unit;
        }
        places
    }
}

/// The triangle laid flat over its longest edge; `None` when it is a point.
pub(super) fn cell(places: [DVec3; 3], corners: [u32; 3], total: f64) -> Option<Cell> {
    // Over its longest edge the height is best known. The turn keeps the corners' sense.
    let squared = [0, 1, 2].map(|k| places[(k + 1) % 3].distance_squared(places[k]));
    let first = (0..3).fold(0, |best, k| if squared[k] > squared[best] { k } else { best });
    let [a, b, c] = [0, 1, 2].map(|k| places[(first + k) % 3]);
    let base = squared[first].sqrt();
    let double = (b - a).cross(c - a).length();
    let height = (double / base).max(SLIVER * base);
    let along = (c - a).dot(b - a) / base;
    if !(base > 0.0 && height > 0.0) {
        return None;
    }
    let turned = [0, 1, 2].map(|k| corners[(first + k) % 3]);
    Some(Cell {
        corners: turned,
        gradients: [[1.0 / base, -along / (base * height)], [0.0, 1.0 / height]],
        weight: 0.5 * double / total,
    })
}

impl Cell {
    /// The matrix of the map of this triangle.
    #[inline]
    pub(super) fn jet(&self, flat: &[[f64; 2]]) -> Jet {
        let [a, b, c] = self.corners.map(|v| flat[v as usize]);
        let edges = [[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]];
        self.jet_of(edges)
    }

    /// The same for the two edges at the first corner.
    #[inline]
    pub(super) fn jet_of(&self, edges: [[f64; 2]; 2]) -> Jet {
        let mut jet = Jet::default();
        for (e, g) in edges.iter().zip(&self.gradients) {
            jet.turn[0] += 0.5 * (e[0] * g[0] + e[1] * g[1]);
            jet.turn[1] += 0.5 * (e[1] * g[0] - e[0] * g[1]);
            jet.shear[0] += 0.5 * (e[0] * g[0] - e[1] * g[1]);
            jet.shear[1] += 0.5 * (e[0] * g[1] + e[1] * g[0]);
        }
        jet
    }

    /// Which corner a place is.
    #[inline]
    pub(super) fn corner(&self, place: u32) -> usize {
        if self.corners[0] == place { 0 } else { 1 + usize::from(self.corners[2] == place) }
    }

    /// The gradient of a corner's hat function.
    #[inline]
    pub(super) fn hat(&self, corner: usize) -> [f64; 2] {
        let [b, c] = self.gradients;
        [[-b[0] - c[0], -b[1] - c[1]], b, c][corner]
    }

    /// Whether the triangle lies the right way up: by its map where that is sure, else by the exact predicate.
    #[inline]
    pub(super) fn is_upright(&self, jet: &Jet, flat: &[[f64; 2]]) -> bool {
        let (det, size) = (jet.determinant(), jet.norm_squared());
        if det > SURE * size && size < 1.0 / SURE && size > SURE {
            return true;
        }
        let [a, b, c] = self.corners.map(|v| flat[v as usize]).map(|[x, y]| Coord { x, y });
        orient2d(a, b, c) > 0.0
    }
}
