//! Area and shape change (thesis 4.3): (4.5) to (4.10), per triangle and per edge, of a mesh or of a part of it.
//!
//! `d = before - after`, so that shrinkage is positive; absolute changes sum `|d|`. An edge belongs to a part when one of
//! its triangles does. Sums run in the order of triangles and edges, eight side by side, whatever calls them, hence the same seed has the
//! same change bit for bit in a search and in a report. Areas mm^2, lengths mm. A triangle that the flattening did not
//! get to (NaN) counts for nothing.

use glam::DVec2;

use super::Thresholds;
use crate::engine::mesh::{Mesh, Topology, measures};

/// The mesh in space, measured once: what flattenings of it are compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct Original {
    /// Triangles that count, with their corners and areas.
    triangles: Vec<([u32; 3], f64)>,
    /// Edges that count, with their ends and lengths.
    edges: Vec<([u32; 2], f64)>,
    area: f64,
    length: f64,
}

/// Sums over triangles or edges.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Change {
    /// Sum in space: A^o or L^o.
    pub before: f64,
    /// Sum in the plane: A^f or L^f.
    pub after: f64,
    /// Sum of the absolute differences: (4.9) or (4.10).
    pub absolute: f64,
    /// Greatest absolute difference.
    pub max: f64,
    /// Mean of the absolute differences above the threshold; 0 when there are none.
    pub average: f64,
    /// How many were measured.
    pub count: u64,
}

impl Change {
    /// (4.5) or (4.7): positive for shrinkage.
    #[must_use]
    pub fn relative(&self) -> f64 {
        ratio(self.before - self.after, self.before)
    }

    /// (4.9) or (4.10) in percent of the sum in space.
    #[must_use]
    pub fn percent(&self) -> f64 {
        100.0 * ratio(self.absolute, self.before)
    }

    fn of(pairs: impl Iterator<Item = (f64, f64)>, threshold: f64) -> Self {
        let mut change = Self::default();
        let (mut sum, mut above) = (0.0, 0_u64);
        let mut absolute = [0.0; LANES];
        for (k, (before, after)) in pairs.enumerate().filter(|(_, (_, after))| after.is_finite()) {
            let difference = (before - after).abs();
            change.before += before;
            change.after += after;
            absolute[k % LANES] += difference;
            change.max = change.max.max(difference);
            change.count += 1;
            if difference > threshold {
                sum += difference;
                above += 1;
            }
        }
        change.absolute = total(absolute);
        change.average = ratio(sum, above as f64);
        change
    }
}

/// Sums of absolute differences that run side by side, term `k` in sum `k mod LANES`: one sum alone would wait for each
/// of its additions, and take roots one at a time.
const LANES: usize = 8;

/// The sums as one.
fn total([a, b, c, d, e, f, g, h]: [f64; LANES]) -> f64 {
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

fn ratio(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { numerator / denominator } else { 0.0 }
}

impl Original {
    /// Measures a mesh, or the triangles of it that `part` marks.
    #[must_use]
    pub fn new(mesh: &Mesh, topology: &Topology, part: Option<&[bool]>) -> Self {
        let counts = |t: usize| part.is_none_or(|p| p.get(t) == Some(&true));
        let triangles: Vec<_> = (0..mesh.triangles.len())
            .filter(|&t| counts(t))
            .map(|t| (mesh.triangles[t], measures::area(measures::corners(mesh, t as u32))))
            .collect();
        let lengths = measures::edge_lengths(mesh, topology);
        let belongs = |e: usize| {
            let h = topology.edges()[e];
            let twin = topology.twin(h);
            counts(h as usize / 3) || (twin != crate::engine::mesh::topology::NONE && counts(twin as usize / 3))
        };
        let edges: Vec<_> = (0..lengths.len())
            .filter(|&e| belongs(e))
            .map(|e| (topology.edge_vertices(e as u32), lengths[e]))
            .collect();
        let area = triangles.iter().map(|(_, a)| a).sum();
        let length = edges.iter().map(|(_, l)| l).sum();
        Self { triangles, edges, area, length }
    }

    /// Area in space.
    #[must_use]
    pub const fn area(&self) -> f64 {
        self.area
    }

    /// How many triangles count.
    #[must_use]
    pub const fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// How many edges count.
    #[must_use]
    pub const fn edge_count(&self) -> usize {
        self.edges.len()
    }

    /// Summed edge length in space.
    #[must_use]
    pub const fn length(&self) -> f64 {
        self.length
    }

    /// Changes of area, triangle by triangle.
    #[must_use]
    pub fn area_change(&self, flat: &[DVec2], thresholds: Thresholds) -> Change {
        let pairs = self.triangles.iter().map(|(corners, area)| (*area, flat_area(*corners, flat)));
        Change::of(pairs, thresholds.area_mm2)
    }

    /// Changes of length, edge by edge.
    #[must_use]
    pub fn shape_change(&self, flat: &[DVec2], thresholds: Thresholds) -> Change {
        let pairs = self.edges.iter().map(|(ends, length)| (*length, flat_length(*ends, flat)));
        Change::of(pairs, thresholds.length_mm)
    }

    /// (4.9) in percent of a whole flattening: what a seed search minimises.
    #[must_use]
    pub fn area_change_percent(&self, flat: &[DVec2]) -> f64 {
        let mut sums = [0.0; LANES];
        let (blocks, rest) = self.triangles.as_chunks::<LANES>();
        for block in blocks.iter().map(<[_; LANES]>::as_slice).chain([rest]) {
            for (sum, (corners, area)) in sums.iter_mut().zip(block) {
                *sum += (area - flat_area(*corners, flat)).abs();
            }
        }
        let sum = total(sums);
        100.0 * ratio(sum, self.area)
    }

    /// (4.10) in percent of a whole flattening.
    #[must_use]
    pub fn shape_change_percent(&self, flat: &[DVec2]) -> f64 {
        let mut sums = [0.0; LANES];
        let (blocks, rest) = self.edges.as_chunks::<LANES>();
        for block in blocks {
            // The squares first: then the roots are taken two at a time.
            let squares = block.each_ref().map(|(ends, _)| flat_length_squared(*ends, flat));
            for ((sum, (_, length)), square) in sums.iter_mut().zip(block).zip(squares) {
                *sum += (length - square.sqrt()).abs();
            }
        }
        for (sum, (ends, length)) in sums.iter_mut().zip(rest) {
            *sum += (length - flat_length(*ends, flat)).abs();
        }
        let sum = total(sums);
        100.0 * ratio(sum, self.length)
    }
}

/// Area of a triangle in the plane, mm^2: the very term that the sums above are made of.
#[inline]
pub(in crate::engine) fn flat_area(corners: [u32; 3], flat: &[DVec2]) -> f64 {
    let [a, b, c] = corners.map(|v| flat[v as usize]);
    0.5 * (b - a).perp_dot(c - a).abs()
}

/// Length of an edge in the plane, mm: likewise.
#[inline]
pub(in crate::engine) fn flat_length(ends: [u32; 2], flat: &[DVec2]) -> f64 {
    flat_length_squared(ends, flat).sqrt()
}

#[inline]
fn flat_length_squared(ends: [u32; 2], flat: &[DVec2]) -> f64 {
    flat[ends[0] as usize].distance_squared(flat[ends[1] as usize])
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    fn plane() -> (Mesh, Topology, Vec<DVec2>) {
        let mesh = grid(5, 4, Diagonal::Regular, |u, v| DVec3::new(4.0 * u, 3.0 * v, 0.0));
        let topology = Topology::new(&mesh).unwrap();
        let flat = mesh.positions.iter().map(|p| p.truncate()).collect();
        (mesh, topology, flat)
    }

    #[test]
    fn a_scaled_copy_changes_by_the_scale() {
        let (mesh, topology, flat) = plane();
        let original = Original::new(&mesh, &topology, None);
        let half: Vec<DVec2> = flat.iter().map(|p| *p * 0.5).collect();
        let (area, shape) =
            (original.area_change(&half, Thresholds::default()), original.shape_change(&half, Thresholds::default()));
        assert!((area.relative() - 0.75).abs() < 1e-14);
        assert!((area.percent() - 75.0).abs() < 1e-12);
        assert!((area.max - 0.375).abs() < 1e-15);
        assert!((area.average - 0.375).abs() < 1e-15);
        assert!((shape.relative() - 0.5).abs() < 1e-14);
        assert!((original.area_change_percent(&half) - 75.0).abs() < 1e-12);
        assert!((original.shape_change_percent(&half) - 50.0).abs() < 1e-12);
        let double: Vec<DVec2> = flat.iter().map(|p| *p * 2.0).collect();
        assert!((original.shape_change(&double, Thresholds::default()).relative() + 1.0).abs() < 1e-14);
    }

    #[test]
    fn changes_below_the_threshold_do_not_count_in_the_average() {
        let (mesh, topology, flat) = plane();
        let original = Original::new(&mesh, &topology, None);
        let slightly: Vec<DVec2> = flat.iter().map(|p| *p * 1.05).collect();
        let change = original.shape_change(&slightly, Thresholds::default());
        assert_eq!(change.average, 0.0);
        assert!((change.max - 0.05 * 2.0_f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn a_search_and_a_report_have_the_same_change_to_the_last_bit() {
        let (mesh, topology, flat) = plane();
        let bent: Vec<DVec2> = flat.iter().map(|p| DVec2::new(p.x + 0.1 * p.y * p.y, p.y * 0.97)).collect();
        for count in 0..=mesh.triangles.len() {
            let part: Vec<bool> = (0..mesh.triangles.len()).map(|t| t < count).collect();
            let original = Original::new(&mesh, &topology, Some(&part));
            let area = original.area_change(&bent, Thresholds::default()).percent();
            let shape = original.shape_change(&bent, Thresholds::default()).percent();
            assert_eq!(area.to_bits(), original.area_change_percent(&bent).to_bits(), "{count}");
            assert_eq!(shape.to_bits(), original.shape_change_percent(&bent).to_bits(), "{count}");
        }
        // What was not reached counts for nothing, wherever it stands in the order.
        let mut partial = bent;
        partial[3] = DVec2::NAN;
        let original = Original::new(&mesh, &topology, None);
        let reached = (mesh.triangles.iter().filter(|t| !t.contains(&3))).count() as u64;
        let change = original.area_change(&partial, Thresholds::default());
        assert!(change.count == reached && change.absolute.is_finite() && change.absolute > 0.0, "{change:?}");
    }

    #[test]
    fn parts_add_up_to_the_whole() {
        let (mesh, topology, flat) = plane();
        let bent: Vec<DVec2> = flat.iter().map(|p| DVec2::new(p.x + 0.1 * p.y * p.y, p.y)).collect();
        let left: Vec<bool> = (0..mesh.triangles.len()).map(|t| t < 11).collect();
        let right: Vec<bool> = left.iter().map(|l| !l).collect();
        let percent = |part: Option<&[bool]>| {
            Original::new(&mesh, &topology, part).area_change(&bent, Thresholds::default()).absolute
        };
        assert!((percent(Some(&left)) + percent(Some(&right)) - percent(None)).abs() < 1e-13);
        // Edges on the line between them belong to both.
        let lengths = |part| Original::new(&mesh, &topology, part).length();
        assert!(lengths(Some(&left[..])) + lengths(Some(&right[..])) > lengths(None));
    }

    #[test]
    fn what_was_not_reached_counts_for_nothing_and_gives_no_nan() {
        let (mesh, topology, mut flat) = plane();
        flat.fill(DVec2::NAN);
        let original = Original::new(&mesh, &topology, None);
        let change = original.area_change(&flat, Thresholds::default());
        assert_eq!((change.count, change.relative(), change.percent()), (0, 0.0, 0.0));
    }
}
