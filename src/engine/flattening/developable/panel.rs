//! One panel of the domain in the plane: the flat map of a rectangle on which the surface is smooth.
//!
//! With the frame `e1 = Su / |Su|`, `e2 = n x e1` of the tangent plane a map to the plane keeps all lengths when the
//! direction of `e1` there turns by the connection form: `dphi = e2 . de1`, so
//! `phi_u = n . (Su x Suu) / E` and `phi_v = n . (Su x Suv) / E` (do Carmo, Differential Geometry of Curves and Surfaces,
//! 4-4). The form is closed where the Gaussian curvature vanishes, and only there. Then
//! `F_u = sqrt(E) c`, `F_v = (F / sqrt(E)) c + (|Su x Sv| / sqrt(E)) c'` with `c = (cos phi, sin phi)` and `c'` a quarter
//! turn on. Both integrals run over Chebyshev nodes: along the middle line, then from there to each node. No ruling is
//! looked for, so it does not matter how rulings cross the parameter lines.

use glam::DVec2;

use super::chebyshev::{Line, ORDER, Rule, START, derivatives, polynomials};
use crate::engine::nurbs::{Domain, Surface, SurfaceDerivatives};

/// A coefficient below this part of the greatest in its direction is rounding and is left out. Smaller: rounding is kept and
/// differentiation amplifies it; larger: curves are cut off.
const ROUNDING: f64 = 2e-15;

/// The last two coefficients in a direction are below this part of the greatest when the panel is fine enough.
const RESOLVED: f64 = 2e-14;

/// What rounding leaves in a coefficient when the surface is evaluated, as a part of the part's size.
const EVALUATED: f64 = 5e-17;

/// `|Su|` below this part of its greatest value in the panel has no direction.
const VANISHING: f64 = 1e-9;

/// The flat map of a rectangle as a Chebyshev series, in coordinates of its own.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Panel {
    /// The rectangle.
    pub(super) domain: Domain,
    /// Coefficients in use along u and v.
    count: [usize; 2],
    /// Coefficient of `T_a(x) T_b(y)` at `b * count[0] + a`.
    coefficients: Vec<DVec2>,
    /// Unit vector that the own x axis is turned to in the common plane.
    pub(super) turn: DVec2,
    /// Where the own origin comes to lie.
    pub(super) origin: DVec2,
}

/// What comes of developing a rectangle.
pub(super) struct Developed {
    /// The panel.
    pub(super) panel: Panel,
    /// Whether the series is long enough along u and along v.
    pub(super) resolved: [bool; 2],
}

/// Buffers to develop panels with.
pub(super) struct Developer<'a> {
    surface: &'a Surface,
    rule: Rule,
    samples: Vec<SurfaceDerivatives>,
    /// What rounding leaves in a coefficient, mm.
    rounding: f64,
}

impl<'a> Developer<'a> {
    /// For panels of a part of the given size, mm.
    pub(super) fn new(surface: &'a Surface, size: f64) -> Self {
        Self { surface, rule: Rule::new(), samples: Vec::new(), rounding: EVALUATED * size }
    }

    /// The map of a rectangle. `None` where the surface has no tangent plane at a node.
    pub(super) fn develop(&mut self, domain: Domain) -> Option<Developed> {
        let half = [0.5 * (domain.u[1] - domain.u[0]), 0.5 * (domain.v[1] - domain.v[0])];
        let at = |[a, b]: [f64; 2], x: f64| 0.5 * (a + b) + 0.5 * (b - a) * x;
        let us = self.rule.nodes.map(|x| at(domain.u, x));
        let vs = self.rule.nodes.map(|x| at(domain.v, x));
        self.surface.grid_derivatives(&us, &vs, &mut self.samples);
        let reach = self.samples.iter().map(|d| d.su.length()).fold(0.0, f64::max);
        let mut turning = [[[0.0; ORDER]; ORDER]; 2];
        let mut frame = [[[0.0; ORDER]; ORDER]; 3];
        for (k, d) in self.samples.iter().enumerate() {
            let (j, i) = (k / ORDER, k % ORDER);
            let (along, cross) = (d.su.length(), d.su.cross(d.sv));
            let normal = cross.try_normalize()?;
            if along <= VANISHING * reach {
                return None;
            }
            let first = along * along;
            turning[0][j][i] = half[0] * normal.dot(d.su.cross(d.suu)) / first;
            turning[1][j][i] = half[1] * normal.dot(d.su.cross(d.suv)) / first;
            frame[0][j][i] = half[0] * along;
            frame[1][j][i] = half[1] * d.su.dot(d.sv) / along;
            frame[2][j][i] = half[1] * cross.length() / along;
        }
        // The longer way first: what is added along the shorter one is then small, and exact relative to its own size.
        let extent = |f: &[Line; ORDER]| f.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
        let first = if extent(&frame[0]) >= extent(&frame[2]) { Way::AlongU } else { Way::AlongV };
        let angle = self.integrated(&turning, first).values();
        let mut steps = [[[[0.0; ORDER]; ORDER]; 2]; 2];
        for j in 0..ORDER {
            for i in 0..ORDER {
                let (sin, cos) = angle[j][i].sin_cos();
                let [along, shear, height] = [frame[0][j][i], frame[1][j][i], frame[2][j][i]];
                steps[0][0][j][i] = along * cos;
                steps[0][1][j][i] = shear * cos - height * sin;
                steps[1][0][j][i] = along * sin;
                steps[1][1][j][i] = shear * sin + height * cos;
            }
        }
        let [x, y] = steps.map(|s| self.coefficients(&self.integrated(&s, first)));
        Some(packed(domain, &x, &y, self.rounding))
    }

    /// The function that vanishes at node ([`START`], [`START`]) and has the derivatives `[along u, along v]` at the nodes
    /// `[j][i]`.
    fn integrated(&self, [of_u, of_v]: &[[Line; ORDER]; 2], first: Way) -> Integrated {
        let dot = |a: &Line, b: &Line| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let integral = &self.rule.integral;
        match first {
            Way::AlongU => {
                let line = std::array::from_fn(|i| dot(&integral[i], &of_u[START]));
                let rest = std::array::from_fn(|j| {
                    let mut row = [0.0; ORDER];
                    for (w, values) in integral[j].iter().zip(of_v) {
                        for (sum, f) in row.iter_mut().zip(values) {
                            *sum += w * f;
                        }
                    }
                    row
                });
                Integrated { first, line, rest }
            }
            Way::AlongV => {
                let column: Line = std::array::from_fn(|j| of_v[j][START]);
                let line = std::array::from_fn(|j| dot(&integral[j], &column));
                let rest = std::array::from_fn(|j| std::array::from_fn(|i| dot(&integral[i], &of_u[j])));
                Integrated { first, line, rest }
            }
        }
    }

    /// Coefficients `[b][a]` of `T_a(x) T_b(y)`.
    fn coefficients(&self, of: &Integrated) -> [Line; ORDER] {
        let mut across = [[0.0; ORDER]; ORDER];
        for (row, line) in self.rule.transform.iter().zip(&mut across) {
            for (w, values) in row.iter().zip(&of.rest) {
                for (sum, f) in line.iter_mut().zip(values) {
                    *sum += w * f;
                }
            }
        }
        let along = |line: Line| -> Line {
            std::array::from_fn(|k| self.rule.transform[k].iter().zip(&line).map(|(w, f)| w * f).sum())
        };
        let mut out = across.map(along);
        for (k, c) in along(of.line).into_iter().enumerate() {
            match of.first {
                Way::AlongU => out[0][k] += c,
                Way::AlongV => out[k][0] += c,
            }
        }
        out
    }
}

/// The parameter that integrals run along first, through the middle.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    AlongU,
    AlongV,
}

/// An integral over the nodes in two parts: along the middle line, and from there to each node.
struct Integrated {
    first: Way,
    line: Line,
    rest: [Line; ORDER],
}

impl Integrated {
    /// The sum of both at the nodes `[j][i]`.
    fn values(&self) -> [Line; ORDER] {
        std::array::from_fn(|j| {
            std::array::from_fn(|i| {
                self.rest[j][i]
                    + match self.first {
                        Way::AlongU => self.line[i],
                        Way::AlongV => self.line[j],
                    }
            })
        })
    }
}

/// The panel of coefficients, without those that are rounding.
fn packed(domain: Domain, x: &[Line; ORDER], y: &[Line; ORDER], rounding: f64) -> Developed {
    let magnitude = |b: usize, a: usize| x[b][a].abs().max(y[b][a].abs());
    let columns: Line = std::array::from_fn(|a| (0..ORDER).map(|b| magnitude(b, a)).fold(0.0, f64::max));
    let rows: Line = std::array::from_fn(|b| (0..ORDER).map(|a| magnitude(b, a)).fold(0.0, f64::max));
    // Each direction has a scale of its own: a panel may be a million times as long as it is wide.
    let scale = |line: &Line| line[1..].iter().copied().fold(0.0, f64::max);
    let used = |line: &Line| {
        line.iter().rposition(|&c| c > ROUNDING * scale(line) + rounding).map_or(1, |last| last + 1).max(2)
    };
    let count = [used(&columns), used(&rows)];
    let tail = |line: &Line| line[ORDER - 2].max(line[ORDER - 1]) <= RESOLVED * scale(line) + 4.0 * rounding;
    let coefficients = (0..count[1]).flat_map(|b| (0..count[0]).map(move |a| DVec2::new(x[b][a], y[b][a]))).collect();
    let panel = Panel { domain, count, coefficients, turn: DVec2::X, origin: DVec2::ZERO };
    Developed { panel, resolved: [tail(&columns), tail(&rows)] }
}

impl Panel {
    /// Place of a parameter in [-1, 1].
    fn local(&self, uv: DVec2) -> DVec2 {
        let place = |[a, b]: [f64; 2], t: f64| (2.0 * t - a - b) / (b - a);
        DVec2::new(place(self.domain.u, uv.x), place(self.domain.v, uv.y))
    }

    /// The sum of coefficients times functions of x times functions of y.
    fn sum(&self, of_x: &Line, of_y: &Line) -> DVec2 {
        self.coefficients
            .chunks_exact(self.count[0])
            .zip(of_y)
            .map(|(row, y)| row.iter().zip(of_x).fold(DVec2::ZERO, |sum, (c, x)| sum + *c * *x) * *y)
            .fold(DVec2::ZERO, |sum, row| sum + row)
    }

    /// Where a point comes to lie in the panel's own coordinates.
    pub(super) fn own(&self, uv: DVec2) -> DVec2 {
        let at = self.local(uv);
        self.sum(&polynomials(at.x), &polynomials(at.y))
    }

    /// Where a point comes to lie in the common plane.
    pub(super) fn at(&self, uv: DVec2) -> DVec2 {
        self.turn.rotate(self.own(uv)) + self.origin
    }

    /// A length that the panel does not exceed by much: the sum of its coefficients but the constant one.
    pub(super) fn size(&self) -> f64 {
        self.coefficients[1..].iter().map(|c| c.length()).sum()
    }

    /// Derivatives along u and v in the common plane.
    pub(super) fn jacobian(&self, uv: DVec2) -> [DVec2; 2] {
        let at = self.local(uv);
        let (x, y) = (polynomials(at.x), polynomials(at.y));
        let du = self.sum(&derivatives(at.x), &y) * (2.0 / (self.domain.u[1] - self.domain.u[0]));
        let dv = self.sum(&x, &derivatives(at.y)) * (2.0 / (self.domain.v[1] - self.domain.v[0]));
        [du, dv].map(|d| self.turn.rotate(d))
    }
}
