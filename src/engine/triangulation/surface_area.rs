//! Area of the surface inside a triangulated domain, by quadrature of |Su x Sv| over the domain's triangles.
//!
//! Each triangle is integrated by the rule of three points (exact for quadratics) and compared with the rule of seven
//! (exact to degree five, [Radon 1948]); where they differ it is quartered, down to a fixed depth: a knot inside a
//! triangle, where the integrand is less smooth, is met that way. Square millimetres; sums run in the triangles' order
//! whatever the number of threads. Limits: the boundary is that of the domain mesh, a polygon, so the trimming curves'
//! own chords in the domain are missing from the area.

use glam::DVec2;
use rayon::prelude::*;

use super::DomainMesh;
use crate::engine::nurbs::Surface;

/// Relative difference of the two rules up to which the better one is taken: its own error is then smaller by the
/// square of a triangle's size, well below what any tolerance of an area asks for.
const AGREEMENT: f64 = 1e-6;

/// How often a triangle may be quartered. Deeper costs four times as much a level where the integrand is not smooth.
const DEPTH: u32 = 6;

/// Triangles that are summed at a time: a fixed number, so that the order of summation is fixed.
const CHUNK: usize = 4096;

/// Area of the surface over the triangles of the domain, mm^2.
#[must_use]
pub fn trimmed_area(surface: &Surface, domain: &DomainMesh) -> f64 {
    let sums: Vec<f64> = domain
        .triangles
        .par_chunks(CHUNK)
        .map(|chunk| chunk.iter().map(|t| over(surface, t.map(|c| domain.uv[c as usize]), DEPTH)).sum())
        .collect();
    sums.iter().sum()
}

/// |Su x Sv| at a place.
fn stretch(surface: &Surface, at: DVec2) -> f64 {
    let (_, su, sv) = surface.first_derivatives(at.x, at.y);
    su.cross(sv).length()
}

/// Area over one triangle of the domain.
fn over(surface: &Surface, t: [DVec2; 3], depth: u32) -> f64 {
    let size = 0.5 * (t[1] - t[0]).perp_dot(t[2] - t[0]).abs();
    let at = |w: [f64; 3]| stretch(surface, w[0] * t[0] + w[1] * t[1] + w[2] * t[2]);
    let around = |near: f64| {
        let far = 0.5 * (1.0 - near);
        at([near, far, far]) + at([far, near, far]) + at([far, far, near])
    };
    let three = around(2.0 / 3.0) / 3.0;
    let seven =
        SEVEN_CENTRE * at([1.0 / 3.0; 3]) + SEVEN_NEAR[1] * around(SEVEN_NEAR[0]) + SEVEN_FAR[1] * around(SEVEN_FAR[0]);
    if depth == 0 || (seven - three).abs() <= AGREEMENT * seven.abs() {
        return size * seven;
    }
    let [a, b, c] = [0.5 * (t[0] + t[1]), 0.5 * (t[1] + t[2]), 0.5 * (t[2] + t[0])];
    [[t[0], a, c], [a, t[1], b], [c, b, t[2]], [a, b, c]].into_iter().map(|q| over(surface, q, depth - 1)).sum()
}

/// Weight of the centroid in Radon's rule of seven points.
const SEVEN_CENTRE: f64 = 0.225;
/// Three points near the corners: weight of the nearest corner, and of each point in the sum.
const SEVEN_NEAR: [f64; 2] = [0.797_426_985_353_087_3, 0.125_939_180_544_827_15];
/// Three points near the middles of the sides.
const SEVEN_FAR: [f64; 2] = [0.059_715_871_789_769_82, 0.132_394_152_788_506_2];

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::engine::nurbs::shapes;
    use crate::engine::triangulation::{Configuration, GridLines, grid_mesh};

    fn area(surface: &Surface, points: usize) -> f64 {
        trimmed_area(
            surface,
            &grid_mesh(&GridLines::uniform(surface.domain(), points, points), Configuration::Regular, 0),
        )
    }

    #[test]
    fn planes_cylinders_spheres_and_tori_have_their_areas_on_coarse_grids() {
        assert!((area(&shapes::plane(3.0, 2.0), 2) - 6.0).abs() < 1e-12);
        for points in [2, 7, 20] {
            for (surface, exact) in [
                (shapes::cylinder(2.0, 5.0), 20.0 * PI),
                (shapes::sphere(3.0), 36.0 * PI),
                (shapes::torus(5.0, 2.0), 40.0 * PI * PI),
            ] {
                let found = area(&surface, points) / exact;
                assert!((found - 1.0).abs() < 1e-6, "{points}: {found}");
            }
        }
    }
}
