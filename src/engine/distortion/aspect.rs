//! The aspect ratios of a mesh (thesis 1.6.9) in the ranges of Tables 3.3 and 3.4.

use super::AspectRatio;
use crate::engine::mesh::Mesh;
use crate::engine::mesh::measures::{ASPECT_RANGES, aspect_ratio, corners};

impl AspectRatio {
    /// Of a mesh. Ranges are half open, `[from, to)`; shares are percent of the triangles.
    #[must_use]
    pub fn of(mesh: &Mesh) -> Self {
        let mut counts = [0_u64; ASPECT_RANGES.len()];
        let (mut min, mut max) = (f64::INFINITY, 0.0_f64);
        for t in 0..mesh.triangles.len() as u32 {
            let ratio = aspect_ratio(corners(mesh, t));
            min = min.min(ratio);
            max = max.max(ratio);
            let range = ASPECT_RANGES.partition_point(|&from| from <= ratio);
            counts[range.saturating_sub(1)] += 1;
        }
        let total = mesh.triangles.len().max(1) as f64;
        let histogram = counts
            .iter()
            .enumerate()
            .map(|(i, &count)| (ASPECT_RANGES[i], ASPECT_RANGES.get(i + 1).copied(), 100.0 * count as f64 / total))
            .collect();
        Self { min: if mesh.triangles.is_empty() { 0.0 } else { min }, max, histogram }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    #[test]
    fn right_angle_triangles_of_squares_fall_into_the_third_range() {
        let aspect = AspectRatio::of(&grid(5, 5, Diagonal::Regular, |u, v| DVec3::new(u, v, 0.0)));
        assert!((aspect.min - 2.0).abs() < 1e-12 && (aspect.max - 2.0).abs() < 1e-12);
        assert_eq!(aspect.histogram.len(), 16);
        let share: f64 = aspect.histogram.iter().filter(|h| h.0 == 1.5 || h.0 == 2.0).map(|h| h.2).sum();
        assert!((share - 100.0).abs() < 1e-12);
    }

    #[test]
    fn shares_add_up_and_the_last_range_has_no_end() {
        let aspect = AspectRatio::of(&grid(9, 9, Diagonal::Diamond, |u, v| DVec3::new(u * u * 50.0, v, 0.0)));
        assert!((aspect.histogram.iter().map(|h| h.2).sum::<f64>() - 100.0).abs() < 1e-9);
        assert_eq!(aspect.histogram[15].1, None);
        assert!(aspect.max > aspect.min);
    }

    #[test]
    fn an_empty_mesh_has_finite_numbers() {
        let aspect = AspectRatio::of(&Mesh::default());
        assert_eq!((aspect.min, aspect.max), (0.0, 0.0));
    }
}
