//! The order in which seeds are tried: the promising ones first.
//!
//! A search that may abandon seeds, or that may run out of time, gains by knowing a good seed early. First comes a
//! *sample*: triangles spread over the mesh. Seeds next to each other flatten much alike, so then come the neighbours of
//! the best seeds of the sample, in breadth-first levels over shared edges, and so on to the whole mesh. The order is a
//! function of the mesh and of what the sample gave: the number of threads has no part in it.

use crate::engine::mesh::Topology;
use crate::engine::mesh::topology::NONE;

/// Seeds of the sample for each square root of the mesh's triangles. One for each such root is some two hundredths of
/// the work at 7000 triangles; fewer would miss good regions, more would delay going near them.
const SAMPLE_PER_ROOT: f64 = 1.0;

/// Seeds of the sample whose neighbours come first, all of them at once: a search for area change has a few basins.
const BASINS: usize = 4;

/// How many seeds the sample of a mesh has.
pub(super) fn sample_size(triangles: usize) -> usize {
    ((SAMPLE_PER_ROOT * (triangles as f64).sqrt()).ceil() as usize).min(triangles)
}

/// The sample: steps of the golden section through the numbers of the triangles. Numbers run along the rows of a mesh,
/// and such steps fill rows and columns evenly, however long the rows are.
pub(super) fn sample(triangles: usize) -> Vec<u32> {
    let wanted = sample_size(triangles);
    let step = coprime_step(triangles);
    (0..wanted).map(|k| (k * step % triangles) as u32).collect()
}

/// All other triangles: neighbours of the best of the sample first. `ranked` is the sample, best first.
pub(super) fn others(topology: &Topology, ranked: &[u32]) -> Vec<u32> {
    let triangles = topology.triangle_count();
    let mut tried = vec![false; triangles];
    for &t in ranked {
        tried[t as usize] = true;
    }
    let mut seen = vec![false; triangles];
    let mut order: Vec<u32> = Vec::with_capacity(triangles);
    let mut from = 0;
    // The basins together, then whatever cannot be reached from them, piece by piece.
    let starts =
        ranked.iter().copied().take(BASINS).map(|t| (t, false)).chain((0..triangles as u32).map(|t| (t, true)));
    let mut pending = false;
    for (start, alone) in starts {
        if alone && pending {
            spread(topology, &mut order, &mut from, &mut seen);
            pending = false;
        }
        if !std::mem::replace(&mut seen[start as usize], true) {
            order.push(start);
            pending = true;
        }
    }
    spread(topology, &mut order, &mut from, &mut seen);
    order.retain(|&t| !tried[t as usize]);
    order
}

/// Goes on over shared edges as far as it gets.
fn spread(topology: &Topology, order: &mut Vec<u32>, from: &mut usize, seen: &mut [bool]) {
    while let Some(&t) = order.get(*from) {
        *from += 1;
        for h in 3 * t..3 * t + 3 {
            let twin = topology.twin(h);
            if twin != NONE && !std::mem::replace(&mut seen[(twin / 3) as usize], true) {
                order.push(twin / 3);
            }
        }
    }
}

/// The step next to the golden section of `n` that meets every number below `n`.
fn coprime_step(n: usize) -> usize {
    let golden = (n as f64 * 0.618_033_988_749_894_9) as usize;
    (golden.max(1)..=n.max(1)).find(|&step| gcd(step, n) == 1).unwrap_or(1)
}

const fn gcd(mut a: usize, mut b: usize) -> usize {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid_triangles};

    #[test]
    fn sample_and_others_together_are_all_triangles_each_once() {
        for (m, n) in [(2, 2), (7, 5), (30, 20)] {
            let topology = Topology::of_triangles(&grid_triangles(m, n, Diagonal::Regular), m * n).unwrap();
            let sample = sample(topology.triangle_count());
            assert_eq!(sample.len(), sample_size(topology.triangle_count()));
            let mut all: Vec<u32> = sample.iter().copied().chain(others(&topology, &sample)).collect();
            all.sort_unstable();
            assert_eq!(all, (0..topology.triangle_count() as u32).collect::<Vec<_>>());
        }
    }

    #[test]
    fn triangles_that_cannot_be_reached_come_too() {
        let topology = Topology::of_triangles(&[[0, 1, 2], [3, 4, 5], [5, 4, 6]], 7).unwrap();
        let mut all = others(&topology, &[1]);
        all.push(1);
        all.sort_unstable();
        assert_eq!(all, [0, 1, 2]);
    }

    #[test]
    fn the_neighbours_of_the_best_come_first() {
        let topology = Topology::of_triangles(&grid_triangles(12, 12, Diagonal::Regular), 144).unwrap();
        // Triangle 100 lies inside: three neighbours.
        let order = others(&topology, &[100]);
        let near: Vec<u32> = (300..303).map(|h| topology.twin(h) / 3).collect();
        assert_eq!(order[..3], near[..]);
    }

    #[test]
    fn the_sample_meets_every_quarter_of_the_mesh() {
        let triangles = 2 * 59 * 59;
        let mut counts = [[0; 4]; 4];
        for t in sample(triangles) {
            let (i, j) = (t as usize / 2 % 59, t as usize / 2 / 59);
            counts[i * 4 / 59][j * 4 / 59] += 1;
        }
        assert!(counts.iter().flatten().all(|&c| c > 0), "{counts:?}");
    }

    #[test]
    fn no_triangle_has_no_sample() {
        assert!(sample(0).is_empty());
        assert_eq!(sample(1), [0]);
    }
}
