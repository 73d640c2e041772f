//! The curves of a border: followed by chords, and met by the nearest point.

use glam::DVec3;

use super::face::Face;
use super::near::{Near, Segment};

/// The most parts that a chord is cut into at once.
const MOST_PARTS: f64 = 64.0;

/// How often parts are cut again: a curve whose parameter runs unevenly needs a second and a third look.
const MOST_CUTS: u32 = 4;

/// The most points on one edge of a mesh's border: edges end at the lines of the grid, between which curves bend little.
const MOST_POINTS: usize = 4096;

/// Steps towards the nearest point of a curve. From a chord within the tolerance two or three are enough.
const STEPS: usize = 8;

/// The parameters between 0 and 1 at which chords of an edge's curve stay within `tolerance` of it, sampled; ascending.
pub(super) fn followed(face: &Face<'_>, edge: u32, tolerance: f64) -> Vec<f64> {
    let mut inner = Vec::new();
    cut(face, edge, [0.0, 1.0], tolerance, MOST_CUTS, &mut inner);
    inner
}

fn cut(face: &Face<'_>, edge: u32, [from, to]: [f64; 2], tolerance: f64, cuts: u32, inner: &mut Vec<f64>) {
    if cuts == 0 || inner.len() >= MOST_POINTS {
        return;
    }
    let at = |share: f64| from + (to - from) * share;
    let chord = Segment { ends: [from, to].map(|s| face.point(edge, s)), face: 0, of: edge, s: [from, to] };
    let deviation =
        [0.25, 0.5, 0.75].into_iter().map(|share| chord.nearest(face.point(edge, at(share))).1).fold(0.0, f64::max);
    if deviation <= tolerance {
        return;
    }
    // A part's deviation falls with the square of its length.
    let parts = (deviation / tolerance).sqrt().ceil().clamp(2.0, MOST_PARTS);
    for k in 0..parts as u32 {
        let ends = [at(f64::from(k) / parts), at((f64::from(k) + 1.0) / parts)];
        if k > 0 {
            inner.push(ends[0]);
        }
        cut(face, edge, ends, tolerance, cuts - 1, inner);
    }
}

/// All borders of all faces, followed by chords within `tolerance`.
pub(super) fn followed_borders(faces: &[Face<'_>], tolerance: f64) -> Near {
    let mut segments = Vec::new();
    for (f, face) in faces.iter().enumerate() {
        for &edge in face.borders.iter().flatten() {
            let mut last = (0.0, face.point(edge, 0.0));
            for s in followed(face, edge, tolerance).into_iter().chain([1.0]) {
                let here = (s, face.point(edge, s));
                segments.push(Segment { ends: [last.1, here.1], face: f as u32, of: edge, s: [last.0, here.0] });
                last = here;
            }
        }
    }
    Near::new(segments)
}

/// The parameter of the point of an edge's curve that is nearest to `p`, starting near `s`, and the distance.
pub(super) fn nearest(face: &Face<'_>, edge: u32, p: DVec3, s: f64) -> (f64, f64) {
    let mut best = (s, p.distance(face.point(edge, s)));
    let mut s = s;
    for _ in 0..STEPS {
        let (point, along) = face.tangent(edge, s);
        let speed = along.length_squared();
        if speed <= 0.0 {
            break;
        }
        let next = (s + (p - point).dot(along) / speed).clamp(0.0, 1.0);
        if !next.is_finite() {
            break;
        }
        let distance = p.distance(face.point(edge, next));
        if distance < best.1 {
            best = (next, distance);
        }
        if next == s {
            break;
        }
        s = next;
    }
    best
}
