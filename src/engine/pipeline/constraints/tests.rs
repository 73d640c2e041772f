//! Pins and kept lengths through the whole pipeline.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use crate::engine::budget::Unobserved;
use crate::engine::error::{EngineError, Located};
use crate::engine::flattening::{FlatteningError, Keep, KeepCurve, KeepLength, PinAt, PinPlace};
use crate::engine::job::{JobKind, JobOptions};
use crate::engine::mesh::Mesh;
use crate::engine::mesh::test_meshes::{Diagonal, grid};
use crate::engine::nurbs::Surface;
use crate::engine::nurbs::shapes::{circle2, cylinder, sphere};
use crate::engine::pattern::{Align, View};
use crate::engine::pipeline::{Input, Outcome, SurfaceMesh, run};
use crate::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};

fn flat<'a>(surface: impl Into<Input<'a>>, options: &JobOptions) -> Outcome {
    run(JobKind::Flatten, surface, options, &Unobserved).unwrap()
}

fn error<'a>(surface: impl Into<Input<'a>>, options: &JobOptions) -> EngineError {
    run(JobKind::Flatten, surface, options, &Unobserved).unwrap_err().error
}

fn with_pins(pins: Vec<PinAt>) -> JobOptions {
    let mut options = JobOptions::default();
    options.flattening.pins = Some(pins);
    options
}

fn curve(shape: TrimShape) -> TrimLoop {
    TrimLoop { curves: vec![TrimCurve { shape, reversed: false }] }
}

/// A place of the sphere's domain.
fn at(surface: &Surface, s: f64, t: f64) -> DVec2 {
    let d = surface.domain();
    DVec2::new(d.u[0] + s * (d.u[1] - d.u[0]), d.v[0] + t * (d.v[1] - d.v[0]))
}

/// A part of a sphere of radius 100 with a round hole, off the origin.
fn cap(side: Side) -> TrimmedSurface {
    let surface = sphere(100.0).translated(DVec3::new(300.0, -50.0, 20.0));
    let corners = [[0.1, 0.4], [0.35, 0.4], [0.35, 0.75], [0.1, 0.75], [0.1, 0.4]].map(|[s, t]| at(&surface, s, t));
    let radius = 0.2 * (corners[1] - corners[0]).length().min((corners[2] - corners[1]).length());
    let hole = TrimShape::Nurbs(circle2(at(&surface, 0.2, 0.55), radius));
    TrimmedSurface { loops: vec![curve(TrimShape::Polyline(corners.to_vec())), curve(hole)], surface, side }
}

/// Three vertices of a mesh that are far apart.
fn far_apart(outcome: &Outcome) -> [usize; 3] {
    let flat = outcome.flat.as_ref().unwrap();
    let most = |f: &dyn Fn(DVec2) -> f64| {
        (0..flat.len()).max_by(|&a, &b| f(flat[a]).total_cmp(&f(flat[b]))).unwrap_or_default()
    };
    [most(&|p| p.x + 0.3 * p.y), most(&|p| p.y - p.x), most(&|p| -p.y - 0.1 * p.x)]
}

fn worst_residual(outcome: &Outcome) -> f64 {
    outcome.report.flattening.as_ref().unwrap().pins.iter().map(|pin| pin.residual_mm).fold(0.0, f64::max)
}

#[test]
fn pinned_points_lie_at_their_targets_whatever_side_is_seen() {
    for (side, view) in [(Side::Normal, View::Show), (Side::Reversed, View::Show), (Side::Normal, View::Back)] {
        let part = cap(side);
        let mut options = JobOptions::default();
        options.placement.view = view;
        let free = flat(&part, &options);
        let (places, vertices) = (free.flat.as_ref().unwrap(), far_apart(&free));
        let target = |v: usize| (DVec2::from_angle(2.0).rotate(1.01 * places[v]) + DVec2::new(-700.0, 40.0)).to_array();
        let uv = free.mesh.uv.as_ref().unwrap();
        for in_space in [false, true] {
            let pins = vertices.map(|v| PinAt {
                at: if in_space {
                    PinPlace::Xyz(free.mesh.positions[v].to_array())
                } else {
                    PinPlace::Uv(uv[v].to_array())
                },
                to_mm: target(v),
            });
            let mut pinned = with_pins(pins.to_vec());
            pinned.placement.view = view;
            let found = flat(&part, &pinned);
            assert!(worst_residual(&found) < 1e-7, "{side:?} {view:?}: {}", worst_residual(&found));
            let report = found.report.flattening.as_ref().unwrap();
            assert_eq!((report.pins.len(), report.pins[1].at, report.flips), (3, pins[1].at, 0));
            // The mesh that comes out says the same.
            let flat = found.flat.as_ref().unwrap();
            for v in vertices {
                assert!(flat[v].distance(DVec2::from(target(v))) < 1e-6, "{side:?} {view:?}");
            }
            // And so does the outline: its box is that of the mesh.
            let outline = &found.pattern.as_ref().unwrap().pieces[0].outline.points;
            let low = |points: &[DVec2]| points.iter().copied().reduce(DVec2::min).unwrap();
            assert!(low(outline).distance(low(flat)) < 0.5 && low(outline).x < -300.0);
            let size = found.report.pattern.as_ref().unwrap().bounding_box_mm;
            assert!(size.iter().all(|x| (50.0..400.0).contains(x)), "{size:?}");
            // It costs something.
            let energy = |o: &Outcome| o.report.flattening.as_ref().unwrap().solver.unwrap().energy;
            assert!(energy(&found) > energy(&free));
        }
    }
}

#[test]
fn one_pin_leaves_the_turn_to_the_placement_and_costs_nothing() {
    let part = cap(Side::Reversed);
    let to_mm = [1234.5, -20.0];
    let uv = at(&part.surface, 0.3, 0.5);
    let mut options = with_pins(vec![PinAt { at: PinPlace::Uv(uv.to_array()), to_mm }]);
    options.placement.align = Align::V;
    options.placement.to_deg = 30.0;
    let found = flat(&part, &options);
    assert!(worst_residual(&found) < 1e-9);
    options.flattening.pins = None;
    let free = flat(&part, &options);
    let (a, b) = (found.report.placement.unwrap(), free.report.placement.unwrap());
    assert_eq!((a.rotation_deg, a.mirrored), (b.rotation_deg, b.mirrored));
    let energy = |r: &crate::engine::distortion::FlatteningReport| r.solver.unwrap().energy;
    assert_eq!(energy(&found.report.flattening.unwrap()), energy(&free.report.flattening.unwrap()));
}

#[test]
fn what_is_developable_is_moved_without_strain_where_that_will_do() {
    let part = TrimmedSurface { surface: cylinder(10.0, 30.0), loops: Vec::new(), side: Side::Normal };
    let d = part.surface.domain();
    // Both ends of a ruling.
    let u = d.u[0] + 0.3 * (d.u[1] - d.u[0]);
    let (foot, top) = (PinPlace::Uv([u, d.v[0]]), PinPlace::Xyz(part.surface.point(u, d.v[1]).to_array()));
    let pinned = |distance: f64| {
        let end = DVec2::from_angle(FRAC_PI_2 + 0.3) * distance + DVec2::new(5.0, 6.0);
        let pins = vec![PinAt { at: foot, to_mm: [5.0, 6.0] }, PinAt { at: top, to_mm: end.to_array() }];
        flat(&part, &with_pins(pins))
    };
    let found = pinned(30.0);
    let report = found.report.flattening.as_ref().unwrap();
    assert!(report.developable.is_some() && report.solver.is_none());
    assert!(worst_residual(&found) < 1e-9, "{}", worst_residual(&found));
    let strained = pinned(30.3);
    let report = strained.report.flattening.as_ref().unwrap();
    assert!(report.developable.is_none() && report.solver.unwrap().converged);
    assert!(worst_residual(&strained) < 1e-7, "{}", worst_residual(&strained));
}

#[test]
fn a_pin_on_a_curved_boundary_lies_on_the_drawn_curve() {
    let part = cap(Side::Normal);
    let TrimShape::Nurbs(circle) = &part.loops[1].curves[0].shape else { panic!("a circle") };
    let [first, last] = circle.domain();
    let uv = [0.137, 0.61].map(|x| circle.point(first + x * (last - first)));
    let free = flat(&part, &JobOptions::default());
    let pins = vec![
        PinAt { at: PinPlace::Uv(uv[0].to_array()), to_mm: [0.0, 0.0] },
        PinAt { at: PinPlace::Uv(uv[1].to_array()), to_mm: [25.0, 0.0] },
    ];
    let found = flat(&part, &with_pins(pins));
    assert!(worst_residual(&found) < 1e-7);
    let hole = &found.pattern.as_ref().unwrap().pieces[0].holes[0].points;
    let tolerance = free.options.curve_tolerance_mm.unwrap();
    for target in [DVec2::ZERO, DVec2::new(25.0, 0.0)] {
        let next = hole.iter().skip(1).chain(hole.first());
        let to_segment = |(a, b): (&DVec2, &DVec2)| {
            let edge = *b - *a;
            let x = ((target - *a).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
            target.distance(*a + edge * x)
        };
        let off = hole.iter().zip(next).map(to_segment).fold(f64::INFINITY, f64::min);
        assert!(off < tolerance, "{off} {tolerance}");
    }
}

#[test]
fn pins_that_are_not_on_the_part_or_contradict_each_other_are_refused_with_their_places() {
    let part = cap(Side::Normal);
    let good = PinAt { at: PinPlace::Uv(at(&part.surface, 0.3, 0.5).to_array()), to_mm: [0.0, 0.0] };
    let in_hole = PinPlace::Uv(at(&part.surface, 0.2, 0.55).to_array());
    let outside = PinPlace::Uv(at(&part.surface, 0.9, 0.9).to_array());
    let DVec3 { x, y, z } = part.surface.point(at(&part.surface, 0.3, 0.5).x, at(&part.surface, 0.3, 0.5).y);
    for off in [in_hole, outside, PinPlace::Xyz([x, y + 10.0, z + 10.0])] {
        let refused = error(&part, &with_pins(vec![good, PinAt { at: off, to_mm: [9.0, 9.0] }]));
        let EngineError::Flattening(FlatteningError::PinOffSurface { pin: 1, ref away_mm, .. }) = refused else {
            panic!("{off:?}: {refused:?}");
        };
        assert!(away_mm.is_some_and(|away| away > 1.0), "{refused}");
        match off {
            PinPlace::Uv(uv) => assert_eq!(refused.place().uv, Some(uv)),
            PinPlace::Xyz(xyz) => assert!(DVec3::from(refused.place().xyz_mm.unwrap()).distance(xyz.into()) < 1e-9),
        }
    }
    // The same point, once by its place in space.
    let again = PinAt { at: PinPlace::Xyz([x, y, z]), to_mm: [0.0, 3.0] };
    let refused = error(&part, &with_pins(vec![good, again]));
    let EngineError::Flattening(FlatteningError::PinsContradict { pins: [0, 1], .. }) = refused else {
        panic!("{refused:?}");
    };
    assert!(DVec3::from(refused.place().xyz_mm.unwrap()).distance(DVec3::new(x, y, z)) < 0.5);
    // Mirrored: three points the other way round, close together, as one triangle is.
    let [a, b, c] =
        [[0.3, 0.5], [0.301, 0.5], [0.3, 0.501]].map(|[s, t]| PinPlace::Uv(at(&part.surface, s, t).to_array()));
    let pin = |at, to_mm| PinAt { at, to_mm };
    let size = 0.5;
    let pins = |sign: f64| vec![pin(a, [0.0, 0.0]), pin(b, [size, 0.0]), pin(c, [0.0, sign * size])];
    let refused = [1.0, -1.0].map(|sign| match run(JobKind::Flatten, &part, &with_pins(pins(sign)), &Unobserved) {
        Ok(_) => false,
        Err(failure) => {
            assert!(
                matches!(failure.error, EngineError::Flattening(FlatteningError::PinsNotMet { .. })),
                "{failure:?}"
            );
            true
        }
    });
    assert!(refused[0] != refused[1], "one of both is a mirror image: {refused:?}");
}

/// Two panels, the second far from the first; the first with a hole.
fn panels() -> SurfaceMesh {
    let panel = |at: f64| {
        grid(13, 11, Diagonal::Diamond, |u, v| {
            let (x, y) = (60.0 * u, 40.0 * v);
            DVec3::new(at + x, y, 6.0 * (0.06 * x).sin() * (0.05 * y).cos())
        })
    };
    let (mut first, second) = (panel(0.0), panel(500.0));
    let mut cell = 0;
    first.triangles.retain(|_| {
        let (i, j) = ((cell / 2) % 12, (cell / 2) / 12);
        cell += 1;
        !((4..8).contains(&i) && (3..6).contains(&j))
    });
    let shift = first.positions.len() as u32;
    first.positions.extend(second.positions);
    first.triangles.extend(second.triangles.iter().map(|t| t.map(|v| v + shift)));
    SurfaceMesh { mesh: Mesh { uv: None, ..first }, side: Side::Normal }
}

#[test]
fn pieces_without_pins_are_laid_beside_those_with() {
    let surface = panels();
    let at = |k: usize| PinPlace::Xyz(surface.mesh.positions[k].to_array());
    let last = 142;
    let pins = vec![PinAt { at: at(0), to_mm: [-200.0, -80.0] }, PinAt { at: at(last), to_mm: [-140.0, -40.0] }];
    let found = flat(&surface, &with_pins(pins));
    assert!(worst_residual(&found) < 1e-7);
    let pieces = &found.pattern.as_ref().unwrap().pieces;
    let span = |k: usize| {
        let x = pieces[k].outline.points.iter().map(|p| p.x);
        x.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    };
    assert_eq!(pieces.len(), 2);
    assert!(span(0)[1] < span(1)[0] - 1.0 && span(0)[0] > -210.0 && span(1)[1] < 0.0, "{:?} {:?}", span(0), span(1));
    let flat = found.flat.as_ref().unwrap();
    assert!(
        flat[0].distance(DVec2::new(-200.0, -80.0)) < 1e-7 && flat[last].distance(DVec2::new(-140.0, -40.0)) < 1e-7
    );
    // A mesh has no (u, v).
    let refused = error(&surface, &with_pins(vec![PinAt { at: PinPlace::Uv([0.0, 0.0]), to_mm: [0.0, 0.0] }]));
    assert!(matches!(refused, EngineError::Parameter { ref name, .. } if name == "flattening.pins.0.at"), "{refused}");
}

/// Relative changes of the lengths that the report tells.
fn changes(outcome: &Outcome) -> Vec<f64> {
    let boundary = &outcome.report.distortion.as_ref().unwrap().boundary;
    boundary.iter().map(|b| (b.length_2d_mm / b.length_mesh_mm - 1.0).abs()).collect()
}

#[test]
fn the_boundary_that_the_report_counts_is_the_one_that_is_kept() {
    let (part, mesh) = (cap(Side::Normal), panels());
    for surface in [Input::Trimmed(&part), Input::Mesh(&mesh)] {
        let kept = |keep: Option<KeepCurve>| {
            let mut options = JobOptions::default();
            options.flattening.keep = keep.map(|curve| vec![Keep { curve, length: KeepLength::Soft, weight: 1000.0 }]);
            changes(&flat(surface, &options))
        };
        let (free, all) = (kept(None), kept(Some(KeepCurve::Borders)));
        assert!(free.iter().zip(&all).all(|(free, all)| *all < 0.25 * free), "{free:?} {all:?}");
        let one: Vec<Vec<f64>> = (0..free.len()).map(|k| kept(Some(KeepCurve::Border(k as u32)))).collect();
        for border in 0..free.len() {
            assert!(one[border][border] < 0.25 * free[border], "{border}: {free:?} {one:?}");
            // Whichever other one is kept, this one is kept less.
            let others = (0..free.len()).filter(|&k| k != border);
            assert!(others.clone().all(|k| one[k][border] > 1.2 * one[border][border]), "{border}: {free:?} {one:?}");
        }
        let mut options = JobOptions::default();
        let curve = KeepCurve::Border(free.len() as u32);
        options.flattening.keep = Some(vec![Keep { curve, length: KeepLength::Soft, weight: 1.0 }]);
        assert!(matches!(error(surface, &options), EngineError::Parameter { .. }));
    }
}
