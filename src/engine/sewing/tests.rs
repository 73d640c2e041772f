//! Parts of known shape, cut into faces: sewn they are what they were.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::{Cut, CutPoints, Join, Part, SewingOptions};
use crate::engine::budget::Unobserved;
use crate::engine::error::EngineError;
use crate::engine::job::{JobKind, JobOptions};
use crate::engine::nurbs::Surface;
use crate::engine::nurbs::shapes::{circle2, cylinder, plane, sphere};
use crate::engine::pipeline::{Outcome, run};
use crate::engine::sewing::SewingReport;
use crate::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};

fn face(surface: Surface, loops: Vec<TrimLoop>) -> TrimmedSurface {
    TrimmedSurface { surface, loops, side: Side::Normal }
}

fn plate(low: [f64; 2], high: [f64; 2]) -> TrimmedSurface {
    face(plane(high[0] - low[0], high[1] - low[1]).translated(DVec3::new(low[0], low[1], 0.0)), Vec::new())
}

fn window(low: [f64; 2], high: [f64; 2]) -> TrimLoop {
    let points = [low, [high[0], low[1]], high, [low[0], high[1]], low].map(DVec2::from).to_vec();
    TrimLoop { curves: vec![TrimCurve { shape: TrimShape::Polyline(points), reversed: false }] }
}

fn circle(centre: [f64; 2], radius: f64) -> TrimLoop {
    let shape = TrimShape::Nurbs(circle2(DVec2::from(centre), radius));
    TrimLoop { curves: vec![TrimCurve { shape, reversed: false }] }
}

fn sewn_by(faces: Vec<TrimmedSurface>, sewing: SewingOptions) -> Outcome {
    let options = JobOptions { sewing: Some(sewing), ..JobOptions::default() };
    run(JobKind::Flatten, &Part { faces }, &options, &Unobserved).unwrap()
}

fn sewn(faces: Vec<TrimmedSurface>) -> Outcome {
    sewn_by(faces, SewingOptions::default())
}

fn report(outcome: &Outcome) -> &SewingReport {
    outcome.report.sewing.as_ref().unwrap()
}

/// Pieces, holes, area and perimeter of the pattern.
fn drawn(outcome: &Outcome) -> (usize, usize, f64, f64) {
    let (pattern, told) = (outcome.pattern.as_ref().unwrap(), outcome.report.pattern.as_ref().unwrap());
    let holes = pattern.pieces.iter().map(|piece| piece.holes.len()).sum();
    (pattern.pieces.len(), holes, told.area_mm2, told.perimeter_mm)
}

fn close(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() <= relative * b.abs()
}

#[test]
fn one_long_edge_meets_two_short_ones() {
    let outcome = sewn(vec![
        plate([0.0, 0.0], [100.0, 60.0]),
        plate([100.0, 0.0], [150.0, 25.0]),
        plate([100.0, 25.0], [150.0, 60.0]),
    ]);
    let (pieces, holes, area, perimeter) = drawn(&outcome);
    assert_eq!((pieces, holes), (1, 0), "{:?}", report(&outcome));
    assert!(close(area, 9000.0, 1e-9) && close(perimeter, 420.0, 1e-9), "{area} {perimeter}");
    let told = report(&outcome);
    assert_eq!((told.faces, told.joined_borders, told.near_misses.is_none()), (3, 3, true), "{told:?}");
    assert!(close(told.joined_mm, 110.0, 1e-9) && told.greatest_gap_mm < 1e-12);
    assert!(outcome.report.warnings.is_empty(), "{:?}", outcome.report.warnings);
}

#[test]
fn a_border_that_is_shared_in_part_is_joined_there() {
    let outcome = sewn(vec![plate([0.0, 0.0], [100.0, 60.0]), plate([30.0, 60.0], [130.0, 90.0])]);
    let (pieces, holes, area, perimeter) = drawn(&outcome);
    assert_eq!((pieces, holes), (1, 0));
    assert!(close(area, 9000.0, 1e-9) && close(perimeter, 580.0 - 140.0, 1e-9), "{area} {perimeter}");
    assert!(close(report(&outcome).joined_mm, 70.0, 1e-9));
}

#[test]
fn a_plug_fills_its_hole() {
    let mut outer = plate([0.0, 0.0], [100.0, 100.0]);
    outer.loops = vec![window([0.0, 0.0], [1.0, 1.0]), circle([0.4, 0.5], 0.25)];
    // The plug's own domain is another one, so nothing is sampled alike by chance.
    let plug = face(plane(80.0, 80.0), vec![circle([0.5, 0.625], 0.3125)]);
    let outcome = sewn(vec![outer, plug]);
    let (pieces, holes, area, perimeter) = drawn(&outcome);
    assert_eq!((pieces, holes), (1, 0), "{:?}", report(&outcome));
    assert!(close(area, 1e4, 1e-9) && close(perimeter, 400.0, 1e-9), "{area} {perimeter}");
    let told = report(&outcome);
    assert!(close(told.joined_mm, 50.0 * PI, 1e-3) && told.greatest_gap_mm < 2e-3, "{told:?}");
}

#[test]
fn strips_of_a_cylinder_lie_flat_as_the_whole_does() {
    let strip =
        |from: f64, to: f64, low: f64, high: f64| face(cylinder(50.0, 80.0), vec![window([from, low], [to, high])]);
    // Three strips up to the seam of the first quarters, the last one in two.
    let outcome = sewn(vec![
        strip(0.0, 0.7, 0.0, 1.0),
        strip(0.7, 1.1, 0.0, 1.0),
        strip(1.1, 2.0, 0.0, 0.45),
        strip(1.1, 2.0, 0.45, 1.0),
    ]);
    let (pieces, holes, area, perimeter) = drawn(&outcome);
    assert_eq!((pieces, holes), (1, 0));
    assert!(close(area, 50.0 * PI * 80.0, 1e-3), "{area}");
    assert!(close(perimeter, 2.0 * (50.0 * PI + 80.0), 1e-3), "{perimeter}");
    let strain = &outcome.report.distortion.as_ref().unwrap().part.strain_percent;
    assert!(strain.max < 0.1 && strain.min > -0.1, "{} {}", strain.min, strain.max);
    assert_eq!(report(&outcome).joined_borders, 4);
}

#[test]
fn patches_of_a_sphere_come_out_as_the_whole_patch() {
    let sphere = || sphere(100.0);
    let d = sphere().domain();
    let at = |s: f64, t: f64| [d.u[0] + s * (d.u[1] - d.u[0]), d.v[0] + t * (d.v[1] - d.v[0])];
    let patch = |low: [f64; 2], high: [f64; 2]| face(sphere(), vec![window(at(low[0], low[1]), at(high[0], high[1]))]);
    let whole = run(JobKind::Flatten, &patch([0.1, 0.3], [0.3, 0.6]), &JobOptions::default(), &Unobserved).unwrap();
    let parts = sewn(vec![
        patch([0.1, 0.3], [0.17, 0.6]),
        patch([0.17, 0.3], [0.3, 0.42]),
        patch([0.17, 0.42], [0.24, 0.6]),
        patch([0.24, 0.42], [0.3, 0.6]),
    ]);
    let (a, b) = (drawn(&whole), drawn(&parts));
    assert_eq!((b.0, b.1), (1, 0));
    assert!(close(b.2, a.2, 2e-3) && close(b.3, a.3, 2e-3), "{a:?} {b:?}");
    let [a, b] = [&whole, &parts].map(|o| o.report.distortion.as_ref().unwrap().part.area_change_percent);
    assert!((a - b).abs() < 0.1, "{a} {b}");
}

/// The faces of an open box of 40 x 30 x 20.
fn open_box() -> Vec<TrimmedSurface> {
    let bilinear = |o: [f64; 3], a: [f64; 3], b: [f64; 3]| {
        let line = crate::engine::nurbs::shapes::knots(1, &[0.0, 0.0, 1.0, 1.0]);
        let [o, a, b] = [o, a, b].map(DVec3::from);
        face(Surface::new(line.clone(), line, vec![o, o + b, o + a, o + a + b], None).unwrap(), Vec::new())
    };
    vec![
        bilinear([0.0; 3], [40.0, 0.0, 0.0], [0.0, 30.0, 0.0]),
        bilinear([0.0; 3], [0.0, 0.0, 20.0], [40.0, 0.0, 0.0]),
        bilinear([0.0; 3], [0.0, 30.0, 0.0], [0.0, 0.0, 20.0]),
        bilinear([40.0, 0.0, 0.0], [0.0, 0.0, 20.0], [0.0, 30.0, 0.0]),
        bilinear([0.0, 30.0, 0.0], [40.0, 0.0, 0.0], [0.0, 0.0, 20.0]),
    ]
}

#[test]
fn the_faces_of_a_box_kept_apart_have_seams_of_equal_lengths() {
    let outcome = sewn_by(open_box(), SewingOptions { join: Join::None, tolerance_mm: None });
    let (pieces, holes, area, _) = drawn(&outcome);
    assert_eq!((pieces, holes), (5, 0));
    assert!(close(area, 1200.0 + 2.0 * 800.0 + 2.0 * 600.0, 1e-9), "{area}");
    let seams = &outcome.pattern.as_ref().unwrap().seams;
    assert_eq!(seams.len(), 8);
    let mut lengths: Vec<i64> = seams.iter().map(|seam| seam.length_3d_mm.round() as i64).collect();
    lengths.sort_unstable();
    assert_eq!(lengths, [20, 20, 20, 20, 30, 30, 40, 40]);
    for seam in seams {
        assert!(seam.mismatch_mm() < 1e-9 && close(seam.sides[0].length_mm, seam.length_3d_mm, 1e-9), "{seam:?}");
        assert_eq!(seam.sides[0].points.len(), seam.sides[1].points.len());
        for side in &seam.sides {
            let outline = &outcome.pattern.as_ref().unwrap().pieces[side.piece as usize].outline.points;
            let on = |p: &DVec2| outline.iter().any(|q| p.distance(*q) < 1e-9);
            assert!(side.points.iter().all(on), "a seam runs along its piece's outline");
        }
    }
}

#[test]
fn an_open_box_sewn_is_one_piece_whose_faces_look_the_same_way() {
    let mut faces = open_box();
    faces[3].side = Side::Reversed;
    let options = JobOptions::default();
    let outcome = run(JobKind::Triangulate, &Part { faces }, &options, &Unobserved).unwrap();
    assert_eq!((outcome.report.triangulation.pieces, outcome.report.triangulation.borders), (1, 1));
    let told = report(&outcome);
    assert_eq!(told.joined_borders, 8, "{told:?}");
    assert!(told.faces_turned > 0 && !outcome.report.warnings.is_empty());
    let topology = crate::engine::mesh::Topology::new(&outcome.mesh).unwrap();
    assert_eq!(topology.border_count(), 1);
}

#[test]
fn what_lies_within_the_tolerance_is_joined_and_what_does_not_is_told() {
    let gap = |mm: f64| vec![plate([0.0, 0.0], [100.0, 60.0]), plate([100.0 + mm, 0.0], [150.0, 60.0])];
    let joined = sewn(gap(0.01));
    assert_eq!(drawn(&joined).0, 1);
    assert!(close(report(&joined).greatest_gap_mm, 0.01, 1e-6), "{:?}", report(&joined));
    let apart = sewn(gap(0.1));
    assert_eq!(drawn(&apart).0, 2);
    let missed = report(&apart).near_misses.as_ref().unwrap();
    assert!(close(missed.gap_mm[1], 0.1, 1e-6) && close(missed.length_mm, 120.0, 1e-6), "{missed:?}");
    assert!(apart.report.warnings.iter().any(|warning| warning.contains("sewing.tolerance_mm")));
    let wider = sewn_by(gap(0.1), SewingOptions { tolerance_mm: Some(0.2), ..SewingOptions::default() });
    assert_eq!(drawn(&wider).0, 1);
}

#[test]
fn curves_that_part_between_their_ends_are_not_joined() {
    // An arc and its chord: they meet at two corners alone.
    let mut cap = plate([0.0, 0.0], [100.0, 100.0]);
    let arc: Vec<DVec2> = (0..=40)
        .map(|k| {
            let angle = PI * f64::from(k) / 40.0;
            DVec2::new(0.5 + 0.5 * angle.cos(), 0.3 * angle.sin())
        })
        .collect();
    let back = vec![DVec2::new(0.0, 0.0), DVec2::new(0.0, 1.0), DVec2::new(1.0, 1.0), DVec2::new(1.0, 0.0)];
    let curve = |points| TrimCurve { shape: TrimShape::Polyline(points), reversed: false };
    cap.loops = vec![TrimLoop { curves: vec![curve(arc), curve(back)] }];
    let outcome = sewn(vec![cap, plate([0.0, -50.0], [100.0, 0.0])]);
    assert_eq!(drawn(&outcome).0, 2, "{:?}", report(&outcome));
    assert_eq!(report(&outcome).joined_edges, 0);
}

#[test]
fn the_same_face_twice_counts_once() {
    let outcome = sewn(vec![
        plate([0.0, 0.0], [100.0, 60.0]),
        plate([0.0, 0.0], [100.0, 60.0]),
        plate([100.0, 0.0], [150.0, 60.0]),
    ]);
    assert_eq!(drawn(&outcome).0, 1);
    assert_eq!((report(&outcome).faces, report(&outcome).faces_doubled), (3, 1));
}

#[test]
fn a_face_that_closes_on_itself_keeps_its_seam_when_a_lid_is_sewn_on() {
    let lid = face(plane(200.0, 200.0).translated(DVec3::new(-100.0, -100.0, 80.0)), vec![circle([0.5, 0.5], 0.25)]);
    let options = JobOptions::default();
    let part = Part { faces: vec![face(cylinder(50.0, 80.0), Vec::new()), lid] };
    let outcome = run(JobKind::Triangulate, &part, &options, &Unobserved).unwrap();
    assert_eq!(
        (outcome.report.triangulation.pieces, outcome.report.triangulation.borders),
        (1, 1),
        "{:?}",
        report(&outcome)
    );
    assert!(close(report(&outcome).joined_mm, 100.0 * PI, 1e-3), "{:?}", report(&outcome));
}

#[test]
fn settings_without_meaning_on_several_faces_are_refused() {
    let part = Part { faces: vec![plate([0.0, 0.0], [100.0, 60.0])] };
    for (tolerance, sound) in [(f64::NAN, false), (0.0, false), (-1.0, false), (50.0, false), (1e-9, true), (1.0, true)]
    {
        let sewing = SewingOptions { tolerance_mm: Some(tolerance), ..SewingOptions::default() };
        let options = JobOptions { sewing: Some(sewing), ..JobOptions::default() };
        let found = run(JobKind::Flatten, &part, &options, &Unobserved);
        assert_eq!(found.is_ok(), sound, "{tolerance}");
        if let Err(failure) = found {
            assert!(matches!(failure.error, EngineError::Parameter { name, .. } if name == "sewing.tolerance_mm"));
        }
    }
    let none = run(JobKind::Flatten, &Part::default(), &JobOptions::default(), &Unobserved);
    assert!(none.is_err());
}

#[test]
fn as_many_faces_as_there_may_be_on_one_place_end_in_bounded_work() {
    // Faces that lie on each other, each a little different so that none counts as the same.
    let faces = (0..200).map(|k| plate([0.0, 0.0], [100.0 + 1e-7 * f64::from(k), 60.0])).collect();
    let found = run(JobKind::Triangulate, &Part { faces }, &JobOptions::default(), &Unobserved);
    assert!(found.is_ok_and(|outcome| outcome.report.triangulation.pieces >= 1));
}

#[test]
fn threads_decide_nothing() {
    let faces = || open_box();
    let options =
        JobOptions { sewing: Some(SewingOptions { join: Join::None, tolerance_mm: None }), ..JobOptions::default() };
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(JobKind::Flatten, &Part { faces: faces() }, &options, &Unobserved).unwrap())
    };
    let (one, three) = (by(1), by(3));
    assert!(one == three);
}

fn cut_by(faces: Vec<TrimmedSurface>, cuts: Vec<Cut>) -> Outcome {
    let options = JobOptions { cuts, ..JobOptions::default() };
    run(JobKind::Flatten, &Part { faces }, &options, &Unobserved).unwrap()
}

fn uv(points: &[[f64; 2]]) -> Cut {
    Cut { face: None, points: CutPoints::Uv(points.to_vec()) }
}

#[test]
fn a_style_line_makes_two_pieces_of_a_plate_and_a_seam_between_them() {
    let line = [[0.2, -0.1], [0.43, 0.31], [0.6, 0.7], [0.55, 1.2]];
    let outcome = cut_by(vec![plate([0.0, 0.0], [100.0, 60.0])], vec![uv(&line)]);
    let (pieces, holes, area, perimeter) = drawn(&outcome);
    // The line without what lies outside the plate.
    let at = |p: [f64; 2]| DVec2::new(100.0 * p[0], 60.0 * p[1]);
    let clipped = |a: DVec2, b: DVec2, y: f64| a.lerp(b, (y - a.y) / (b.y - a.y));
    let [a, b, c, d] = line.map(at);
    let (start, end) = (clipped(a, b, 0.0), clipped(c, d, 60.0));
    let length = start.distance(b) + b.distance(c) + c.distance(end);
    assert_eq!((pieces, holes), (2, 0));
    assert!(close(area, 6000.0, 1e-9) && close(perimeter, 320.0 + 2.0 * length, 1e-6), "{area} {perimeter} {length}");
    let seams = &outcome.pattern.as_ref().unwrap().seams;
    assert_eq!(seams.len(), 1, "{seams:?}");
    assert!(close(seams[0].length_3d_mm, length, 1e-6) && seams[0].mismatch_mm() < 1e-9, "{seams:?}");
    assert_ne!(seams[0].sides[0].piece, seams[0].sides[1].piece);
}

#[test]
fn a_single_surface_is_cut_as_a_part_of_one_face_is() {
    let surface = plate([0.0, 0.0], [100.0, 60.0]);
    let options = JobOptions { cuts: vec![uv(&[[0.5, 0.0], [0.5, 1.0]])], ..JobOptions::default() };
    let outcome = run(JobKind::Flatten, &surface, &options, &Unobserved).unwrap();
    assert_eq!(drawn(&outcome).0, 2);
    assert!(close(outcome.pattern.as_ref().unwrap().seams[0].length_3d_mm, 60.0, 1e-9));
}

#[test]
fn a_dart_leaves_one_piece_with_a_seam_along_itself() {
    let outcome = cut_by(vec![plate([0.0, 0.0], [100.0, 60.0])], vec![uv(&[[0.37, 0.0], [0.41, 0.55]])]);
    let (pieces, holes, area, perimeter) = drawn(&outcome);
    let length = DVec2::new(4.0, 33.0).length();
    assert_eq!((pieces, holes), (1, 0));
    assert!(close(area, 6000.0, 1e-9) && close(perimeter, 320.0 + 2.0 * length, 1e-6), "{area} {perimeter}");
    let seams = &outcome.pattern.as_ref().unwrap().seams;
    assert!(seams.len() == 1 && seams[0].sides[0].piece == seams[0].sides[1].piece, "{seams:?}");
    assert!(close(seams[0].sides[0].length_mm, length, 1e-6) && seams[0].mismatch_mm() < 1e-9);
}

#[test]
fn a_tube_of_strips_opened_along_a_line_lies_flat() {
    let strip = |from: f64, to: f64| face(cylinder(50.0, 80.0), vec![window([from, 0.0], [to, 1.0])]);
    let line = |z: f64| [-50.0, 0.0, z];
    let cut = Cut { face: None, points: CutPoints::Xyz(vec![line(0.0), line(40.0), line(80.0)]) };
    let outcome = cut_by(vec![strip(0.0, 1.3), strip(1.3, 2.9), strip(2.9, 4.0)], vec![cut]);
    let (pieces, holes, area, _) = drawn(&outcome);
    assert_eq!((pieces, holes), (1, 0), "{:?}", report(&outcome));
    assert!(close(area, 2.0 * PI * 50.0 * 80.0, 2e-3), "{area}");
    let seams = &outcome.pattern.as_ref().unwrap().seams;
    assert!(seams.len() == 1 && close(seams[0].length_3d_mm, 80.0, 1e-6), "{seams:?}");
    assert!(seams[0].mismatch_mm() < 0.01, "{seams:?}");
    let strain = &outcome.report.distortion.as_ref().unwrap().part.strain_percent;
    assert!(strain.max < 0.5 && strain.min > -0.5, "{} {}", strain.min, strain.max);
}

#[test]
fn cuts_that_cross_make_four_pieces_and_less_distortion() {
    let sphere = sphere(100.0);
    let d = sphere.domain();
    let at = |s: f64, t: f64| [d.u[0] + s * (d.u[1] - d.u[0]), d.v[0] + t * (d.v[1] - d.v[0])];
    let patch = || face(sphere.clone(), vec![window(at(0.1, 0.3), at(0.3, 0.6))]);
    let whole = sewn(vec![patch()]);
    let cuts = vec![uv(&[at(0.1, 0.45), at(0.2, 0.47), at(0.3, 0.45)]), uv(&[at(0.21, 0.2), at(0.19, 0.9)])];
    let outcome = cut_by(vec![patch()], cuts);
    assert_eq!(drawn(&outcome).0, 4);
    assert!(close(drawn(&outcome).2, drawn(&whole).2, 0.02));
    let [all, parts] = [&whole, &outcome].map(|o| o.report.distortion.as_ref().unwrap().part.area_change_percent);
    assert!(parts < 0.5 * all, "{parts} {all}");
    let seams = &outcome.pattern.as_ref().unwrap().seams;
    assert!(seams.len() >= 2, "{seams:?}");
}

#[test]
fn the_border_of_a_cut_face_is_sewn_all_the_same() {
    let faces = vec![plate([0.0, 0.0], [100.0, 60.0]), plate([100.0, 0.0], [150.0, 60.0])];
    let one = Cut { face: Some(0), ..uv(&[[0.0, 0.5], [1.0, 0.5]]) };
    // Both halves hang on the neighbour.
    let outcome = cut_by(faces.clone(), vec![one.clone()]);
    assert_eq!(drawn(&outcome).0, 1);
    let two = Cut { face: Some(1), ..uv(&[[0.0, 0.5], [1.0, 0.5]]) };
    let outcome = cut_by(faces, vec![one, two]);
    let (pieces, holes, area, perimeter) = drawn(&outcome);
    assert_eq!((pieces, holes), (2, 0), "{:?}", report(&outcome));
    assert!(close(area, 9000.0, 1e-9) && close(perimeter, 2.0 * 360.0, 1e-9), "{area} {perimeter}");
}

#[test]
fn cuts_that_lie_nowhere_are_refused() {
    let faces = || vec![plate([0.0, 0.0], [100.0, 60.0]), plate([100.0, 0.0], [150.0, 60.0])];
    let far = Cut { face: None, points: CutPoints::Xyz(vec![[0.0, 0.0, 90.0], [100.0, 0.0, 90.0]]) };
    for (cut, word) in [
        (uv(&[[0.0, 0.5], [1.0, 0.5]]), "need the `face`"),
        (Cut { face: Some(2), ..uv(&[[0.0, 0.5], [1.0, 0.5]]) }, "there is no face 2"),
        (far, "mm off the nearest"),
    ] {
        let options = JobOptions { cuts: vec![cut], ..JobOptions::default() };
        let failure = run(JobKind::Flatten, &Part { faces: faces() }, &options, &Unobserved).unwrap_err();
        assert!(failure.error.to_string().contains(word), "{}", failure.error);
    }
    // One that lies outside altogether cuts nothing.
    let outside = cut_by(vec![plate([0.0, 0.0], [100.0, 60.0])], vec![uv(&[[2.0, 0.0], [3.0, 1.0]])]);
    assert_eq!(drawn(&outside).0, 1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_cut_leaves_a_sound_mesh_of_the_same_area(
        points in proptest::collection::vec([-0.2..1.2_f64, -0.2..1.2_f64], 2..7),
        on_grid in any::<bool>(),
    ) {
        // Places on lines of the grid and on corners are met as well as those between them.
        let place = |x: f64| if on_grid { (4.0 * x).round() / 4.0 } else { x };
        let points: Vec<[f64; 2]> = points.into_iter().map(|p| p.map(place)).collect();
        let mut options = JobOptions { cuts: vec![uv(&points)], ..JobOptions::default() };
        options.triangulation.grid = Some([5, 5]);
        let part = Part { faces: vec![plate([0.0, 0.0], [100.0, 60.0])] };
        let outcome = run(JobKind::Triangulate, &part, &options, &Unobserved).unwrap();
        prop_assert!(crate::engine::mesh::Topology::new(&outcome.mesh).is_ok());
        prop_assert!(close(outcome.report.triangulation.area_mm2, 6000.0, 1e-9));
    }
}

#[test]
fn a_tolerance_near_nothing_and_a_fine_outline_are_bounded_work() {
    let strip = |from: f64, to: f64| face(cylinder(50.0, 80.0), vec![window([from, 0.0], [to, 1.0])]);
    let options = JobOptions {
        sewing: Some(SewingOptions { tolerance_mm: Some(1e-300), ..SewingOptions::default() }),
        curve_tolerance_mm: Some(1e-300),
        ..JobOptions::default()
    };
    let part = Part { faces: vec![strip(0.0, 0.7), strip(0.7, 2.0)] };
    let outcome = run(JobKind::Triangulate, &part, &options, &Unobserved).unwrap();
    assert!(outcome.mesh.triangles.len() < 100_000, "{}", outcome.mesh.triangles.len());
}
