//! Areas of polygons, points in polygons, and which loop lies in which.
//!
//! Loops that do not cross are nested as their points are: loop `a` lies in loop `b` when one point of `a` that is not on
//! `b` does. Depth is the number of loops around; even is an outer boundary, odd a hole (thesis 3.1 needs no more).

use glam::DVec2;

use super::crossing::orient;

/// Rings that differ by no more than this part of their size are the same.
const TWIN_TOLERANCE: f64 = 1e-9;

/// Where a point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Containment {
    /// Inside.
    Inside,
    /// Outside.
    Outside,
    /// Exactly on the boundary.
    Boundary,
}

/// Signed area of a closed polygon, positive when it is anticlockwise. Taken about its first point, so that a small
/// polygon far from the origin keeps its digits.
pub(super) fn signed_area(points: impl Iterator<Item = DVec2>) -> f64 {
    let mut points = points;
    let Some(origin) = points.next() else { return 0.0 };
    let (mut twice, mut last) = (0.0, DVec2::ZERO);
    for p in points {
        let d = p - origin;
        twice += last.perp_dot(d);
        last = d;
    }
    0.5 * twice
}

/// Crossings of the ray from `p` towards +u with the segment from `a` to `b`: `None` when `p` lies on the segment, else
/// whether it is crossed. Half open, so a ray through a vertex counts once; the side is found by an exact predicate.
pub(super) fn crosses_ray(p: DVec2, a: DVec2, b: DVec2) -> Option<bool> {
    if (a.y > p.y) == (b.y > p.y) {
        // Level segments can still hold the point.
        let on = a.y == p.y && b.y == p.y && a.x.min(b.x) <= p.x && p.x <= a.x.max(b.x);
        let touches = p == a || p == b;
        return (!on && !touches).then_some(false);
    }
    if a.x < p.x && b.x < p.x {
        return Some(false);
    }
    let side = orient(a, b, p);
    if side == 0.0 { None } else { Some((side > 0.0) == (b.y > a.y)) }
}

/// Where a point lies with respect to a closed polygon.
pub(super) fn locate(p: DVec2, polygon: impl Iterator<Item = [DVec2; 2]>) -> Containment {
    let mut inside = false;
    for [a, b] in polygon {
        match crosses_ray(p, a, b) {
            None => return Containment::Boundary,
            Some(crossed) => inside ^= crossed,
        }
    }
    if inside { Containment::Inside } else { Containment::Outside }
}

/// A closed polygon with what nesting asks for.
pub(super) struct Ring {
    pub(super) points: Vec<DVec2>,
    /// Signed.
    pub(super) area: f64,
    low: DVec2,
    high: DVec2,
}

impl Ring {
    /// The ring through the given points.
    pub(super) fn new(points: Vec<DVec2>) -> Self {
        let area = signed_area(points.iter().copied());
        let low = points.iter().fold(DVec2::INFINITY, |m, &p| m.min(p));
        let high = points.iter().fold(DVec2::NEG_INFINITY, |m, &p| m.max(p));
        Self { points, area, low, high }
    }

    /// Width and height of its box.
    pub(super) fn extent(&self) -> DVec2 {
        self.high - self.low
    }

    /// Its segments.
    pub(super) fn segments(&self) -> impl Iterator<Item = [DVec2; 2]> + '_ {
        let count = self.points.len();
        (0..count).map(move |i| [self.points[i], self.points[if i + 1 == count { 0 } else { i + 1 }]])
    }

    /// Whether this ring lies in `other`, which it does not cross and is not the same as.
    fn lies_in(&self, other: &Self) -> bool {
        if !(self.low.cmpge(other.low).all() && self.high.cmple(other.high).all()) {
            return false;
        }
        let middles = self.segments().map(|[a, b]| (a + b) * 0.5);
        for p in self.points.iter().copied().chain(middles) {
            match locate(p, other.segments()) {
                Containment::Inside => return true,
                Containment::Outside => return false,
                Containment::Boundary => {}
            }
        }
        true
    }

    /// Whether the two rings, which do not cross, are the same up to rounding: same box, area and centroid.
    fn is_twin(&self, other: &Self) -> bool {
        let size = self.extent() * TWIN_TOLERANCE;
        let close = |a: DVec2, b: DVec2| (a - b).abs().cmple(size).all();
        (self.area.abs() - other.area.abs()).abs() <= TWIN_TOLERANCE * self.area.abs()
            && close(self.low, other.low)
            && close(self.high, other.high)
            && close(self.centroid(), other.centroid())
    }

    /// Centre of the area.
    fn centroid(&self) -> DVec2 {
        let origin = self.points[0];
        let sum = self.segments().fold(DVec2::ZERO, |sum, [a, b]| {
            let (a, b) = (a - origin, b - origin);
            sum + (a + b) * a.perp_dot(b)
        });
        origin + sum / (6.0 * self.area)
    }
}

/// Depth and parent of each ring.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Nesting {
    /// Depth and parent of each ring.
    pub(super) rings: Vec<(u32, Option<usize>)>,
    /// Pairs of rings that are the same.
    pub(super) twins: Vec<(usize, usize)>,
}

/// Nests rings that do not cross.
pub(super) fn nest(rings: &[Ring]) -> Nesting {
    let mut nesting = Nesting::default();
    for (i, ring) in rings.iter().enumerate() {
        let mut depth = 0;
        let mut parent: Option<usize> = None;
        for (j, other) in rings.iter().enumerate() {
            if i == j || ring.area.abs() > other.area.abs() * (1.0 + TWIN_TOLERANCE) {
                continue;
            }
            if ring.is_twin(other) {
                if i < j {
                    nesting.twins.push((i, j));
                }
            } else if ring.lies_in(other) {
                depth += 1;
                if parent.is_none_or(|p| rings[p].area.abs() > other.area.abs()) {
                    parent = Some(j);
                }
            }
        }
        nesting.rings.push((depth, parent));
    }
    nesting
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(points: &[[f64; 2]]) -> Ring {
        Ring::new(points.iter().map(|&p| DVec2::from_array(p)).collect())
    }

    #[test]
    fn a_point_is_located_exactly_against_slanted_and_level_edges() {
        let star = ring(&[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 1.0], [0.0, 3.0]]);
        let at = |x: f64, y: f64| locate(DVec2::new(x, y), star.segments());
        assert_eq!(at(2.0, 0.5), Containment::Inside);
        // On the level of the inner corner, on both of its sides, and of the two upper ones.
        assert_eq!(at(1.0, 1.0), Containment::Inside);
        assert_eq!(at(2.0, 1.5), Containment::Outside);
        assert_eq!(at(-1.0, 0.0), Containment::Outside);
        assert_eq!(at(5.0, 3.0), Containment::Outside);
        for (x, y) in [(0.0, 0.0), (2.0, 0.0), (4.0, 1.0), (3.0, 2.0), (2.0, 1.0), (0.0, 3.0), (1.5, 1.5)] {
            assert_eq!(at(x, y), Containment::Boundary, "{x} {y}");
        }
        assert_eq!(at(3.0, 2.0 - 1e-15), Containment::Inside);
        assert_eq!(at(3.0, 2.0 + 1e-15), Containment::Outside);
    }

    #[test]
    fn a_small_polygon_far_from_the_origin_keeps_its_area() {
        let far = ring(&[[1e6, 1e6], [1e6 + 0.5, 1e6], [1e6 + 0.5, 1e6 + 0.5], [1e6, 1e6 + 0.5]]);
        assert_eq!(far.area, 0.25);
    }

    #[test]
    fn halves_of_a_square_are_not_the_same_and_not_in_each_other() {
        let halves = [
            ring(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]),
            ring(&[[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
            ring(&[[1.0, 1.0], [0.0, 0.0], [1.0, 0.0]]),
        ];
        let nesting = nest(&halves);
        assert_eq!(nesting.twins, [(0, 2)]);
        assert_eq!(nesting.rings, [(0, None), (0, None), (0, None)]);
    }
}
