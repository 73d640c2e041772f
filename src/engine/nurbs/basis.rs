//! B-spline basis functions and their first two derivatives at one parameter (thesis 1.1.1, (1.2) and (1.3)).
//!
//! Method: the triangular scheme of Cox and de Boor (Piegl and Tiller, The NURBS Book, A2.2) on the stack; derivatives by
//! (1.3) from the functions of the two lower degrees. Only the `degree + 1` functions that do not vanish on the span are
//! formed: function `k` belongs to control point `first + k`. All denominators contain the span itself, so none is zero.
//! Parameters outside the domain are clamped to it.

use super::{KnotVector, MAX_DEGREE};

/// Room for the functions of every degree.
pub(super) const WIDEST: usize = MAX_DEGREE + 1;

/// Room for the functions of the degrees that most files have: short arrays are cleared and copied in no time.
pub(super) const NARROW: usize = 4;

/// The functions that do not vanish at a parameter. `ORDERS` is 1 (values), 2 (and first) or 3 (and second derivatives);
/// `WIDTH` is the room for functions, more than the degree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Basis<const ORDERS: usize, const WIDTH: usize> {
    /// Index of the control point that function 0 belongs to.
    pub(super) first: usize,
    /// `rows[d][k]` is the d-th derivative of function `k`, for `k` up to the degree.
    pub(super) rows: [[f64; WIDTH]; ORDERS],
}

impl<const ORDERS: usize, const WIDTH: usize> Basis<ORDERS, WIDTH> {
    /// The functions of `knots` at `t`.
    #[inline]
    pub(super) fn at(knots: &KnotVector, t: f64) -> Self {
        let t = knots.clamp(t);
        let span = knots.span(t);
        let p = knots.degree();
        let k = knots.knots();
        let mut rows = [[0.0; WIDTH]; ORDERS];
        let mut row = [0.0; WIDTH];
        row[0] = 1.0;
        for q in 1..=p {
            // Before raising to degree q, the row holds the functions of degree q - 1.
            if ORDERS > 1 && q == p {
                rows[1] = differentiate(k, span, p, &row);
            }
            if ORDERS > 2 && q + 1 == p {
                rows[2] = differentiate(k, span, p, &differentiate(k, span, p - 1, &row));
            }
            raise(k, span, q, t, &mut row);
        }
        rows[0] = row;
        Self { first: span - p, rows }
    }
}

/// Raises the functions of degree `q - 1` on `span` to degree `q`, in place (1.2b).
#[inline]
fn raise<const WIDTH: usize>(knots: &[f64], span: usize, q: usize, t: f64, row: &mut [f64; WIDTH]) {
    let mut saved = 0.0;
    for r in 0..q {
        let high = knots[span + r + 1];
        let low = knots[span + r + 1 - q];
        let share = row[r] / (high - low);
        row[r] = saved + (high - t) * share;
        saved = (t - low) * share;
    }
    row[q] = saved;
}

/// The derivatives of the functions of degree `q` from (any derivative of) those of degree `q - 1`, by (1.3).
#[inline]
fn differentiate<const WIDTH: usize>(knots: &[f64], span: usize, q: usize, lower: &[f64; WIDTH]) -> [f64; WIDTH] {
    let mut out = [0.0; WIDTH];
    let mut left = 0.0;
    for j in 0..q {
        // Function j of degree q - 1 has the support knots[span - q + 1 + j] .. knots[span + 1 + j].
        let share = q as f64 * lower[j] / (knots[span + 1 + j] - knots[span + 1 + j - q]);
        out[j] = left - share;
        left = share;
    }
    out[q] = left;
    out
}
