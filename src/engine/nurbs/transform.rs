//! Moved, scaled and transposed surfaces, the box of the control net, and degenerate edges.

use glam::DVec3;

use super::{KnotVector, Surface};

impl Surface {
    /// The surface moved by `offset`.
    #[must_use]
    pub fn translated(&self, offset: DVec3) -> Self {
        self.with_control(self.control().iter().map(|&p| p + offset).collect())
    }

    /// The surface scaled by `factor` about the origin.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        self.with_control(self.control().iter().map(|&p| p * factor).collect())
    }

    /// The surface with u and v exchanged: its normal points the other way.
    #[must_use]
    pub fn swapped(&self) -> Self {
        let nv = self.knots_v().control_count();
        Self::from_parts(
            self.knots_v().clone(),
            self.knots_u().clone(),
            transposed(self.control(), nv),
            self.weights().map(|w| transposed(w, nv)),
        )
    }

    /// Least and greatest corner of the box around the control net, which holds the surface.
    ///
    /// For a knot vector that is not clamped the box can be larger than the surface by a good deal.
    #[must_use]
    pub fn bounding_box(&self) -> [DVec3; 2] {
        self.control().iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
    }

    /// Which edges of the domain are one point in space (poles) within `tolerance`: `[u first, u last, v first, v last]`,
    /// where "u first" is the edge on which u is least.
    #[must_use]
    pub fn degenerate_edges(&self, tolerance: f64) -> [bool; 4] {
        let domain = self.domain();
        let along_v = |u: f64| is_point(|t| self.point(u, t), self.knots_v(), tolerance);
        let along_u = |v: f64| is_point(|t| self.point(t, v), self.knots_u(), tolerance);
        [along_v(domain.u[0]), along_v(domain.u[1]), along_u(domain.v[0]), along_u(domain.v[1])]
    }

    /// The same surface with other control points.
    fn with_control(&self, control: Vec<DVec3>) -> Self {
        Self::from_parts(self.knots_u().clone(), self.knots_v().clone(), control, self.weights().map(<[f64]>::to_vec))
    }
}

/// A net of `columns` columns transposed.
fn transposed<T: Copy>(net: &[T], columns: usize) -> Vec<T> {
    (0..columns).flat_map(|j| net.iter().skip(j).step_by(columns).copied()).collect()
}

/// Whether a curve over `knots` stays at one point: every span is sampled more often than it could come back there.
fn is_point(at: impl Fn(f64) -> DVec3, knots: &KnotVector, tolerance: f64) -> bool {
    let start = at(knots.domain()[0]);
    let samples = 2 * knots.degree() + 1;
    knots.breaks().windows(2).all(|span| {
        (1..=samples).all(|k| {
            let t = span[0] + (span[1] - span[0]) * (k as f64 / samples as f64);
            at(t).distance(start) <= tolerance
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::nurbs::shapes::{cylinder, plane, sphere};

    #[test]
    fn only_the_poles_of_a_sphere_are_degenerate_edges() {
        assert_eq!(sphere(2.0).degenerate_edges(1e-9), [false, false, true, true]);
        assert_eq!(sphere(2.0).swapped().degenerate_edges(1e-9), [true, true, false, false]);
        assert_eq!(cylinder(2.0, 3.0).degenerate_edges(1e-9), [false; 4]);
        assert_eq!(plane(1.0, 1.0).degenerate_edges(1e-9), [false; 4]);
    }

    #[test]
    fn a_closed_edge_is_not_taken_for_a_point() {
        // The circle comes back to its start at the end of every fourth span.
        assert!(!cylinder(2.0, 3.0).degenerate_edges(1e-9)[2]);
    }

    #[test]
    fn moving_and_scaling_do_what_they_say() {
        let s = sphere(2.0);
        let p = s.point(0.7, 0.9);
        assert!(
            s.translated(DVec3::new(1.0, 2.0, 3.0)).point(0.7, 0.9).distance(p + DVec3::new(1.0, 2.0, 3.0)) < 1e-12
        );
        assert!(s.scaled(3.0).point(0.7, 0.9).distance(p * 3.0) < 1e-12);
        assert!((s.swapped().normal(0.9, 0.7) + s.normal(0.7, 0.9)).length() < 1e-12);
        let [low, high] = s.bounding_box();
        assert!(low.distance(DVec3::splat(-2.0)) < 1e-12 && high.distance(DVec3::splat(2.0)) < 1e-12);
    }
}
