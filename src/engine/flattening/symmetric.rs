//! Cader's flattening without accidents: a whole level of the mapping order at once, so that neither the numbering of the
//! triangles, nor which corner of one comes first, nor a mirror decides anything but the rounding.
//!
//! As in the thesis (4.2 to 4.4) a seed is laid and the mapping order is walked level by level, triangles unfolded over
//! edges that lie, positions averaged, a level left behind for good. What differs is when:
//!
//! 1. Each edge between a triangle of the new level and one of the level before gives the vertex opposite a position. It is
//!    measured from the *middle* of the edge ([`Hinge::unfold_middle`]). A vertex that does not lie yet comes to the mean of
//!    its positions, taken all together.
//! 2. The vertices that came with the last [`WINDOW`] levels come to rest, in [`STEPS`] steps for all of them together. In
//!    a step every triangle t at them is turned as it fits best its corners p: R is the direction of
//!    `sum over its edges ij of w_ij conj(e_ij) (p_j - p_i)`, where `e_ij` is the edge in the triangle laid by itself and
//!    `w_ij = A / |e_ij|^2` with its area A (so a strained thin triangle weighs as much as a strained round one). Each edge
//!    then asks of its ends `p_i = p_j - R e_ij` and `p_j = p_i + R e_ij`, and a vertex goes by [`RELAXATION`] of the way to
//!    the weighted mean of what is asked of it, and by [`MOMENTUM`] of its last move in the same level.
//!
//! What is exact stays as it is: on a developable mesh all positions agree. Everything is a sum over edges or triangles,
//! and each is its own mirror image. A level costs `WINDOW * STEPS` fits a triangle, so a run takes O(triangles) time.
//!
//! Positions are counted as with the other scheme: *averaged* are those given to a vertex that had one, *duplicates* those
//! given to one that had two or more. A vertex's movement is counted from the mean that it came to first.

use std::ops::Range;

use glam::DVec2;

use super::cader::{CaderMesh, Scratch, Stop};
use super::unfolding::{Hinge, orientation};
use super::{Check, LevelCounts, Parent};

/// Levels whose vertices still move. Fewer leave more strain behind; with more a run costs more, and little is gained.
pub(super) const WINDOW: usize = 6;
/// Steps after each level. With 6 of them one real surface in forty flattens worse than by the best of the thesis's
/// readings, with 8 none; the time is in proportion.
const STEPS: usize = 8;
/// Part of the way to the mean. Beyond 1 vertices of opposite sides swing.
const RELAXATION: f64 = 0.8;
/// Part of the last move that is made again. It saves half of the steps; from 0.7 on some surfaces turn over.
const MOMENTUM: f64 = 0.6;

/// A level that no triangle has and no vertex came with.
const NEVER: u32 = u32::MAX;

/// A triangle as the steps need it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    corners: [u32; 3],
    /// The tag of the neighbour across each edge.
    across: [u32; 3],
    /// w of each edge.
    weights: [f64; 3],
    /// w e of each edge, in the triangle laid by itself.
    edges: [DVec2; 3],
}

impl Cell {
    /// The triangle of three hinges, its edges in order.
    pub(super) fn new(hinges: &[Hinge; 3]) -> Self {
        let [a, b, c] = hinges[0].at_origin();
        let area = 0.5 * orientation(a, b, c);
        let edges = [b - a, c - b, a - c];
        let weights = edges.map(|e| area / e.length_squared());
        Self {
            corners: [hinges[0].start, hinges[0].end, hinges[0].apex],
            across: [hinges[1].neighbours[0], hinges[0].neighbours[0], hinges[0].neighbours[1]],
            weights,
            edges: std::array::from_fn(|k| edges[k] * weights[k]),
        }
    }
}

/// Working memory beside that of every run.
#[derive(Debug, Clone, Default)]
pub(super) struct Memory {
    /// The level of each triangle, and of one that lies beyond the border.
    level_of: Vec<u32>,
    /// The level that each vertex came with.
    came: Vec<u32>,
    /// Vertices in the order in which they came, and where those of each level begin.
    vertices: Vec<u32>,
    first_vertex: Vec<usize>,
    /// Where the triangles of each level begin in the mapping order.
    first_triangle: Vec<usize>,
    /// What is asked of each vertex in one step; zero between steps where it is read.
    asked: Vec<DVec2>,
    /// The weight of all that is asked.
    weight: Vec<f64>,
    /// The last move of each vertex.
    moved: Vec<DVec2>,
}

impl Memory {
    fn begin(&mut self, triangles: usize, vertices: usize, levels: usize) {
        self.level_of.clear();
        self.level_of.resize(triangles + 1, NEVER);
        self.came.clear();
        self.came.resize(vertices, NEVER);
        self.vertices.clear();
        self.vertices.reserve(vertices);
        for firsts in [&mut self.first_vertex, &mut self.first_triangle] {
            firsts.clear();
            firsts.reserve(levels + 1);
        }
        self.asked.clear();
        self.asked.resize(vertices, DVec2::ZERO);
        self.weight.clear();
        self.weight.resize(vertices, 0.0);
        // Set when a vertex comes.
        self.moved.resize(vertices, DVec2::ZERO);
    }
}

/// A whole run; `scratch` has begun with the seed.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a function of its own would not have the instructions of its caller")]
pub(super) fn run_levels(
    mesh: &CaderMesh,
    check: Check,
    seed: u32,
    scratch: &mut Scratch,
    mut goes_on: impl FnMut(&Scratch) -> bool,
) -> Result<(), Stop> {
    let cells = mesh.cells();
    scratch.symmetric.begin(cells.len(), mesh.vertex_count(), mesh.most_levels());
    lay_seed(mesh, &cells[seed as usize], seed, scratch);
    let (mut from, mut level) = (0, 0);
    loop {
        let taken = from..scratch.order.len();
        discover(cells, taken.clone(), scratch);
        from = taken.end;
        let new = from..scratch.order.len();
        if new.is_empty() {
            break;
        }
        level += 1;
        let counts = lay_level(mesh, taken, new.clone(), level, scratch);
        scratch.levels.push(counts);
        scratch.flattened = new.end;
        let first = (level as usize + 1).saturating_sub(WINDOW);
        relax(cells, first, scratch);
        let moving = scratch.symmetric.first_triangle[first]..new.end;
        if check == Check::Incident
            && let Some(triangle) = least_flipped(cells, scratch, moving)
        {
            return Err(Stop::Flipped { triangle, level, flattened: new.end as u32 });
        }
        if !goes_on(scratch) {
            return Err(Stop::Abandoned { flattened: new.end as u32 });
        }
    }
    if from < cells.len() {
        return Err(Stop::Unreached { unreached: (cells.len() - from) as u32 });
    }
    match least_flipped(cells, scratch, 0..from) {
        Some(triangle) => Err(Stop::Flipped { triangle, level, flattened: from as u32 }),
        None => Ok(()),
    }
}

/// Lays the seed as with the other scheme.
fn lay_seed(mesh: &CaderMesh, cell: &Cell, seed: u32, scratch: &mut Scratch) {
    let memory = &mut scratch.symmetric;
    for (vertex, place) in cell.corners.into_iter().zip(mesh.hinge(4 * seed).at_origin()) {
        scratch.flat[vertex as usize] = place;
        scratch.positions[vertex as usize] = 1;
        scratch.first[vertex as usize] = place;
        memory.came[vertex as usize] = 0;
        memory.vertices.push(vertex);
    }
    memory.level_of[seed as usize] = 0;
    memory.first_vertex.push(0);
    memory.first_triangle.push(0);
    memory.weigh(cell);
    scratch.levels.push(LevelCounts { triangles: 1, ..LevelCounts::default() });
    scratch.flattened = 1;
}

/// Queues the neighbours of the triangles taken that are in no level yet.
fn discover(cells: &[Cell], taken: Range<usize>, scratch: &mut Scratch) {
    let beyond = 4 * cells.len() as u32;
    let mut walk = scratch.order.walk();
    for at in taken {
        let [one, two, three] = cells[(walk.tag(at, Parent::First) >> 2) as usize].across;
        walk.touch([one, two], Parent::First);
        walk.touch([three, beyond], Parent::First);
    }
    let queued = walk.len();
    scratch.order.end(queued);
}

/// Gives the vertices of a new level their positions and counts them.
fn lay_level(
    mesh: &CaderMesh,
    taken: Range<usize>,
    new: Range<usize>,
    level: u32,
    scratch: &mut Scratch,
) -> LevelCounts {
    let Scratch { order, flat, first, positions, symmetric: memory, .. } = scratch;
    let cells = mesh.cells();
    let mut counts = LevelCounts { triangles: new.len() as u32, ..LevelCounts::default() };
    let begin = memory.vertices.len();
    memory.first_vertex.push(begin);
    memory.first_triangle.push(new.start);
    for triangle in order.triangles(new.clone()) {
        memory.level_of[triangle as usize] = level;
        memory.weigh(&cells[triangle as usize]);
    }
    for triangle in order.triangles(taken) {
        for tag in cells[triangle as usize].across {
            if memory.level_of[(tag >> 2) as usize] != level {
                continue;
            }
            let hinge = mesh.hinge(tag);
            let apex = hinge.apex as usize;
            if memory.came[apex] == NEVER {
                memory.came[apex] = level;
                memory.vertices.push(hinge.apex);
            }
            let before = positions[apex];
            positions[apex] = before + 1;
            counts.averaged += u32::from(before > 0);
            counts.duplicates += u32::from(before > 1);
            if memory.came[apex] == level {
                memory.asked[apex] += hinge.unfold_middle(flat[hinge.start as usize], flat[hinge.end as usize]);
            }
        }
    }
    for &vertex in &memory.vertices[begin..] {
        let vertex = vertex as usize;
        flat[vertex] = memory.asked[vertex] / f64::from(positions[vertex]);
        first[vertex] = flat[vertex];
        memory.asked[vertex] = DVec2::ZERO;
        memory.moved[vertex] = DVec2::ZERO;
    }
    counts
}

impl Memory {
    /// Adds the weights of a triangle that is laid now to its corners'.
    fn weigh(&mut self, cell: &Cell) {
        for k in 0..3 {
            self.weight[cell.corners[k] as usize] += cell.weights[k] + cell.weights[(k + 2) % 3];
        }
    }
}

/// Lets the vertices that came with level `first` or later come to rest. The triangles at them are of these levels too.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a function of its own would not have the instructions of its caller")]
fn relax(cells: &[Cell], first: usize, scratch: &mut Scratch) {
    let Scratch { order, flat, symmetric: memory, .. } = scratch;
    let Memory { vertices, first_vertex, first_triangle, asked, weight, moved, .. } = memory;
    let (flat, asked, moved) = (flat.as_mut_slice(), asked.as_mut_slice(), moved.as_mut_slice());
    let moving = &vertices[first_vertex[first]..];
    for step in 0..STEPS {
        for triangle in order.triangles(first_triangle[first]..order.len()) {
            ask(&cells[triangle as usize], flat, asked);
        }
        let momentum = if step == 0 { 0.0 } else { MOMENTUM };
        for &vertex in moving {
            let vertex = vertex as usize;
            let place = flat[vertex];
            let mean = asked[vertex] * (1.0 / weight[vertex]);
            let by = (mean - place) * RELAXATION + moved[vertex] * momentum;
            flat[vertex] = place + by;
            moved[vertex] = by;
            asked[vertex] = DVec2::ZERO;
        }
    }
    // Those that have settled were asked too, in vain; none of them is asked again what counts.
}

/// What one triangle asks of its corners.
#[inline(always)]
#[expect(clippy::inline_always, reason = "a function of its own would not have the instructions of its caller")]
fn ask(cell: &Cell, flat: &[DVec2], asked: &mut [DVec2]) {
    let corners = cell.corners.map(|v| v as usize);
    let [a, b, c] = corners.map(|v| flat[v]);
    let lying = [b - a, c - b, a - c];
    let mut turn = DVec2::ZERO;
    for (own, lies) in cell.edges.iter().zip(lying) {
        turn += DVec2::new(own.dot(lies), own.perp_dot(lies));
    }
    let turn = turn * (1.0 / turn.length());
    let [ab, bc, ca] = cell.edges.map(|own| turn.rotate(own));
    let [one, two, three] = cell.weights;
    asked[corners[0]] += b * one + c * three + (ca - ab);
    asked[corners[1]] += c * two + a * one + (ab - bc);
    asked[corners[2]] += a * three + b * two + (bc - ca);
}

/// The least triangle of these places of the order that lies turned over, or nowhere.
fn least_flipped(cells: &[Cell], scratch: &Scratch, places: Range<usize>) -> Option<u32> {
    let lies_upright = |triangle: u32| {
        let [a, b, c] = cells[triangle as usize].corners.map(|v| scratch.flat[v as usize]);
        orientation(a, b, c) > 0.0
    };
    scratch.order.triangles(places).filter(|&triangle| !lies_upright(triangle)).min()
}
