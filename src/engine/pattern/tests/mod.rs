//! Patterns of parts whose flattenings are known: planes, cylinders, cones.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::*;
use crate::engine::budget::{Observer, Unobserved};
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, Topology};
use crate::engine::nurbs::shapes::{circle2, cylinder, knots, plane, revolved};
use crate::engine::nurbs::{Curve2, Surface};
use crate::engine::triangulation::{Configuration, DomainMesh, GridLines, Lifted, grid_mesh, lift};
use crate::engine::trimming::tests::samples::real_faces;
use crate::engine::trimming::{CheckedTrims, Side, TrimCurve, TrimLoop, TrimRegion, TrimShape, TrimmedSurface};

mod laws;

/// The letter F, anticlockwise, 6 wide and 10 high.
const F: [[f64; 2]; 10] = [
    [0.0, 0.0],
    [2.0, 0.0],
    [2.0, 4.0],
    [5.0, 4.0],
    [5.0, 6.0],
    [2.0, 6.0],
    [2.0, 8.0],
    [6.0, 8.0],
    [6.0, 10.0],
    [0.0, 10.0],
];

/// A base mesh with a flattening that is known.
struct Part {
    surface: Surface,
    trims: CheckedTrims,
    lifted: Lifted,
    flat: Vec<DVec2>,
    side: Side,
    placement: Placement,
    tolerance: Option<f64>,
}

impl Part {
    /// The surface meshed with m x n points; `flatten` is its unrolling.
    fn new(
        surface: Surface,
        loops: Vec<TrimLoop>,
        [m, n]: [usize; 2],
        flatten: impl Fn(DVec3, DVec2) -> DVec2,
    ) -> Self {
        let lines = GridLines::uniform(surface.domain(), m, n);
        let lifted = lift(&surface, grid_mesh(&lines, Configuration::Regular, 0), &lines);
        let uv = lifted.mesh.uv.clone().expect("a surface's mesh");
        let flat = lifted.mesh.positions.iter().zip(uv).map(|(&p, uv)| flatten(p, uv)).collect();
        let trimmed = TrimmedSurface { surface: surface.clone(), loops, side: Side::Normal };
        let trims = trimmed.check().expect("loops that do");
        Self { surface, trims, lifted, flat, side: Side::Normal, placement: Placement::default(), tolerance: None }
    }

    fn region_part(&self) -> Vec<bool> {
        let region = self.trims.polygonise(&self.surface, 1e-3).expect("loops that do");
        part_of(&self.lifted, &region)
    }

    fn draw_observed(&self, observer: &dyn Observer) -> Result<Drawn, EngineError> {
        let input = DrawInput {
            surface: &self.surface,
            side: self.side,
            trims: &self.trims,
            lifted: &self.lifted,
            topology: &Topology::new(&self.lifted.mesh).expect("a mesh"),
            locator: &Locator::new(&self.lifted.domain, &Unobserved)?,
            exact: None,
            flat: &self.flat,
            part: &self.region_part(),
            placement: &self.placement,
            holds: &[],
            curve_tolerance_mm: self.tolerance,
        };
        let mut drawn = draw(&input, observer)?;
        drawn.finish(&Finishing::default(), observer)?;
        Ok(drawn)
    }

    fn try_draw(&self) -> Result<Drawn, EngineError> {
        self.draw_observed(&Unobserved)
    }

    fn draw(&self) -> Drawn {
        self.try_draw().expect("a pattern")
    }
}

fn locator(lifted: &Lifted) -> Locator<'_> {
    Locator::new(&lifted.domain, &Unobserved).expect("nobody cancels")
}

fn part_of(lifted: &Lifted, region: &TrimRegion) -> Vec<bool> {
    triangles_of_part(lifted, &locator(lifted), region, &Unobserved).expect("nobody cancels")
}

fn polyline(points: impl Iterator<Item = DVec2>) -> TrimLoop {
    let mut points: Vec<DVec2> = points.collect();
    points.push(points[0]);
    TrimLoop { curves: vec![TrimCurve { shape: TrimShape::Polyline(points), reversed: false }] }
}

fn nurbs(curve: Curve2) -> TrimLoop {
    TrimLoop { curves: vec![TrimCurve { shape: TrimShape::Nurbs(curve), reversed: false }] }
}

/// An F in the middle of a plane of 20 x 20.
fn f_on_a_plane() -> Part {
    let letter = polyline(F.iter().map(|&p| (DVec2::from_array(p) + DVec2::new(5.3, 4.1)) / 20.0));
    Part::new(plane(20.0, 20.0), vec![letter], [9, 7], |p, _| p.truncate())
}

fn assert_points(found: &[DVec2], expected: &[DVec2], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (a, b) in found.iter().zip(expected) {
        assert!(a.distance(*b) <= tolerance, "{found:?} where {expected:?} is expected");
    }
}

fn f_points() -> Vec<DVec2> {
    F.iter().map(|&p| DVec2::from_array(p)).collect()
}

/// The F upside down as its mirror image, from the same first point, anticlockwise.
fn mirrored_f_points() -> Vec<DVec2> {
    let mut points: Vec<DVec2> = F.iter().map(|&[x, y]| DVec2::new(x, 10.0 - y)).collect();
    points[1..].reverse();
    points
}

fn area(points: &[DVec2]) -> f64 {
    (0..points.len()).map(|k| 0.5 * points[k].perp_dot(points[(k + 1) % points.len()])).sum()
}

/// Distance from a point to a closed polyline.
fn distance(points: &[DVec2], p: DVec2) -> f64 {
    (0..points.len())
        .map(|k| {
            let (a, b) = (points[k], points[(k + 1) % points.len()]);
            let x = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            p.distance(a.lerp(b, x))
        })
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn an_f_comes_out_as_an_f_with_its_corners_and_nothing_else() {
    let drawn = f_on_a_plane().draw();
    assert_eq!(drawn.pattern.pieces.len(), 1);
    let outline = &drawn.pattern.pieces[0].outline;
    assert_points(&outline.points, &f_points(), 1e-12);
    assert!(outline.corners.iter().all(|&c| c));
    assert_eq!(drawn.pattern.bounding_box_mm.map(|x| (x * 1e9).round() / 1e9), [6.0, 10.0]);
    assert!(!drawn.placement.mirrored && drawn.placement.side_up == "show");
    assert!((drawn.report.area_mm2 - area(&f_points())).abs() < 1e-11);
    assert_eq!((drawn.report.pieces, drawn.report.holes, drawn.report.points), (1, 0, 10));
}

#[test]
fn an_f_is_mirrored_for_a_reversed_side_and_for_the_back_but_not_for_both() {
    let mut part = f_on_a_plane();
    for (side, view, mirrored) in [
        (Side::Normal, View::Show, false),
        (Side::Reversed, View::Show, true),
        (Side::Normal, View::Back, true),
        (Side::Reversed, View::Back, false),
    ] {
        part.side = side;
        part.placement.view = view;
        let drawn = part.draw();
        assert_eq!(drawn.placement.mirrored, mirrored);
        let expected = if mirrored { mirrored_f_points() } else { f_points() };
        assert_points(&drawn.pattern.pieces[0].outline.points, &expected, 1e-12);
        assert!(drawn.report.area_mm2 > 0.0, "outlines stay anticlockwise");
    }
}

#[test]
fn an_f_sent_clockwise_and_in_pieces_is_the_same_f() {
    let mut points: Vec<DVec2> = f_points().iter().map(|&p| (p + DVec2::new(5.3, 4.1)) / 20.0).collect();
    points.push(points[0]);
    points.reverse();
    let curves =
        points.windows(2).map(|w| TrimCurve { shape: TrimShape::Polyline(vec![w[1], w[0]]), reversed: true }).collect();
    let part = Part::new(plane(20.0, 20.0), vec![TrimLoop { curves }], [9, 7], |p, _| p.truncate());
    assert_points(&part.draw().pattern.pieces[0].outline.points, &f_points(), 1e-12);
}

#[test]
fn the_chosen_direction_points_where_it_is_told() {
    let mut part = f_on_a_plane();
    for (align, to_deg, expected) in [
        (Align::U, 90.0, DVec2::Y),
        (Align::V, 0.0, DVec2::new(0.0, -1.0)),
        (Align::Uv([1.0, 1.0]), 45.0, DVec2::X),
        (Align::Xyz([3.0, 0.0, 4.0]), 0.0, DVec2::X),
        (Align::Xyz([0.0, -1.0, 0.0]), -90.0, DVec2::X),
    ] {
        part.placement = Placement { view: View::Show, align, to_deg };
        let points = part.draw().pattern.pieces[0].outline.points.clone();
        // The foot of the F runs along u.
        assert!((points[1] - points[0]).normalize().distance(expected) < 1e-12, "{align:?} to {to_deg}");
        let low = points.iter().fold(DVec2::INFINITY, |m, p| m.min(*p));
        assert!(low.length() < 1e-13, "{low}");
    }
}

#[test]
fn a_direction_without_meaning_is_refused_by_name() {
    let mut part = f_on_a_plane();
    for align in [Align::Uv([0.0, 0.0]), Align::Uv([f64::NAN, 1.0]), Align::Xyz([0.0; 3]), Align::Xyz([0.0, 0.0, 1.0])]
    {
        part.placement.align = align;
        let refused = part.try_draw();
        assert!(
            matches!(&refused, Err(EngineError::Parameter { name, .. }) if name == "placement.align"),
            "{refused:?}"
        );
    }
    part.placement.align = Align::U;
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        part.tolerance = Some(tolerance);
        let refused = part.try_draw();
        assert!(matches!(&refused, Err(EngineError::Parameter { name, .. }) if name == "curve_tolerance_mm"));
    }
}

#[test]
fn a_cylinder_unrolls_into_a_rectangle_of_four_points() {
    let (radius, height) = (30.0, 50.0);
    let part =
        Part::new(cylinder(radius, height), Vec::new(), [41, 5], |p, uv| DVec2::new(radius * uv.x * PI / 2.0, p.z));
    let drawn = part.draw();
    let outline = &drawn.pattern.pieces[0].outline;
    let around = 2.0 * PI * radius;
    let rectangle = [[0.0, 0.0], [around, 0.0], [around, height], [0.0, height]].map(DVec2::from_array);
    assert_points(&outline.points, &rectangle, 1e-9);
    assert!(outline.corners.iter().all(|&c| c));
    let boundary = &drawn.boundary[0];
    let exact = 2.0 * around + 2.0 * height;
    assert!((boundary.length_3d_mm / exact - 1.0).abs() < 1e-8, "{boundary:?}");
    assert!((boundary.length_2d_mm / exact - 1.0).abs() < 1e-12);
    // The chords of the mesh around, bottom and top.
    let row = &part.lifted.mesh.positions[..41];
    let chords = 2.0 * row.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>() + 2.0 * height;
    assert!((boundary.length_mesh_mm / chords - 1.0).abs() < 1e-6, "{} {chords}", boundary.length_mesh_mm);
    assert_eq!((boundary.source_loop, boundary.hole), (None, false));
}

#[test]
fn an_f_on_a_cylinder_is_an_f_seen_from_outside() {
    let (radius, height) = (30.0, 50.0);
    // In the cylinder's quarters: 6 mm wide, 10 mm high.
    let letter =
        polyline(f_points().into_iter().map(|p| DVec2::new(1.2 + p.x / (radius * PI / 2.0), 0.3 + p.y / height)));
    // Its parameter is not quite the angle: the exact unrolling takes the angle of the point.
    let angle = |p: DVec3| p.y.atan2(p.x).rem_euclid(2.0 * PI);
    let mut part = Part::new(cylinder(radius, height), vec![letter], [641, 5], |p, uv| {
        DVec2::new(radius * if uv.x == 4.0 { 2.0 * PI } else { angle(p) }, p.z)
    });
    let corners = |drawn: &Drawn| -> Vec<DVec2> {
        let outline = &drawn.pattern.pieces[0].outline;
        outline.points.iter().zip(&outline.corners).filter(|c| *c.1).map(|c| *c.0).collect()
    };
    let exact: Vec<DVec2> = f_points()
        .into_iter()
        .map(|p| {
            let at = |x: f64, y: f64| part.surface.point(1.2 + x / (radius * PI / 2.0), 0.3 + y / height);
            DVec2::new(radius * (angle(at(p.x, p.y)) - angle(at(0.0, 0.0))), p.y)
        })
        .collect();
    assert_points(&corners(&part.draw()), &exact, 1e-3);
    part.side = Side::Reversed;
    let drawn = part.draw();
    assert!(drawn.placement.mirrored);
    let mut mirrored: Vec<DVec2> = exact.iter().map(|p| DVec2::new(p.x, 10.0 - p.y)).collect();
    mirrored[1..].reverse();
    assert_points(&corners(&drawn), &mirrored, 1e-3);
}

#[test]
fn a_cone_unrolls_into_a_sector_with_one_point_at_its_apex() {
    let (radius, height) = (30.0, 40.0);
    let slant = 50.0;
    let profile = [(DVec2::new(radius, 0.0), 1.0), (DVec2::new(0.0, height), 1.0)];
    let cone = revolved(knots(1, &[0.0, 0.0, 1.0, 1.0]), &profile);
    let part = Part::new(cone, Vec::new(), [97, 9], |p, uv| {
        let angle = if uv.x == 4.0 { 2.0 * PI } else { p.y.atan2(p.x).rem_euclid(2.0 * PI) };
        // The apex is to the left of the rim as it is walked.
        DVec2::from_angle(angle * radius / slant - PI / 2.0) * (1.0 - uv.y) * slant
    });
    let drawn = part.draw();
    let outline = &drawn.pattern.pieces[0].outline;
    let exact = PI * radius * slant;
    assert!((drawn.report.area_mm2 / exact - 1.0).abs() < 1e-3, "{} {exact}", drawn.report.area_mm2);
    assert_eq!(outline.corners.iter().filter(|&&c| c).count(), 3, "two ends of the rim and the apex");
    let boundary = &drawn.boundary[0];
    assert!((boundary.length_3d_mm / (2.0 * PI * radius + 2.0 * slant) - 1.0).abs() < 1e-8, "{boundary:?}");
    assert!((boundary.length_2d_mm / boundary.length_3d_mm - 1.0).abs() < 1e-3);
}

#[test]
fn holes_are_clockwise_islands_are_pieces_of_their_own_and_circles_stay_within_the_tolerance() {
    let unit = |curve: Curve2| nurbs(curve);
    let at = DVec2::new(0.5, 0.5);
    let loops = vec![
        unit(circle2(at, 0.2)),
        unit(circle2(at, 0.1)),
        unit(circle2(at, 0.4)),
        unit(circle2(DVec2::new(0.06, 0.06), 0.04)),
    ];
    let mut part = Part::new(plane(100.0, 100.0), loops, [12, 15], |p, _| p.truncate());
    for tolerance in [0.5, 0.05, 0.005] {
        part.tolerance = Some(tolerance);
        let drawn = part.draw();
        let pieces = &drawn.pattern.pieces;
        let holes: Vec<usize> = pieces.iter().map(|p| p.holes.len()).collect();
        assert_eq!(holes, [0, 1, 0], "the island, the ring, the disc apart");
        assert!(pieces.iter().all(|p| area(&p.outline.points) > 0.0));
        assert!(pieces.iter().flat_map(|p| &p.holes).all(|h| area(&h.points) < 0.0));
        let centre = drawn.transform.point(DVec2::new(50.0, 50.0), 0);
        for (contour, radius) in [(&pieces[0].outline, 10.0), (&pieces[1].outline, 40.0), (&pieces[1].holes[0], 20.0)] {
            for k in 0..2000 {
                let p = centre + DVec2::from_angle(f64::from(k) * PI / 1000.0) * radius;
                assert!(distance(&contour.points, p) <= tolerance, "{tolerance}: {}", distance(&contour.points, p));
            }
            // Not many more points than chords of that height need (8 h r = c^2).
            let needed = PI * (radius / (2.0 * tolerance)).sqrt();
            assert!((contour.points.len() as f64) < 4.0 * needed + 12.0, "{} {needed}", contour.points.len());
            assert!(contour.corners[1..].iter().all(|&c| !c), "a circle has no corners");
        }
        let sources: Vec<_> = drawn.boundary.iter().map(|b| (b.source_loop, b.hole)).collect();
        assert_eq!(sources, [(Some(0), true), (Some(1), false), (Some(2), false), (Some(3), false)]);
        for (b, radius) in drawn.boundary.iter().zip([20.0, 10.0, 40.0, 4.0]) {
            for length in [b.length_3d_mm, b.length_mesh_mm, b.length_2d_mm] {
                assert!((length / (2.0 * PI * radius) - 1.0).abs() < 1e-7, "{b:?}");
            }
        }
    }
}

/// Cancels at the n-th question.
struct CancelsAt(std::sync::atomic::AtomicUsize);

impl Observer for CancelsAt {
    fn is_cancelled(&self) -> bool {
        let left = self.0.load(std::sync::atomic::Ordering::Relaxed);
        self.0.store(left.saturating_sub(1), std::sync::atomic::Ordering::Relaxed);
        left == 0
    }
}

#[test]
fn drawing_and_marking_the_part_stop_at_whatever_question_they_are_cancelled() {
    let part = f_on_a_plane();
    for question in 0..10 {
        let observer = CancelsAt(question.into());
        assert_eq!(part.draw_observed(&observer), Err(EngineError::Cancelled), "{question}");
    }
    let region = part.trims.polygonise(&part.surface, 1e-3).expect("loops that do");
    let marked = triangles_of_part(&part.lifted, &locator(&part.lifted), &region, &CancelsAt(1.into()));
    assert_eq!(marked, Err(EngineError::Cancelled));
    assert!(matches!(Locator::new(&part.lifted.domain, &CancelsAt(0.into())), Err(EngineError::Cancelled)));
}

#[test]
fn a_loop_along_the_seam_and_the_border_is_followed_on_its_own_side() {
    let (radius, height) = (10.0, 20.0);
    // The whole width of the cylinder: both long sides run along the seam.
    let letter = polyline([[0.0, 0.0], [4.0, 0.0], [4.0, 0.5], [0.0, 0.5]].into_iter().map(DVec2::from_array));
    let part =
        Part::new(cylinder(radius, height), vec![letter], [33, 9], |p, uv| DVec2::new(radius * uv.x * PI / 2.0, p.z));
    let drawn = part.draw();
    let around = 2.0 * PI * radius;
    let rectangle = [[0.0, 0.0], [around, 0.0], [around, 10.0], [0.0, 10.0]].map(DVec2::from_array);
    assert_points(&drawn.pattern.pieces[0].outline.points, &rectangle, 1e-9);
}

#[test]
fn pieces_that_are_flattened_apart_are_laid_side_by_side() {
    // Two squares of one plane that touch in a corner, each flattened at the origin, one of them turned.
    let uv: Vec<DVec2> = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5], [1.0, 0.5], [1.0, 1.0], [0.5, 1.0]]
        .map(DVec2::from_array)
        .to_vec();
    let surface = plane(20.0, 20.0);
    let triangles = vec![[0, 1, 2], [0, 2, 3], [2, 4, 5], [2, 5, 6]];
    let mut positions: Vec<DVec3> = uv.iter().map(|p| surface.point(p.x, p.y)).collect();
    positions.push(positions[2]);
    let own = vec![[0, 1, 2], [0, 2, 3], [7, 4, 5], [7, 5, 6]];
    let domain = DomainMesh { uv: uv.clone(), triangles };
    let lifted = Lifted {
        domain,
        mesh: Mesh { positions, uv: None, triangles: own },
        normals: vec![DVec3::Z; 8],
        vertex_of: (0..7).collect(),
        triangle_of: (0..4).collect(),
    };
    let flat =
        [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 10.0], [-10.0, 10.0], [-10.0, 0.0], [0.0, 0.0]];
    let square = |x: f64, y: f64| {
        polyline([[x, y], [x + 0.5, y], [x + 0.5, y + 0.5], [x, y + 0.5]].into_iter().map(DVec2::from_array))
    };
    let trims = TrimmedSurface {
        surface: surface.clone(),
        loops: vec![square(0.0, 0.0), square(0.5, 0.5)],
        side: Side::Normal,
    };
    let trims = trims.check().expect("loops that touch in a corner do");
    let flat = flat.map(DVec2::from_array);
    let mut part = Part {
        surface,
        trims,
        lifted,
        flat: flat.to_vec(),
        side: Side::Normal,
        placement: Placement::default(),
        tolerance: None,
    };
    let drawn = part.draw();
    assert_eq!(drawn.pattern.pieces.len(), 2);
    let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].map(DVec2::from_array);
    assert_points(&drawn.pattern.pieces[0].outline.points, &square, 1e-12);
    let beside = square.map(|p| p + DVec2::new(10.5, 0.0));
    assert_points(&drawn.pattern.pieces[1].outline.points, &beside, 1e-12);
    assert_eq!(drawn.pattern.bounding_box_mm, [20.5, 10.0]);
    // What is not flattened is left out, and so are its lengths.
    for p in [4, 5, 6, 7] {
        part.flat[p] = DVec2::NAN;
    }
    let drawn = part.draw();
    assert_eq!((drawn.pattern.pieces.len(), drawn.boundary.len()), (1, 1));
    assert!(drawn.transform.apply(&part.flat).iter().take(4).all(|p| p.is_finite()));
}

#[test]
fn a_curve_beside_the_chords_of_a_trimmed_mesh_is_drawn_and_not_the_chords() {
    // A disc meshed as a fan of twelve triangles: the circle lies outside of its chords.
    let surface = plane(100.0, 100.0);
    let ring = |k: u32| DVec2::new(0.5, 0.5) + DVec2::from_angle(f64::from(k) * PI / 6.0) * 0.3;
    let mut uv = vec![DVec2::new(0.5, 0.5)];
    uv.extend((0..12).map(ring));
    let triangles: Vec<[u32; 3]> = (0..12).map(|k| [0, 1 + k, 1 + (k + 1) % 12]).collect();
    let positions: Vec<DVec3> = uv.iter().map(|p| surface.point(p.x, p.y)).collect();
    let flat: Vec<DVec2> = positions.iter().map(|p| p.truncate()).collect();
    let lifted = Lifted {
        domain: DomainMesh { uv, triangles: triangles.clone() },
        mesh: Mesh { positions, uv: None, triangles },
        normals: vec![DVec3::Z; 13],
        vertex_of: (0..13).collect(),
        triangle_of: (0..12).collect(),
    };
    let loops = vec![nurbs(circle2(DVec2::new(0.5, 0.5), 0.3))];
    let trims = TrimmedSurface { surface: surface.clone(), loops, side: Side::Normal }.check().expect("a circle");
    let drawn = Part {
        surface,
        trims,
        lifted,
        flat,
        side: Side::Normal,
        placement: Placement::default(),
        tolerance: Some(1e-3),
    }
    .draw();
    assert!((drawn.report.area_mm2 / (PI * 900.0) - 1.0).abs() < 1e-4, "{}", drawn.report.area_mm2);
    assert!((drawn.boundary[0].length_2d_mm / (60.0 * PI) - 1.0).abs() < 1e-7);
}

#[test]
fn every_real_face_is_drawn_through_a_known_map_of_its_domain() {
    for (name, face, _) in real_faces() {
        let surface = &face.surface;
        let domain = surface.domain();
        let lines = GridLines::uniform(domain, 37, 31);
        let lifted = lift(surface, grid_mesh(&lines, Configuration::Diamond, 0), &lines);
        let uv = lifted.mesh.uv.clone().expect("a surface's mesh");
        // The domain itself, stretched to about the surface's size: no flattening, but one that is known exactly.
        let [low, high] = surface.bounding_box();
        let size = low.distance(high);
        let scale = DVec2::new(size / (domain.u[1] - domain.u[0]), size / (domain.v[1] - domain.v[0]));
        let flat: Vec<DVec2> = uv.iter().map(|&p| p * scale).collect();
        let trims = face.check().unwrap_or_else(|e| panic!("{name}: {e:?}"));
        let region = trims.polygonise(surface, 1e-5 * size).expect("loops that do");
        let part = part_of(&lifted, &region);
        let (topology, locator) = (Topology::new(&lifted.mesh).expect("a mesh"), locator(&lifted));
        let mut drawn = draw(
            &DrawInput {
                surface,
                side: face.side,
                trims: &trims,
                lifted: &lifted,
                topology: &topology,
                locator: &locator,
                exact: None,
                flat: &flat,
                part: &part,
                placement: &Placement::default(),
                holds: &[],
                curve_tolerance_mm: Some(1e-5 * size),
            },
            &Unobserved,
        )
        .unwrap_or_else(|e| panic!("{name}: {e}"));
        drawn.finish(&Finishing::default(), &Unobserved).expect("nobody cancels");
        let outer = region.loops.iter().filter(|l| l.depth % 2 == 0).count();
        assert_eq!(drawn.pattern.pieces.len(), outer, "{name}");
        assert_eq!(drawn.report.holes as usize, region.loops.len() - outer, "{name}");
        assert_eq!(drawn.boundary.len(), region.loops.len(), "{name}");
        for piece in &drawn.pattern.pieces {
            assert!(area(&piece.outline.points) > 0.0, "{name}");
            assert!(piece.holes.iter().all(|h| area(&h.points) < 0.0), "{name}");
            for p in piece.outline.points.iter().chain(piece.holes.iter().flat_map(|h| &h.points)) {
                assert!(p.min_element() >= -1e-9 * size && p.max_element() <= 2.0 * size, "{name}: {p}");
            }
        }
        for b in &drawn.boundary {
            assert!(b.length_3d_mm > 0.0 && b.length_2d_mm > 0.0, "{name}: {b:?}");
            assert!((b.length_mesh_mm / b.length_3d_mm - 1.0).abs() < 0.05, "{name}: {b:?}");
        }
        let meets: f64 = lifted
            .domain
            .triangles
            .iter()
            .zip(&lifted.triangle_of)
            .filter(|(_, to)| part.get(**to as usize).copied().unwrap_or(true))
            .map(|(t, _)| area(&t.map(|k| lifted.domain.uv[k as usize])))
            .sum();
        assert!(meets >= region.area() * (1.0 - 1e-12), "{name}: the part's triangles cover its region");
        // At a pole all of the degenerate edge is one point, and areas change.
        if !surface.degenerate_edges(1e-9 * size).contains(&true) {
            let exact = region.area() * scale.x * scale.y;
            assert!((drawn.report.area_mm2 / exact - 1.0).abs() < 2e-3, "{name}: {} {exact}", drawn.report.area_mm2);
        }
    }
}
