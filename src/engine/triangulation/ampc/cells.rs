//! From the points of a lattice to triangles (thesis 6.4, stages 7 and 8).
//!
//! A cell with corners a, b, c, d (anticlockwise from the lower left) becomes (a, b, c) and (a, c, d), the regular
//! configuration. Where corners coincide the rest is one triangle, and where all lie on one border nothing. With free ends
//! the crossings on a cell's sides are corners too, and runs along the border and back are taken out. Such a cell is convex
//! but for the bend of its lines; it is cut as a fan whose smallest triangle is largest. Where lines of both families make a cell
//! that `/` does not divide into positive triangles, `\` does, or the lines tangle.
//!
//! Vertices are numbered row by row, then crossings in the order of columns and rows. Orientation is decided exactly.

use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

use super::ends::{End, ends, is_between};
use super::lattice::{COINCIDENT, Crossing, Lattice};
use crate::engine::triangulation::polygon::PolygonTriangulator;

/// Triangles in strip coordinates.
#[derive(Default)]
pub(super) struct Cut {
    /// Vertices.
    pub points: Vec<DVec2>,
    /// Corners, anticlockwise in (x, t).
    pub triangles: Vec<[u32; 3]>,
    /// Triangles that were left out.
    pub dropped: Vec<[u32; 3]>,
    /// Cells that were left out.
    pub cells_dropped: u64,
}

/// A cell that cannot be divided: its lines are out of order.
pub(super) struct Tangled {
    /// The middle of its corners, in strip coordinates.
    pub at: DVec2,
}

/// Which cells are thin, and what becomes of them.
pub(super) struct Thin<'a> {
    /// The surface's point at a place in strip coordinates.
    pub point: &'a dyn Fn(DVec2) -> DVec3,
    /// Two corners at most this far apart make a cell thin, mm.
    pub distance: f64,
    /// Columns, and rows, beyond the first and last line that was found: only their cells are looked at.
    pub beyond: [[usize; 2]; 2],
}

/// Divides every cell.
pub(super) fn cut(lattice: &Lattice, thin: Option<&Thin>) -> Result<Cut, Tangled> {
    let mut corners = Corners::new(lattice);
    let [columns, rows] = lattice.size;
    let mut cut = Cut::default();
    let mut corner = Vec::with_capacity(12);
    let mut triangulator = PolygonTriangulator::default();
    let one_family = lattice.of_rows.iter().all(Vec::is_empty);
    let of_column = |i: usize| if one_family { ends(&corners, i, &mut triangulator) } else { Vec::new() };
    let mut together: Vec<Vec<End>> = (0..columns - 1).map(of_column).collect();
    for j in 0..rows - 1 {
        for (i, ends) in together.iter_mut().enumerate() {
            let end = ends.iter_mut().find(|end| (end.rows[0]..=end.rows[1]).contains(&j));
            let triangles = if let Some(end) = end {
                if end.rows[0] < j {
                    continue;
                }
                corner.clone_from(&end.corner);
                std::mem::take(&mut end.triangles)
            } else {
                corners.around(i, [j, j], None, &mut corner);
                if corner.len() < 3 {
                    continue;
                }
                let Some(triangles) = divide(&corners.points, &corner) else {
                    let sum: DVec2 = corner.iter().map(|&k| corners.points[k as usize]).sum();
                    return Err(Tangled { at: sum / corner.len() as f64 });
                };
                triangles
            };
            let is_thin = thin.is_some_and(|thin| {
                let outer = |[first, last]: [usize; 2], k: usize, count: usize| k < first || k + 1 + last >= count;
                (outer(thin.beyond[0], i, columns) || outer(thin.beyond[1], j, rows))
                    && is_thin(&corners.points, &corner, thin)
            });
            if is_thin {
                cut.cells_dropped += 1;
                cut.dropped.extend(triangles);
            } else {
                cut.triangles.extend(triangles);
            }
        }
    }
    cut.points = std::mem::take(&mut corners.points);
    Ok(cut)
}

/// Whether two of a cell's corners are too near in space.
fn is_thin(points: &[DVec2], corner: &[u32], thin: &Thin) -> bool {
    let places: Vec<DVec3> = corner.iter().map(|&k| (thin.point)(points[k as usize])).collect();
    (1..places.len()).any(|b| (0..b).any(|a| places[a].distance(places[b]) <= thin.distance))
}

/// The vertices of a lattice.
pub(super) struct Corners<'a> {
    pub(super) lattice: &'a Lattice,
    pub(super) points: Vec<DVec2>,
    /// Vertex of each point.
    vertex: Vec<u32>,
    /// For each column and each row the vertices of its crossings.
    columns: Vec<Vec<u32>>,
    rows: Vec<Vec<u32>>,
}

impl<'a> Corners<'a> {
    fn new(lattice: &'a Lattice) -> Self {
        let columns = lattice.size[0];
        let mut points: Vec<DVec2> = Vec::with_capacity(lattice.points.len());
        let mut vertex: Vec<u32> = Vec::with_capacity(lattice.points.len());
        for (k, &p) in lattice.points.iter().enumerate() {
            let left = (!k.is_multiple_of(columns)).then(|| vertex[k - 1]);
            let below = (k >= columns).then(|| vertex[k - columns]);
            let known = left.into_iter().chain(below).find(|&v| {
                let q: DVec2 = points[v as usize];
                (p - q).abs().max_element() <= COINCIDENT
            });
            vertex.push(known.unwrap_or_else(|| {
                points.push(p);
                points.len() as u32 - 1
            }));
        }
        let mut border = Border::new(&points);
        let mut of = |lists: &[Vec<Crossing>], turned: bool| -> Vec<Vec<u32>> {
            let mut vertex_of = |c: &Crossing| {
                let p = DVec2::new(c.border, c.at);
                border.vertex(if turned { DVec2::new(p.y, p.x) } else { p }, &mut points)
            };
            lists.iter().map(|list| list.iter().map(&mut vertex_of).collect()).collect()
        };
        let (of_columns, of_rows) = (of(&lattice.of_columns, false), of(&lattice.of_rows, true));
        Self { lattice, points, vertex, columns: of_columns, rows: of_rows }
    }

    /// The distinct corners of the cells of column i from row `first` to row `last`, anticlockwise, without those of the border
    /// that lie in `left_out`.
    pub(super) fn around(
        &self,
        i: usize,
        [first, last]: [usize; 2],
        left_out: Option<(f64, [f64; 2])>,
        corner: &mut Vec<u32>,
    ) {
        let columns = self.lattice.size[0];
        let at = |i: usize, j: usize| self.vertex[j * columns + i];
        corner.clear();
        corner.push(at(i, first));
        self.crossed(&self.rows[first], at(i, first), at(i + 1, first), 0, corner);
        corner.push(at(i + 1, first));
        for j in first..=last {
            self.crossed(&self.columns[i + 1], at(i + 1, j), at(i + 1, j + 1), 1, corner);
            corner.push(at(i + 1, j + 1));
        }
        let begin = corner.len();
        self.crossed(&self.rows[last + 1], at(i, last + 1), at(i + 1, last + 1), 0, corner);
        corner[begin..].reverse();
        corner.push(at(i, last + 1));
        for j in (first..=last).rev() {
            let begin = corner.len();
            self.crossed(&self.columns[i], at(i, j), at(i, j + 1), 1, corner);
            corner[begin..].reverse();
            if j > first {
                corner.push(at(i, j));
            }
        }
        if let Some((border, between)) = left_out {
            corner.retain(|&k| !is_between(self.points[k as usize], border, between));
        }
        // A corner that is twice in turn, or that the way goes to along the border and back, is none.
        let mut k = 0;
        while corner.len() > 2 && k < corner.len() {
            let n = corner.len();
            let [before, here, after] = [corner[(k + n - 1) % n], corner[k], corner[(k + 1) % n]];
            if here == before || self.is_spike(before, here, after) {
                corner.remove(k);
                k = k.saturating_sub(2);
            } else {
                k += 1;
            }
        }
    }

    /// Crossings between two points of a line, by their coordinate along it.
    fn crossed(&self, line: &[u32], from: u32, to: u32, axis: usize, corner: &mut Vec<u32>) {
        if line.is_empty() {
            return;
        }
        let along = |v: u32| self.points[v as usize][axis];
        corner.extend(line.iter().filter(|&&v| along(v) > along(from) && along(v) < along(to)));
    }

    /// True when the way goes to `here` along the border and back.
    fn is_spike(&self, before: u32, here: u32, after: u32) -> bool {
        let [p, q, r] = [before, here, after].map(|v| self.points[v as usize]);
        (0..2).any(|axis| {
            let border = q[axis] == 0.0 || q[axis] == 1.0;
            let along = 1 - axis;
            border && p[axis] == q[axis] && r[axis] == q[axis] && (p[along] - q[along]) * (r[along] - q[along]) >= 0.0
        })
    }
}

/// The vertices on each side of the domain, by their place along it.
struct Border([Vec<(f64, u32)>; 4]);

impl Border {
    fn new(points: &[DVec2]) -> Self {
        let mut border = Self(Default::default());
        for (k, p) in points.iter().enumerate() {
            for (side, on) in [p.x == 0.0, p.x == 1.0, p.y == 0.0, p.y == 1.0].into_iter().enumerate() {
                if on {
                    border.0[side].push((p[1 - side / 2], k as u32));
                }
            }
        }
        for side in &mut border.0 {
            side.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        border
    }

    /// The vertex at a place of the border, a new one where there is none.
    fn vertex(&mut self, p: DVec2, points: &mut Vec<DVec2>) -> u32 {
        let on = [p.x == 0.0, p.x == 1.0, p.y == 0.0];
        let number = on.iter().position(|&on| on).unwrap_or(3);
        let side = &mut self.0[number];
        let at = p[1 - number / 2];
        let k = side.partition_point(|&(place, _)| place < at);
        for near in [k.wrapping_sub(1), k] {
            if let Some(&(_, vertex)) = side.get(near).filter(|(place, _)| (place - at).abs() <= COINCIDENT) {
                return vertex;
            }
        }
        points.push(p);
        let vertex = points.len() as u32 - 1;
        side.insert(k, (at, vertex));
        vertex
    }
}

/// The triangles of a cell; `None` where there are no positive ones.
fn divide(points: &[DVec2], corner: &[u32]) -> Option<Vec<[u32; 3]>> {
    let n = corner.len();
    let fan = |root: usize| -> Vec<[u32; 3]> {
        (1..n - 1).map(|k| [root, root + k, root + k + 1].map(|k| corner[k % n])).collect()
    };
    let positive = |triangles: &[[u32; 3]]| triangles.iter().all(|&t| turn(points, t) > 0.0);
    if n <= 4 {
        return (0..n.max(3) - 2).map(fan).find(|triangles| positive(triangles));
    }
    let least = |triangles: &[[u32; 3]]| triangles.iter().map(|&t| turn(points, t)).fold(f64::INFINITY, f64::min);
    let mut best: Option<(f64, Vec<[u32; 3]>)> = None;
    for triangles in (0..n).map(fan) {
        let worst = least(&triangles);
        if worst > best.as_ref().map_or(0.0, |(worst, _)| *worst) {
            best = Some((worst, triangles));
        }
    }
    best.map(|(_, triangles)| triangles)
}

/// Twice the signed area, its sign exact.
pub(super) fn turn(points: &[DVec2], triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|k| points[k as usize]).map(|p| Coord { x: p.x, y: p.y });
    orient2d(a, b, c)
}
