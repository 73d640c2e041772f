//! Style lines: polylines along which a face is cut open.
//!
//! A cut is laid into the triangulation of the face's domain segment by segment: its points become vertices, every edge that a
//! segment crosses is split there, so that the segment runs along edges from then on. Then the mesh is opened along these
//! edges: each fan of triangles around a vertex gets a vertex of its own. A cut may begin and end inside the face (a dart),
//! cross others, and run beyond the border, where there is nothing to cut.
//!
//! An edge that is crossed within [`SNAP`] of an end is taken to be crossed at that end, so that no needles come to be; the cut
//! moves by as little. `O(triangles)` for each segment.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::nurbs::Surface;

/// Most cuts of a job.
pub const MAX_CUTS: usize = 100;

/// Most points of all cuts of a job: each costs a look at the face's triangles.
pub const MAX_CUT_POINTS: usize = 2000;

/// A point this near to an end of an edge, as a part of its length, is that end.
const SNAP: f64 = 1e-4;

/// A point in space may lie so far off its face, as a part of the diagonal of the part.
pub const OFF_FACE: f64 = 1e-2;

/// A cut.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cut {
    /// The face that it is on, by its place in the file. Absent: of points in space the nearest, else the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<u32>,
    /// Its points.
    pub points: CutPoints,
}

/// The points of a cut, at least two.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum CutPoints {
    /// Places in the domain of the face.
    Uv(Vec<[f64; 2]>),
    /// Points in space, mm; the nearest points of the face are taken.
    Xyz(Vec<[f64; 3]>),
}

impl CutPoints {
    /// How many there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        match self {
            Self::Uv(points) => points.len(),
            Self::Xyz(points) => points.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether all are numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Uv(points) => points.iter().flatten().all(|x| x.is_finite()),
            Self::Xyz(points) => points.iter().flatten().all(|x| x.is_finite()),
        }
    }
}

/// A triangulation of a face that can be cut.
#[derive(Debug, Clone)]
pub(super) struct Cloth<'a> {
    pub surface: &'a Surface,
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Where the corners lie in the domain.
    pub places: Vec<[DVec2; 3]>,
    /// Edges along which it is to be opened, the lesser vertex first, and whether the cut runs from that to the other.
    marked: BTreeMap<[u32; 2], bool>,
}

/// Half-edges that were one edge, in the triangles of the opened mesh; the first runs along the cut, the second against it.
pub(super) type Opened = Vec<[u32; 2]>;

impl<'a> Cloth<'a> {
    pub(super) const fn new(
        surface: &'a Surface,
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        places: Vec<[DVec2; 3]>,
    ) -> Self {
        Self { surface, positions, triangles, places, marked: BTreeMap::new() }
    }

    /// The place in the domain of the point of the mesh that is nearest to `p`, and the distance.
    pub(super) fn nearest(&self, p: DVec3) -> (DVec2, f64) {
        let mut best = (DVec2::ZERO, f64::INFINITY);
        for (corners, places) in self.triangles.iter().zip(&self.places) {
            let corners = corners.map(|v| self.positions[v as usize]);
            let weights = nearest_weights(corners, p);
            let point = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
            let distance = p.distance(point);
            if distance < best.1 {
                best = (places[0] * weights[0] + places[1] * weights[1] + places[2] * weights[2], distance);
            }
        }
        best
    }

    /// Lays a polyline into the triangulation.
    pub(super) fn lay(&mut self, points: &[DVec2], observer: &dyn Observer) -> Result<(), EngineError> {
        let mut from = points.first().map(|&p| (p, self.put(p)));
        for &to in points.iter().skip(1) {
            observer.check()?;
            let Some((start, a)) = from else { continue };
            let b = self.put(to);
            if start.distance_squared(to) > 0.0 {
                self.run([start, to], [a, b]);
            }
            from = Some((to, b));
        }
        Ok(())
    }

    /// Makes a vertex of a place; `None` outside.
    fn put(&mut self, p: DVec2) -> Option<u32> {
        for t in 0..self.triangles.len() {
            let weights = weights(self.places[t], p);
            if !weights.iter().all(|w| *w >= -SNAP * SNAP) {
                continue;
            }
            let zero = |w: &f64| *w < SNAP;
            return Some(match weights.iter().filter(|w| zero(w)).count() {
                0 => {
                    let [a, b, c] = self.triangles[t];
                    let [pa, pb, pc] = self.places[t];
                    let v = self.vertex(p);
                    self.triangles[t] = [a, b, v];
                    self.places[t] = [pa, pb, p];
                    self.triangles.extend([[b, c, v], [c, a, v]]);
                    self.places.extend([[pb, pc, p], [pc, pa, p]]);
                    v
                }
                1 => {
                    let opposite = weights.iter().position(zero).unwrap_or(0);
                    let (i, j) = ((opposite + 1) % 3, (opposite + 2) % 3);
                    let share = weights[j] / (weights[i] + weights[j]);
                    self.split([self.triangles[t][i], self.triangles[t][j]], share)
                }
                _ => {
                    let greatest = (0..3).max_by(|&i, &j| weights[i].total_cmp(&weights[j])).unwrap_or(0);
                    self.triangles[t][greatest]
                }
            });
        }
        None
    }

    fn vertex(&mut self, p: DVec2) -> u32 {
        self.positions.push(self.surface.point(p.x, p.y));
        self.positions.len() as u32 - 1
    }

    /// Splits an edge in all its triangles, `share` of the way from its first vertex.
    fn split(&mut self, [from, to]: [u32; 2], share: f64) -> u32 {
        let (mut vertex, mut found) = (None, 0);
        for t in 0..self.triangles.len() {
            // An edge has at most two triangles.
            if found == 2 {
                break;
            }
            let corners = self.triangles[t];
            let Some(i) = (0..3).find(|&i| {
                let [a, b] = [corners[i], corners[(i + 1) % 3]];
                [a, b] == [from, to] || [b, a] == [from, to]
            }) else {
                continue;
            };
            found += 1;
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let [p, q, r] = [i, j, k].map(|n| self.places[t][n]);
            let place = if corners[i] == from { p.lerp(q, share) } else { q.lerp(p, share) };
            let v = match vertex {
                Some(v) => v,
                None => *vertex.insert(self.vertex(place)),
            };
            self.triangles[t] = [corners[i], v, corners[k]];
            self.places[t] = [p, place, r];
            self.triangles.push([v, corners[j], corners[k]]);
            self.places.push([place, q, r]);
        }
        let v = vertex.unwrap_or(from);
        if let Some(ascends) = self.marked.remove(&sorted([from, to])) {
            let along = ascends == (from < to);
            self.mark([from, v], along);
            self.mark([v, to], along);
        }
        v
    }

    /// Marks an edge, which a cut runs along or against.
    fn mark(&mut self, [a, b]: [u32; 2], along: bool) {
        self.marked.entry(sorted([a, b])).or_insert(along == (a < b));
    }

    /// Marks the edges along a segment, after splitting those that it crosses.
    fn run(&mut self, [a, b]: [DVec2; 2], ends: [Option<u32>; 2]) {
        let along = b - a;
        let length = along.length_squared();
        let off = |p: DVec2| along.perp_dot(p - a);
        let param = |p: DVec2| along.dot(p - a) / length;
        // Vertices on the segment with their places along it, and edges that it crosses between their ends.
        let mut on: BTreeMap<u32, f64> = BTreeMap::new();
        for (end, s) in ends.into_iter().zip([0.0, 1.0]) {
            on.extend(end.map(|v| (v, s)));
        }
        let mut crossed: BTreeMap<[u32; 2], (f64, f64)> = BTreeMap::new();
        for (corners, places) in self.triangles.iter().zip(&self.places) {
            for i in 0..3 {
                let j = (i + 1) % 3;
                let ([p, q], [dp, dq]) = ([places[i], places[j]], [off(places[i]), off(places[j])]);
                if dp == 0.0 && (0.0..=1.0).contains(&param(p)) {
                    on.entry(corners[i]).or_insert_with(|| param(p));
                }
                if (dp > 0.0) == (dq > 0.0) || dp == 0.0 || dq == 0.0 {
                    continue;
                }
                let share = dp / (dp - dq);
                let s = param(p.lerp(q, share));
                if !(0.0..=1.0).contains(&s) {
                    continue;
                }
                if share < SNAP {
                    on.entry(corners[i]).or_insert(s);
                } else if share > 1.0 - SNAP {
                    on.entry(corners[j]).or_insert(s);
                } else if corners[i] < corners[j] {
                    crossed.entry([corners[i], corners[j]]).or_insert((share, s));
                } else {
                    crossed.entry([corners[j], corners[i]]).or_insert((1.0 - share, s));
                }
            }
        }
        for (edge, (share, s)) in crossed {
            if edge.iter().all(|v| !on.contains_key(v)) {
                on.insert(self.split(edge, share), s);
            }
        }
        let mut path: Vec<(f64, u32)> = on.into_iter().map(|(v, s)| (s, v)).collect();
        path.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let edges: BTreeSet<[u32; 2]> = self.edges().collect();
        // Where two that follow each other are no edge the segment runs outside.
        for step in path.windows(2) {
            let edge = [step[0].1, step[1].1];
            if edges.contains(&sorted(edge)) {
                self.mark(edge, true);
            }
        }
    }

    fn edges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).map(sorted)
    }

    /// Opens the mesh along the marked edges. Gives the pairs of half-edges that were one.
    pub(super) fn open(&mut self) -> Opened {
        if self.marked.is_empty() {
            return Opened::new();
        }
        let mut halves: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (h, edge) in self.edges().enumerate() {
            halves.entry(edge).or_default().push(h as u32);
        }
        // Corners of one fan, joined over the edges that are not opened.
        let mut fan: Vec<u32> = (0..3 * self.triangles.len() as u32).collect();
        let mut opened = Opened::new();
        for (edge, both) in &halves {
            let &[g, h] = both.as_slice() else { continue };
            if let Some(&ascends) = self.marked.get(edge) {
                let from = self.triangles[g as usize / 3][g as usize % 3];
                opened.push(if (from == edge[0]) == ascends { [g, h] } else { [h, g] });
                continue;
            }
            for v in edge {
                let corner =
                    |h: u32| (h - h % 3..h - h % 3 + 3).find(|&c| self.triangles[c as usize / 3][c as usize % 3] == *v);
                if let (Some(a), Some(b)) = (corner(g), corner(h)) {
                    let (a, b) = (root(&mut fan, a), root(&mut fan, b));
                    fan[a.max(b) as usize] = a.min(b);
                }
            }
        }
        // The first fan of a vertex keeps it.
        let mut keeper: BTreeMap<u32, u32> = BTreeMap::new();
        let mut number: BTreeMap<u32, u32> = BTreeMap::new();
        for c in 0..3 * self.triangles.len() as u32 {
            let (t, i) = (c as usize / 3, c as usize % 3);
            let (v, r) = (self.triangles[t][i], root(&mut fan, c));
            let own = match number.get(&r) {
                Some(&own) => own,
                None if *keeper.entry(v).or_insert(r) == r => v,
                None => {
                    self.positions.push(self.positions[v as usize]);
                    self.positions.len() as u32 - 1
                }
            };
            number.insert(r, own);
            self.triangles[t][i] = own;
        }
        opened
    }
}

fn root(fan: &mut [u32], mut of: u32) -> u32 {
    while fan[of as usize] != of {
        fan[of as usize] = fan[fan[of as usize] as usize];
        of = fan[of as usize];
    }
    of
}

const fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

/// Barycentric coordinates in the plane.
fn weights([a, b, c]: [DVec2; 3], p: DVec2) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    let (wb, wc) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
    [1.0 - wb - wc, wb, wc]
}

/// Barycentric coordinates of the point of a triangle in space that is nearest to `p`.
fn nearest_weights([a, b, c]: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let (u, v, w) = (b - a, c - a, p - a);
    let (uu, uv, vv, uw, vw) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let determinant = uu * vv - uv * uv;
    let (s, t) = ((vv * uw - uv * vw) / determinant, (uu * vw - uv * uw) / determinant);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return [1.0 - s - t, s, t];
    }
    // Outside: the nearest of the three edges.
    let on = |from: DVec3, to: DVec3| {
        let along = to - from;
        let k = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (if k.is_finite() { k } else { 0.0 }, p.distance_squared(from + along * k))
    };
    let [(k0, d0), (k1, d1), (k2, d2)] = [on(a, b), on(b, c), on(c, a)];
    if d0 <= d1 && d0 <= d2 {
        [1.0 - k0, k0, 0.0]
    } else if d1 <= d2 {
        [0.0, 1.0 - k1, k1]
    } else {
        [k2, 0.0, 1.0 - k2]
    }
}
