//! Principal strains and shear of each triangle.
//!
//! The map of a triangle from space to the plane is linear; its matrix in an orthonormal frame of the triangle has the
//! singular values `s1 >= s2 >= 0`: an arc of length 1 on the part has a length between `s2` and `s1` in the pattern.
//! A user reads the opposite direction: `strain_percent = 100 (1 / s - 1)`, positive where the material is stretched when
//! it is laid on the part. So the least principal strain comes from `s1`, the greatest from `s2`.
//!
//! The shear angle is the change of the right angle between the two directions that lie at 45 degrees to the principal
//! ones, the greatest change of any right angle: `2 atan((s1 - s2) / (s1 + s2))`, the same in both directions.

use glam::{DVec2, DVec3};

use crate::engine::mesh::{Mesh, measures};

/// Singular values below this count as this: a triangle that lies flat on a line has a strain of 1e8 percent and not
/// one that no format can write.
const LEAST_STRETCH: f64 = 1e-6;

/// Distortion of one triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleStrain {
    /// Greater singular value of the map from space to the plane.
    pub s1: f64,
    /// Lesser one.
    pub s2: f64,
}

impl TriangleStrain {
    /// Of a triangle in space and in the plane. `None` where either is not a number or the first has no area.
    #[must_use]
    pub fn new(space: [DVec3; 3], plane: [DVec2; 3]) -> Option<Self> {
        let (e1, e2) = (space[1] - space[0], space[2] - space[0]);
        let (f1, f2) = (plane[1] - plane[0], plane[2] - plane[0]);
        // In the frame along e1 the triangle has the corners (0, 0), (x1, 0), (x2, y2).
        let x1 = e1.length();
        let (x2, y2) = (e2.dot(e1) / x1, e1.cross(e2).length() / x1);
        let first = f1 / x1;
        let second = (f2 - first * x2) / y2;
        let [a, c] = first.to_array();
        let [b, d] = second.to_array();
        // s1 + s2 and s1 - s2 (up to sign) without a square root of a difference.
        let (p, q) = ((a + d).hypot(c - b), (a - d).hypot(b + c));
        let (s1, s2) = (0.5 * (p + q), 0.5 * (p - q).abs());
        s1.is_finite().then_some(Self { s1: s1.max(LEAST_STRETCH), s2: s2.max(LEAST_STRETCH) })
    }

    /// Least and greatest principal strain, percent.
    #[must_use]
    pub fn percent(self) -> [f64; 2] {
        [100.0 * (1.0 / self.s1 - 1.0), 100.0 * (1.0 / self.s2 - 1.0)]
    }

    /// Shear angle, degrees, in [0, 90).
    #[must_use]
    pub fn shear_deg(self) -> f64 {
        (2.0 * ((self.s1 - self.s2) / (self.s1 + self.s2)).atan()).to_degrees()
    }

    /// `s1^2 + s2^2 + 1/s1^2 + 1/s2^2`, at least 4.
    #[must_use]
    pub fn symmetric_dirichlet(self) -> f64 {
        let (p, q) = (self.s1 * self.s1, self.s2 * self.s2);
        p + q + 1.0 / p + 1.0 / q
    }
}

/// The distortion of each triangle; `None` for those that a partial flattening did not get to.
#[must_use]
pub fn strains(mesh: &Mesh, flat: &[DVec2]) -> Vec<Option<TriangleStrain>> {
    (0..mesh.triangles.len() as u32)
        .map(|t| {
            let plane = mesh.triangles[t as usize].map(|v| flat[v as usize]);
            TriangleStrain::new(measures::corners(mesh, t), plane)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPACE: [DVec3; 3] = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(3.0, 2.0, 0.0), DVec3::new(0.5, 4.0, 0.0)];

    fn mapped(f: impl Fn(DVec2) -> DVec2) -> TriangleStrain {
        TriangleStrain::new(SPACE, SPACE.map(|p| f(p.truncate()))).unwrap()
    }

    #[test]
    fn a_rigid_motion_strains_nothing() {
        let turn = DVec2::from_angle(1.1);
        let strain = mapped(|p| turn.rotate(p) + DVec2::new(5.0, -7.0));
        assert!(strain.percent().iter().all(|s| s.abs() < 1e-12));
        assert!((strain.symmetric_dirichlet() - 4.0).abs() < 1e-13);
        assert!(strain.shear_deg() < 1e-12);
    }

    #[test]
    fn a_pattern_that_is_too_small_is_stretched_onto_the_part() {
        // Half as wide and as high as the part: each length doubles when it is laid on.
        let strain = mapped(|p| p * 0.5);
        assert!(strain.percent().iter().all(|s| (s - 100.0).abs() < 1e-11));
        // A quarter larger in one direction only: gathered there, by a fifth.
        let [least, greatest] = mapped(|p| DVec2::new(p.x * 1.25, p.y)).percent();
        assert!((least + 20.0).abs() < 1e-12 && greatest.abs() < 1e-12);
    }

    #[test]
    fn simple_shear_has_its_known_principal_stretches_and_angle() {
        let gamma = 0.3_f64;
        let strain = mapped(|p| DVec2::new(p.x + gamma * p.y, p.y));
        let s1 = 0.5 * gamma + (1.0 + 0.25 * gamma * gamma).sqrt();
        assert!((strain.s1 - s1).abs() < 1e-13 && (strain.s2 - 1.0 / s1).abs() < 1e-13);
        // The diagonals of the principal square have lengths s1 and s2 along the axes.
        let expected = 90.0 - 2.0 * (strain.s2 / strain.s1).atan().to_degrees();
        assert!((strain.shear_deg() - expected).abs() < 1e-11);
    }

    #[test]
    fn a_collapsed_triangle_has_large_but_finite_strains() {
        let strain = mapped(|_| DVec2::ONE);
        assert!(strain.percent().iter().all(|s| s.is_finite()));
        assert!(strain.symmetric_dirichlet().is_finite() && strain.shear_deg().is_finite());
    }

    #[test]
    fn what_is_nowhere_has_no_strain() {
        assert_eq!(TriangleStrain::new(SPACE, [DVec2::NAN; 3]), None);
        assert_eq!(TriangleStrain::new([DVec3::ZERO; 3], [DVec2::ZERO; 3]), None);
    }
}
