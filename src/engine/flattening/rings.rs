//! The vertices around each vertex, laid out for the flip check.
//!
//! The ring of a vertex lists its neighbours fan by fan, anticlockwise, so that each two that follow one another make a
//! triangle with it. An inner vertex has its first neighbour again at the end. Between two fans (a vertex where parts of
//! the mesh only touch) stands the number of a vertex that does not exist: its place is kept as NaN, and no comparison
//! with NaN finds a flip.

use crate::engine::mesh::Topology;
use crate::engine::mesh::topology::{NONE, next, prev};

/// Rings of all vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Rings {
    /// For each vertex where its ring begins and ends.
    spans: Vec<[u32; 2]>,
    neighbours: Vec<u32>,
    /// The triangle between a neighbour and the next one, [`NONE`] at the end of a fan.
    triangles: Vec<u32>,
}

impl Rings {
    /// Rings of a mesh: O(triangles).
    pub(super) fn new(topology: &Topology) -> Self {
        let gap = topology.vertex_count() as u32;
        let halfedges = 3 * topology.triangle_count() as u32;
        // First half-edge of each fan: at the border its clockwise end, else the least of the fan.
        let mut seen = vec![false; halfedges as usize];
        let mut fans: Vec<(u32, u32)> = Vec::new();
        let mut lengths = vec![0_u32; topology.vertex_count() + 1];
        for border in [true, false] {
            for first in 0..halfedges {
                if seen[first as usize] || (border && topology.twin(first) != NONE) {
                    continue;
                }
                let mut count = 0;
                for h in fan(topology, first) {
                    seen[h as usize] = true;
                    count += 1;
                }
                fans.push((first, count));
                // The neighbours of the fan and one gap after it.
                lengths[topology.origin(first) as usize + 1] += count + 2;
            }
        }
        for v in 0..topology.vertex_count() {
            lengths[v + 1] += lengths[v];
        }
        let starts = lengths;
        let mut place = starts.clone();
        let total = starts.last().map_or(0, |&n| n as usize);
        // Without the gap at the end.
        let spans = starts.windows(2).map(|s| [s[0], s[1].max(s[0] + 1) - 1]).collect();
        let mut rings = Self { spans, neighbours: vec![gap; total], triangles: vec![NONE; total] };
        for &(first, count) in &fans {
            let at = &mut place[topology.origin(first) as usize];
            for h in fan(topology, first) {
                rings.neighbours[*at as usize] = topology.target(h);
                rings.triangles[*at as usize] = h / 3;
                rings.neighbours[*at as usize + 1] = topology.origin(prev(h));
                *at += 1;
            }
            debug_assert!(count > 0);
            *at += 2;
        }
        rings
    }

    /// Most steps over edges between two triangles of one vertex; `None` where some vertex has several fans.
    pub(super) fn widest_fan(&self) -> Option<u32> {
        let gap = self.spans.len() as u32;
        let mut widest = 0;
        for v in 0..gap {
            let ring = self.of(v);
            if ring.contains(&gap) {
                return None;
            }
            let triangles = ring.len().saturating_sub(1) as u32;
            // Closed when the first neighbour stands at the end again: then one can go either way round.
            let closed = triangles > 2 && ring.first() == ring.last();
            widest = widest.max(if closed { triangles / 2 } else { triangles.saturating_sub(1) });
        }
        Some(widest)
    }

    /// The ring of a vertex.
    #[inline]
    pub(super) fn of(&self, vertex: u32) -> &[u32] {
        let [start, end] = self.spans[vertex as usize];
        &self.neighbours[start as usize..end as usize]
    }

    /// The triangles that go with [`Rings::of`].
    pub(super) fn triangles_of(&self, vertex: u32) -> &[u32] {
        let [start, end] = self.spans[vertex as usize];
        &self.triangles[start as usize..end as usize]
    }
}

/// The half-edges out of one vertex, anticlockwise from the given one, to the border or all round.
fn fan(topology: &Topology, first: u32) -> impl Iterator<Item = u32> {
    std::iter::successors(Some(first), move |&h| {
        let turned = topology.twin(prev(h));
        debug_assert!(turned == NONE || next(prev(h)) == h);
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
                for (pair, &t) in rings.of(v).windows(2).zip(rings.triangles_of(v)) {
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

    #[test]
    fn a_vertex_where_two_fans_touch_has_a_gap_between_them() {
        let topology = Topology::of_triangles(&[[0, 1, 2], [0, 3, 4]], 6).unwrap();
        let rings = Rings::new(&topology);
        assert_eq!(rings.of(0), [1, 2, 6, 3, 4]);
        assert_eq!(rings.triangles_of(0), [0, NONE, NONE, 1, NONE]);
        assert!(rings.of(5).is_empty());
    }
}
