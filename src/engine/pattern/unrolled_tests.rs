//! Patterns of surfaces that were unrolled exactly: however coarse the mesh is, outlines are true.

use std::f64::consts::PI;

use glam::DVec2;

use super::{DrawInput, Drawn, Locator, Placement, draw, triangles_of_part};
use crate::engine::budget::Unobserved;
use crate::engine::flattening::developable::{DEVELOPABLE_STRAIN, unroll};
use crate::engine::mesh::Topology;
use crate::engine::nurbs::Surface;
use crate::engine::nurbs::shapes::{circle2, cylinder};
use crate::engine::triangulation::{Configuration, GridLines, grid_mesh, lift};
use crate::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};

/// The pattern of a surface on a mesh of m x n points, unrolled.
fn drawn(surface: &Surface, loops: Vec<TrimLoop>, [m, n]: [usize; 2], tolerance: f64) -> Drawn {
    let lines = GridLines::uniform(surface.domain(), m, n);
    let lifted = lift(surface, grid_mesh(&lines, Configuration::Regular, 0), &lines);
    let exact = unroll(surface, surface.domain(), DEVELOPABLE_STRAIN, &Unobserved).unwrap().expect("developable");
    let flat: Vec<DVec2> = lifted.mesh.uv.as_ref().unwrap().iter().map(|&uv| exact.map(uv)).collect();
    let trimmed = TrimmedSurface { surface: surface.clone(), loops, side: Side::Normal };
    let trims = trimmed.check().unwrap();
    let region = trims.polygonise(surface, 1e-3).unwrap();
    let locator = Locator::new(&lifted.domain, &Unobserved).unwrap();
    let part = triangles_of_part(&lifted, &locator, &region, &Unobserved).unwrap();
    let input = DrawInput {
        surface,
        side: Side::Normal,
        trims: &trims,
        lifted: &lifted,
        topology: &Topology::new(&lifted.mesh).unwrap(),
        locator: &locator,
        exact: Some(&exact),
        flat: &flat,
        part: &part,
        placement: &Placement::default(),
        holds: &[],
        curve_tolerance_mm: Some(tolerance),
    };
    let mut drawn = draw(&input, &Unobserved).unwrap();
    drawn.finish(&super::Finishing::default(), &Unobserved).unwrap();
    drawn
}

#[test]
fn the_outline_of_a_cylinder_has_its_true_lengths_on_the_coarsest_mesh() {
    let (radius, height) = (10.0, 30.0);
    let drawn = drawn(&cylinder(radius, height), Vec::new(), [9, 2], 1e-3);
    let mut sides = drawn.pattern.bounding_box_mm;
    sides.sort_unstable_by(f64::total_cmp);
    assert!((sides[0] - height).abs() < 1e-10 && (sides[1] - 2.0 * PI * radius).abs() < 1e-10, "{sides:?}");
    let boundary = &drawn.boundary[0];
    assert!((boundary.length_2d_mm / boundary.length_3d_mm - 1.0).abs() < 1e-10, "{boundary:?}");
    // The mesh itself is shorter by its chords.
    assert!(boundary.length_mesh_mm < 0.99 * boundary.length_3d_mm);
}

#[test]
fn a_circle_in_the_domain_of_a_cylinder_is_drawn_within_the_tolerance() {
    let surface = cylinder(10.0, 30.0);
    let circle = TrimCurve { shape: TrimShape::Nurbs(circle2(DVec2::new(2.0, 0.5), 0.4)), reversed: false };
    for tolerance in [1e-2, 1e-4] {
        let drawn = drawn(&surface, vec![TrimLoop { curves: vec![circle.clone()] }], [9, 3], tolerance);
        let boundary = &drawn.boundary[0];
        assert!((boundary.length_2d_mm / boundary.length_3d_mm - 1.0).abs() < 1e-8, "{boundary:?}");
        // In arc length and height its points satisfy the circle's equation, on either side by no more than asked.
        let points = &drawn.pattern.pieces[0].outline.points;
        let middle = points
            .iter()
            .copied()
            .fold(DVec2::INFINITY, DVec2::min)
            .midpoint(points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max));
        let place = |p: DVec2| {
            let angle = p.x / 10.0;
            // u runs as a rational quadratic over each quarter: tan of a quarter's part.
            let quarter = |a: f64| 0.5 + 0.5 * ((a - PI / 4.0) / 2.0).tan() / (PI / 8.0).tan();
            let (whole, rest) = ((angle / (PI / 2.0)).floor(), angle.rem_euclid(PI / 2.0));
            DVec2::new(whole + quarter(rest), p.y / 30.0)
        };
        for p in points {
            let uv = place(*p - middle);
            assert!((uv.length() - 0.4).abs() < 2.0 * tolerance / 15.0 + 1e-9, "{tolerance}: {uv}");
        }
    }
}
