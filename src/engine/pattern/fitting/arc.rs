//! Circular arcs and pairs of them: from tangents, through samples, and how far they are from samples.
//!
//! An arc is its ends and the tangent of a quarter of its sweep, its bulge. With the chord from `-a` to `a` on the x axis of a frame
//! its centre is `(0, m)`, `m = a (1 - bulge^2) / (2 bulge)`, and its circle `x^2 + y^2 - 2 m y = a^2`.

use glam::DVec2;

use super::{LEAST_MEASURED, distance_to_segment};
use crate::engine::pattern::Segment;

/// Below this bulge an arc is its chord: it turns by less than a millionth of a radian.
pub(super) const FLAT: f64 = 1e-7;

/// No arc sweeps more than nearly a full turn: its ends would not say where its centre is.
const MOST_BULGE: f64 = 10.0;

/// An arc between two points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arc {
    pub(super) from: DVec2,
    pub(super) to: DVec2,
    pub(super) bulge: f64,
}

impl Arc {
    /// A line or an arc as an arc; a cubic's chord.
    pub(super) const fn of(from: DVec2, segment: Segment) -> Self {
        let bulge = if let Segment::Arc { bulge, .. } = segment { bulge } else { 0.0 };
        Self { from, to: segment.to(), bulge }
    }

    /// The arc that leaves a point in a unit direction and goes to another one. `None` for nearly a full turn.
    pub(super) fn leaving(from: DVec2, direction: DVec2, to: DVec2) -> Option<Self> {
        let chord = to - from;
        let bulge = direction.perp_dot(chord) / (chord.length() + direction.dot(chord));
        (bulge.abs() <= MOST_BULGE).then_some(Self { from, to, bulge })
    }

    /// The arc that comes to a point in a unit direction.
    fn arriving(from: DVec2, to: DVec2, direction: DVec2) -> Option<Self> {
        let chord = to - from;
        let bulge = chord.perp_dot(direction) / (chord.length() + direction.dot(chord));
        (bulge.abs() <= MOST_BULGE).then_some(Self { from, to, bulge })
    }

    /// The arc between two points that is nearest to others, in the mean of squares of what their distances from the circle amount
    /// to times the diameter.
    pub(super) fn through(from: DVec2, to: DVec2, others: impl Iterator<Item = DVec2>) -> Option<Self> {
        let half = 0.5 * (to - from);
        let (middle, a) = (0.5 * (from + to), half.length());
        let along = half / a;
        let (mut mixed, mut squares, mut heights, mut side) = (0.0, 0.0, 0.0, 0.0);
        for q in others {
            let d = q - middle;
            let (square, y) = (d.length_squared() - a * a, along.perp_dot(d));
            mixed += y * square;
            squares += square * square;
            heights += y * y;
            side += y;
        }
        // The ratio a / m: of the least squares in 1 / m where m is large, so that a line is no exception, else of those in m.
        let (over, under) = if squares > 4.0 * a * a * heights {
            (2.0 * a * mixed, squares)
        } else {
            ((2.0 * a * heights).copysign(mixed), mixed.abs())
        };
        // 2 b / (1 - b^2) is that ratio; of the two arcs of the circle the others tell which: one that turns left lies to the right.
        let small = over / (under + under.hypot(over));
        let bulge = if small == 0.0 || (small > 0.0) == (side < 0.0) { small } else { -1.0 / small };
        (bulge.abs() <= MOST_BULGE).then_some(Self { from, to, bulge })
    }

    /// Its unit direction at its end.
    pub(super) fn end_direction(&self) -> DVec2 {
        (self.to - self.from).normalize_or(DVec2::X).rotate(self.half_turn())
    }

    /// A turn by half its sweep.
    fn half_turn(&self) -> DVec2 {
        let b = self.bulge;
        DVec2::new(1.0 - b * b, 2.0 * b) / (1.0 + b * b)
    }

    /// It as a segment; a line where it hardly bulges.
    pub(super) fn segment(&self) -> Segment {
        let Self { to, bulge, .. } = *self;
        if bulge.abs() <= FLAT { Segment::Line { to } } else { Segment::Arc { to, bulge } }
    }

    /// Its greatest distance from the samples `inner` and from the polyline `before`, `inner`, `after`, on which it begins and ends;
    /// `None` when that is more than `limit`. `fine` points are measured between two samples.
    pub(super) fn deviation(
        &self,
        before: DVec2,
        inner: &[DVec2],
        after: DVec2,
        limit: f64,
        fine: usize,
    ) -> Option<f64> {
        let mut worst = 0.0_f64;
        let fine = fine.max(LEAST_MEASURED / (inner.len() + 1));
        if self.bulge.abs() <= FLAT {
            // Between two samples within the limit of a line the polyline is so too, and it passes all of the line.
            for &q in inner {
                worst = worst.max(distance_to_segment(q, self.from, self.to));
                if worst.is_nan() || worst > limit {
                    return None;
                }
            }
            return Some(worst);
        }
        let half = 0.5 * (self.to - self.from);
        let (middle, a) = (0.5 * (self.from + self.to), half.length());
        let along = half / a;
        let m = a * (1.0 - self.bulge * self.bulge) / (2.0 * self.bulge);
        let centre = middle + along.perp() * m;
        let radius = a * (1.0 + self.bulge * self.bulge) / (2.0 * self.bulge.abs());
        let sign = self.bulge.signum();
        // The angle that the samples have turned about the centre, where the ends do not tell how often and which way.
        let wide = self.bulge.abs() > 0.5;
        let mut turned = 0.0;
        let mut last = (before, (self.from - centre) / radius);
        let ends = [(after, (self.to - centre) / radius)];
        let samples = inner.iter().map(|&q| (q, (q - centre).normalize_or(DVec2::X)));
        for (k, (q, out)) in samples.chain(ends).enumerate() {
            if k < inner.len() {
                let d = q - middle;
                let (x, y) = (along.dot(d), along.perp_dot(d));
                let off = (x * x + y * y - 2.0 * m * y - a * a) / (x.hypot(y - m) + radius);
                worst = worst.max(off.abs());
                if !wide && (sign * y > limit || x.abs() > a + limit) {
                    return None;
                }
            }
            if wide {
                turned += sign * last.1.perp_dot(out).atan2(last.1.dot(out));
            }
            for n in 1..=fine {
                let x = n as f64 / (fine + 1) as f64;
                let p = centre + last.1.lerp(out, x).normalize_or(out) * radius;
                worst = worst.max(distance_to_segment(p, last.0, q));
            }
            if worst.is_nan() || worst > limit {
                return None;
            }
            last = (q, out);
        }
        let sweep = 4.0 * self.bulge.abs().atan();
        (!wide || (turned - sweep).abs() < 1.0).then_some(worst)
    }
}

/// Two arcs that leave a point in one unit direction, come to another in a second one, and are tangent where they
/// meet: of all of these the ones with tangents of equal lengths.
pub(super) fn biarc(from: DVec2, direction: DVec2, to: DVec2, arriving: DVec2) -> Option<[Arc; 2]> {
    let v = to - from;
    let (square, along, apart) = (v.length_squared(), v.dot(direction + arriving), 1.0 - direction.dot(arriving));
    let d = square / (along + (along * along + 2.0 * apart * square).sqrt());
    if !(d.is_finite() && d > 0.0) {
        return None;
    }
    let joint = 0.5 * (from + to + d * (direction - arriving));
    Some([Arc::leaving(from, direction, joint)?, Arc::arriving(joint, to, arriving)?])
}
