//! From loose triangles, as files bring them, to a mesh that can be worked on.
//!
//! - Vertices at the same place become one (exactly the same: exporters write the two sides of a seam from one number).
//! - Triangles without area and triangles that lie on others with the same corners are left out.
//! - Neighbours are oriented alike wherever they can be: over edges of two triangles, the orientation that more triangles
//!   of a component have stands (the first triangle's, when there are as many of each).
//! - A vertex that triangles only touch in, without sharing an edge there, is split: each fan gets its own.
//! - Vertices that no triangle uses are left out; the others keep their order, and so do the triangles.
//!
//! What is left of faults (edges of more than two triangles, one-sided pieces, closed ones, handles) is told piece by piece.
//! Time is O(n log n), memory O(n). Lengths mm, areas mm^2.

use glam::DVec3;

use super::invariants::FLAT;
use super::topology::{NONE, next};
use super::{Mesh, MeshFault, Topology, measures, pieces, sheet};
use crate::engine::error::Place;

/// What was changed on the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Changes {
    /// Vertices that were joined to another at the same place.
    pub welded: u64,
    /// Triangles without area that were left out.
    pub without_area: u64,
    /// Where the first of them was, mm.
    pub first_without_area: Option<DVec3>,
    /// Triangles left out since they lay on another with the same corners.
    pub doubled: u64,
    /// Triangles that were turned over.
    pub turned: u64,
    /// Vertices that came to be by splitting others.
    pub split: u64,
}

/// What is known of a piece.
#[derive(Debug, Clone, PartialEq)]
pub struct PieceFacts {
    /// Its least triangle.
    pub first_triangle: u32,
    /// How many triangles.
    pub triangles: u64,
    /// Its area, mm^2.
    pub area_mm2: f64,
    /// Lengths of its borders, mm, in the order of the topology's borders.
    pub borders_mm: Vec<f64>,
    /// Why it cannot lie flat, in the numbers of the whole mesh, and where.
    pub fault: Option<(MeshFault, Place)>,
}

/// A mesh and what is known of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Assembled {
    /// The mesh.
    pub mesh: Mesh,
    /// For each of its vertices the one of those given that it is.
    pub origin_of: Vec<u32>,
    /// Its topology, cut along edges at fault.
    pub topology: Topology,
    /// The edges at fault.
    pub faults: Vec<MeshFault>,
    /// What was changed.
    pub changes: Changes,
    /// Its pieces.
    pub pieces: Vec<PieceFacts>,
}

/// Makes a mesh of triangles over `positions` (finite, mm). With `weld` vertices at the same place become one.
///
/// # Errors
/// [`MeshFault::VertexOutOfRange`] and [`MeshFault::TooLarge`].
pub fn assemble(positions: &[DVec3], triangles: &[[u32; 3]], weld: bool) -> Result<Assembled, MeshFault> {
    let vertices = positions.len() as u32;
    for (t, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v >= vertices) {
            return Err(MeshFault::VertexOutOfRange { triangle: t as u32, vertex, vertices });
        }
    }
    let mut changes = Changes::default();
    let one = if weld { same_place(positions, &mut changes) } else { (0..vertices).collect() };
    let mut kept = sound_triangles(positions, triangles, &one, &mut changes);
    let edges = Edges::new(&kept);
    orient(&mut kept, &edges, &mut changes);
    let (mesh, origin_of) = split_fans(positions, &kept, &edges, &mut changes);
    let (topology, faults) = Topology::cut(&mesh.triangles, mesh.positions.len())?;
    let pieces = facts(&mesh, &topology);
    Ok(Assembled { mesh, origin_of, topology, faults, changes, pieces })
}

/// For each vertex the least one at the same place.
fn same_place(positions: &[DVec3], changes: &mut Changes) -> Vec<u32> {
    // Adding zero makes one of the two zeros.
    let key = |v: u32| (positions[v as usize] + DVec3::ZERO).to_array();
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by(|&a, &b| {
        let (p, q) = (key(a), key(b));
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(p[2].total_cmp(&q[2])).then(a.cmp(&b))
    });
    let mut one: Vec<u32> = (0..positions.len() as u32).collect();
    for pair in order.windows(2) {
        if key(pair[0]) == key(pair[1]) {
            one[pair[1] as usize] = one[pair[0] as usize];
            changes.welded += 1;
        }
    }
    one
}

/// The triangles that have an area and are there for the first time.
fn sound_triangles(positions: &[DVec3], triangles: &[[u32; 3]], one: &[u32], changes: &mut Changes) -> Vec<[u32; 3]> {
    let mut kept: Vec<[u32; 3]> = Vec::with_capacity(triangles.len());
    for corners in triangles {
        let corners = corners.map(|v| one[v as usize]);
        let [a, b, c] = corners.map(|v| positions[v as usize]);
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        if (b - a).cross(c - a).length() <= FLAT * longest {
            changes.without_area += 1;
            changes.first_without_area.get_or_insert(a + ((b - a) + (c - a)) / 3.0);
        } else {
            kept.push(corners);
        }
    }
    let sorted = |t: usize| {
        let mut corners = kept[t];
        corners.sort_unstable();
        corners
    };
    let mut order: Vec<usize> = (0..kept.len()).collect();
    order.sort_unstable_by_key(|&t| (sorted(t), t));
    let mut again: Vec<usize> =
        order.windows(2).filter(|pair| sorted(pair[0]) == sorted(pair[1])).map(|pair| pair[1]).collect();
    if !again.is_empty() {
        changes.doubled = again.len() as u64;
        again.sort_unstable();
        let mut t = 0;
        kept.retain(|_| {
            t += 1;
            again.binary_search(&(t - 1)).is_err()
        });
    }
    kept
}

/// Half-edges in groups of those that share both vertices, whatever their direction.
struct Edges {
    /// Half-edges, group by group.
    halfedges: Vec<u32>,
    /// Where each group begins; one more than there are groups.
    starts: Vec<u32>,
}

impl Edges {
    fn new(triangles: &[[u32; 3]]) -> Self {
        let corners = triangles.as_flattened();
        let ends = |h: u32| {
            let (a, b) = (corners[h as usize], corners[next(h) as usize]);
            (a.min(b), a.max(b))
        };
        let mut halfedges: Vec<u32> = (0..corners.len() as u32).collect();
        halfedges.sort_unstable_by_key(|&h| (ends(h), h));
        let mut starts = vec![0];
        for k in 1..=halfedges.len() {
            if k == halfedges.len() || ends(halfedges[k]) != ends(halfedges[k - 1]) {
                starts.push(k as u32);
            }
        }
        if halfedges.is_empty() {
            starts.truncate(1);
        }
        Self { halfedges, starts }
    }

    fn groups(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|w| &self.halfedges[w[0] as usize..w[1] as usize])
    }
}

/// Orients triangles alike over edges of two.
fn orient(triangles: &mut [[u32; 3]], edges: &Edges, changes: &mut Changes) {
    let mut mate = vec![NONE; 3 * triangles.len()];
    for group in edges.groups() {
        if let [g, h] = *group {
            mate[g as usize] = h;
            mate[h as usize] = g;
        }
    }
    let origin = |h: u32| triangles[h as usize / 3][h as usize % 3];
    // Half-edges that start from the same vertex run in the same direction.
    let disagree: Vec<bool> =
        (0..mate.len() as u32).map(|h| mate[h as usize] != NONE && origin(h) == origin(mate[h as usize])).collect();
    let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
    let mut component = Vec::new();
    for first in 0..triangles.len() as u32 {
        if turned[first as usize].is_some() {
            continue;
        }
        turned[first as usize] = Some(false);
        component.clear();
        component.push(first);
        let (mut at, mut count) = (0, 0);
        while at < component.len() {
            let t = component[at];
            at += 1;
            let own = turned[t as usize] == Some(true);
            count += usize::from(own);
            for h in 3 * t..3 * t + 3 {
                let other = mate[h as usize];
                if other != NONE && turned[other as usize / 3].is_none() {
                    turned[other as usize / 3] = Some(own != disagree[h as usize]);
                    component.push(other / 3);
                }
            }
        }
        if 2 * count > component.len() {
            for &t in &component {
                turned[t as usize] = turned[t as usize].map(|own| !own);
            }
        }
    }
    for (corners, turned) in triangles.iter_mut().zip(turned) {
        if turned == Some(true) {
            corners.swap(1, 2);
            changes.turned += 1;
        }
    }
}

/// The mesh with a vertex for each fan, and where each comes from.
fn split_fans(positions: &[DVec3], triangles: &[[u32; 3]], edges: &Edges, changes: &mut Changes) -> (Mesh, Vec<u32>) {
    let corners = triangles.as_flattened();
    // Corners of one fan, joined over the edges that they share. Groups name half-edges as they were before triangles
    // were turned over, which does not change which triangles share an edge.
    let mut fan = Joined::new(corners.len());
    for group in edges.groups() {
        let of = |h: u32, vertex: u32| (h - h % 3..h - h % 3 + 3).find(|&c| corners[c as usize] == vertex);
        let Some(&first) = group.first() else { continue };
        let shared = shared_vertices(triangles, group);
        for vertex in shared {
            let Some(kept) = of(first, vertex) else { continue };
            for &h in &group[1..] {
                if let Some(other) = of(h, vertex) {
                    fan.join(kept, other);
                }
            }
        }
    }
    // By vertex, then by the least corner.
    let roots: Vec<u32> = (0..corners.len() as u32).map(|c| fan.root(c)).collect();
    let mut fans: Vec<(u32, u32)> =
        (0..corners.len() as u32).filter(|&c| roots[c as usize] == c).map(|c| (corners[c as usize], c)).collect();
    fans.sort_unstable();
    let mut number = vec![NONE; corners.len()];
    let mut mesh = Mesh { positions: Vec::with_capacity(fans.len()), ..Mesh::default() };
    for (k, &(vertex, root)) in fans.iter().enumerate() {
        changes.split += u64::from(k > 0 && fans[k - 1].0 == vertex);
        number[root as usize] = k as u32;
        mesh.positions.push(positions[vertex as usize]);
    }
    let corner = |c: u32| number[roots[c as usize] as usize];
    mesh.triangles =
        (0..triangles.len() as u32).map(|t| [corner(3 * t), corner(3 * t + 1), corner(3 * t + 2)]).collect();
    (mesh, fans.into_iter().map(|(vertex, _)| vertex).collect())
}

/// The two vertices that all triangles of a group share: those of the first one's that the second has too; of a group of
/// one, none need joining.
fn shared_vertices(triangles: &[[u32; 3]], group: &[u32]) -> impl Iterator<Item = u32> {
    let pair = match *group {
        [g, h, ..] => Some((triangles[g as usize / 3], triangles[h as usize / 3])),
        _ => None,
    };
    pair.into_iter().flat_map(|(a, b)| a.into_iter().filter(move |v| b.contains(v)))
}

/// Disjoint sets of corners; the least of a set is its root.
struct Joined(Vec<u32>);

impl Joined {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut of: u32) -> u32 {
        while self.0[of as usize] != of {
            // Halving the way keeps it short.
            self.0[of as usize] = self.0[self.0[of as usize] as usize];
            of = self.0[of as usize];
        }
        of
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

fn facts(mesh: &Mesh, topology: &Topology) -> Vec<PieceFacts> {
    let mut facts: Vec<PieceFacts> = pieces(mesh, topology)
        .into_iter()
        .map(|piece| PieceFacts {
            first_triangle: piece.triangle_of.first().copied().unwrap_or(0),
            triangles: piece.triangle_of.len() as u64,
            area_mm2: measures::total_area(&piece.mesh),
            borders_mm: Vec::new(),
            fault: sheet(&piece.mesh).err().map(|fault| {
                let mut place = fault.place_in(&piece.mesh);
                let fault = fault.in_whole(&piece);
                place.triangle = fault.triangle();
                (fault, place)
            }),
        })
        .collect();
    for border in topology.borders() {
        let Some(&first) = border.first() else { continue };
        let length = |h: u32| {
            let [a, b] = [topology.origin(h), topology.target(h)].map(|v| mesh.positions[v as usize]);
            a.distance(b)
        };
        let piece = topology.piece_of()[first as usize / 3] as usize;
        facts[piece].borders_mm.push(border.iter().map(|&h| length(h)).sum());
    }
    facts
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    const SQUARE: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];

    /// Every corner of every triangle as a vertex of its own.
    fn apart(mesh: &Mesh) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let positions = mesh.triangles.as_flattened().iter().map(|&v| mesh.positions[v as usize]).collect();
        let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        (positions, triangles)
    }

    #[test]
    fn a_mesh_taken_apart_is_welded_to_what_it_was() {
        let mut mesh = grid(9, 7, Diagonal::Diamond, |u, v| DVec3::new(u, v, u * v));
        mesh.uv = None;
        let (positions, triangles) = apart(&mesh);
        let found = assemble(&positions, &triangles, true).unwrap();
        assert_eq!(found.topology.edge_count(), Topology::new(&mesh).unwrap().edge_count());
        assert_eq!(found.mesh.positions.len(), 63);
        assert_eq!(found.changes.welded, positions.len() as u64 - 63);
        for (corners, was) in found.mesh.triangles.iter().zip(&mesh.triangles) {
            let at = |mesh: &Mesh, t: &[u32; 3]| t.map(|v| mesh.positions[v as usize]);
            assert_eq!(at(&found.mesh, corners), at(&mesh, was));
        }
        let loose = assemble(&positions, &triangles, false).unwrap();
        assert_eq!((loose.pieces.len(), loose.changes.welded), (triangles.len(), 0));
    }

    #[test]
    fn negative_zero_is_the_same_place_as_zero() {
        let mut positions = SQUARE.to_vec();
        positions.push(DVec3::new(-0.0, 0.0, -0.0));
        let found = assemble(&positions, &[[0, 1, 2], [4, 2, 3]], true).unwrap();
        assert_eq!((found.mesh.positions.len(), found.pieces.len()), (4, 1));
    }

    #[test]
    fn the_orientation_of_most_triangles_stands() {
        let mut mesh = grid(8, 8, Diagonal::Regular, |u, v| DVec3::new(u, v, 0.0));
        for t in [0, 5, 17, 40, 41, 42] {
            mesh.triangles[t].swap(0, 1);
        }
        let found = assemble(&mesh.positions, &mesh.triangles, true).unwrap();
        assert_eq!(found.changes.turned, 6);
        assert!(found.faults.is_empty() && found.pieces[0].fault.is_none());
        let up = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| found.mesh.positions[v as usize]);
            (b - a).cross(c - a).z > 0.0
        };
        assert!(found.mesh.triangles.iter().all(up));
    }

    #[test]
    fn triangles_without_area_and_doubled_ones_are_left_out() {
        let mut positions = SQUARE.to_vec();
        positions.push(DVec3::new(2.0, 0.0, 0.0));
        let triangles = [[0, 1, 2], [0, 1, 1], [0, 1, 4], [0, 2, 3], [2, 1, 0], [3, 0, 2]];
        let found = assemble(&positions, &triangles, true).unwrap();
        assert_eq!(found.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!((found.changes.without_area, found.changes.doubled), (2, 2));
        assert_eq!(found.changes.first_without_area, Some(DVec3::new(2.0 / 3.0, 0.0, 0.0)));
        assert_eq!(found.mesh.positions.len(), 4, "the vertex that nothing uses is gone");
    }

    #[test]
    fn pieces_that_touch_in_a_vertex_are_parted_and_so_is_a_piece_that_touches_itself() {
        let bow_tie = [DVec3::ZERO, DVec3::new(1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0), DVec3::NEG_X, DVec3::NEG_Y];
        let found = assemble(&bow_tie, &[[0, 1, 2], [0, 3, 4]], true).unwrap();
        assert_eq!((found.pieces.len(), found.mesh.positions.len(), found.changes.split), (2, 6, 1));
        // A strip bent round until its first and last corner meet: one piece that touches itself in vertex 0.
        let ring: Vec<DVec3> = (0..7)
            .map(|k| {
                let a = std::f64::consts::TAU * f64::from(k) / 6.5;
                DVec3::new(a.cos(), a.sin(), 0.0) * if k % 2 == 0 { 1.0 } else { 2.0 }
            })
            .collect();
        let triangles = [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5], [4, 5, 6], [6, 5, 0]];
        let found = assemble(&ring, &triangles, true).unwrap();
        assert_eq!((found.pieces.len(), found.changes.split, found.mesh.positions.len()), (1, 1, 8));
        assert_eq!(found.topology.border_count(), 1);
        assert_eq!(found.pieces[0].fault, None);
    }

    #[test]
    fn faults_come_piece_by_piece_with_their_place() {
        // An edge of three triangles, and apart from it a square.
        let mut positions = SQUARE.to_vec();
        positions.extend([5.0, 6.0].map(|x| DVec3::new(x, 0.0, 0.0)));
        positions.extend([DVec3::new(5.5, 1.0, 0.0), DVec3::new(5.5, -1.0, 0.0), DVec3::new(5.5, 0.0, 1.0)]);
        let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [5, 4, 7], [4, 5, 8]];
        let found = assemble(&positions, &triangles, true).unwrap();
        assert_eq!((found.pieces.len(), found.faults.len()), (2, 1));
        assert_eq!(found.pieces[0].fault, None);
        let (fault, place) = found.pieces[1].fault.as_ref().unwrap();
        assert_eq!(fault, &MeshFault::NonManifoldEdge { vertices: [4, 5], triangles: [2, 3, 4], count: 3 });
        assert_eq!(place.xyz_mm, Some([5.5, 0.0, 0.0]));
        assert_eq!(found.pieces[0].borders_mm, [4.0]);
    }

    #[test]
    fn an_index_out_of_range_is_an_error() {
        let error = assemble(&SQUARE, &[[0, 1, 4]], true);
        assert_eq!(error, Err(MeshFault::VertexOutOfRange { triangle: 0, vertex: 4, vertices: 4 }));
        assert_eq!(assemble(&[], &[], true).unwrap(), Assembled { topology: found_empty(), ..Assembled::default() });
    }

    fn found_empty() -> Topology {
        Topology::of_triangles(&[], 0).unwrap()
    }

    proptest! {
        #[test]
        fn any_triangles_become_a_mesh_without_fans_that_only_touch(
            triangles in prop::collection::vec(prop::array::uniform3(0_u32..12), 0..40),
            places in prop::collection::vec(prop::array::uniform3(-3_i8..3), 12),
            weld in any::<bool>(),
        ) {
            let positions: Vec<DVec3> = places.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
            let found = assemble(&positions, &triangles, weld).unwrap();
            let triangles_left = found.mesh.triangles.len() as u64 + found.changes.without_area + found.changes.doubled;
            prop_assert_eq!(triangles_left, triangles.len() as u64);
            prop_assert_eq!(found.pieces.iter().map(|p| p.triangles).sum::<u64>(), found.mesh.triangles.len() as u64);
            if found.faults.is_empty() {
                prop_assert_eq!(found.topology.fan_count(), found.mesh.positions.len());
            }
            // What was assembled without a fault needs no more mending. (Where it was cut at a fault, other triangles are
            // neighbours than before.)
            if found.faults.is_empty() {
                let again = assemble(&found.mesh.positions, &found.mesh.triangles, false).unwrap();
                prop_assert_eq!(&again.mesh.triangles, &found.mesh.triangles);
                prop_assert_eq!(again.changes, Changes::default());
            }
        }
    }
}
