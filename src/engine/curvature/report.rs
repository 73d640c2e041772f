//! What a report says of a mesh's curvature: the rows of the thesis's Tables 5.4 to 5.6 and 5.12.

use serde::{Deserialize, Serialize};

use super::{Differences, Ring, rings};
use crate::engine::mesh::{Mesh, Topology};

/// Gaussian curvature at the interior vertices of a mesh.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CurvatureReport {
    /// Interior vertices: those at borders have no estimate.
    pub vertices: u64,
    /// Sum of the angle deficits, radians: the integral of the curvature over the interior vertices' shares.
    pub integral: f64,
    /// The same of their absolute values.
    pub absolute_integral: f64,
    /// How many interior vertices have which valency: `[valency, vertices]` (Table 5.12).
    pub valencies: Vec<(u32, u64)>,
    /// Least and greatest curvature of the surface itself at these vertices, 1/mm^2 (Table 5.4). Null for a mesh that was sent.
    pub surface_per_mm2: Option<[f64; 2]>,
    /// By a third of the triangles' area (5.5).
    pub barycentric: EstimateReport,
    /// By the same, compensated for the valency (5.7).
    pub compensated: EstimateReport,
    /// By the mixed Voronoi area (Meyer et al. 2003).
    pub voronoi: EstimateReport,
}

/// One estimate (a row of Tables 5.5 and 5.6).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EstimateReport {
    /// Least estimate, 1/mm^2.
    pub least_per_mm2: f64,
    /// Greatest estimate, 1/mm^2.
    pub greatest_per_mm2: f64,
    /// How far it is from the surface's own curvature. Null for a mesh that was sent.
    pub difference: Option<DifferenceReport>,
}

/// Absolute differences between an estimate and the surface's own curvature.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct DifferenceReport {
    /// Least, 1/mm^2.
    pub least_per_mm2: f64,
    /// Greatest, 1/mm^2.
    pub greatest_per_mm2: f64,
    /// Mean over the vertices, 1/mm^2.
    pub mean_per_mm2: f64,
    /// Sum over the vertices, 1/mm^2.
    pub sum_per_mm2: f64,
}

impl From<Differences> for DifferenceReport {
    fn from(of: Differences) -> Self {
        Self { least_per_mm2: of.least, greatest_per_mm2: of.greatest, mean_per_mm2: of.mean(), sum_per_mm2: of.sum }
    }
}

impl CurvatureReport {
    /// Of a mesh; `own` is the surface's curvature at each vertex, 1/mm^2, where there is a surface behind it.
    #[must_use]
    pub fn of(mesh: &Mesh, topology: &Topology, own: Option<&[f64]>) -> Self {
        let rings = rings(mesh, topology);
        let inner = || rings.iter().enumerate().filter_map(|(v, ring)| ring.map(|ring| (v, ring)));
        let estimate = |by: fn(&Ring) -> f64| {
            let [least, greatest] = extremes(inner().map(|(_, ring)| by(&ring))).unwrap_or_default();
            let difference = own.map(|own| Differences::of(inner().map(|(v, ring)| (by(&ring), own[v]))).into());
            EstimateReport { least_per_mm2: least, greatest_per_mm2: greatest, difference }
        };
        let mut valencies = std::collections::BTreeMap::new();
        for (_, ring) in inner() {
            *valencies.entry(ring.triangles).or_default() += 1;
        }
        Self {
            vertices: inner().count() as u64,
            integral: inner().map(|(_, ring)| ring.deficit()).sum(),
            absolute_integral: inner().map(|(_, ring)| ring.deficit().abs()).sum(),
            valencies: valencies.into_iter().collect(),
            surface_per_mm2: own.and_then(|own| extremes(inner().map(|(v, _)| own[v]))),
            barycentric: estimate(Ring::barycentric),
            compensated: estimate(Ring::compensated),
            voronoi: estimate(Ring::voronoi),
        }
    }
}

/// Least and greatest of the numbers that are finite.
fn extremes(numbers: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    numbers.filter(|x| x.is_finite()).fold(None, |so_far: Option<[f64; 2]>, x| {
        Some(so_far.map_or([x, x], |[least, greatest]| [least.min(x), greatest.max(x)]))
    })
}
