//! A window of the domain as a grid of panels that lie side by side in the plane.
//!
//! Panels end at the knots, so that the surface is smooth on each, and are halved, whole columns or rows at a time, until
//! their series are long enough. Each is then turned and moved onto its neighbour by the best rigid fit of the edge that
//! they share; along the middle row first, then up and down. Where the surface is developable the fit is exact on every
//! shared edge; where panels are but their joint is not (a fold along a curve, a corner with an angle defect) a gap is
//! left, which is measured.

use glam::DVec2;

use super::panel::{Developer, Panel};
use super::strain::strain_of;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::nurbs::{Domain, FirstDerivatives, KnotVector, Surface};

/// The most panels of a window. Each takes some ten thousand multiplications and up to 4 kB.
const MOST_PANELS: usize = 1 << 14;

/// How often columns or rows may be halved: a surface that needs more has a cusp or a fold in its parametrisation.
const DEEPEST: u32 = 10;

/// Strain up to which a panel is fine enough whatever its series look like: near what rounding leaves.
const FINE: f64 = 3e-11;

/// A knot nearer to the window's end than this part of its width makes no panel of its own: the series of the neighbour
/// runs on over it.
const SLIVER: f64 = 1e-9;

/// A span narrower than this part of the mean one is no panel of its own either where the surface has [`SMOOTH`] continuous
/// derivatives: rounding of its derivatives, which grows as spans shrink, would do more harm than the jump in the third
/// derivative, which shrinks with their cube.
const NARROW: f64 = 4e-3;

/// Continuous derivatives that allow it.
const SMOOTH: usize = 2;

/// Points of a shared edge that are fitted.
const FITTED: usize = 9;

/// A shared edge that is shorter than this part of its panel cannot say how the neighbour is turned.
const SHORT: f64 = 1e-7;

/// Panels side by side.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sheet {
    /// Borders of the columns and rows.
    lines: [Vec<f64>; 2],
    /// Panel `(i, j)` at `j * columns + i`.
    panels: Vec<Panel>,
    /// Greatest strain at the probes.
    pub(super) strain: f64,
    /// Greatest distance between two images of a point of a shared edge, mm.
    pub(super) gap: f64,
}

impl Sheet {
    /// The flat window. `None` where its strain exceeds the tolerance, or its panels cannot be made or joined.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`].
    pub(super) fn new(
        surface: &Surface,
        window: Domain,
        size: f64,
        tolerance: f64,
        observer: &dyn Observer,
    ) -> Result<Option<Self>, EngineError> {
        let mut lines = [breaks(window.u, surface.knots_u()), breaks(window.v, surface.knots_v())];
        let mut developer = Developer::new(surface, size);
        let mut samples = FirstDerivatives::default();
        for depth in 0..=DEEPEST {
            let [columns, rows] = [lines[0].len() - 1, lines[1].len() - 1];
            if columns * rows > MOST_PANELS {
                return Ok(None);
            }
            let mut sheet = Self { lines: lines.clone(), panels: Vec::new(), strain: 0.0, gap: 0.0 };
            let mut halved = [vec![false; columns], vec![false; rows]];
            for k in 0..columns * rows {
                observer.check()?;
                let [i, j] = [k % columns, k / columns];
                let domain = Domain { u: [lines[0][i], lines[0][i + 1]], v: [lines[1][j], lines[1][j + 1]] };
                let Some(developed) = developer.develop(domain) else { return Ok(None) };
                let strain = strain_of(surface, &developed.panel, &mut samples);
                let resolved = developed.resolved == [true; 2] || depth == DEEPEST;
                if resolved && strain > tolerance {
                    return Ok(None);
                }
                if strain > FINE && depth < DEEPEST {
                    halved[0][i] |= !developed.resolved[0];
                    halved[1][j] |= !developed.resolved[1];
                }
                sheet.strain = sheet.strain.max(strain);
                sheet.panels.push(developed.panel);
            }
            if halved.iter().flatten().all(|h| !h) {
                return Ok(sheet.joined().then_some(sheet));
            }
            lines = [0, 1].map(|d| finer(&lines[d], &halved[d]));
        }
        Ok(None)
    }

    fn columns(&self) -> usize {
        self.lines[0].len() - 1
    }

    /// The panel that a point lies in, or the nearest.
    fn panel(&self, uv: DVec2) -> &Panel {
        let place = |lines: &[f64], t: f64| lines[1..lines.len() - 1].partition_point(|&x| x <= t);
        &self.panels[place(&self.lines[1], uv.y) * self.columns() + place(&self.lines[0], uv.x)]
    }

    /// Where a point comes to lie.
    pub(super) fn at(&self, uv: DVec2) -> DVec2 {
        self.panel(uv).at(uv)
    }

    /// The map's derivatives along u and v.
    pub(super) fn jacobian(&self, uv: DVec2) -> [DVec2; 2] {
        self.panel(uv).jacobian(uv)
    }

    /// How many panels there are.
    pub(super) fn panel_count(&self) -> usize {
        self.panels.len()
    }

    /// Lays the panels side by side and measures the gaps. False where an edge is too short to tell how.
    fn joined(&mut self) -> bool {
        let [columns, rows] = [self.columns(), self.lines[1].len() - 1];
        let (ci, cj) = (columns / 2, rows / 2);
        let along_row = (ci + 1..columns).map(|i| (i - 1, i)).chain((0..ci).rev().map(|i| (i + 1, i)));
        let across: Vec<_> = along_row.map(|(from, to)| (cj * columns + from, cj * columns + to)).collect();
        let steps = (cj + 1..rows).map(|j| (j - 1, j)).chain((0..cj).rev().map(|j| (j + 1, j)));
        let up: Vec<_> =
            steps.flat_map(|(from, to)| (0..columns).map(move |i| (from * columns + i, to * columns + i))).collect();
        for (from, to) in across.into_iter().chain(up) {
            if !self.lay(from, to) {
                return false;
            }
        }
        for k in 0..self.panels.len() {
            let right = (k % columns + 1 < columns).then_some(k + 1);
            let above = (k + columns < self.panels.len()).then_some(k + columns);
            for other in [right, above].into_iter().flatten() {
                for uv in self.edge(k, other) {
                    self.gap = self.gap.max(self.panels[k].at(uv).distance(self.panels[other].at(uv)));
                }
            }
        }
        self.gap.is_finite()
    }

    /// Points of the edge that two neighbours share.
    fn edge(&self, a: usize, b: usize) -> [DVec2; FITTED] {
        let (a, b) = (self.panels[a].domain, self.panels[b].domain);
        let low = DVec2::new(a.u[0].max(b.u[0]), a.v[0].max(b.v[0]));
        let high = DVec2::new(a.u[1].min(b.u[1]), a.v[1].min(b.v[1]));
        std::array::from_fn(|k| low.lerp(high, k as f64 / (FITTED - 1) as f64))
    }

    /// Turns and moves the panel `to` onto `from` along their edge.
    fn lay(&mut self, from: usize, to: usize) -> bool {
        let edge = self.edge(from, to);
        let (there, own) = (edge.map(|uv| self.panels[from].at(uv)), edge.map(|uv| self.panels[to].own(uv)));
        let mean = |points: &[DVec2; FITTED]| points.iter().sum::<DVec2>() / FITTED as f64;
        let (middle, own_middle) = (mean(&there), mean(&own));
        let mut sum = DVec2::ZERO;
        let mut spread = 0.0;
        for (p, q) in there.iter().zip(&own) {
            let (p, q) = (*p - middle, *q - own_middle);
            sum += DVec2::new(q.dot(p), q.perp_dot(p));
            spread += q.length_squared();
        }
        let size = self.panels[to].size();
        let Some(turn) = sum.try_normalize().filter(|_| spread.sqrt() > SHORT * size) else { return false };
        self.panels[to].turn = turn;
        self.panels[to].origin = middle - turn.rotate(own_middle);
        true
    }
}

/// The ends of a window with the knots between them at which panels end.
fn breaks([a, b]: [f64; 2], knots: &KnotVector) -> Vec<f64> {
    let inner: Vec<f64> = knots.breaks().into_iter().filter(|&k| k > a && k < b).collect();
    let least = SLIVER * (b - a);
    let narrow = NARROW * (b - a) / (inner.len() + 1) as f64;
    let mut out = vec![a];
    let mut last = a;
    for k in inner {
        let smooth = knots.multiplicity(k) + SMOOTH <= knots.degree();
        if k - last > if smooth { narrow } else { least } && b - k > least {
            out.push(k);
            last = k;
        }
    }
    out.push(b);
    out
}

/// The lines with a new one in the middle of each interval that is to be halved.
fn finer(lines: &[f64], halved: &[bool]) -> Vec<f64> {
    let mut out = Vec::with_capacity(2 * lines.len());
    for (k, &line) in lines.iter().enumerate() {
        out.push(line);
        if halved.get(k) == Some(&true) {
            out.push(0.5 * line + 0.5 * lines[k + 1]);
        }
    }
    out
}
