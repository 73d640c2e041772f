//! How far the flat map is from an isometry, measured on the surface itself.
//!
//! At points between the nodes the derivative of the map as it is evaluated (series, turned) is held against the
//! surface's own: in the orthonormal frame of the tangent plane the map has singular values `s1 >= s2`, and the strain is
//! the greatest `|s - 1|`. Nothing here knows how the map was made.

use glam::{DVec2, DVec3};

use super::panel::Panel;
use crate::engine::nurbs::{FirstDerivatives, Surface};

/// Places in [-1, 1] at which a panel is measured in each direction: the middle, the flanks, and almost the border, where
/// a series is worst.
const PROBES: [f64; 7] = [-0.9999, -0.73, -0.38, 0.01, 0.37, 0.74, 0.9999];

/// A point where `|Su x Sv|` is below this part of its greatest in the panel is next to a pole or an edge of regression.
/// Rounding, which is the same in millimetres everywhere, would be all that is measured there.
const DEGENERATE: f64 = 1e-3;

/// The greatest strain at the probes of a panel.
pub(super) fn strain_of(surface: &Surface, panel: &Panel, samples: &mut FirstDerivatives) -> f64 {
    let at = |[a, b]: [f64; 2], x: f64| 0.5 * (a + b) + 0.5 * (b - a) * x;
    let us = PROBES.map(|x| at(panel.domain.u, x));
    let vs = PROBES.map(|x| at(panel.domain.v, x));
    surface.grid_first_derivatives(&us, &vs, samples);
    let areas = samples.su.iter().zip(&samples.sv).map(|(su, sv)| su.cross(*sv).length());
    let least = DEGENERATE * areas.fold(0.0, f64::max);
    let mut worst = 0.0_f64;
    for (k, (&su, &sv)) in samples.su.iter().zip(&samples.sv).enumerate() {
        if su.cross(sv).length() <= least {
            continue;
        }
        let uv = DVec2::new(us[k % PROBES.len()], vs[k / PROBES.len()]);
        let strain = strain(su, sv, panel.jacobian(uv));
        // A strain that is not a number is none that may be overlooked.
        worst = worst.max(if strain.is_nan() { f64::INFINITY } else { strain });
    }
    worst
}

/// The greatest `|s - 1|` of the map that takes `su` and `sv` to `flat`.
pub(super) fn strain(su: DVec3, sv: DVec3, [fu, fv]: [DVec2; 2]) -> f64 {
    let along = su.length();
    let shear = sv.dot(su) / along;
    let height = su.cross(sv).length() / along;
    let first = fu / along;
    let second = (fv - first * shear) / height;
    let (sum, difference) =
        ((first.x + second.y).hypot(first.y - second.x), (first.x - second.y).hypot(second.x + first.y));
    let (greater, lesser) = (0.5 * (sum + difference), 0.5 * (sum - difference));
    (greater - 1.0).abs().max((lesser - 1.0).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strain_is_that_of_the_stretch_and_a_turn_strains_nothing() {
        let (su, sv) = (DVec3::new(2.0, 0.0, 1.0), DVec3::new(0.3, 1.5, 0.0));
        let along = su.length();
        let shear = sv.dot(su) / along;
        let height = su.cross(sv).length() / along;
        let turn = DVec2::from_angle(0.7);
        let flat = |stretch: f64| [DVec2::new(along, 0.0), DVec2::new(shear, height * stretch)].map(|d| turn.rotate(d));
        assert!(strain(su, sv, flat(1.0)) < 1e-15);
        assert!((strain(su, sv, flat(1.25)) - 0.25).abs() < 1e-15);
        assert!((strain(su, sv, flat(0.9)) - 0.1).abs() < 1e-15);
        // Turned over is no isometry of the oriented plane.
        assert!(strain(su, sv, [DVec2::new(along, 0.0), DVec2::new(shear, -height)]) > 1.0);
    }
}
