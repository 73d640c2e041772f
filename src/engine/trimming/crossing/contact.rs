//! Whether two chains of segments cross, decided by exact predicates (Shewchuk's `orient2d` in the crate `robust`).
//!
//! Two segments cross when each has its ends strictly on both sides of the other. Where a vertex lies on a segment or on
//! another vertex the chains may touch or cross: there the directions in which one chain comes and goes are sorted in
//! between those of the other. Chains that run together for a while are followed to where they part, and cross when they
//! part to the other side than they met from. A chain that turns back on itself (a spike) has no sides and crosses nothing.

use glam::DVec2;
use robust::{Coord, orient2d};

use super::outline::Outline;

/// Positive when `c` lies to the left of the line from `a` to `b`, zero exactly when it lies on it.
pub(in crate::engine::trimming) fn orient(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// A place on a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Spot {
    /// At a point.
    Vertex(usize),
    /// Inside the segment that begins at a point.
    Inside(usize),
}

/// Where something lies as seen from a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    /// The way that the chain goes.
    Ahead,
    /// The way that it comes from.
    Behind,
}

/// How two chains cross.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::engine::trimming) enum Cross {
    /// Inside both segments.
    Inside(DVec2),
    /// At a point of at least one of the polylines.
    AtPoint(DVec2),
}

/// Whether the chains that segments `i` and `j` belong to cross at a point that these two segments have in common (the
/// end points of segments belong to the segments that begin there). The segments are not neighbours. `slack(i)` is how
/// far a curve may be from segment `i`: chains that part by no more than that are taken to touch.
pub(in crate::engine::trimming) fn cross(
    outline: &Outline,
    i: usize,
    j: usize,
    slack: impl Fn(usize) -> f64,
) -> Option<Cross> {
    let [a, b] = outline.segment(i);
    let [c, d] = outline.segment(j);
    let (c_side, d_side) = (orient(a, b, c), orient(a, b, d));
    if (c_side > 0.0 && d_side > 0.0) || (c_side < 0.0 && d_side < 0.0) {
        return None;
    }
    let (a_side, b_side) = (orient(c, d, a), orient(c, d, b));
    if (a_side > 0.0 && b_side > 0.0) || (a_side < 0.0 && b_side < 0.0) {
        return None;
    }
    if c_side != 0.0 && d_side != 0.0 && a_side != 0.0 && b_side != 0.0 {
        return Some(Cross::Inside(a + (b - a) * (a_side / (a_side - b_side)).clamp(0.0, 1.0)));
    }
    // A point of a line that lies in the box of a segment on that line is on the segment.
    let inside = |p: DVec2, a: DVec2, b: DVec2| p != a && p != b && p.cmpge(a.min(b)).all() && p.cmple(a.max(b)).all();
    let slack = slack(i) + slack(j);
    let crosses = |p: DVec2, a: Spot, b: Spot| {
        chains_cross(outline, p, a, b) && (slack == 0.0 || part_clearly(outline, p, a, b, slack))
    };
    if a == c && crosses(a, Spot::Vertex(i), Spot::Vertex(j)) {
        return Some(Cross::AtPoint(a));
    }
    if a_side == 0.0 && inside(a, c, d) && crosses(a, Spot::Vertex(i), Spot::Inside(j)) {
        return Some(Cross::AtPoint(a));
    }
    if c_side == 0.0 && inside(c, a, b) && crosses(c, Spot::Inside(i), Spot::Vertex(j)) {
        return Some(Cross::AtPoint(c));
    }
    None
}

/// Whether both ways of chain `b` at `p` lead farther than `slack` away from chain `a`.
fn part_clearly(outline: &Outline, p: DVec2, a: Spot, b: Spot, slack: f64) -> bool {
    let [from, to] = ways(outline, a);
    ways(outline, b).into_iter().all(|q| distance(q, p, from).min(distance(q, p, to)) > slack)
}

/// Distance of a point from a segment.
pub(in crate::engine::trimming) fn distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (d, e) = (p - a, b - a);
    let length = e.length_squared();
    let along = if length > 0.0 { (d.dot(e) / length).clamp(0.0, 1.0) } else { 0.0 };
    (d - e * along).length()
}

/// Where a chain at a spot comes from and goes to.
fn ways(outline: &Outline, spot: Spot) -> [DVec2; 2] {
    match spot {
        Spot::Vertex(i) => [outline.points[outline.before(i)].uv, outline.points[outline.next(i)].uv],
        Spot::Inside(i) => outline.segment(i),
    }
}

/// On which side of a chain through `p` that comes from and goes to `ways` the point `q` lies, near `p`; `None` at a spike.
fn side(p: DVec2, ways: [DVec2; 2], q: DVec2) -> Option<Side> {
    let [from, to] = ways;
    let same = |x: DVec2| orient(p, x, q) == 0.0 && (x - p).dot(q - p) > 0.0;
    let turn = orient(p, to, from);
    if turn == 0.0 && (to - p).dot(from - p) > 0.0 {
        return None;
    }
    Some(if same(to) {
        Side::Ahead
    } else if same(from) {
        Side::Behind
    } else {
        // The left side is what an anticlockwise sweep from `to` to `from` covers.
        let (after_to, after_from) = (orient(p, to, q), orient(p, from, q));
        let left = if turn > 0.0 {
            after_to > 0.0 && after_from < 0.0
        } else if turn < 0.0 {
            // More than half a turn: what lies straight opposite to either way is in it.
            after_to >= 0.0 || after_from <= 0.0
        } else {
            after_to > 0.0
        };
        if left { Side::Left } else { Side::Right }
    })
}

/// Whether chain `b` crosses chain `a` at `p` or on the way that they share from there on.
fn chains_cross(outline: &Outline, p: DVec2, a: Spot, b: Spot) -> bool {
    let [from, to] = ways(outline, b);
    let ways_a = ways(outline, a);
    let (Some(before), Some(after)) = (side(p, ways_a, from), side(p, ways_a, to)) else { return false };
    match (before, after) {
        (Side::Left, Side::Right) | (Side::Right, Side::Left) => true,
        (Side::Left | Side::Right, Side::Ahead) => part(outline, p, a, b, true).is_some_and(|s| s != before),
        (Side::Left | Side::Right, Side::Behind) => part(outline, p, a, b, false).is_some_and(|s| s != before),
        _ => false,
    }
}

/// The side to which chain `b`, going on from `p` along chain `a` (in its direction or against it), leaves it at last.
fn part(outline: &Outline, p: DVec2, a: Spot, b: Spot, along: bool) -> Option<Side> {
    let (mut p, mut a, mut b) = (p, a, b);
    let end = |spot: Spot, forwards: bool| match (spot, forwards) {
        (Spot::Vertex(i) | Spot::Inside(i), true) => outline.next(i),
        (Spot::Vertex(i), false) => outline.before(i),
        (Spot::Inside(i), false) => i,
    };
    // Two loops share at most all their vertices.
    for _ in 0..2 * outline.points.len() {
        let (next_a, next_b) = (end(a, along), end(b, true));
        let (at_a, at_b) = (outline.points[next_a].uv, outline.points[next_b].uv);
        let further = |x: DVec2| (x - p).abs().max_element();
        if at_a == at_b {
            (p, a, b) = (at_a, Spot::Vertex(next_a), Spot::Vertex(next_b));
        } else if further(at_a) < further(at_b) {
            let inside_b = match b {
                Spot::Vertex(i) | Spot::Inside(i) => i,
            };
            (p, a, b) = (at_a, Spot::Vertex(next_a), Spot::Inside(inside_b));
        } else {
            let inside_a = match (a, along) {
                (Spot::Vertex(i) | Spot::Inside(i), true) | (Spot::Inside(i), false) => i,
                (Spot::Vertex(_), false) => next_a,
            };
            (p, a, b) = (at_b, Spot::Inside(inside_a), Spot::Vertex(next_b));
        }
        match side(p, ways(outline, a), ways(outline, b)[1])? {
            Side::Ahead if along => {}
            Side::Behind if !along => {}
            Side::Ahead | Side::Behind => return None,
            parted => return Some(parted),
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::trimming::chord::ChordPoint;

    fn outline(loops: &[&[[i32; 2]]]) -> Outline {
        let mut outline = Outline::default();
        for (index, points) in loops.iter().enumerate() {
            let start = outline.points.len();
            outline.points.extend(points.iter().map(|p| ChordPoint {
                uv: DVec2::new(f64::from(p[0]), f64::from(p[1])),
                place: 0,
                t: [0.0, 1.0],
                deviation: 0.0,
                corner: true,
            }));
            outline.close(index, start);
        }
        outline
    }

    fn crosses(loops: &[&[[i32; 2]]]) -> bool {
        let outline = outline(loops);
        let n = outline.points.len();
        (0..n).any(|i| {
            (i + 1..n).any(|j| outline.next(i) != j && outline.next(j) != i && cross(&outline, i, j, |_| 0.0).is_some())
        })
    }

    /// Both orientations of both loops, and both orders of them.
    fn all_ways(a: &[[i32; 2]], b: &[[i32; 2]]) -> Vec<bool> {
        let turned = |l: &[[i32; 2]]| l.iter().rev().copied().collect::<Vec<_>>();
        let (x, y) = (turned(a), turned(b));
        vec![
            crosses(&[a, b]),
            crosses(&[&x, b]),
            crosses(&[a, &y]),
            crosses(&[&x, &y]),
            crosses(&[b, a]),
            crosses(&[&y, a]),
            crosses(&[b, &x]),
        ]
    }

    const SQUARE: [[i32; 2]; 4] = [[0, 0], [8, 0], [8, 8], [0, 8]];

    #[test]
    fn touching_is_not_crossing_whichever_way_the_loops_run() {
        let touching: [&[[i32; 2]]; 7] = [
            // A corner on an edge from inside and from outside, a corner on a corner.
            &[[4, 0], [6, 4], [2, 4]],
            &[[4, 0], [6, -4], [2, -4]],
            &[[8, 8], [12, 8], [12, 12]],
            // A shared stretch inside an edge, around a corner from inside and from outside.
            &[[2, 0], [6, 0], [4, 4]],
            &[[0, 2], [0, 0], [2, 0], [4, 4]],
            &[[8, 4], [8, 12], [4, 8], [8, 8]],
            // A corner that reaches into a corner.
            &[[0, 0], [4, 2], [2, 4]],
        ];
        for b in touching {
            assert!(all_ways(&SQUARE, b).iter().all(|c| !c), "{b:?}");
        }
    }

    #[test]
    fn crossing_is_found_whichever_way_the_loops_run() {
        let crossing: [&[[i32; 2]]; 6] = [
            // Through edges, through a corner, through points of its own on an edge.
            &[[4, 4], [12, 4], [12, 6]],
            &[[4, 4], [12, 12], [12, 4]],
            &[[4, 4], [8, 4], [12, 6], [8, 6]],
            // In along an edge, along two edges, against them.
            &[[2, -4], [2, 0], [6, 0], [6, 4], [12, 4], [12, -4]],
            &[[4, -4], [4, 0], [8, 0], [8, 4], [4, 4], [2, 2], [2, -4]],
            &[[12, 2], [8, 2], [8, 6], [4, 6], [4, 12], [12, 12]],
        ];
        for b in crossing {
            assert!(all_ways(&SQUARE, b).iter().all(|c| *c), "{b:?} {:?}", all_ways(&SQUARE, b));
        }
    }

    #[test]
    fn a_loop_may_meet_itself_and_may_not_pass_through() {
        assert!(!crosses(&[&[[0, 0], [4, 4], [8, 0], [8, 8], [4, 4], [0, 8]]]));
        assert!(crosses(&[&[[0, 0], [4, 4], [8, 8], [8, 0], [4, 4], [0, 8]]]));
        // A keyhole: out to the hole and back along the same way.
        assert!(!crosses(&[&[
            [0, 0],
            [8, 0],
            [8, 8],
            [0, 8],
            [0, 4],
            [2, 4],
            [2, 6],
            [6, 6],
            [6, 2],
            [2, 2],
            [2, 4],
            [0, 4]
        ]]));
    }
}
