//! How far a mesh is from its surface: sampled on the triangles, measured to the nearest point of the surface.
//!
//! Seven points a triangle: the middles of its edges, its centroid and three points between centroid and corners. A
//! sample's place in the domain is the combination of its corners'; the surface's point there is close to the foot
//! of the perpendicular but not it, so what counts is the part of the difference along the normal; samples that could
//! raise the maximum are followed to their foot by Gauss and Newton's step. Distances are millimetres. Limits: a sampled
//! maximum is a lower bound of the true one; for triangles over which the surface is nearly quadratic it is within
//! some percent.

use glam::DVec3;
use rayon::prelude::*;

use super::Lifted;
use crate::engine::budget::{Observer, Unobserved};
use crate::engine::error::EngineError;
use crate::engine::nurbs::Surface;

/// The samples, as weights of the corners.
const SAMPLES: [[f64; 3]; 7] = [
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [0.6, 0.2, 0.2],
    [0.2, 0.6, 0.2],
    [0.2, 0.2, 0.6],
];

/// Steps towards the foot point. The start is within the square of a triangle's size of it, and each step squares that.
const STEPS: usize = 3;

/// Triangles that are worked on at a time. The result does not depend on it but through rounding of nothing: a maximum is
/// a maximum in any order.
const CHUNK: usize = 2048;

/// The greatest sampled distance between the mesh and the surface, millimetres. Zero for an empty mesh.
#[must_use]
pub fn sampled_chord_error(surface: &Surface, lifted: &Lifted) -> f64 {
    greatest_distance(surface, lifted, &Unobserved)
}

/// The same, and it stops within a chunk of triangles when it is no longer wanted.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub fn observed_chord_error(surface: &Surface, lifted: &Lifted, observer: &dyn Observer) -> Result<f64, EngineError> {
    let greatest = greatest_distance(surface, lifted, observer);
    observer.check()?;
    Ok(greatest)
}

/// The greatest sampled distance; of less than the whole mesh when the observer cancels.
fn greatest_distance(surface: &Surface, lifted: &Lifted, observer: &dyn Observer) -> f64 {
    let chunks = lifted.domain.triangles.par_chunks(CHUNK).enumerate();
    chunks
        .map(|(chunk, triangles)| {
            let mut greatest = 0.0_f64;
            if observer.is_cancelled() {
                return greatest;
            }
            for (k, triangle) in triangles.iter().enumerate() {
                // A triangle that vanished at a pole has no image.
                if lifted.triangle_of.get(chunk * CHUNK + k).is_some_and(|t| *t == u32::MAX) {
                    continue;
                }
                let uv = triangle.map(|c| lifted.domain.uv[c as usize]);
                let xyz = triangle.map(|c| lifted.mesh.positions[lifted.vertex_of[c as usize] as usize]);
                for [a, b, c] in SAMPLES {
                    let at = a * uv[0] + b * uv[1] + c * uv[2];
                    let point = a * xyz[0] + b * xyz[1] + c * xyz[2];
                    greatest = greatest.max(distance_above(surface, point, [at.x, at.y], greatest));
                }
            }
            greatest
        })
        .reduce(|| 0.0, f64::max)
}

/// Distance of a point to the surface near a place of the domain; 0 when it is found to be no more than `known`.
fn distance_above(surface: &Surface, point: DVec3, place: [f64; 2], known: f64) -> f64 {
    let domain = surface.domain();
    let [mut u, mut v] = place;
    let mut least = f64::INFINITY;
    for _ in 0..=STEPS {
        let (s, su, sv) = surface.first_derivatives(u, v);
        let d = point - s;
        least = least.min(d.length());
        if least <= known {
            return 0.0;
        }
        // [Su.Su Su.Sv; Su.Sv Sv.Sv] (du, dv) = (Su.d, Sv.d)
        let (e, f, g) = (su.length_squared(), su.dot(sv), sv.length_squared());
        let determinant = e * g - f * f;
        if determinant <= SINGULAR * e * g {
            return least;
        }
        let (x, y) = (su.dot(d), sv.dot(d));
        let next_u = (u + (g * x - f * y) / determinant).clamp(domain.u[0], domain.u[1]);
        let next_v = (v + (e * y - f * x) / determinant).clamp(domain.v[0], domain.v[1]);
        if next_u == u && next_v == v {
            break;
        }
        (u, v) = (next_u, next_v);
    }
    least
}

/// Share of the product of the squared derivatives below which they count as parallel (at a pole).
const SINGULAR: f64 = 1e-20;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::mesh::Mesh;
    use crate::engine::nurbs::shapes;
    use crate::engine::triangulation::{Configuration, GridLines, grid_mesh};

    fn lifted(surface: &Surface, lines: &GridLines) -> Lifted {
        let domain = grid_mesh(lines, Configuration::Regular, 0);
        let positions = domain.uv.iter().map(|p| surface.point(p.x, p.y)).collect();
        let triangles = domain.triangles.clone();
        Lifted {
            vertex_of: (0..domain.uv.len() as u32).collect(),
            triangle_of: (0..triangles.len() as u32).collect(),
            mesh: Mesh { positions, uv: None, triangles },
            normals: Vec::new(),
            domain,
        }
    }

    #[test]
    fn a_plane_has_no_deviation() {
        let surface = shapes::plane(3.0, 2.0);
        assert!(sampled_chord_error(&surface, &lifted(&surface, &GridLines::uniform(surface.domain(), 5, 4))) < 1e-14);
    }

    #[test]
    fn a_cylinder_deviates_by_the_sagitta_of_its_chords() {
        let radius = 7.0_f64;
        let surface = shapes::cylinder(radius, 20.0);
        let domain = surface.domain();
        for cells in [8, 16, 64] {
            let curved = GridLines::uniform(domain, cells + 1, cells + 1);
            let found = sampled_chord_error(&surface, &lifted(&surface, &curved));
            // The parameter of a rational circle is not its angle; the widest chord is the longest one.
            let points: Vec<DVec3> = curved.u.iter().map(|u| surface.point(*u, domain.v[0])).collect();
            let other: Vec<DVec3> = curved.v.iter().map(|v| surface.point(domain.u[0], *v)).collect();
            let around = if (points[0] - points[1]).z.abs() < 1e-9 { points } else { other };
            let longest = around.windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f64::max);
            let sagitta = radius * (1.0 - (1.0 - (longest / (2.0 * radius)).powi(2)).sqrt());
            assert!((found / sagitta - 1.0).abs() < 1e-6, "{cells}: {found} {sagitta}");
        }
    }
}
