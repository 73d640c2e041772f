//! What faces share, but are not sewn along, as seams of the pattern.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::engine::mesh::{Mesh, Topology};
use crate::engine::pattern::{Seam, SeamSide, Transform};
use crate::engine::sewing::Run;

/// Where the mesh that a pattern was drawn from lies.
pub(super) struct Seamed<'a> {
    pub mesh: &'a Mesh,
    pub topology: &'a Topology,
    /// The vertices in the plane; NaN where they are not flattened.
    pub flat: &'a [DVec2],
    /// To the pattern.
    pub transform: &'a Transform,
    /// For each vertex the number that runs know it by.
    pub origin_of: &'a [u32],
}

/// The seams: runs of which both sides are borders of flattened pieces. Names are those of the runs, counted.
pub(super) fn seams(runs: &[Run], on: &Seamed<'_>) -> Vec<Seam> {
    let placed = on.transform.apply(on.flat);
    let piece_of_drawn = drawn_pieces(on);
    // Border edges by the numbers of their ends, whichever way they run.
    let mut borders: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for &h in on.topology.borders().flatten() {
        let [a, b] = [on.topology.origin(h), on.topology.target(h)].map(|v| on.origin_of[v as usize]);
        borders.insert([a.min(b), a.max(b)], h);
    }
    let side = |vertices: &[u32]| -> Option<(SeamSide, f64)> {
        let mut points: Vec<DVec2> = Vec::with_capacity(vertices.len());
        let (mut piece, mut length_3d) = (None, 0.0);
        for ends in vertices.windows(2) {
            let &h = borders.get(&[ends[0].min(ends[1]), ends[0].max(ends[1])])?;
            let [a, b] = [on.topology.origin(h), on.topology.target(h)];
            let [a, b] = if on.origin_of[a as usize] == ends[0] { [a, b] } else { [b, a] };
            if points.is_empty() {
                points.push(placed[a as usize]);
            }
            points.push(placed[b as usize]);
            length_3d += on.mesh.positions[a as usize].distance(on.mesh.positions[b as usize]);
            piece = piece_of_drawn[on.topology.piece_of()[h as usize / 3] as usize];
        }
        if points.len() < 2 || !points.iter().all(|p| p.is_finite()) {
            return None;
        }
        let length_mm = points.windows(2).map(|p| p[0].distance(p[1])).sum();
        Some((SeamSide { piece: piece?, points, length_mm }, length_3d))
    };
    let mut seams = Vec::new();
    for run in runs {
        let [Some((first, length_a)), Some((second, length_b))] = [0, 1].map(|k| side(&run.vertices[k])) else {
            continue;
        };
        let length_3d_mm = 0.5 * (length_a + length_b);
        seams.push(Seam { name: format!("S{}", seams.len() + 1), sides: [first, second], length_3d_mm });
    }
    seams
}

/// For each piece of the mesh its place among the pieces that are drawn: those that are flattened.
fn drawn_pieces(on: &Seamed<'_>) -> Vec<Option<u32>> {
    let mut flattened = vec![true; on.topology.piece_count()];
    for (corners, &piece) in on.mesh.triangles.iter().zip(on.topology.piece_of()) {
        let finite = corners.iter().all(|&v| on.flat[v as usize].is_finite());
        flattened[piece as usize] = flattened[piece as usize] && finite;
    }
    let mut next = 0;
    let number = |flattened: bool| {
        next += u32::from(flattened);
        flattened.then(|| next - 1)
    };
    flattened.into_iter().map(number).collect()
}
