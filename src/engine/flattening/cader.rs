//! Cader's flattening (thesis 4.2 to 4.4; Cader et al. 2005): triangle by triangle in mapping order, averaging as it goes.
//!
//! The seed is laid down; each triangle of the mapping order is unfolded over an edge that lies already. When its apex
//! lies already too, the apex moves to the average of its positions, so that tears never open. When a triangle turns
//! over the run stops: the surface is too curved for this seed (4.4.1, 4.4.2). What the thesis leaves open is settled by
//! [`Readings`]; of these the scheme `symmetric` has a module of its own ([`symmetric`]).
//!
//! [`CaderMesh`] holds what depends on the mesh alone, [`Scratch`] what a run needs; after the first run on a mesh a
//! further one allocates nothing. A run takes O(triangles) time. Lengths are millimetres; vertices and triangles are
//! numbered as in the mesh. Only the seed's piece is reached: a mesh of several pieces is an error here.

use std::ops::Range;
use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::mapping_order::{MappingOrder, Record};
use super::rings::Rings;
use super::symmetric::{self, Cell, Memory};
use super::unfolding::{Hinge, orientation};
use super::{Anchor, Average, Check, Flattening, FlatteningError, LevelCounts, Parent, Readings, Scheme};
use crate::engine::error::Place;
use crate::engine::mesh::topology::{NONE, next, prev};
use crate::engine::mesh::{Mesh, MeshFault, Topology};

/// What every run on one mesh shares: a [`Hinge`] for each half-edge, and the ring of each vertex.
#[derive(Debug, Clone)]
pub struct CaderMesh {
    hinges: Vec<Hinge>,
    rings: Rings,
    triangles: Vec<[u32; 3]>,
    vertices: usize,
    /// No seed has more levels than this.
    most_levels: usize,
    /// See [`CaderMesh::settles_within`].
    settles_within: Option<u32>,
    /// What the scheme `symmetric` needs, made when it is first asked for.
    cells: OnceLock<Vec<Cell>>,
}

impl CaderMesh {
    /// Prepares a mesh.
    ///
    /// # Errors
    /// [`MeshFault::NotFinite`] and [`MeshFault::ZeroArea`]: a triangle without area cannot be unfolded.
    pub fn new(mesh: &Mesh, topology: &Topology) -> Result<Self, MeshFault> {
        if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
            return Err(MeshFault::NotFinite { vertex: vertex as u32 });
        }
        // The triangle beyond the border.
        let beyond = 4 * topology.triangle_count() as u32;
        let tag = |h: u32| match topology.twin(h) {
            NONE => beyond,
            twin => 4 * (twin / 3) + twin % 3,
        };
        let place = |v: u32| -> DVec3 { mesh.positions[v as usize] };
        let mut hinges = Vec::with_capacity(3 * topology.triangle_count());
        for h in 0..3 * topology.triangle_count() as u32 {
            let vertices = [topology.origin(h), topology.target(h), topology.origin(prev(h))];
            // In the order of the triangle's edges: over edge 1 the previous edge (0) comes before the next (2).
            let (one, two) = if h % 3 == 1 { (prev(h), next(h)) } else { (next(h), prev(h)) };
            let hinge = Hinge::new(vertices, vertices.map(place), [tag(one), tag(two)]);
            if !hinge.is_sound() {
                return Err(MeshFault::ZeroArea { triangle: h / 3 });
            }
            hinges.push(hinge);
        }
        let rings = Rings::new(topology);
        Ok(Self {
            hinges,
            settles_within: rings.widest_fan(),
            rings,
            triangles: topology.triangles().to_vec(),
            vertices: topology.vertex_count(),
            most_levels: most_levels(topology),
            cells: OnceLock::new(),
        })
    }

    /// When a level is done, no triangle so many levels before it moves any more. One after the other, triangles at one
    /// vertex are at most so many levels apart, and only they move it; `None` where fans of triangles only touch at a vertex:
    /// these may be any number of levels apart. By the scheme `symmetric` vertices move for some levels after they came.
    #[must_use]
    pub const fn settles_within(&self, readings: Readings) -> Option<u32> {
        match readings.scheme {
            Scheme::InTurn => self.settles_within,
            Scheme::Symmetric => Some(symmetric::WINDOW as u32),
        }
    }

    /// How many triangles there are.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The triangles' corners.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// How many vertices there are.
    pub(super) const fn vertex_count(&self) -> usize {
        self.vertices
    }

    /// No seed has more levels than this.
    pub(super) const fn most_levels(&self) -> usize {
        self.most_levels
    }

    /// The hinge of a half-edge, by its tag.
    #[inline]
    pub(super) fn hinge(&self, tag: u32) -> &Hinge {
        &self.hinges[(tag - (tag >> 2)) as usize]
    }

    /// The triangles as the scheme `symmetric` needs them.
    pub(super) fn cells(&self) -> &[Cell] {
        self.cells.get_or_init(|| self.hinges.as_chunks().0.iter().map(Cell::new).collect())
    }

    /// The tag of what lies beyond the border.
    const fn beyond(&self) -> u32 {
        4 * self.triangles.len() as u32
    }
}

/// A bound for the levels of any seed: twice those of one seed of its piece, since the way from any triangle to any other
/// leads past that one.
fn most_levels(topology: &Topology) -> usize {
    let mut seen = vec![false; topology.triangle_count()];
    let mut queue = Vec::with_capacity(topology.triangle_count());
    let mut most = 0;
    for first in 0..topology.triangle_count() as u32 {
        if std::mem::replace(&mut seen[first as usize], true) {
            continue;
        }
        let mut from = queue.len();
        queue.push(first);
        let mut levels = 0;
        while from < queue.len() {
            let level = from..queue.len();
            from = level.end;
            levels += 1;
            for at in level {
                for h in 3 * queue[at]..3 * queue[at] + 3 {
                    let twin = topology.twin(h);
                    if twin != NONE && !std::mem::replace(&mut seen[(twin / 3) as usize], true) {
                        queue.push(twin / 3);
                    }
                }
            }
        }
        most = most.max(2 * levels);
    }
    most
}

/// Why a run stopped. Small and without a place: a search stops thousands of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// There is no such seed.
    SeedOutOfRange,
    /// A triangle turned over.
    Flipped {
        /// Which (the least, when several did at once).
        triangle: u32,
        /// The level that was being processed.
        level: u32,
        /// How many triangles were flattened, the one whose unfolding turned it over included.
        flattened: u32,
    },
    /// The caller wanted it no further.
    Abandoned {
        /// How many triangles were flattened.
        flattened: u32,
    },
    /// The run ended, but these many triangles were not reached.
    Unreached {
        /// How many.
        unreached: u32,
    },
}

impl Stop {
    /// The error that a user reads, with the place.
    #[must_use]
    pub fn error(self, mesh: &Mesh, seed: u32, flat: &[DVec2]) -> FlatteningError {
        let total = mesh.triangles.len() as u32;
        match self {
            Self::SeedOutOfRange => FlatteningError::SeedOutOfRange { seed, triangles: total },
            Self::Unreached { unreached } => FlatteningError::SeveralPieces { unreached, total },
            // What was not flattened was not reached.
            Self::Abandoned { flattened } => {
                FlatteningError::SeveralPieces { unreached: total.saturating_sub(flattened), total }
            }
            Self::Flipped { triangle, level, flattened } => {
                let corners = mesh.triangles[triangle as usize].map(|v| v as usize);
                let middle = |p: &[DVec2]| corners.iter().map(|&v| p[v]).sum::<DVec2>() / 3.0;
                let xyz = corners.iter().map(|&v| mesh.positions[v]).sum::<DVec3>() / 3.0;
                let xy = middle(flat);
                let place = Place {
                    triangle: Some(triangle),
                    level: Some(level),
                    uv: mesh.uv.as_deref().map(|uv| middle(uv).to_array()),
                    xyz_mm: Some(xyz.to_array()),
                    xy_mm: xy.is_finite().then(|| xy.to_array()),
                    ..Place::default()
                };
                FlatteningError::Flipped { triangle, level, seed, flattened, total, place: Box::new(place) }
            }
        }
    }
}

/// Working memory of a run and its result, reused by the next run.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    pub(super) order: MappingOrder,
    /// Vertices, and one that is never placed.
    pub(super) flat: Vec<DVec2>,
    /// The first position of each vertex, where positions are counted.
    pub(super) first: Vec<DVec2>,
    /// How many positions each vertex has had.
    pub(super) positions: Vec<u32>,
    pub(super) levels: Vec<LevelCounts>,
    pub(super) flattened: usize,
    /// What the scheme `symmetric` needs beside these.
    pub(super) symmetric: Memory,
}

impl Scratch {
    /// Empty memory: the first run on a mesh sizes it.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Places of the vertices after the last run; NaN where it did not get to.
    #[must_use]
    pub fn flat(&self) -> &[DVec2] {
        &self.flat[..self.flat.len().saturating_sub(1)]
    }

    /// How far each vertex lies from its first position after the last run of [`flatten`], mm; NaN where it did not get to.
    pub fn movement(&self) -> impl Iterator<Item = f64> {
        self.flat().iter().zip(&self.first).map(|(last, first)| last.distance(*first))
    }

    /// The triangles flattened by the last run, in order.
    pub fn sequence(&self) -> impl ExactSizeIterator<Item = u32> {
        self.order.triangles(0..self.flattened)
    }

    /// The same from one place of the order to another, as far as it was flattened.
    pub fn stretch(&self, places: Range<usize>) -> impl ExactSizeIterator<Item = u32> {
        let end = places.end.min(self.flattened);
        self.order.triangles(places.start.min(end)..end)
    }

    /// How many triangles the last run flattened.
    #[must_use]
    pub const fn flattened(&self) -> usize {
        self.flattened
    }

    /// Counts by level of the last run; the last level of a failed run counts what was done of it.
    #[must_use]
    pub fn levels(&self) -> &[LevelCounts] {
        &self.levels
    }

    fn begin(&mut self, mesh: &CaderMesh, seed: u32, counts: bool) {
        self.order.begin(mesh.triangle_count(), seed);
        self.flat.clear();
        self.flat.resize(mesh.vertices + 1, DVec2::NAN);
        // Without counts they are never read.
        if counts {
            self.positions.clear();
            self.first.clear();
            self.first.resize(mesh.vertices, DVec2::NAN);
        }
        self.positions.resize(mesh.vertices, 0);
        self.levels.clear();
        self.levels.reserve(mesh.most_levels);
        self.flattened = 0;
    }
}

/// Flattens a mesh from one seed. The result is read from `scratch`, also after a failure.
///
/// # Errors
/// [`Stop`], which [`Stop::error`] turns into what a user reads.
pub fn flatten(mesh: &CaderMesh, readings: Readings, seed: u32, scratch: &mut Scratch) -> Result<(), Stop> {
    run::<true>(mesh, readings, seed, scratch, |_| true)
}

/// The same for searches, as long as `goes_on` says so: it is asked after every level. Of its levels it only counts the
/// triangles.
///
/// # Errors
/// [`Stop`]; [`Stop::Abandoned`] when it said no.
pub fn flatten_while(
    mesh: &CaderMesh,
    readings: Readings,
    seed: u32,
    scratch: &mut Scratch,
    goes_on: impl FnMut(&Scratch) -> bool,
) -> Result<(), Stop> {
    run::<false>(mesh, readings, seed, scratch, goes_on)
}

/// A flattening together with the reason why it is partial, if it is.
///
/// # Errors
/// Only when there is nothing at all: a mesh that cannot be prepared, or a seed that does not exist.
pub fn flatten_once(
    mesh: &Mesh,
    topology: &Topology,
    readings: Readings,
    seed: u32,
) -> Result<(Flattening, Option<FlatteningError>), FlatteningError> {
    let prepared = CaderMesh::new(mesh, topology)?;
    let mut scratch = Scratch::new();
    let stop = flatten(&prepared, readings, seed, &mut scratch).err();
    let error = stop.map(|stop| stop.error(mesh, seed, scratch.flat()));
    match error {
        Some(error @ FlatteningError::SeedOutOfRange { .. }) => Err(error),
        error => Ok((
            Flattening {
                flat: scratch.flat().to_vec(),
                seed,
                sequence: scratch.sequence().collect(),
                levels: scratch.levels().to_vec(),
                movement: scratch.movement().collect(),
            },
            error,
        )),
    }
}

/// A whole run with the widest instructions that the processor has: the same operations, so the same bits on all.
fn run<const COUNTS: bool>(
    mesh: &CaderMesh,
    readings: Readings,
    seed: u32,
    scratch: &mut Scratch,
    goes_on: impl FnMut(&Scratch) -> bool,
) -> Result<(), Stop> {
    if seed as usize >= mesh.triangle_count() {
        return Err(Stop::SeedOutOfRange);
    }
    scratch.begin(mesh, seed, COUNTS || readings != Readings::default());
    pulp::Arch::new().dispatch(|| match readings.scheme {
        Scheme::InTurn => run_levels::<COUNTS>(mesh, readings, seed, scratch, goes_on),
        Scheme::Symmetric => symmetric::run_levels(mesh, readings.check, seed, scratch, goes_on),
    })
}

#[inline(always)]
#[expect(clippy::inline_always, reason = "a function of its own would not have the instructions of its caller")]
fn run_levels<const COUNTS: bool>(
    mesh: &CaderMesh,
    readings: Readings,
    seed: u32,
    scratch: &mut Scratch,
    mut goes_on: impl FnMut(&Scratch) -> bool,
) -> Result<(), Stop> {
    lay_seed(mesh, readings.parent, seed, scratch);
    let is_default = readings == Readings::default();
    let (mut from, mut to) = (1, scratch.order.len());
    while from < to {
        scratch.order.arrange(from, readings.order);
        let level = scratch.levels.len() as u32;
        let (counts, flipped) = match (readings.parent, readings.anchor) {
            _ if is_default => process::<false, true, true, COUNTS>(mesh, readings, from..to, scratch),
            (Parent::First, Anchor::Start) => process::<false, false, false, true>(mesh, readings, from..to, scratch),
            (Parent::First, Anchor::End) => process::<false, true, false, true>(mesh, readings, from..to, scratch),
            (Parent::Last, Anchor::Start) => process::<true, false, false, true>(mesh, readings, from..to, scratch),
            (Parent::Last, Anchor::End) => process::<true, true, false, true>(mesh, readings, from..to, scratch),
        };
        scratch.levels.push(counts);
        scratch.flattened = from + counts.triangles as usize;
        if let Some(triangle) = flipped {
            return Err(Stop::Flipped { triangle, level, flattened: scratch.flattened as u32 });
        }
        if !goes_on(scratch) {
            return Err(Stop::Abandoned { flattened: scratch.flattened as u32 });
        }
        (from, to) = (to, scratch.order.len());
    }
    if to < mesh.triangle_count() {
        return Err(Stop::Unreached { unreached: (mesh.triangle_count() - to) as u32 });
    }
    if readings.check == Check::Final
        && let Some(triangle) = first_flipped(mesh, &scratch.flat)
    {
        let level = scratch.levels.len() as u32 - 1;
        return Err(Stop::Flipped { triangle, level, flattened: to as u32 });
    }
    Ok(())
}

/// Lays the seed as 4.2.1 says: its first corner at the origin, its second on +x.
fn lay_seed(mesh: &CaderMesh, parent: Parent, seed: u32, scratch: &mut Scratch) {
    let [hinge, second] = [mesh.hinges[3 * seed as usize], mesh.hinges[3 * seed as usize + 1]];
    for (vertex, place) in [hinge.start, hinge.end, hinge.apex].into_iter().zip(hinge.at_origin()) {
        scratch.flat[vertex as usize] = place;
        scratch.positions[vertex as usize] = 1;
        if let Some(first) = scratch.first.get_mut(vertex as usize) {
            *first = place;
        }
    }
    let mut walk = scratch.order.walk();
    // The first neighbour of the second hinge is the one across the seed's first edge.
    walk.touch([second.neighbours[0], hinge.neighbours[0]], parent);
    walk.touch([hinge.neighbours[1], mesh.beyond()], parent);
    let queued = walk.len();
    scratch.order.end(queued);
    scratch.levels.push(LevelCounts { triangles: 1, ..LevelCounts::default() });
    scratch.flattened = 1;
}

/// Unfolds the triangles of one level in their order, as far as the first whose apex turns a triangle over: gives what
/// was counted, and the least triangle that turned over.
///
/// All that the loop needs stands in local slices, and nothing in it allocates. The default readings, which searches run
/// thousands of times, have copies of the loop that ask for none of them, one of which does not count positions.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a function of its own would not have the instructions of its caller")]
fn process<const LAST: bool, const END: bool, const DEFAULT: bool, const COUNTS: bool>(
    mesh: &CaderMesh,
    readings: Readings,
    level: Range<usize>,
    scratch: &mut Scratch,
) -> (LevelCounts, Option<u32>) {
    let parent = if LAST { Parent::Last } else { Parent::First };
    let readings = if DEFAULT { Readings::default() } else { readings };
    let flat = scratch.flat.as_mut_slice();
    let positions = scratch.positions.as_mut_slice();
    let first = scratch.first.as_mut_slice();
    let hinges = mesh.hinges.as_slice();
    let mut walk = scratch.order.walk();
    let (mut averaged, mut duplicates) = (0, 0);
    let mut at = level.start;
    let mut flipped = None;
    while at < level.end {
        let tag = walk.tag(at, parent);
        at += 1;
        fetch_hinge(hinges, walk.peek(at + AHEAD));
        let hinge = &hinges[(tag - (tag >> 2)) as usize];
        let (a, b) = (flat[hinge.start as usize], flat[hinge.end as usize]);
        walk.touch(hinge.neighbours, parent);
        let new = hinge.unfold::<END>(a, b);
        let apex = hinge.apex as usize;
        let before = if COUNTS {
            let before = positions[apex];
            positions[apex] = before + 1;
            before
        } else {
            // Whether there was one is all that matters, and a place that is none tells it.
            u32::from(!flat[apex].x.is_nan())
        };
        let suspicious = if before == 0 {
            flat[apex] = new.tip();
            if COUNTS {
                first[apex] = new.tip();
            }
            // A reading that lets neighbours turn over may leave an edge without length: then there is no place.
            readings.check == Check::Current && !flat[apex].is_finite()
        } else {
            let old = flat[apex];
            let moved = match readings.average {
                Average::Pair => new.midway(old),
                Average::Running => old + (new.tip() - old) / f64::from(before + 1),
            };
            flat[apex] = moved;
            if COUNTS {
                averaged += 1;
                duplicates += u32::from(before > 1);
            }
            match readings.check {
                Check::Incident => looks_flipped(&mesh.rings, hinge.apex, flat, moved),
                Check::Current => !lies_upright([a, b, moved]),
                Check::Final => false,
            }
        };
        if suspicious {
            flipped = match readings.check {
                Check::Incident => least_flipped_at(mesh, walk.record(at), flat, hinge.apex),
                Check::Current | Check::Final => Some(tag >> 2),
            };
            if flipped.is_some() {
                break;
            }
        }
    }
    let queued = walk.len();
    scratch.order.end(queued);
    (LevelCounts { triangles: (at - level.start) as u32, averaged, duplicates }, flipped)
}

/// Triangles by which the loop is ahead of the next one in reading hinges: enough for one to come from the second cache.
const AHEAD: usize = 3;

/// Has a hinge that will be needed soon brought to the nearest cache: levels cross the mesh, so that no processor guesses
/// which is next.
#[inline]
fn fetch_hinge(hinges: &[Hinge], tag: Option<u32>) {
    if let Some(hinge) = tag.and_then(|tag| hinges.get((tag - (tag >> 2)) as usize)) {
        std::hint::black_box(hinge.start);
    }
}

/// The least triangle at a vertex that has turned over, of those taken: a triangle whose corners all lie may still be
/// waiting for its turn.
#[cold]
fn least_flipped_at(mesh: &CaderMesh, mut record: Record, flat: &[DVec2], vertex: u32) -> Option<u32> {
    let place = |v: u32| flat[v as usize];
    let turned = |[p, q]: [u32; 2]| orientation(place(vertex), place(p), place(q)) <= 0.0;
    let triangles = mesh.rings.triangles_of(vertex).filter(|(pair, _)| turned(*pair));
    triangles.map(|(_, triangle)| triangle).filter(|&triangle| record.is_done(triangle)).min()
}

/// Whether some triangle of a vertex, flattened or not, is turned over when the vertex lies at this place.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a function of its own would not have the instructions of its caller")]
fn looks_flipped(rings: &Rings, vertex: u32, flat: &[DVec2], centre: DVec2) -> bool {
    let mut flipped = false;
    let mut block = rings.first(vertex);
    loop {
        let spokes = block.neighbours.map(|neighbour| flat[neighbour as usize] - centre);
        for k in 1..spokes.len() {
            let (last, spoke) = (spokes[k - 1], spokes[k]);
            // False for a neighbour that does not lie yet, and for a gap: its place is NaN.
            flipped |= last.x * spoke.y <= last.y * spoke.x;
        }
        match rings.after(block) {
            Some(next) => block = next,
            None => return flipped,
        }
    }
}

/// The least triangle that lies turned over, or nowhere.
fn first_flipped(mesh: &CaderMesh, flat: &[DVec2]) -> Option<u32> {
    let upright = |corners: &[u32; 3]| lies_upright(corners.map(|v| flat[v as usize]));
    mesh.triangles.iter().position(|corners| !upright(corners)).map(|t| t as u32)
}

/// Whether a triangle lies somewhere and is not turned over.
fn lies_upright([a, b, c]: [DVec2; 3]) -> bool {
    orientation(a, b, c) > 0.0
}
