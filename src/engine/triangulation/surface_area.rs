//! Area of the surface inside a triangulated domain, by quadrature of |Su x Sv| over the domain's triangles.
//!
//! Each triangle is integrated by the rule of three points (exact for quadratics) and by the rule of seven (exact to
//! degree five, [Radon 1948]); the triangles whose two answers differ by more than a fixed share of the whole area are
//! quartered, level by level: a knot inside a triangle, where the integrand is less smooth, is met that way. Square
//! millimetres; sums run in the triangles' order whatever the number of threads. Limits: the boundary is that of the
//! domain mesh, a polygon, so the trimming curves' own chords in the domain are missing from the area.

use glam::DVec2;
use rayon::prelude::*;

use super::DomainMesh;
use crate::engine::budget::{Observer, Unobserved};
use crate::engine::error::EngineError;
use crate::engine::nurbs::Surface;

/// Difference of the two rules, as a share of the whole area, up to which the better one is taken. Its own error is then
/// smaller still by the square of a triangle's size; a thousandth of what any tolerance of an area asks for.
const AGREEMENT: f64 = 1e-8;

/// The same for the rough area: the rule of three points is then off by about a hundredth of the difference.
const ROUGH_AGREEMENT: f64 = 1e-6;

/// How often a triangle may be quartered. Each level costs what is still rough; where the integrand jumps an error is
/// divided by four.
const LEVELS: u32 = 7;

/// Triangles that one level may have: it bounds the work on nets of hundreds of knot spans under a coarse mesh. When
/// there are more, those of the largest differences are taken.
const MOST_IN_A_LEVEL: usize = 1 << 16;

/// Triangles that are integrated at a time by one thread.
const CHUNK: usize = 1024;

type Corners = [DVec2; 3];

/// Area of the surface over the triangles of the domain, mm^2.
#[must_use]
pub fn trimmed_area(surface: &Surface, domain: &DomainMesh) -> f64 {
    integral(surface, domain, over, AGREEMENT, &Unobserved)
}

/// The same to some five digits, in less than half of the time: by the rules of one point and of three.
#[must_use]
pub fn rough_trimmed_area(surface: &Surface, domain: &DomainMesh) -> f64 {
    integral(surface, domain, roughly_over, ROUGH_AGREEMENT, &Unobserved)
}

/// The same, and it stops within a chunk of triangles when it is no longer wanted.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub fn observed_area(surface: &Surface, domain: &DomainMesh, observer: &dyn Observer) -> Result<f64, EngineError> {
    let area = integral(surface, domain, over, AGREEMENT, observer);
    observer.check()?;
    Ok(area)
}

/// The integral; of less than the whole domain when the observer cancels.
fn integral(
    surface: &Surface,
    domain: &DomainMesh,
    rules: impl Fn(&Surface, Corners) -> [f64; 2] + Sync,
    agreement: f64,
    observer: &dyn Observer,
) -> f64 {
    let mut level: Vec<Corners> = domain.triangles.iter().map(|t| t.map(|c| domain.uv[c as usize])).collect();
    let (mut area, mut allowed) = (0.0, None);
    for depth in 0..=LEVELS {
        // Once it is cancelled, what is left of the level has no triangles to go through.
        let wanted = |chunk: &[Corners]| if observer.is_cancelled() { 0 } else { chunk.len() };
        let found: Vec<[f64; 2]> = level
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| chunk[..wanted(chunk)].iter().map(|&t| rules(surface, t)))
            .collect();
        if observer.is_cancelled() {
            break;
        }
        let whole = *allowed.get_or_insert_with(|| agreement * found.iter().map(|[_, better]| better).sum::<f64>());
        let least = if depth == LEVELS { f64::INFINITY } else { refined_from(&found, whole) };
        let mut next = Vec::new();
        for (t, [simple, better]) in level.iter().zip(&found) {
            if (better - simple).abs() > least {
                next.extend(quarters(*t));
            } else {
                area += better;
            }
        }
        if next.is_empty() {
            break;
        }
        level = next;
    }
    area
}

/// The difference above which a triangle is quartered: what is allowed, or more when too many are beyond that.
fn refined_from(found: &[[f64; 2]], allowed: f64) -> f64 {
    let mut beyond: Vec<f64> =
        found.iter().map(|[simple, better]| (better - simple).abs()).filter(|d| *d > allowed).collect();
    let most = MOST_IN_A_LEVEL / 4;
    if beyond.len() <= most {
        return allowed;
    }
    *beyond.select_nth_unstable_by(most, |a, b| b.total_cmp(a)).1
}

fn quarters(t: Corners) -> [Corners; 4] {
    let [a, b, c] = [0.5 * (t[0] + t[1]), 0.5 * (t[1] + t[2]), 0.5 * (t[2] + t[0])];
    [[t[0], a, c], [a, t[1], b], [c, b, t[2]], [a, b, c]]
}

/// |Su x Sv| at a place.
fn stretch(surface: &Surface, at: DVec2) -> f64 {
    let (_, su, sv) = surface.first_derivatives(at.x, at.y);
    su.cross(sv).length()
}

/// Area over one triangle of the domain by three points and by seven.
fn over(surface: &Surface, t: Corners) -> [f64; 2] {
    let size = 0.5 * (t[1] - t[0]).perp_dot(t[2] - t[0]).abs();
    let at = |w: [f64; 3]| stretch(surface, w[0] * t[0] + w[1] * t[1] + w[2] * t[2]);
    let around = |near: f64| {
        let far = 0.5 * (1.0 - near);
        at([near, far, far]) + at([far, near, far]) + at([far, far, near])
    };
    let three = around(2.0 / 3.0) / 3.0;
    let seven =
        SEVEN_CENTRE * at([1.0 / 3.0; 3]) + SEVEN_NEAR[1] * around(SEVEN_NEAR[0]) + SEVEN_FAR[1] * around(SEVEN_FAR[0]);
    [size * three, size * seven]
}

/// The same by one point and by three.
fn roughly_over(surface: &Surface, t: Corners) -> [f64; 2] {
    let size = 0.5 * (t[1] - t[0]).perp_dot(t[2] - t[0]).abs();
    let at = |w: [f64; 3]| stretch(surface, w[0] * t[0] + w[1] * t[1] + w[2] * t[2]);
    let [near, far] = [2.0 / 3.0, 1.0 / 6.0];
    let three = (at([near, far, far]) + at([far, near, far]) + at([far, far, near])) / 3.0;
    [size * at([1.0 / 3.0; 3]), size * three]
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
    fn the_rough_area_has_five_digits() {
        for surface in [shapes::sphere(10.0), shapes::cylinder(3.0, 20.0)] {
            let domain = grid_mesh(&GridLines::uniform(surface.domain(), 17, 17), Configuration::Regular, 0);
            let (rough, fine) = (rough_trimmed_area(&surface, &domain), trimmed_area(&surface, &domain));
            assert!((rough / fine - 1.0).abs() < 1e-5, "{rough} {fine}");
        }
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
