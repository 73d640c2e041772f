//! The mesh of one face, whose border can be given more vertices.

use glam::{DVec2, DVec3};

use super::cuts::Cloth;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::Topology;
use crate::engine::nurbs::Surface;
use crate::engine::triangulation::Lifted;
use crate::engine::trimming::{Side, TrimmedSurface};

/// "No edge of the border", "no node".
pub(super) const NONE: u32 = u32::MAX;

/// The mesh of a face in space, with its border as curves on its surface.
#[derive(Debug, Clone)]
pub struct Face<'a> {
    surface: &'a Surface,
    /// True when its triangles are anticlockwise seen from behind.
    pub(super) reversed: bool,
    /// Vertices, mm.
    pub(super) positions: Vec<DVec3>,
    /// Corners.
    pub(super) triangles: Vec<[u32; 3]>,
    /// For each vertex what it is joined in, [`NONE`] inside.
    pub(super) node: Vec<u32>,
    /// Where the corners lie in the domain: by corner, since a pole has many places.
    places: Vec<[DVec2; 3]>,
    /// The half-edge of each edge of the border.
    halfedge: Vec<u32>,
    /// For each half-edge its edge of the border, or [`NONE`].
    edge_at: Vec<u32>,
    /// For each edge of the border that of the other side of a cut, or [`NONE`].
    cut_twin: Vec<u32>,
    /// For each edge of the border whether it runs along a cut, not against it.
    along_cut: Vec<bool>,
    /// The edges of each closed border, in the order in which the triangles run along it.
    pub(super) borders: Vec<Vec<u32>>,
}

/// A vertex to be put into an edge of the border.
#[derive(Debug, Clone, Copy)]
pub(super) struct Insertion {
    /// Where along the edge, 0 to 1.
    pub s: f64,
    /// What it is joined in.
    pub node: u32,
}

impl<'a> Face<'a> {
    /// The face of a surface (in its own place) and its mesh, which lies `offset` away from there, cut open along polylines of
    /// its domain.
    ///
    /// # Errors
    /// When the mesh is none: an edge of three triangles, say; [`EngineError::Cancelled`] when the observer asks for it.
    pub fn new(
        part: &'a TrimmedSurface,
        lifted: &Lifted,
        offset: DVec3,
        cuts: &[Vec<DVec2>],
        observer: &dyn Observer,
    ) -> Result<Self, EngineError> {
        let mut cloth = cloth(part, lifted, offset);
        for cut in cuts {
            cloth.lay(cut, observer)?;
        }
        let opened = cloth.open();
        let Cloth { surface, positions, triangles, places, .. } = cloth;
        let topology = Topology::of_triangles(&triangles, positions.len()).map_err(FlatteningError::from)?;
        let mut halfedge = Vec::new();
        let mut edge_at = vec![NONE; 3 * triangles.len()];
        let borders = topology.borders().map(|border| {
            let edges = border.iter().map(|&h| {
                edge_at[h as usize] = halfedge.len() as u32;
                halfedge.push(h);
                edge_at[h as usize]
            });
            edges.collect()
        });
        let borders = borders.collect();
        let mut cut_twin = vec![NONE; halfedge.len()];
        let mut along_cut = vec![false; halfedge.len()];
        for [g, h] in opened {
            let [e, f] = [g, h].map(|h| edge_at[h as usize]);
            if e != NONE && f != NONE {
                cut_twin[e as usize] = f;
                cut_twin[f as usize] = e;
                along_cut[e as usize] = true;
            }
        }
        Ok(Self {
            surface,
            reversed: part.side == Side::Reversed,
            node: vec![NONE; positions.len()],
            positions,
            triangles,
            places,
            halfedge,
            edge_at,
            cut_twin,
            along_cut,
            borders,
        })
    }

    /// The place in a face's domain of the point of its mesh that is nearest to `p`, and the distance.
    #[must_use]
    pub fn nearest(part: &TrimmedSurface, lifted: &Lifted, offset: DVec3, p: DVec3) -> (DVec2, f64) {
        cloth(part, lifted, offset).nearest(p)
    }

    /// Whether an edge is that side of a cut which runs along it.
    pub(super) fn is_along_cut(&self, edge: u32) -> bool {
        self.along_cut.get(edge as usize).copied().unwrap_or(false)
    }

    /// The edge on the other side of a cut.
    pub(super) fn cut_twin(&self, edge: u32) -> Option<u32> {
        self.cut_twin.get(edge as usize).copied().filter(|&twin| twin != NONE)
    }

    /// How many triangles there are.
    #[must_use]
    pub const fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Its area, mm^2.
    pub(super) fn area(&self) -> f64 {
        let double = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| self.positions[v as usize]);
            (b - a).cross(c - a).length()
        };
        0.5 * self.triangles.iter().map(double).sum::<f64>()
    }

    /// The two vertices of an edge of the border.
    pub(super) fn ends(&self, edge: u32) -> [u32; 2] {
        let h = self.halfedge[edge as usize] as usize;
        let corners = self.triangles[h / 3];
        [corners[h % 3], corners[(h % 3 + 1) % 3]]
    }

    /// Where the ends of an edge lie in the domain.
    fn place(&self, edge: u32) -> [DVec2; 2] {
        let h = self.halfedge[edge as usize] as usize;
        let places = &self.places[h / 3];
        [places[h % 3], places[(h % 3 + 1) % 3]]
    }

    /// The point of an edge's curve at `s`, 0 to 1; its ends are the vertices themselves.
    pub(super) fn point(&self, edge: u32, s: f64) -> DVec3 {
        let [a, b] = self.ends(edge);
        if s <= 0.0 {
            return self.positions[a as usize];
        }
        if s >= 1.0 {
            return self.positions[b as usize];
        }
        let [p, q] = self.place(edge);
        let uv = p.lerp(q, s);
        self.surface.point(uv.x, uv.y)
    }

    /// The point of an edge's curve and its derivative by `s`.
    pub(super) fn tangent(&self, edge: u32, s: f64) -> (DVec3, DVec3) {
        let [p, q] = self.place(edge);
        let uv = p.lerp(q, s);
        let (point, u, v) = self.surface.first_derivatives(uv.x, uv.y);
        (point, u * (q.x - p.x) + v * (q.y - p.y))
    }

    /// Puts vertices into edges: `insertions` has for each edge, by its number, those along it in ascending order.
    /// Returns where each came to be, in the same order.
    pub(super) fn insert(&mut self, insertions: &[Vec<Insertion>]) -> Vec<Vec<u32>> {
        let mut vertices: Vec<Vec<u32>> = Vec::with_capacity(insertions.len());
        // The edges that follow each one.
        let mut parts: Vec<Vec<u32>> = Vec::with_capacity(insertions.len());
        for (edge, along) in insertions.iter().enumerate() {
            let edge = edge as u32;
            // All places are of the edge as it is now, so they are found before it is split.
            let points: Vec<DVec3> = along.iter().map(|new| self.point(edge, new.s)).collect();
            let [p, q] = self.place(edge);
            let (mut new_vertices, mut new_edges) = (Vec::new(), Vec::new());
            for (new, &point) in along.iter().zip(&points).rev() {
                let (vertex, part) = self.split(edge, p.lerp(q, new.s), point);
                self.node[vertex as usize] = new.node;
                new_vertices.push(vertex);
                new_edges.push(part);
            }
            new_vertices.reverse();
            new_edges.reverse();
            vertices.push(new_vertices);
            parts.push(new_edges);
        }
        self.pair_parts(&parts);
        for border in &mut self.borders {
            let longer = border.iter().flat_map(|&edge| {
                let parts = parts.get(edge as usize).map_or(&[][..], Vec::as_slice);
                std::iter::once(edge).chain(parts.iter().copied())
            });
            *border = longer.collect();
        }
        vertices
    }

    /// Pairs the parts of edges along cuts, which run in opposite directions; where one side was split otherwise than the other
    /// they are no pair any more.
    fn pair_parts(&mut self, parts: &[Vec<u32>]) {
        for (edge, of_edge) in parts.iter().enumerate() {
            let twin = self.cut_twin[edge];
            let Some(of_twin) = parts.get(twin as usize).filter(|_| (edge as u32) < twin) else { continue };
            let chain =
                |first: u32, rest: &[u32]| -> Vec<u32> { std::iter::once(first).chain(rest.iter().copied()).collect() };
            let (mine, theirs) = (chain(edge as u32, of_edge), chain(twin, of_twin));
            let alike = mine.len() == theirs.len();
            for (&a, &b) in mine.iter().zip(theirs.iter().rev()) {
                self.cut_twin[a as usize] = if alike { b } else { NONE };
                self.cut_twin[b as usize] = if alike { a } else { NONE };
            }
            if !alike {
                mine.iter().chain(&theirs).for_each(|&e| self.cut_twin[e as usize] = NONE);
            }
        }
    }

    /// Splits an edge and its triangle; the edge keeps the first part. Gives the vertex and the edge of the second part.
    fn split(&mut self, edge: u32, uv: DVec2, point: DVec3) -> (u32, u32) {
        let h = self.halfedge[edge as usize] as usize;
        let (t, j, k) = (h / 3, (h % 3 + 1) % 3, (h % 3 + 2) % 3);
        let vertex = self.positions.len() as u32;
        self.positions.push(point);
        self.node.push(NONE);
        let fresh = self.triangles.len();
        self.triangles.push([vertex, self.triangles[t][j], self.triangles[t][k]]);
        self.places.push([uv, self.places[t][j], self.places[t][k]]);
        self.triangles[t][j] = vertex;
        self.places[t][j] = uv;
        // The edge that followed is the new triangle's now.
        let part = self.halfedge.len() as u32;
        let moved = std::mem::replace(&mut self.edge_at[3 * t + j], NONE);
        self.edge_at.extend([part, moved, NONE]);
        self.halfedge.push(3 * fresh as u32);
        self.cut_twin.push(NONE);
        self.along_cut.push(self.along_cut[edge as usize]);
        if moved != NONE {
            self.halfedge[moved as usize] = 3 * fresh as u32 + 1;
        }
        (vertex, part)
    }

    /// How many edges the borders have.
    pub(super) const fn edge_count(&self) -> usize {
        self.halfedge.len()
    }
}

/// The mesh of a face as it can be cut.
fn cloth<'a>(part: &'a TrimmedSurface, lifted: &Lifted, offset: DVec3) -> Cloth<'a> {
    let triangles = lifted.mesh.triangles.clone();
    let mut places = vec![[DVec2::ZERO; 3]; triangles.len()];
    for (corners, &to) in lifted.domain.triangles.iter().zip(&lifted.triangle_of) {
        if let Some(place) = places.get_mut(to as usize) {
            *place = corners.map(|k| lifted.domain.uv[k as usize]);
        }
    }
    Cloth::new(&part.surface, lifted.mesh.positions.iter().map(|&p| p + offset).collect(), triangles, places)
}
