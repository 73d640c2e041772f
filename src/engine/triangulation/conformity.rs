//! Checks that a domain mesh is a conforming triangulation of a region: the promise that everything downstream rests on.
//!
//! What is checked: indices, orientation by exact predicates, no two vertices at one place, every edge once in each
//! direction at most, boundary edges on the region's boundary in its direction, and the areas. Together they exclude
//! overlaps, gaps and T-vertices: a vertex in the middle of an edge leaves edges without partners inside the region.
//! Time is O(n log n) but for the boundary edges, each of which is compared with all segments of the loops.

use glam::DVec2;
use robust::{Coord, orient2d};

use super::DomainMesh;
use crate::engine::trimming::TrimRegion;

/// Boundary edges may be off the loops by this fraction of the region's size: ten times what tracing moves points by.
const ON_BOUNDARY: f64 = 2e-10;

/// Areas may differ by this fraction.
const AREA: f64 = 1e-10;

/// A violation of conformity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DomainFault {
    /// A corner is not a vertex.
    #[error("triangle {triangle} has a corner that does not exist")]
    Corner {
        /// Which triangle.
        triangle: u32,
    },
    /// A triangle is clockwise or has no area.
    #[error("triangle {triangle} is not anticlockwise")]
    Orientation {
        /// Which triangle.
        triangle: u32,
    },
    /// Two vertices are at one place.
    #[error("vertices {0} and {1} are at the same place")]
    Duplicate(u32, u32),
    /// A vertex belongs to no triangle.
    #[error("vertex {0} belongs to no triangle")]
    Unused(u32),
    /// An edge has the same direction in two triangles.
    #[error("the edge from {0} to {1} occurs twice")]
    Edge(u32, u32),
    /// An edge of one triangle only does not lie on the region's boundary, in its direction: a crack or a T-vertex.
    #[error("the edge from {0} to {1} has one triangle but is not on the boundary")]
    Crack(u32, u32),
    /// Mesh and region differ in area.
    #[error("the mesh has area {mesh}, the region {region}")]
    Area {
        /// Area of the mesh in (u, v).
        mesh: f64,
        /// Area of the region.
        region: f64,
    },
}

/// Area of a region in (u, v).
#[must_use]
pub fn region_area(region: &TrimRegion) -> f64 {
    // Relative to a point of each loop: coordinates far from the origin would cancel.
    region
        .loops
        .iter()
        .map(|l| {
            let at = |k: usize| l.points[k % l.points.len()] - l.points[0];
            (0..l.points.len()).map(|k| at(k).perp_dot(at(k + 1))).sum::<f64>() / 2.0
        })
        .sum()
}

/// All violations of conformity of `mesh` as a triangulation of `region`; empty when it conforms.
#[must_use]
pub fn check_domain_mesh(mesh: &DomainMesh, region: &TrimRegion) -> Vec<DomainFault> {
    let mut faults = Vec::new();
    let count = mesh.uv.len() as u32;
    faults.extend(
        (mesh.triangles.iter().enumerate())
            .filter(|(_, corners)| corners.iter().any(|&k| k >= count))
            .map(|(t, _)| DomainFault::Corner { triangle: t as u32 }),
    );
    if !faults.is_empty() {
        return faults; // nothing else can be looked at
    }
    let mut area = 0.0;
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|k| mesh.uv[k as usize]);
        let coord = |p: DVec2| Coord { x: p.x, y: p.y };
        if orient2d(coord(a), coord(b), coord(c)) <= 0.0 {
            faults.push(DomainFault::Orientation { triangle: t as u32 });
        }
        area += 0.5 * (b - a).perp_dot(c - a);
    }
    check_vertices(mesh, &mut faults);
    check_edges(mesh, region, &mut faults);
    let expected = region_area(region);
    if (area - expected).abs() > AREA * expected.abs() {
        faults.push(DomainFault::Area { mesh: area, region: expected });
    }
    faults
}

fn check_vertices(mesh: &DomainMesh, faults: &mut Vec<DomainFault>) {
    let mut used = vec![false; mesh.uv.len()];
    mesh.triangles.as_flattened().iter().for_each(|&k| used[k as usize] = true);
    faults.extend((0..mesh.uv.len()).filter(|&k| !used[k]).map(|k| DomainFault::Unused(k as u32)));
    let at = |k: u32| mesh.uv[k as usize] + DVec2::ZERO; // -0 becomes 0
    let mut order: Vec<u32> = (0..mesh.uv.len() as u32).collect();
    order.sort_unstable_by(|&a, &b| at(a).x.total_cmp(&at(b).x).then(at(a).y.total_cmp(&at(b).y)));
    faults.extend(order.windows(2).filter(|w| at(w[0]) == at(w[1])).map(|w| DomainFault::Duplicate(w[0], w[1])));
}

fn check_edges(mesh: &DomainMesh, region: &TrimRegion, faults: &mut Vec<DomainFault>) {
    let mut halfedges: Vec<[u32; 2]> = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    halfedges.sort_unstable();
    faults.extend(halfedges.windows(2).filter(|w| w[0] == w[1]).map(|w| DomainFault::Edge(w[0][0], w[0][1])));
    let boundary = Boundary::new(region);
    for &[a, b] in &halfedges {
        if halfedges.binary_search(&[b, a]).is_err() && !boundary.holds(mesh.uv[a as usize], mesh.uv[b as usize]) {
            faults.push(DomainFault::Crack(a, b));
        }
    }
}

/// The segments of a region's loops.
struct Boundary {
    segments: Vec<[DVec2; 2]>,
    size: DVec2,
}

impl Boundary {
    fn new(region: &TrimRegion) -> Self {
        let points = || region.loops.iter().flat_map(|l| &l.points);
        let low = points().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = points().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let size = (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
        let scaled = |p: DVec2| p / size;
        let segments = region.loops.iter().flat_map(|l| {
            (0..l.points.len()).map(move |k| [scaled(l.points[k]), scaled(l.points[(k + 1) % l.points.len()])])
        });
        Self { segments: segments.collect(), size }
    }

    /// True when the edge lies on a segment and runs in its direction.
    fn holds(&self, a: DVec2, b: DVec2) -> bool {
        let (a, b) = (a / self.size, b / self.size);
        self.segments.iter().any(|&[p, q]| {
            let near = |x: DVec2| {
                let t = ((x - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
                x.distance(p.lerp(q, t)) <= ON_BOUNDARY
            };
            near(a) && near(b) && (b - a).dot(q - p) > 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::trimming::BoundaryLoop;

    fn square() -> TrimRegion {
        let points = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(DVec2::from).to_vec();
        let whole = BoundaryLoop {
            points,
            sources: Vec::new(),
            corners: vec![true; 4],
            source_loop: Some(0),
            depth: 0,
            parent: None,
        };
        TrimRegion { loops: vec![whole], natural: false }
    }

    fn mesh(uv: &[(f64, f64)], triangles: &[[u32; 3]]) -> DomainMesh {
        DomainMesh { uv: uv.iter().copied().map(DVec2::from).collect(), triangles: triangles.to_vec() }
    }

    const CORNERS: [(f64, f64); 4] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];

    #[test]
    fn a_conforming_mesh_has_no_fault() {
        assert_eq!(check_domain_mesh(&mesh(&CORNERS, &[[0, 1, 2], [0, 2, 3]]), &square()), []);
    }

    #[test]
    fn each_fault_is_named() {
        let has = |m: &DomainMesh, wanted: &dyn Fn(&DomainFault) -> bool| {
            let faults = check_domain_mesh(m, &square());
            assert!(faults.iter().any(wanted), "{faults:?}");
        };
        has(&mesh(&CORNERS, &[[0, 1, 7]]), &|f| matches!(f, DomainFault::Corner { triangle: 0 }));
        has(&mesh(&CORNERS, &[[0, 1, 2], [0, 3, 2]]), &|f| matches!(f, DomainFault::Orientation { triangle: 1 }));
        has(&mesh(&CORNERS, &[[0, 1, 2], [0, 1, 3]]), &|f| matches!(f, DomainFault::Edge(0, 1)));
        has(&mesh(&CORNERS, &[[0, 1, 2]]), &|f| matches!(f, DomainFault::Crack(2, 0)));
        has(&mesh(&CORNERS, &[[0, 1, 2]]), &|f| matches!(f, DomainFault::Area { .. }));
        has(&mesh(&CORNERS, &[[0, 1, 2]]), &|f| matches!(f, DomainFault::Unused(3)));
        let mut five = CORNERS.to_vec();
        five.push((1.0, 1.0));
        has(&mesh(&five, &[[0, 1, 2], [0, 4, 3]]), &|f| matches!(f, DomainFault::Duplicate(..)));
        // A T-vertex on the diagonal.
        five[4] = (0.5, 0.5);
        has(&mesh(&five, &[[0, 1, 2], [0, 4, 3], [4, 2, 3]]), &|f| matches!(f, DomainFault::Crack(2, 0)));
    }
}
