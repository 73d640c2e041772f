//! The map from a surface's domain to its flattening: piecewise quadratic over the triangles of the domain mesh.
//!
//! A point of the domain is found in its triangle; its barycentric coordinates there give its place on the mesh and, with
//! the bends of the triangle's edges ([`super::bend`]), in the plane. The domain mesh covers the domain whole, so this works across poles too: triangles that vanish in space map
//! to the line between the pole and the vertex opposite.
//!
//! The mesh of a trimmed domain is bounded by chords, and the exact curve may lie outside by up to their height. There the
//! nearest triangle's map is continued, as far as lengths in the plane agree with those on the surface (in a
//! sliver they may not); else the nearest point stands.
//!
//! Of a surface that was unrolled exactly the place in the plane comes from that map, and from the triangle only the place
//! on the mesh.

use std::cell::RefCell;

use glam::{DVec2, DVec3};

use super::bend::{Laid, bend, bent, bent_along};
use super::locator::{Located, Locator};
use crate::engine::flattening::developable::Unrolled;
use crate::engine::mesh::Topology;
use crate::engine::nurbs::Surface;
use crate::engine::triangulation::Lifted;

/// A continued step in the plane may differ from the step on the surface by this factor either way. Smaller: honest
/// continuation is refused where the material is strained; larger: slivers throw points about.
const CONTINUED: f64 = 2.0;

/// A point outside of the mesh by less than this part of a triangle counts as on its border: rounding.
const HAIR: f64 = 1e-9;

/// Triangles whose bends are remembered at a time: more than curves cross on meshes that are drawn in a moment.
const REMEMBERED: usize = 4096;

/// A flattened mesh as a map of its domain.
#[derive(Debug)]
pub(super) struct FlatMap<'a> {
    surface: &'a Surface,
    lifted: &'a Lifted,
    flat: &'a [DVec2],
    locator: &'a Locator<'a>,
    topology: &'a Topology,
    exact: Option<&'a Unrolled>,
    /// Bends of triangles of the domain that were asked for, each at its number modulo [`REMEMBERED`]: curves are walked
    /// along several times, and stay in one triangle for a while.
    bends: RefCell<Vec<(u32, [DVec2; 3])>>,
}

/// A point of the domain on the mesh and in the plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mapped {
    /// In the plane; NaN where the mesh is not flattened.
    pub(super) flat: DVec2,
    /// On the mesh.
    pub(super) mesh: DVec3,
}

impl<'a> FlatMap<'a> {
    /// The map of a mesh whose vertex `k` lies at `flat[k]`; with the mesh's topology, the domain mesh's locator, and the
    /// map that the vertices were placed by when they were unrolled.
    pub(super) fn new(
        surface: &'a Surface,
        lifted: &'a Lifted,
        topology: &'a Topology,
        locator: &'a Locator<'a>,
        flat: &'a [DVec2],
        exact: Option<&'a Unrolled>,
    ) -> Self {
        Self { surface, lifted, flat, locator, topology, exact, bends: RefCell::default() }
    }

    /// How many pieces the mesh has.
    pub(super) const fn piece_count(&self) -> usize {
        self.topology.piece_count()
    }

    /// The piece that a triangle of the domain belongs to; `None` where it vanished in space.
    fn piece_of(&self, domain_triangle: u32) -> Option<u32> {
        self.topology.piece_of().get(self.mesh_triangle(domain_triangle) as usize).copied()
    }

    /// For each vertex of the mesh its piece.
    pub(super) fn pieces_of_vertices(&self) -> Vec<u32> {
        let mut of_vertex = vec![0; self.flat.len()];
        for (corners, &piece) in self.lifted.mesh.triangles.iter().zip(self.topology.piece_of()) {
            for &k in corners {
                of_vertex[k as usize] = piece;
            }
        }
        of_vertex
    }

    /// The piece that a point of the domain lies in or nearest to.
    pub(super) fn piece_at(&self, uv: DVec2) -> u32 {
        self.locator.locate(uv).and_then(|l| self.piece_of(l.triangle)).unwrap_or(0)
    }

    /// Where a point of a piece comes to lie. `None` only for a mesh without triangles or a point that is not finite.
    ///
    /// Where pieces touch in a vertex, a point there lies in both: so the piece is named.
    pub(super) fn at(&self, uv: DVec2, piece: u32) -> Option<Mapped> {
        let located = if self.piece_count() <= 1 {
            self.locator.locate(uv)?
        } else {
            self.locator.locate_among(uv, |t| self.piece_of(t).is_none_or(|p| p == piece))?
        };
        let mut mapped = self.mapped(located.triangle, located.weights);
        if !located.inside {
            mapped = self.continued(uv, &located, mapped).unwrap_or(mapped);
        }
        if let Some(exact) = self.exact {
            mapped.flat = exact.map(uv);
        }
        Some(mapped)
    }

    /// Continues the triangle's map beyond its border, where that is sound.
    fn continued(&self, uv: DVec2, located: &Located, on: Mapped) -> Option<Mapped> {
        let [a, b, c] = self.locator.corners(located.triangle);
        let (ab, ac, ap) = (b - a, c - a, uv - a);
        let area = ab.perp_dot(ac);
        let (x, y) = (ap.perp_dot(ac) / area, ab.perp_dot(ap) / area);
        let weights = [1.0 - x - y, x, y];
        if !(x.is_finite() && y.is_finite()) || weights.iter().all(|&w| w > -HAIR) {
            return None;
        }
        let beyond = self.mapped(located.triangle, weights);
        let near = a * located.weights[0] + b * located.weights[1] + c * located.weights[2];
        let step = self.surface.point(uv.x, uv.y).distance(self.surface.point(near.x, near.y));
        let (flat, mesh) = (on.flat.distance(beyond.flat), on.mesh.distance(beyond.mesh));
        let agrees = |length: f64| length <= CONTINUED * step && step <= CONTINUED * length;
        (agrees(flat) && agrees(mesh)).then_some(beyond)
    }

    /// The map's derivative at a point: where the unit steps along u and v go in the plane. `None` where the triangle there
    /// is not flattened.
    pub(super) fn jacobian(&self, uv: DVec2, piece: u32) -> Option<[DVec2; 2]> {
        if let Some(exact) = self.exact {
            return Some(exact.jacobian(uv));
        }
        // A triangle that vanished in space has no derivative.
        let Located { triangle, weights, .. } = self.locator.locate_among(uv, |t| self.piece_of(t) == Some(piece))?;
        let bends = self.bends(triangle);
        let [a, b, c] = self.locator.corners(triangle);
        let [fa, fb, fc] = self.mesh_corners(triangle).map(|k| self.flat[k]);
        let (ab, ac) = (b - a, c - a);
        let area = ab.perp_dot(ac);
        // Weights of the second and third corner change by these along u and v.
        let du = [ac.y / area, -ab.y / area];
        let dv = [-ac.x / area, ab.x / area];
        let along =
            |d: [f64; 2]| (fb - fa) * d[0] + (fc - fa) * d[1] + bent_along(weights, [-d[0] - d[1], d[0], d[1]], &bends);
        let result = [along(du), along(dv)];
        result.iter().all(|d| d.is_finite()).then_some(result)
    }

    /// The triangle of the mesh (not of the domain) that a triangle of the domain became; `u32::MAX` where it vanished.
    fn mesh_triangle(&self, domain_triangle: u32) -> u32 {
        self.lifted.triangle_of.get(domain_triangle as usize).copied().unwrap_or(u32::MAX)
    }

    /// The mesh vertices at the corners of a triangle of the domain. By way of the triangle, since a vertex at which two
    /// pieces touch may be two in the mesh.
    fn mesh_corners(&self, triangle: u32) -> [usize; 3] {
        let own = self.mesh_triangle(triangle) as usize;
        match self.lifted.mesh.triangles.get(own) {
            Some(corners) => corners.map(|k| k as usize),
            None => self.lifted.domain.triangles[triangle as usize].map(|k| self.lifted.vertex_of[k as usize] as usize),
        }
    }

    /// A triangle of the mesh, on the mesh and in the plane.
    fn laid(&self, corners: [usize; 3]) -> Laid {
        Laid { mesh: corners.map(|k| self.lifted.mesh.positions[k]), flat: corners.map(|k| self.flat[k]) }
    }

    /// The bends of the edges (0, 1), (1, 2), (2, 0) of a triangle of the domain.
    fn bends(&self, triangle: u32) -> [DVec2; 3] {
        let slot = triangle as usize % REMEMBERED.min(self.lifted.domain.triangles.len());
        let mut remembered = self.bends.borrow_mut();
        if remembered.is_empty() {
            remembered.resize(REMEMBERED.min(self.lifted.domain.triangles.len()), (u32::MAX, [DVec2::ZERO; 3]));
        }
        if remembered[slot].0 == triangle {
            return remembered[slot].1;
        }
        let own = self.mesh_triangle(triangle);
        // A triangle that vanished in space has no plane, and an exact map needs no bends.
        let bends = if self.exact.is_some() || own == u32::MAX {
            [DVec2::ZERO; 3]
        } else {
            let (corners, uv) = (self.mesh_corners(triangle), self.locator.corners(triangle));
            let here = self.laid(corners);
            std::array::from_fn(|e| {
                let (a, b) = (e, (e + 1) % 3);
                let middle = 0.5 * (uv[a] + uv[b]);
                let off = self.surface.point(middle.x, middle.y) - 0.5 * (here.mesh[a] + here.mesh[b]);
                let twin = self.topology.twins().get(3 * own as usize + e).copied().unwrap_or(u32::MAX);
                let beyond = self.lifted.mesh.triangles.get(twin as usize / 3);
                bend(off, [Some(here), beyond.map(|t| self.laid(t.map(|k| k as usize)))], CONTINUED)
            })
        };
        remembered[slot] = (triangle, bends);
        bends
    }

    fn mapped(&self, triangle: u32, weights: [f64; 3]) -> Mapped {
        let ([a, b, c], [wa, wb, wc]) = (self.mesh_corners(triangle), weights);
        let p = &self.lifted.mesh.positions;
        Mapped {
            flat: self.flat[a] * wa + self.flat[b] * wb + self.flat[c] * wc + bent(weights, &self.bends(triangle)),
            mesh: p[a] * wa + p[b] * wb + p[c] * wc,
        }
    }
}
