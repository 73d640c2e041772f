//! Triangles that have an area in the domain and none in space, flipped away.
//!
//! Three points of a trimming curve that is straight in space but curved in (u, v) make such a triangle. Its longest edge
//! is exchanged for the other diagonal of the quadrilateral with its neighbour, where that is convex in the domain and
//! the flatter of the two new triangles is less flat than before.

use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

use super::DomainMesh;

/// A triangle is flat when twice its area is below this fraction of the square of its longest edge: its normal would be
/// noise in single precision.
const FLAT: f64 = 1e-9;

/// A triangle of which an edge is below this fraction of the longest is left alone: it shrinks at a pole.
const POINT: f64 = 1e-9;

/// Rounds of flips; a run of k points on a straight edge needs about log k, and a few more where flips wait for others.
const ROUNDS: usize = 24;

/// Twice the area of a triangle over the square of its longest edge, and the edge; `None` when an edge has no length.
fn fatness(p: [DVec3; 3]) -> Option<(f64, usize)> {
    let squares = [0, 1, 2].map(|e| p[e].distance_squared(p[(e + 1) % 3]));
    let longest = (0..3).fold(0, |best, e| if squares[e] > squares[best] { e } else { best });
    let shortest = squares.into_iter().fold(f64::INFINITY, f64::min);
    if shortest <= squares[longest] * POINT * POINT {
        return None;
    }
    Some(((p[1] - p[0]).cross(p[2] - p[0]).length() / squares[longest], longest))
}

/// Flips flat triangles of a domain mesh whose vertices have these positions. The domain stays covered as it was.
pub(super) fn flip_flat(domain: &mut DomainMesh, positions: &[DVec3]) {
    let at = |t: [u32; 3]| t.map(|k| positions[k as usize]);
    for _ in 0..ROUNDS {
        let flat: Vec<(usize, f64, usize)> = (domain.triangles.iter().enumerate())
            .filter_map(|(t, &corners)| fatness(at(corners)).map(|(fat, edge)| (t, fat, edge)))
            .filter(|&(_, fat, _)| fat < FLAT)
            .collect();
        if flat.is_empty() {
            return;
        }
        let mut halfedges: Vec<([u32; 2], u32)> = (domain.triangles.iter().enumerate())
            .flat_map(|(t, &[a, b, c])| [[a, b], [b, c], [c, a]].map(|edge| (edge, t as u32)))
            .collect();
        halfedges.sort_unstable();
        let mut moved = vec![false; domain.triangles.len()];
        let mut flips = 0;
        for (t, fat, edge) in flat {
            let [p, q, b] = [0, 1, 2].map(|k| domain.triangles[t][(edge + k) % 3]);
            let Ok(found) = halfedges.binary_search_by(|(e, _)| e.cmp(&[q, p])) else { continue };
            let s = halfedges[found].1 as usize;
            if moved[t] || moved[s] {
                continue;
            }
            let Some(&d) = domain.triangles[s].iter().find(|&&k| k != p && k != q) else { continue };
            let new = [[b, p, d], [d, q, b]];
            let before = fatness(at(domain.triangles[s])).map_or(fat, |(other, _)| fat.min(other));
            let better = new.iter().all(|&t| fatness(at(t)).is_some_and(|(after, _)| after > before));
            let convex = new.iter().all(|t| is_anticlockwise(t.map(|k| domain.uv[k as usize])));
            if better && convex {
                domain.triangles[t] = new[0];
                domain.triangles[s] = new[1];
                (moved[t], moved[s]) = (true, true);
                flips += 1;
            }
        }
        if flips == 0 {
            return;
        }
    }
}

fn is_anticlockwise([a, b, c]: [DVec2; 3]) -> bool {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c)) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_an_edge_that_is_straight_in_space_make_no_flat_triangle() {
        // v = u^2 / 2 is the line y = 0 in space; its points are joined to a fan, and once to the apex.
        let uv: Vec<DVec2> = (0..=8_u32)
            .map(|k| f64::from(k) / 8.0)
            .map(|u| DVec2::new(u, 0.5 * u * u))
            .chain([DVec2::new(0.4, 1.0)])
            .collect();
        let positions: Vec<DVec3> = uv.iter().map(|p| DVec3::new(p.x, p.y - 0.5 * p.x * p.x, 0.0)).collect();
        let mut triangles: Vec<[u32; 3]> = (1..8).map(|k| [0, k, k + 1]).collect();
        triangles.push([0, 8, 9]);
        let mut domain = DomainMesh { uv, triangles };
        let area = |domain: &DomainMesh| -> f64 {
            let twice = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|k| domain.uv[k as usize]);
                (b - a).perp_dot(c - a)
            };
            domain.triangles.iter().map(twice).sum()
        };
        let before = area(&domain);
        flip_flat(&mut domain, &positions);
        assert_eq!(domain.triangles.len(), 8);
        assert!((area(&domain) - before).abs() < 1e-14);
        for t in &domain.triangles {
            assert!(t.contains(&9), "{t:?} has its corners on one line");
            assert!(is_anticlockwise(t.map(|k| domain.uv[k as usize])));
        }
    }
}
