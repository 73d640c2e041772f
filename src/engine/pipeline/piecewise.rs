//! Pieces that touch at a vertex only: the vertex is split, so that each piece can lie flat by itself.

use std::collections::BTreeMap;

use crate::engine::mesh::{MeshFault, Topology};
use crate::engine::triangulation::Lifted;

/// No piece yet.
const NOBODY: u32 = u32::MAX;

/// Splits the vertices that several pieces share, and gives the topology of what comes out. A mesh whose pieces do not
/// touch comes back as it was.
///
/// # Errors
/// As [`Topology::new`].
pub(super) fn split_touching(mut lifted: Lifted) -> Result<(Lifted, Topology), MeshFault> {
    let topology = Topology::new(&lifted.mesh)?;
    if topology.piece_count() < 2 {
        return Ok((lifted, topology));
    }
    let pieces = topology.piece_of();
    // The first piece that uses a vertex keeps it; each further one gets a copy.
    let mut owner = vec![NOBODY; lifted.mesh.positions.len()];
    // The copy of a vertex for a piece.
    let mut copies: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for (t, &piece) in pieces.iter().enumerate() {
        for corner in 0..3 {
            let v = lifted.mesh.triangles[t][corner];
            if owner[v as usize] == NOBODY {
                owner[v as usize] = piece;
            }
            if owner[v as usize] == piece {
                continue;
            }
            let copy = *copies.entry((v, piece)).or_insert_with(|| {
                let copy = lifted.mesh.positions.len() as u32;
                lifted.mesh.positions.push(lifted.mesh.positions[v as usize]);
                lifted.normals.push(lifted.normals[v as usize]);
                if let Some(uv) = &mut lifted.mesh.uv {
                    uv.push(uv[v as usize]);
                }
                owner.push(piece);
                copy
            });
            lifted.mesh.triangles[t][corner] = copy;
        }
    }
    if copies.is_empty() {
        return Ok((lifted, topology));
    }
    follow_in_the_domain(&mut lifted, pieces, &copies);
    let topology = Topology::new(&lifted.mesh)?;
    Ok((lifted, topology))
}

/// Gives the domain's triangles their own copies too, so that places in (u, v) lead to the right piece.
fn follow_in_the_domain(lifted: &mut Lifted, pieces: &[u32], copies: &BTreeMap<(u32, u32), u32>) {
    let mut made: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for t in 0..lifted.domain.triangles.len() {
        let image = lifted.triangle_of[t];
        if image == u32::MAX {
            continue;
        }
        let piece = pieces[image as usize];
        for corner in 0..3 {
            let d = lifted.domain.triangles[t][corner];
            let v = lifted.vertex_of[d as usize];
            let Some(&copy) = copies.get(&(v, piece)) else { continue };
            let own = *made.entry((d, piece)).or_insert_with(|| {
                let own = lifted.domain.uv.len() as u32;
                lifted.domain.uv.push(lifted.domain.uv[d as usize]);
                lifted.vertex_of.push(copy);
                own
            });
            lifted.domain.triangles[t][corner] = own;
        }
    }
}
