//! How a pattern is to lie: the options, and the motion that brings a flattening there.
//!
//! A flattening shows the side that `Su x Sv` points to. It is mirrored when one is to look at the other side: when the
//! show side is reversed or the back is asked for, but not when both are. Then it is turned so that a direction of the
//! surface at the part's area centroid, mapped through the triangle there, points at an angle.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::engine::error::EngineError;
use crate::engine::nurbs::Surface;
use crate::engine::trimming::Side;

/// The side one looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// The show side.
    #[default]
    Show,
    /// The back: the mirror image.
    Back,
}

/// Which direction of the surface is turned to `to_deg`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Align {
    /// The surface's u direction at the part's area centroid; on a mesh, which has none, the x axis of space.
    #[default]
    U,
    /// Its v direction there; on a mesh the y axis.
    V,
    /// A direction in the domain.
    Uv([f64; 2]),
    /// A direction in space.
    Xyz([f64; 3]),
}

/// The `placement` object of a job.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Placement {
    /// The side.
    pub view: View,
    /// The direction.
    pub align: Align,
    /// Where that direction points in the pattern, degrees anticlockwise from +x.
    pub to_deg: f64,
}

/// Whether the pattern shows the flattening mirrored: one looks at the side that it does not show.
#[must_use]
pub fn mirrored(side: Side, placement: &Placement) -> bool {
    (side == Side::Reversed) != (placement.view == View::Back)
}

/// Where a pattern lies with respect to the flattening it is drawn from: each piece of the mesh is mirrored or not (all
/// alike), turned, and moved. A mesh of one piece has one such motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Transform {
    /// True when x, y becomes x, -y before turning.
    pub mirrored: bool,
    /// The motion of each piece of the mesh.
    pub motions: Vec<Motion>,
    /// For each vertex of the mesh the index of its motion; empty when there is one only.
    pub(super) motion_of: Vec<u32>,
}

/// What is settled already of how a piece lies, by points that are to lie at given places.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Hold {
    /// Nothing: it is turned as the placement says and laid beside the others.
    #[default]
    Free,
    /// One point: the piece is turned as the placement says, and moved.
    Point {
        /// The point in the flattening, mm.
        flat: DVec2,
        /// Where it is to lie in the pattern, mm.
        to: DVec2,
    },
    /// All of it.
    Motion(Motion),
}

/// A rotation followed by a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Cosine and sine of the rotation.
    pub rotation: DVec2,
    /// Where the flattening's own origin comes to lie, mm.
    pub origin: DVec2,
}

impl Default for Motion {
    fn default() -> Self {
        Self { rotation: DVec2::X, origin: DVec2::ZERO }
    }
}

impl Transform {
    /// Where a point of the flattening of a piece comes to lie in the pattern.
    #[must_use]
    pub fn point(&self, p: DVec2, piece: usize) -> DVec2 {
        let p = Self::seen(self.mirrored, p);
        let motion = self.motions.get(piece).copied().unwrap_or_default();
        // Adding zero turns -0 into 0, which text files should not show.
        motion.rotation.rotate(p) + motion.origin + DVec2::ZERO
    }

    /// Where a point lies in the pattern before the piece is moved: mirrored where the pattern is.
    #[must_use]
    pub fn seen(mirrored: bool, p: DVec2) -> DVec2 {
        if mirrored { DVec2::new(p.x, -p.y) } else { p }
    }

    /// The whole flattening as it lies in the pattern, vertex by vertex. NaN stays NaN.
    #[must_use]
    pub fn apply(&self, flat: &[DVec2]) -> Vec<DVec2> {
        let piece = |k: usize| self.motion_of.get(k).map_or(0, |&m| m as usize);
        flat.iter().enumerate().map(|(k, &p)| self.point(p, piece(k))).collect()
    }
}

/// Cosine and sine of an angle in degrees, exact at multiples of 90.
fn unit_at(degrees: f64) -> DVec2 {
    match degrees.rem_euclid(360.0) {
        0.0 => DVec2::X,
        90.0 => DVec2::Y,
        180.0 => DVec2::NEG_X,
        270.0 => DVec2::NEG_Y,
        d => DVec2::from_angle(d.to_radians()),
    }
}

/// A direction whose part in the tangent plane is less than this of its length is refused: what is left is rounding or chance.
pub(super) const IN_PLANE: f64 = 1e-3;

/// How far into the domain a place is moved that has no tangent plane.
const OFF_POLE: f64 = 1e-3;

impl Align {
    /// The direction in the domain at a place of the surface.
    ///
    /// # Errors
    /// [`EngineError::Parameter`] when the direction is zero, not finite, or normal to the surface there.
    pub(super) fn direction(self, surface: &Surface, at: DVec2) -> Result<DVec2, EngineError> {
        let refuse = |detail: &str| EngineError::Parameter { name: "placement.align".into(), detail: detail.into() };
        match self {
            Self::U => Ok(DVec2::X),
            Self::V => Ok(DVec2::Y),
            Self::Uv(d) => DVec2::from_array(d)
                .try_normalize()
                .ok_or_else(|| refuse("the direction in (u, v) must have a length; [1, 0] is along u")),
            Self::Xyz(d) => {
                let d = DVec3::from_array(d)
                    .try_normalize()
                    .ok_or_else(|| refuse("the direction in space must have a length; [1, 0, 0] is along x"))?;
                let (_, mut su, mut sv) = surface.first_derivatives(at.x, at.y);
                let mut area = su.cross(sv).length_squared();
                if area == 0.0 {
                    let [u, v] = surface.domain().inwards(at.x, at.y, OFF_POLE);
                    (_, su, sv) = surface.first_derivatives(u, v);
                    area = su.cross(sv).length_squared();
                }
                // Least squares: the (du, dv) whose step on the surface is nearest to d.
                let (e, f, g) = (su.dot(su), su.dot(sv), sv.dot(sv));
                let (x, y) = (su.dot(d), sv.dot(d));
                let step = DVec2::new(g * x - f * y, e * y - f * x) / area;
                if !step.is_finite() || (su * step.x + sv * step.y).length() < IN_PLANE {
                    return Err(refuse(
                        "the direction is normal to the surface at the part's middle; one along the surface is needed",
                    ));
                }
                Ok(step)
            }
        }
    }
}

impl Placement {
    /// The rotation that turns `direction` (in the flattening, mirrored already when the pattern is) to `to_deg`.
    pub(super) fn rotation(&self, direction: DVec2) -> DVec2 {
        let Some(d) = direction.try_normalize() else { return unit_at(self.to_deg) };
        DVec2::new(d.x, -d.y).rotate(unit_at(self.to_deg)).try_normalize().unwrap_or(DVec2::X)
    }
}
