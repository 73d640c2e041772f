//! Surfaces and meshes that lie flat without any strain, laid flat from their own geometry.
//!
//! [`unroll`] takes a surface: it judges by Gaussian curvature whether a window of the domain can be developable, develops
//! it panel by panel ([`panel`]), joins the panels ([`sheet`]), measures the strain on the surface ([`strain`]), and gives
//! the map (u, v) to the plane: cheap, and exact for mesh vertices, trimming curves and everything else. Planes,
//! cylinders, cones, tangent developables and what is put together of them are treated alike; rulings need not be
//! parameter lines; folds along rulings are kept. A closed cylinder or cone is cut at its seam, the ends of the domain.
//!
//! [`unfold()`] takes a mesh whose angle defects vanish and lays it flat triangle by triangle.
//!
//! Units: lengths mm; strains are parts, not percent. Triangles and (u, v) keep their orientation.
//!
//! Limits: a window on whose inside `|Su x Sv|` vanishes (a pole that is not at its border, a fold of the
//! parametrisation) and a fold along a curve that is no ruling are not unrolled. Overlaps in the plane are not looked for.

mod chebyshev;
mod kind;
mod panel;
mod sheet;
mod strain;
#[cfg(test)]
mod tests;
mod unfold;

use glam::DVec2;

pub use self::kind::DevelopableKind;
use self::sheet::Sheet;
pub use self::unfold::{UNFOLDED_STRAIN, Unfolded, unfold};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::nurbs::{Domain, Surface, SurfaceDerivatives};

/// Strain up to which a surface counts as developable, on which every sample of it is. Smaller: parts whose control points
/// were rounded in a file are flattened on a mesh, which costs more than this at any density that is used. Larger: the
/// least distortion would be lower than that of the map from here by an amount that matters.
pub const DEVELOPABLE_STRAIN: f64 = 1e-6;

/// The absolute total curvature of a window, rad, above which it is not looked at further. A window with strains up to
/// [`DEVELOPABLE_STRAIN`] stays far below.
const CURVED: f64 = 0.02;

/// Samples of curvature in each direction, at most.
const MOST_SAMPLES: usize = 96;

/// The window is larger than what was asked for by this part of its width, where the domain allows: curves lie outside
/// of the polyline that stands for them by the height of its chords.
const MARGIN: f64 = 0.01;

/// A surface in the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Unrolled {
    window: Domain,
    sheet: Sheet,
    kind: DevelopableKind,
}

impl Unrolled {
    /// Where a point of the domain comes to lie, mm. Points outside of the window are moved to its border.
    #[must_use]
    pub fn map(&self, uv: DVec2) -> DVec2 {
        self.sheet.at(self.inside(uv))
    }

    /// The map's derivatives along u and v.
    #[must_use]
    pub fn jacobian(&self, uv: DVec2) -> [DVec2; 2] {
        self.sheet.jacobian(self.inside(uv))
    }

    /// The greatest `|s - 1|` of the map's singular values `s` at the samples, measured on the surface.
    #[must_use]
    pub fn strain(&self) -> f64 {
        self.sheet.strain
    }

    /// The kind of the surface.
    #[must_use]
    pub fn kind(&self) -> DevelopableKind {
        self.kind
    }

    /// How many panels the map is made of.
    #[must_use]
    pub fn panels(&self) -> usize {
        self.sheet.panel_count()
    }

    fn inside(&self, uv: DVec2) -> DVec2 {
        let Domain { u, v } = self.window;
        DVec2::new(uv.x.clamp(u[0], u[1]), uv.y.clamp(v[0], v[1]))
    }
}

/// The part of a surface over `window` in the plane, where it is developable: its strain at all samples is at most
/// `tolerance` (usually [`DEVELOPABLE_STRAIN`]), and so is every gap relative to its size. `None` elsewhere.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub fn unroll(
    surface: &Surface,
    window: Domain,
    tolerance: f64,
    observer: &dyn Observer,
) -> Result<Option<Unrolled>, EngineError> {
    let window = widened(window, surface.domain());
    let positive = |[a, b]: [f64; 2]| a.is_finite() && b.is_finite() && a < b;
    if !(positive(window.u) && positive(window.v)) {
        return Ok(None);
    }
    let Some(size) = size_if_flat(surface, window) else { return Ok(None) };
    let Some(sheet) = Sheet::new(surface, window, size, tolerance, observer)? else { return Ok(None) };
    if sheet.gap > tolerance * size {
        return Ok(None);
    }
    Ok(Some(Unrolled { window, sheet, kind: kind::kind_of(surface, window, size) }))
}

/// The window with its margin, inside the domain.
fn widened(window: Domain, domain: Domain) -> Domain {
    let wider = |[a, b]: [f64; 2], [first, last]: [f64; 2]| {
        let margin = MARGIN * (b - a);
        [(a - margin).max(first), (b + margin).min(last)]
    };
    Domain { u: wider(window.u, domain.u), v: wider(window.v, domain.v) }
}

/// The window's extent in space, mm, unless its samples show so much Gaussian curvature that it cannot be developable.
fn size_if_flat(surface: &Surface, window: Domain) -> Option<f64> {
    let lines = |[a, b]: [f64; 2], spans: usize| -> Vec<f64> {
        let count = (3 * spans + 5).min(MOST_SAMPLES);
        (0..count).map(|k| a + (b - a) * (k as f64 + 0.5) / count as f64).collect()
    };
    let us = lines(window.u, surface.knots_u().breaks().len());
    let vs = lines(window.v, surface.knots_v().breaks().len());
    let mut samples: Vec<SurfaceDerivatives> = Vec::new();
    surface.grid_derivatives(&us, &vs, &mut samples);
    let cell = (window.u[1] - window.u[0]) / us.len() as f64 * ((window.v[1] - window.v[0]) / vs.len() as f64);
    let mut total = 0.0;
    for d in &samples {
        let cross = d.su.cross(d.sv);
        let Some(n) = cross.try_normalize() else { continue };
        let (l, m, n) = (n.dot(d.suu), n.dot(d.suv), n.dot(d.svv));
        total += (l * n - m * m).abs() / cross.length() * cell;
    }
    let low = samples.iter().map(|d| d.s).reduce(glam::DVec3::min)?;
    let high = samples.iter().map(|d| d.s).reduce(glam::DVec3::max)?;
    let size = low.distance(high);
    (size > 0.0 && total <= CURVED).then_some(size)
}
