//! Laying triangles one after the other by the intersection of circles (thesis 4.1.1), in mapping order.
//!
//! The third vertex of a triangle lies where two circles about the ends of the shared edge meet whose radii are the
//! triangle's lengths in space. While the ends are as far apart as in space that is the cosine rule; where an edge joins
//! vertices that other triangles have laid it is not, and circles may miss each other.

use glam::DVec2;

use crate::engine::flattening::mapping_order::MappingOrder;
use crate::engine::flattening::{Order, Parent};
use crate::engine::mesh::topology::{NONE, prev};
use crate::engine::mesh::{Mesh, Topology};

/// An edge in the plane whose length is that in space but for this share of it has it but for rounding. Then the apex stands
/// where the triangle in space says: circles about the ends of a needle's edge may miss each other by rounding alone.
const SAME_LENGTH: f64 = 1e-12;

/// A mesh that is being laid.
pub(super) struct Laying<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    order: MappingOrder,
    /// Where the next level begins in the order.
    from: usize,
}

/// A triangle of the mapping order as it comes to be laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Unfolding {
    pub(super) triangle: u32,
    /// Vertices: the ends of the edge that it is unfolded over, then the one opposite.
    pub(super) corners: [u32; 3],
}

impl<'a> Laying<'a> {
    /// Begins with a seed, which must exist: its first corner comes to lie at the origin, its second on +x.
    pub(super) fn begin(mesh: &'a Mesh, topology: &'a Topology, seed: u32, flat: &mut [DVec2]) -> Self {
        let mut order = MappingOrder::default();
        order.begin(topology.triangle_count(), seed);
        let mut laying = Self { mesh, topology, order, from: 1 };
        let [a, b, c] = topology.triangles()[seed as usize];
        flat[a as usize] = DVec2::ZERO;
        flat[b as usize] = DVec2::new(laying.length(a, b), 0.0);
        // A triangle in space always closes; one of no area is refused before.
        let apex = intersection(DVec2::ZERO, flat[b as usize], [laying.length(a, c), laying.length(b, c)]);
        flat[c as usize] = apex.unwrap_or(DVec2::ZERO);
        let ahead = [0, 1, 2].map(|e| laying.tag_beyond(3 * seed + e));
        let beyond = laying.beyond();
        let mut walk = laying.order.walk();
        walk.touch([ahead[0], ahead[1]], Parent::First);
        walk.touch([ahead[2], beyond], Parent::First);
        let queued = walk.len();
        laying.order.end(queued);
        laying
    }

    /// The triangles of the next level in their order, none after the last.
    pub(super) fn next_level(&mut self, order: Order) -> Vec<Unfolding> {
        let (from, to) = (self.from, self.order.len());
        self.order.arrange(from, order);
        let mut level = Vec::with_capacity(to - from);
        for at in from..to {
            let tag = self.order.walk().tag(at, Parent::First);
            let h = 3 * (tag >> 2) + (tag & 3);
            let first = h - h % 3;
            let others = [0, 1, 2].map(|e| first + e).into_iter().filter(|&other| other != h);
            let mut tags = [self.beyond(); 2];
            for (tag, other) in tags.iter_mut().zip(others) {
                *tag = self.tag_beyond(other);
            }
            let mut walk = self.order.walk();
            walk.touch(tags, Parent::First);
            let queued = walk.len();
            self.order.end(queued);
            let corners = [self.topology.origin(h), self.topology.target(h), self.topology.origin(prev(h))];
            level.push(Unfolding { triangle: tag >> 2, corners });
        }
        self.from = to;
        level
    }

    /// How many triangles have been given out, the seed included.
    pub(super) const fn given(&self) -> usize {
        self.from
    }

    /// Where the apex of a triangle comes to lie over its edge; `None` where the circles miss each other.
    pub(super) fn apex(&self, corners: [u32; 3], flat: &[DVec2]) -> Option<DVec2> {
        let [a, b, c] = corners;
        let length = self.length(a, b);
        if (flat[a as usize].distance(flat[b as usize]) - length).abs() <= SAME_LENGTH * length {
            return Some(self.over_edge(corners, flat));
        }
        intersection(flat[a as usize], flat[b as usize], [self.length(a, c), self.length(b, c)])
    }

    /// Where the apex comes to lie by the angle that the triangle has in space, however long the edge is now: half-way
    /// between what its two ends say. There always is such a place while the edge has a length.
    pub(super) fn over_edge(&self, corners: [u32; 3], flat: &[DVec2]) -> DVec2 {
        let [a, b, c] = corners.map(|v| self.mesh.positions[v as usize]);
        let edge = b - a;
        let length = edge.length();
        let (foot, height) = ((c - a).dot(edge) / length - 0.5 * length, edge.cross(c - a).length() / length);
        let [p, q] = [corners[0], corners[1]].map(|v| flat[v as usize]);
        let along = (q - p).normalize_or(DVec2::X);
        0.5 * (p + q) + along * foot + along.perp() * height
    }

    fn length(&self, a: u32, b: u32) -> f64 {
        self.mesh.positions[a as usize].distance(self.mesh.positions[b as usize])
    }

    fn tag_beyond(&self, halfedge: u32) -> u32 {
        match self.topology.twin(halfedge) {
            NONE => self.beyond(),
            twin => 4 * (twin / 3) + twin % 3,
        }
    }

    fn beyond(&self) -> u32 {
        4 * self.topology.triangle_count() as u32
    }
}

/// The point to the left of the way from `a` to `b` that has these distances from the two.
fn intersection(a: DVec2, b: DVec2, [from_a, from_b]: [f64; 2]) -> Option<DVec2> {
    let d = b - a;
    let squared = d.length_squared();
    let foot = 0.5 * (squared + (from_a - from_b) * (from_a + from_b)) / squared;
    let height = from_a * from_a / squared - foot * foot;
    // False for NaN as well: an edge without length has no circles to meet.
    (height >= 0.0).then(|| a + d * foot + d.perp() * height.sqrt())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    #[test]
    fn needles_of_a_plane_are_laid() {
        // Rows that are a billionth of their cells' width high.
        let height = |v: f64| v * v * 1e-9;
        let mesh = grid(9, 9, Diagonal::Diamond, |u, v| DVec3::new(8.0 * u + 0.3 * v, height(8.0 * v), 0.0));
        let topology = Topology::new(&mesh).unwrap();
        let (laid, error) = crate::engine::flattening::energy_release::mccartney::lay(&mesh, &topology, 60);
        assert_eq!(error, None);
        for &[a, b, c] in &mesh.triangles {
            let [p, q, r] = [a, b, c].map(|v| laid.flat[v as usize]);
            assert!((p.distance(q) - mesh.positions[a as usize].distance(mesh.positions[b as usize])).abs() < 1e-11);
            assert!((p.distance(r) - mesh.positions[a as usize].distance(mesh.positions[c as usize])).abs() < 1e-11);
        }
    }

    #[test]
    fn circles_meet_at_both_distances_on_the_left_or_not_at_all() {
        let (a, b) = (DVec2::new(1.0, 2.0), DVec2::new(4.0, 3.5));
        let p = intersection(a, b, [2.0, 2.5]).unwrap();
        assert!((p.distance(a) - 2.0).abs() < 1e-14 && (p.distance(b) - 2.5).abs() < 1e-14);
        assert!((b - a).perp_dot(p - a) > 0.0);
        assert_eq!(intersection(a, b, [1.0, 1.0]), None, "too short");
        assert_eq!(intersection(a, b, [9.0, 1.0]), None, "one inside of the other");
        assert_eq!(intersection(a, a, [1.0, 1.0]), None);
    }
}
