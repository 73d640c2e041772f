//! Placing one triangle against a neighbour (thesis 4.2.1), without angles.
//!
//! The cosine rule and the two rotations of 4.2.1 amount to this: with an edge from `a` to `b` of length `l`, the apex
//! stands over the point at `foot` along the edge at a height `h`. Both are known from the triangle in space before
//! anything is flattened. In the plane the apex is then `p + (foot d + h d') / |d|`, where `d` is the edge as it lies
//! there now, `d'` is `d` turned by +90 degrees, and `p` is the anchor: the edge's start with the foot measured from the
//! start, or its end with the foot measured from the end. Where averaging has changed the edge's length the two differ.

use glam::{DVec2, DVec3};

/// A half-edge with all that is needed to unfold its triangle over it. Tags are those of the mapping order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hinge {
    /// Foot of the apex along the edge, measured from its start and from its end, mm.
    foot: [f64; 2],
    /// Height of the apex over the edge, mm; positive.
    height: f64,
    /// Vertices: start, end, and the one opposite.
    pub(super) start: u32,
    pub(super) end: u32,
    pub(super) apex: u32,
    /// Tags of the neighbours across the two other edges, in the order of the triangle's edges.
    pub(super) neighbours: [u32; 2],
}

impl Hinge {
    /// The hinge of corners `start`, `end`, `apex` at these places. The height is not positive for a flat triangle.
    pub(super) fn new(vertices: [u32; 3], places: [DVec3; 3], neighbours: [u32; 2]) -> Self {
        let [a, b, c] = places;
        let edge = b - a;
        let length = edge.length();
        let foot = [(c - a).dot(edge) / length, (c - b).dot(edge) / length];
        let height = edge.cross(c - a).length() / length;
        Self { foot, height, start: vertices[0], end: vertices[1], apex: vertices[2], neighbours }
    }

    /// Whether the triangle has an area.
    pub(super) const fn is_sound(&self) -> bool {
        self.height > 0.0 && self.height.is_finite() && self.foot[0].is_finite() && self.foot[1].is_finite()
    }

    /// The triangle at the origin with its start there and its end on +x: how a seed lies.
    pub(super) fn at_origin(&self) -> [DVec2; 3] {
        [DVec2::ZERO, DVec2::new(self.foot[0] - self.foot[1], 0.0), DVec2::new(self.foot[0], self.height)]
    }

    /// The arm to where the apex comes to lie when the edge lies from `a` to `b`; its end or its start is the anchor.
    #[inline]
    pub(super) fn unfold<const END: bool>(&self, a: DVec2, b: DVec2) -> Arm {
        let d = b - a;
        let (from, foot) = if END { (b, self.foot[1]) } else { (a, self.foot[0]) };
        let squared = d.length_squared();
        Arm { from, reach: (d * foot + d.perp() * self.height) * (1.0 / squared), length: squared.sqrt() }
    }

    /// The apex when the edge lies from `a` to `b`, measured from the edge's middle: what changed of its length goes to
    /// both sides alike. This is where the triangle has its apex when it is laid as it best fits the two.
    #[inline]
    pub(super) fn unfold_middle(&self, a: DVec2, b: DVec2) -> DVec2 {
        let d = b - a;
        let foot = (self.foot[0] + self.foot[1]) * 0.5;
        (a + b) * 0.5 + (d * foot + d.perp() * self.height) * (1.0 / d.length())
    }
}

/// A position that is being computed: `from + reach * length`.
///
/// Each triangle of a level waits for the apex of the one before, so what costs time is how long one takes and not how
/// much there is to do. The square root takes longest. Hence the reciprocal is taken of the square beside it, instead of
/// of the root after it, and all that an average adds is done meanwhile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arm {
    from: DVec2,
    reach: DVec2,
    length: f64,
}

impl Arm {
    /// The position.
    #[inline]
    pub(super) fn tip(self) -> DVec2 {
        self.from + self.reach * self.length
    }

    /// The middle between the position and another.
    #[inline]
    pub(super) fn midway(self, other: DVec2) -> DVec2 {
        (self.from + other) * 0.5 + (self.reach * 0.5) * self.length
    }
}

/// Twice the signed area of a triangle in the plane (1.29): positive = anticlockwise.
#[inline]
pub(super) fn orientation(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hinge() -> (Hinge, [DVec3; 3]) {
        let places = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 2.5, 1.0), DVec3::new(2.0, 6.0, 4.0)];
        (Hinge::new([0, 1, 2], places, [0, 0]), places)
    }

    #[test]
    fn a_seed_lies_at_the_origin_along_x_with_its_own_edge_lengths() {
        let (hinge, [a, b, c]) = hinge();
        let [p, q, r] = hinge.at_origin();
        assert_eq!((p, q.y), (DVec2::ZERO, 0.0));
        assert!((p.distance(q) - a.distance(b)).abs() < 1e-14);
        assert!((q.distance(r) - b.distance(c)).abs() < 1e-14);
        assert!((r.distance(p) - c.distance(a)).abs() < 1e-14);
        assert!(orientation(p, q, r) > 0.0);
    }

    #[test]
    fn over_an_edge_of_its_own_length_both_anchors_keep_all_lengths() {
        let (hinge, [a, b, c]) = hinge();
        let (p, turn) = (DVec2::new(-3.0, 8.0), DVec2::from_angle(2.3));
        let q = p + turn * a.distance(b);
        for arm in [hinge.unfold::<false>(p, q), hinge.unfold::<true>(p, q)] {
            let r = arm.tip();
            assert!((p.distance(r) - a.distance(c)).abs() < 1e-13);
            assert!((q.distance(r) - b.distance(c)).abs() < 1e-13);
            assert!(orientation(p, q, r) > 0.0);
            let middle = arm.midway(DVec2::new(2.0, 5.0));
            assert!(middle.distance((r + DVec2::new(2.0, 5.0)) * 0.5) < 1e-14);
        }
    }

    #[test]
    fn over_a_longer_edge_the_anchor_keeps_its_own_length_and_the_other_does_not() {
        let (hinge, [a, b, c]) = hinge();
        let q = DVec2::new(a.distance(b) * 1.25, 0.0);
        let from_start = hinge.unfold::<false>(DVec2::ZERO, q).tip();
        let from_end = hinge.unfold::<true>(DVec2::ZERO, q).tip();
        assert!((from_start.length() - a.distance(c)).abs() < 1e-14);
        assert!((from_end.distance(q) - b.distance(c)).abs() < 1e-14);
        assert!((from_end.x - from_start.x - a.distance(b) * 0.25).abs() < 1e-14);
    }

    #[test]
    fn from_the_middle_the_apex_stands_between_what_the_two_anchors_say() {
        let (hinge, [a, b, _]) = hinge();
        let p = DVec2::new(4.0, -1.0);
        for stretch in [1.0, 1.3, 0.8] {
            let q = p + DVec2::from_angle(0.7) * (a.distance(b) * stretch);
            let between = (hinge.unfold::<false>(p, q).tip() + hinge.unfold::<true>(p, q).tip()) * 0.5;
            assert!(hinge.unfold_middle(p, q).distance(between) < 1e-14);
        }
    }
}
