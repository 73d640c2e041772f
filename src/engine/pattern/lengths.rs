//! Lengths of curves that can only be evaluated: on the surface, on the mesh, and in the pattern.
//!
//! Chords of one, two and four parts of an interval are extrapolated twice (Richardson; errors h^2, h^4), the interval is
//! halved until the two extrapolations agree. Needs no derivatives, so the same code serves the exact curve on the surface
//! and its piecewise linear images, whose kinks only cost a few more halvings.

/// Agreement that is asked of an interval, relative to its length.
const RELATIVE: f64 = 1e-9;

/// Agreement that is enough, relative to the length of the whole curve: what kinks are judged by.
const OF_WHOLE: f64 = 1e-8;

/// How often an interval may be halved: bounds the work at kinks, where each halving halves the error.
const DEEPEST: u32 = 12;

/// The length of a curve from `t0` to `t1`; `distance(a, b)` is that between its points at two parameters.
///
/// `scale` is about the length of the whole.
pub(super) fn curve_length<P: Copy>(
    at: &impl Fn(f64) -> P,
    distance: &impl Fn(P, P) -> f64,
    [t0, t1]: [f64; 2],
    scale: f64,
) -> f64 {
    let middle = 0.5 * (t0 + t1);
    let ends = [at(t0), at(middle), at(t1)];
    halve(at, distance, [t0, t1], ends, scale, DEEPEST)
}

fn halve<P: Copy>(
    at: &impl Fn(f64) -> P,
    distance: &impl Fn(P, P) -> f64,
    [t0, t1]: [f64; 2],
    [first, middle, last]: [P; 3],
    scale: f64,
    deepest: u32,
) -> f64 {
    let tm = 0.5 * (t0 + t1);
    let quarters = [at(0.5 * (t0 + tm)), at(0.5 * (tm + t1))];
    let one = distance(first, last);
    let two = distance(first, middle) + distance(middle, last);
    let four = distance(first, quarters[0])
        + distance(quarters[0], middle)
        + distance(middle, quarters[1])
        + distance(quarters[1], last);
    let (coarse, fine) = (two + (two - one) / 3.0, four + (four - two) / 3.0);
    let error = (fine - coarse).abs();
    // A length that is not a number ends here too.
    if deepest == 0 || !(error > RELATIVE * four && error > OF_WHOLE * scale) {
        return fine + (fine - coarse) / 15.0;
    }
    halve(at, distance, [t0, tm], [first, quarters[0], middle], scale, deepest - 1)
        + halve(at, distance, [tm, t1], [middle, quarters[1], last], scale, deepest - 1)
}
