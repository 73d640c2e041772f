//! Triangulates polygons with holes: a plane sweep, then flips to the constrained Delaunay triangulation.
//!
//! The thesis clips ears and names the cost, O(n^3), as the scheme's weakness (3.5). Here a sweep of O(n log n) does it
//! ([`sweep`]), and flips ([`flips`]) then drive small angles out. A region is given by *directed edges* with the region
//! to their left, in any order: several polygons, holes, islands in holes and polygons that touch themselves in a vertex
//! are all the same to it. No triangle has area zero, whatever points are collinear.

mod flips;
mod sweep;

use glam::DVec2;

use sweep::Trouble;
pub(super) use sweep::orientation;

/// Marks a half-edge on the boundary.
const NONE: u32 = u32::MAX;

/// Triangulates regions one after the other, and keeps its memory between them.
#[derive(Debug, Default)]
pub(super) struct PolygonTriangulator {
    sweep: sweep::Sweep,
    turned: Vec<DVec2>,
    stack: Vec<u32>,
}

impl PolygonTriangulator {
    /// Triangulates the region to the left of `edges`, which are pairs of indices of `points`.
    ///
    /// Points at the same place count as one, the first of them. `aspect` is how many times longer a step along u is in
    /// space than the same step along v: angles are judged in the domain stretched by it (use a power of two, so that
    /// stretching is exact). The triangles are anticlockwise by exact predicates.
    ///
    /// # Errors
    /// [`Trouble`] at the first point where the edges do not bound a region: they cross, overlap or are not closed.
    pub(super) fn triangulate(
        &mut self,
        points: &[DVec2],
        edges: &[[u32; 2]],
        aspect: f64,
    ) -> Result<&[[u32; 3]], Trouble> {
        // The sweep's triangles are rungs across its direction. Sweeping along the region's longer side leaves few flips;
        // along the shorter one an ellipse of n points needs O(n^2). A quarter turn is exact.
        let low = points.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        if (high.x - low.x) * aspect > high.y - low.y {
            self.turned.clear();
            self.turned.extend(points.iter().map(|p| p.perp()));
            self.sweep.run(&self.turned, edges)?;
        } else {
            self.sweep.run(points, edges)?;
        }
        let (triangles, twins) = self.sweep.mesh_mut();
        flips::make_delaunay(points, aspect, triangles, twins, &mut self.stack);
        Ok(self.sweep.mesh_mut().0)
    }
}

#[cfg(test)]
mod tests;
