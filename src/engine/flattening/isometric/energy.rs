//! Distortion energies of one triangle's map, with their derivatives.
//!
//! The map from the triangle's own plane to the pattern has the matrix F, singular values s1 >= s2 (s2 < 0: turned over).
//! Written in complex numbers it is z -> p z + q conj(z): p is its turn and scale, q what shears it. With P = |p| and
//! Q = |q|: s1 = P + Q, s2 = P - Q, det F = d = P^2 - Q^2. Every energy here is a function of P and Q alone, so its
//! Hessian over (p, q) falls apart into the two directions in which p and q turn and a 2 x 2 block for their lengths:
//! the analytic eigensystem of Smith, De Goes and Kim 2019 in the plane. Negative eigenvalues are set to nought, which
//! makes the Hessian positive semidefinite with the least change.
//!
//! Energies, each nought exactly where the map is rigid:
//! - weighted: a 2 (d - 1)^2 / d + b 4 Q^2 (1 + 1 / d^2). With a = b = 1 it is the symmetric Dirichlet energy
//!   s1^2 + s2^2 + 1 / s1^2 + 1 / s2^2 - 4, split into what changes area and what changes shape (Smith and Schaefer 2015
//!   for the energy). It grows without bound towards a flip.
//! - ARAP: (s1 - 1)^2 + (s2 - 1)^2 = 2 (P - 1)^2 + 2 Q^2 (Liu et al. 2008). It knows no flips: the line search does.
//!
//! - robust: like the weighted one, but of the sizes |d - 1| and |Q| rather than of their squares, softened near nought, so
//!   that means of sizes become least and not those of squares; with a part of the weighted energy against flips.
//!
//! No form subtracts large numbers: near a rigid map the energy keeps its relative accuracy, far below 1e-16.

/// A distortion energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Energy {
    /// Changes of area and of shape with their weights.
    Weighted {
        /// Weight of the area's part.
        area: f64,
        /// Weight of the shape's part.
        shape: f64,
    },
    /// As rigid as possible, with a part of the symmetric Dirichlet energy that keeps triangles from collapsing.
    Arap {
        /// That part.
        barrier: f64,
    },
    /// Mean sizes of changes rather than of their squares.
    Robust {
        /// Weight of the change of area.
        area: f64,
        /// Weight of the change of shape.
        shape: f64,
        /// Changes from which their size counts and no longer their square.
        soft: f64,
        /// Part of the symmetric Dirichlet energy that keeps triangles from collapsing.
        barrier: f64,
    },
}

/// Twice the soft absolute value of x: x^2 near nought, 2 soft |x| far from it; with its first derivative over x and its
/// second.
fn softened(x2: f64, soft: f64) -> [f64; 3] {
    let root = (1.0 + x2 / (soft * soft)).sqrt();
    [2.0 * x2 / (root + 1.0), 2.0 / root, 2.0 / (root * root * root)]
}

/// A map of a triangle: its conformal and its anticonformal part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Jet {
    /// p.
    pub(crate) turn: [f64; 2],
    /// q.
    pub(crate) shear: [f64; 2],
}

/// Gradient over (p, q) and positive semidefinite Hessian (upper and lower half both filled).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Derivatives {
    pub(crate) gradient: [f64; 4],
    pub(crate) hessian: [[f64; 4]; 4],
}

/// Which quadratic stands for the energy around a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Curvature {
    /// Each singular value on a parabola about 1 (the reweighting of SLIM, Rabinovich et al. 2017): collapsed triangles
    /// open in one step where Newton's method would need many, but the last digits come slowly.
    Secant,
    /// The Hessian, of whose negative eigenvalues `clamped` is taken away: all of them at 1, none at 0. At 1 it is always
    /// positive semidefinite; at 0 it is exact, so that the last digits come fast, but good near a least value alone.
    Newton {
        /// Share taken away.
        clamped: f64,
    },
}

/// First and second derivatives by P and Q.
struct Radial {
    /// dE/dP / P: what turning p costs.
    turn: f64,
    /// dE/dQ / Q: what turning q costs.
    shear: f64,
    pp: f64,
    pq: f64,
    qq: f64,
}

/// The weighted energy: E = f(d) + h(d, B) with B = Q^2.
#[inline]
fn dirichlet(area: f64, shape: f64, p: f64, q2: f64, det: f64) -> f64 {
    let off = (p - 1.0) * (p + 1.0) - q2;
    2.0 * area * off * off / det + 4.0 * shape * q2 * (1.0 + 1.0 / (det * det))
}

impl Radial {
    fn plus(&self, other: &Self) -> Self {
        Self {
            turn: self.turn + other.turn,
            shear: self.shear + other.shear,
            pp: self.pp + other.pp,
            pq: self.pq + other.pq,
            qq: self.qq + other.qq,
        }
    }

    /// Of the weighted energy.
    #[inline]
    fn dirichlet(area: f64, shape: f64, p: f64, q: f64, det: f64) -> Self {
        let inverse = 1.0 / det;
        let (inverse2, b) = (inverse * inverse, q * q);
        let off = (p - 1.0) * (p + 1.0) - b;
        // 1 - 1/d^2 without cancellation.
        let slope = 2.0 * area * off * (det + 1.0) * inverse2 - 8.0 * shape * b * inverse2 * inverse;
        let curvature = (4.0 * area + 24.0 * shape * b * inverse) * inverse2 * inverse;
        let by_b = 4.0 * shape * (1.0 + inverse2);
        let mixed = -8.0 * shape * inverse2 * inverse;
        let shear = 2.0 * (by_b - slope);
        Self {
            turn: 2.0 * slope,
            shear,
            pp: 2.0 * slope + 4.0 * p * p * curvature,
            pq: 4.0 * p * q * (mixed - curvature),
            qq: shear + 4.0 * b * (curvature - 2.0 * mixed),
        }
    }
}

impl Jet {
    fn squares(&self) -> (f64, f64) {
        let square = |z: [f64; 2]| z[0] * z[0] + z[1] * z[1];
        (square(self.turn), square(self.shear))
    }

    /// Determinant of the map.
    pub(crate) fn determinant(&self) -> f64 {
        let (p, q) = self.squares();
        p - q
    }

    /// Sum of the squares of the singular values.
    pub(crate) fn norm_squared(&self) -> f64 {
        let (p, q) = self.squares();
        2.0 * (p + q)
    }
}

impl Energy {
    /// Whether sizes count in it rather than squares.
    pub(crate) const fn is_robust(self) -> bool {
        matches!(self, Self::Robust { .. })
    }

    /// The energy of a map; infinite where it turns over or collapses.
    #[inline]
    pub(crate) fn value(self, jet: &Jet) -> f64 {
        let (p2, q2) = jet.squares();
        let p = p2.sqrt();
        let det = p2 - q2;
        if det.is_nan() || det <= 0.0 {
            return f64::INFINITY;
        }
        match self {
            Self::Weighted { area, shape } => dirichlet(area, shape, p, q2, det),
            Self::Arap { barrier } => {
                let rigid = 2.0 * (p - 1.0) * (p - 1.0) + 2.0 * q2;
                if barrier > 0.0 { rigid + dirichlet(barrier, barrier, p, q2, det) } else { rigid }
            }
            Self::Robust { area, shape, soft, barrier } => {
                let off = (p - 1.0) * (p + 1.0) - q2;
                2.0 * area * softened(off * off, soft)[0]
                    + 8.0 * shape * softened(q2, soft)[0]
                    + dirichlet(barrier, barrier, p, q2, det)
            }
        }
    }

    fn radial(self, p: f64, q: f64, det: f64) -> Radial {
        match self {
            Self::Weighted { area, shape } => Radial::dirichlet(area, shape, p, q, det),
            Self::Arap { barrier } => {
                let rigid = Radial { turn: 4.0 * (p - 1.0) / p, shear: 4.0, pp: 4.0, pq: 0.0, qq: 4.0 };
                if barrier > 0.0 { rigid.plus(&Radial::dirichlet(barrier, barrier, p, q, det)) } else { rigid }
            }
            Self::Robust { area, shape, soft, barrier } => {
                let b = q * q;
                let off = (p - 1.0) * (p + 1.0) - b;
                let [_, slope, curvature] = softened(off * off, soft);
                let (slope, curvature) = (2.0 * area * slope * off, 2.0 * area * curvature);
                let [_, first, second] = softened(b, soft);
                let (first, second) = (8.0 * shape * first, 8.0 * shape * second);
                Radial {
                    turn: 2.0 * slope,
                    shear: first - 2.0 * slope,
                    pp: 2.0 * slope + 4.0 * p * p * curvature,
                    pq: -4.0 * p * q * curvature,
                    qq: second - 2.0 * slope + 4.0 * b * curvature,
                }
                .plus(&Radial::dirichlet(barrier, barrier, p, q, det))
            }
        }
    }

    /// The gradient over (p, q) at a map that does not turn over.
    #[inline]
    pub(crate) fn gradient(self, jet: &Jet) -> [f64; 4] {
        let (p2, q2) = jet.squares();
        let radial = self.radial(p2.sqrt(), q2.sqrt(), p2 - q2);
        [radial.turn * jet.turn[0], radial.turn * jet.turn[1], radial.shear * jet.shear[0], radial.shear * jet.shear[1]]
    }

    /// Derivatives of the energy of a map that does not turn over.
    #[inline]
    pub(crate) fn derivatives(self, jet: &Jet, curvature: Curvature) -> Derivatives {
        let (p2, q2) = jet.squares();
        let (p, q) = (p2.sqrt(), q2.sqrt());
        let radial = self.radial(p, q, p2 - q2);
        let gradient = [
            radial.turn * jet.turn[0],
            radial.turn * jet.turn[1],
            radial.shear * jet.shear[0],
            radial.shear * jet.shear[1],
        ];
        let direction = |z: [f64; 2], length: f64| {
            if length > 0.0 { [z[0] / length, z[1] / length] } else { [1.0, 0.0] }
        };
        let (u, w) = (direction(jet.turn, p), direction(jet.shear, q));
        // Curvatures along and across: of p, mixed, of q.
        let (along, across) = match curvature {
            Curvature::Newton { clamped } => {
                let positive = semidefinite(radial.pp, radial.pq, radial.qq);
                let keep = 1.0 - clamped;
                let mix = |full: f64, positive: f64| positive + keep * (full - positive);
                let turning = [radial.turn, radial.shear].map(|full| mix(full, full.max(0.0)));
                let along = [mix(radial.pp, positive[0]), mix(radial.pq, positive[1]), mix(radial.qq, positive[2])];
                (along, [turning[0], 0.0, turning[1]])
            }
            Curvature::Secant if let Self::Robust { area, shape, soft, barrier } = self => {
                // Parabolas that touch the softened sizes from above: stepping to their least never overshoots.
                let off = (p - 1.0) * (p + 1.0) - q2;
                let area = 8.0 * area * softened(off * off, soft)[1] / 2.0;
                let shape = 8.0 * shape * softened(q2, soft)[1];
                let safe = 8.0 * barrier;
                (
                    [area * p2 + safe, -area * p * q, area * q2 + shape + safe],
                    [radial.turn.max(0.0), 0.0, (radial.shear).max(shape) + safe],
                )
            }
            Curvature::Secant => {
                let [a, b] = self.secants(p + q, p - q);
                ([a + b, a - b, a + b], [a + b, b - a, a + b])
            }
        };
        let own = |d: [f64; 2], along: f64, across: f64| {
            let mixed = (along - across) * d[0] * d[1];
            [[along * d[0] * d[0] + across * d[1] * d[1], mixed], [mixed, along * d[1] * d[1] + across * d[0] * d[0]]]
        };
        let (a, b) = (own(u, along[0], across[0]), own(w, along[2], across[2]));
        // Across u is (-u1, u0), across w likewise.
        let (m, n) = (along[1], across[1]);
        let c = [
            [m * u[0] * w[0] + n * u[1] * w[1], m * u[0] * w[1] - n * u[1] * w[0]],
            [m * u[1] * w[0] - n * u[0] * w[1], m * u[1] * w[1] + n * u[0] * w[0]],
        ];
        Derivatives {
            gradient,
            hessian: [
                [a[0][0], a[0][1], c[0][0], c[0][1]],
                [a[1][0], a[1][1], c[1][0], c[1][1]],
                [c[0][0], c[1][0], b[0][0], b[0][1]],
                [c[0][1], c[1][1], b[1][0], b[1][1]],
            ],
        }
    }

    /// For each singular value the curvature of the parabola about 1 that has the energy's slope there.
    fn secants(self, s1: f64, s2: f64) -> [f64; 2] {
        let (rigid, barrier) = match self {
            Self::Weighted { area, shape } => (0.0, area.max(shape)),
            Self::Arap { barrier } => (2.0, barrier),
            Self::Robust { area, shape, barrier, .. } => (4.0 * area.max(shape), barrier),
        };
        [s1, s2].map(|s| rigid + 2.0 * barrier * (s + 1.0) * (s * s + 1.0) / (s * s * s))
    }
}

/// The symmetric matrix [a b; b c] with its negative eigenvalues set to nought.
fn semidefinite(a: f64, b: f64, c: f64) -> [f64; 3] {
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let root = (half * half + b * b).sqrt();
    if mean >= root {
        return [a, b, c];
    }
    let greater = mean + root;
    if greater <= 0.0 {
        return [0.0; 3];
    }
    // The projector onto the greater eigenvalue's direction is (M - lesser) / (greater - lesser).
    let (cos, sin) = (half / root, b / root);
    [0.5 * greater * (1.0 + cos), 0.5 * greater * sin, 0.5 * greater * (1.0 - cos)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const ENERGIES: [Energy; 6] = [
        Energy::Weighted { area: 1.0, shape: 1.0 },
        Energy::Weighted { area: 1.0, shape: 0.01 },
        Energy::Weighted { area: 0.05, shape: 1.0 },
        Energy::Arap { barrier: 0.0 },
        Energy::Arap { barrier: 0.1 },
        Energy::Robust { area: 1.0, shape: 0.3, soft: 0.2, barrier: 0.01 },
    ];

    fn jet(x: [f64; 4]) -> Jet {
        Jet { turn: [x[0], x[1]], shear: [x[2], x[3]] }
    }

    /// A map with the singular values s1 and s2, turned by two angles.
    fn map(s1: f64, s2: f64, alpha: f64, beta: f64) -> [f64; 4] {
        let (p, q) = (0.5 * (s1 + s2), 0.5 * (s1 - s2));
        [p * alpha.cos(), p * alpha.sin(), q * beta.cos(), q * beta.sin()]
    }

    /// The Hessian before projection, from differences of the gradient.
    fn differences(energy: Energy, x: [f64; 4]) -> [[f64; 4]; 4] {
        let step = 1e-6;
        std::array::from_fn(|i| {
            let at = |t: f64| {
                let mut y = x;
                y[i] += t;
                energy.gradient(&jet(y))
            };
            let (a, b) = (at(step), at(-step));
            std::array::from_fn(|j| (a[j] - b[j]) / (2.0 * step))
        })
    }

    #[test]
    fn with_equal_weights_the_energy_is_the_symmetric_dirichlet_energy() {
        for (s1, s2) in [(1.0, 1.0), (2.0, 0.5), (3.0, 2.0), (0.4, 0.1)] {
            let expected: f64 = s1 * s1 + s2 * s2 + 1.0 / (s1 * s1) + 1.0 / (s2 * s2) - 4.0;
            let value = ENERGIES[0].value(&jet(map(s1, s2, 0.3, 1.1)));
            assert!((value - expected).abs() < 1e-12 * (1.0 + expected), "{s1} {s2}");
            let arap = ENERGIES[3].value(&jet(map(s1, s2, 0.3, 1.1)));
            assert!((arap - (s1 - 1.0).powi(2) - (s2 - 1.0).powi(2)).abs() < 1e-13);
        }
    }

    #[test]
    fn energies_of_tiny_strains_keep_their_relative_accuracy() {
        let strain = 1e-7_f64;
        let value = ENERGIES[0].value(&jet([1.0 + strain, 0.0, 0.0, 0.0]));
        // 2 (s - 1/s)^2 with s = 1 + 1e-7.
        let s = 1.0 + strain;
        let expected = 2.0 * ((s - 1.0) * (s + 1.0) / s).powi(2);
        assert!((value / expected - 1.0).abs() < 1e-8);
    }

    #[test]
    fn maps_that_turn_over_have_no_energy() {
        for energy in ENERGIES {
            assert_eq!(energy.value(&jet([0.5, 0.0, 0.5, 0.0])), f64::INFINITY);
            assert_eq!(energy.value(&jet([0.5, 0.0, 0.0, 0.8])), f64::INFINITY);
            assert_eq!(energy.value(&jet([f64::NAN, 0.0, 0.0, 0.0])), f64::INFINITY);
        }
    }

    proptest! {
        #[test]
        fn the_gradient_is_that_of_the_value(s1 in 0.3..3.0, ratio in 0.1..1.0, alpha in 0.0..6.3, beta in 0.0..6.3) {
            let x = map(s1, s1 * ratio, alpha, beta);
            for energy in ENERGIES {
                let gradient = energy.gradient(&jet(x));
                let scale = 1.0 + gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
                for i in 0..4 {
                    let at = |t: f64| { let mut y = x; y[i] += t; energy.value(&jet(y)) };
                    let step = 1e-6 * ratio;
                    let slope = (at(step) - at(-step)) / (2.0 * step);
                    prop_assert!((slope - gradient[i]).abs() < 1e-5 * scale / ratio, "{energy:?} {i}: {slope} {}", gradient[i]);
                }
            }
        }

        #[test]
        fn the_hessian_is_that_of_the_gradient_where_it_is_positive(
            s in 0.97..1.03_f64, t in 0.97..1.03_f64, alpha in 0.0..6.3, beta in 0.0..6.3,
        ) {
            // Where the map enlarges both ways a little, all eigenvalues are positive.
            let x = map(1.05 * s.max(t), 1.05 * s.min(t), alpha, beta);
            for energy in ENERGIES {
                let (found, expected) = (energy.derivatives(&jet(x), Curvature::Newton { clamped: 0.0 }).hessian, differences(energy, x));
                for i in 0..4 {
                    for j in 0..4 {
                        prop_assert!((found[i][j] - expected[i][j]).abs() < 1e-5, "{energy:?} {i} {j}");
                    }
                }
            }
        }

        #[test]
        fn the_projected_hessian_is_positive_and_never_below_the_true_one(
            s1 in 0.3..3.0, ratio in 0.2..1.0, alpha in 0.0..6.3, beta in 0.0..6.3,
            d in [-1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0_f64],
        ) {
            let x = map(s1, s1 * ratio, alpha, beta);
            for energy in ENERGIES {
                let (found, expected) = (energy.derivatives(&jet(x), Curvature::Newton { clamped: 1.0 }).hessian, differences(energy, x));
                let form = |h: &[[f64; 4]; 4]| {
                    (0..4).map(|i| (0..4).map(|j| d[i] * h[i][j] * d[j]).sum::<f64>()).sum::<f64>()
                };
                let scale = 1.0 + found.iter().flatten().fold(0.0_f64, |m, h| m.max(h.abs()));
                prop_assert!(form(&found) >= -1e-10 * scale);
                prop_assert!(form(&found) >= form(&expected) - 1e-5 * scale, "{energy:?}");
            }
        }
    }
}
