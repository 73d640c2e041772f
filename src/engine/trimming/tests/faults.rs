//! Loops that are refused, with the place, and those that are mended, with a warning.

use glam::DVec2;

use super::samples::{circle, polygon, rectangle, square, trimmed};
use crate::engine::error::{Located, Place};
use crate::engine::nurbs::{Curve2, KnotVector, shapes};
use crate::engine::trimming::{TrimCurve, TrimLoop, TrimShape, TrimmedSurface, TrimmingError};

fn errors(loops: Vec<TrimLoop>) -> Vec<TrimmingError> {
    trimmed(square(0.0, 100.0), loops).check().unwrap_err()
}

fn near(place: &Place, uv: [f64; 2], tolerance: f64) -> bool {
    let at = DVec2::from_array(place.uv.unwrap());
    let xyz = place.xyz_mm.unwrap();
    at.distance(DVec2::from_array(uv)) < tolerance && (xyz[0] - 100.0 * at.x).abs() < 1e-9
}

/// A square of four lines with a gap of `gap` in u at the corner (0.8, 0.8).
fn gapped(gap: f64) -> TrimmedSurface {
    let line = |a: [f64; 2], b: [f64; 2]| TrimCurve {
        shape: TrimShape::Polyline(vec![DVec2::from_array(a), DVec2::from_array(b)]),
        reversed: false,
    };
    let curves = vec![
        line([0.2, 0.2], [0.8, 0.2]),
        line([0.8, 0.2], [0.8, 0.8]),
        line([0.8 - gap, 0.8], [0.2, 0.8]),
        line([0.2, 0.8], [0.2, 0.2]),
    ];
    trimmed(square(0.0, 100.0), vec![TrimLoop { curves }])
}

#[test]
fn gaps_of_rounding_close_silently_small_ones_with_a_warning_and_large_ones_are_refused() {
    assert!(gapped(1e-13).check().unwrap().warnings().is_empty());
    for gap in [1e-8, 1e-6, 1e-4] {
        let face = gapped(gap);
        let trims = face.check().unwrap();
        let [warning] = trims.warnings() else { panic!("one warning") };
        assert_eq!((warning.code, warning.place.loop_index, warning.place.curve), ("gap-closed", Some(0), Some(1)));
        assert!(near(&warning.place, [0.8, 0.8], 1e-3), "{warning:?}");
        assert_eq!(trims.point(0, 1, 1.0), trims.point(0, 2, 0.0));
        assert_eq!(trims.polygonise(&face.surface, 0.1).unwrap().loops[0].points.len(), 4);
    }
    let found = gapped(0.01).check().unwrap_err();
    let [TrimmingError::Gap { loop_index: 0, curve: 1, gap_mm, place, .. }] = &found[..] else { panic!("{found:?}") };
    assert!((gap_mm - 1.0).abs() < 1e-9 && near(place, [0.8, 0.8], 1e-9) && place.t == Some(1.0));
    assert_eq!(found[0].remedies().len(), 1);
}

#[test]
fn all_faults_are_reported_at_once() {
    let open = TrimLoop { curves: vec![polygon(&[[0.1, 0.1], [0.3, 0.1], [0.3, 0.3]]).curves.remove(0)] };
    let mut open = open;
    if let TrimShape::Polyline(points) = &mut open.curves[0].shape {
        points.pop();
    }
    let found = errors(vec![
        open,
        rectangle([0.5, 0.5], [1.5, 0.9]),
        polygon(&[[0.1, 0.6], [0.4, 0.9], [0.4, 0.6], [0.1, 0.9]]),
        polygon(&[[0.6, 0.1], [0.9, 0.4]]),
        TrimLoop { curves: Vec::new() },
    ]);
    let mut codes: Vec<_> = found.iter().map(|e| (e.place().loop_index.unwrap(), e.code())).collect();
    codes.sort_unstable();
    assert_eq!(
        codes,
        [
            (0, "loop-gap"),
            (1, "loop-outside-domain"),
            (2, "loop-self-intersection"),
            (3, "loop-empty"),
            (4, "loop-empty"),
        ]
    );
}

#[test]
fn a_curve_that_leaves_the_domain_is_refused_with_the_place() {
    let found = errors(vec![circle([0.8, 0.5], 0.3)]);
    let [TrimmingError::OutsideDomain { loop_index: 0, curve: 0, place }] = &found[..] else { panic!("{found:?}") };
    assert!(place.uv.unwrap()[0] > 1.0 && place.t.is_some());
    // Its control points leave the domain, the circle does not.
    assert!(trimmed(square(0.0, 1.0), vec![circle([0.5, 0.5], 0.5)]).check().is_ok());
    let not_a_number = polygon(&[[0.1, 0.1], [f64::NAN, 0.5], [0.5, 0.5]]);
    assert!(errors(vec![not_a_number]).iter().any(|e| e.code() == "loop-outside-domain"));
}

#[test]
fn a_figure_eight_is_refused_near_where_it_crosses() {
    // One closed cubic through its middle twice, and a polyline that crosses at one of its own vertices.
    let knots = KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0], "knots").unwrap();
    let control = [[0.2, 0.2], [0.9, 0.9], [0.9, 0.1], [0.5, 0.5], [0.1, 0.9], [0.1, 0.1], [0.2, 0.2]];
    let shape = TrimShape::Nurbs(Curve2::new(knots, control.map(DVec2::from_array).to_vec(), None).unwrap());
    let curve = TrimCurve { shape, reversed: false };
    let found = errors(vec![TrimLoop { curves: vec![curve] }]);
    assert!(matches!(&found[..], [TrimmingError::SelfIntersection { .. }]), "{found:?}");

    let found = errors(vec![polygon(&[[0.1, 0.1], [0.9, 0.9], [0.9, 0.1], [0.1, 0.9]])]);
    let [TrimmingError::SelfIntersection { loop_index: 0, place }] = &found[..] else { panic!("{found:?}") };
    assert!(near(place, [0.5, 0.5], 1e-12));

    let through = polygon(&[[0.1, 0.1], [0.5, 0.5], [0.9, 0.9], [0.9, 0.1], [0.5, 0.5], [0.1, 0.9]]);
    let found = errors(vec![through]);
    let [TrimmingError::SelfIntersection { place, .. }] = &found[..] else { panic!("{found:?}") };
    assert!(near(place, [0.5, 0.5], 1e-12));
}

#[test]
fn loops_that_cross_are_refused_with_the_place() {
    let found = errors(vec![rectangle([0.1, 0.1], [0.6, 0.6]), rectangle([0.4, 0.4], [0.9, 0.9])]);
    let [TrimmingError::LoopsIntersect { loop_index: 0, other: 1, place }] = &found[..] else { panic!("{found:?}") };
    assert!(near(place, [0.6, 0.4], 1e-12) || near(place, [0.4, 0.6], 1e-12));

    // Two circles that overlap by a millionth of the domain.
    let found = errors(vec![circle([0.3, 0.5], 0.2), circle([0.7 - 1e-6, 0.5], 0.2)]);
    let [TrimmingError::LoopsIntersect { place, .. }] = &found[..] else { panic!("{found:?}") };
    assert!(near(place, [0.5, 0.5], 2e-3), "{place:?}");
    // And two that miss each other by it.
    let apart = vec![circle([0.3, 0.5], 0.2), circle([0.7 + 1e-6, 0.5], 0.2)];
    let face = trimmed(square(0.0, 100.0), apart);
    face.check().unwrap().polygonise(&face.surface, 1.0).unwrap();
}

#[test]
fn loops_that_cross_along_a_shared_stretch_are_refused() {
    let along = polygon(&[[0.3, 0.1], [0.5, 0.3], [0.7, 0.3], [0.9, 0.5], [0.9, 0.1]]);
    let found = errors(vec![rectangle([0.2, 0.3], [0.8, 0.8]), along]);
    assert!(matches!(&found[..], [TrimmingError::LoopsIntersect { .. }]), "{found:?}");
}

#[test]
fn the_same_loop_twice_is_refused() {
    for twice in [rectangle([0.2, 0.2], [0.8, 0.8]), circle([0.5, 0.5], 0.3)] {
        let found = errors(vec![twice.clone(), twice]);
        assert!(matches!(&found[..], [TrimmingError::Twins { loop_index: 0, other: 1, .. }]), "{found:?}");
    }
}

#[test]
fn a_thin_wall_between_curves_does_not_let_coarse_polylines_cross() {
    let face = trimmed(square(0.0, 1.0), vec![circle([0.5, 0.5], 0.3), circle([0.5, 0.5], 0.2999)]);
    let region = face.check().unwrap().polygonise(&face.surface, 0.02).unwrap();
    assert_eq!(region.loops[1].depth, 1);
    for [a, b] in region.loops[0].segments() {
        assert!(((a + b) * 0.5).distance(DVec2::splat(0.5)) > 0.2999 * 0.9);
    }
}

#[test]
fn a_jump_along_a_pole_is_bridged_and_a_jump_across_a_seam_is_refused() {
    let line = |a: [f64; 2], b: [f64; 2]| TrimCurve {
        shape: TrimShape::Polyline(vec![DVec2::from_array(a), DVec2::from_array(b)]),
        reversed: false,
    };
    // A quarter of a sphere without the edge at the upper pole (v = 2), and one without the edge at v = 1.
    let quarter = |top: f64| {
        let curves = vec![line([0.0, 1.0], [1.0, 1.0]), line([1.0, 1.0], [1.0, top]), line([0.0, top], [0.0, 1.0])];
        trimmed(shapes::sphere(10.0), vec![TrimLoop { curves }])
    };
    let face = quarter(2.0);
    let trims = face.check().unwrap();
    assert_eq!(trims.warnings().len(), 1);
    let region = trims.polygonise(&face.surface, 0.01).unwrap();
    assert!((region.area() - 1.0).abs() < 1e-12 && region.loops[0].points.len() == 4);

    let found = quarter(1.5).check().unwrap_err();
    let [TrimmingError::Gap { curve: 1, gap_mm, .. }] = &found[..] else { panic!("{found:?}") };
    // A quarter of the circle of latitude at 45 degrees, by chords.
    assert!((gap_mm / (10.0 * std::f64::consts::FRAC_PI_2 * 0.5_f64.sqrt()) - 1.0).abs() < 0.01, "{gap_mm}");

    let around = vec![line([0.0, 0.2], [4.0, 0.2]), line([0.0, 0.8], [4.0, 0.8])];
    let found = trimmed(shapes::cylinder(10.0, 50.0), vec![TrimLoop { curves: around }]).check().unwrap_err();
    assert_eq!(found.len(), 2, "{found:?}");
}

#[test]
fn sizes_do_not_matter() {
    for size in [1e-3, 1.0, 1e5] {
        let face = |gap: f64| {
            let mut face = gapped(gap);
            face.surface = square(0.0, size);
            face
        };
        assert_eq!(face(1e-5).check().unwrap().warnings().len(), 1);
        assert_eq!(face(1e-3).check().unwrap_err().len(), 1);
        let region = face(0.0).check().unwrap().polygonise(&face(0.0).surface, 1e-3 * size).unwrap();
        assert!((region.area() - 0.36).abs() < 1e-15);
    }
}
