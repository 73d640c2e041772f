//! From densities to lines: each piece between two breaks is divided at equal shares of its integrated density.
//!
//! The integral runs strip by strip and so knot span by knot span: a span gets as many lines as it needs, unequally
//! spaced where the need varies, and a span that needs less than one shares a cell with its neighbours.

use super::axis::Axis;

/// Share of a cell that may be missing from a whole number of cells: it absorbs rounding of the integral.
const ROUNDING: f64 = 1e-9;

/// The integral of a density between two parameters.
fn integral(axis: &Axis, density: &[f64], from: f64, to: f64) -> f64 {
    let mut sum = 0.0;
    let first = axis.strip_of(from);
    for (offset, per_parameter) in density[first..].iter().enumerate() {
        let i = first + offset;
        let (lower, upper) = (axis.edges[i].max(from), axis.edges[i + 1].min(to));
        if lower >= to {
            break;
        }
        sum += (upper - lower).max(0.0) * per_parameter;
    }
    sum
}

/// Ends of the pieces: the strips' ends and the breaks between them.
fn pieces<'a>(axis: &'a Axis, breaks: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + 'a {
    let last = axis.edges[axis.len()];
    let starts = std::iter::once(axis.edges[0]).chain(breaks.iter().copied());
    let ends = breaks.iter().copied().chain(std::iter::once(last));
    starts.zip(ends)
}

/// Cells that [`place`] would make, as a real number: it may be beyond every integer.
pub(super) fn count(axis: &Axis, breaks: &[f64], density: &[f64], scale: f64) -> f64 {
    pieces(axis, breaks).map(|(from, to)| (integral(axis, density, from, to) * scale - ROUNDING).ceil().max(1.0)).sum()
}

/// The lines, from the first strip's start to the last one's end, and the density that whole cells make of the given one.
///
/// Call only after [`count`] was found bearable.
pub(super) fn place(axis: &Axis, breaks: &[f64], density: &[f64], scale: f64) -> (Vec<f64>, Vec<f64>) {
    let mut lines = vec![axis.edges[0]];
    let mut made = vec![0.0_f64; axis.len()];
    for (from, to) in pieces(axis, breaks) {
        let whole = integral(axis, density, from, to);
        let cells = (whole * scale - ROUNDING).ceil().max(1.0);
        let first = axis.strip_of(from);
        let (mut strip, mut passed) = (first, 0.0);
        let mut next = 1.0;
        while strip < axis.len() && axis.edges[strip] < to {
            let (lower, upper) = (axis.edges[strip].max(from), axis.edges[strip + 1].min(to));
            let held = (upper - lower) * density[strip];
            made[strip] = made[strip].max(density[strip] * cells / whole);
            while next < cells && whole * next / cells <= passed + held {
                let line = lower + (whole * next / cells - passed) / density[strip];
                let line = line.min(upper);
                if lines.last().is_some_and(|l| *l < line) && line < to {
                    lines.push(line);
                }
                next += 1.0;
            }
            passed += held;
            strip += 1;
        }
        lines.push(to);
    }
    (lines, made)
}

/// The grid's lines: those between the ends, and the domain's own ends in their stead.
///
/// What lies between the domain's end and the part's first line holds the part from its own end only, so no line is
/// needed there.
pub(super) fn of_domain(axis: &Axis, lines: &[f64]) -> Vec<f64> {
    let [first, last] = axis.domain;
    let mut whole = vec![first];
    whole.extend(lines[1..lines.len() - 1].iter().copied().filter(|l| *l > first && *l < last));
    whole.push(last);
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::nurbs::KnotVector;

    fn axis() -> Axis {
        Axis::new(&KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 4.0, 4.0, 4.0, 4.0], "u").unwrap(), [0.0, 4.0], false)
    }

    #[test]
    fn an_even_density_gives_even_lines_and_the_ends_are_kept_bit_for_bit() {
        let a = axis();
        let density = vec![2.0; a.len()];
        assert_eq!(count(&a, &[], &density, 1.0), 8.0);
        let (lines, made) = place(&a, &[], &density, 1.0);
        assert_eq!(lines.len(), 9);
        for (i, line) in lines.iter().enumerate() {
            assert!((line - 0.5 * i as f64).abs() < 1e-14);
        }
        assert!(made.iter().all(|m| (m - 2.0).abs() < 1e-14));
        assert_eq!((lines[0], lines[8]), (0.0, 4.0));
    }

    #[test]
    fn lines_crowd_where_the_density_is_high_and_breaks_are_lines() {
        let a = axis();
        let density: Vec<f64> = (0..a.len()).map(|i| if i < a.len() / 2 { 10.0 } else { 1.0 }).collect();
        let (lines, _) = place(&a, &[2.0], &density, 1.0);
        assert_eq!(lines.iter().filter(|l| **l < 2.0).count(), 20);
        assert!(lines.contains(&2.0));
        assert_eq!(lines.len(), 23);
        assert!(lines.windows(2).all(|w| w[0] < w[1]));
    }

    #[test]
    fn a_part_of_the_domain_has_no_lines_of_its_own_ends() {
        let knots = KnotVector::new(1, vec![0.0, 0.0, 4.0, 4.0], "u").unwrap();
        let a = Axis::new(&knots, [1.0, 3.0], false);
        let (lines, _) = place(&a, &[], &[1.0], 1.0);
        assert_eq!(of_domain(&a, &lines), vec![0.0, 2.0, 4.0]);
    }
}
