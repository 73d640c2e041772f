//! The field of principal directions in strip coordinates, and a step along it.
//!
//! Strip coordinates (x, t): both in [0, 1] over the domain; t runs along the lines and x across them. Lines that run
//! along v have x = u and t = v; along u they are exchanged. A line is x as a function of t.
//!
//! By `cells` (thesis 6.4, stage 4) the direction is that of the principal curvature of smaller *magnitude* (greater, for
//! the other family) at the point where a cell is entered. By `runge-kutta` a line stays with its own family: of the two
//! principal directions the one nearer, in the surface's metric, to the direction before it is taken, with that one's
//! sense, so that the field neither turns round nor jumps where the magnitudes change places.
//!
//! At an umbilic there is no direction: `cells` goes straight along t there, `runge-kutta` on as before.

use glam::DVec2;

use super::options::Integration;
use crate::engine::nurbs::{Curvature, Domain, Surface};

/// A direction whose part along t is less than this share of it does not lead on to the next row: the step across would
/// be ten thousand cells. Smaller only delays the same verdict.
const ALONG: f64 = 1e-4;

/// The family of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Family {
    /// The principal curvature of smaller magnitude.
    Minimum,
    /// That of greater magnitude.
    Maximum,
}

/// Which coordinate lines run along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Along {
    /// From the first u to the last: strips are ranges of v.
    U,
    /// From the first v to the last: strips are ranges of u.
    V,
}

impl Along {
    /// The other coordinate.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::U => Self::V,
            Self::V => Self::U,
        }
    }
}

/// The directions of one family over a surface.
pub(super) struct Field<'a> {
    surface: &'a Surface,
    domain: Domain,
    pub along: Along,
    family: Family,
    integration: Integration,
    flat: f64,
}

impl<'a> Field<'a> {
    pub(super) fn new(surface: &'a Surface, along: Along, family: Family, integration: Integration) -> Self {
        Self { surface, domain: surface.domain(), along, family, integration, flat: flat(surface) }
    }

    /// (u, v) of a place in strip coordinates; 0 and 1 give the domain's ends bit for bit.
    pub(super) fn uv(&self, p: DVec2) -> DVec2 {
        let q = if self.along == Along::V { p } else { DVec2::new(p.y, p.x) };
        DVec2::new(between(self.domain.u, q.x), between(self.domain.v, q.y))
    }

    /// The direction to begin with at a place; straight along t at an umbilic.
    pub(super) fn start(&self, p: DVec2) -> DVec2 {
        self.principal(&self.curvature(p)).unwrap_or(DVec2::Y)
    }

    /// From `p`, where the line came with the direction `before`, to the place `h` further along t (back, when negative):
    /// x there, and the direction to go on with. `None` where the line does not lead there.
    pub(super) fn step(&self, p: DVec2, before: DVec2, h: f64) -> Option<(f64, DVec2)> {
        match self.integration {
            Integration::Cells => {
                let d = self.start(p);
                Some((p.x + h * slope(d)?, d))
            }
            Integration::RungeKutta => {
                let first = self.follow(p, before);
                let k1 = slope(first)?;
                let second = self.follow(p + 0.5 * h * DVec2::new(k1, 1.0), first);
                let k2 = slope(second)?;
                let third = self.follow(p + 0.5 * h * DVec2::new(k2, 1.0), second);
                let k3 = slope(third)?;
                let last = self.follow(p + h * DVec2::new(k3, 1.0), third);
                let k4 = slope(last)?;
                Some((p.x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4), last))
            }
        }
    }

    /// Curvature at a place; outside of the domain that of the nearest place on its border.
    fn curvature(&self, p: DVec2) -> Curvature {
        let uv = self.uv(p.clamp(DVec2::ZERO, DVec2::ONE));
        self.surface.curvature(uv.x, uv.y)
    }

    /// The direction of the family by magnitude.
    fn principal(&self, c: &Curvature) -> Option<DVec2> {
        if has_none(c, self.flat) {
            return None;
        }
        let least_is_first = c.k1.abs() < c.k2.abs();
        let direction = if least_is_first == (self.family == Family::Minimum) { c.d1 } else { c.d2 };
        Some(self.strip(direction))
    }

    /// The principal direction that goes on from `before`.
    fn follow(&self, p: DVec2, before: DVec2) -> DVec2 {
        let c = self.curvature(p);
        if has_none(&c, self.flat) {
            return before;
        }
        let metric = self.parameter(before);
        let cosine = |d: DVec2| {
            let product = c.e * metric.x * d.x + c.f * (metric.x * d.y + metric.y * d.x) + c.g * metric.y * d.y;
            product / (c.e * d.x * d.x + 2.0 * c.f * d.x * d.y + c.g * d.y * d.y).sqrt()
        };
        let (first, second) = (cosine(c.d1), cosine(c.d2));
        let (d, with) = if first.abs() >= second.abs() { (c.d1, first) } else { (c.d2, second) };
        self.strip(if with < 0.0 { -d } else { d })
    }

    /// A direction of (u, v) in strip coordinates, of length one.
    fn strip(&self, d: DVec2) -> DVec2 {
        let q = d / DVec2::new(width(self.domain.u), width(self.domain.v));
        let q = q.normalize_or(DVec2::Y);
        if self.along == Along::V { q } else { DVec2::new(q.y, q.x) }
    }

    /// A direction of strip coordinates in (u, v).
    fn parameter(&self, d: DVec2) -> DVec2 {
        let q = if self.along == Along::V { d } else { DVec2::new(d.y, d.x) };
        q * DVec2::new(width(self.domain.u), width(self.domain.v))
    }
}

/// Principal curvatures that differ by less than this part of the greater have no direction that could be told from rounding:
/// near a pole a sphere's differ by 1e-5. More would lose directions near true umbilics, less follows noise.
const UMBILIC: f64 = 1e-4;

/// The same where they differ by less than this over the size of the surface: it bends by less than rounding then.
const FLAT: f64 = 1e-9;

/// The difference of principal curvatures below which a surface is flat, 1/mm.
fn flat(surface: &Surface) -> f64 {
    let [low, high] = surface.bounding_box();
    FLAT / low.distance(high).max(f64::MIN_POSITIVE)
}

/// Whether a point has no principal directions.
fn has_none(c: &Curvature, flat: f64) -> bool {
    c.umbilic || c.k2 - c.k1 <= (UMBILIC * c.k1.abs().max(c.k2.abs())).max(flat)
}

/// dx/dt of a direction, which may point either way.
fn slope(d: DVec2) -> Option<f64> {
    (d.y.abs() > ALONG * d.length()).then(|| d.x / d.y)
}

fn width([first, last]: [f64; 2]) -> f64 {
    last - first
}

/// The ends bit for bit, and in between as the lines of a uniform grid are placed.
fn between([first, last]: [f64; 2], share: f64) -> f64 {
    if share >= 1.0 { last } else { first + (last - first) * share }
}

/// How many points of the grid have their direction of minimum curvature rather along u and rather along v (stage 2).
pub(super) fn votes(surface: &Surface, us: &[f64], vs: &[f64]) -> [u64; 2] {
    let (domain, flat) = (surface.domain(), flat(surface));
    let mut votes = [0; 2];
    for &v in vs {
        for &u in us {
            let c = surface.curvature(u, v);
            let d = (c.dmag / DVec2::new(width(domain.u), width(domain.v))).abs();
            // Within rounding of the diagonal neither is recorded.
            if has_none(&c, flat) || (d.x - d.y).abs() <= EQUAL * d.x.max(d.y) {
                continue;
            }
            votes[usize::from(d.x < d.y)] += 1;
        }
    }
    votes
}

/// The thesis's zero tolerance for directions that lean neither way: well above rounding, well below what is seen.
const EQUAL: f64 = 1e-9;
