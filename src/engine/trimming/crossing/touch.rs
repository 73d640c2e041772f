//! Whether two curves whose finest chords cross really cross, touch, or pass each other.
//!
//! Along the one curve the signed distance `g` from the other is followed through a window of a few chords. It has the same
//! sign at both ends of the window when the curves only come near each other, and between them an extremum, found by
//! parabolas through three places ever closer together: there they are apart, touch, or overlap.

use glam::DVec2;

use super::TOUCH;
use super::weld::Touch;
use crate::engine::trimming::checked::{CheckedCurve, CheckedTrims};

/// Chords on either side that the curves are followed.
const WINDOW: f64 = 4.0;

/// Parabolas; the window shrinks by [`SHRINK`] each time, so the last is a few thousandths of a chord wide and the
/// extremum in it is found to rounding.
const STEPS: usize = 6;

/// How much the window shrinks from one parabola to the next.
const SHRINK: f64 = 0.3;

/// Steps towards the foot of a perpendicular: the curves are all but parallel, so each gains several digits.
const FOOT_STEPS: usize = 6;

/// Step of the difference quotient for a tangent, as a part of the window. Its error shifts a foot by as small a part of
/// the distance to it.
const TANGENT_STEP: f64 = 1e-3;

/// What two curves do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::engine::trimming) enum Encounter {
    /// They touch here.
    Touch(Touch),
    /// They pass each other.
    Apart,
    /// They cross.
    Cross,
}

/// One of the curves with what is needed to walk on it.
struct Walk<'a> {
    trims: &'a CheckedTrims,
    curve: &'a CheckedCurve,
    size: DVec2,
    range: [f64; 2],
    window: f64,
}

impl Walk<'_> {
    fn clamp(&self, t: f64) -> f64 {
        t.clamp(self.range[0], self.range[1])
    }

    /// The point at `t` in the unit square.
    fn at(&self, t: f64) -> DVec2 {
        self.trims.on_curve(self.curve, t) / self.size
    }

    /// The tangent at `t`, not a unit vector.
    fn tangent(&self, t: f64) -> DVec2 {
        let step = self.window * TANGENT_STEP;
        let (a, b) = (self.clamp(t - step), self.clamp(t + step));
        if b > a { (self.at(b) - self.at(a)) / (b - a) } else { DVec2::ZERO }
    }

    /// The foot of the perpendicular from `p`, looked for from `t` on, and the signed distance of `p` from the curve.
    fn foot(&self, p: DVec2, t: f64) -> (f64, f64) {
        let mut foot = t;
        for _ in 0..FOOT_STEPS {
            let d = self.tangent(foot);
            let step = (p - self.at(foot)).dot(d) / d.length_squared();
            if !step.is_finite() {
                break;
            }
            foot = self.clamp(foot + step.clamp(-self.window, self.window));
        }
        let along = self.tangent(foot).try_normalize().unwrap_or(DVec2::ZERO);
        (foot, along.perp_dot(p - self.at(foot)))
    }
}

/// Looks closely at a place where the chords of two curves cross by no more than they deviate.
pub(in crate::engine::trimming) fn encounter(trims: &CheckedTrims, touch: &Touch, size: DVec2) -> Encounter {
    let [a, b] = touch.spots.map(|spot| {
        let curve = &trims.loops[spot.index].curves[spot.place as usize];
        let range = [curve.t_start.min(curve.t_end), curve.t_start.max(curve.t_end)];
        Walk { trims, curve, size, range, window: spot.reach * WINDOW }
    });
    let mut middle = a.clamp(touch.spots[0].t);
    let mut foot = b.clamp(touch.spots[1].t);
    let mut width = a.window;
    let mut side = 0.0;
    for step in 0..STEPS {
        let places = [a.clamp(middle - width), middle, a.clamp(middle + width)];
        let [low, here, high] = places.map(|t| b.foot(a.at(t), foot));
        if step == 0 {
            if low.1 * high.1 < 0.0 && low.1.abs().min(high.1.abs()) > TOUCH {
                return Encounter::Cross;
            }
            side = if low.1.abs() > high.1.abs() { low.1.signum() } else { high.1.signum() };
        }
        foot = here.0;
        // The vertex of the parabola through three places that need not be evenly spaced.
        let (x, y) = (places[0] - places[1], places[2] - places[1]);
        let (f, g) = (low.1 - here.1, high.1 - here.1);
        let vertex = 0.5 * (f * y * y - g * x * x) / (f * y - g * x);
        let best = if vertex.is_finite() { vertex } else { 0.0 };
        middle = a.clamp(middle + best.clamp(-width, width));
        width *= SHRINK;
    }
    let (foot, distance) = b.foot(a.at(middle), foot);
    let distance = distance * side;
    if distance > TOUCH {
        Encounter::Apart
    } else if distance < -TOUCH {
        Encounter::Cross
    } else {
        let uv = (a.at(middle) + b.at(foot)) * 0.5 * size;
        let mut touch = Touch { uv, ..*touch };
        (touch.spots[0].t, touch.spots[1].t) = (middle, foot);
        Encounter::Touch(touch)
    }
}
