//! Lawson's flips: an edge whose opposite corner lies inside the circle of its triangle is exchanged for the other
//! diagonal, until none is left: the constrained Delaunay triangulation, which has the largest smallest angle.

use glam::DVec2;

use super::NONE;

/// A corner counts as inside a circle when the determinant exceeds this fraction of the sum of its terms' magnitudes.
/// It is above the rounding error (about 1e-15), so every flip made is a true improvement, the flipped quadrilateral is
/// strictly convex, and the process ends; cocircular points (each trimmed circle has many) are left as they are.
const CERTAINLY_INSIDE: f64 = 1e-13;

/// Flips a triangle on the average before we are content. A polygon close to a circle needs O(n^2) flips that improve
/// next to nothing (an ellipse of 500 points would spend most of its time here). What stands in the end is a valid
/// triangulation all the same.
const FLIPS_PER_TRIANGLE: usize = 6;

/// Makes a triangulation constrained Delaunay in the domain stretched by `aspect` along u.
///
/// Half-edge `3 t + e` runs from corner e to corner e + 1 of triangle t; boundary half-edges have no twin and stay.
pub(super) fn make_delaunay(
    points: &[DVec2],
    aspect: f64,
    triangles: &mut [[u32; 3]],
    twins: &mut [u32],
    stack: &mut Vec<u32>,
) {
    stack.clear();
    stack.extend((0..twins.len() as u32).rev().filter(|&h| twins[h as usize] != NONE && h < twins[h as usize]));
    let mut allowance = FLIPS_PER_TRIANGLE * triangles.len();
    while let Some(h) = stack.pop() {
        let g = twins[h as usize];
        if g == NONE {
            continue;
        }
        let (t, s) = ((h / 3) as usize, (g / 3) as usize);
        let (e, f) = ((h % 3) as usize, (g % 3) as usize);
        let [a, b, c] = [0, 1, 2].map(|k| triangles[t][(e + k) % 3]);
        let d = triangles[s][(f + 2) % 3];
        if !inside_circle([a, b, c, d].map(|k| points[k as usize]), aspect) {
            continue;
        }
        if allowance == 0 {
            return;
        }
        allowance -= 1;
        // The quadrilateral a, d, b, c: triangles (c, a, d) and (d, b, c) replace (a, b, c) and (b, a, d).
        let outer = [next(next(h)), next(g), next(next(g)), next(h)].map(|k| twins[k as usize]);
        triangles[t] = [c, a, d];
        triangles[s] = [d, b, c];
        let (t, s) = (3 * t as u32, 3 * s as u32);
        for (inner, outer) in [t, t + 1, s, s + 1].into_iter().zip(outer) {
            twins[inner as usize] = outer;
            if outer != NONE {
                twins[outer as usize] = inner;
                stack.push(inner);
            }
        }
        twins[t as usize + 2] = s + 2;
        twins[s as usize + 2] = t + 2;
    }
}

/// The half-edge after `h` in its triangle.
const fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// True when the last point lies inside the circle of the first three (anticlockwise) without doubt.
fn inside_circle(p: [DVec2; 4], aspect: f64) -> bool {
    let stretch = DVec2::new(aspect, 1.0);
    let [a, b, c] = [0, 1, 2].map(|k| (p[k] - p[3]) * stretch);
    let term = |p: DVec2, q: DVec2, r: DVec2| {
        let (plus, minus) = (q.x * r.y, r.x * q.y);
        let lift = p.length_squared();
        (lift * (plus - minus), lift * (plus.abs() + minus.abs()))
    };
    let terms = [term(a, b, c), term(b, c, a), term(c, a, b)];
    let determinant = terms[0].0 + terms[1].0 + terms[2].0;
    let magnitude = terms[0].1 + terms[1].1 + terms[2].1;
    determinant > CERTAINLY_INSIDE * magnitude
}
