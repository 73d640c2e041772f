//! Claims about the triangulation of polygons.

use std::f64::consts::TAU;

use glam::DVec2;
use proptest::prelude::*;

use super::{NONE, PolygonTriangulator, Trouble, sweep::orientation};

/// Points and directed edges of closed loops.
fn region(loops: &[Vec<DVec2>]) -> (Vec<DVec2>, Vec<[u32; 2]>) {
    let mut points = Vec::new();
    let mut edges = Vec::new();
    for l in loops {
        let first = points.len() as u32;
        let n = l.len() as u32;
        points.extend_from_slice(l);
        edges.extend((0..n).map(|k| [first + k, first + (k + 1) % n]));
    }
    (points, edges)
}

fn points(list: &[(f64, f64)]) -> Vec<DVec2> {
    list.iter().map(|&(x, y)| DVec2::new(x, y)).collect()
}

fn circle(centre: DVec2, radius: f64, n: usize, clockwise: bool) -> Vec<DVec2> {
    let turn = if clockwise { -TAU } else { TAU };
    (0..n).map(|k| centre + DVec2::from_angle(turn * k as f64 / n as f64) * radius).collect()
}

fn area(loops: &[Vec<DVec2>]) -> f64 {
    loops.iter().flat_map(|l| (0..l.len()).map(|k| 0.5 * l[k].perp_dot(l[(k + 1) % l.len()]))).sum()
}

/// Triangulates, holds everything that must hold, and gives the number of triangles.
fn check(loops: &[Vec<DVec2>], aspect: f64) -> usize {
    let (points, edges) = region(loops);
    let mut triangulator = PolygonTriangulator::default();
    let triangles = triangulator.triangulate(&points, &edges, aspect).expect("a valid region").to_vec();
    let twins = triangulator.sweep.mesh_mut().1.to_vec();
    let mut sum = 0.0;
    for &[a, b, c] in &triangles {
        let twice = orientation(points[a as usize], points[b as usize], points[c as usize]);
        assert!(twice > 0.0, "triangle {a} {b} {c} is not anticlockwise");
        sum += 0.5 * twice;
    }
    assert!((sum - area(loops)).abs() <= 1e-12 * sum, "area {sum} instead of {}", area(loops));
    let ends = |h: u32| {
        let t = triangles[(h / 3) as usize];
        let e = (h % 3) as usize;
        [points[t[e] as usize], points[t[(e + 1) % 3] as usize]]
    };
    let mut border = Vec::new();
    for h in 0..twins.len() as u32 {
        let [p, q] = ends(h);
        match twins[h as usize] {
            NONE => border.push([p.to_array(), q.to_array()]),
            g => {
                assert_eq!(twins[g as usize], h);
                assert_eq!(ends(g), [q, p]);
            }
        }
    }
    let mut given: Vec<_> =
        edges.iter().map(|&[a, b]| [points[a as usize].to_array(), points[b as usize].to_array()]).collect();
    let order = |x: &[[f64; 2]; 2], y: &[[f64; 2]; 2]| x.partial_cmp(y).unwrap();
    given.sort_by(order);
    border.sort_by(order);
    assert_eq!(given, border, "the boundary is the given one, edge by edge");
    triangles.len()
}

#[test]
fn a_polygon_of_n_vertices_with_h_holes_has_n_minus_2_plus_2h_triangles() {
    let outer = circle(DVec2::ZERO, 3.0, 50, false);
    assert_eq!(check(std::slice::from_ref(&outer), 1.0), 48);
    let holes = [(-1.5, 0.2), (1.2, -0.7), (0.3, 1.4)].map(|(x, y)| circle(DVec2::new(x, y), 0.5, 11, true));
    let mut loops = vec![outer];
    loops.extend(holes);
    assert_eq!(check(&loops, 1.0), 83 - 2 + 6);
}

#[test]
fn collinear_points_give_no_flat_triangle() {
    let mut square = Vec::new();
    let corners = points(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
    for k in 0..4 {
        for s in 0..8 {
            square.push(corners[k].lerp(corners[(k + 1) % 4], f64::from(s) / 8.0));
        }
    }
    assert_eq!(check(&[square], 1.0), 30);
    // A triangle with points on two sides only, apex up, down, left and right.
    for turn in [0.0, 0.25, 0.5, 0.75] {
        let spin = DVec2::from_angle(TAU * turn).round();
        let side = [(0, 0), (4, 0), (3, 1), (2, 2), (1, 3), (0, 4), (0, 3), (0, 2), (0, 1)];
        let polygon = side.map(|(x, y)| spin.rotate(DVec2::new(f64::from(x), f64::from(y))));
        assert_eq!(check(&[polygon.to_vec()], 1.0), 7);
    }
}

#[test]
fn combs_spirals_and_staircases_are_triangulated() {
    for teeth in [1, 2, 7, 40] {
        let mut comb = points(&[(0.0, -1.0)]);
        comb.push(DVec2::new(f64::from(2 * teeth), -1.0));
        for k in (0..teeth).rev() {
            let x = f64::from(2 * k);
            comb.extend(points(&[(x + 2.0, 0.0), (x + 1.5, 3.0), (x + 1.0, 3.0), (x + 0.5, 0.0)]));
        }
        let flipped: Vec<_> = comb.iter().map(|p| -*p).collect();
        let turned: Vec<_> = comb.iter().map(|p| p.perp()).collect();
        for polygon in [comb, flipped, turned] {
            let n = polygon.len();
            assert_eq!(check(&[polygon], 1.0), n - 2);
        }
    }
    let arm = |r: f64| (0..60).map(move |k| DVec2::from_angle(0.3 * f64::from(k)) * (r + 0.1 * f64::from(k)));
    let spiral: Vec<_> = arm(1.0).rev().chain(arm(0.7)).rev().collect();
    let spiral = if area(std::slice::from_ref(&spiral)) < 0.0 { spiral.into_iter().rev().collect() } else { spiral };
    assert_eq!(check(&[spiral], 4.0), 118);
}

#[test]
fn islands_in_holes_belong_to_the_region() {
    let at = DVec2::new(0.1, 0.2);
    let loops =
        [circle(at, 4.0, 20, false), circle(at, 3.0, 17, true), circle(at, 2.0, 13, false), circle(at, 1.0, 9, true)];
    assert_eq!(check(&loops, 0.5), 20 + 17 + 13 + 9);
}

#[test]
fn polygons_that_touch_themselves_in_a_vertex_are_triangulated() {
    // A bow tie upright and lying, a hole that touches the border, two holes that touch each other.
    check(&[points(&[(0.0, 0.0), (2.0, 0.0), (1.0, 1.0), (2.0, 2.0), (0.0, 2.0), (1.0, 1.0)])], 1.0);
    check(&[points(&[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (2.0, 2.0), (1.0, 1.0), (0.0, 2.0)])], 1.0);
    let square = points(&[(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]);
    check(&[square.clone(), points(&[(2.0, 0.0), (1.0, 2.0), (3.0, 2.0)])], 1.0);
    check(
        &[
            square,
            points(&[(2.0, 2.0), (1.0, 1.0), (1.0, 2.0)]),
            points(&[(2.0, 2.0), (3.0, 3.0), (3.0, 2.0)]),
            points(&[(2.0, 2.0), (2.0, 3.0), (2.5, 3.0)]),
        ],
        1.0,
    );
}

#[test]
fn edges_that_bound_no_region_are_refused_with_a_place() {
    let refuse = |loops: &[Vec<DVec2>]| -> Trouble {
        let (points, edges) = region(loops);
        PolygonTriangulator::default().triangulate(&points, &edges, 1.0).expect_err("not a region")
    };
    refuse(&[points(&[(0.0, 0.0), (0.0, 1.0), (1.0, 0.0)])]); // clockwise
    refuse(&[points(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)])]); // crosses itself
    refuse(&[points(&[(0.0, 0.0), (1.0, 0.0)])]); // has no inside
    let square = points(&[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]);
    refuse(&[square.clone(), points(&[(1.0, 1.0), (3.0, 1.0), (1.0, 1.5)])]); // a hole that leaves
    refuse(&[square, points(&[(1.0, 0.0), (0.5, 1.0), (1.5, 1.0)])]); // touches an edge without a vertex
}

#[test]
fn flips_leave_a_delaunay_triangulation_in_the_stretched_domain() {
    let aspect = 8.0;
    let polygon: Vec<DVec2> = circle(DVec2::ZERO, 1.0, 40, false)
        .iter()
        .enumerate()
        .map(|(k, p)| *p * (1.0 + 0.2 * (7.0 * k as f64).sin()) / DVec2::new(aspect, 1.0))
        .collect();
    let (points, edges) = region(&[polygon]);
    let mut triangulator = PolygonTriangulator::default();
    let triangles = triangulator.triangulate(&points, &edges, aspect).unwrap().to_vec();
    let twins = triangulator.sweep.mesh_mut().1.to_vec();
    let coord = |k: u32| robust::Coord { x: points[k as usize].x * aspect, y: points[k as usize].y };
    for (h, &g) in twins.iter().enumerate().filter(|(_, g)| **g != NONE) {
        let [a, b, c] = triangles[h / 3].map(coord);
        let d = coord(triangles[(g / 3) as usize][(g as usize + 2) % 3]);
        assert!(robust::incircle(a, b, c, d) <= 1e-12);
    }
}

proptest! {
    #[test]
    fn stars_with_holes_on_a_coarse_lattice_are_triangulated(
        radii in prop::collection::vec(2_u32..9, 3..40),
        inner in prop::collection::vec(1_u32..3, 3..12),
        step in 1_u32..4,
        aspect in prop::sample::select(vec![0.25, 1.0, 4.0]),
    ) {
        // Radii in whole steps and rounded coordinates make many points collinear or level with each other.
        let star = |radii: &[u32], turn: f64| -> Vec<DVec2> {
            let n = radii.len() as f64;
            radii
                .iter()
                .enumerate()
                .map(|(k, &r)| DVec2::from_angle(turn * k as f64 / n) * f64::from(r))
                .map(|p| (p * 64.0 * f64::from(step)).round() / (64.0 * f64::from(step)))
                .collect()
        };
        let (outer, hole) = (star(&radii, TAU), star(&inner, -TAU));
        let triangles = check(std::slice::from_ref(&outer), aspect);
        prop_assert_eq!(triangles, outer.len() - 2);
        let scaled: Vec<DVec2> = hole.iter().map(|p| *p / 32.0).collect();
        if scaled.len() > 4 && radii.len() > 4 {
            check(&[outer, scaled], aspect);
        }
    }
}

/// The constrained Delaunay triangulation by another hand: triangles by their corners' coordinates.
fn by_spade(loops: &[Vec<DVec2>]) -> Vec<[[f64; 2]; 3]> {
    use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    for l in loops {
        let handles: Vec<_> = l.iter().map(|p| cdt.insert(Point2::new(p.x, p.y)).unwrap()).collect();
        for k in 0..handles.len() {
            cdt.add_constraint(handles[k], handles[(k + 1) % handles.len()]);
        }
    }
    let inside = |p: DVec2| {
        let edges = loops.iter().flat_map(|l| (0..l.len()).map(|k| (l[k], l[(k + 1) % l.len()])));
        let crossed =
            edges.filter(|(a, b)| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y));
        crossed.count() % 2 == 1
    };
    cdt.inner_faces()
        .map(|face| face.positions().map(|p| DVec2::new(p.x, p.y)))
        .filter(|[a, b, c]| inside((*a + *b + *c) / 3.0))
        .map(sorted)
        .collect()
}

fn sorted(corners: [DVec2; 3]) -> [[f64; 2]; 3] {
    let mut corners = corners.map(|p| p.to_array());
    corners.sort_by(|p, q| p.partial_cmp(q).unwrap());
    corners
}

proptest! {
    #[test]
    fn triangulations_agree_with_those_of_another_library(
        radii in prop::collection::vec(0.5_f64..1.0, 5..40),
        hole in prop::collection::vec(0.1_f64..0.3, 4..12),
        turn in 0.0..TAU,
    ) {
        let star = |radii: &[f64], around: f64| -> Vec<DVec2> {
            let n = radii.len() as f64;
            let at = |(k, r): (usize, &f64)| DVec2::from_angle(turn + around * k as f64 / n) * *r;
            radii.iter().enumerate().map(at).collect()
        };
        let loops = [star(&radii, TAU), star(&hole, -TAU)];
        let (points, edges) = region(&loops);
        // The outer star's chords pass the middle at 0.5 cos 36 degrees or more: beyond the hole.
        let mut triangulator = PolygonTriangulator::default();
        let triangles = triangulator.triangulate(&points, &edges, 1.0).expect("loops that do not cross");
        let mut ours: Vec<_> = triangles.iter().map(|t| sorted(t.map(|k| points[k as usize]))).collect();
        let mut theirs = by_spade(&loops);
        let order = |a: &[[f64; 2]; 3], b: &[[f64; 2]; 3]| a.partial_cmp(b).unwrap();
        ours.sort_by(order);
        theirs.sort_by(order);
        prop_assert_eq!(ours, theirs);
    }
}
