//! Cader's flattening (thesis 4.2 to 4.4; Cader et al. 2005): triangle by triangle in mapping order, averaging as it goes.
//!
//! The seed is laid down; each triangle of the mapping order is unfolded over an edge that lies already. When its apex
//! lies already too, the apex moves to the average of its positions, so that tears never open. When a triangle turns
//! over the run stops: the surface is too curved for this seed (4.4.1, 4.4.2). What the thesis leaves open is settled by
//! [`Readings`].
//!
//! [`CaderMesh`] holds what depends on the mesh alone, [`Scratch`] what a run needs; after the first run on a mesh a
//! further one allocates nothing. A run takes O(triangles) time. Lengths are millimetres; vertices and triangles are
//! numbered as in the mesh. Only the seed's piece is reached: a mesh of several pieces is an error here.

use glam::{DVec2, DVec3};

use super::mapping_order::MappingOrder;
use super::rings::Rings;
use super::unfolding::{Hinge, orientation};
use super::{Average, Check, Flattening, FlatteningError, LevelCounts, Readings};
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
            let hinge = Hinge::new(vertices, vertices.map(place), tag(next(h)), tag(prev(h)));
            if !hinge.is_sound() {
                return Err(MeshFault::ZeroArea { triangle: h / 3 });
            }
            hinges.push(hinge);
        }
        Ok(Self {
            hinges,
            rings: Rings::new(topology),
            triangles: topology.triangles().to_vec(),
            vertices: topology.vertex_count(),
        })
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

    /// The hinge of a tag.
    #[inline]
    fn hinge(&self, tag: u32) -> Hinge {
        self.hinges[(tag - (tag >> 2)) as usize]
    }
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
    order: MappingOrder,
    /// Vertices, and one that is never placed.
    flat: Vec<DVec2>,
    /// How many positions each vertex has had.
    positions: Vec<u32>,
    levels: Vec<LevelCounts>,
    flattened: usize,
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

    /// The triangles flattened by the last run, in order.
    pub fn sequence(&self) -> impl ExactSizeIterator<Item = u32> {
        self.order.triangles().take(self.flattened)
    }

    /// Counts by level of the last run; the last level of a failed run counts what was done of it.
    #[must_use]
    pub fn levels(&self) -> &[LevelCounts] {
        &self.levels
    }

    fn begin(&mut self, mesh: &CaderMesh, seed: u32) {
        self.order.begin(mesh.triangle_count(), seed);
        self.flat.clear();
        self.flat.resize(mesh.vertices + 1, DVec2::NAN);
        self.positions.clear();
        self.positions.resize(mesh.vertices, 0);
        self.levels.clear();
        self.flattened = 0;
    }
}

/// Flattens a mesh from one seed. The result is read from `scratch`, also after a failure.
///
/// # Errors
/// [`Stop`], which [`Stop::error`] turns into what a user reads.
pub fn flatten(mesh: &CaderMesh, readings: Readings, seed: u32, scratch: &mut Scratch) -> Result<(), Stop> {
    if seed as usize >= mesh.triangle_count() {
        return Err(Stop::SeedOutOfRange);
    }
    scratch.begin(mesh, seed);
    let result = run(mesh, readings, seed, scratch);
    // The eccentricities of two triangles differ by a factor of at most 2: no later seed needs more room.
    let enough = 2 * scratch.levels.len() + 2;
    scratch.levels.reserve(enough.saturating_sub(scratch.levels.len()));
    result
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
            },
            error,
        )),
    }
}

fn run(mesh: &CaderMesh, readings: Readings, seed: u32, scratch: &mut Scratch) -> Result<(), Stop> {
    lay_seed(mesh, readings, seed, scratch);
    let (mut from, mut to) = (1, scratch.order.len());
    while from < to {
        scratch.order.arrange(from, readings.order);
        let level = scratch.levels.len() as u32;
        let mut counts = LevelCounts::default();
        for at in from..to {
            let step = process(mesh, readings, at, scratch, &mut counts);
            if let Err(triangle) = step {
                scratch.levels.push(counts);
                return Err(Stop::Flipped { triangle, level, flattened: at as u32 + 1 });
            }
        }
        scratch.levels.push(counts);
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
fn lay_seed(mesh: &CaderMesh, readings: Readings, seed: u32, scratch: &mut Scratch) {
    let tag = scratch.order.tag(0, super::Parent::First);
    let hinge = mesh.hinge(tag);
    for (vertex, place) in [hinge.start, hinge.end, hinge.apex].into_iter().zip(hinge.at_origin()) {
        scratch.flat[vertex as usize] = place;
        scratch.positions[vertex as usize] = 1;
    }
    scratch.order.done(seed);
    // Over its first edge, its second, its third: the neighbour across the first is "before" of the second hinge.
    let across_first = mesh.hinge(tag + 1).before;
    for neighbour in [across_first, hinge.after, hinge.before] {
        scratch.order.touch(neighbour, readings.parent);
    }
    scratch.flattened = 1;
    scratch.levels.push(LevelCounts { triangles: 1, ..LevelCounts::default() });
}

/// Unfolds the triangle at one place of the mapping order. Err: the least triangle that turned over.
#[inline]
fn process(
    mesh: &CaderMesh,
    readings: Readings,
    at: usize,
    scratch: &mut Scratch,
    counts: &mut LevelCounts,
) -> Result<(), u32> {
    let Scratch { order, flat, positions, flattened, .. } = scratch;
    *flattened = at + 1;
    counts.triangles += 1;
    let tag = order.tag(at, readings.parent);
    let triangle = tag >> 2;
    let hinge = mesh.hinge(tag);
    let (a, b) = (flat[hinge.start as usize], flat[hinge.end as usize]);
    let new = hinge.unfold(a, b, readings.anchor);
    let apex = hinge.apex as usize;
    let before = positions[apex];
    positions[apex] = before + 1;
    order.done(triangle);
    if before == 0 {
        flat[apex] = new;
        // A reading that lets neighbours turn over may leave an edge without length: then there is no place.
        if readings.check == Check::Current && !new.is_finite() {
            return Err(triangle);
        }
    } else {
        let moved = match readings.average {
            Average::Pair => (flat[apex] + new) * 0.5,
            Average::Running => flat[apex] + (new - flat[apex]) / f64::from(before + 1),
        };
        flat[apex] = moved;
        counts.averaged += 1;
        counts.duplicates += u32::from(before > 1);
        let flipped = match readings.check {
            Check::Incident => flipped_at(mesh, order, flat, hinge.apex),
            Check::Current => (!(orientation(a, b, moved) > 0.0)).then_some(triangle),
            Check::Final => None,
        };
        if let Some(flipped) = flipped {
            return Err(flipped);
        }
    }
    order.touch_pair(tag, hinge.after, hinge.before, readings.parent);
    Ok(())
}

/// The least flattened triangle at a vertex that has turned over.
#[inline]
fn flipped_at(mesh: &CaderMesh, order: &MappingOrder, flat: &[DVec2], vertex: u32) -> Option<u32> {
    let centre = flat[vertex as usize];
    let ring = mesh.rings.of(vertex);
    let mut flipped = false;
    let mut last = DVec2::NAN;
    for &neighbour in ring {
        let spoke = flat[neighbour as usize] - centre;
        // False for a neighbour that does not lie yet: its place is NaN.
        flipped |= last.perp_dot(spoke) <= 0.0;
        last = spoke;
    }
    if flipped { least_flipped_at(mesh, order, flat, vertex) } else { None }
}

/// The same, looking closely: a triangle whose corners all lie may still be waiting for its turn.
#[cold]
fn least_flipped_at(mesh: &CaderMesh, order: &MappingOrder, flat: &[DVec2], vertex: u32) -> Option<u32> {
    let centre = flat[vertex as usize];
    let pairs = mesh.rings.of(vertex).windows(2).zip(mesh.rings.triangles_of(vertex));
    pairs
        .filter(|(pair, _)| orientation(centre, flat[pair[0] as usize], flat[pair[1] as usize]) <= 0.0)
        .map(|(_, &triangle)| triangle)
        .filter(|&triangle| triangle != NONE && order.is_done(triangle))
        .min()
}

/// The least triangle that lies turned over, or nowhere.
fn first_flipped(mesh: &CaderMesh, flat: &[DVec2]) -> Option<u32> {
    let flipped = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|v| flat[v as usize]);
        !(orientation(a, b, c) > 0.0)
    };
    mesh.triangles.iter().position(flipped).map(|t| t as u32)
}
