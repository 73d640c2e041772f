//! Triangles that fill what lies around a flat part: between its border and a frame, and in its holes.
//!
//! A constrained Delaunay triangulation of the borders, the frame (a polygon on a circle) and points in between, which
//! lie as densely as the border's nodes where these are near and more sparsely the farther off (the leaves of a quadtree).
//! Together with the part's triangles it is a triangulation of the frame's polygon; that is how the map that it came from
//! is known to be injective.
//!
//! Units are those of the map. The number of points is in proportion to the border's nodes, with [`MOST_CELLS`] for each
//! at the most.

use std::f64::consts::TAU;

use glam::DVec2;
use spade::handles::FixedFaceHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// Radius of the frame over that of the part. Nearer, and the part would feel it; farther costs nothing but a step more of
/// the quadtree.
const FRAME: f64 = 3.0;

/// Corners of the frame.
const CORNERS: usize = 24;

/// Points stay within this part of the frame's radius, so that its triangles are not thin.
const INSIDE: f64 = 0.9;

/// A point keeps this part of its cell's side from the border. Nearer, and it would be in the border's way.
const CLEARANCE: f64 = 0.5;

/// Halvings of the frame's box, at most: what is left is 1e-6 of it.
const DEEPEST: usize = 20;

/// Cells for each node of the border, at most. Evenly divided borders have about twelve.
const MOST_CELLS: usize = 64;

/// What lies around a part.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Scaffold {
    /// Vertices of its own: they follow the part's in number.
    pub(super) places: Vec<[f64; 2]>,
    /// Where among them the frame's begin.
    pub(super) frame: usize,
    /// Anticlockwise.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Edges that are none of the part's.
    pub(super) edges: Vec<[u32; 2]>,
}

/// An edge of the border.
struct Segment {
    ends: [DVec2; 2],
    /// At least the spacing.
    length: f64,
}

impl Segment {
    fn middle(&self) -> DVec2 {
        0.5 * (self.ends[0] + self.ends[1])
    }

    fn distance(&self, p: DVec2) -> f64 {
        distance_to_segment(p, self.ends)
    }
}

/// Distance of a point from the segment between two others.
pub(super) fn distance_to_segment(p: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(a + t * along)
}

/// The scaffold around a map without overlaps of a part whose borders are `borders` (numbers of vertices, each a closed
/// loop), with points no closer to each other than about `spacing`. `None` when borders meet as far as numbers of sixteen digits can tell.
pub(super) fn scaffold(flat: &[[f64; 2]], borders: &[Vec<u32>], spacing: f64) -> Option<Scaffold> {
    let count = flat.len() as u32;
    let nodes: Vec<u32> = borders.iter().flatten().copied().collect();
    let at = |v: u32| DVec2::from_array(flat[v as usize]);
    let (low, high) = nodes
        .iter()
        .map(|&v| at(v))
        .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let centre = 0.5 * (low + high);
    let radius = FRAME * nodes.iter().map(|&v| centre.distance(at(v))).fold(0.0, f64::max);
    if !(radius.is_finite() && radius > 0.0) {
        return None;
    }
    let mut edges = Vec::with_capacity(nodes.len());
    let mut segments = Vec::with_capacity(nodes.len());
    let mut first = 0;
    for border in borders {
        for k in 0..border.len() {
            let next = (k + 1) % border.len();
            edges.push([first + k, first + next]);
            let ends = [at(border[k]), at(border[next])];
            segments.push(Segment { ends, length: ends[0].distance(ends[1]).max(spacing) });
        }
        first += border.len();
    }
    let mut points: Vec<DVec2> = nodes.iter().map(|&v| at(v)).collect();
    let own = points.len();
    // Only those outside of the part are of use: a first triangulation tells where they lie.
    let frame = (0..CORNERS).map(|k| centre + radius * DVec2::from_angle(TAU * k as f64 / CORNERS as f64));
    points.extend(frame);
    let plain = triangulated(&points, &edges)?;
    let outside = outside(&plain);
    let spread = spread(&segments, centre, radius);
    let mut between: Vec<DVec2> = Vec::with_capacity(spread.len());
    for p in spread {
        if let spade::PositionInTriangulation::OnFace(face) = plain.locate(Point2::new(p.x, p.y))
            && outside[face.index()]
        {
            between.push(p);
        }
    }
    // The frame last.
    let corners = points.split_off(own);
    points.extend(&between);
    points.extend(&corners);
    let whole = triangulated(&points, &edges)?;
    let outside = self::outside(&whole);
    let number = |k: usize| if k < own { nodes[k] } else { count + (k - own) as u32 };
    let mut scaffold = Scaffold {
        places: points[own..].iter().map(DVec2::to_array).collect(),
        frame: between.len(),
        ..Scaffold::default()
    };
    for face in whole.inner_faces().filter(|face| outside[face.fix().index()]) {
        scaffold.triangles.push(face.vertices().map(|v| number(v.fix().index())));
    }
    for edge in whole.undirected_edges().filter(|edge| !edge.is_constraint_edge()) {
        let [a, b] = edge.as_directed().vertices().map(|v| v.fix().index());
        let faces = [edge.as_directed().face(), edge.as_directed().rev().face()];
        if faces.iter().any(|face| !face.is_outer() && outside[face.fix().index()]) {
            scaffold.edges.push([number(a), number(b)]);
        }
    }
    Some(scaffold)
}

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// The triangulation of all points, in their order, with all edges; `None` when points coincide or edges cross.
fn triangulated(points: &[DVec2], edges: &[[usize; 2]]) -> Option<Cdt> {
    let all = points.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let mut crossed = false;
    let found = Cdt::try_bulk_load_cdt(all, edges.to_vec(), |_| crossed = true).ok()?;
    (!crossed && found.num_vertices() == points.len() && found.num_constraints() == edges.len()).then_some(found)
}

/// Which faces lie outside of the part: an even number of borders away from the frame.
fn outside(triangulation: &Cdt) -> Vec<bool> {
    let mut found = vec![None; triangulation.num_all_faces()];
    let mut open: Vec<FixedFaceHandle<_>> = Vec::new();
    for edge in triangulation.directed_edges().filter(spade::handles::DirectedEdgeHandle::is_outer_edge) {
        if let Some(face) = edge.rev().face().as_inner()
            && found[face.fix().index()].is_none()
        {
            found[face.fix().index()] = Some(true);
            open.push(face.fix());
        }
    }
    while let Some(face) = open.pop() {
        let here = found[face.index()] == Some(true);
        for edge in triangulation.face(face).adjacent_edges() {
            if let Some(next) = edge.rev().face().as_inner()
                && found[next.fix().index()].is_none()
            {
                found[next.fix().index()] = Some(here != edge.is_constraint_edge());
                open.push(next.fix());
            }
        }
    }
    found.into_iter().map(|outside| outside == Some(true)).collect()
}

/// A cell of the quadtree with the segments that are near it.
struct Cell {
    centre: DVec2,
    side: f64,
    near: Vec<u32>,
}

impl Cell {
    fn distance(&self, p: DVec2) -> f64 {
        ((p - self.centre).abs() - 0.5 * self.side).max(DVec2::ZERO).length()
    }
}

/// Points over the frame's disc: a cell is divided while a shorter segment is less than its side away.
fn spread(segments: &[Segment], centre: DVec2, radius: f64) -> Vec<DVec2> {
    let mut points = Vec::new();
    let mut cells = vec![Cell { centre, side: 2.0 * radius, near: (0..segments.len() as u32).collect() }];
    let mut total = 1;
    for depth in 0..=DEEPEST {
        let mut finer = Vec::new();
        for cell in cells {
            let near = |s: &Segment| s.length < cell.side && cell.distance(s.middle()) < cell.side;
            let divided = cell.near.iter().any(|&s| near(&segments[s as usize]));
            if divided && depth < DEEPEST && total < MOST_CELLS * segments.len() {
                total += 4;
                for corner in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
                    let mut child = Cell {
                        centre: cell.centre + 0.25 * cell.side * DVec2::from(corner),
                        side: 0.5 * cell.side,
                        near: Vec::new(),
                    };
                    child.near = cell
                        .near
                        .iter()
                        .copied()
                        .filter(|&s| {
                            let s = &segments[s as usize];
                            child.distance(s.middle()) - 0.5 * s.length < child.side
                        })
                        .collect();
                    finer.push(child);
                }
            } else if cell.centre.distance(centre) < INSIDE * radius
                && cell.near.iter().all(|&s| segments[s as usize].distance(cell.centre) > CLEARANCE * cell.side)
            {
                points.push(cell.centre);
            }
        }
        cells = finer;
    }
    points
}

#[cfg(test)]
mod tests {
    use robust::{Coord, orient2d};

    use super::*;

    /// Twice the area of the scaffold's triangles; each must be anticlockwise.
    fn double_area(flat: &[[f64; 2]], scaffold: &Scaffold) -> f64 {
        let at = |v: u32| flat.get(v as usize).copied().unwrap_or_else(|| scaffold.places[v as usize - flat.len()]);
        let coord = |v: u32| Coord { x: at(v)[0], y: at(v)[1] };
        scaffold
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(coord);
                let double = orient2d(a, b, c);
                assert!(double > 0.0);
                double
            })
            .sum()
    }

    fn circle(count: usize, radius: f64, clockwise: bool) -> Vec<[f64; 2]> {
        (0..count)
            .map(|k| {
                let angle = TAU * k as f64 / count as f64;
                (radius * DVec2::from_angle(if clockwise { -angle } else { angle })).to_array()
            })
            .collect()
    }

    #[test]
    fn everything_in_the_frame_but_the_part_is_filled_holes_too() {
        let mut flat = circle(80, 2.0, false);
        flat.extend(circle(30, 0.7, true));
        let borders = [(0..80).collect(), (80..110).collect()];
        let found = scaffold(&flat, &borders, 0.0).unwrap();
        let polygon = |count: f64, radius: f64| count * radius * radius * (TAU / count).sin();
        let expected = polygon(24.0, 6.0) - polygon(80.0, 2.0) + polygon(30.0, 0.7);
        assert!((double_area(&flat, &found) - expected).abs() < 1e-9);
        assert_eq!(found.places.len() - found.frame, CORNERS);
        assert!(found.places.len() < 12 * flat.len(), "{}", found.places.len());
        // Euler: every edge of a triangle is there once, the part's own aside.
        let sides = 3 * found.triangles.len() + CORNERS;
        assert_eq!(2 * found.edges.len() + flat.len(), sides);
    }

    #[test]
    fn borders_that_meet_have_no_scaffold() {
        let mut flat = circle(8, 1.0, false);
        flat[3] = flat[0];
        assert_eq!(scaffold(&flat, &[(0..8).collect()], 0.0), None);
        let bow = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(scaffold(&bow, &[vec![0, 1, 2, 3]], 0.0), None);
    }
}
