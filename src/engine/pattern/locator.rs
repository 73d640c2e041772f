//! Which triangle of a domain mesh holds a point, and where in it.
//!
//! Triangles are kept in buckets bounded by lines of constant u and v. The lines are quantiles of the vertices'
//! coordinates, so that a mesh that is dense in one corner fills its buckets evenly, and a triangle enters a row of
//! buckets only as far as it reaches in that row, so that long thin triangles cost their length and not their box.
//! Whether a triangle holds a point is decided exactly (`robust`); of several (an edge, a vertex) the lowest index is
//! taken. A point that no triangle holds goes to the nearest one, distances taken relative to the domain's width.
//!
//! Building takes `O(n log n)`, a point `O(log n)` and the triangles of its bucket.

use glam::DVec2;
use robust::{Coord, orient2d};

use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::triangulation::DomainMesh;

/// Triangles a bucket holds on average. More: points look at more triangles; fewer: more memory and more empty buckets.
const PER_BUCKET: usize = 2;

/// The most lines in one direction: bounds the memory of the buckets.
const MOST_LINES: usize = 2048;

/// Values that are looked at for each line that bounds buckets. More: buckets fill more evenly; fewer: less to sort.
const SAMPLES_PER_LINE: usize = 16;

/// Triangles that are sorted into buckets between two questions whether to go on: some milliseconds of work.
const BETWEEN_CHECKS: usize = 1 << 16;

/// How far, relative to the domain, a triangle's reach in a row of buckets is widened against rounding.
const MARGIN: f64 = 1e-12;

/// Where a point lies in a domain mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// The triangle of the domain mesh.
    pub triangle: u32,
    /// Barycentric coordinates there, at least 0 and with sum 1: those of the point, or of the nearest point.
    pub weights: [f64; 3],
    /// True when a triangle holds the point; false when it is outside of the mesh and was moved to the nearest place.
    pub inside: bool,
}

/// Buckets over a domain mesh.
#[derive(Debug)]
pub struct Locator<'a> {
    mesh: &'a DomainMesh,
    /// Lines of constant u that bound the buckets.
    u: Lines,
    /// Lines of constant v.
    v: Lines,
    /// One over the domain's width in u and v: what distances are measured in.
    scale: DVec2,
    /// Bucket `b` (row by row of v) holds `items[starts[b]..starts[b + 1]]`.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl<'a> Locator<'a> {
    /// Builds the buckets. A mesh without triangles locates nothing.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`] when the observer asks for it.
    pub fn new(mesh: &'a DomainMesh, observer: &dyn Observer) -> Result<Self, EngineError> {
        let count = (mesh.triangles.len() / PER_BUCKET).isqrt().clamp(1, MOST_LINES);
        let u = Lines::quantiles(mesh.uv.iter().map(|p| p.x), count);
        let v = Lines::quantiles(mesh.uv.iter().map(|p| p.y), count);
        let over = |w: f64| if w > 0.0 { 1.0 / w } else { 1.0 };
        let scale = DVec2::new(over(u.width()), over(v.width()));
        let mut locator = Self { mesh, u, v, scale, starts: Vec::new(), items: Vec::new() };
        locator.fill(observer)?;
        Ok(locator)
    }

    /// The mesh that it is built over.
    #[must_use]
    pub const fn mesh(&self) -> &'a DomainMesh {
        self.mesh
    }

    /// The triangle that holds `p`, or else the nearest one. `None` only for a mesh without triangles or a `p` that is
    /// not finite.
    #[must_use]
    pub fn locate(&self, p: DVec2) -> Option<Located> {
        self.locate_among(p, |_| true)
    }

    /// The same among the triangles that `accepts` lets pass; `None` also when it lets none pass.
    #[must_use]
    pub fn locate_among(&self, p: DVec2, accepts: impl Fn(u32) -> bool) -> Option<Located> {
        if self.items.is_empty() || !p.is_finite() {
            return None;
        }
        let (column, row) = (self.u.interval(p.x), self.v.interval(p.y));
        self.bucket(column, row)
            .iter()
            .filter(|&&triangle| accepts(triangle))
            .find_map(|&triangle| {
                let weights = holding(self.corners(triangle), p)?;
                Some(Located { triangle, weights, inside: true })
            })
            .or_else(|| self.nearest(p, column, row, accepts))
    }

    /// The triangles whose bucket the segment may pass through; each may come several times.
    pub(super) fn along(&self, a: DVec2, b: DVec2, mut visit: impl FnMut(u32)) {
        self.buckets_along(&[a, b], |bucket| {
            for &t in &self.items[self.starts[bucket] as usize..self.starts[bucket + 1] as usize] {
                visit(t);
            }
        });
    }

    /// The corners of a triangle.
    pub(super) fn corners(&self, triangle: u32) -> [DVec2; 3] {
        self.mesh.triangles[triangle as usize].map(|k| self.mesh.uv[k as usize])
    }

    fn bucket(&self, column: usize, row: usize) -> &[u32] {
        let b = row * self.u.count() + column;
        &self.items[self.starts[b] as usize..self.starts[b + 1] as usize]
    }

    /// Sorts the triangles into the buckets, each bucket's in ascending order.
    fn fill(&mut self, observer: &dyn Observer) -> Result<(), EngineError> {
        let buckets = self.u.count() * self.v.count();
        let mut starts = vec![0_u32; buckets + 1];
        let mut pairs: Vec<[u32; 2]> = Vec::with_capacity(4 * self.mesh.triangles.len());
        for t in 0..self.mesh.triangles.len() as u32 {
            if (t as usize).is_multiple_of(BETWEEN_CHECKS) {
                observer.check()?;
            }
            self.buckets_along(&self.corners(t), |b| {
                starts[b + 1] += 1;
                pairs.push([b as u32, t]);
            });
        }
        for b in 0..buckets {
            starts[b + 1] += starts[b];
        }
        observer.check()?;
        let mut items = vec![0_u32; pairs.len()];
        let mut next = starts.clone();
        for [b, t] in pairs {
            let place = &mut next[b as usize];
            items[*place as usize] = t;
            *place += 1;
        }
        (self.starts, self.items) = (starts, items);
        Ok(())
    }

    /// Visits the buckets that the convex hull of two or three points may meet.
    fn buckets_along(&self, hull: &[DVec2], mut visit: impl FnMut(usize)) {
        let low = hull.iter().fold(DVec2::INFINITY, |m, p| m.min(*p)) - DVec2::splat(MARGIN) / self.scale;
        let high = hull.iter().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p)) + DVec2::splat(MARGIN) / self.scale;
        let (first, last) = (self.v.interval(low.y), self.v.interval(high.y));
        for row in first..=last {
            let reach = if first == last {
                Some([low.x, high.x])
            } else {
                // The outermost rows also hold what lies beyond them.
                let bottom = if row == 0 { f64::NEG_INFINITY } else { self.v.values[row] - MARGIN / self.scale.y };
                let beyond = row + 1 == self.v.count();
                let top = if beyond { f64::INFINITY } else { self.v.values[row + 1] + MARGIN / self.scale.y };
                reach_between(hull, bottom, top)
            };
            let Some([from, to]) = reach else { continue };
            let (from, to) = (from - MARGIN / self.scale.x, to + MARGIN / self.scale.x);
            for column in self.u.interval(from)..=self.u.interval(to) {
                visit(row * self.u.count() + column);
            }
        }
    }

    /// The nearest triangle to a point that none holds: rings of buckets around it, until what is left is farther away.
    fn nearest(&self, p: DVec2, column: usize, row: usize, accepts: impl Fn(u32) -> bool) -> Option<Located> {
        let (columns, rows) = (self.u.count(), self.v.count());
        let mut best: Option<(f64, Located)> = None;
        for ring in 0..columns.max(rows) {
            let (left, right) = (column.saturating_sub(ring), (column + ring).min(columns - 1));
            let (bottom, top) = (row.saturating_sub(ring), (row + ring).min(rows - 1));
            for j in bottom..=top {
                for i in left..=right {
                    let outermost = i + ring == column || i == column + ring || j + ring == row || j == row + ring;
                    if !outermost {
                        continue;
                    }
                    for &triangle in self.bucket(i, j).iter().filter(|&&t| accepts(t)) {
                        let (distance, weights) = self.nearest_in(triangle, p);
                        let better = best.is_none_or(|(d, l)| distance < d || distance == d && triangle < l.triangle);
                        if better {
                            best = Some((distance, Located { triangle, weights, inside: false }));
                        }
                    }
                }
            }
            // Distance to what has not been looked at: beyond the sides of the rings, where there are buckets beyond.
            let beyond = |open: bool, d: f64| if open { d.max(0.0) } else { f64::INFINITY };
            let rest = beyond(left > 0, (p.x - self.u.values[left]) * self.scale.x)
                .min(beyond(right + 1 < columns, (self.u.values[right + 1] - p.x) * self.scale.x))
                .min(beyond(bottom > 0, (p.y - self.v.values[bottom]) * self.scale.y))
                .min(beyond(top + 1 < rows, (self.v.values[top + 1] - p.y) * self.scale.y));
            if best.is_some_and(|(d, _)| d <= rest * rest) {
                break;
            }
        }
        best.map(|b| b.1)
    }

    /// Squared scaled distance of a triangle from a point outside of it, and the barycentrics of its nearest point.
    fn nearest_in(&self, triangle: u32, p: DVec2) -> (f64, [f64; 3]) {
        let corners = self.corners(triangle);
        let mut best = (f64::INFINITY, [1.0, 0.0, 0.0]);
        for e in 0..3 {
            let (a, b) = (corners[e] * self.scale, corners[(e + 1) % 3] * self.scale);
            let (edge, to) = (b - a, p * self.scale - a);
            let square = edge.length_squared();
            let s = if square > 0.0 { (to.dot(edge) / square).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (to - edge * s).length_squared();
            if distance < best.0 {
                let mut weights = [0.0; 3];
                weights[e] = 1.0 - s;
                weights[(e + 1) % 3] = s;
                best = (distance, weights);
            }
        }
        best
    }
}

/// Barycentric coordinates of `p` when the triangle (anticlockwise) holds it, border included.
fn holding([a, b, c]: [DVec2; 3], p: DVec2) -> Option<[f64; 3]> {
    let w = [orientation(b, c, p), orientation(c, a, p), orientation(a, b, p)];
    let sum = w[0] + w[1] + w[2];
    (w.iter().all(|&x| x >= 0.0) && sum > 0.0).then(|| w.map(|x| x / sum))
}

/// Positive when `a`, `b`, `c` turn left; the sign is exact.
pub(super) fn orientation(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Increasing values, at least two, that bound intervals; with a guide that finds an interval in a step or two.
#[derive(Debug)]
struct Lines {
    values: Vec<f64>,
    /// Steps of the guide per unit.
    rate: f64,
    /// How many values stand in the steps before each; one more than there are steps.
    guide: Vec<u32>,
}

impl Lines {
    /// Quantiles of `values` as bounds of at most `count` intervals. Of many values every k-th is looked at, and the ends.
    fn quantiles(values: impl Iterator<Item = f64> + Clone, count: usize) -> Self {
        let finite = values.filter(|x| x.is_finite());
        let total = finite.clone().count();
        if total == 0 {
            return Self::new(vec![0.0, 1.0]);
        }
        let low = finite.clone().fold(f64::INFINITY, f64::min);
        let high = finite.clone().fold(f64::NEG_INFINITY, f64::max);
        let stride = (total / (SAMPLES_PER_LINE * count)).max(1);
        let mut sample: Vec<f64> = finite.step_by(stride).chain([low, high]).collect();
        sample.sort_unstable_by(f64::total_cmp);
        sample.dedup();
        let last = sample.len() - 1;
        let count = count.min(last);
        Self::new(if count == 0 {
            vec![low, low + 1.0]
        } else {
            (0..=count).map(|k| sample[(k * last) / count]).collect()
        })
    }

    fn new(values: Vec<f64>) -> Self {
        let mut lines = Self { rate: 0.0, guide: vec![0; values.len() + 1], values };
        let rate = lines.values.len() as f64 / lines.width();
        // An infinite rate (a width next to nothing) would give no order; one step then holds everything.
        lines.rate = if rate.is_finite() { rate } else { 0.0 };
        for k in 0..lines.values.len() {
            let step = lines.step(lines.values[k]);
            lines.guide[step + 1] += 1;
        }
        for k in 1..lines.guide.len() {
            lines.guide[k] += lines.guide[k - 1];
        }
        lines
    }

    /// How many intervals there are.
    const fn count(&self) -> usize {
        self.values.len() - 1
    }

    fn width(&self) -> f64 {
        self.values[self.count()] - self.values[0]
    }

    /// The guide's step of a value: never less for a greater value, which is all that the guide needs.
    fn step(&self, x: f64) -> usize {
        (((x - self.values[0]) * self.rate) as usize).min(self.guide.len() - 2)
    }

    /// The interval that holds `x`; the first or last for what lies beyond.
    fn interval(&self, x: f64) -> usize {
        let step = self.step(x);
        let (from, to) = (self.guide[step] as usize, self.guide[step + 1] as usize);
        let below = from + self.values[from..to].partition_point(|&line| line <= x);
        below.clamp(1, self.count()) - 1
    }
}

/// The least and greatest x of the part of a convex hull of two or three points between two heights.
fn reach_between(hull: &[DVec2], bottom: f64, top: f64) -> Option<[f64; 2]> {
    let mut reach: Option<[f64; 2]> = None;
    let mut add = |x: f64| reach = Some(reach.map_or([x, x], |[a, b]: [f64; 2]| [a.min(x), b.max(x)]));
    for (k, &a) in hull.iter().enumerate() {
        if bottom <= a.y && a.y <= top {
            add(a.x);
        }
        let b = hull[(k + 1) % hull.len()];
        for height in [bottom, top] {
            if (a.y < height) != (b.y < height) && height.is_finite() {
                add(a.x + (b.x - a.x) * ((height - a.y) / (b.y - a.y)).clamp(0.0, 1.0));
            }
        }
    }
    reach
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::budget::Unobserved;
    use crate::engine::nurbs::Domain;
    use crate::engine::triangulation::{Configuration, GridLines, grid_mesh};

    fn grid(u: Vec<f64>, v: Vec<f64>) -> DomainMesh {
        grid_mesh(&GridLines { u, v }, Configuration::Diamond, 0)
    }

    fn locator(mesh: &DomainMesh) -> Locator<'_> {
        Locator::new(mesh, &Unobserved).expect("nobody cancels")
    }

    fn place(mesh: &DomainMesh, l: &Located) -> DVec2 {
        let corners = mesh.triangles[l.triangle as usize].map(|k| mesh.uv[k as usize]);
        corners[0] * l.weights[0] + corners[1] * l.weights[1] + corners[2] * l.weights[2]
    }

    #[test]
    fn every_vertex_and_edge_of_a_grid_is_held_by_some_triangle() {
        let lines = GridLines::uniform(Domain { u: [0.1, 0.9], v: [-3.0, 7.0] }, 23, 17);
        let mesh = grid(lines.u, lines.v);
        let locator = locator(&mesh);
        for t in &mesh.triangles {
            for e in 0..3 {
                let (a, b) = (mesh.uv[t[e] as usize], mesh.uv[t[(e + 1) % 3] as usize]);
                for p in [a, (a + b) * 0.5] {
                    let l = locator.locate(p).expect("there are triangles");
                    assert!(place(&mesh, &l).distance(p) < 1e-14);
                }
                assert!(locator.locate(a).expect("there are triangles").inside);
            }
        }
    }

    #[test]
    fn a_point_outside_goes_to_the_nearest_place_on_the_border() {
        let lines = GridLines::uniform(Domain { u: [0.0, 1.0], v: [0.0, 1.0] }, 9, 12);
        let mesh = grid(lines.u, lines.v);
        let locator = locator(&mesh);
        for (x, y) in [(1.5, 0.3), (-0.2, 0.77), (0.4, -1e-17), (0.6, 1.0 + 1e-15), (-1.0, 9.0), (2.0, 2.0)] {
            let l = locator.locate(DVec2::new(x, y)).expect("there are triangles");
            assert!(!l.inside);
            let nearest = DVec2::new(x.clamp(0.0, 1.0), y.clamp(0.0, 1.0));
            assert!(place(&mesh, &l).distance(nearest) < 1e-14);
        }
    }

    #[test]
    fn nothing_is_located_in_nothing() {
        let mesh = DomainMesh::default();
        assert_eq!(locator(&mesh).locate(DVec2::ZERO), None);
        let lines = GridLines::uniform(Domain { u: [0.0, 1.0], v: [0.0, 1.0] }, 2, 2);
        let mesh = grid(lines.u, lines.v);
        assert_eq!(locator(&mesh).locate(DVec2::NAN), None);
    }

    #[test]
    fn an_interval_is_found_as_by_searching_all_lines() {
        let uneven = vec![-3.0, -2.999, -2.998, 0.0, 1e-9, 2e-9, 5.0, 1000.0];
        let lines = Lines::new(uneven.clone());
        for &line in &uneven {
            for x in [line, line.next_down(), line.next_up(), line + 0.5, line - 0.5, line * 2.0] {
                let searched = uneven.partition_point(|&l| l <= x).clamp(1, uneven.len() - 1) - 1;
                assert_eq!(lines.interval(x), searched, "{x}");
            }
        }
        assert_eq!((lines.interval(f64::NEG_INFINITY), lines.interval(f64::INFINITY)), (0, 6));
    }

    /// Strictly increasing lines with very uneven steps.
    fn uneven() -> impl Strategy<Value = Vec<f64>> {
        proptest::collection::vec(-6.0..1.0_f64, 1..20).prop_map(|steps| {
            let mut lines = vec![0.0];
            for s in steps {
                lines.push(lines[lines.len() - 1] + 10.0_f64.powf(s));
            }
            lines
        })
    }

    proptest! {
        #[test]
        fn the_triangle_found_is_the_one_that_holds_the_point(
            u in uneven(), v in uneven(), points in proptest::collection::vec((0.0..1.0_f64, 0.0..1.0_f64), 50),
        ) {
            let mesh = grid(u.clone(), v.clone());
            let locator = locator(&mesh);
            for (x, y) in points {
                let p = DVec2::new(x * u[u.len() - 1], y * v[v.len() - 1]);
                let l = locator.locate(p).expect("there are triangles");
                let lowest = (0..mesh.triangles.len() as u32).find(|&t| holding(locator.corners(t), p).is_some());
                prop_assert_eq!(Some(l.triangle), lowest);
                prop_assert!(l.inside && place(&mesh, &l).distance(p) < 1e-12);
            }
        }

        #[test]
        fn the_nearest_triangle_of_a_mesh_with_holes_is_found(
            keep in proptest::collection::vec(any::<bool>(), 72), points in proptest::collection::vec((-0.5..1.5_f64, -0.5..1.5_f64), 20),
        ) {
            let lines = GridLines::uniform(Domain { u: [0.0, 1.0], v: [0.0, 1.0] }, 7, 7);
            let mut mesh = grid(lines.u, lines.v);
            let mut keep = keep.into_iter();
            mesh.triangles.retain(|_| keep.next() == Some(true));
            prop_assume!(!mesh.triangles.is_empty());
            let locator = locator(&mesh);
            for (x, y) in points {
                let p = DVec2::new(x, y);
                let l = locator.locate(p).expect("there are triangles");
                if !l.inside {
                    let best = (0..mesh.triangles.len() as u32)
                        .map(|t| locator.nearest_in(t, p).0).fold(f64::INFINITY, f64::min);
                    let found = place(&mesh, &l).distance(p);
                    prop_assert!((found * found - best).abs() < 1e-12);
                }
            }
        }
    }
}
