//! A run of samples between corners, with lengths along it and the tangents at its samples.

use glam::DVec2;

/// Samples that a tangent is estimated from on one side, at the most.
const SIDE: usize = 8;

/// The samples that a tangent is estimated from stay within this part of the tolerance of a chord: more, and the curve
/// is no parabola over them; less, and noise within the tolerance turns the tangent.
const BENT: f64 = 0.5;

/// Points with the length of the polyline up to each.
#[derive(Debug)]
pub(super) struct Store {
    pub(super) points: Vec<DVec2>,
    lengths: Vec<f64>,
}

impl Store {
    pub(super) fn new(points: Vec<DVec2>) -> Self {
        let mut passed = 0.0;
        let lengths = (0..points.len())
            .map(|k| {
                passed += if k > 0 { points[k].distance(points[k - 1]) } else { 0.0 };
                passed
            })
            .collect();
        Self { points, lengths }
    }
}

/// Samples between two corners, or all of a closed curve without corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    points: &'a [DVec2],
    lengths: &'a [f64],
    /// Whether it closes on itself without a corner; its last point is then its first.
    pub(super) smooth: bool,
    /// By how much a fit may leave the samples.
    pub(super) tolerance: f64,
    /// What is asked of curves that are looked for, and measured coarsely.
    pub(super) asked: f64,
}

impl<'a> Run<'a> {
    pub(super) fn new(store: &'a Store, from: usize, to: usize, smooth: bool, tolerance: f64) -> Self {
        Self {
            points: &store.points[from..=to],
            lengths: &store.lengths[from..=to],
            smooth,
            tolerance,
            asked: tolerance,
        }
    }

    /// The same with a part of the tolerance asked of what is looked for.
    pub(super) const fn asking(self, part: f64) -> Self {
        Self { asked: part * self.tolerance, ..self }
    }

    pub(super) const fn points(&self) -> &'a [DVec2] {
        self.points
    }

    /// The index of the last sample.
    pub(super) const fn last(&self) -> usize {
        self.points.len() - 1
    }

    /// The length between two samples along the polyline.
    pub(super) fn length(&self, from: usize, to: usize) -> f64 {
        self.lengths[to] - self.lengths[from]
    }

    /// The point of the polyline at a length from sample `from` on, looked for up to sample `to`.
    pub(super) fn at_length(&self, from: usize, to: usize, length: f64) -> DVec2 {
        let target = self.lengths[from] + length;
        let k = from + self.lengths[from..=to].partition_point(|&l| l <= target);
        if k > to {
            return self.points[to];
        }
        let k = k.max(from + 1);
        let x = (target - self.lengths[k - 1]) / (self.lengths[k] - self.lengths[k - 1]);
        self.points[k - 1].lerp(self.points[k], x)
    }

    /// The sample nearest to the middle of the way between two that are not neighbours.
    pub(super) fn middle(&self, from: usize, to: usize) -> usize {
        let half = 0.5 * (self.lengths[from] + self.lengths[to]);
        let k = from + self.lengths[from..=to].partition_point(|&l| l < half);
        let k = if k > from && half - self.lengths[k - 1] < self.lengths[k] - half { k - 1 } else { k };
        k.clamp(from + 1, (to - 1).max(from + 1))
    }

    /// The sample that many steps on, round the end where the run is smooth.
    fn step(&self, k: usize, steps: usize, ahead: bool) -> Option<DVec2> {
        let last = self.last();
        let to = if ahead { k.checked_add(steps) } else { k.checked_sub(steps) };
        match to.filter(|&t| t <= last) {
            Some(to) => Some(self.points[to]),
            None if !self.smooth || steps >= last => None,
            None if ahead => Some(self.points[k + steps - last]),
            None => Some(self.points[k + last - steps]),
        }
    }

    /// The unit tangent at a sample: that of the parabola through it which fits the samples near by least squares, on
    /// both sides, or on one at an end.
    pub(super) fn tangent(&self, k: usize) -> DVec2 {
        self.tangent_of(k, [true, true])
    }

    /// The same from the samples before, after, or both.
    pub(super) fn tangent_of(&self, k: usize, sides: [bool; 2]) -> DVec2 {
        let p = self.points[k];
        // Sums of squares, cubes, fourth powers of lengths and of lengths times places.
        let (mut s2, mut s3, mut s4, mut d1, mut d2) = (0.0, 0.0, 0.0, DVec2::ZERO, DVec2::ZERO);
        let mut nearest = DVec2::ZERO;
        let windows = [false, true].map(|ahead| if sides[usize::from(ahead)] { self.window(k, ahead) } else { 0 });
        let far = |ahead: bool| self.step(k, windows[usize::from(ahead)], ahead).map_or(0.0, |q| q.distance(p));
        let scale = far(false).max(far(true)).max(f64::MIN_POSITIVE);
        for ahead in [false, true] {
            let count = windows[usize::from(ahead)];
            let sign = if ahead { 1.0 } else { -1.0 };
            let taken = count.min(SIDE);
            for n in 1..=taken {
                let Some(q) = self.step(k, (n * count) / taken, ahead) else { continue };
                let d = q - p;
                let s = sign * d.length() / scale;
                let (square, d) = (s * s, d / scale);
                if n == 1 {
                    nearest += d * sign;
                }
                (s2, s3, s4) = (s2 + square, s3 + square * s, s4 + square * square);
                (d1, d2) = (d1 + d * s, d2 + d * square);
            }
        }
        let determinant = s2 * s4 - s3 * s3;
        // With a single sample there is no parabola.
        let along = if determinant > 1e-9 * s2 * s4 { d1 * s4 - d2 * s3 } else { d1 };
        along.try_normalize().or_else(|| nearest.try_normalize()).unwrap_or(DVec2::X)
    }

    /// How many samples on one side the tangent is estimated from.
    fn window(&self, k: usize, ahead: bool) -> usize {
        let most = if self.smooth { self.last() / 2 } else { usize::MAX };
        let flat = |count: usize| {
            let Some(end) = self.step(k, count, ahead) else { return false };
            count <= most
                && [1, 2, 3].iter().all(|q| {
                    let inner = self.step(k, (q * count) / 4, ahead);
                    inner.is_some_and(|p| super::distance_to_segment(p, self.points[k], end) <= BENT * self.tolerance)
                })
        };
        if self.step(k, 1, ahead).is_none() {
            return 0;
        }
        let mut count = 1;
        while flat(2 * count) {
            count *= 2;
        }
        // Two samples say where a parabola bends, also where samples are far apart.
        if count == 1 && self.step(k, 2, ahead).is_some() && most >= 2 { 2 } else { count }
    }
}
