//! What the scheme `symmetric` promises: no accident of the mesh's description decides anything, and levels settle.

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::cader::{CaderMesh, Scratch, Stop, flatten, flatten_once, flatten_while};
use super::rigid::Rigid;
use super::{Check, FlatteningError, Readings};
use crate::engine::budget::Unobserved;
use crate::engine::job::{SearchMeasure, SearchOptions};
use crate::engine::mesh::test_meshes::{Diagonal, grid};
use crate::engine::mesh::{Mesh, Topology};
use crate::engine::seed::{SearchSettings, search};

/// Of the mesh's size: what two descriptions of one surface may differ by.
const SAME: f64 = 1e-9;

/// A hill with a dale beside it, bent the more the higher.
fn hill(m: usize, n: usize, diagonal: Diagonal, height: f64) -> Mesh {
    grid(m, n, diagonal, |u, v| {
        let bump = |x: f64, y: f64| (-9.0 * ((u - x).powi(2) + (v - y).powi(2))).exp();
        DVec3::new(10.0 * u + 0.3 * v * v, 8.0 * v, height * (bump(0.4, 0.5) - 0.6 * bump(0.9, 0.2)))
    })
}

fn flat(mesh: &Mesh, seed: u32) -> Vec<DVec2> {
    let (flattening, error) = flatten_once(mesh, &Topology::new(mesh).unwrap(), Readings::SYMMETRIC, seed).unwrap();
    assert_eq!(error, None);
    flattening.flat
}

/// Numbers in an order that depends on these keys alone.
fn shuffled(count: usize, keys: &[u32]) -> Vec<u32> {
    let mut numbers: Vec<u32> = (0..count as u32).collect();
    numbers.sort_by_key(|&k| (u64::from(keys[k as usize % keys.len()]) * u64::from(2 * k + 1)) % 1009);
    numbers
}

/// The same surface told otherwise: vertex v becomes `vertices[v]`, triangle `triangles[k]` stands at k with its corners
/// turned on by `turns`.
fn retold(mesh: &Mesh, vertices: &[u32], triangles: &[u32], turns: &[u32]) -> Mesh {
    let mut positions = vec![DVec3::ZERO; mesh.positions.len()];
    for (v, &p) in mesh.positions.iter().enumerate() {
        positions[vertices[v] as usize] = p;
    }
    let told = |(k, &t): (usize, &u32)| {
        let mut corners = mesh.triangles[t as usize].map(|v| vertices[v as usize]);
        corners.rotate_left((turns[k % turns.len()] % 3) as usize);
        corners
    };
    Mesh { positions, triangles: triangles.iter().enumerate().map(told).collect(), uv: None }
}

/// The surface in a mirror, triangles anticlockwise again.
fn mirrored(mesh: &Mesh) -> Mesh {
    let positions = mesh.positions.iter().map(|p| DVec3::new(p.x, p.y, -p.z)).collect();
    let triangles = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    Mesh { positions, triangles, uv: None }
}

proptest! {
    #[test]
    fn numbering_and_first_corners_decide_nothing(
        height in 0.0..2.5, seed in 0_u32..400, keys in prop::collection::vec(any::<u32>(), 7..40),
    ) {
        let mesh = hill(17, 14, Diagonal::Regular, height);
        let vertices = shuffled(mesh.positions.len(), &keys);
        let triangles = shuffled(mesh.triangles.len(), &keys[3..]);
        let other = retold(&mesh, &vertices, &triangles, &keys);
        let there = triangles.iter().position(|&t| t == seed).unwrap() as u32;
        let (one, two) = (flat(&mesh, seed), flat(&other, there));
        let told: Vec<DVec2> = vertices.iter().map(|&v| two[v as usize]).collect();
        // The seed's first corner decides how the pattern is turned, and nothing else.
        prop_assert!(Rigid::fit(&told, &one).residual < SAME * 10.0);
    }

    #[test]
    fn a_mirror_image_is_flattened_to_the_mirror_image(height in 0.0..2.5, seed in 0_u32..400) {
        let mesh = hill(17, 14, Diagonal::Diamond, height);
        let (one, two) = (flat(&mesh, seed), flat(&mirrored(&mesh), seed));
        let back: Vec<DVec2> = two.iter().map(|p| DVec2::new(p.x, -p.y)).collect();
        prop_assert!(Rigid::fit(&back, &one).residual < SAME * 10.0);
    }
}

#[test]
fn the_counts_do_not_depend_on_the_numbering_either() {
    let mesh = hill(17, 14, Diagonal::ChevronRows, 1.0);
    let keys = [17, 91, 4, 230, 5];
    let triangles = shuffled(mesh.triangles.len(), &keys);
    let vertices: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let other = retold(&mesh, &vertices, &triangles, &keys);
    let there = triangles.iter().position(|&t| t == 200).unwrap() as u32;
    let levels = |mesh: &Mesh, seed| {
        flatten_once(mesh, &Topology::new(mesh).unwrap(), Readings::SYMMETRIC, seed).unwrap().0.levels
    };
    let counts = levels(&mesh, 200);
    assert_eq!(counts, levels(&other, there));
    assert_eq!(counts.iter().map(|l| l.triangles as usize).sum::<usize>(), mesh.triangles.len());
    assert!(counts.iter().any(|l| l.averaged > 0));
}

#[test]
fn by_the_thesis_the_same_surface_told_otherwise_has_another_pattern() {
    // What the scheme is for: were this not so, the properties above would show nothing.
    let mesh = hill(17, 14, Diagonal::Diamond, 2.0);
    let of = |mesh: &Mesh| flatten_once(mesh, &Topology::new(mesh).unwrap(), Readings::default(), 200).unwrap().0.flat;
    let back: Vec<DVec2> = of(&mirrored(&mesh)).iter().map(|p| DVec2::new(p.x, -p.y)).collect();
    assert!(Rigid::fit(&back, &of(&mesh)).residual > 1e-3);
}

#[test]
fn triangles_lie_still_when_they_have_settled() {
    let mesh = hill(24, 20, Diagonal::Diamond, 2.0);
    let prepared = CaderMesh::new(&mesh, &Topology::new(&mesh).unwrap()).unwrap();
    let lag = prepared.settles_within(Readings::SYMMETRIC).unwrap() as usize;
    let mut scratch = Scratch::new();
    // After each level, the places of all triangles that have settled by then.
    let mut settled: Vec<(u32, [DVec2; 3])> = Vec::new();
    let run = flatten_while(&prepared, Readings::SYMMETRIC, 77, &mut scratch, |scratch| {
        let done: usize = scratch.levels().iter().rev().skip(lag).map(|l| l.triangles as usize).sum();
        for triangle in scratch.stretch(settled.len()..done) {
            settled.push((triangle, mesh.triangles[triangle as usize].map(|v| scratch.flat()[v as usize])));
        }
        true
    });
    assert_eq!(run, Ok(()));
    assert!(settled.len() > mesh.triangles.len() / 2);
    for (triangle, places) in settled {
        assert_eq!(mesh.triangles[triangle as usize].map(|v| scratch.flat()[v as usize]), places);
    }
}

#[test]
fn the_search_finds_the_same_seed_whether_losers_are_abandoned_and_with_any_number_of_threads() {
    let mesh = hill(16, 15, Diagonal::Regular, 1.5);
    let topology = Topology::new(&mesh).unwrap();
    for measure in [SearchMeasure::Area, SearchMeasure::Shape] {
        let options = SearchOptions { measure, ..SearchOptions::default() };
        let with = |landscape, threads| {
            let settings =
                SearchSettings { readings: Readings::SYMMETRIC, options, landscape, ..SearchSettings::default() };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| search(&mesh, &topology, &settings, &Unobserved)).unwrap()
        };
        let (whole, one, three) = (with(true, 2), with(false, 1), with(false, 3));
        assert_eq!(one, three);
        assert_eq!(one.best, whole.best);
        assert!(one.abandoned > 50, "{}", one.abandoned);
    }
}

#[test]
fn a_failure_names_the_place_and_leaves_the_levels_beyond_unplaced() {
    let mesh = grid(24, 24, Diagonal::Diamond, |u, v| {
        let (x, y) = (u - 0.5, v - 0.5);
        DVec3::new(x, y, 40.0 * (x * x + y * y))
    });
    let topology = Topology::new(&mesh).unwrap();
    let (flattening, error) = flatten_once(&mesh, &topology, Readings::SYMMETRIC, 500).unwrap();
    let Some(FlatteningError::Flipped { triangle, level, flattened, place, .. }) = error else { panic!("{error:?}") };
    assert_eq!((place.triangle, place.level), (Some(triangle), Some(level)));
    assert_eq!((level as usize + 1, flattened as usize), (flattening.levels.len(), flattening.sequence.len()));
    assert_eq!(flattening.levels.iter().map(|l| l.triangles).sum::<u32>(), flattened);
    assert!((flattened as usize) < mesh.triangles.len() && flattening.flat.iter().any(|p| p.is_nan()));
    let [a, b, c] = mesh.triangles[triangle as usize].map(|v| flattening.flat[v as usize]);
    assert!((b - a).perp_dot(c - a) <= 0.0);
    // With the test at the end alone the run comes to the end, and says so there.
    let late = Readings { check: Check::Final, ..Readings::SYMMETRIC };
    let (flattening, error) = flatten_once(&mesh, &topology, late, 500).unwrap();
    assert!(matches!(error, Some(FlatteningError::Flipped { .. })));
    assert_eq!(flattening.sequence.len(), mesh.triangles.len());
}

#[test]
fn a_reused_scratch_forgets_the_run_before_and_pieces_are_told() {
    let (large, small) = (hill(17, 14, Diagonal::Diamond, 1.0), hill(6, 5, Diagonal::Regular, 1.0));
    let mut scratch = Scratch::new();
    for (mesh, seed) in [(&large, 9), (&small, 20), (&large, 300), (&large, 9)] {
        let prepared = CaderMesh::new(mesh, &Topology::new(mesh).unwrap()).unwrap();
        assert_eq!(flatten(&prepared, Readings::default(), 0, &mut scratch), Ok(()));
        assert_eq!(flatten(&prepared, Readings::SYMMETRIC, seed, &mut scratch), Ok(()));
        assert_eq!(scratch.flat(), flat(mesh, seed));
    }
    let mut pieces = small;
    // Six columns of vertices; without the fourth nothing joins those before to those behind.
    pieces.triangles.retain(|t| t.iter().all(|v| v % 6 != 3));
    let prepared = CaderMesh::new(&pieces, &Topology::new(&pieces).unwrap()).unwrap();
    let stop = flatten(&prepared, Readings::SYMMETRIC, 0, &mut scratch);
    assert!(matches!(stop, Err(Stop::Unreached { unreached }) if unreached > 0), "{stop:?}");
}
