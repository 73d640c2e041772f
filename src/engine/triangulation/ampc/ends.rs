//! The border between the free ends of two lines, cut without a corner that lies on neither.
//!
//! A corner of the border between two rulings is not in their plane: triangles to it leave an angle defect at the inner
//! vertices they meet, and the mesh of a developable surface is none. So where two neighbouring lines end on the same side of
//! the domain, the rows' corners between their ends are left out and the cells there are cut as one polygon, whose corners
//! all lie on the two lines. Where one of them ends on that side and the other beyond the domain's corner, that corner is
//! cut off as a triangle of its own, which meets no inner vertex; beside a line that lies outside entirely it may stay, being the
//! one corner off the other line.
//!
//! Limits: ends more than `MOST_ROWS` rows apart keep the rows' corners, and so their defects, and so do lines that end more than once
//! on a side; lines of both families have corners on either anyhow.

use glam::DVec2;

use super::cells::Corners;
use super::lattice::COINCIDENT;
use crate::engine::triangulation::polygon::PolygonTriangulator;

/// Rows between two ends at the most. More keeps lines developable that lean little against the border, but draws a chord over so many
/// rows of a surface that curves along it.
const MOST_ROWS: usize = 8;

/// Cells of one column that are cut together.
pub(super) struct End {
    /// First and last cell.
    pub rows: [usize; 2],
    /// Corners of the polygon.
    pub corner: Vec<u32>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// The ends between columns i and i + 1, from the first row to the last, disjoint.
pub(super) fn ends(corners: &Corners, i: usize, triangulator: &mut PolygonTriangulator) -> Vec<End> {
    let mut found: Vec<End> = Vec::new();
    for border in [0.0, 1.0] {
        let Some(Span { between, cuts_corner }) = span(corners, i, border) else { continue };
        let cells = corners.lattice.size[1] - 1;
        let row = |t: f64| ((t * cells as f64) as usize).min(cells - 1);
        let rows = between.map(row);
        let taken = found.iter().any(|end| end.rows[0] <= rows[1] && rows[0] <= end.rows[1]);
        if (rows[0] == rows[1] && !cuts_corner) || rows[1] - rows[0] > MOST_ROWS || taken {
            continue;
        }
        let mut corner = Vec::new();
        corners.around(i, rows, Some((border, between)), &mut corner);
        if let Some(triangles) = cut(&corners.points, &corner, cuts_corner.then_some(border), triangulator) {
            found.push(End { rows, corner, triangles });
        }
    }
    found.sort_by_key(|end| end.rows);
    found
}

/// A part of a side of the domain.
struct Span {
    /// From where to where.
    between: [f64; 2],
    /// Whether the domain's corner at one of its ends is cut off.
    cuts_corner: bool,
}

/// The part between the ends of two lines, between the end of one and the domain's corner beyond which the other ends, or
/// between the end of one and the corner where the other lies outside entirely.
fn span(corners: &Corners, i: usize, border: f64) -> Option<Span> {
    let on_side = |column: usize| {
        let mut at = corners.lattice.of_columns[column].iter().filter(|c| c.border == border).map(|c| c.at);
        (at.next(), at.next())
    };
    let begins_outside = |column: usize| corners.lattice.points[column].x == border;
    let (end, one, other) = match (on_side(i), on_side(i + 1)) {
        ((Some(a), None), (Some(b), None)) => {
            return Some(Span { between: [a.min(b), a.max(b)], cuts_corner: false });
        }
        ((Some(end), None), (None, _)) => (end, i, i + 1),
        ((None, _), (Some(end), None)) => (end, i + 1, i),
        _ => return None,
    };
    // Beside a line that lies outside the region goes on where the first is inside, beside one inside where it is outside.
    let from_the_first_row = begins_outside(one) != begins_outside(other);
    let between = if from_the_first_row { [0.0, end] } else { [end, 1.0] };
    Some(Span { between, cuts_corner: !begins_outside(other) })
}

/// The triangles of a polygon; with `cut_off` the domain's corner on that side, where it is one of them, gets a triangle with its
/// neighbours. `None`
/// where the lines bend so that there are none.
fn cut(
    points: &[DVec2],
    corner: &[u32],
    cut_off: Option<f64>,
    triangulator: &mut PolygonTriangulator,
) -> Option<Vec<[u32; 3]>> {
    let at = |k: usize| points[corner[k % corner.len()] as usize];
    let is_corner = |k: usize, border: f64| at(k).x == border && (at(k).y == 0.0 || at(k).y == 1.0);
    let cut_off = cut_off.and_then(|border| (0..corner.len()).find(|&k| is_corner(k, border)));
    let mut ring = corner.to_vec();
    let mut triangles = Vec::new();
    if let Some(k) = cut_off.filter(|_| corner.len() > 3) {
        let n = corner.len();
        triangles.push([(k + n - 1) % n, k, (k + 1) % n].map(|k| corner[k]));
        ring.remove(k);
    }
    let places: Vec<DVec2> = ring.iter().map(|&k| points[k as usize]).collect();
    let edges: Vec<[u32; 2]> = (0..ring.len()).map(|k| [k as u32, ((k + 1) % ring.len()) as u32]).collect();
    let inner = triangulator.triangulate(&places, &edges, 1.0).ok()?;
    triangles.extend(inner.iter().map(|t| t.map(|k| ring[k as usize])));
    // Every corner once, and no triangle turned over: else the polygon was none.
    let whole = triangles.len() + 2 == corner.len();
    (whole && triangles.iter().all(|&t| super::cells::turn(points, t) > 0.0)).then_some(triangles)
}

/// Whether a vertex of the border is left out between two ends.
pub(super) fn is_between(p: DVec2, border: f64, [low, high]: [f64; 2]) -> bool {
    p.x == border && p.y > low + COINCIDENT && p.y < high - COINCIDENT
}
