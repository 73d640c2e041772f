//! Where the points of pins are on a mesh.
//!
//! A point in (u, v) is looked up in the domain mesh; one in space is moved to the nearest point of the mesh, then along
//! the surface to the nearest point of that (Gauss-Newton), whatever the mesh's density. Beside a curved boundary the point
//! may lie outside of the mesh's chords: there the nearest triangle's map is continued.

use glam::{DVec2, DVec3};

use crate::engine::job::JobOptions;
use crate::engine::mesh::{Mesh, measures};
use crate::engine::nurbs::Surface;
use crate::engine::pattern::Locator;
use crate::engine::seed::locate::nearest_point;
use crate::engine::triangulation::{Density, Lifted};

/// A pin may be off the part by this part of its diagonal: measured points and points of another program's mesh are. Larger,
/// and a pin that belongs to another part would pass. On a trimmed boundary the mesh's chords add as much again.
pub(super) const OFF: f64 = 1e-3;

/// Places nearer than this part of the diagonal are one place.
pub(super) const SAME: f64 = 1e-9;

/// An edge's bend by more than this part of the triangle is that of a sliver.
const MOST_BEND: f64 = 0.5;

/// Steps of the search for the surface's point nearest to a place in space; it converges quadratically.
const PROJECTIONS: usize = 20;

/// A step beyond the mesh's border may differ in length from that on the surface by this factor either way; see
/// [`crate::engine::pattern`].
const CONTINUED: f64 = 2.0;

/// A point of a triangle.
pub(super) fn in_space(mesh: &Mesh, triangle: u32, weights: [f64; 3]) -> DVec3 {
    measures::corners(mesh, triangle).into_iter().zip(weights).map(|(p, w)| p * w).sum()
}

/// How far the mesh's chords may be off the surface's boundary, as a part of the diagonal.
pub(super) fn chord(options: &JobOptions, diagonal: f64) -> f64 {
    match options.triangulation.tolerance {
        Some(Density::Chord(mm)) if diagonal > 0.0 => mm / diagonal,
        Some(Density::ChordRelative(share)) => share,
        _ => 0.0,
    }
}

/// A triangle of the mesh, weights there, and the place in the domain; or how far away the part is, if that is known.
pub(super) type Located = Result<(u32, [f64; 3], Option<DVec2>), Option<f64>>;

/// Where points of a surface are on its mesh.
pub(super) struct OnSurface<'a> {
    pub(super) surface: &'a Surface,
    pub(super) lifted: &'a Lifted,
    pub(super) locator: &'a Locator<'a>,
    /// Farthest that a point may be off the part, mm.
    pub(super) slack: f64,
}

impl OnSurface<'_> {
    pub(super) fn at_uv(&self, uv: DVec2) -> Located {
        let domain = self.surface.domain();
        let inside = DVec2::new(uv.x.clamp(domain.u[0], domain.u[1]), uv.y.clamp(domain.v[0], domain.v[1]));
        if !uv.is_finite() || inside.distance(uv) > SAME * (domain.u[1] - domain.u[0] + domain.v[1] - domain.v[0]) {
            return Err(None);
        }
        let triangle_of = |t: u32| self.lifted.triangle_of.get(t as usize).copied().unwrap_or(u32::MAX);
        let found = self.locator.locate_among(inside, |t| triangle_of(t) != u32::MAX).ok_or(None)?;
        let triangle = triangle_of(found.triangle);
        if found.inside {
            return Ok((triangle, self.bent(found.triangle, found.weights), Some(inside)));
        }
        let corners = self.lifted.domain.triangles[found.triangle as usize].map(|v| self.lifted.domain.uv[v as usize]);
        let near: DVec2 = corners.into_iter().zip(found.weights).map(|(p, w)| p * w).sum();
        let step = self.surface.point(near.x, near.y).distance(self.surface.point(inside.x, inside.y));
        if step > self.slack {
            return Err(Some(step));
        }
        // The boundary curve bulges beyond the mesh's chord: the triangle's map is continued, where that is sound.
        let [a, b, c] = corners;
        let (ab, ac, ap) = (b - a, c - a, inside - a);
        let area = ab.perp_dot(ac);
        let (x, y) = (ap.perp_dot(ac) / area, ab.perp_dot(ap) / area);
        let beyond = [1.0 - x - y, x, y];
        let mesh = &self.lifted.mesh;
        let length = in_space(mesh, triangle, beyond).distance(in_space(mesh, triangle, found.weights));
        let sound = length <= CONTINUED * step && step <= CONTINUED * length;
        let weights = if sound { beyond } else { found.weights };
        Ok((triangle, self.bent(found.triangle, weights), Some(inside)))
    }

    /// The weights of a triangle's point with what the surface's bulge adds to the map there, as the pattern's curves have
    /// it (see [`crate::engine::pattern`]): the bend of each edge is a combination of the corners too. It is that of this
    /// triangle alone, which at the part's border is all there is, and inside differs from the mean of both sides by a
    /// third power of the edge length.
    fn bent(&self, domain_triangle: u32, weights: [f64; 3]) -> [f64; 3] {
        let uv = self.lifted.domain.triangles[domain_triangle as usize].map(|v| self.lifted.domain.uv[v as usize]);
        let corners = measures::corners(&self.lifted.mesh, self.lifted.triangle_of[domain_triangle as usize]);
        let [e, f] = [corners[1] - corners[0], corners[2] - corners[0]];
        let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
        let area = ee * ff - ef * ef;
        let mut bent = weights;
        for k in 0..3 {
            let next = (k + 1) % 3;
            let middle = 0.5 * (uv[k] + uv[next]);
            let off = self.surface.point(middle.x, middle.y) - 0.5 * (corners[k] + corners[next]);
            let (oe, of) = (off.dot(e), off.dot(f));
            let (x, y) = ((oe * ff - of * ef) / area, (of * ee - oe * ef) / area);
            // A sliver says nothing; nor does a number that is none.
            if x.abs().max(y.abs()) <= MOST_BEND {
                let share = 4.0 * weights[k] * weights[next];
                bent = [bent[0] - share * (x + y), bent[1] + share * x, bent[2] + share * y];
            }
        }
        bent
    }

    pub(super) fn at_xyz(&self, xyz: DVec3, near: &Near) -> Located {
        let (triangle, weights, away) = near.nearest(xyz).ok_or(None)?;
        let mesh = &self.lifted.mesh;
        let on_mesh =
            |uv: Option<DVec2>| if away <= self.slack { Ok((triangle, weights, uv)) } else { Err(Some(away)) };
        let Some(uvs) = mesh.uv.as_deref() else { return on_mesh(None) };
        let corners = mesh.triangles[triangle as usize];
        let start: DVec2 = corners.iter().zip(weights).map(|(&v, w)| uvs[v as usize] * w).sum();
        let uv = projected(self.surface, xyz, start);
        let off = self.surface.point(uv.x, uv.y).distance(xyz);
        match self.at_uv(uv) {
            Ok(found) if off <= self.slack => Ok(found),
            _ => on_mesh(Some(start)),
        }
    }
}

/// The place of the domain whose point is nearest to a point in space, from a place nearby: Gauss-Newton, kept inside.
fn projected(surface: &Surface, xyz: DVec3, start: DVec2) -> DVec2 {
    let domain = surface.domain();
    let mut uv = start;
    let mut least = surface.point(uv.x, uv.y).distance_squared(xyz);
    for _ in 0..PROJECTIONS {
        let (s, su, sv) = surface.first_derivatives(uv.x, uv.y);
        let (e, f, g) = (su.dot(su), su.dot(sv), sv.dot(sv));
        let (x, y) = (su.dot(xyz - s), sv.dot(xyz - s));
        let step = DVec2::new(g * x - f * y, e * y - f * x) / (e * g - f * f);
        let next = uv + step;
        let next = DVec2::new(next.x.clamp(domain.u[0], domain.u[1]), next.y.clamp(domain.v[0], domain.v[1]));
        let distance = surface.point(next.x, next.y).distance_squared(xyz);
        // Not a number is not nearer either.
        if distance.is_nan() || distance >= least {
            break;
        }
        (uv, least) = (next, distance);
    }
    uv
}

/// The nearest points of a mesh: triangles whose balls are farther away than what is known are passed over.
pub(super) struct Near<'a> {
    mesh: &'a Mesh,
    balls: Vec<(DVec3, f64)>,
}

impl<'a> Near<'a> {
    pub(super) fn new(mesh: &'a Mesh, wanted: bool) -> Self {
        let ball = |t: u32| {
            let corners = measures::corners(mesh, t);
            let middle = measures::centroid(corners);
            (middle, corners.into_iter().map(|p| p.distance(middle)).fold(0.0, f64::max))
        };
        let balls = if wanted { (0..mesh.triangles.len() as u32).map(ball).collect() } else { Vec::new() };
        Self { mesh, balls }
    }

    /// The nearest triangle, the least of several, with the point's weights there and its distance.
    pub(super) fn nearest(&self, xyz: DVec3) -> Option<(u32, [f64; 3], f64)> {
        let mut best: Option<(u32, DVec3, f64)> = None;
        for (t, (middle, radius)) in self.balls.iter().enumerate() {
            if best.is_some_and(|(_, _, least)| middle.distance(xyz) - radius > least) {
                continue;
            }
            let point = nearest_point(measures::corners(self.mesh, t as u32), xyz);
            let away = point.distance(xyz);
            if away.is_finite() && best.is_none_or(|(_, _, least)| away < least) {
                best = Some((t as u32, point, away));
            }
        }
        let (triangle, point, away) = best?;
        let [a, b, c] = measures::corners(self.mesh, triangle);
        let normal = (b - a).cross(c - a);
        let size = normal.length_squared();
        if size == 0.0 {
            return Some((triangle, [1.0, 0.0, 0.0], away));
        }
        let y = (b - a).cross(point - a).dot(normal) / size;
        let x = (point - a).cross(c - a).dot(normal) / size;
        Some((triangle, [1.0 - x - y, x, y], away))
    }
}
