//! Taking a mesh apart into its pieces: sets of triangles joined by edges.
//!
//! Each piece becomes a mesh of its own. A vertex that several pieces only touch is split: each piece has its own copy.
//! Vertices and triangles keep their relative order.

use super::topology::NONE;
use super::{Mesh, Topology};

/// One piece of a mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Piece {
    /// The piece as a mesh.
    pub mesh: Mesh,
    /// For each of its vertices that of the whole.
    pub vertex_of: Vec<u32>,
    /// For each of its triangles that of the whole.
    pub triangle_of: Vec<u32>,
}

/// The pieces of a mesh, in the order of their least triangle. Vertices that no triangle uses belong to none.
#[must_use]
pub fn pieces(mesh: &Mesh, topology: &Topology) -> Vec<Piece> {
    let mut pieces = vec![Piece::default(); topology.piece_count()];
    for (t, &piece) in topology.piece_of().iter().enumerate() {
        pieces[piece as usize].triangle_of.push(t as u32);
    }
    let mut local = vec![NONE; mesh.positions.len()];
    for piece in &mut pieces {
        let corners = piece.triangle_of.iter().flat_map(|&t| mesh.triangles[t as usize]);
        piece.vertex_of = corners.collect();
        piece.vertex_of.sort_unstable();
        piece.vertex_of.dedup();
        for (i, &v) in piece.vertex_of.iter().enumerate() {
            local[v as usize] = i as u32;
        }
        piece.mesh = Mesh {
            positions: piece.vertex_of.iter().map(|&v| mesh.positions[v as usize]).collect(),
            uv: mesh.uv.as_ref().map(|uv| piece.vertex_of.iter().map(|&v| uv[v as usize]).collect()),
            triangles: piece
                .triangle_of
                .iter()
                .map(|&t| mesh.triangles[t as usize].map(|v| local[v as usize]))
                .collect(),
        };
    }
    pieces
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;

    #[test]
    fn a_vertex_where_two_pieces_touch_is_split() {
        let mesh = Mesh {
            positions: (0..6).map(|i| DVec3::splat(f64::from(i))).collect(),
            uv: Some((0..6).map(|i| DVec2::splat(f64::from(i))).collect()),
            triangles: vec![[4, 2, 1], [2, 3, 5]],
        };
        let pieces = pieces(&mesh, &Topology::new(&mesh).unwrap());
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0].vertex_of, [1, 2, 4]);
        assert_eq!(pieces[0].mesh.triangles, [[2, 1, 0]]);
        assert_eq!(pieces[1].vertex_of, [2, 3, 5]);
        assert_eq!(pieces[1].triangle_of, [1]);
        assert_eq!(pieces[1].mesh.positions[0], DVec3::splat(2.0));
        assert_eq!(pieces[1].mesh.uv.as_ref().unwrap()[2], DVec2::splat(5.0));
    }
}
