//! Which patches of the domain a trimmed part touches: needs elsewhere place no lines.
//!
//! Every segment of the region's loops marks the patches that its bounding box meets within each strip of u; what lies
//! inside is found by the parity of crossings along the middle of each strip of v. A patch is covered when either says
//! so, so that no patch which holds a piece of the part is left out.

use super::axis::Axis;
use crate::engine::trimming::TrimRegion;

/// What a patch has of the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Cover {
    /// It holds a piece of the part.
    pub inside: bool,
    /// A border that is a line of constant v runs through it.
    pub border_u: bool,
    /// A border that is a line of constant u runs through it.
    pub border_v: bool,
}

/// For patch (i, j) at `i * v.len() + j`: what the region has of it. Without a region the domain's border is the part's.
pub(super) fn covered(u: &Axis, v: &Axis, region: Option<&TrimRegion>) -> Vec<Cover> {
    let (columns, rows) = (u.len(), v.len());
    let Some(region) = region.filter(|r| !r.natural && !r.loops.is_empty()) else {
        let mut marks = vec![Cover { inside: true, ..Cover::default() }; columns * rows];
        for i in 0..columns {
            marks[i * rows].border_u = true;
            marks[i * rows + rows - 1].border_u = true;
        }
        for j in 0..rows {
            marks[j].border_v = true;
            marks[(columns - 1) * rows + j].border_v = true;
        }
        return marks;
    };
    let mut marks = vec![Cover::default(); columns * rows];
    let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); rows];
    for boundary in &region.loops {
        let points = &boundary.points;
        for (index, a) in points.iter().enumerate() {
            let b = points[(index + 1) % points.len()];
            let (left, right) = if a.x <= b.x { (*a, b) } else { (b, *a) };
            let slope = if right.x > left.x { (right.y - left.y) / (right.x - left.x) } else { 0.0 };
            let last = u.strip_of(right.x);
            for i in u.strip_of(left.x)..=last {
                let (from, to) = (left.x.max(u.edges[i]), right.x.min(u.edges[i + 1]));
                let (y0, y1) = if from < to && right.x > left.x {
                    (left.y + slope * (from - left.x), left.y + slope * (to - left.x))
                } else {
                    (left.y, right.y)
                };
                for mark in &mut marks[i * rows + v.strip_of(y0.min(y1))..=i * rows + v.strip_of(y0.max(y1))] {
                    mark.inside = true;
                    mark.border_u |= a.y == b.y;
                    mark.border_v |= a.x == b.x;
                }
            }
            let (low, high) = if a.y <= b.y { (*a, b) } else { (b, *a) };
            if low.y < high.y {
                let first = v.strip_of(low.y);
                for (offset, row) in crossings[first..=v.strip_of(high.y)].iter_mut().enumerate() {
                    let y = v.middle(first + offset);
                    if low.y <= y && y < high.y {
                        row.push(low.x + (high.x - low.x) * (y - low.y) / (high.y - low.y));
                    }
                }
            }
        }
    }
    for (j, row) in crossings.iter_mut().enumerate() {
        row.sort_unstable_by(f64::total_cmp);
        for run in row.chunks_exact(2) {
            for i in u.strip_of(run[0])..=u.strip_of(run[1]) {
                marks[i * rows + j].inside = true;
            }
        }
    }
    marks
}

/// The rectangle that holds the region, as `[u, v]` ranges; `None` when there is no region or it has no extent.
pub(super) fn extents(region: &TrimRegion) -> Option<[[f64; 2]; 2]> {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for point in region.loops.iter().flat_map(|l| &l.points) {
        for (r, x) in range.iter_mut().zip([point.x, point.y]) {
            *r = [r[0].min(x), r[1].max(x)];
        }
    }
    range.iter().all(|r| r[0] < r[1]).then_some(range)
}

/// Area of the region in the domain: outer loops less holes.
pub(super) fn domain_area(region: &TrimRegion) -> f64 {
    let mut sum = 0.0;
    for boundary in &region.loops {
        let points = &boundary.points;
        let Some(origin) = points.first() else { continue };
        for w in points.windows(2) {
            sum += (w[0] - *origin).perp_dot(w[1] - *origin);
        }
    }
    0.5 * sum
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::engine::nurbs::KnotVector;
    use crate::engine::trimming::BoundaryLoop;

    fn region(points: Vec<DVec2>) -> TrimRegion {
        let corners = vec![true; points.len()];
        let boundary =
            BoundaryLoop { points, sources: Vec::new(), corners, source_loop: Some(0), depth: 0, parent: None };
        TrimRegion { loops: vec![boundary], natural: false }
    }

    #[test]
    fn a_triangle_covers_the_patches_on_its_side_of_the_diagonal() {
        let knots = KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], "u").unwrap();
        let axis = Axis::new(&knots, [0.0, 1.0], false);
        let part = region(vec![DVec2::ZERO, DVec2::X, DVec2::Y]);
        let marks = covered(&axis, &axis, Some(&part));
        let n = axis.len();
        assert!(marks[0].inside && marks[n - 1].inside && marks[(n - 1) * n].inside);
        assert!(marks[0].border_u && marks[0].border_v && !marks[n + 1].border_u);
        assert!(!marks[n * n - 1].inside);
        for i in 0..n {
            for j in 0..n {
                assert_eq!(marks[i * n + j].inside, i + j <= n, "{i} {j}");
            }
        }
        assert_eq!(extents(&part), Some([[0.0, 1.0], [0.0, 1.0]]));
        assert!((domain_area(&part) - 0.5).abs() < 1e-15);
    }
}
