//! The polygonised trimmed domain: loops as polylines, oriented by their nesting.

use glam::DVec2;

use super::nesting::{Containment, locate, signed_area};
use crate::engine::nurbs::Domain;

/// Where a point of a boundary loop comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Index of the curve in its loop (as sent).
    pub curve: u32,
    /// Parameter on that curve.
    pub t: f64,
}

/// One closed polyline of the region's boundary. The first point is not repeated at the end.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundaryLoop {
    /// Points in the domain; anticlockwise at even depth (the region lies to the left), clockwise at odd depth.
    pub points: Vec<DVec2>,
    /// Where each point comes from. Empty for the natural boundary of an untrimmed surface.
    pub sources: Vec<CurvePoint>,
    /// True where a point is a corner: the end of a curve at which the tangent turns, or a vertex of a polyline.
    pub corners: Vec<bool>,
    /// Index of the loop in the file; `None` for the natural boundary.
    pub source_loop: Option<usize>,
    /// How many other loops contain this one: even = outer boundary of a part, odd = hole.
    pub depth: u32,
    /// Index in [`TrimRegion::loops`] of the smallest loop that contains this one.
    pub parent: Option<usize>,
}

/// The trimmed domain: what lies to the left of all loops.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrimRegion {
    /// The loops, in the order of the file.
    pub loops: Vec<BoundaryLoop>,
    /// True when the surface has no trimming loops: the single loop is the border of the domain.
    pub natural: bool,
}

impl BoundaryLoop {
    /// Area that the loop encloses, in units of the domain; positive when it is anticlockwise.
    #[must_use]
    pub fn signed_area(&self) -> f64 {
        signed_area(self.points.iter().copied())
    }

    /// Its segments, the closing one last.
    pub fn segments(&self) -> impl Iterator<Item = [DVec2; 2]> + '_ {
        let next = self.points.iter().skip(1).chain(self.points.first());
        self.points.iter().zip(next).map(|(&a, &b)| [a, b])
    }
}

impl TrimRegion {
    /// The whole of a domain.
    #[must_use]
    pub fn whole(Domain { u, v }: Domain) -> Self {
        let points = [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])].map(DVec2::from).to_vec();
        let corners = vec![true; points.len()];
        let border = BoundaryLoop { points, sources: Vec::new(), corners, source_loop: None, depth: 0, parent: None };
        Self { loops: vec![border], natural: true }
    }

    /// Where a point of the domain lies, by the parity of crossings of a ray; exact. `O(points)`.
    #[must_use]
    pub fn contains(&self, uv: DVec2) -> Containment {
        locate(uv, self.loops.iter().flat_map(BoundaryLoop::segments))
    }

    /// Area of the region in units of the domain: holes count negative.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.loops.iter().map(BoundaryLoop::signed_area).sum()
    }
}
