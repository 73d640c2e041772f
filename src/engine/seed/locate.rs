//! Seeds that are named rather than searched: by index, by corners, by a place in the domain or in space, at the centre.

use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::{Mesh, measures};

/// A place this far outside the domain's triangles, relative to the domain's diagonal, still counts as on its border:
/// users copy places from reports, which are rounded. Further out it is not in the part at all.
const OUTSIDE: f64 = 1e-9;

/// A triangulation of the domain and the triangles of the mesh that its triangles became.
#[derive(Debug, Clone, Copy)]
pub struct Domain<'a> {
    /// Vertices in (u, v).
    pub uv: &'a [DVec2],
    /// Corners, anticlockwise in (u, v).
    pub triangles: &'a [[u32; 3]],
    /// For each triangle that of the mesh, `u32::MAX` where it vanished (at a pole). Empty: the same numbers.
    pub triangle_of: &'a [u32],
}

impl<'a> Domain<'a> {
    /// The domain of a mesh that knows its own places in it.
    #[must_use]
    pub fn of(mesh: &'a Mesh) -> Option<Self> {
        let uv = mesh.uv.as_deref()?;
        Some(Self { uv, triangles: &mesh.triangles, triangle_of: &[] })
    }
}

/// A triangle by its number.
///
/// # Errors
/// [`FlatteningError::SeedOutOfRange`].
pub fn by_index(mesh: &Mesh, seed: u32) -> Result<u32, FlatteningError> {
    let triangles = mesh.triangles.len() as u32;
    if seed < triangles { Ok(seed) } else { Err(FlatteningError::SeedOutOfRange { seed, triangles }) }
}

/// The triangle with these three corners, in any order; the least where several have them.
///
/// # Errors
/// [`FlatteningError::SeedNotFound`] when no triangle has them.
pub fn by_vertices(mesh: &Mesh, corners: [u32; 3]) -> Result<u32, FlatteningError> {
    let sorted = |mut corners: [u32; 3]| {
        corners.sort_unstable();
        corners
    };
    let wanted = sorted(corners);
    let found = mesh.triangles.iter().position(|&triangle| sorted(triangle) == wanted);
    found.map(|t| t as u32).ok_or(FlatteningError::SeedNotFound)
}

/// The triangle that holds a place of the domain, the least where several do (on an edge, at a vertex).
///
/// # Errors
/// [`FlatteningError::SeedNotFound`] outside the triangles, and where the triangle vanished at a pole.
pub fn by_uv(domain: Domain, place: DVec2) -> Result<u32, FlatteningError> {
    if !place.is_finite() {
        return Err(FlatteningError::SeedNotFound);
    }
    let of_mesh = |t: usize| match domain.triangle_of.get(t) {
        Some(&u32::MAX) => None,
        Some(&triangle) => Some(triangle),
        None => Some(t as u32),
    };
    let corners = |t: usize| domain.triangles[t].map(|v| domain.uv[v as usize]);
    let holding = (0..domain.triangles.len()).filter(|&t| holds(corners(t), place)).filter_map(of_mesh).min();
    if let Some(triangle) = holding {
        return Ok(triangle);
    }
    let (low, high) = domain.uv.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let distance = |t: usize| {
        let [a, b, c] = corners(t).map(|p| p.extend(0.0));
        nearest_point([a, b, c], place.extend(0.0)).distance(place.extend(0.0))
    };
    let reachable = (0..domain.triangles.len()).filter(|&t| of_mesh(t).is_some());
    let nearest = reachable.map(|t| (distance(t), t)).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    match nearest {
        Some((away, t)) if away <= OUTSIDE * low.distance(high) => of_mesh(t).ok_or(FlatteningError::SeedNotFound),
        _ => Err(FlatteningError::SeedNotFound),
    }
}

/// The triangle nearest to a place in space, the least of several that are equally near.
///
/// # Errors
/// [`FlatteningError::SeedNotFound`] for an empty mesh or a place that is not a number.
pub fn by_xyz(mesh: &Mesh, place: DVec3) -> Result<u32, FlatteningError> {
    if !place.is_finite() {
        return Err(FlatteningError::SeedNotFound);
    }
    (0..mesh.triangles.len() as u32)
        .map(|t| (nearest_point(measures::corners(mesh, t), place).distance_squared(place), t))
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        .map(|(_, t)| t)
        .ok_or(FlatteningError::SeedNotFound)
}

/// The triangle whose centroid is nearest to the area centroid, of the mesh or of the triangles that `part` marks.
///
/// # Errors
/// [`FlatteningError::SeedNotFound`] when there is no such triangle.
pub fn centre(mesh: &Mesh, part: Option<&[bool]>) -> Result<u32, FlatteningError> {
    measures::central_triangle(mesh, part).ok_or(FlatteningError::SeedNotFound)
}

/// Whether a triangle holds a point, border included: decided exactly.
fn holds(corners: [DVec2; 3], point: DVec2) -> bool {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    (0..3).all(|e| orient2d(coord(corners[e]), coord(corners[(e + 1) % 3]), coord(point)) >= 0.0)
}

/// The point of a triangle that is nearest to `p` (Ericson, Real-Time Collision Detection, 5.1.5).
pub(crate) fn nearest_point([a, b, c]: [DVec3; 3], p: DVec3) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(p - a), ac.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let over_c = d1 * d4 - d3 * d2;
    if over_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let over_b = d5 * d2 - d1 * d6;
    if over_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let over_a = d3 * d6 - d5 * d4;
    if over_a <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = over_a + over_b + over_c;
    a + ab * (over_b / sum) + ac * (over_c / sum)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    fn mesh() -> Mesh {
        grid(6, 5, Diagonal::Regular, |u, v| DVec3::new(10.0 * u, 8.0 * v, u * v))
    }

    #[test]
    fn a_place_in_the_domain_finds_its_triangle() {
        let mesh = mesh();
        let domain = Domain::of(&mesh).unwrap();
        // Cell (1, 2): number 11, below and above its diagonal.
        assert_eq!(by_uv(domain, DVec2::new(0.35, 0.55)), Ok(22));
        assert_eq!(by_uv(domain, DVec2::new(0.25, 0.70)), Ok(23));
        assert_eq!(by_uv(domain, DVec2::ZERO), Ok(0));
        assert_eq!(by_uv(domain, DVec2::new(1.0 + 1e-12, 1.0)), Ok(38));
        assert_eq!(by_uv(domain, DVec2::new(1.01, 1.0)), Err(FlatteningError::SeedNotFound));
        assert_eq!(by_uv(domain, DVec2::NAN), Err(FlatteningError::SeedNotFound));
    }

    #[test]
    fn triangles_of_the_domain_are_translated_and_vanished_ones_passed_over() {
        let mesh = mesh();
        let triangle_of: Vec<u32> = (0..40).map(|t| if t == 22 { u32::MAX } else { 39 - t }).collect();
        let domain = Domain { triangle_of: &triangle_of, ..Domain::of(&mesh).unwrap() };
        assert_eq!(by_uv(domain, DVec2::new(0.25, 0.70)), Ok(16));
        assert_eq!(by_uv(domain, DVec2::new(0.35, 0.55)), Err(FlatteningError::SeedNotFound));
    }

    #[test]
    fn an_index_beyond_the_mesh_is_refused() {
        assert_eq!(by_index(&mesh(), 39), Ok(39));
        assert_eq!(by_index(&mesh(), 40), Err(FlatteningError::SeedOutOfRange { seed: 40, triangles: 40 }));
    }

    #[test]
    fn three_corners_in_any_order_find_their_triangle() {
        let mesh = mesh();
        let [a, b, c] = mesh.triangles[17];
        assert_eq!(by_vertices(&mesh, [a, b, c]), Ok(17));
        assert_eq!(by_vertices(&mesh, [c, a, b]), Ok(17));
        assert_eq!(by_vertices(&mesh, [b, a, c]), Ok(17));
        assert_eq!(by_vertices(&mesh, [a, b, a]), Err(FlatteningError::SeedNotFound));
        assert_eq!(by_vertices(&mesh, [a, b, 999]), Err(FlatteningError::SeedNotFound));
    }

    #[test]
    fn a_place_in_space_finds_the_nearest_triangle_from_any_distance() {
        let mesh = mesh();
        assert_eq!(by_xyz(&mesh, DVec3::new(3.5, 4.4, 0.2)), Ok(22));
        assert_eq!(by_xyz(&mesh, DVec3::new(-500.0, -500.0, 40.0)), Ok(0));
        assert_eq!(by_xyz(&Mesh::default(), DVec3::ZERO), Err(FlatteningError::SeedNotFound));
    }

    proptest! {
        #[test]
        fn the_nearest_point_of_a_triangle_is_nearer_than_any_other(
            p in prop::array::uniform3(-3.0..3.0_f64), w in prop::array::uniform3(0.0..1.0_f64)
        ) {
            let triangle = [DVec3::new(0.1, 0.2, 0.0), DVec3::new(2.0, 0.0, 0.5), DVec3::new(0.4, 1.5, -0.3)];
            let p = DVec3::from_array(p);
            let nearest = nearest_point(triangle, p);
            let sum = w.iter().sum::<f64>() + 1e-9;
            let other = triangle.iter().zip(w).map(|(c, w)| *c * (w / sum)).sum::<DVec3>()
                + triangle[0] * (1e-9 / sum);
            prop_assert!(nearest.distance(p) <= other.distance(p) + 1e-9);
        }
    }
}
