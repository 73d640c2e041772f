//! Taking a mesh apart into its pieces: sets of triangles joined by edges.
//!
//! Each piece becomes a mesh of its own. A vertex that several pieces only touch is split: each piece has its own copy.
//! Vertices and triangles keep their relative order.

use super::topology::NONE;
use super::{Mesh, MeshFault, Topology};

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

/// The topology of a piece that can lie flat: a sheet with a border, holes or not.
///
/// A sheet of Euler characteristic V - E + F = 2 - 2 g - b has g handles, b being its borders.
///
/// # Errors
/// [`MeshFault::NonManifoldEdge`], [`MeshFault::NotOrientable`] (neighbours that cannot agree, once a mesh is oriented as
/// far as it can be), [`MeshFault::Closed`] and [`MeshFault::Handles`], in the numbers of the piece.
pub fn sheet(piece: &Mesh) -> Result<Topology, MeshFault> {
    let topology = Topology::new(piece).map_err(|fault| match fault {
        MeshFault::Orientation { vertices, triangles } => MeshFault::NotOrientable { vertices, triangles },
        other => other,
    })?;
    check_sheet(&topology)?;
    Ok(topology)
}

/// Whether one piece, whose edges are without fault, is a sheet with a border.
///
/// # Errors
/// [`MeshFault::Closed`] and [`MeshFault::Handles`].
pub fn check_sheet(topology: &Topology) -> Result<(), MeshFault> {
    let triangles = topology.triangle_count() as u32;
    let borders = topology.border_count() as i64;
    if borders == 0 && triangles > 0 {
        return Err(MeshFault::Closed { triangle: 0, triangles });
    }
    let euler = topology.fan_count() as i64 - topology.edge_count() as i64 + i64::from(triangles);
    let handles = (2 - euler - borders) / 2;
    if topology.piece_count() == 1 && handles > 0 {
        return Err(MeshFault::Handles { handles: handles as u32, triangle: 0 });
    }
    Ok(())
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

    fn of(triangles: &[[u32; 3]], vertices: usize) -> Mesh {
        Mesh { positions: vec![DVec3::ZERO; vertices], uv: None, triangles: triangles.to_vec() }
    }

    #[test]
    fn what_cannot_lie_flat_is_told_apart() {
        let closed = of(&[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]], 4);
        assert_eq!(sheet(&closed), Err(MeshFault::Closed { triangle: 0, triangles: 4 }));
        // A band of five triangles closed with a half turn.
        let moebius = of(&[[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 0], [4, 0, 1]], 5);
        assert!(matches!(sheet(&moebius), Err(MeshFault::NotOrientable { .. })));
        // A torus of 3 x 3 vertices without one of its triangles.
        let vertex = |i: u32, j: u32| 3 * (j % 3) + i % 3;
        let cell = |i: u32, j: u32| {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        let torus: Vec<_> = (0..9).flat_map(|k| cell(k % 3, k / 3)).skip(1).collect();
        assert_eq!(sheet(&of(&torus, 9)), Err(MeshFault::Handles { handles: 1, triangle: 0 }));
        // A ring that touches itself nowhere, and one that touches itself in two vertices.
        assert!(sheet(&of(&[[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]], 6)).is_ok());
        assert!(sheet(&of(&[[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5], [5, 3, 6], [5, 6, 0], [6, 1, 7]], 8)).is_ok());
    }
}
