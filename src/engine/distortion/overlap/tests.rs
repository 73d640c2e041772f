//! Shapes with known overlaps, and random polygons against plain sums over horizontal slabs.

use std::f64::consts::TAU;

use proptest::prelude::*;

use super::border::Crossing;
use super::predicate::left;
use super::*;
use crate::engine::budget::Unobserved;
use crate::engine::mesh::test_meshes::{Diagonal, grid_triangles};

/// A strip of `n` by 2 points whose sides are `inner` and `outer` of t in [0, 1], the mesh between them.
fn strip(n: usize, outer: impl Fn(f64) -> DVec2, inner: impl Fn(f64) -> DVec2) -> (Vec<DVec2>, Topology) {
    let t = |k: usize| k as f64 / (n - 1) as f64;
    let flat = (0..n).map(|k| outer(t(k))).chain((0..n).map(|k| inner(t(k)))).collect();
    (flat, Topology::of_triangles(&grid_triangles(n, 2, Diagonal::Regular), 2 * n).unwrap())
}

fn found(flat: &[DVec2], topology: &Topology) -> Overlaps {
    let found = overlaps(flat, topology, &Unobserved).unwrap();
    assert!(found.complete);
    found
}

/// Loops of points as a border.
fn border_of(loops: &[Vec<DVec2>]) -> Border {
    let mut border = Border::default();
    for points in loops {
        let halfedges: Vec<u32> = (0..points.len() as u32).map(|k| border.points.len() as u32 + k).collect();
        border.push(points.iter().copied(), &halfedges);
    }
    border.shaken()
}

fn of_loops(loops: &[Vec<DVec2>]) -> Overlaps {
    of_border(&border_of(loops), &Unobserved).unwrap()
}

fn square(low: [f64; 2], size: f64) -> Vec<DVec2> {
    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|p| DVec2::from(low) + DVec2::from(p) * size).to_vec()
}

#[test]
fn a_ring_that_goes_round_more_than_once_overlaps_by_the_excess() {
    // Steps of 10 degrees: 400 degrees cover 4 steps twice, whose area is that of four quadrangles.
    let ring = |degrees: f64, n: usize, lift: f64| {
        let at = move |t: f64, r: f64| DVec2::from_angle((degrees * t).to_radians()) * (r + lift * t);
        strip(n, move |t| at(t, 5.0), move |t| at(t, 3.0))
    };
    let (flat, topology) = ring(400.0, 41, 0.0);
    let cell = 0.5 * (25.0 - 9.0) * 10.0_f64.to_radians().sin();
    let overlap = found(&flat, &topology);
    assert_eq!(overlap.regions.len(), 1, "{overlap:?}");
    assert!((overlap.area_mm2 - 4.0 * cell).abs() < 1e-9, "{} {}", overlap.area_mm2, 4.0 * cell);
    assert_eq!(overlap.regions[0].places.len(), 2);
    // The ends of a full turn touch, and less than that leaves a gap.
    for (degrees, n) in [(360.0, 37), (350.0, 36)] {
        let (flat, topology) = ring(degrees, n, 0.0);
        assert_eq!(found(&flat, &topology).regions, [], "{degrees}");
    }
    // A spiral that rises by more than its width does not meet itself; one that rises by less does, all the way.
    let (flat, topology) = ring(1000.0, 301, 2.0 * 1000.0 / 360.0 + 0.1);
    assert_eq!(found(&flat, &topology).regions, []);
    let (flat, topology) = ring(1000.0, 301, 1.0 * 1000.0 / 360.0);
    assert_eq!(found(&flat, &topology).regions.len(), 1);
}

#[test]
fn a_figure_of_eight_overlaps_where_its_bands_cross() {
    // Two loops side by side; the band is 0.2 wide and crosses itself at the origin.
    let curve = |t: f64| DVec2::new((TAU * t).sin(), (2.0 * TAU * t).sin() * 0.5);
    let side = |t: f64, by: f64| {
        let step = (curve(t + 1e-6) - curve(t - 1e-6)).normalize();
        curve(t) + step.perp() * by
    };
    // From one end to the other, short of a full turn, so that the band is a disc.
    let part = |t: f64| 0.8 * t - 0.1;
    let (flat, topology) = strip(400, |t| side(part(t), -0.1), |t| side(part(t), 0.1));
    let overlap = found(&flat, &topology);
    assert_eq!(overlap.regions.len(), 1);
    // Both bands run at 45 degrees there: a square of their width, almost.
    assert!((overlap.area_mm2 - 0.04).abs() < 0.004, "{}", overlap.area_mm2);
    let region = &overlap.regions[0];
    assert!(region.at.length() < 0.2);
    let halfway = region.bounds[0].midpoint(region.bounds[1]);
    assert!(halfway.length() < 0.02);
    // The two places are the same in the plane and far from each other along the band.
    let [p, q] = [region.places[0], region.places[1]];
    assert!(p.of(&topology, &flat).distance(q.of(&topology, &flat)) < 1e-9);
    let along: Vec<f64> = (0..800).map(|k| f64::from(k % 400) / 399.0).collect();
    assert!((p.of(&topology, &along) - q.of(&topology, &along)).abs() > 0.3);
}

#[test]
fn borders_may_touch() {
    let two = [square([0.0, 0.0], 1.0), square([1.0, 0.0], 1.0), square([0.5, 1.0], 1.0), square([-0.25, -0.5], 0.5)];
    assert_eq!(of_loops(&two).regions, []);
    // A chain that comes back to its own corner and to its own side.
    let pinched = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.0], [0.0, 2.0]].map(DVec2::from).to_vec();
    assert_eq!(of_loops(&[pinched]).regions, []);
    // Rounding is no overlap; a thousandth is.
    assert_eq!(of_loops(&[square([0.0, 0.0], 1.0), square([1.0 - 1e-13, 0.0], 1.0)]).regions, []);
    let overlap = of_loops(&[square([0.0, 0.0], 1.0), square([0.999, 0.0], 1.0)]);
    assert_eq!(overlap.regions.len(), 1);
    assert!((overlap.area_mm2 - 1e-3).abs() < 1e-10);
}

#[test]
fn what_lies_on_the_mesh_without_crossing_its_border_is_found() {
    let overlap = of_loops(&[square([0.0, 0.0], 4.0), square([1.0, 1.0], 1.0)]);
    assert_eq!(overlap.regions.len(), 1);
    assert!((overlap.area_mm2 - 1.0).abs() < 1e-10);
    assert_eq!(overlap.regions[0].places.len(), 1);
    // In a hole it is no overlap; a hole's border that lies over the mesh beyond its outline is one.
    let mut hole = square([0.5, 0.5], 2.0);
    hole.reverse();
    assert_eq!(of_loops(&[square([0.0, 0.0], 4.0), hole.clone(), square([1.0, 1.0], 1.0)]).regions, []);
    assert_eq!(of_loops(&[square([0.0, 0.0], 4.0), hole]).regions, []);
}

#[test]
fn identical_pieces_on_each_other_overlap_wholly_and_thrice_counts_once() {
    for copies in [2, 3] {
        let overlap = of_loops(&vec![square([0.0, 0.0], 2.0); copies]);
        assert!((overlap.area_mm2 - 4.0).abs() < 1e-9, "{copies}: {overlap:?}");
    }
}

#[test]
fn nothing_overlaps_in_an_empty_mesh_or_one_that_is_not_flattened() {
    let (flat, topology) = strip(5, |t| DVec2::new(t, 0.0), |t| DVec2::new(t, 1.0));
    assert_eq!(found(&[], &Topology::of_triangles(&[], 0).unwrap()).regions, []);
    assert_eq!(found(&vec![DVec2::NAN; flat.len()], &topology).regions, []);
}

#[test]
fn a_spiral_with_a_million_border_edges_is_done() {
    let turns = 80.0;
    let at = |t: f64, by: f64| DVec2::from_angle(TAU * turns * t) * (10.0 + turns * t + by);
    let (mut flat, topology) = strip(500_000, |t| at(t, 0.9), |t| at(t, 0.0));
    assert_eq!(found(&flat, &topology).regions, []);
    // The inner end pulled over the next turn.
    flat[0].x += 0.8;
    assert_eq!(found(&flat, &topology).regions.len(), 1);
}

/// All crossings by comparing each edge with each.
fn every_crossing(border: &Border) -> Vec<[u32; 2]> {
    let (p, count) = (&border.points, border.points.len());
    let mut found = Vec::new();
    for i in 0..count {
        for j in i + 1..count {
            let [a, b, c, d] = [i, border.next[i] as usize, j, border.next[j] as usize];
            let apart = a != d && b != c;
            if apart && left(p, c, d, a) != left(p, c, d, b) && left(p, a, b, c) != left(p, a, b, d) {
                found.push([i as u32, j as u32]);
            }
        }
    }
    found
}

/// Area where the winding number is two or more: between neighbouring heights of nodes and crossings, widths are linear.
fn area_by_slabs(border: &Border, crossings: &[Crossing]) -> f64 {
    let mut heights: Vec<f64> = border.points.iter().map(|p| p.y).chain(crossings.iter().map(|c| c.point.y)).collect();
    heights.sort_by(f64::total_cmp);
    let slab = |[low, high]: [f64; 2]| {
        let y = 0.5 * (low + high);
        let mut cuts: Vec<(f64, i32)> = (0..border.points.len())
            .filter_map(|k| {
                let [a, b] = border.ends(k);
                let up = b.y > y;
                ((a.y > y) != up).then(|| (a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y), if up { -1 } else { 1 }))
            })
            .collect();
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut windings, mut width) = (0, 0.0);
        for w in cuts.windows(2) {
            windings += w[0].1;
            width += if windings >= 2 { w[1].0 - w[0].0 } else { 0.0 };
        }
        width * (high - low)
    };
    heights.windows(2).map(|w| slab([w[0], w[1]])).sum()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_polygons_overlap_where_plain_sums_say_so(
        loops in proptest::collection::vec(
            proptest::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64), 3..24), 1..4),
    ) {
        let loops: Vec<Vec<DVec2>> = loops.iter().map(|l| l.iter().map(|&p| p.into()).collect()).collect();
        let border = border_of(&loops);
        let mut crossings = border.crossings(&border.tree(), &Unobserved).unwrap().unwrap();
        let overlap = of_loops(&loops);
        let exact = area_by_slabs(&border, &crossings);
        prop_assert!((overlap.area_mm2 - exact).abs() < 1e-9, "{} {exact}", overlap.area_mm2);
        crossings.sort_by_key(|c| c.edges);
        prop_assert_eq!(crossings.iter().map(|c| c.edges).collect::<Vec<_>>(), every_crossing(&border));
    }

    /// Polygons on a tiny lattice: they run through their own corners and along their own sides.
    #[test]
    fn degenerate_polygons_overlap_where_plain_sums_say_so(
        points in proptest::collection::vec((0..4_i8, 0..4_i8), 3..10)
    ) {
        let points: Vec<DVec2> = points.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y))).collect();
        let border = border_of(&[points]);
        let crossings = border.crossings(&border.tree(), &Unobserved).unwrap().unwrap();
        prop_assert_eq!(crossings.len(), every_crossing(&border).len());
        let overlap = of_border(&border, &Unobserved).unwrap();
        let exact = area_by_slabs(&border, &crossings);
        prop_assert!((overlap.area_mm2 - exact).abs() < 1e-9, "{} {exact}", overlap.area_mm2);
    }

    #[test]
    fn where_the_mesh_lies_does_not_matter(angle in 0.0..6.3_f64, x in -99.0..99.0_f64, degrees in 20.0..700.0_f64) {
        let at = |t: f64, r: f64| DVec2::from_angle(angle + (degrees * t).to_radians()) * r + DVec2::splat(x);
        let (flat, topology) = strip(301, |t| at(t, 2.0), |t| at(t, 1.0));
        let overlap = found(&flat, &topology);
        let expected = 1.5 * (degrees.min(720.0) - 360.0).max(0.0).to_radians();
        // The chords of the two layers differ a little.
        prop_assert!((overlap.area_mm2 - expected).abs() < 4e-3 * (1.0 + expected), "{degrees}: {}", overlap.area_mm2);
        // What is as small as the difference of the chords may be found larger or smaller.
        let found = overlap.regions.iter().any(|r| r.area_mm2 > 1e-2);
        prop_assert!(found || expected < 1.5e-2, "{degrees}: {expected}");
        prop_assert!(!found || expected > 5e-3, "{degrees}: {expected}");
    }
}
