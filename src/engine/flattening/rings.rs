//! The vertices around each vertex, laid out for the flip check.
//!
//! The ring of a vertex lists its neighbours fan by fan, anticlockwise, so that each two that follow one another make a
//! triangle with it. An inner vertex has its first neighbour again at the end. Between two fans (a vertex where parts of
//! the mesh only touch) stands the number of a vertex that does not exist: its place is kept as NaN, and no comparison
//! with NaN finds a flip.
//!
//! A ring is cut into [`Block`]s that overlap by one neighbour, and the last is filled with that same number: so the
//! check does the same work for each block, without a branch that is guessed wrongly where a ring ends.

use crate::engine::mesh::Topology;
use crate::engine::mesh::topology::{NONE, prev};

/// Triangles of a block: as many as most inner vertices have. More would be done in vain there, fewer would need a
/// second block.
const BLOCK: usize = 6;

/// A stretch of a ring.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) neighbours: [u32; BLOCK + 1],
    /// Where the ring goes on, [`NONE`] at its end.
    next: u32,
}

/// Rings of all vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Rings {
    /// The first block of each vertex, then all further ones.
    blocks: Vec<Block>,
    /// The triangles between the neighbours of each block, [`NONE`] next to a gap.
    triangles: Vec<[u32; BLOCK]>,
    widest_fan: Option<u32>,
}

impl Rings {
    /// Rings of a mesh: O(triangles).
    pub(super) fn new(topology: &Topology) -> Self {
        let vertices = topology.vertex_count();
        let gap = vertices as u32;
        let mut building = Building {
            gap,
            blocks: vec![Block { neighbours: [gap; BLOCK + 1], next: NONE }; vertices],
            triangles: vec![[NONE; BLOCK]; vertices],
            ends: (0..gap).map(|v| (v, 0)).collect(),
        };
        let mut widest_fan = Some(0);
        let halfedges = 3 * topology.triangle_count() as u32;
        let mut seen = vec![false; halfedges as usize];
        // First half-edge of each fan: at the border its clockwise end, else the least of the fan.
        for border in [true, false] {
            for first in 0..halfedges {
                if seen[first as usize] || (border && topology.twin(first) != NONE) {
                    continue;
                }
                let vertex = topology.origin(first);
                if building.has_begun(vertex) {
                    building.push(vertex, gap, NONE);
                    widest_fan = None;
                }
                building.push(vertex, topology.target(first), NONE);
                let mut count = 0;
                for h in fan(topology, first) {
                    seen[h as usize] = true;
                    building.push(vertex, topology.origin(prev(h)), h / 3);
                    count += 1;
                }
                // All round one can go either way.
                let steps = if border { count - 1 } else { count / 2 };
                widest_fan = widest_fan.map(|widest| steps.max(widest));
            }
        }
        Self { blocks: building.blocks, triangles: building.triangles, widest_fan }
    }

    /// Most steps over edges between two triangles of one vertex; `None` where some vertex has several fans.
    pub(super) const fn widest_fan(&self) -> Option<u32> {
        self.widest_fan
    }

    /// The first block of a vertex's ring.
    #[inline]
    pub(super) fn first(&self, vertex: u32) -> &Block {
        &self.blocks[vertex as usize]
    }

    /// The block after another, when the ring goes on.
    #[inline]
    pub(super) fn after(&self, block: &Block) -> Option<&Block> {
        if block.next == NONE { None } else { self.blocks.get(block.next as usize) }
    }

    /// The triangles of a vertex, each with its two other corners, anticlockwise.
    pub(super) fn triangles_of(&self, vertex: u32) -> impl Iterator<Item = ([u32; 2], u32)> {
        let blocks = std::iter::successors(Some(vertex), |&at| {
            let next = self.blocks[at as usize].next;
            (next != NONE).then_some(next)
        });
        blocks.flat_map(|at| {
            let neighbours = &self.blocks[at as usize].neighbours;
            let pairs = neighbours.windows(2).map(|pair| [pair[0], pair[1]]);
            pairs.zip(self.triangles[at as usize]).filter(|(_, triangle)| *triangle != NONE)
        })
    }
}

/// Rings that are being laid out.
struct Building {
    gap: u32,
    blocks: Vec<Block>,
    triangles: Vec<[u32; BLOCK]>,
    /// For each vertex the last block of its ring, and how many neighbours stand in it.
    ends: Vec<(u32, usize)>,
}

impl Building {
    /// Whether something stands in the ring of a vertex.
    fn has_begun(&self, vertex: u32) -> bool {
        self.ends[vertex as usize].1 > 0
    }

    /// Puts a neighbour at the end of a vertex's ring, and the triangle between it and the one before it.
    fn push(&mut self, vertex: u32, neighbour: u32, triangle: u32) {
        let (mut block, mut used) = self.ends[vertex as usize];
        if used > BLOCK {
            let next = self.blocks.len() as u32;
            let mut neighbours = [self.gap; BLOCK + 1];
            neighbours[0] = self.blocks[block as usize].neighbours[BLOCK];
            self.blocks[block as usize].next = next;
            self.blocks.push(Block { neighbours, next: NONE });
            self.triangles.push([NONE; BLOCK]);
            (block, used) = (next, 1);
        }
        self.blocks[block as usize].neighbours[used] = neighbour;
        if used > 0 {
            self.triangles[block as usize][used - 1] = triangle;
        }
        self.ends[vertex as usize] = (block, used + 1);
    }
}

/// The half-edges out of one vertex, anticlockwise from the given one, to the border or all round.
fn fan(topology: &Topology, first: u32) -> impl Iterator<Item = u32> {
    std::iter::successors(Some(first), move |&h| {
        let turned = topology.twin(prev(h));
        (turned != NONE && turned != first).then_some(turned)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid_triangles};

    #[test]
    fn rings_hold_each_triangle_of_a_vertex_once_between_its_two_other_corners() {
        for diagonal in Diagonal::ALL {
            let triangles = grid_triangles(6, 5, diagonal);
            let topology = Topology::of_triangles(&triangles, 30).unwrap();
            let rings = Rings::new(&topology);
            for v in 0..30_u32 {
                let mut found: Vec<u32> = Vec::new();
                for (pair, t) in rings.triangles_of(v) {
                    let [a, b, c] = triangles[t as usize];
                    assert!([[a, b, c], [b, c, a], [c, a, b]].contains(&[v, pair[0], pair[1]]));
                    found.push(t);
                }
                found.sort_unstable();
                let expected: Vec<u32> =
                    (0..triangles.len() as u32).filter(|&t| triangles[t as usize].contains(&v)).collect();
                assert_eq!(found, expected);
            }
        }
    }

    #[test]
    fn the_widest_fan_counts_steps_the_shorter_way_round() {
        // A hexagon of six triangles about vertex 0; opened, five steps lie between its ends.
        let mut triangles: Vec<[u32; 3]> = (0..6).map(|k| [0, 1 + k, 1 + (k + 1) % 6]).collect();
        let widest = |triangles: &[[u32; 3]]| Rings::new(&Topology::of_triangles(triangles, 8).unwrap()).widest_fan();
        assert_eq!(widest(&triangles), Some(3));
        triangles[5] = [0, 6, 7];
        assert_eq!(widest(&triangles), Some(5));
        assert_eq!(widest(&[[0, 1, 2], [0, 3, 4]]), None);
    }

    /// The neighbours of all blocks.
    fn neighbours(rings: &Rings, vertex: u32) -> Vec<[u32; BLOCK + 1]> {
        std::iter::successors(Some(rings.first(vertex)), |block| rings.after(block)).map(|b| b.neighbours).collect()
    }

    #[test]
    fn a_vertex_where_two_fans_touch_has_a_gap_between_them() {
        let topology = Topology::of_triangles(&[[0, 1, 2], [0, 3, 4]], 6).unwrap();
        let rings = Rings::new(&topology);
        assert_eq!(neighbours(&rings, 0), [[1, 2, 6, 3, 4, 6, 6]]);
        assert_eq!(rings.triangles_of(0).collect::<Vec<_>>(), [([1, 2], 0), ([3, 4], 1)]);
        assert_eq!(neighbours(&rings, 5), [[6; BLOCK + 1]]);
        assert_eq!(rings.triangles_of(5).count(), 0);
    }

    #[test]
    fn a_long_ring_goes_on_with_the_neighbour_that_its_block_ended_with() {
        let triangles: Vec<[u32; 3]> = (0..8).map(|k| [0, 1 + k, 1 + (k + 1) % 8]).collect();
        let rings = Rings::new(&Topology::of_triangles(&triangles, 9).unwrap());
        assert_eq!(neighbours(&rings, 0), [[1, 2, 3, 4, 5, 6, 7], [7, 8, 1, 9, 9, 9, 9]]);
        assert!(rings.triangles_of(0).map(|(_, triangle)| triangle).eq(0..8));
        assert_eq!(rings.widest_fan(), Some(4));
    }
}
