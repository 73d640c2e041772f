//! What kind of developable surface a window shows, from its rulings.
//!
//! At samples the direction of vanishing curvature gives a line in space. All lines parallel: a cylinder. All through one
//! point (least squares of the distances): a cone. Else the general kind: a tangent developable, or pieces of several
//! kinds side by side.

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::engine::nurbs::{Domain, Surface};

/// The kind of a developable surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DevelopableKind {
    /// Curved nowhere.
    Plane,
    /// All rulings are parallel.
    Cylinder,
    /// All rulings meet in one point.
    Cone,
    /// A tangent developable, or several kinds side by side.
    General,
}

impl DevelopableKind {
    /// The kind's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Cylinder => "cylinder",
            Self::Cone => "cone",
            Self::General => "general",
        }
    }
}

/// Samples in each direction.
const SAMPLES: usize = 12;

/// A greatest curvature times the part's size below this is flat: an arc that rises by a billionth of its length.
const FLAT: f64 = 1e-8;

/// A ruling counts where the curvature across it is at least this part of the greatest: its direction is
/// rounding elsewhere.
const CURVED: f64 = 1e-3;

/// Rulings within this angle of each other are parallel, and lines that pass a point at this part of the part's size (or
/// of their distance from the point) meet in it.
const MEET: f64 = 1e-6;

/// The kind of a window that is known to be developable; `size` is its extent in space, mm.
pub(super) fn kind_of(surface: &Surface, window: Domain, size: f64) -> DevelopableKind {
    let at = |[a, b]: [f64; 2], k: usize| a + (b - a) * (k as f64 + 0.5) / SAMPLES as f64;
    let places = (0..SAMPLES * SAMPLES).map(|k| DVec2::new(at(window.u, k % SAMPLES), at(window.v, k / SAMPLES)));
    let lines: Vec<(f64, DVec3, DVec3)> = places
        .filter_map(|uv| {
            let (p, su, sv) = surface.first_derivatives(uv.x, uv.y);
            let c = surface.curvature(uv.x, uv.y);
            let direction = (su * c.dmag.x + sv * c.dmag.y).try_normalize()?;
            Some((c.k1.abs().max(c.k2.abs()), p, direction))
        })
        .collect();
    let greatest = lines.iter().map(|l| l.0).fold(0.0, f64::max);
    if greatest * size <= FLAT {
        return DevelopableKind::Plane;
    }
    let rulings: Vec<(DVec3, DVec3)> =
        lines.into_iter().filter(|l| l.0 >= CURVED * greatest).map(|(_, p, d)| (p, d)).collect();
    let Some(&(_, first)) = rulings.first() else { return DevelopableKind::General };
    if rulings.iter().all(|(_, d)| d.cross(first).length() <= MEET) {
        return DevelopableKind::Cylinder;
    }
    // The point nearest to all lines: the sum of (I - d d^T) (x - p) vanishes.
    let (mut matrix, mut side) = (DMat3::ZERO, DVec3::ZERO);
    for &(p, d) in &rulings {
        let across = DMat3::IDENTITY - DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        matrix += across;
        side += across * p;
    }
    let apex = matrix.inverse() * side;
    let meets = |&(p, d): &(DVec3, DVec3)| {
        let to = apex - p;
        to.cross(d).length() <= MEET * size.max(to.length())
    };
    if apex.is_finite() && rulings.iter().all(meets) { DevelopableKind::Cone } else { DevelopableKind::General }
}
