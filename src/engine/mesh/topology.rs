//! Half-edge topology of a triangle mesh as flat arrays (thesis 1.7).
//!
//! Half-edge `3 * t + e` runs from corner `e` to corner `(e + 1) % 3` of triangle `t`; [`Topology::twin`] gives the
//! half-edge that runs the other way in the neighbouring triangle, or [`NONE`] at the border. Edges are numbered in the
//! order in which the half-edges meet them, borders are closed loops of half-edges, pieces are sets of triangles joined
//! by edges (a shared vertex alone joins nothing).
//!
//! Method: half-edges are sorted by their two vertices with two counting sorts, so that the halves of an edge stand side
//! by side. Time and memory are O(triangles + vertices) for every mesh, also for stars of any valency.
//!
//! Limits: 2^30 triangles; each edge belongs to at most two triangles, which run through it in opposite directions.

use super::{Mesh, MeshFault};

/// "No half-edge", "no triangle".
pub const NONE: u32 = u32::MAX;

/// Most triangles of a mesh: three times as many half-edges leave room in `u32` for [`NONE`] and for tagged numbers.
const MAX_TRIANGLES: usize = 1 << 30;

/// The next half-edge in the same triangle.
#[must_use]
pub const fn next(halfedge: u32) -> u32 {
    if halfedge % 3 == 2 { halfedge - 2 } else { halfedge + 1 }
}

/// The previous half-edge in the same triangle.
#[must_use]
pub const fn prev(halfedge: u32) -> u32 {
    if halfedge.is_multiple_of(3) { halfedge + 2 } else { halfedge - 1 }
}

/// Who is whose neighbour in a mesh.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Topology {
    triangles: Vec<[u32; 3]>,
    vertex_count: usize,
    twin: Vec<u32>,
    edge_of: Vec<u32>,
    edges: Vec<u32>,
    border_starts: Vec<u32>,
    border_halfedges: Vec<u32>,
    piece_of: Vec<u32>,
    piece_count: usize,
    used_vertices: usize,
}

impl Topology {
    /// The topology of a mesh.
    ///
    /// # Errors
    /// The first [`MeshFault`] of the connectivity: an index out of range, a vertex twice in a triangle, an edge of more
    /// than two triangles, two triangles that run through an edge in the same direction.
    pub fn new(mesh: &Mesh) -> Result<Self, MeshFault> {
        Self::of_triangles(&mesh.triangles, mesh.positions.len())
    }

    /// The topology of triangles over vertices `0..vertex_count`.
    ///
    /// # Errors
    /// As [`Topology::new`].
    pub fn of_triangles(triangles: &[[u32; 3]], vertex_count: usize) -> Result<Self, MeshFault> {
        let (topology, mut faults) = Self::cut(triangles, vertex_count)?;
        if faults.is_empty() { Ok(topology) } else { Err(faults.swap_remove(0)) }
    }

    /// The topology of triangles whose edges may be at fault: where more than two triangles share an edge, or two run
    /// through it in the same direction, their half-edges have no twins, so that a border runs there, and each half-edge
    /// counts as an edge of its own. The triangles are of one piece all the same. The faults come along, in the order of
    /// their least half-edge.
    ///
    /// # Errors
    /// [`MeshFault::TooLarge`], [`MeshFault::VertexOutOfRange`] and [`MeshFault::RepeatedVertex`]: there are no edges then.
    pub fn cut(triangles: &[[u32; 3]], vertex_count: usize) -> Result<(Self, Vec<MeshFault>), MeshFault> {
        check_corners(triangles, vertex_count)?;
        let mut topology = Self { triangles: triangles.to_vec(), vertex_count, ..Self::default() };
        let (faults, joints) = topology.pair_halfedges();
        topology.number_edges();
        topology.join_pieces(&joints);
        topology.chain_borders();
        let mut used = vec![false; vertex_count];
        for &v in triangles.as_flattened() {
            used[v as usize] = true;
        }
        topology.used_vertices = used.iter().filter(|&&u| u).count();
        Ok((topology, faults))
    }

    /// The triangles' corners.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// How many vertices the mesh has, used or not.
    #[must_use]
    pub const fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// How many triangles the mesh has.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The vertex that a half-edge starts from.
    #[must_use]
    pub fn origin(&self, halfedge: u32) -> u32 {
        self.triangles.as_flattened()[halfedge as usize]
    }

    /// The vertex that a half-edge runs to.
    #[must_use]
    pub fn target(&self, halfedge: u32) -> u32 {
        self.origin(next(halfedge))
    }

    /// For each half-edge its twin, [`NONE`] at the border.
    #[must_use]
    pub fn twins(&self) -> &[u32] {
        &self.twin
    }

    /// The twin of a half-edge, [`NONE`] at the border.
    #[must_use]
    pub fn twin(&self, halfedge: u32) -> u32 {
        self.twin[halfedge as usize]
    }

    /// For each half-edge the number of its edge.
    #[must_use]
    pub fn edge_of(&self) -> &[u32] {
        &self.edge_of
    }

    /// For each edge the first half-edge that runs along it.
    #[must_use]
    pub fn edges(&self) -> &[u32] {
        &self.edges
    }

    /// How many edges there are.
    #[must_use]
    pub fn edge_count(&self) -> usize {
        self.edges.len()
    }

    /// The two vertices of an edge, in the direction of its first half-edge.
    #[must_use]
    pub fn edge_vertices(&self, edge: u32) -> [u32; 2] {
        let h = self.edges[edge as usize];
        [self.origin(h), self.target(h)]
    }

    /// How many closed borders there are.
    #[must_use]
    pub fn border_count(&self) -> usize {
        self.border_starts.len().saturating_sub(1)
    }

    /// The borders, each the half-edges of one closed loop in order; the mesh lies to their left. They come in the
    /// order of their least half-edge, which stands first.
    pub fn borders(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.border_starts.windows(2).map(|w| &self.border_halfedges[w[0] as usize..w[1] as usize])
    }

    /// For each triangle its piece; pieces are numbered by their least triangle.
    #[must_use]
    pub fn piece_of(&self) -> &[u32] {
        &self.piece_of
    }

    /// How many pieces there are.
    #[must_use]
    pub const fn piece_count(&self) -> usize {
        self.piece_count
    }

    /// Used vertices - edges + triangles: 1 for a disc, 2 for a sphere, 0 for a ring, less one for each hole.
    #[must_use]
    pub fn euler_characteristic(&self) -> i64 {
        self.used_vertices as i64 - self.edges.len() as i64 + self.triangles.len() as i64
    }

    /// How many fans of triangles there are round the vertices: as many as used vertices, and more where fans of one
    /// vertex do not share an edge there.
    #[must_use]
    pub fn fan_count(&self) -> usize {
        let mut seen = vec![false; self.twin.len()];
        let mut fans = 0;
        // A fan at the border begins with its border half-edge; what is left then is closed.
        for border in [true, false] {
            for first in 0..self.twin.len() as u32 {
                if seen[first as usize] || (border && self.twin(first) != NONE) {
                    continue;
                }
                fans += 1;
                let mut h = first;
                while h != NONE && !std::mem::replace(&mut seen[h as usize], true) {
                    h = self.twin(prev(h));
                }
            }
        }
        fans
    }

    /// Sorts half-edges by (lesser vertex, greater vertex), stable, and couples those that share both. Gives the edges at
    /// fault, and pairs of triangles that share one.
    fn pair_halfedges(&mut self) -> (Vec<MeshFault>, Vec<[u32; 2]>) {
        let corners = self.triangles.as_flattened();
        let ends = |h: u32| -> (u32, u32) {
            let (a, b) = (corners[h as usize], corners[next(h) as usize]);
            (a.min(b), a.max(b))
        };
        let count = corners.len();
        let identity: Vec<u32> = (0..count as u32).collect();
        let by_greater = counting_sort(&identity, self.vertex_count, |h| ends(h).1);
        let sorted = counting_sort(&by_greater, self.vertex_count, |h| ends(h).0);
        let mut twin = vec![NONE; count];
        let mut faults: Vec<(u32, MeshFault)> = Vec::new();
        let mut joints = Vec::new();
        let mut i = 0;
        while i < count {
            let key = ends(sorted[i]);
            let mut j = i + 1;
            while j < count && ends(sorted[j]) == key {
                j += 1;
            }
            let (h, vertices) = (sorted[i], [key.0, key.1]);
            let found = match j - i {
                1 => None,
                2 => {
                    let g = sorted[i + 1];
                    if corners[h as usize] == corners[g as usize] {
                        Some(MeshFault::Orientation { vertices, triangles: [h / 3, g / 3] })
                    } else {
                        twin[h as usize] = g;
                        twin[g as usize] = h;
                        None
                    }
                }
                count => Some(MeshFault::NonManifoldEdge {
                    vertices,
                    triangles: [h / 3, sorted[i + 1] / 3, sorted[i + 2] / 3],
                    count: count as u32,
                }),
            };
            if let Some(found) = found {
                faults.push((h, found));
                joints.extend(sorted[i..j].windows(2).map(|pair| [pair[0] / 3, pair[1] / 3]));
            }
            i = j;
        }
        self.twin = twin;
        // By the least half-edge, whatever the numbering of the vertices.
        faults.sort_by_key(|(at, _)| *at);
        (faults.into_iter().map(|(_, fault)| fault).collect(), joints)
    }

    fn number_edges(&mut self) {
        self.edge_of = vec![NONE; self.twin.len()];
        for h in 0..self.twin.len() {
            let twin = self.twin[h];
            if (twin as usize) < h {
                self.edge_of[h] = self.edge_of[twin as usize];
            } else {
                self.edge_of[h] = self.edges.len() as u32;
                self.edges.push(h as u32);
            }
        }
    }

    /// Pieces by the twins, and by the pairs of triangles that share an edge without being twins.
    fn join_pieces(&mut self, joints: &[[u32; 2]]) {
        self.piece_of = vec![NONE; self.triangles.len()];
        let mut joined: Vec<[u32; 2]> = joints.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        joined.sort_unstable();
        let mut open = Vec::new();
        for first in 0..self.triangles.len() as u32 {
            if self.piece_of[first as usize] != NONE {
                continue;
            }
            let piece = self.piece_count as u32;
            self.piece_count += 1;
            self.piece_of[first as usize] = piece;
            open.push(first);
            while let Some(t) = open.pop() {
                for h in 3 * t..3 * t + 3 {
                    let twin = self.twin[h as usize];
                    if twin != NONE && self.piece_of[(twin / 3) as usize] == NONE {
                        self.piece_of[(twin / 3) as usize] = piece;
                        open.push(twin / 3);
                    }
                }
                let from = joined.partition_point(|pair| pair[0] < t);
                for &[_, other] in joined[from..].iter().take_while(|pair| pair[0] == t) {
                    if self.piece_of[other as usize] == NONE {
                        self.piece_of[other as usize] = piece;
                        open.push(other);
                    }
                }
            }
        }
    }

    /// Follows each border: from a border half-edge round the fan at its target to the next one. Every border half-edge
    /// has exactly one successor and one predecessor, so the chains close, also where a vertex is touched twice.
    fn chain_borders(&mut self) {
        self.border_starts.push(0);
        let mut seen = vec![false; self.twin.len()];
        for first in 0..self.twin.len() as u32 {
            if self.twin[first as usize] != NONE || seen[first as usize] {
                continue;
            }
            let mut h = first;
            loop {
                seen[h as usize] = true;
                self.border_halfedges.push(h);
                h = next(h);
                while self.twin[h as usize] != NONE {
                    h = next(self.twin[h as usize]);
                }
                if h == first {
                    break;
                }
            }
            self.border_starts.push(self.border_halfedges.len() as u32);
        }
    }
}

fn check_corners(triangles: &[[u32; 3]], vertex_count: usize) -> Result<(), MeshFault> {
    if triangles.len() > MAX_TRIANGLES || vertex_count >= NONE as usize {
        return Err(MeshFault::TooLarge { triangles: triangles.len() as u64, limit: MAX_TRIANGLES as u64 });
    }
    for (t, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertex_count) {
            return Err(MeshFault::VertexOutOfRange { triangle: t as u32, vertex, vertices: vertex_count as u32 });
        }
        let [a, b, c] = *corners;
        if a == b || b == c || c == a {
            let vertex = if a == b { a } else { c };
            return Err(MeshFault::RepeatedVertex { triangle: t as u32, vertex });
        }
    }
    Ok(())
}

/// Stable counting sort of `items` by a key below `keys`.
fn counting_sort(items: &[u32], keys: usize, key: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut starts = vec![0_u32; keys + 1];
    for &item in items {
        starts[key(item) as usize + 1] += 1;
    }
    for k in 0..keys {
        starts[k + 1] += starts[k];
    }
    let mut sorted = vec![0; items.len()];
    for &item in items {
        let place = &mut starts[key(item) as usize];
        sorted[*place as usize] = item;
        *place += 1;
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid_triangles};

    #[test]
    fn a_grid_is_a_disc_with_one_border_and_the_thesis_counts() {
        for (m, edges, triangles) in [(60, 10561, 6962), (70, 14421, 9522)] {
            let topology = Topology::of_triangles(&grid_triangles(m, m, Diagonal::Regular), m * m).unwrap();
            assert_eq!(topology.edge_count(), edges);
            assert_eq!(topology.triangle_count(), triangles);
            assert_eq!(topology.euler_characteristic(), 1);
            assert_eq!(topology.piece_count(), 1);
            assert_eq!(topology.border_count(), 1);
            assert_eq!(topology.borders().next().unwrap().len(), 4 * (m - 1));
        }
    }

    #[test]
    fn twins_run_in_opposite_directions_along_the_same_edge() {
        let topology = Topology::of_triangles(&grid_triangles(7, 5, Diagonal::Diamond), 35).unwrap();
        for h in 0..topology.twins().len() as u32 {
            let twin = topology.twin(h);
            if twin != NONE {
                assert_eq!(topology.twin(twin), h);
                assert_eq!(topology.origin(h), topology.target(twin));
                assert_eq!(topology.target(h), topology.origin(twin));
                assert_eq!(topology.edge_of()[h as usize], topology.edge_of()[twin as usize]);
            }
            let [a, b] = topology.edge_vertices(topology.edge_of()[h as usize]);
            assert!(
                [a, b] == [topology.origin(h), topology.target(h)]
                    || [b, a] == [topology.origin(h), topology.target(h)]
            );
        }
    }

    #[test]
    fn borders_are_closed_and_lie_with_the_mesh_to_their_left() {
        // A square ring: 4 x 4 points without the middle cell.
        let all = grid_triangles(4, 4, Diagonal::Regular);
        let ring: Vec<_> = all.iter().enumerate().filter(|(t, _)| t / 2 != 4).map(|(_, &t)| t).collect();
        let topology = Topology::of_triangles(&ring, 16).unwrap();
        assert_eq!(topology.euler_characteristic(), 0);
        let borders: Vec<_> = topology.borders().collect();
        assert_eq!(borders.iter().map(|b| b.len()).collect::<Vec<_>>(), [12, 4]);
        for border in borders {
            for (i, &h) in border.iter().enumerate() {
                assert_eq!(topology.target(h), topology.origin(border[(i + 1) % border.len()]));
                assert_eq!(topology.twin(h), NONE);
            }
        }
    }

    #[test]
    fn triangles_that_share_a_vertex_only_are_two_pieces_with_two_borders() {
        let topology = Topology::of_triangles(&[[0, 1, 2], [2, 3, 4]], 5).unwrap();
        assert_eq!(topology.piece_of(), [0, 1]);
        assert_eq!(topology.border_count(), 2);
    }

    #[test]
    fn a_closed_mesh_has_no_border() {
        let topology = Topology::of_triangles(&[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]], 4).unwrap();
        assert_eq!(topology.border_count(), 0);
        assert_eq!(topology.euler_characteristic(), 2);
    }

    #[test]
    fn an_empty_mesh_has_nothing() {
        let topology = Topology::of_triangles(&[], 0).unwrap();
        assert_eq!((topology.edge_count(), topology.border_count(), topology.piece_count()), (0, 0, 0));
    }

    #[test]
    fn faults_name_the_place() {
        assert_eq!(
            Topology::of_triangles(&[[0, 1, 2], [0, 1, 3]], 4),
            Err(MeshFault::Orientation { vertices: [0, 1], triangles: [0, 1] })
        );
        assert_eq!(
            Topology::of_triangles(&[[0, 1, 2], [1, 0, 3], [0, 1, 4]], 5),
            Err(MeshFault::NonManifoldEdge { vertices: [0, 1], triangles: [0, 1, 2], count: 3 })
        );
        assert_eq!(
            Topology::of_triangles(&[[0, 1, 7]], 3),
            Err(MeshFault::VertexOutOfRange { triangle: 0, vertex: 7, vertices: 3 })
        );
        assert_eq!(
            Topology::of_triangles(&[[0, 1, 2], [2, 1, 2]], 3),
            Err(MeshFault::RepeatedVertex { triangle: 1, vertex: 2 })
        );
    }

    #[test]
    fn a_mesh_with_faults_is_cut_there_and_stays_one_piece() {
        let (topology, faults) = Topology::cut(&[[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 1, 5], [2, 5, 1]], 6).unwrap();
        assert_eq!(faults.len(), 2);
        assert!(matches!(faults[0], MeshFault::NonManifoldEdge { vertices: [0, 1], count: 3, .. }));
        assert!(matches!(faults[1], MeshFault::NonManifoldEdge { vertices: [1, 2], count: 3, .. }));
        assert_eq!(topology.piece_of(), [0; 5]);
        assert_eq!((topology.twin(0), topology.twin(1)), (NONE, NONE));
        assert_ne!(topology.twin(10), NONE);
        assert_eq!(Topology::cut(&[[0, 1, 2], [0, 1, 3]], 4).unwrap().1.len(), 1);
    }

    #[test]
    fn a_star_of_a_hundred_thousand_triangles_is_paired() {
        let n = 100_000_u32;
        let star: Vec<_> = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
        let topology = Topology::of_triangles(&star, n as usize + 1).unwrap();
        assert_eq!(topology.border_count(), 1);
        assert_eq!(topology.euler_characteristic(), 1);
    }
}
