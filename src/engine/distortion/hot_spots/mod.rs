//! Hot spots: the few places of a flattening that a person should look at first, and what to try there.
//!
//! A triangle's severity is the greater magnitude of its principal strains, averaged with its neighbourhood. Triangles
//! above a threshold, with those beside them that are not far below, make regions of one kind ([`HotSpotKind`]) that are
//! connected over edges. The threshold is a limit that the caller names, or half of what 99 % of the part's area stays
//! below, which one bad triangle does not raise. Spots are ranked by peak times area, the ten first are kept.
//!
//! Strains in percent, positive = stretched when laid on the part; areas mm^2 on the part. Everything is found in time
//! O(triangles log triangles) and in a fixed order. Limits: regions are as fine as the mesh; what is smaller than a
//! few triangles is averaged away, but stays in the extremes of the report.

mod severity;
#[cfg(test)]
mod tests;

use glam::DVec2;
use serde::{Deserialize, Serialize};

pub use self::severity::HotSpotKind;
use self::severity::{averaged, severity};
use super::{StrainPlace, TriangleStrain, strains};
use crate::engine::error::Remedy;
use crate::engine::mesh::topology::NONE;
use crate::engine::mesh::{Mesh, Topology, measures};

/// The most spots that are told: more than anybody mends at once.
const MOST_SPOTS: usize = 10;

/// The share of the part's area that stays below the severity which sets the threshold.
const SHARE: f64 = 0.99;

/// The threshold as a part of that severity. Larger: spots are small and some are missed; smaller: they run together.
const HALF: f64 = 0.5;

/// A region goes on down to this part of the threshold: without it a region falls apart, or does not, by a hair.
const GOES_ON: f64 = 0.75;

/// Severity below which nothing is hot, percent: a tenth of a millimetre a metre.
const COLD: f64 = 0.01;

/// Regions smaller than this part of the part's area are no spots.
const LEAST_AREA: f64 = 1e-4;

/// Severities within this part of the greatest are peaks too: of these the triangle with the least number is told.
const TIE: f64 = 1e-9;

/// One place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HotSpot {
    /// What is the matter.
    pub kind: HotSpotKind,
    /// The strain of that kind at its greatest, percent, with its sign.
    pub peak_percent: f64,
    /// Area of the region on the part, mm^2.
    pub area_mm2: f64,
    /// Where the peak is.
    pub at: StrainPlace,
    /// What to try.
    pub remedies: Vec<Remedy>,
}

/// The hot spots of a flattening, the worst first. `part` marks the triangles to look at; `threshold_percent` is the
/// severity from which on a place is hot, when there is a limit to hold it against.
#[must_use]
pub fn hot_spots(
    mesh: &Mesh,
    topology: &Topology,
    flat: &[DVec2],
    part: Option<&[bool]>,
    threshold_percent: Option<f64>,
) -> Vec<HotSpot> {
    let mut raw = strains(mesh, flat);
    for (t, strain) in raw.iter_mut().enumerate() {
        if part.is_some_and(|p| p.get(t) != Some(&true)) {
            *strain = None;
        }
    }
    let around = averaged(mesh, topology, &raw);
    let areas: Vec<f64> = (0..raw.len() as u32).map(|t| measures::area(measures::corners(mesh, t))).collect();
    let total: f64 = raw.iter().zip(&areas).filter(|(s, _)| s.is_some()).map(|(_, a)| a).sum();
    let threshold =
        threshold_percent.unwrap_or_else(|| HALF * quantile(&around, &raw, &areas, SHARE * total)).max(COLD);
    let mut found: Vec<(f64, HotSpot)> = Vec::new();
    for region in regions(topology, &around, threshold) {
        let area: f64 = region.triangles.iter().map(|&t| areas[t as usize]).sum();
        if area < LEAST_AREA * total {
            continue;
        }
        if let Some(spot) = spot(mesh, flat, &raw, &around, &region, area) {
            found.push((spot.peak_percent.abs() * area, spot));
        }
    }
    // Stable: equal ranks stay in the order of their least triangle.
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(MOST_SPOTS).map(|(_, spot)| spot).collect()
}

/// The severity that triangles with `share` mm^2 of area stay below.
fn quantile(around: &[[f64; 2]], raw: &[Option<TriangleStrain>], areas: &[f64], share: f64) -> f64 {
    let mut order: Vec<(f64, f64)> = around
        .iter()
        .zip(raw)
        .zip(areas)
        .filter(|((_, s), _)| s.is_some())
        .map(|((&e, _), &a)| (severity(e), a))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = 0.0;
    order
        .iter()
        .find(|(_, area)| {
            below += area;
            below >= share
        })
        .or(order.last())
        .map_or(0.0, |o| o.0)
}

/// Connected triangles of one kind.
struct Region {
    kind: HotSpotKind,
    /// In ascending order of discovery from the least.
    triangles: Vec<u32>,
}

/// The regions that reach the threshold somewhere, in the order of their least triangle.
fn regions(topology: &Topology, around: &[[f64; 2]], threshold: f64) -> Vec<Region> {
    let warm = |t: u32| severity(around[t as usize]) >= GOES_ON * threshold;
    let mut seen = vec![false; around.len()];
    let mut found = Vec::new();
    for first in 0..around.len() as u32 {
        if seen[first as usize] || !warm(first) {
            continue;
        }
        seen[first as usize] = true;
        let kind = HotSpotKind::of(around[first as usize]);
        let gathered = around[first as usize][0] + around[first as usize][1] < 0.0;
        let alike =
            |e: [f64; 2]| HotSpotKind::of(e) == kind && (kind != HotSpotKind::Area || (e[0] + e[1] < 0.0) == gathered);
        let mut triangles = vec![first];
        let mut done = 0;
        while let Some(&t) = triangles.get(done) {
            done += 1;
            for twin in [3 * t, 3 * t + 1, 3 * t + 2].map(|h| topology.twin(h)).into_iter().filter(|&h| h != NONE) {
                let other = twin / 3;
                if !seen[other as usize] && warm(other) && alike(around[other as usize]) {
                    seen[other as usize] = true;
                    triangles.push(other);
                }
            }
        }
        if triangles.iter().any(|&t| severity(around[t as usize]) >= threshold) {
            found.push(Region { kind, triangles });
        }
    }
    found
}

fn spot(
    mesh: &Mesh,
    flat: &[DVec2],
    raw: &[Option<TriangleStrain>],
    around: &[[f64; 2]],
    region: &Region,
    area: f64,
) -> Option<HotSpot> {
    let worst = region.triangles.iter().map(|&t| severity(around[t as usize])).fold(0.0, f64::max);
    let peaks = region.triangles.iter().copied().filter(|&t| severity(around[t as usize]) >= worst * (1.0 - TIE));
    let t = peaks.min()?;
    let peak_percent = region.kind.strain_of(raw[t as usize]?);
    let corners = mesh.triangles[t as usize].map(|v| v as usize);
    let middle = |values: &[DVec2]| ((values[corners[0]] + values[corners[1]] + values[corners[2]]) / 3.0).to_array();
    let at = StrainPlace {
        uv: mesh.uv.as_deref().map(middle),
        xyz_mm: measures::centroid(measures::corners(mesh, t)).to_array(),
        xy_mm: middle(flat),
        triangle: t,
    };
    let remedies = remedies(region.kind, peak_percent);
    Some(HotSpot { kind: region.kind, peak_percent, area_mm2: area, at, remedies })
}

/// What to try, the least work first.
fn remedies(kind: HotSpotKind, peak: f64) -> Vec<Remedy> {
    let size = peak.abs();
    let words: [String; 2] = match kind {
        HotSpotKind::Stretched => [
            format!("lay the direction in which the material gives most along the stretch here ({size:.2} %)"),
            "cut the part in two here, or let a slit run in from the nearest edge: it opens when the material is laid on"
                .into(),
        ],
        HotSpotKind::Gathered => [
            format!("let the material ease in here ({size:.2} % too long), as a seam with gathers or by shrinking does"),
            "take out a dart from the nearest edge, or put a seam through this place".into(),
        ],
        HotSpotKind::Sheared => [
            format!("turn a woven material so that its threads run at 45 degrees to the stretch: it shears by {size:.2} %"),
            "put a seam along the stretch here".into(),
        ],
        HotSpotKind::Area if peak > 0.0 => [
            format!("the part is larger than the pattern in all directions here ({size:.2} % of area): use a material that gives"),
            "put a seam through this place, so that both sides get an edge of the right length".into(),
        ],
        HotSpotKind::Area => [
            format!("the part is smaller than the pattern in all directions here ({size:.2} % of area): shrink or gather it"),
            "take out a dart that ends here, or put a seam through this place".into(),
        ],
    };
    words.into_iter().map(Remedy::say).collect()
}
