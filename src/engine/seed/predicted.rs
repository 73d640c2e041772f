//! The predicted seed: the optimum of thesis 4.4.4 looked for with few trial flattenings (the open question of chapter 7).
//!
//! What the shape says before any trial: seeds next to each other flatten much alike, so the change over the mesh is a
//! landscape of a few wide basins, and what closes least (a band round an axis) often flattens from a corner of its border
//! alone. Hence
//! 1. the *corners* of the border are tried, the sharpest first, since a basin there is a few triangles wide;
//! 2. then seeds as far from all tried ones as there are, in steps over shared edges, until a share of the trials is used;
//! 3. from the best of these, places about a step away are tried, those farthest from all tried ones first. One that is
//!    better is gone to; where none is, the step is halved. Then from the second best, and so on. Of seeds that fail, the one
//!    that got further is better.
//!
//! In the third part a trial ends as soon as it can no longer beat the place that it is compared with. Trials are
//! [`SHARE`] of the triangles, within [`LEAST`] and [`MOST`]. Nothing depends on the number of threads. Limits: a
//! basin that lies between all trials of the first two parts is missed; then another seed wins, or none succeeds.

use std::collections::VecDeque;

use super::search::Search;
use crate::engine::budget::Observer;
use crate::engine::curvature::Ring;
use crate::engine::error::EngineError;
use crate::engine::mesh::topology::NONE;
use crate::engine::mesh::{Mesh, Topology, measures};

/// Trials for each triangle: an exhaustive search has one each. Below a hundredth with something to spare.
const SHARE: f64 = 0.007;
/// So many trials at least: fewer find no basin. A hundredth of 1600 triangles is as many; on smaller meshes they are more than
/// that, and take a few milliseconds all together.
const LEAST: usize = 16;
/// So many at most: on fine meshes the basins are as wide as on coarse ones.
const MOST: usize = 64;

/// Share of the trials that is spread over the mesh; the rest goes to where the best of these are.
const SPREAD: f64 = 0.4;
/// Of that rest, the share that the best start leaves to the others.
const OTHERS: f64 = 0.25;

/// Corners that are tried at most.
const CORNERS: usize = 6;
/// The border turns at a corner: the angles of its triangles add up to less than this, radians. A straight border has pi, the
/// corner of a grid about half of that.
const CORNER_ANGLE: f64 = 2.0;
/// Corners are so many steps over shared edges apart.
const CORNERS_APART: u32 = 6;

/// Places that are tried about one place before the step is halved.
const DIRECTIONS: usize = 4;
/// Between which multiples of the step from it they are.
const RING: [f64; 2] = [0.6, 1.3];
/// They are so many steps away from whatever was tried, at least.
const CLEAR: f64 = 0.6;

/// How many seeds are tried on a mesh of so many triangles.
#[must_use]
pub fn trials(triangles: usize) -> usize {
    ((SHARE * triangles as f64) as usize).clamp(LEAST, MOST).min(triangles)
}

/// Tries seeds until the trials are used, none is left or the time is over.
pub(super) fn run(
    search: &mut Search,
    mesh: &Mesh,
    topology: &Topology,
    observer: &dyn Observer,
) -> Result<(), EngineError> {
    let triangles = topology.triangle_count();
    let trials = trials(triangles);
    if trials == 0 {
        return Ok(());
    }
    let mut field = Field::new(topology);
    let spread = spread(mesh, &mut field, ((SPREAD * trials as f64) as usize).max(1));
    observer.check()?;
    search.slice(&spread, None, observer)?;
    observer.progress(search.tried() as f64 / trials as f64);
    let step = f64::from(field.farthest().map_or(0, |(hops, _)| hops));
    let left_to_others = (OTHERS * (trials - spread.len().min(trials)) as f64) as usize;
    for (k, start) in search.ranked(spread).into_iter().enumerate() {
        let until = if k == 0 { trials - left_to_others } else { trials };
        let mut descent = Descent { at: start, step, until };
        descent.go(search, &mut field, (observer, trials))?;
        if search.spent() || search.tried() >= trials {
            break;
        }
    }
    Ok(())
}

/// Corners of the border, then what is farthest from all before. They count as tried from now on.
fn spread(mesh: &Mesh, field: &mut Field, wanted: usize) -> Vec<u32> {
    let mut seeds = Vec::with_capacity(wanted);
    for corner in corners(mesh, field.topology) {
        if seeds.len() < wanted.min(CORNERS) && field.hops[corner as usize] >= CORNERS_APART {
            field.tried(corner);
            seeds.push(corner);
        }
    }
    if seeds.is_empty() {
        // A border without corners, or none: the middle of the mesh.
        let first = measures::central_triangle(mesh, None).unwrap_or(0);
        field.tried(first);
        seeds.push(first);
    }
    while seeds.len() < wanted {
        let Some((_, seed)) = field.farthest() else { break };
        field.tried(seed);
        seeds.push(seed);
    }
    seeds
}

/// For each corner of the border the first triangle at it, the sharpest corner first.
fn corners(mesh: &Mesh, topology: &Topology) -> Vec<u32> {
    let mut at_border = vec![false; mesh.positions.len()];
    for &halfedge in topology.borders().flatten() {
        at_border[topology.origin(halfedge) as usize] = true;
    }
    let mut found = vec![(Ring::default(), NONE); mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let vertex = corners[k] as usize;
            if at_border[vertex] {
                let [p, q, r] = [0, 1, 2].map(|e| mesh.positions[corners[(k + e) % 3] as usize]);
                found[vertex].0.add([p, q, r]);
                found[vertex].1 = found[vertex].1.min(t as u32);
            }
        }
    }
    found.retain(|(ring, triangle)| *triangle != NONE && ring.angle < CORNER_ANGLE);
    found.sort_by(|a, b| a.0.angle.total_cmp(&b.0.angle).then(a.1.cmp(&b.1)));
    found.into_iter().map(|(_, triangle)| triangle).collect()
}

/// The way from one start to a place that nothing near is better than.
struct Descent {
    at: u32,
    step: f64,
    /// Trials of the search when it ends at the latest.
    until: usize,
}

impl Descent {
    fn go(
        &mut self,
        search: &mut Search,
        field: &mut Field,
        (observer, trials): (&dyn Observer, usize),
    ) -> Result<(), EngineError> {
        loop {
            let mut better = false;
            let [near, far] = RING.map(|share| (share * self.step).max(1.0));
            let ring = field.ring(self.at, near, far);
            for _ in 0..DIRECTIONS {
                if search.tried() >= self.until || search.out_of_time(observer) {
                    return Ok(());
                }
                observer.check()?;
                let Some(seed) = field.clearest(&ring, CLEAR * self.step) else { break };
                field.tried(seed);
                search.slice(&[seed], search.change(self.at), observer)?;
                observer.progress(search.tried() as f64 / trials as f64);
                if search.is_better(seed, self.at) {
                    self.at = seed;
                    better = true;
                    break;
                }
            }
            if !better {
                if self.step <= 1.0 {
                    return Ok(());
                }
                self.step = (0.5 * self.step).max(1.0);
            }
        }
    }
}

/// How far each triangle is from what was tried, in steps over shared edges.
struct Field<'a> {
    topology: &'a Topology,
    /// [`NONE`] where nothing tried can be reached.
    hops: Vec<u32>,
    /// For each triangle the last walk that came to it.
    seen: Vec<u32>,
    walks: u32,
    queue: VecDeque<(u32, u32)>,
}

impl<'a> Field<'a> {
    fn new(topology: &'a Topology) -> Self {
        let triangles = topology.triangle_count();
        Self { topology, hops: vec![NONE; triangles], seen: vec![0; triangles], walks: 0, queue: VecDeque::new() }
    }

    /// A seed is tried: whatever is nearer to it than to all before is this near now.
    fn tried(&mut self, seed: u32) {
        self.hops[seed as usize] = 0;
        self.queue.clear();
        self.queue.push_back((seed, 0));
        while let Some((t, hops)) = self.queue.pop_front() {
            for next in neighbours(self.topology, t) {
                if self.hops[next as usize] > hops + 1 {
                    self.hops[next as usize] = hops + 1;
                    self.queue.push_back((next, hops + 1));
                }
            }
        }
    }

    /// The triangle farthest from all that were tried, the lowest of several, with its distance; none when all were.
    fn farthest(&self) -> Option<(u32, u32)> {
        let mut best = (0, 0);
        for (t, &hops) in self.hops.iter().enumerate() {
            if hops > best.0 {
                best = (hops, t as u32);
            }
        }
        (best.0 > 0).then_some(best)
    }

    /// The triangles between two distances from one, nearest first.
    fn ring(&mut self, at: u32, near: f64, far: f64) -> Vec<u32> {
        self.walks += 1;
        self.seen[at as usize] = self.walks;
        self.queue.clear();
        self.queue.push_back((at, 0));
        let mut ring = Vec::new();
        while let Some((t, hops)) = self.queue.pop_front() {
            if f64::from(hops) >= near {
                ring.push(t);
            }
            if f64::from(hops + 1) > far {
                continue;
            }
            for next in neighbours(self.topology, t) {
                if std::mem::replace(&mut self.seen[next as usize], self.walks) != self.walks {
                    self.queue.push_back((next, hops + 1));
                }
            }
        }
        ring
    }

    /// Of a ring, the untried triangle farthest from all that were tried, the lowest of several, if it is this far away.
    fn clearest(&self, ring: &[u32], clear: f64) -> Option<u32> {
        let distance = |t: u32| self.hops[t as usize];
        let best = ring.iter().copied().max_by(|&a, &b| distance(a).cmp(&distance(b)).then(b.cmp(&a)))?;
        // A neighbour is the nearest that there is.
        (f64::from(distance(best)) >= clear.clamp(1.0, f64::INFINITY)).then_some(best)
    }
}

/// The triangles across the three edges of one.
fn neighbours(topology: &Topology, triangle: u32) -> impl Iterator<Item = u32> {
    (3 * triangle..3 * triangle + 3).map(|h| topology.twin(h)).filter(|&twin| twin != NONE).map(|twin| twin / 3)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::engine::budget::Unobserved;
    use crate::engine::flattening::FlatteningError;
    use crate::engine::job::{SearchMeasure, SearchOptions, SearchStrategy};
    use crate::engine::mesh::test_meshes::{Diagonal, grid};
    use crate::engine::seed::search::{SearchSettings, search};
    use crate::engine::seed::{SeedOutcome, SeedSearch};

    fn dome(m: usize, n: usize, depth: f64) -> Mesh {
        grid(m, n, Diagonal::Regular, |u, v| {
            let (x, y) = (u - 0.5, v - 0.5);
            DVec3::new(100.0 * x, 90.0 * y, -depth * (x * x + 0.7 * y * y + 0.1 * x))
        })
    }

    fn settings(strategy: SearchStrategy) -> SearchSettings<'static> {
        SearchSettings { options: SearchOptions { strategy, ..SearchOptions::default() }, ..SearchSettings::default() }
    }

    fn searched(mesh: &Mesh, strategy: SearchStrategy) -> SeedSearch {
        search(mesh, &Topology::new(mesh).unwrap(), &settings(strategy), &Unobserved).unwrap()
    }

    #[test]
    fn trials_are_a_share_of_the_triangles_within_bounds() {
        let expected = [(0, 0), (5, 5), (1000, 16), (3042, 21), (6962, 48), (19_602, 64), (1_000_000, 64)];
        for (triangles, wanted) in expected {
            assert_eq!(trials(triangles), wanted, "{triangles}");
        }
    }

    #[test]
    fn corners_come_first_and_then_what_is_farthest_from_all_before() {
        let mesh = dome(20, 20, 30.0);
        let topology = Topology::new(&mesh).unwrap();
        let mut field = Field::new(&topology);
        let seeds = spread(&mesh, &mut field, 9);
        let cell = |t: u32| (t / 2 % 19, t / 2 / 19);
        let mut corners: Vec<(u32, u32)> = seeds[..4].iter().map(|&t| cell(t)).collect();
        corners.sort_unstable();
        assert_eq!(corners, [(0, 0), (0, 18), (18, 0), (18, 18)]);
        // Every further one is as far from those before as any triangle is.
        for k in 4..seeds.len() {
            let mut before = Field::new(&topology);
            seeds[..k].iter().for_each(|&seed| before.tried(seed));
            let (hops, first) = before.farthest().unwrap();
            assert_eq!((before.hops[seeds[k] as usize], first), (hops, seeds[k]));
        }
    }

    #[test]
    fn a_ring_holds_what_is_between_two_distances_and_nothing_else() {
        let mesh = dome(14, 11, 30.0);
        let topology = Topology::new(&mesh).unwrap();
        let mut from = Field::new(&topology);
        from.tried(101);
        let mut field = Field::new(&topology);
        for (near, far) in [(1.0, 1.0), (2.4, 5.2), (6.0, 13.0)] {
            let mut ring = field.ring(101, near, far);
            ring.sort_unstable();
            let between = |t: &u32| (near..=far).contains(&f64::from(from.hops[*t as usize]));
            let expected: Vec<u32> = (0..topology.triangle_count() as u32).filter(between).collect();
            assert_eq!(ring, expected);
        }
    }

    #[test]
    fn on_a_dome_few_trials_come_within_a_tenth_of_the_optimum() {
        let mesh = dome(40, 40, 60.0);
        for measure in [SearchMeasure::Area, SearchMeasure::Shape] {
            let of = |strategy| {
                let options = SearchOptions { measure, strategy, ..SearchOptions::default() };
                let settings = SearchSettings { options, ..SearchSettings::default() };
                search(&mesh, &Topology::new(&mesh).unwrap(), &settings, &Unobserved).unwrap()
            };
            let (few, all) = (of(SearchStrategy::Predicted), of(SearchStrategy::Exhaustive));
            assert_eq!(few.tried as usize, trials(mesh.triangles.len()));
            let report = few.report(&[]);
            assert_eq!((report.strategy.as_str(), report.complete), ("predicted", false));
            assert_eq!(report.almost_developable, Some(true));
            let (few, all) = (few.best.unwrap().percent, all.best.unwrap().percent);
            assert!(few >= all && few < 1.1 * all, "{few} {all}");
        }
    }

    #[test]
    fn when_none_succeeds_the_furthest_failure_is_told_and_nothing_is_said_of_the_rest() {
        let mesh = grid(24, 24, Diagonal::Diamond, |u, v| {
            let (x, y) = (u - 0.5, v - 0.5);
            DVec3::new(x, y, 40.0 * (x * x + y * y))
        });
        let few = searched(&mesh, SearchStrategy::Predicted);
        assert_eq!(few.almost_developable(), None);
        let Err(FlatteningError::NonePredicted { tried, seeds, furthest }) = few.best else { panic!("{:?}", few.best) };
        assert_eq!((tried as usize, seeds as usize), (trials(mesh.triangles.len()), mesh.triangles.len()));
        assert!(matches!(*furthest, FlatteningError::Flipped { .. }));
        assert_eq!(searched(&mesh, SearchStrategy::Exhaustive).almost_developable(), Some(false));
    }

    #[test]
    fn a_mesh_without_border_or_of_few_triangles_is_searched_too() {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let positions = vec![at(0.0, 0.0, 0.0), at(5.0, 0.3, 0.0), at(0.4, 2.0, 0.0), at(0.2, 0.1, 1.0)];
        let closed = Mesh { positions, uv: None, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] };
        assert_eq!(searched(&closed, SearchStrategy::Predicted).tried, 4);
        let one = dome(2, 2, 1.0);
        let found = searched(&one, SearchStrategy::Predicted);
        assert!(found.complete() && found.best.is_ok());
        assert_eq!(searched(&Mesh::default(), SearchStrategy::Predicted).best, Err(FlatteningError::SeedNotFound));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn no_byte_depends_on_the_threads_and_what_was_tried_is_what_the_whole_search_says_of_it(
            m in 5..16_usize, n in 5..16_usize, depth in 1.0..150.0_f64,
            diagonal in prop::sample::select(Diagonal::ALL.to_vec()),
        ) {
            let mesh = grid(m, n, diagonal, |u, v| DVec3::new(100.0 * u, 80.0 * v, depth * (u * u * v - 0.4 * v * v)));
            let results: Vec<SeedSearch> = [1, 3]
                .map(|threads| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                    pool.install(|| searched(&mesh, SearchStrategy::Predicted))
                })
                .into();
            prop_assert_eq!(&results[0], &results[1]);
            let landscape = SearchSettings { landscape: true, ..settings(SearchStrategy::Exhaustive) };
            let all = search(&mesh, &Topology::new(&mesh).unwrap(), &landscape, &Unobserved).unwrap();
            prop_assert_eq!(results[0].tried as usize, trials(mesh.triangles.len()));
            for (few, all) in results[0].outcomes.iter().zip(&all.outcomes) {
                if let SeedOutcome::Flattened(changes) = few {
                    prop_assert_eq!(changes.area_percent, all.changes().unwrap().area_percent);
                }
            }
        }
    }
}
