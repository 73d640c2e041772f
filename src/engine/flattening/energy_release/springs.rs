//! The mesh's edges as springs: (4.2) and what both methods ask of it.
//!
//! An edge of length `l` in space that is `l'` long in the plane holds the energy `(l' - l)^2 / (2 l)`, a length: that of a
//! rod whose stiffness does not depend on how finely the mesh divides it. Lengths are millimetres, so energies are too.

use glam::DVec2;

use crate::engine::mesh::{Mesh, Topology};

/// One end of an edge as its other end sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spoke {
    /// The vertex there.
    pub(super) to: u32,
    /// The edge's length in space, mm.
    pub(super) length: f64,
    /// Half of its stiffness, `1 / (2 length)`.
    pub(super) half: f64,
}

/// The edges of a mesh, vertex by vertex.
#[derive(Debug, Clone)]
pub(super) struct Springs {
    /// Where each vertex's spokes begin; one more at the end.
    first: Vec<u32>,
    spokes: Vec<Spoke>,
}

impl Springs {
    /// The springs of a mesh without zero-length edges: each vertex has its spokes in the order of the edges' numbers.
    pub(super) fn new(mesh: &Mesh, topology: &Topology) -> Self {
        let edges = || (0..topology.edge_count() as u32).map(|e| topology.edge_vertices(e));
        let mut first = vec![0_u32; mesh.positions.len() + 1];
        for v in edges().flatten() {
            first[v as usize + 1] += 1;
        }
        for v in 1..first.len() {
            first[v] += first[v - 1];
        }
        let mut next = first.clone();
        let mut spokes = vec![Spoke { to: 0, length: 0.0, half: 0.0 }; 2 * topology.edge_count()];
        for [a, b] in edges() {
            let length = mesh.positions[a as usize].distance(mesh.positions[b as usize]);
            for (from, to) in [(a, b), (b, a)] {
                spokes[next[from as usize] as usize] = Spoke { to, length, half: 0.5 / length };
                next[from as usize] += 1;
            }
        }
        Self { first, spokes }
    }

    /// How many vertices there are, those without an edge included.
    pub(super) const fn vertex_count(&self) -> usize {
        self.first.len() - 1
    }

    /// The spokes of a vertex.
    #[inline]
    pub(super) fn of(&self, vertex: u32) -> &[Spoke] {
        &self.spokes[self.first[vertex as usize] as usize..self.first[vertex as usize + 1] as usize]
    }

    /// Mean length of the edges at each vertex, mm; 0 where there are none.
    pub(super) fn local_lengths(&self) -> Vec<f64> {
        let mean = |spokes: &[Spoke]| spokes.iter().map(|s| s.length).sum::<f64>() / spokes.len().max(1) as f64;
        (0..self.vertex_count() as u32).map(|v| mean(self.of(v))).collect()
    }

    /// Mean length of all edges, mm.
    pub(super) fn mean_length(&self) -> f64 {
        self.spokes.iter().map(|s| s.length).sum::<f64>() / self.spokes.len().max(1) as f64
    }

    /// The energy of all edges whose ends both lie, mm.
    pub(super) fn energy(&self, flat: &[DVec2]) -> f64 {
        let mut sum = 0.0;
        for v in 0..self.vertex_count() as u32 {
            let place = flat[v as usize];
            for spoke in self.of(v).iter().filter(|spoke| spoke.to > v) {
                let off = place.distance(flat[spoke.to as usize]) - spoke.length;
                let energy = spoke.half * off * off;
                // NaN where an end does not lie yet.
                if energy >= 0.0 {
                    sum += energy;
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    #[test]
    fn an_edge_longer_by_a_tenth_holds_half_a_hundredth_of_its_length() {
        let mesh = grid(2, 2, Diagonal::Regular, |u, v| glam::DVec3::new(3.0 * u, 4.0 * v, 0.0));
        let springs = Springs::new(&mesh, &Topology::new(&mesh).unwrap());
        let scaled: Vec<DVec2> = mesh.positions.iter().map(|p| p.truncate() * 1.1).collect();
        // Two sides of 3, two of 4, a diagonal of 5.
        assert!((springs.energy(&scaled) - 0.5 * 0.01 * 19.0).abs() < 1e-14);
        assert_eq!(springs.of(0).iter().map(|s| s.to).collect::<Vec<_>>().len(), 3);
        assert!((springs.mean_length() - 3.8).abs() < 1e-14);
        assert!((springs.local_lengths()[0] - 4.0).abs() < 1e-14);
        let mut partly = scaled;
        partly[3] = DVec2::NAN;
        assert!((springs.energy(&partly) - 0.5 * 0.01 * 7.0).abs() < 1e-14);
    }
}
