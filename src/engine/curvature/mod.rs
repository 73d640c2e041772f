//! Gaussian curvature of a triangle mesh at its interior vertices, by three estimates, 1/mm^2.
//!
//! All divide the angle deficit `2 pi - sum of angles` by an area that is the vertex's own:
//! - a third of its triangles' area (thesis 5.5);
//! - the same times `6 / valency` (thesis 5.6, 5.7), so that valencies 4 and 8 of a grid get the area that 6 gets;
//! - the mixed Voronoi area (Meyer, Desbrun, Schröder, Barr 2003), which adds up to the mesh's area exactly.
//!
//! Limits: a vertex at a border has none, nor one whose triangles have no area. Where several closed fans of
//! triangles meet in one vertex (a mesh that was sent may have that) their angles are added, which says nothing of either.

pub mod developability;
mod report;

use std::f64::consts::TAU;

use glam::DVec3;

use crate::engine::mesh::{Mesh, Topology};

pub use report::{CurvatureReport, DifferenceReport, EstimateReport};

/// Sums over the triangles round a vertex.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ring {
    /// Sum of the angles at the vertex.
    pub angle: f64,
    /// Sum of the triangles' areas, mm^2.
    pub area: f64,
    /// The vertex's share of them by Voronoi regions, mm^2.
    pub mixed_area: f64,
    /// How many triangles there are: at an interior vertex its valency.
    pub triangles: u32,
}

impl Ring {
    /// Adds the triangle with corner `p` at the vertex and `q`, `r` opposite.
    pub fn add(&mut self, [p, q, r]: [DVec3; 3]) {
        let (to_q, to_r, side) = (q - p, r - p, r - q);
        let twice = to_q.cross(to_r).length();
        let (at_p, at_q, at_r) = (to_q.dot(to_r), -to_q.dot(side), to_r.dot(side));
        self.angle += twice.atan2(at_p);
        self.area += 0.5 * twice;
        self.mixed_area += if at_p < 0.0 {
            0.25 * twice
        } else if at_q < 0.0 || at_r < 0.0 {
            0.125 * twice
        } else if twice > 0.0 {
            (to_r.length_squared() * at_q + to_q.length_squared() * at_r) / (8.0 * twice)
        } else {
            0.0
        };
        self.triangles += 1;
    }

    /// The angle deficit: the curvature's integral over the vertex's share, exactly so by Gauss and Bonnet.
    #[must_use]
    pub fn deficit(&self) -> f64 {
        TAU - self.angle
    }

    /// Thesis (5.5). Not finite where there is no area.
    #[must_use]
    pub fn barycentric(&self) -> f64 {
        self.deficit() / (self.area / 3.0)
    }

    /// Thesis (5.7). Not finite where there is no area.
    #[must_use]
    pub fn compensated(&self) -> f64 {
        self.deficit() / (6.0 / f64::from(self.triangles) * self.area / 3.0)
    }

    /// By the mixed Voronoi area. Not finite where there is no area.
    #[must_use]
    pub fn voronoi(&self) -> f64 {
        self.deficit() / self.mixed_area
    }
}

/// The ring of each vertex of a mesh; `None` at borders and where there is no area.
#[must_use]
pub fn rings(mesh: &Mesh, topology: &Topology) -> Vec<Option<Ring>> {
    let mut rings = vec![Ring::default(); mesh.positions.len()];
    for &corners in &mesh.triangles {
        let at = corners.map(|k| mesh.positions[k as usize]);
        for e in 0..3 {
            rings[corners[e] as usize].add([at[e], at[(e + 1) % 3], at[(e + 2) % 3]]);
        }
    }
    let mut inner: Vec<bool> = rings.iter().map(|ring| ring.area > 0.0).collect();
    for &halfedge in topology.borders().flatten() {
        inner[topology.origin(halfedge) as usize] = false;
    }
    rings.into_iter().zip(inner).map(|(ring, inner)| inner.then_some(ring)).collect()
}

/// How far estimates are from the surface's own curvature: a row of the thesis's Tables 5.5 and 5.6.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Differences {
    /// Vertices that were compared.
    pub vertices: u64,
    /// Sum of absolute differences, 1/mm^2.
    pub sum: f64,
    /// Least absolute difference, 1/mm^2; 0 where nothing was compared.
    pub least: f64,
    /// Greatest absolute difference, 1/mm^2.
    pub greatest: f64,
}

impl Differences {
    /// Of pairs of an estimate and the surface's own curvature, in their order; pairs that are not finite do not count.
    #[must_use]
    pub fn of(pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let differences = pairs.map(|(estimate, own)| (estimate - own).abs()).filter(|d| d.is_finite());
        differences.fold(Self::default(), |so_far, d| Self {
            vertices: so_far.vertices + 1,
            sum: so_far.sum + d,
            least: if so_far.vertices == 0 { d } else { so_far.least.min(d) },
            greatest: so_far.greatest.max(d),
        })
    }

    /// The average per vertex; 0 where there is none.
    #[must_use]
    pub fn mean(&self) -> f64 {
        if self.vertices == 0 { 0.0 } else { self.sum / self.vertices as f64 }
    }
}

#[cfg(test)]
mod tests;
