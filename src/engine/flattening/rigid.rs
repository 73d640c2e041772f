//! The rigid motion of the plane that brings points nearest to others: least squares, never a mirror image.
//!
//! With middles taken off, the rotation is the direction of sum conj(a) b, the points read as complex numbers.

use glam::DVec2;

/// Where the points' spread says less than this part of their size about the angle, none is taken.
const NO_SPREAD: f64 = 1e-12;

/// A rotation about the origin, then a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// Cosine and sine; (1, 0) where the points say nothing of an angle.
    pub rotation: DVec2,
    /// The shift.
    pub shift: DVec2,
    /// The greatest distance that is left.
    pub residual: f64,
}

impl Rigid {
    /// The motion that brings `from` nearest to `to`.
    #[must_use]
    pub fn fit(from: &[DVec2], to: &[DVec2]) -> Self {
        let count = from.len().min(to.len()).max(1) as f64;
        let middle = |points: &[DVec2]| points.iter().copied().sum::<DVec2>() / count;
        let (a, b) = (middle(from), middle(to));
        let pairs = || from.iter().zip(to).map(|(p, q)| (*p - a, *q - b));
        let turn: DVec2 = pairs().map(|(p, q)| DVec2::new(p.dot(q), p.perp_dot(q))).sum();
        let size: f64 = pairs().map(|(p, q)| p.length_squared() + q.length_squared()).sum();
        let rotation = if turn.length() > NO_SPREAD * size { turn.normalize() } else { DVec2::X };
        let mut fitted = Self { rotation, shift: b - rotation.rotate(a), residual: 0.0 };
        fitted.residual = from.iter().zip(to).map(|(p, q)| fitted.at(*p).distance(*q)).fold(0.0, f64::max);
        fitted
    }

    /// Where a point comes to lie.
    #[must_use]
    pub fn at(&self, p: DVec2) -> DVec2 {
        self.rotation.rotate(p) + self.shift
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const POINTS: [DVec2; 4] =
        [DVec2::new(0.0, 0.0), DVec2::new(3.0, 0.5), DVec2::new(1.0, 2.0), DVec2::new(-1.0, 0.25)];

    #[test]
    fn mirror_images_are_not_undone() {
        let mirrored = POINTS.map(|p| DVec2::new(-p.x, p.y));
        let found = Rigid::fit(&POINTS, &mirrored);
        assert!((found.rotation.length() - 1.0).abs() < 1e-15 && found.residual > 0.5, "{found:?}");
    }

    #[test]
    fn one_point_or_points_at_one_place_are_shifted_alone() {
        let (from, to) = (DVec2::new(3.0, -1.0), DVec2::new(-100.0, 7.0));
        for count in [1, 3] {
            let found = Rigid::fit(&vec![from; count], &vec![to; count]);
            assert_eq!((found.rotation, found.at(from)), (DVec2::X, to));
        }
        assert_eq!(Rigid::fit(&[], &[]), Rigid { rotation: DVec2::X, shift: DVec2::ZERO, residual: 0.0 });
    }

    proptest! {
        #[test]
        fn a_motion_is_found_again(angle in -3.1..3.1, x in -1e3..1e3, y in -1e3..1e3) {
            let (rotation, shift) = (DVec2::from_angle(angle), DVec2::new(x, y));
            let moved = POINTS.map(|p| rotation.rotate(p) + shift);
            let found = Rigid::fit(&POINTS, &moved);
            prop_assert!(found.rotation.distance(rotation) < 1e-12 && found.residual < 1e-11);
        }

        #[test]
        fn no_other_angle_is_nearer(
            places in proptest::collection::vec([-1.0..1.0, -1.0..1.0_f64], 4), angle in -3.1..3.1,
        ) {
            let to: Vec<DVec2> = places.into_iter().map(DVec2::from_array).collect();
            let found = Rigid::fit(&POINTS, &to);
            let error = |r: Rigid| POINTS.iter().zip(&to).map(|(p, q)| r.at(*p).distance_squared(*q)).sum::<f64>();
            let middle = |points: &[DVec2]| points.iter().copied().sum::<DVec2>() / 4.0;
            let rotation = DVec2::from_angle(angle);
            let other = Rigid { rotation, shift: middle(&to) - rotation.rotate(middle(&POINTS)), residual: 0.0 };
            prop_assert!(error(found) <= error(other) + 1e-12);
        }
    }
}
