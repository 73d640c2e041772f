//! How badly a triangle is off, and in what way.
//!
//! Strains are those that users read: percent, positive where the material is stretched when it is laid on the part.

use serde::{Deserialize, Serialize};

use crate::engine::distortion::TriangleStrain;
use crate::engine::mesh::{Mesh, Topology, measures};

/// What is the matter with the material in a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HotSpotKind {
    /// Stretched in one direction.
    Stretched,
    /// Gathered in one direction.
    Gathered,
    /// Stretched in one direction and gathered across it by about as much.
    Sheared,
    /// Stretched, or gathered, in all directions by about as much.
    Area,
}

/// The lesser of two principal strains is "about as much" as the greater from this part of it on.
const AS_MUCH: f64 = 0.5;

impl HotSpotKind {
    /// Of a triangle's least and greatest principal strain, percent.
    pub(super) fn of([least, greatest]: [f64; 2]) -> Self {
        let (low, high) = (least.abs().min(greatest.abs()), least.abs().max(greatest.abs()));
        let comparable = low >= AS_MUCH * high;
        match (comparable, least < 0.0, greatest > 0.0) {
            (true, true, true) => Self::Sheared,
            (true, ..) => Self::Area,
            _ if greatest.abs() >= least.abs() => Self::Stretched,
            _ => Self::Gathered,
        }
    }

    /// The strain that this kind is told by, percent: the principal one of greater magnitude with its sign, the tangent of
    /// the shear angle, the relative change of area.
    pub(super) fn strain_of(self, strain: TriangleStrain) -> f64 {
        let [least, greatest] = strain.percent();
        match self {
            Self::Stretched => greatest,
            Self::Gathered => least,
            Self::Sheared => 100.0 * strain.shear_deg().to_radians().tan(),
            Self::Area => 100.0 * (1.0 / (strain.s1 * strain.s2) - 1.0),
        }
    }
}

/// Each triangle's principal strains `[least, greatest]` in percent, averaged by area with those of the triangles around
/// its corners: what a single triangle's shape adds goes, what the surface does stays. Zero where there is nothing.
pub(super) fn averaged(mesh: &Mesh, topology: &Topology, strains: &[Option<TriangleStrain>]) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 3]; mesh.positions.len()];
    let corners = |t: usize| topology.triangles()[t].map(|v| v as usize);
    for (t, strain) in strains.iter().enumerate() {
        let Some(strain) = strain else { continue };
        let area = measures::area(measures::corners(mesh, t as u32));
        let [least, greatest] = strain.percent();
        for v in corners(t) {
            for (sum, x) in sums[v].iter_mut().zip([area * least, area * greatest, area]) {
                *sum += x;
            }
        }
    }
    let at = |t: usize| {
        let mut total = [0.0; 3];
        for v in corners(t) {
            for (sum, x) in total.iter_mut().zip(sums[v]) {
                *sum += x;
            }
        }
        if total[2] > 0.0 { [total[0] / total[2], total[1] / total[2]] } else { [0.0; 2] }
    };
    (0..strains.len()).map(|t| if strains[t].is_some() { at(t) } else { [0.0; 2] }).collect()
}

/// The greater magnitude of two principal strains.
pub(super) fn severity([least, greatest]: [f64; 2]) -> f64 {
    least.abs().max(greatest.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kind_follows_the_two_principal_strains() {
        use HotSpotKind::{Area, Gathered, Sheared, Stretched};
        let cases = [
            ([0.0, 3.0], Stretched),
            ([-1.0, 3.0], Stretched),
            ([1.0, 3.0], Stretched),
            ([-3.0, 0.0], Gathered),
            ([-3.0, -1.0], Gathered),
            ([-3.0, 2.0], Sheared),
            ([-2.0, 3.0], Sheared),
            ([2.0, 3.0], Area),
            ([-3.0, -2.0], Area),
        ];
        for (strains, kind) in cases {
            assert_eq!(HotSpotKind::of(strains), kind, "{strains:?}");
        }
    }

    #[test]
    fn the_strain_of_a_kind_has_the_sign_that_users_read() {
        // The pattern is 4 % smaller in one direction and 1 % larger in the other.
        let strain = TriangleStrain { s1: 1.01, s2: 0.96 };
        assert!((HotSpotKind::Stretched.strain_of(strain) - 100.0 * (1.0 / 0.96 - 1.0)).abs() < 1e-12);
        assert!(HotSpotKind::Gathered.strain_of(strain) < 0.0);
        assert!((HotSpotKind::Area.strain_of(strain) - 100.0 * (1.0 / (1.01 * 0.96) - 1.0)).abs() < 1e-12);
        // tan(2 atan x) = 2 x / (1 - x^2) with x = (s1 - s2) / (s1 + s2).
        let x = 0.05 / 1.97;
        assert!((HotSpotKind::Sheared.strain_of(strain) - 200.0 * x / (1.0 - x * x)).abs() < 1e-10);
    }
}
