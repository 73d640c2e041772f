//! How far a mesh is from developable, measured before anything is flattened, and what that foretells of a flattening.
//!
//! A map that keeps angles and leaves the border's lengths alone scales by e^u with `lap u = K`, `u = 0` at the border, so
//! the mean of |u| is the integral of |K| weighted by the torsion function of the surface (what solves `lap t = -1`) over the area.
//! Its place takes `d^2`, `d` the distance to the border along edges: in a strip of constant curvature both integrals are
//! `K w^2 / 3` (`w` half its width), on a disc they are `K r^2 / 8` and `K r^2 / 6`. So
//! `predicted strain = sum |deficit| d^2 / area`, an order of magnitude that rises with what any flattening must strain.
//! Curvature near the border costs little, in the middle much. Limits: curvatures of both signs do not cancel here.
//!
//! Points are elliptic, hyperbolic or developable (thesis 1.4.4: K above, below or equal to 0) by the surface's own
//! curvature where there is one, else by the deficit over the mixed area. Equal to 0 means [`FLAT`]. All figures are the
//! same for a mesh of any size, place and unit.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::FRAC_PI_2;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::rings;
use crate::engine::mesh::{Mesh, Topology, measures};
use crate::engine::nurbs::Curvature;

/// A point is developable when `|K|` times the mesh's area is at most this, radians: a part that is all curved so would be strained
/// by about a ten-thousandth. Smaller, and the roundings of meshes sent in single precision would count as curvature.
pub const FLAT: f64 = 1e-3;

/// At most about so many vertices ask the surface for its curvature, evenly spread over their numbers: shares are then known to
/// a hundredth, and a large mesh takes no longer than one of this size.
const SAMPLES: usize = 20_000;

/// Where principal curvatures differ in size by less than this share of the greater, there is no direction of minimum curvature.
const UMBILIC: f64 = 1e-6;

/// What is foretold of a mesh before it is flattened.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct DevelopabilityReport {
    /// Sum of the absolute angle deficits at interior vertices, radians: the integral of |K|.
    pub absolute_curvature: f64,
    /// Mean strain that a flattening is expected to need at least, percent, as an order of magnitude. Null where the mesh has no
    /// border.
    pub predicted_strain_percent: Option<f64>,
    /// `absolute_curvature` times the mean aspect ratio of the triangles by area: the greater, the more seeds of a sequential
    /// flattening fail.
    pub failure_index: f64,
    /// Mean angle between the line of minimum curvature and the nearest edge, by area, degrees. Null for a mesh that was sent, and where no
    /// vertex has such a line.
    pub edge_alignment_deg: Option<f64>,
    /// Shares of the points by area. Null where no vertex has a curvature.
    pub points: Option<PointShares>,
}

/// Shares of points by the sign of their Gaussian curvature (thesis 1.4.4).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PointShares {
    /// K above zero, percent.
    pub elliptic_percent: f64,
    /// K below zero, percent.
    pub hyperbolic_percent: f64,
    /// K zero, percent.
    pub developable_percent: f64,
    /// The greatest |K| that counts as zero, 1/mm^2.
    pub flat_per_mm2: f64,
}

impl DevelopabilityReport {
    /// Of a mesh; `own` gives the curvature of the surface behind it at a place of its domain.
    #[must_use]
    pub fn of(mesh: &Mesh, topology: &Topology, own: Option<&dyn Fn(DVec2) -> Curvature>) -> Self {
        let rings = rings(mesh, topology);
        let deficit = |v: usize| rings[v].map_or(0.0, |ring| ring.deficit().abs());
        let absolute_curvature: f64 = (0..rings.len()).map(deficit).sum();
        let area = measures::total_area(mesh);
        let predicted = to_border(mesh, topology).map(|distances| {
            let sum: f64 = distances
                .iter()
                .enumerate()
                .filter(|(_, distance)| distance.is_finite())
                .map(|(v, distance)| deficit(v) * distance * distance)
                .sum();
            if area > 0.0 { 100.0 * sum / area } else { 0.0 }
        });
        let aspects: f64 = (0..mesh.triangles.len() as u32)
            .map(|t| {
                let corners = measures::corners(mesh, t);
                let area = measures::area(corners);
                if area > 0.0 { measures::aspect_ratio(corners).min(measures::ASPECT_MAX) * area } else { 0.0 }
            })
            .sum();
        let flat_per_mm2 = if area > 0.0 { FLAT / area } else { 0.0 };
        let (points, edge_alignment_deg) = if let (Some(own), Some(uv)) = (own, &mesh.uv) {
            of_surface(mesh, uv, own, flat_per_mm2)
        } else {
            let inner = rings.iter().flatten().map(|ring| (ring.voronoi(), ring.mixed_area));
            (shares(inner, flat_per_mm2), None)
        };
        Self {
            absolute_curvature,
            predicted_strain_percent: predicted,
            failure_index: if area > 0.0 { absolute_curvature * aspects / area } else { 0.0 },
            edge_alignment_deg,
            points,
        }
    }
}

/// Shares of pairs of a curvature and the area that it stands for.
fn shares(points: impl Iterator<Item = (f64, f64)>, flat_per_mm2: f64) -> Option<PointShares> {
    let [mut elliptic, mut hyperbolic, mut developable] = [0.0; 3];
    for (gaussian, area) in points.filter(|(gaussian, area)| gaussian.is_finite() && *area > 0.0) {
        if gaussian.abs() <= flat_per_mm2 {
            developable += area;
        } else if gaussian > 0.0 {
            elliptic += area;
        } else {
            hyperbolic += area;
        }
    }
    let all = elliptic + hyperbolic + developable;
    (all > 0.0).then(|| PointShares {
        elliptic_percent: 100.0 * elliptic / all,
        hyperbolic_percent: 100.0 * hyperbolic / all,
        developable_percent: 100.0 * developable / all,
        flat_per_mm2,
    })
}

/// The least number from `step` on that has no divisor in common with `n`.
fn coprime_above(n: usize, step: usize) -> usize {
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    (step..step + n).find(|&step| gcd(step, n) == 1).unwrap_or(1)
}

/// Shares by the surface's own curvature, and how far edges run from its lines of minimum curvature.
fn of_surface(
    mesh: &Mesh,
    uv: &[DVec2],
    own: &dyn Fn(DVec2) -> Curvature,
    flat_per_mm2: f64,
) -> (Option<PointShares>, Option<f64>) {
    // A step that divides a grid's row would look at the same columns in each of them.
    let step = coprime_above(uv.len(), uv.len().div_ceil(SAMPLES).max(1));
    let curvatures: Vec<Curvature> = uv.iter().step_by(step).map(|&place| own(place)).collect();
    let mut areas = vec![0.0; curvatures.len()];
    let mut angles = vec![f64::INFINITY; curvatures.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let third = measures::area(measures::corners(mesh, t as u32)) / 3.0;
        for k in 0..3 {
            let vertex = corners[k] as usize;
            if !vertex.is_multiple_of(step) {
                continue;
            }
            let at = vertex / step;
            areas[at] += third;
            for other in [corners[(k + 1) % 3], corners[(k + 2) % 3]] {
                if let Some(angle) = from_minimum(&curvatures[at], uv[other as usize] - uv[vertex]) {
                    angles[at] = angles[at].min(angle);
                }
            }
        }
    }
    let points = curvatures.iter().zip(&areas).map(|(curvature, area)| (curvature.gaussian, *area));
    let directed = || angles.iter().zip(&areas).filter(|(angle, _)| angle.is_finite());
    let area: f64 = directed().map(|(_, area)| area).sum();
    let mean = directed().map(|(angle, area)| angle * area).sum::<f64>() / area;
    (shares(points, flat_per_mm2), mean.is_finite().then(|| mean.to_degrees()))
}

/// The angle on the surface between a direction of the domain and the line of minimum curvature, from 0 to a right one; none
/// where there is no such line.
fn from_minimum(curvature: &Curvature, towards: DVec2) -> Option<f64> {
    let [least, greatest] = [curvature.k1.abs(), curvature.k2.abs()];
    let line = if least <= greatest { curvature.d1 } else { curvature.d2 };
    // Not a number: there is none either.
    let distinct = (least - greatest).abs() > UMBILIC * least.max(greatest);
    let dot =
        |a: DVec2, b: DVec2| curvature.e * a.x * b.x + curvature.f * (a.x * b.y + a.y * b.x) + curvature.g * a.y * b.y;
    let cosine = dot(line, towards).abs() / (dot(line, line) * dot(towards, towards)).sqrt();
    (distinct && cosine.is_finite()).then(|| cosine.min(1.0).acos().clamp(0.0, FRAC_PI_2))
}

/// For each vertex its distance to the nearest border along edges, mm; infinite where none is reached. None without borders.
fn to_border(mesh: &Mesh, topology: &Topology) -> Option<Vec<f64>> {
    let mut distances = vec![f64::INFINITY; mesh.positions.len()];
    let mut queue = BinaryHeap::new();
    for &halfedge in topology.borders().flatten() {
        let vertex = topology.origin(halfedge);
        if std::mem::replace(&mut distances[vertex as usize], 0.0) > 0.0 {
            queue.push(Reverse((0_u64, vertex)));
        }
    }
    if queue.is_empty() {
        return None;
    }
    let (starts, edges) = fans(mesh);
    // Distances are not negative, so their bits have their order.
    while let Some(Reverse((bits, vertex))) = queue.pop() {
        let distance = f64::from_bits(bits);
        if distance > distances[vertex as usize] {
            continue;
        }
        for &next in &edges[starts[vertex as usize] as usize..starts[vertex as usize + 1] as usize] {
            let through = distance + mesh.positions[vertex as usize].distance(mesh.positions[next as usize]);
            if through < distances[next as usize] {
                distances[next as usize] = through;
                queue.push(Reverse((through.to_bits(), next)));
            }
        }
    }
    Some(distances)
}

/// The vertices across the edges of each, some of them twice, and where those of each begin.
fn fans(mesh: &Mesh) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; mesh.positions.len() + 1];
    for &corner in mesh.triangles.as_flattened() {
        starts[corner as usize + 1] += 2;
    }
    for v in 1..starts.len() {
        starts[v] += starts[v - 1];
    }
    let mut next = starts.clone();
    let mut edges = vec![0; 6 * mesh.triangles.len()];
    for corners in &mesh.triangles {
        for k in 0..3 {
            let at = &mut next[corners[k] as usize];
            edges[*at as usize] = corners[(k + 1) % 3];
            edges[*at as usize + 1] = corners[(k + 2) % 3];
            *at += 2;
        }
    }
    (starts, edges)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use proptest::prelude::*;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};
    use crate::engine::nurbs::shapes::{cylinder, sphere};
    use crate::engine::nurbs::{Domain, Surface};
    use crate::engine::triangulation::{Configuration, GridLines, grid_mesh, lift};

    fn of_mesh(mesh: &Mesh) -> DevelopabilityReport {
        DevelopabilityReport::of(mesh, &Topology::new(mesh).unwrap(), None)
    }

    /// A patch away from poles and seams, by its surface.
    fn of_patch(surface: &Surface, points: usize) -> DevelopabilityReport {
        let Domain { u, v } = surface.domain();
        let inside = |[a, b]: [f64; 2]| [a + 0.3 * (b - a), a + 0.45 * (b - a)];
        let lines = GridLines::uniform(Domain { u: inside(u), v: inside(v) }, points, points);
        let mesh = lift(surface, grid_mesh(&lines, Configuration::Regular, 0), &lines).mesh;
        let own = |p: DVec2| surface.curvature(p.x, p.y);
        DevelopabilityReport::of(&mesh, &Topology::new(&mesh).unwrap(), Some(&own))
    }

    fn percents(report: &DevelopabilityReport) -> [f64; 3] {
        let points = report.points.unwrap();
        [points.elliptic_percent, points.hyperbolic_percent, points.developable_percent]
    }

    fn saddle(u: f64, v: f64) -> DVec3 {
        DVec3::new(100.0 * u, 100.0 * v, 40.0 * (u - 0.5) * (v - 0.5))
    }

    #[test]
    fn a_cylinder_is_developable_with_edges_along_its_rulings_and_a_sphere_is_elliptic() {
        let flat = of_patch(&cylinder(20.0, 100.0), 13);
        assert_eq!(percents(&flat), [0.0, 0.0, 100.0]);
        assert!(flat.absolute_curvature < 1e-10 && flat.predicted_strain_percent.unwrap() < 1e-9, "{flat:?}");
        assert!(flat.edge_alignment_deg.unwrap() < 1e-4, "{flat:?}");
        let round = of_patch(&sphere(50.0), 13);
        assert_eq!(percents(&round), [100.0, 0.0, 0.0]);
        assert_eq!(round.edge_alignment_deg, None, "every direction of a sphere is as curved");
        assert!(round.absolute_curvature > 0.01 && round.failure_index > round.absolute_curvature);
    }

    #[test]
    fn a_cone_is_developable_and_a_saddle_hyperbolic_by_their_meshes() {
        let cone = grid(15, 15, Diagonal::Regular, |u, v| {
            let (r, angle) = (20.0 + 30.0 * u, v - 0.5);
            DVec3::new(r * angle.cos(), r * angle.sin(), 1.5 * r)
        });
        assert_eq!(percents(&of_mesh(&cone)), [0.0, 0.0, 100.0]);
        let saddle = of_mesh(&grid(15, 15, Diagonal::Regular, saddle));
        assert_eq!(percents(&saddle), [0.0, 100.0, 0.0]);
        assert_eq!(saddle.edge_alignment_deg, None);
    }

    #[test]
    fn a_torus_is_elliptic_outside_and_hyperbolic_inside_by_its_closed_form() {
        // A ring of radii 50 and 20, cut once each way: the areas outside and inside are pi R +- 2 r of 2 pi R.
        let (long, short) = (50.0, 20.0);
        let tau = std::f64::consts::TAU;
        let torus = grid(61, 61, Diagonal::Regular, |u, v| {
            let (a, b) = (tau * u, tau * v);
            let r = long + short * b.cos();
            DVec3::new(r * a.cos(), r * a.sin(), short * b.sin())
        });
        let outside = 50.0 + 100.0 * short / (std::f64::consts::PI * long);
        let [elliptic, hyperbolic, developable] = percents(&of_mesh(&torus));
        assert!((elliptic - outside).abs() < 3.0 && developable < 4.0, "{elliptic} {hyperbolic} {developable}");
        assert!((elliptic + hyperbolic + developable - 100.0).abs() < 1e-9);
    }

    #[test]
    fn a_strip_of_a_sphere_needs_the_strain_that_theory_says() {
        // Half its width is w: the mean of |u| is w^2 / (3 R^2).
        let (radius, half) = (100.0, 8.0);
        let strip = grid(401, 33, Diagonal::Diamond, |u, v| {
            let (along, across) = (2.0 * u, 2.0 * half / radius * (v - 0.5));
            radius * DVec3::new(across.cos() * along.cos(), across.cos() * along.sin(), across.sin())
        });
        let expected = 100.0 * half * half / (3.0 * radius * radius);
        let found = of_mesh(&strip).predicted_strain_percent.unwrap();
        assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
    }

    #[test]
    fn a_mesh_without_border_or_without_interior_has_what_there_is() {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let positions = vec![at(0.0, 0.0, 0.0), at(5.0, 0.3, 0.0), at(0.4, 2.0, 0.0), at(0.2, 0.1, 1.0)];
        let closed = Mesh { positions, uv: None, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] };
        let report = of_mesh(&closed);
        assert_eq!(report.predicted_strain_percent, None);
        assert!((report.absolute_curvature - 4.0 * std::f64::consts::PI).abs() < 1e-12);
        let one = of_mesh(&grid(2, 2, Diagonal::Regular, saddle));
        assert_eq!((one.points, one.absolute_curvature, one.predicted_strain_percent), (None, 0.0, Some(0.0)));
    }

    proptest! {
        #[test]
        fn nothing_depends_on_size_or_place(
            size in 1e-3..1e3_f64, angle in 0.0..6.0_f64, shift in -50.0..50.0_f64, depth in 1.0..60.0_f64,
        ) {
            let mesh = grid(9, 11, Diagonal::Regular, |u, v| {
                DVec3::new(100.0 * u, 90.0 * v, depth * (u * u * v - 0.4 * v * v))
            });
            let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle);
            let moved = |p: &DVec3| size * (turn * *p + DVec3::splat(shift));
            let other = Mesh { positions: mesh.positions.iter().map(moved).collect(), ..mesh.clone() };
            let (one, two) = (of_mesh(&mesh), of_mesh(&other));
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-7 * (1.0 + a.abs());
            prop_assert!(near(one.absolute_curvature, two.absolute_curvature));
            prop_assert!(near(one.failure_index, two.failure_index));
            prop_assert!(near(one.predicted_strain_percent.unwrap(), two.predicted_strain_percent.unwrap()));
            prop_assert!(percents(&one).iter().zip(percents(&two)).all(|(a, b)| near(*a, b)));
        }
    }
}
