//! Strain at vertices, for forms that hold it there: the mean over the triangles around a vertex.
//!
//! A vertex on the border between part and waste takes the mean over the part's triangles alone: what lies outside is cut
//! off. Sums run in the order of the triangles.

use super::MeshParts;

/// Mean least and greatest principal strain of each vertex, percent, and the mean of the larger in magnitude; `None` for a
/// vertex that no strained triangle touches.
pub(super) fn vertex_strains(parts: &MeshParts<'_>, strains: &[[f64; 2]]) -> Vec<Option<VertexStrain>> {
    let mut sums = vec![Sum::default(); parts.mesh.positions.len()];
    for (t, (corners, strain)) in parts.mesh.triangles.iter().zip(strains).enumerate() {
        if !strain.iter().all(|s| s.is_finite()) {
            continue;
        }
        let inside = parts.is_of_part(t);
        for corner in corners {
            if let Some(sum) = sums.get_mut(*corner as usize) {
                sum.add(*strain, inside);
            }
        }
    }
    sums.into_iter().map(Sum::mean).collect()
}

/// Strain at a vertex, percent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VertexStrain {
    /// Least.
    pub(super) min: f64,
    /// Greatest.
    pub(super) max: f64,
    /// The one of larger magnitude.
    pub(super) signed: f64,
}

/// The principal strain of larger magnitude.
pub(super) fn larger([least, greatest]: [f64; 2]) -> f64 {
    if least.abs() > greatest.abs() { least } else { greatest }
}

#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    values: [f64; 3],
    count: u32,
    inside: bool,
}

impl Sum {
    fn add(&mut self, strain: [f64; 2], inside: bool) {
        if self.inside && !inside {
            return;
        }
        if inside && !self.inside {
            *self = Self { inside, ..Self::default() };
        }
        for (sum, value) in self.values.iter_mut().zip([strain[0], strain[1], larger(strain)]) {
            *sum += value;
        }
        self.count += 1;
    }

    fn mean(self) -> Option<VertexStrain> {
        let [min, max, signed] = self.values.map(|sum| sum / f64::from(self.count));
        (self.count > 0).then_some(VertexStrain { min, max, signed })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::Mesh;

    #[test]
    fn a_vertex_takes_the_mean_of_the_parts_triangles_and_of_the_waste_only_where_there_is_no_part() {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO; 7],
            uv: None,
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [4, 5, 5]],
        };
        let strains = [[-9.0, 9.5], [-1.0, 2.0], [-3.0, 1.0], [f64::NAN; 2]];
        let part = [false, true, true, true];
        let parts = MeshParts { part: Some(&part), ..MeshParts::of(&mesh) };
        let found = vertex_strains(&parts, &strains);
        assert_eq!(found[0], Some(VertexStrain { min: -2.0, max: 1.5, signed: -0.5 }));
        assert_eq!(found[1], Some(VertexStrain { min: -9.0, max: 9.5, signed: 9.5 }), "waste alone");
        assert_eq!(found[2], Some(VertexStrain { min: -1.0, max: 2.0, signed: 2.0 }));
        assert_eq!(
            found[4],
            Some(VertexStrain { min: -3.0, max: 1.0, signed: -3.0 }),
            "what is not a number does not count"
        );
        assert_eq!((found[5], found[6]), (None, None));
    }
}
