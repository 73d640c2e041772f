//! Claims about tracing.

use std::f64::consts::TAU;

use proptest::prelude::*;

use super::*;
use crate::engine::{
    budget::Unobserved,
    nurbs::{Domain, KnotVector},
    triangulation::{check_domain_mesh, lift, region_area, trimmed_area},
    trimming::BoundaryLoop,
};

const UNIT: Domain = Domain { u: [0.0, 1.0], v: [0.0, 1.0] };

/// A region of loops, oriented and nested here as the trimming does it (by brute force: loops do not cross).
fn region(loops: Vec<Vec<DVec2>>) -> TrimRegion {
    let area = |l: &[DVec2]| (0..l.len()).map(|k| l[k].perp_dot(l[(k + 1) % l.len()])).sum::<f64>();
    let holds = |l: &[DVec2], p: DVec2| {
        let crossed = (0..l.len()).filter(|&k| {
            let (a, b) = (l[k], l[(k + 1) % l.len()]);
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)
        });
        crossed.count() % 2 == 1
    };
    // A point on an edge's middle is inside another loop exactly when the loop is.
    let depth = |k: usize| {
        let p = loops[k][0].lerp(loops[k][1], 0.5);
        (0..loops.len()).filter(|&other| other != k && holds(&loops[other], p)).count() as u32
    };
    let depths: Vec<u32> = (0..loops.len()).map(depth).collect();
    let oriented = loops.into_iter().zip(depths).enumerate().map(|(k, (mut points, depth))| {
        if (area(&points) > 0.0) != depth.is_multiple_of(2) {
            points.reverse();
        }
        let corners = vec![true; points.len()];
        BoundaryLoop { points, sources: Vec::new(), corners, source_loop: Some(k), depth, parent: None }
    });
    TrimRegion { loops: oriented.collect(), natural: false }
}

fn points(list: &[(f64, f64)]) -> Vec<DVec2> {
    list.iter().copied().map(DVec2::from).collect()
}

fn circle(centre: (f64, f64), radius: f64, n: usize) -> Vec<DVec2> {
    (0..n).map(|k| DVec2::from(centre) + DVec2::from_angle(TAU * k as f64 / n as f64) * radius).collect()
}

fn rectangle(u: [f64; 2], v: [f64; 2]) -> Vec<DVec2> {
    points(&[(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])])
}

fn area(mesh: &DomainMesh) -> f64 {
    // Summed in halves: a plain sum of a million terms is good to no more than 1e-11.
    fn sum(mesh: &DomainMesh, triangles: &[[u32; 3]]) -> f64 {
        if triangles.len() > 64 {
            let (a, b) = triangles.split_at(triangles.len() / 2);
            return sum(mesh, a) + sum(mesh, b);
        }
        let twice = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|k| mesh.uv[k as usize]);
            (b - a).perp_dot(c - a)
        };
        triangles.iter().map(twice).sum::<f64>() / 2.0
    }
    sum(mesh, &mesh.triangles)
}

/// Traces and triangulates, and holds that the mesh conforms and has the region's area to 1e-12.
#[track_caller]
fn check(lines: &GridLines, region: &TrimRegion) -> (DomainMesh, TracingCounts) {
    let traced = trace(lines, region, &Unobserved).expect("traceable");
    let mesh = traced.triangulate(Configuration::Regular, 0).expect("a mesh");
    let faults = check_domain_mesh(&mesh, region);
    assert!(faults.is_empty(), "{} faults: {:?}", faults.len(), &faults[..faults.len().min(5)]);
    let (got, exact) = (area(&mesh), region_area(region));
    assert!((got - exact).abs() <= 1e-12 * exact.max(1.0), "area {got} instead of {exact}");
    (mesh, traced.counts())
}

fn uniform(cells_u: usize, cells_v: usize) -> GridLines {
    GridLines::uniform(UNIT, cells_u + 1, cells_v + 1)
}

#[test]
fn the_reference_regions_have_their_areas_in_space() {
    let read = |name: &str| {
        let path = format!("{}/../shared/reference/cases/{name}", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(path).ok().map(|text| serde_json::from_str::<serde_json::Value>(&text).unwrap())
    };
    let (Some(file), Some(surfaces)) = (read("trimmed.json"), read("synthetic_surfaces.json")) else {
        println!("reference cases are not there: nothing compared");
        return;
    };
    let given = &surfaces["backlight_like"]["surface"];
    let knots = |key: &str| KnotVector::new(3, serde_json::from_value(given[key].clone()).unwrap(), "knots").unwrap();
    let net: Vec<Vec<[f64; 3]>> = serde_json::from_value(given["control_points"].clone()).unwrap();
    let control = net.into_iter().flatten().map(glam::DVec3::from).collect();
    let surface = Surface::new(knots("knots_u"), knots("knots_v"), control, None).unwrap();
    for (name, case) in file["cases"].as_object().unwrap() {
        let loops: Vec<Vec<[f64; 2]>> = serde_json::from_value(case["loops"].clone()).unwrap();
        let region = region(loops.into_iter().map(|l| l.into_iter().map(DVec2::from).collect()).collect());
        let runs = case["runs"].as_array().unwrap();
        let exact = runs[runs.len() - 1]["surface_area_of_polygonised_domain"].as_f64().unwrap();
        for cells in [5, 10, 20, 40] {
            let lines = uniform(cells, cells);
            let (domain, _) = check(&lines, &region);
            if cells == 40 {
                let quadrature = trimmed_area(&surface, &domain);
                assert!((quadrature - exact).abs() <= 1e-8 * exact, "{name}: {quadrature} instead of {exact}");
            }
            let lifted = lift(&surface, domain, &lines);
            let corners = lifted.mesh.triangles.iter().map(|t| t.map(|k| lifted.mesh.positions[k as usize]));
            let sum: f64 = corners.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum();
            let error = (sum - exact).abs() / exact;
            assert!(error < 0.05 / (cells * cells) as f64, "{name} on {cells}: {error}");
        }
    }
}

#[test]
fn the_reference_regions_have_their_areas_and_counts() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/cases/trimmed.json");
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("reference cases are not there: nothing compared");
        return;
    };
    let file: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (name, case) in file["cases"].as_object().unwrap() {
        let loops: Vec<Vec<[f64; 2]>> = serde_json::from_value(case["loops"].clone()).unwrap();
        let region = region(loops.into_iter().map(|l| l.into_iter().map(DVec2::from).collect()).collect());
        for run in case["runs"].as_array().unwrap() {
            let number = |key: &str| run[key].as_u64().unwrap();
            let (nx, ny) = (number("nx") as usize, number("ny") as usize);
            let (mesh, counts) = check(&uniform(nx, ny), &region);
            let exact = case["exact_area"].as_f64().unwrap();
            assert!((area(&mesh) - exact).abs() <= 1e-10 * exact, "{name} {nx} x {ny}");
            let depth: Vec<u32> = serde_json::from_value(run["depth"].clone()).unwrap();
            assert_eq!(region.loops.iter().map(|l| l.depth).collect::<Vec<_>>(), depth);
            let got = [counts.cells_traced, counts.cells_distinct, counts.contained_loops];
            assert_eq!(counts.cells as usize, nx * ny);
            if name == "L_touch" && nx == 40 {
                // This loop passes through corners of cells; the reference enters one more of them in a single point.
                assert_eq!(got[0] + 1, number("cells_visited"));
                continue;
            }
            assert_eq!(got, ["cells_visited", "cells_distinct", "contained_loops"].map(number), "{name} {nx} x {ny}");
            // Numbers of vertices and triangles belong to one way of tracing; where nothing is degenerate there is one.
            let got = [mesh.uv.len(), mesh.triangles.len()].map(|n| n as u64);
            assert_eq!(got, ["vertices", "triangles"].map(number), "{name} {nx} x {ny}");
        }
    }
}

#[test]
fn an_untrimmed_domain_is_the_grid_itself() {
    let lines = uniform(4, 3);
    let mut border = region(vec![rectangle([0.0, 1.0], [0.0, 1.0])]);
    let (mesh, _) = check(&lines, &border);
    assert_eq!((mesh.uv.len(), mesh.triangles.len()), (20, 24));
    border.natural = true;
    let (mesh, counts) = check(&lines, &border);
    assert_eq!(mesh, grid_mesh(&lines, Configuration::Regular, 0));
    assert_eq!(counts, TracingCounts { cells: 12, ..TracingCounts::default() });
}

#[test]
fn diagonals_follow_the_configuration_in_cells_that_no_loop_enters() {
    let lines = uniform(12, 12);
    let region = region(vec![circle((0.5, 0.5), 0.4, 60)]);
    let traced = trace(&lines, &region, &Unobserved).unwrap();
    for (configuration, phase) in [(Configuration::Diamond, 0), (Configuration::ChevronRows, 1)] {
        let mesh = traced.triangulate(configuration, phase).unwrap();
        assert_eq!(check_domain_mesh(&mesh, &region), []);
        let place = |p: DVec2| [0, 1].map(|k| lines.u.iter().position(|&x| x == p[k]));
        let whole = mesh.triangles.iter().map(|t| t.map(|k| place(mesh.uv[k as usize])));
        let mut compared = 0;
        for corners in whole.filter(|t| t.as_flattened().iter().all(Option::is_some)) {
            let low = [0, 1].map(|k| corners.iter().filter_map(|c| c[k]).min().unwrap());
            let has = |i: usize, j: usize| corners.contains(&[Some(low[0] + i), Some(low[1] + j)]);
            if (2..10).contains(&low[0]) && (4..8).contains(&low[1]) {
                let backslash = has(1, 0) && has(0, 1);
                assert_eq!(backslash, configuration.is_backslash(low[0], low[1], phase));
                compared += 1;
            }
        }
        assert_eq!(compared, 2 * 8 * 4);
    }
}

#[test]
fn contained_loops_are_holes_inside_and_islands_outside() {
    let lines = uniform(4, 4);
    let outer = rectangle([0.05, 0.95], [0.1, 0.9]);
    let hole = circle((0.625, 0.375), 0.1, 12);
    let island = circle((0.625, 0.375), 0.05, 7);
    let elsewhere = circle((0.4, 0.6), 0.03, 9);
    let (_, counts) = check(&lines, &region(vec![hole.clone(), outer, island.clone(), elsewhere]));
    assert_eq!(counts.contained_loops, 3);
    // The same without the outer loop: hole and island are outer boundary and hole now, in a cell labelled CONTAINED.
    let (_, counts) = check(&lines, &region(vec![hole, island]));
    assert_eq!((counts.cells_traced, counts.cells_distinct, counts.contained_loops), (2, 1, 2));
}

#[test]
fn labels_and_lists_are_those_of_the_thesis() {
    let lines = uniform(3, 3);
    let slab = rectangle([0.1, 0.9], [0.4, 0.6]);
    let traced = trace(&lines, &region(vec![slab, circle((0.5, 0.5), 0.05, 6)]), &Unobserved).unwrap();
    let cells: Vec<TracedCell> = traced.cells().collect();
    assert_eq!(cells.iter().map(|c| c.cell).collect::<Vec<_>>(), [[0, 1], [1, 1], [2, 1]]);
    let edges: Vec<Vec<_>> = cells.iter().map(|c| c.lists.iter().map(|l| (l.enter, l.leave)).collect()).collect();
    assert_eq!(edges[0], [(CellEdge::Right, CellEdge::Right)]);
    let mut both = edges[1].clone();
    both.sort_unstable();
    assert_eq!(both, [(CellEdge::Right, CellEdge::Left), (CellEdge::Left, CellEdge::Right)]);
    assert_eq!(edges[2], [(CellEdge::Left, CellEdge::Left)]);
    assert_eq!(cells[1].label, CellLabel { intersect: true, contained: true, inside: None });
    assert_eq!(cells[0].label, CellLabel { intersect: true, contained: false, inside: None });
    let list = cells[0].lists[0];
    assert_eq!(list.last - list.first, 3, "enter point, two corners of the slab, leave point");
    assert_eq!(traced.point(list.first), Some(DVec2::new(lines.u[1], 0.6)));
}

#[test]
fn a_loop_through_corners_goes_on_in_the_diagonal_cell() {
    let diamond = points(&[(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)]);
    for n in [1, 2, 3, 4, 8, 10, 16] {
        let (mesh, counts) = check(&uniform(n, n), &region(vec![diamond.clone()]));
        if n % 2 == 0 && n > 1 {
            let n = n as u64;
            assert_eq!((counts.cells_traced, counts.cells_distinct), (2 * n, 2 * n));
            assert_eq!(mesh.triangles.len() as u64, n * n);
        }
    }
}

#[test]
fn loops_along_grid_lines_and_the_border_leave_no_spike() {
    let lines = uniform(5, 5);
    // A comb whose teeth begin and end on lines, on one side or both; an L; a step on the domain's border.
    let comb = points(&[
        (0.2, 0.2),
        (1.0, 0.2),
        (1.0, 0.8),
        (0.9, 0.8),
        (0.9, 0.4),
        (0.8, 0.4),
        (0.8, 0.8),
        (0.6, 0.8),
        (0.6, 0.4),
        (0.4, 0.4),
        (0.4, 0.7),
        (0.2, 0.7),
    ]);
    check(&lines, &region(vec![comb]));
    check(&lines, &region(vec![points(&[(0.0, 0.0), (1.0, 0.0), (1.0, 0.4), (0.4, 0.4), (0.4, 1.0), (0.0, 1.0)])]));
    let step = points(&[
        (0.0, 0.0),
        (1.0, 0.0),
        (1.0, 0.5),
        (0.9, 0.5),
        (0.9, 1.0),
        (0.0, 1.0),
        (0.0, 0.7),
        (0.1, 0.6),
        (0.0, 0.5),
    ]);
    check(&lines, &region(vec![step]));
    // Holes that slide along lines, one of them a slot along a single line between cells.
    let outer = rectangle([0.0, 1.0], [0.0, 1.0]);
    check(&lines, &region(vec![outer.clone(), rectangle([0.2, 0.6], [0.4, 0.6])]));
    check(
        &lines,
        &region(vec![outer.clone(), rectangle([0.25, 0.55], [0.4, 0.45]), rectangle([0.4, 0.5], [0.6, 0.8])]),
    );
    // Slides that begin and end in the middle of an edge.
    check(&lines, &region(vec![points(&[(0.05, 0.2), (0.15, 0.2), (0.15, 0.4), (0.05, 0.4)])]));
    check(&lines, &region(vec![outer, points(&[(0.25, 0.4), (0.35, 0.4), (0.3, 0.5)])]));
}

#[test]
fn slits_and_slivers_narrower_than_the_snapping_distance_vanish() {
    let lines = uniform(5, 5);
    let hair = 2e-13;
    let outer = rectangle([0.1, 0.9], [0.1, 0.9]);
    // A notch and a slot around a grid line, upright and lying: the mesh is that of the whole rectangle.
    let notch = points(&[
        (0.1, 0.1),
        (0.9, 0.1),
        (0.9, 0.4 - hair),
        (0.5, 0.4 - hair),
        (0.5, 0.4 + hair),
        (0.9, 0.4 + hair),
        (0.9, 0.9),
        (0.1, 0.9),
    ]);
    check(&lines, &region(vec![notch.clone()]));
    check(&lines, &region(vec![notch.iter().map(|p| DVec2::new(p.y, p.x)).collect()]));
    check(&lines, &region(vec![outer.clone(), rectangle([0.4 - hair, 0.4 + hair], [0.3, 0.7])]));
    check(&lines, &region(vec![outer.clone(), rectangle([0.25, 0.75], [0.6 - hair, 0.6 + hair])]));
    // Parts as narrow beside a sound one: nothing of them is left.
    let beside = |sliver: Vec<DVec2>| {
        let traced = trace(&lines, &region(vec![rectangle([0.45, 0.9], [0.45, 0.9]), sliver]), &Unobserved).unwrap();
        let mesh = traced.triangulate(Configuration::Regular, 0).unwrap();
        assert!((area(&mesh) - 0.45 * 0.45).abs() < 1e-12);
    };
    beside(rectangle([0.2 - hair, 0.2 + hair], [0.1, 0.7]));
    beside(rectangle([0.05, 0.35], [0.4 - hair, 0.4 + hair]));
}

#[test]
fn touch_points_are_carried_by_both_cells() {
    let lines = uniform(5, 5);
    let outer = rectangle([0.0, 1.0], [0.0, 1.0]);
    // A hole in one cell that touches its border in a point, from inside; one that touches all four edges.
    let (mesh, _) = check(&lines, &region(vec![outer.clone(), points(&[(0.5, 0.4), (0.55, 0.5), (0.45, 0.5)])]));
    assert!(mesh.uv.contains(&DVec2::new(0.5, 0.4)));
    let star = points(&[
        (0.5, 0.4),
        (0.52, 0.48),
        (0.6, 0.5),
        (0.52, 0.52),
        (0.5, 0.6),
        (0.48, 0.52),
        (0.4, 0.5),
        (0.48, 0.48),
    ]);
    check(&lines, &region(vec![outer.clone(), star.clone()]));
    let (_, counts) = check(&lines, &region(vec![star]));
    assert_eq!((counts.cells_distinct, counts.contained_loops), (1, 1));
    // Two loops that meet in a point on an edge, and two in a corner.
    let up = points(&[(0.5, 0.4), (0.55, 0.5), (0.45, 0.5)]);
    let down = points(&[(0.5, 0.4), (0.45, 0.3), (0.55, 0.3)]);
    check(&lines, &region(vec![outer.clone(), up.clone(), down.clone()]));
    check(&lines, &region(vec![up, down]));
    let ne = points(&[(0.4, 0.4), (0.5, 0.45), (0.45, 0.5)]);
    let sw = points(&[(0.4, 0.4), (0.3, 0.35), (0.35, 0.3)]);
    check(&lines, &region(vec![outer, ne.clone(), sw.clone()]));
    check(&lines, &region(vec![ne, sw]));
}

#[test]
fn loops_may_be_much_finer_than_cells_and_cells_much_finer_than_loops() {
    let rough = |n: usize| -> Vec<DVec2> {
        (0..n)
            .map(|k| {
                let t = TAU * k as f64 / n as f64;
                DVec2::new(0.5, 0.5)
                    + DVec2::from_angle(t) * (0.4 + 0.03 * (17.0 * t).sin() + 0.0005 * (f64::from(k as u32 % 7)))
            })
            .collect()
    };
    check(&uniform(1, 1), &region(vec![rough(5000), circle((0.5, 0.5), 0.1, 2000)]));
    check(&uniform(3, 2), &region(vec![rough(3000), circle((0.5, 0.5), 0.1, 700)]));
    let (mesh, counts) = check(&uniform(1000, 1000), &region(vec![rough(40), circle((0.5, 0.5), 0.2, 3)]));
    assert!(counts.cells == 1_000_000 && counts.cells_traced < 6_000);
    assert!(mesh.triangles.len() > 700_000);
}

#[test]
fn small_and_distant_domains_are_traced_alike() {
    let hexagon = circle((0.5, 0.5), 0.4, 6);
    let hole = rectangle([0.4, 0.6], [0.2, 0.4]);
    let reference = check(&uniform(10, 10), &region(vec![hexagon.clone(), hole.clone()])).0.triangles.len();
    for (scale, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e3), (1e4, -1e6)] {
        let place = |l: &[DVec2]| l.iter().map(|p| *p * scale + DVec2::splat(offset)).collect::<Vec<_>>();
        let domain = Domain { u: [offset, offset + scale], v: [offset, offset + scale] };
        let lines = GridLines::uniform(domain, 11, 11);
        let region = region(vec![place(&hexagon), place(&hole)]);
        let traced = trace(&lines, &region, &Unobserved).unwrap();
        let mesh = traced.triangulate(Configuration::Regular, 0).unwrap();
        let cracks = check_domain_mesh(&mesh, &region);
        assert!(cracks.is_empty(), "{scale} {offset} {cracks:?}");
        assert_eq!(mesh.triangles.len(), reference, "{scale} {offset}");
    }
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let lines = uniform(4, 4);
    let error = |region: &TrimRegion| -> EngineError {
        let traced = match trace(&lines, region, &Unobserved) {
            Ok(traced) => traced,
            Err(error) => return error,
        };
        traced.triangulate(Configuration::Regular, 0).expect_err("no mesh").into()
    };
    let outside = region(vec![rectangle([0.2, 1.2], [0.2, 0.8])]);
    assert_eq!(crate::engine::error::Located::place(&error(&outside)).uv, Some([1.2, 0.2]));
    let mut clockwise = region(vec![circle((0.5, 0.5), 0.3, 9)]);
    clockwise.loops[0].points.reverse();
    assert!(matches!(error(&clockwise), EngineError::Triangulation(TriangulationError::Polygon { .. })));
    let crossing = region(vec![rectangle([0.1, 0.6], [0.1, 0.6]), rectangle([0.3, 0.9], [0.3, 0.9])]);
    let EngineError::Triangulation(TriangulationError::Polygon { place }) = error(&crossing) else {
        panic!("crossing loops give no mesh")
    };
    assert!(place.loop_index.is_some() && place.uv.is_some());
    let empty = TrimRegion::default();
    assert_eq!(error(&empty), EngineError::Triangulation(TriangulationError::NoArea));
    let flat = GridLines { u: vec![0.0, 0.0, 1.0], v: vec![0.0, 1.0] };
    assert!(matches!(trace(&flat, &empty, &Unobserved), Err(EngineError::Parameter { .. })));
}

#[test]
fn a_cancelled_trace_stops() {
    struct Cancelled;
    impl Observer for Cancelled {
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let region = region(vec![circle((0.5, 0.5), 0.3, 9)]);
    assert_eq!(trace(&uniform(3, 3), &region, &Cancelled), Err(EngineError::Cancelled));
}

/// Random rectilinear lines over [0, 1].
fn any_lines() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.05_f64..1.0, 1..14).prop_map(|steps| {
        let total: f64 = steps.iter().sum();
        let mut at = 0.0;
        let mut lines = vec![0.0];
        for step in &steps[..steps.len() - 1] {
            at += step / total;
            lines.push(at);
        }
        lines.push(1.0);
        lines
    })
}

/// Moves coordinates that are within `reach` of a line to it.
fn snapped(l: &[DVec2], lines: &GridLines, reach: f64) -> Vec<DVec2> {
    let near = |x: f64, lines: &[f64]| *lines.iter().min_by(|a, b| (*a - x).abs().total_cmp(&(*b - x).abs())).unwrap();
    let snap = |x: f64, lines: &[f64]| if (near(x, lines) - x).abs() <= reach { near(x, lines) } else { x };
    let mut moved: Vec<DVec2> = l.iter().map(|p| DVec2::new(snap(p.x, &lines.u), snap(p.y, &lines.v))).collect();
    moved.dedup();
    moved
}

/// True when no two segments of the loops meet but neighbours in their common point (exactly): a valid region.
fn is_simple(loops: &[Vec<DVec2>]) -> bool {
    use crate::engine::triangulation::polygon::orientation;
    let segments: Vec<_> = loops
        .iter()
        .enumerate()
        .flat_map(|(n, l)| (0..l.len()).map(move |k| (n, k, l[k], l[(k + 1) % l.len()])))
        .collect();
    let on = |p: DVec2, a: DVec2, b: DVec2| {
        orientation(a, b, p) == 0.0 && p.cmpge(a.min(b)).all() && p.cmple(a.max(b)).all()
    };
    loops.iter().all(|l| l.len() >= 3)
        && segments.iter().enumerate().all(|(s, &(n, k, a, b))| {
            segments[..s].iter().all(|&(m, h, c, d)| {
                let len = loops[n].len();
                if n == m && (h + 1) % len == k {
                    return !on(b, c, d) && !on(c, a, b); // d == a
                }
                if n == m && (k + 1) % len == h {
                    return !on(a, c, d) && !on(d, a, b); // b == c
                }
                let apart = |p: f64, q: f64| (p > 0.0) == (q > 0.0) && p != 0.0 && q != 0.0;
                !(on(a, c, d) || on(b, c, d) || on(c, a, b) || on(d, a, b))
                    && (apart(orientation(a, b, c), orientation(a, b, d))
                        || apart(orientation(c, d, a), orientation(c, d, b)))
            })
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, max_global_rejects: 200_000, ..ProptestConfig::default() })]

    #[test]
    fn random_stars_with_holes_and_islands_on_random_grids_conform(
        u in any_lines(), v in any_lines(),
        radii in prop::collection::vec(0.75_f64..1.0, 3..60),
        turn in 0.0..TAU,
        reach in prop::sample::select(vec![0.0, 1e-13, 0.004, 0.02]),
        nested in 0_usize..4,
    ) {
        let lines = GridLines { u, v };
        let star = |size: f64, skip: usize| -> Vec<DVec2> {
            let picked: Vec<f64> = radii.iter().copied().step_by(skip).collect();
            let n = picked.len() as f64;
            let at = |(k, r): (usize, &f64)| DVec2::splat(0.5) + DVec2::from_angle(turn + TAU * k as f64 / n) * r * size;
            picked.iter().enumerate().map(at).collect()
        };
        let all = [(0.49, 1), (0.16, 1), (0.05, 2), (0.012, 3)];
        let loops: Vec<Vec<DVec2>> =
            all[..=nested].iter().map(|&(size, skip)| snapped(&star(size, skip), &lines, reach)).collect();
        prop_assume!(is_simple(&loops));
        check(&lines, &region(loops));
    }

    #[test]
    fn random_staircases_along_grid_lines_conform(
        u in any_lines(), v in any_lines(),
        walls in prop::collection::vec((0_usize..40, 0_usize..40), 2..12),
        offset in prop::sample::select(vec![0.0, 0.0, 2e-13, 0.01]),
        holes in any::<bool>(),
    ) {
        // A skyline: columns between grid lines (or between lines and middles of cells) up to heights on grid lines.
        let lines = GridLines { u, v };
        let halves = |lines: &[f64]| -> Vec<f64> {
            let mut all: Vec<f64> = lines.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]).collect();
            all.push(1.0);
            all
        };
        let (hu, hv) = (halves(&lines.u), halves(&lines.v));
        let mut columns: Vec<usize> = walls.iter().map(|w| w.0 % hu.len()).collect();
        columns.sort_unstable();
        columns.dedup();
        prop_assume!(columns.len() >= 2);
        let mut skyline = vec![DVec2::new(hu[columns[columns.len() - 1]], 0.0)];
        for (k, w) in columns.windows(2).rev().enumerate() {
            let height = (hv[1 + walls[k].1 % (hv.len() - 1)] - offset).max(0.02);
            skyline.push(DVec2::new(hu[w[1]], height));
            skyline.push(DVec2::new(hu[w[0]], height));
        }
        skyline.push(DVec2::new(hu[columns[0]], 0.0));
        skyline.dedup();
        let mut loops = vec![skyline];
        if holes {
            let low = 0.4 * loops[0].iter().map(|p| p.y).filter(|y| *y > 0.0).fold(1.0, f64::min);
            let (a, b) = (hu[columns[0]], hu[columns[1]]);
            loops.push(rectangle([a.lerp_to(b, 0.25), a.lerp_to(b, 0.75)], [0.5 * low, low]));
            let snap = snapped(&loops[1], &lines, 0.01);
            loops[1] = snap;
        }
        prop_assume!(is_simple(&loops));
        check(&lines, &region(loops));
    }

    #[test]
    fn lattice_polygons_that_touch_lines_and_corners_conform(
        cells in (1_usize..7, 1_usize..7),
        radii in prop::collection::vec(2_i32..12, 4..24),
    ) {
        // Vertices on a lattice of which the grid's lines are a part: touches, slides and corners everywhere.
        let lines = GridLines::uniform(Domain { u: [-12.0, 12.0], v: [-12.0, 12.0] }, 2 * cells.0 + 1, 2 * cells.1 + 1);
        let n = radii.len() as f64;
        let at = |(k, &r): (usize, &i32)| (DVec2::from_angle(TAU * k as f64 / n) * f64::from(r)).round();
        let mut star: Vec<DVec2> = radii.iter().enumerate().map(at).collect();
        star.dedup();
        prop_assume!(is_simple(std::slice::from_ref(&star)));
        let frame = rectangle([-12.0, 12.0], [-12.0, 12.0]);
        check(&lines, &region(vec![star.clone()]));
        if star.iter().all(|p| p.abs().max_element() < 12.0) {
            check(&lines, &region(vec![frame, star]));
        }
    }
}

trait LerpTo {
    fn lerp_to(self, end: f64, t: f64) -> f64;
}

impl LerpTo for f64 {
    fn lerp_to(self, end: f64, t: f64) -> f64 {
        self + (end - self) * t
    }
}
