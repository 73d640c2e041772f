//! Unit normals, fundamental forms and principal curvatures (thesis 1.4).
//!
//! Curvatures are found in the orthonormal frame of the tangent plane: `e1 = Su / |Su|`, `e2 = n x e1`. There the second
//! form is a symmetric 2 x 2 matrix `[a b; b c]` whose eigenvalues are the principal curvatures; the discriminant
//! `((a - c) / 2)^2 + b^2` is a sum of squares and loses nothing, which the roots of (1.27) do. Directions come from the
//! row of larger norm of `[a - k, b; b, c - k]`, which is the row of `D - k G` in that frame (the thesis prints a
//! direction with a sign error), and are given as unit vectors in (u, v).
//!
//! Signs are those of the normal `Su x Sv`: a cylinder whose normal points outwards has a negative curvature.
//!
//! Limits: at a point where `Su x Sv` vanishes (a pole, a folded corner) the normal is a limit from inside the domain,
//! and curvatures are those of a point a hair inside.

use glam::{DVec2, DVec3};

use super::{Surface, SurfaceDerivatives};

/// `|Su x Sv|` below this part of the net's reach (both directions, per domain length) counts as degenerate. Larger: good
/// points near a pole get the pole's limit instead of their own normal. Smaller: the direction of rounding errors is
/// taken for a normal. At 1e-9 a normal that is kept has at least about seven good digits.
pub(super) const DEGENERATE: f64 = 1e-9;

/// Steps into the domain, as parts of it, at which a normal is looked for when second derivatives do
/// not give one. The first that works is the nearest to the limit.
const NUDGES: [f64; 5] = [1e-6, 1e-4, 1e-3, 1e-2, 1e-1];

/// Principal curvatures whose half difference is below this part of the larger one have no direction.
const UMBILIC: f64 = 1e-9;

/// The two fundamental forms of a point and what follows from them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curvature {
    /// Unit normal.
    pub normal: DVec3,
    /// First form, `Su . Su` (1.22).
    pub e: f64,
    /// First form, `Su . Sv`.
    pub f: f64,
    /// First form, `Sv . Sv`.
    pub g: f64,
    /// Second form, `n . Suu` (1.23).
    pub l: f64,
    /// Second form, `n . Suv`.
    pub m: f64,
    /// Second form, `n . Svv`.
    pub n: f64,
    /// `k1 k2` (1.28), 1/mm^2.
    pub gaussian: f64,
    /// `(k1 + k2) / 2`, 1/mm.
    pub mean: f64,
    /// The lesser principal curvature, signed, 1/mm.
    pub k1: f64,
    /// The greater principal curvature, signed, 1/mm.
    pub k2: f64,
    /// Direction of `k1` in (u, v), unit, up to sign. At an umbilic: the u direction.
    pub d1: DVec2,
    /// Direction of `k2` in (u, v), unit, up to sign. At an umbilic: the direction that is normal to u on the surface.
    pub d2: DVec2,
    /// The principal curvature of smaller magnitude (what "minimum principal curvature" means for strips).
    pub kmag: f64,
    /// Its direction.
    pub dmag: DVec2,
    /// True when the principal curvatures are equal: there is no direction then.
    pub umbilic: bool,
}

impl Curvature {
    /// From derivatives and a unit normal; `None` where `Su` and `Sv` do not span a plane.
    fn from_derivatives(d: &SurfaceDerivatives, normal: DVec3) -> Option<Self> {
        let (e, f, g) = (d.su.dot(d.su), d.su.dot(d.sv), d.sv.dot(d.sv));
        let (l, m, n) = (normal.dot(d.suu), normal.dot(d.suv), normal.dot(d.svv));
        let det_root = d.su.cross(d.sv).length();
        if !(e > 0.0 && det_root > 0.0) {
            return None;
        }
        // In (u, v): e1 = (1, 0) / root_e and e2 = (-f / e, 1) root_e / det_root.
        let root_e = e.sqrt();
        let shear = f / e;
        let rise = root_e / det_root;
        let a = l / e;
        let b = (m - l * shear) / det_root;
        let c = (n - 2.0 * m * shear + l * shear * shear) * rise * rise;
        let mean = 0.5 * (a + c);
        let half_difference = (0.5 * (a - c)).hypot(b);
        let (k1, k2) = (mean - half_difference, mean + half_difference);
        let umbilic = half_difference <= UMBILIC * k1.abs().max(k2.abs());
        let direction = |k: f64| {
            let (first, second) = (DVec2::new(a - k, b), DVec2::new(b, c - k));
            let row = if first.length_squared() >= second.length_squared() { first } else { second };
            let (x, y) = (-row.y, row.x);
            DVec2::new(x / root_e - y * shear * rise, y * rise).normalize_or_zero()
        };
        let (d1, d2) = if umbilic {
            (DVec2::X, DVec2::new(-shear, 1.0).normalize_or_zero())
        } else {
            (direction(k1), direction(k2))
        };
        let (kmag, dmag) = if k1.abs() < k2.abs() { (k1, d1) } else { (k2, d2) };
        let gaussian = a * c - b * b;
        Some(Self { normal, e, f, g, l, m, n, gaussian, mean, k1, k2, d1, d2, kmag, dmag, umbilic })
    }
}

impl Surface {
    /// The unit normal `Su x Sv / |Su x Sv|` (1.21); at a degenerate point its limit from inside the domain. Never NaN:
    /// a surface without any tangent plane gives +z.
    #[must_use]
    pub fn normal(&self, u: f64, v: f64) -> DVec3 {
        let (_, su, sv) = self.first_derivatives(u, v);
        let cross = su.cross(sv);
        if cross.length() > self.degenerate_area() { cross.normalize() } else { self.limit_normal(u, v) }
    }

    /// Fundamental forms and principal curvatures.
    #[must_use]
    pub fn curvature(&self, u: f64, v: f64) -> Curvature {
        let domain = self.domain();
        let at = |u: f64, v: f64| {
            let d = self.derivatives(u, v);
            let cross = d.su.cross(d.sv);
            if cross.length() <= self.degenerate_area() {
                return None;
            }
            Curvature::from_derivatives(&d, cross.normalize())
        };
        std::iter::once(0.0)
            .chain(NUDGES)
            .find_map(|step| {
                let [u, v] = domain.inwards(u, v, step);
                at(u, v)
            })
            .unwrap_or(Curvature { normal: self.normal(u, v), ..Curvature::FLAT })
    }

    /// `|Su x Sv|` up to which a point is degenerate.
    pub(super) fn degenerate_area(&self) -> f64 {
        let domain = self.domain();
        let [ru, rv] = self.reach();
        DEGENERATE * (ru / (domain.u[1] - domain.u[0])) * (rv / (domain.v[1] - domain.v[0]))
    }

    /// The normal at a degenerate point as the limit along a line into the domain: first from second
    /// derivatives, then from points near by.
    pub(super) fn limit_normal(&self, u: f64, v: f64) -> DVec3 {
        let domain = self.domain();
        let least = self.degenerate_area();
        let d = self.derivatives(u, v);
        let [hu, hv] = domain.inwards(u, v, 1.0);
        let (h, k) = (hu - u.clamp(domain.u[0], domain.u[1]), hv - v.clamp(domain.v[0], domain.v[1]));
        // Su and Sv change by these along the step (h, k): the first term of Su x Sv that does not vanish.
        let (su, sv) = (d.suu * h + d.suv * k, d.suv * h + d.svv * k);
        let first_order = su.cross(d.sv) + d.su.cross(sv);
        if first_order.length() > LIMIT_TERM * least / DEGENERATE {
            return first_order.normalize();
        }
        NUDGES
            .iter()
            .find_map(|&step| {
                let [u, v] = domain.inwards(u, v, step);
                let (_, su, sv) = self.first_derivatives(u, v);
                let cross = su.cross(sv);
                // The area element shrinks with the step, at least in proportion.
                (cross.length() > LIMIT_TERM * step * least).then(|| cross.normalize())
            })
            .filter(|n| n.is_finite())
            .unwrap_or(DVec3::Z)
    }
}

/// How small the first-order term of `Su x Sv` may be, as a part of the net's reach, to decide a limit normal. It must
/// stand well above the rounding errors (1e-15) of a pole whose second derivatives vanish too.
const LIMIT_TERM: f64 = 1e-6;

impl Curvature {
    /// What is said of a point without a tangent plane.
    const FLAT: Self = Self {
        normal: DVec3::Z,
        e: 0.0,
        f: 0.0,
        g: 0.0,
        l: 0.0,
        m: 0.0,
        n: 0.0,
        gaussian: 0.0,
        mean: 0.0,
        k1: 0.0,
        k2: 0.0,
        d1: DVec2::X,
        d2: DVec2::Y,
        kmag: 0.0,
        dmag: DVec2::X,
        umbilic: true,
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::nurbs::shapes::{cylinder, knots, plane, sphere, torus};

    #[test]
    fn a_sphere_has_the_curvature_of_its_radius_and_is_umbilic() {
        let s = sphere(2.5);
        for k in 0..50 {
            let (u, v) = (f64::from(k) * 0.08, 0.05 + f64::from(k) * 0.038);
            let c = s.curvature(u, v);
            assert!(c.umbilic);
            assert!((c.k1 + 0.4).abs() < 1e-10 && (c.k2 + 0.4).abs() < 1e-10);
            assert!(c.normal.distance(s.point(u, v) / 2.5) < 1e-12);
        }
    }

    #[test]
    fn a_cylinder_has_its_ruling_as_the_direction_of_smaller_magnitude_whichever_way_its_normal_points() {
        let s = cylinder(3.0, 7.0);
        for s in [s.clone(), s.swapped()] {
            let (u, v) = if s.knots_u().degree() == 2 { (1.3, 0.4) } else { (0.4, 1.3) };
            let c = s.curvature(u, v);
            assert!(c.kmag.abs() < 1e-12 && !c.umbilic);
            assert!((c.k1.abs().max(c.k2.abs()) - 1.0 / 3.0).abs() < 1e-12);
            let ruling = if s.knots_u().degree() == 2 { DVec2::Y } else { DVec2::X };
            assert!(c.dmag.dot(ruling).abs() > 1.0 - 1e-12);
        }
    }

    #[test]
    fn a_torus_has_its_known_curvatures() {
        let (major, minor) = (5.0, 2.0);
        let s = torus(major, minor);
        for k in 0..60 {
            let (u, v) = (f64::from(k) * 0.066, f64::from(k) * 0.061);
            let c = s.curvature(u, v);
            let p = s.point(u, v);
            let outwards = (p.truncate().length() - major) / minor;
            let around = -outwards / (major + minor * outwards);
            assert!((c.k1 + 1.0 / minor).abs() < 1e-10, "{c:?}");
            assert!((c.k2 - around).abs() < 1e-10);
            assert!((c.gaussian + around / minor).abs() < 1e-10);
        }
    }

    #[test]
    fn a_plane_has_no_curvature_and_its_normal() {
        let c = plane(4.0, 3.0).curvature(0.3, 0.9);
        assert_eq!((c.k1, c.k2, c.gaussian, c.umbilic), (0.0, 0.0, 0.0, true));
        assert_eq!(c.normal, DVec3::Z);
    }

    #[test]
    fn normals_at_the_poles_of_a_sphere_point_along_its_axis() {
        for scale in [1e-3, 1.0, 1e5] {
            let s = sphere(scale);
            for k in 0..=16 {
                let u = f64::from(k) * 0.25;
                assert!(s.normal(u, 0.0).distance(-DVec3::Z) < 1e-9, "{}", s.normal(u, 0.0));
                assert!(s.normal(u, 2.0).distance(DVec3::Z) < 1e-9);
                assert!(s.normal(u, 1e-9).distance(-DVec3::Z) < 1e-6);
            }
        }
    }

    #[test]
    fn the_normal_at_the_apex_of_a_cone_is_that_of_its_ruling() {
        let profile = [(DVec2::new(1.0, 0.0), 1.0), (DVec2::new(0.0, 1.0), 1.0)];
        let cone = crate::engine::nurbs::shapes::revolved(knots(1, &[0.0, 0.0, 1.0, 1.0]), &profile);
        for k in 0..=16 {
            let u = f64::from(k) * 0.25;
            assert!(cone.normal(u, 1.0).distance(cone.normal(u, 0.5)) < 1e-9, "at u = {u}");
        }
    }

    #[test]
    fn the_normal_at_a_corner_with_both_edges_in_line_is_the_limit_from_inside() {
        // A disc as one biquadratic patch: at each corner the tangents are parallel.
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let control = vec![
            at(-w, -w),
            at(-2.0 * w, 0.0),
            at(-w, w),
            at(0.0, -2.0 * w),
            at(0.0, 0.0),
            at(0.0, 2.0 * w),
            at(w, -w),
            at(2.0 * w, 0.0),
            at(w, w),
        ];
        let weights = vec![1.0, w, 1.0, w, 1.0, w, 1.0, w, 1.0];
        let line = knots(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        let disc = Surface::new(line.clone(), line, control, Some(weights)).expect("a disc");
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            assert!(disc.normal(u, v).distance(DVec3::Z) < 1e-9);
        }
        assert!((disc.area(1e-9) - std::f64::consts::PI).abs() < 1e-6);
    }
}
