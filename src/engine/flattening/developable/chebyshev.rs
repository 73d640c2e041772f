//! Chebyshev interpolation on [-1, 1]: nodes, integrals between them, coefficients, values.
//!
//! The nodes are the zeros of `T_ORDER` (first kind), so none stands on the border of an interval: what happens exactly
//! on a knot or at a pole is never asked for. Transform and integration are small dense matrices, built once
//! (Trefethen, Approximation Theory and Approximation Practice, chapters 3 and 19).

use std::f64::consts::PI;

/// Nodes in each direction of a panel. More: fewer panels on smooth surfaces, but differentiation amplifies rounding
/// with its square, and 16 already resolves a quarter circle in rational form to 1e-15.
pub(super) const ORDER: usize = 16;

/// The node that integrals start from: the nearest to the middle of the interval.
pub(super) const START: usize = ORDER / 2;

/// A line of values at the nodes, or of coefficients.
pub(super) type Line = [f64; ORDER];

/// The matrices of the rule.
#[derive(Debug, Clone)]
pub(super) struct Rule {
    /// The nodes, in decreasing order.
    pub(super) nodes: Line,
    /// Row `k`: what makes the coefficient of `T_k` of values at the nodes.
    pub(super) transform: [Line; ORDER],
    /// Row `i`: what makes the integral from node [`START`] to node `i` of values at the nodes.
    pub(super) integral: [Line; ORDER],
}

impl Rule {
    pub(super) fn new() -> Self {
        let n = ORDER as f64;
        let angle = |i: usize| PI * (i as f64 + 0.5) / n;
        let nodes: Line = std::array::from_fn(|i| angle(i).cos());
        let transform: [Line; ORDER] = std::array::from_fn(|k| {
            let scale = if k == 0 { 1.0 / n } else { 2.0 / n };
            std::array::from_fn(|i| scale * (k as f64 * angle(i)).cos())
        });
        // The integral of T_k is (T_{k+1} / (k + 1) - T_{k-1} / (k - 1)) / 2.
        let primitive = |k: usize, i: usize| {
            let (k, t) = (k as f64, |k: f64| (k * angle(i)).cos());
            match k as usize {
                0 => t(1.0),
                1 => 0.25 * t(2.0),
                _ => 0.5 * (t(k + 1.0) / (k + 1.0) - t(k - 1.0) / (k - 1.0)),
            }
        };
        let integral = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..ORDER).map(|k| (primitive(k, i) - primitive(k, START)) * transform[k][j]).sum())
        });
        Self { nodes, transform, integral }
    }
}

/// `T_0(x)` to `T_{ORDER-1}(x)`.
pub(super) fn polynomials(x: f64) -> Line {
    let mut t = [1.0; ORDER];
    t[1] = x;
    for k in 2..ORDER {
        t[k] = 2.0 * x * t[k - 1] - t[k - 2];
    }
    t
}

/// Their derivatives `k U_{k-1}(x)`.
pub(super) fn derivatives(x: f64) -> Line {
    let mut d = [0.0; ORDER];
    let (mut before, mut now) = (0.0, 1.0);
    for (k, d) in d.iter_mut().enumerate().skip(1) {
        *d = k as f64 * now;
        (before, now) = (now, 2.0 * x * now - before);
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot(a: &Line, b: &Line) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn a_smooth_function_is_interpolated_differentiated_and_integrated_to_rounding() {
        let rule = Rule::new();
        let f = |x: f64| (1.3 * x + 0.2).sin();
        let values: Line = rule.nodes.map(f);
        let coefficients: Line = std::array::from_fn(|k| dot(&rule.transform[k], &values));
        for k in 0..=20 {
            let x = f64::from(k) / 10.0 - 1.0;
            assert!((dot(&coefficients, &polynomials(x)) - f(x)).abs() < 1e-14);
            assert!((dot(&coefficients, &derivatives(x)) - 1.3 * (1.3 * x + 0.2).cos()).abs() < 1e-12);
        }
        let primitive = |x: f64| -(1.3 * x + 0.2).cos() / 1.3;
        for (i, row) in rule.integral.iter().enumerate() {
            let exact = primitive(rule.nodes[i]) - primitive(rule.nodes[START]);
            assert!((dot(row, &values) - exact).abs() < 1e-14);
        }
    }
}
