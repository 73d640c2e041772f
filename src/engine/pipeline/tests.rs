//! Closed forms through the whole pipeline: what is developable comes out with its true lengths.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3};

use super::*;
use crate::engine::budget::Unobserved;
use crate::engine::distortion::{Limits, VerdictResult};
use crate::engine::error::Located;
use crate::engine::flattening::isometric::Objective;
use crate::engine::flattening::{FlatteningDomain, FlatteningMethod, SeedChoice, Weights};
use crate::engine::nurbs::Surface;
use crate::engine::nurbs::shapes::{cylinder, plane, sphere};
use crate::engine::triangulation::{Density, TriangulationMethod};
use crate::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape};

fn polygon(points: &[[f64; 2]]) -> TrimLoop {
    let mut points: Vec<DVec2> = points.iter().copied().map(DVec2::from).collect();
    points.push(points[0]);
    TrimLoop { curves: vec![TrimCurve { shape: TrimShape::Polyline(points), reversed: false }] }
}

fn rectangle(low: [f64; 2], high: [f64; 2]) -> TrimLoop {
    polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]])
}

fn part(surface: Surface, loops: Vec<TrimLoop>) -> TrimmedSurface {
    TrimmedSurface { surface, loops, side: Side::Normal }
}

fn flat(surface: &TrimmedSurface, options: &JobOptions) -> Outcome {
    run(JobKind::Flatten, surface, options, &Unobserved).unwrap()
}

/// The options of a method.
fn by(method: FlatteningMethod) -> JobOptions {
    let mut options = JobOptions::default();
    options.flattening.method = Some(method);
    options
}

const METHODS: [FlatteningMethod; 4] =
    [FlatteningMethod::Isometric, FlatteningMethod::Cader, FlatteningMethod::Mccartney, FlatteningMethod::Wang];

fn close(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() <= relative * b.abs().max(1e-300)
}

/// A part of a surface with the domain [0, 1] x [0, 1] or wider: the middle of it, with a hole.
fn with_a_hole(surface: Surface) -> TrimmedSurface {
    let d = surface.domain();
    let at = |s: f64, t: f64| [d.u[0] + s * (d.u[1] - d.u[0]), d.v[0] + t * (d.v[1] - d.v[0])];
    part(surface, vec![rectangle(at(0.2, 0.1), at(0.8, 0.7)), rectangle(at(0.4, 0.3), at(0.5, 0.5))])
}

/// A rectangle of the domain of a sphere of radius 100, as shares of it, with a hole near its first corner.
fn cap(low: [f64; 2], high: [f64; 2]) -> TrimmedSurface {
    let sphere = sphere(100.0);
    let d = sphere.domain();
    let at = |[s, t]: [f64; 2]| [d.u[0] + s * (d.u[1] - d.u[0]), d.v[0] + t * (d.v[1] - d.v[0])];
    let inside = |share: f64| at([low[0] + share * (high[0] - low[0]), low[1] + share * (high[1] - low[1])]);
    part(sphere, vec![rectangle(at(low), at(high)), rectangle(inside(0.25), inside(0.5))])
}

#[test]
fn a_cylinder_unrolls_to_a_rectangle_without_strain() {
    for domain in [FlatteningDomain::Base, FlatteningDomain::Trimmed] {
        let mut options = JobOptions::default();
        options.flattening.domain = Some(domain);
        options.triangulation.tolerance = Some(Density::ChordRelative(1e-4));
        options.flattening.seed = Some(SeedChoice::Centre);
        let outcome = flat(&part(cylinder(10.0, 30.0), Vec::new()), &options);
        let report = &outcome.report;
        let distortion = report.distortion.as_ref().unwrap();
        assert!(distortion.part.area_change_percent < 1e-9, "{distortion:?}");
        assert!(distortion.part.strain_percent.max.abs() < 1e-8 && distortion.part.strain_percent.min.abs() < 1e-8);
        let pattern = report.pattern.as_ref().unwrap();
        let mut sides = pattern.bounding_box_mm;
        sides.sort_unstable_by(f64::total_cmp);
        // The chords of the mesh are shorter than the arc by the square of their angle.
        assert!(close(sides[0], 30.0, 1e-9) && close(sides[1], TAU * 10.0, 1e-3), "{sides:?}");
        assert_eq!(report.placement.as_ref().unwrap().side_up, "show");
    }
}

#[test]
fn what_is_developable_is_laid_flat_from_its_surface_without_strain() {
    let whole = part(cylinder(10.0, 30.0), Vec::new());
    for domain in [FlatteningDomain::Base, FlatteningDomain::Trimmed] {
        let mut options = by(FlatteningMethod::Isometric);
        options.flattening.domain = Some(domain);
        let outcome = flat(&whole, &options);
        let flattening = outcome.report.flattening.as_ref().unwrap();
        let found = flattening.developable.as_ref().unwrap();
        assert_eq!((found.kind.as_str(), flattening.flips, flattening.solver), ("cylinder", 0, None));
        assert!(found.strain < 1e-10, "{found:?}");
        let distortion = outcome.report.distortion.as_ref().unwrap();
        let strain = &distortion.part.strain_percent;
        assert!(strain.max.abs() < 1e-8 && strain.min.abs() < 1e-8, "{strain:?}");
        assert!(distortion.part.area_change_percent < 1e-10 && distortion.hot_spots.is_empty());
        // The arc itself, not the chords of a mesh.
        let mut sides = outcome.report.pattern.as_ref().unwrap().bounding_box_mm;
        sides.sort_unstable_by(f64::total_cmp);
        assert!(close(sides[0], 30.0, 1e-10) && close(sides[1], TAU * 10.0, 1e-10), "{sides:?}");
    }
    let holed = flat(&with_a_hole(cylinder(10.0, 30.0)), &by(FlatteningMethod::Isometric));
    for boundary in &holed.report.distortion.unwrap().boundary {
        assert!(close(boundary.length_2d_mm, boundary.length_3d_mm, 1e-6), "{boundary:?}");
    }
}

#[test]
fn a_dome_lies_without_a_flip_and_with_less_strain_than_by_the_best_seed() {
    let surface = cap([0.4, 0.42], [0.6, 0.7]);
    let change = |options: &JobOptions| {
        let outcome = flat(&surface, options);
        let flattening = outcome.report.flattening.unwrap();
        assert_eq!((flattening.flips, flattening.overlaps), (0, Some(0)));
        (outcome.report.distortion.unwrap().part, flattening.solver, flattening.seed)
    };
    let (least, solver, seed) = change(&by(FlatteningMethod::Isometric));
    assert!(solver.unwrap().converged && solver.unwrap().energy > 0.0 && seed.is_none());
    let mut cader = by(FlatteningMethod::Cader);
    cader.flattening.domain = Some(FlatteningDomain::Trimmed);
    let (sequential, solver, seed) = change(&cader);
    assert!(solver.is_none() && seed.is_some());
    assert!(least.area_change_percent < 0.5 * sequential.area_change_percent, "{least:?} {sequential:?}");
    // Each objective gains what it is after.
    let of = |objective| {
        let mut options = by(FlatteningMethod::Isometric);
        options.flattening.objective = Some(objective);
        change(&options).0
    };
    let (area, shape) = (of(Objective::Area), of(Objective::Shape));
    assert!(
        area.area_change_percent < least.area_change_percent && shape.shape_change_percent < area.shape_change_percent
    );
    let mut weighted = by(FlatteningMethod::Isometric);
    weighted.flattening.weights = Some(Weights { area: 10.0, shape: 1.0 });
    assert_eq!(change(&weighted).0.area_change_percent, area.area_change_percent);
}

#[test]
fn a_whole_sphere_cut_along_its_seam_lies_without_a_flip() {
    let outcome = flat(&part(sphere(10.0), Vec::new()), &by(FlatteningMethod::Isometric));
    let flattening = outcome.report.flattening.unwrap();
    assert_eq!((flattening.flips, flattening.developable), (0, None));
    assert!(outcome.report.distortion.unwrap().part.strain_percent.max > 10.0);
}

#[test]
fn a_plane_keeps_every_length_and_its_hole() {
    let outcome = flat(&with_a_hole(plane(100.0, 50.0)), &JobOptions::default());
    let pattern = outcome.pattern.as_ref().unwrap();
    assert_eq!((pattern.pieces.len(), pattern.pieces[0].holes.len()), (1, 1));
    let report = outcome.report.pattern.as_ref().unwrap();
    assert!(close(report.area_mm2, 60.0 * 30.0 - 10.0 * 10.0, 1e-9), "{report:?}");
    assert!(close(report.perimeter_mm, 2.0 * 90.0 + 2.0 * 20.0, 1e-9));
    assert!(close(report.bounding_box_mm[0], 60.0, 1e-9) && close(report.bounding_box_mm[1], 30.0, 1e-9));
    for boundary in &outcome.report.distortion.as_ref().unwrap().boundary {
        assert!(close(boundary.length_2d_mm, boundary.length_3d_mm, 1e-9), "{boundary:?}");
    }
}

#[test]
fn far_from_the_origin_and_at_any_size_the_answer_is_the_same() {
    for options in METHODS.map(by) {
        the_same_anywhere(&options);
    }
}

fn the_same_anywhere(options: &JobOptions) {
    let reference = flat(&with_a_hole(cylinder(10.0, 30.0)), options);
    let expected = reference.report.pattern.as_ref().unwrap();
    for (scale, offset) in [(1.0, DVec3::new(1e6, -3e5, 2e6)), (1e-4, DVec3::ZERO), (1e4, DVec3::splat(1e7))] {
        let surface = cylinder(10.0, 30.0).scaled(scale).translated(offset);
        let outcome = flat(&with_a_hole(surface.clone()), options);
        let found = outcome.report.pattern.as_ref().unwrap();
        assert_eq!(outcome.mesh.triangles, reference.mesh.triangles, "{scale} {offset}");
        assert!(close(found.area_mm2, expected.area_mm2 * scale * scale, 1e-6), "{scale}: {found:?}");
        // What comes out stands where the surface stands.
        let [low, high] = surface.bounding_box();
        let slack = DVec3::splat(1e-9 * low.length().max(high.length()));
        assert!(outcome.mesh.positions.iter().all(|p| p.cmpge(low - slack).all() && p.cmple(high + slack).all()));
        let at = outcome.report.distortion.as_ref().unwrap().part.strain_percent.at_max.xyz_mm;
        assert!(DVec3::from(at).cmpge(low - slack).all() && DVec3::from(at).cmple(high + slack).all());
    }
}

#[test]
fn several_outer_loops_become_pieces_that_do_not_overlap() {
    let loops =
        vec![rectangle([0.05, 0.1], [0.4, 0.5]), rectangle([0.45, 0.1], [0.9, 0.9]), rectangle([0.1, 0.2], [0.2, 0.3])];
    let mut options = JobOptions::default();
    options.flattening.domain = Some(FlatteningDomain::Trimmed);
    let outcome = flat(&part(plane(100.0, 50.0), loops), &options);
    let report = &outcome.report;
    assert_eq!(report.triangulation.pieces, 2);
    assert_eq!(report.pattern.as_ref().unwrap().pieces, 2);
    let boxes: Vec<[DVec2; 2]> = outcome
        .pattern
        .unwrap()
        .pieces
        .iter()
        .map(|p| {
            let points = &p.outline.points;
            [points.iter().copied().reduce(DVec2::min).unwrap(), points.iter().copied().reduce(DVec2::max).unwrap()]
        })
        .collect();
    assert!(boxes[0][1].x < boxes[1][0].x || boxes[1][1].x < boxes[0][0].x, "{boxes:?}");
    assert!(close(report.pattern.as_ref().unwrap().area_mm2, 35.0 * 20.0 - 10.0 * 5.0 + 45.0 * 40.0, 1e-9));
}

#[test]
fn pieces_that_touch_at_a_point_are_flattened_apart() {
    let loops = vec![rectangle([0.1, 0.1], [0.5, 0.5]), rectangle([0.5, 0.5], [0.9, 0.9])];
    let mut options = JobOptions::default();
    options.flattening.domain = Some(FlatteningDomain::Trimmed);
    let outcome = flat(&part(plane(100.0, 50.0), loops), &options);
    assert_eq!(outcome.report.triangulation.pieces, 2);
    assert!(close(outcome.report.pattern.unwrap().area_mm2, 2.0 * 40.0 * 20.0, 1e-9));
    assert!(outcome.flat.unwrap().iter().all(|p| p.is_finite()));
}

#[test]
fn a_whole_sphere_fails_with_the_triangle_and_what_was_flattened() {
    let mut options = JobOptions::default();
    options.triangulation.grid = Some([40, 40]);
    options.flattening.seed = Some(SeedChoice::Centre);
    let centre = DVec3::new(0.0, 0.0, 1000.0);
    let surface = part(sphere(10.0).translated(centre), Vec::new());
    let failure = run(JobKind::Flatten, &surface, &options, &Unobserved).unwrap_err();
    assert_eq!(failure.error.code(), "triangle-flipped");
    let place = failure.error.place();
    assert!(place.triangle.is_some() && place.level.is_some() && place.uv.is_some());
    assert!(DVec3::from(place.xyz_mm.unwrap()).distance(centre) < 10.5, "{place:?}");
    assert!(!failure.error.remedies().is_empty());
    let partial = failure.partial.unwrap();
    let flat = partial.flat.unwrap();
    assert!(flat.iter().any(|p| p.is_nan()) && flat.iter().any(|p| p.is_finite()));
    assert!(partial.mesh.positions.iter().all(|p| p.distance(centre) < 10.5));
    let flattening = partial.report.flattening.unwrap();
    assert!(flattening.flattened > 0 && flattening.flattened < partial.mesh.triangles.len() as u64);
}

#[test]
fn the_answer_shows_the_defaults_that_were_taken() {
    let surface = part(cylinder(10.0, 30.0), Vec::new());
    let options = flat(&surface, &JobOptions::default()).options;
    assert_eq!(options.triangulation.tolerance, Some(Density::ChordRelative(DEFAULT_CHORD_RELATIVE)));
    let flattening = &options.flattening;
    assert_eq!((flattening.method, flattening.seed), (Some(FlatteningMethod::Isometric), None));
    assert_eq!((flattening.domain, flattening.objective), (Some(FlatteningDomain::Trimmed), Some(Objective::Balanced)));
    let cader = flat(&surface, &by(FlatteningMethod::Cader)).options.flattening;
    assert_eq!((cader.domain, cader.seed), (Some(FlatteningDomain::Base), Some(SeedChoice::Optimum)));
    assert!(options.curve_tolerance_mm.unwrap() > 0.0);
}

#[test]
fn the_default_density_suits_the_method() {
    for method in METHODS {
        let (least, most) = default_triangles(method);
        for surface in [plane(1.0, 1000.0), cylinder(10.0, 30.0)] {
            let triangulation = flat(&part(surface, Vec::new()), &by(method)).report.triangulation;
            assert!((least..=most).contains(&triangulation.triangles), "{triangulation:?}");
        }
    }
}

#[test]
fn limits_decide_the_verdict() {
    let mut options =
        JobOptions { limits: Limits { stretch_percent: Some(1.0), ..Limits::default() }, ..JobOptions::default() };
    let surface = part(cylinder(10.0, 30.0), Vec::new());
    assert_eq!(flat(&surface, &options).report.verdict.unwrap().result, VerdictResult::Pass);
    options.limits = Limits { area_percent: Some(-1.0), ..Limits::default() };
    assert_eq!(flat(&surface, &options).report.verdict.unwrap().result, VerdictResult::Fail);
    options.limits = Limits::default();
    assert_eq!(flat(&surface, &options).report.verdict.unwrap().result, VerdictResult::Unchecked);
}

#[test]
fn parameters_that_contradict_each_other_are_refused() {
    let mut options = JobOptions::default();
    options.flattening.domain = Some(FlatteningDomain::Trimmed);
    options.triangulation.method = TriangulationMethod::Grid;
    let failure = run(JobKind::Flatten, &with_a_hole(plane(1.0, 1.0)), &options, &Unobserved).unwrap_err();
    assert!(matches!(failure.error, EngineError::Parameter { .. }), "{:?}", failure.error);
    options.triangulation.grid = Some([1, 5]);
    options.triangulation.method = TriangulationMethod::Tracing;
    let failure = run(JobKind::Flatten, &with_a_hole(plane(1.0, 1.0)), &options, &Unobserved).unwrap_err();
    assert!(matches!(failure.error, EngineError::Parameter { .. }), "{:?}", failure.error);
}

#[test]
fn a_survey_measures_the_part_and_not_the_base() {
    let surface = with_a_hole(cylinder(10.0, 30.0).translated(DVec3::splat(500.0)));
    let found = survey(&surface, &surface.check().unwrap()).unwrap();
    let d = surface.surface.domain();
    let share = (0.6 * 0.6 - 0.1 * 0.2) * 2.0 * PI * 10.0 * 30.0;
    assert!(d.u[1] > d.u[0]);
    // The domain's angle is not proportional to the arc, so the share is only roughly that of the domain.
    assert!(found.area > 0.7 * share && found.area < 1.3 * share, "{found:?}");
    assert!(found.bounding_box[0].min_element() > 480.0 && found.diagonal < 40.0);
}

#[test]
fn a_cancelled_job_stops_at_once() {
    struct Stop;
    impl Observer for Stop {
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let surface = part(cylinder(10.0, 30.0), Vec::new());
    let failure = run(JobKind::Flatten, &surface, &JobOptions::default(), &Stop).unwrap_err();
    assert_eq!(failure.error, EngineError::Cancelled);
}

/// Counts the questions whether to go on, and says no from the n-th on.
struct StopsAt {
    question: usize,
    asked: AtomicUsize,
}

impl StopsAt {
    const fn new(question: usize) -> Self {
        Self { question, asked: AtomicUsize::new(0) }
    }
}

impl Observer for StopsAt {
    fn is_cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.question
    }
}

#[test]
fn a_job_that_is_cancelled_at_any_question_ends_cancelled_and_not_failed() {
    use FlatteningDomain::{Base, Trimmed};
    use FlatteningMethod::{Cader, Isometric};
    let (bent, domed) = (with_a_hole(cylinder(10.0, 30.0)), cap([0.4, 0.42], [0.6, 0.7]));
    let cases =
        [(&bent, Cader, Base), (&bent, Cader, Trimmed), (&bent, Isometric, Trimmed), (&domed, Isometric, Trimmed)];
    for (surface, method, domain) in cases {
        let mut options = by(method);
        options.flattening.domain = Some(domain);
        options.triangulation.grid = Some([9, 7]);
        for kind in [JobKind::Triangulate, JobKind::Flatten] {
            let patient = StopsAt::new(usize::MAX);
            run(kind, surface, &options, &patient).unwrap();
            let questions = patient.asked.into_inner();
            assert!(questions > 5, "{questions}");
            for question in 0..questions {
                let failure = run(kind, surface, &options, &StopsAt::new(question)).unwrap_err();
                assert_eq!(failure, Failure::from(EngineError::Cancelled), "question {question} of {questions}");
            }
        }
    }
}

#[test]
fn the_same_job_gives_the_same_numbers_with_any_number_of_threads() {
    for method in METHODS {
        let mut options = by(method);
        options.flattening.domain = Some(FlatteningDomain::Trimmed);
        options.triangulation.tolerance = Some(Density::ChordRelative(4e-4));
        the_same_on_any_threads(&options);
    }
}

fn the_same_on_any_threads(options: &JobOptions) {
    let cap = cap([0.4, 0.42], [0.52, 0.6]);
    let outcomes = [1, 2, 8].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| flat(&cap, options))
    });
    assert!(outcomes[0].mesh.triangles.len() > 300, "{}", outcomes[0].mesh.triangles.len());
    assert!(outcomes[0].report.distortion.as_ref().unwrap().part.strain_percent.max > 0.1, "there is strain to sum");
    assert!(outcomes[0] == outcomes[1] && outcomes[0] == outcomes[2]);
}
