//! Lengths of curves that can only be evaluated: on the surface, on the mesh, and in the pattern.
//!
//! Chords of one, two and four parts of an interval are extrapolated twice (Richardson; errors h^2, h^4), the interval is
//! halved until the two extrapolations agree. Needs no derivatives, so the same code serves the exact curve on the surface
//! and its piecewise linear images, whose kinks only cost a few more halvings.

/// Agreement that is asked of an interval, relative to its length.
const RELATIVE: f64 = 1e-9;

/// Agreement that is enough, relative to the length of the whole curve: what kinks are judged by, at each of which the
/// halving ends sooner the larger this is. A hundred kinks may then cost less than a millionth of a length.
const OF_WHOLE: f64 = 3e-9;

/// How often an interval may be halved: bounds the work at kinks, where each halving halves the error.
const DEEPEST: u32 = 14;

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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec2;

    use super::*;

    #[test]
    fn a_circle_and_a_parabola_have_their_lengths() {
        let circle = curve_length(&|t| DVec2::from_angle(t), &DVec2::distance, [0.0, 2.0 * PI], 6.0);
        assert!((circle - 2.0 * PI).abs() < 1e-7, "{circle}");
        let parabola = curve_length(&|t| DVec2::new(t, t * t), &DVec2::distance, [0.0, 1.0], 1.5);
        let exact = 0.5 * 5.0_f64.sqrt() + 0.25 * (2.0 + 5.0_f64.sqrt()).ln();
        assert!((parabola - exact).abs() < 1e-8, "{parabola} {exact}");
    }

    #[test]
    fn a_kink_costs_no_more_than_the_tolerance() {
        let at = |t: f64| if t < 0.3 { DVec2::new(t, 0.0) } else { DVec2::new(0.3, t - 0.3) };
        assert!((curve_length(&at, &DVec2::distance, [0.0, 1.0], 1.0) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_length_that_is_not_a_number_ends() {
        assert!(curve_length(&|_| DVec2::NAN, &DVec2::distance, [0.0, 1.0], 1.0).is_nan());
    }
}
