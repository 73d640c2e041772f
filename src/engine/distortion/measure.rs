//! The measures of a report: changes, strains with their places and percentiles, shear, for a mesh or a part of it.
//!
//! A percentile by area is the least value such that the triangles up to it make up that share of the area in space:
//! one distorted corner triangle moves the extremes but not the 1st and 99th percentile. All values are finite, also of
//! partial and of degenerate flattenings.

use glam::DVec2;

use super::change::Original;
use super::strain::{TriangleStrain, strains};
use super::{DistortionMeasures, StrainPlace, StrainReport, Thresholds};
use crate::engine::mesh::{Mesh, Topology, measures};

/// Share of the area below the lower and above the upper percentile.
const TAIL: f64 = 0.01;

/// Measures a flattening, or the triangles of it that `part` marks.
#[must_use]
pub fn measure(
    mesh: &Mesh,
    topology: &Topology,
    flat: &[DVec2],
    part: Option<&[bool]>,
    thresholds: Thresholds,
) -> DistortionMeasures {
    let original = Original::new(mesh, topology, part);
    let area = original.area_change(flat, thresholds);
    let shape = original.shape_change(flat, thresholds);
    let counted: Vec<Counted> = strains(mesh, flat)
        .into_iter()
        .enumerate()
        .filter(|(t, _)| part.is_none_or(|p| p.get(*t) == Some(&true)))
        .filter_map(|(t, strain)| {
            let triangle = t as u32;
            strain.map(|strain| Counted { triangle, strain, area: measures::area(measures::corners(mesh, triangle)) })
        })
        .collect();
    let total: f64 = counted.iter().map(|c| c.area).sum();
    let dirichlet: f64 = counted.iter().map(|c| c.area * c.strain.symmetric_dirichlet()).sum();
    let shear_max = counted.iter().map(|c| c.strain.shear_deg()).fold(0.0, f64::max);
    DistortionMeasures {
        area_change_percent: area.percent(),
        shape_change_percent: shape.percent(),
        relative_area: area.relative(),
        relative_shape: shape.relative(),
        average_area_change_mm2: area.average,
        average_shape_change_mm: shape.average,
        strain_percent: strain_report(mesh, flat, &counted),
        shear_deg: [shear_max, percentile(&counted, 1.0 - TAIL, TriangleStrain::shear_deg)],
        symmetric_dirichlet: if total > 0.0 { dirichlet / total } else { 4.0 },
        triangles: counted.len() as u64,
    }
}

/// A triangle that counts.
struct Counted {
    triangle: u32,
    strain: TriangleStrain,
    area: f64,
}

fn strain_report(mesh: &Mesh, flat: &[DVec2], counted: &[Counted]) -> StrainReport {
    let least = |s: TriangleStrain| s.percent()[0];
    let greatest = |s: TriangleStrain| s.percent()[1];
    // The first of equals, that is the one with the least number.
    let (mut at_min, mut at_max): (Option<&Counted>, Option<&Counted>) = (None, None);
    for c in counted {
        if at_min.is_none_or(|m| least(c.strain) < least(m.strain)) {
            at_min = Some(c);
        }
        if at_max.is_none_or(|m| greatest(c.strain) > greatest(m.strain)) {
            at_max = Some(c);
        }
    }
    StrainReport {
        min: at_min.map_or(0.0, |c| least(c.strain)),
        max: at_max.map_or(0.0, |c| greatest(c.strain)),
        p01: percentile(counted, TAIL, least),
        p99: percentile(counted, 1.0 - TAIL, greatest),
        at_min: at_min.map_or_else(StrainPlace::default, |c| place(mesh, flat, c.triangle)),
        at_max: at_max.map_or_else(StrainPlace::default, |c| place(mesh, flat, c.triangle)),
    }
}

/// The centroid of a triangle in all its worlds.
fn place(mesh: &Mesh, flat: &[DVec2], triangle: u32) -> StrainPlace {
    let corners = mesh.triangles[triangle as usize];
    let middle = |p: &[DVec2]| (corners.iter().map(|&v| p[v as usize]).sum::<DVec2>() / 3.0).to_array();
    StrainPlace {
        uv: mesh.uv.as_deref().map(middle),
        xyz_mm: measures::centroid(measures::corners(mesh, triangle)).to_array(),
        xy_mm: middle(flat),
        triangle,
    }
}

/// The least value up to which the triangles make up `share` of the area; 0 when there are none.
fn percentile(counted: &[Counted], share: f64, value: impl Fn(TriangleStrain) -> f64) -> f64 {
    let mut values: Vec<(f64, f64)> = counted.iter().map(|c| (value(c.strain), c.area)).collect();
    // Stable: equal values stay in the order of their triangles, and so does the sum.
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let wanted = share * values.iter().map(|v| v.1).sum::<f64>();
    let mut sum = 0.0;
    for &(value, area) in &values {
        sum += area;
        if sum >= wanted {
            return value;
        }
    }
    values.last().map_or(0.0, |v| v.0)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    fn plane() -> (Mesh, Topology, Vec<DVec2>) {
        let mesh = grid(21, 21, Diagonal::Regular, |u, v| DVec3::new(40.0 * u, 30.0 * v, 0.0));
        let topology = Topology::new(&mesh).unwrap();
        let flat = mesh.positions.iter().map(|p| p.truncate()).collect();
        (mesh, topology, flat)
    }

    #[test]
    fn the_identity_distorts_nothing() {
        let (mesh, topology, flat) = plane();
        let m = measure(&mesh, &topology, &flat, None, Thresholds::default());
        assert_eq!((m.area_change_percent, m.shape_change_percent, m.average_area_change_mm2), (0.0, 0.0, 0.0));
        assert!((m.symmetric_dirichlet - 4.0).abs() < 1e-12 && m.triangles == 800);
        assert!(m.strain_percent.min.abs() < 1e-10 && m.strain_percent.max.abs() < 1e-10);
    }

    #[test]
    fn one_corner_triangle_is_an_extreme_with_its_place_and_no_percentile() {
        let (mesh, topology, mut flat) = plane();
        // The corner at the origin is pulled outwards: its triangles 0 and 1 are larger in the pattern, so gathered.
        flat[0] = DVec2::new(-1.0, -1.0);
        let m = measure(&mesh, &topology, &flat, None, Thresholds::default());
        assert!(m.strain_percent.min < -20.0);
        assert!(m.strain_percent.at_min.triangle < 2);
        assert!(m.strain_percent.at_min.uv.unwrap()[0] < 0.05);
        assert!(m.strain_percent.at_min.xy_mm[0] < 2.0);
        assert!(m.strain_percent.p01.abs() < 1e-10 && m.strain_percent.p99.abs() < 1e-10);
        assert!(m.shear_deg[0] > 1.0 && m.shear_deg[1] < 1e-10);
    }

    #[test]
    fn a_part_is_measured_by_itself() {
        let (mesh, topology, mut flat) = plane();
        flat[0] = DVec2::new(-1.0, -1.0);
        let part: Vec<bool> = (0..800).map(|t| t >= 2).collect();
        let m = measure(&mesh, &topology, &flat, Some(&part), Thresholds::default());
        assert_eq!((m.area_change_percent, m.triangles), (0.0, 798));
    }

    #[test]
    fn partial_and_collapsed_flattenings_give_finite_numbers() {
        let (mesh, topology, flat) = plane();
        let nothing = vec![DVec2::NAN; flat.len()];
        let collapsed = vec![DVec2::ZERO; flat.len()];
        let mut partial = flat;
        partial[200..].fill(DVec2::NAN);
        for flat in [nothing, collapsed, partial] {
            let m = measure(&mesh, &topology, &flat, None, Thresholds::default());
            let text = serde_json::to_string(&m).unwrap();
            // serde_json writes what is not finite as null; where nothing was reached the extremes have no place.
            assert!(!text.replace("\"uv\":null", "").contains("null"), "{text}");
        }
    }

    proptest! {
        #[test]
        fn measures_do_not_depend_on_where_the_pattern_lies(angle in 0.0..6.3, x in -99.0..99.0, k in 0.0..0.01) {
            let (mesh, topology, flat) = plane();
            let bent: Vec<DVec2> = flat.iter().map(|p| DVec2::new(p.x + k * p.y * p.y, p.y)).collect();
            let turn = DVec2::from_angle(angle);
            let moved: Vec<DVec2> = bent.iter().map(|p| turn.rotate(*p) + DVec2::splat(x)).collect();
            let one = measure(&mesh, &topology, &bent, None, Thresholds::default());
            let two = measure(&mesh, &topology, &moved, None, Thresholds::default());
            prop_assert!((one.area_change_percent - two.area_change_percent).abs() < 1e-9);
            prop_assert!((one.strain_percent.max - two.strain_percent.max).abs() < 1e-8);
            prop_assert!((one.shear_deg[0] - two.shear_deg[0]).abs() < 1e-8);
        }
    }
}
