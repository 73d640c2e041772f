//! What each patch of the domain asks of the grid's steps: `k (a du^2 + 2 b du dv + c dv^2) <= 1`.
//!
//! - *Chord*: over a triangle of sides du, dv the mesh leaves the surface by at most
//!   `(du^2 |Suu| + 2 du dv |Suv| + dv^2 |Svv|) / 8` [Filip, Magedson, Markot 1986]. Only components along the normal
//!   count, since distance is measured to the nearest point. With `a = |n.Suu| / (8 tol)` and so on the bound is the
//!   constraint above with k = 1. For a surface that is quadratic over the triangle the greatest distance is known
//!   exactly ([`quadratic_distance`]); k brings the bound down to it at the cell that is best for the patch alone.
//!   On a saddle, where the two curvatures work against each other, that is up to half.
//! - *Twist*: a ruled, twisted patch keeps any chord by division of one direction alone, but the normals of its long
//!   triangles then stay wrong however many there are, and so does their area (Schwarz's lantern). So a step along v may
//!   turn the normal about Sv by no more than an angle that shrinks with the tolerance, `dv^2 (n.Suv)^2 / |Su|^2 <=
//!   angle^2`, and a step along u likewise ([`twist_need`]). Surfaces without twist do not notice.
//! - *Edge*: the square of a cell's longest edge is `du^2 Su.Su + 2 du dv |Su.Sv| + dv^2 Sv.Sv`, which must stay below
//!   `edge^2`: the same form.
//!
//! A border of the part that runs along a line of constant u or v has no points of its own: its chords are the cells'
//! sides, which leave the border sideways as well. There the whole of `Suu` or `Svv` across the line counts.
//!
//! Samples stand in the middle of patches (see [`super::axis`]); values between them are the check's business.

use glam::DVec3;

use super::axis::Axis;
use super::coverage::Cover;
use crate::engine::nurbs::{Surface, SurfaceDerivatives};

/// Below this share of |Su| |Sv| the normal is not known and whole vectors are taken instead of their normal parts:
/// near a pole that asks for more, never for less.
const NORMAL_SHARE: f64 = 1e-12;

/// What is kept small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Aim {
    /// Distance between mesh and surface, mm.
    Chord(f64),
    /// Length of edges, mm.
    Edge(f64),
}

/// The need of one patch. All three of `a`, `b`, `c` are non-negative.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Need {
    /// Of du^2.
    pub a: f64,
    /// Of du dv.
    pub b: f64,
    /// Of dv^2.
    pub c: f64,
    /// The factor of the whole form, in (0, 1].
    pub k: f64,
    /// Signs of the curvatures along v and of the twist against that along u: `a`, `signs[1] b`, `signs[0] c`.
    pub signs: [f64; 2],
    /// Of du^2 alone, where a border of the part runs along u.
    pub border_a: f64,
    /// Of dv^2 alone, where one runs along v.
    pub border_c: f64,
    /// Of du^2 alone, for the turning of the normal by twist. No part of the distance.
    pub twist_a: f64,
    /// Of dv^2 alone, likewise.
    pub twist_c: f64,
}

impl Need {
    /// What du^2 alone must meet beside the form.
    pub(super) fn alone_a(&self) -> f64 {
        self.border_a.max(self.twist_a)
    }

    /// What dv^2 alone must meet beside the form.
    pub(super) fn alone_c(&self) -> f64 {
        self.border_c.max(self.twist_c)
    }

    /// What the steps use up of the allowance if the surface is quadratic over them: at most 1 is good.
    pub(super) fn used(&self, du: f64, dv: f64, diagonals: Diagonals) -> f64 {
        let p = self.a * du * du;
        let q = self.signs[1] * self.b * du * dv;
        let r = self.signs[0] * self.c * dv * dv;
        let inner = match diagonals {
            Diagonals::Rising => quadratic_distance(p, q, r),
            Diagonals::Falling => quadratic_distance(p, -q, r),
            Diagonals::Both => quadratic_distance(p, q, r).max(quadratic_distance(p, -q, r)),
        };
        inner.max(self.border_a * du * du).max(self.border_c * dv * dv)
    }
}

/// Which diagonals the cells will have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Diagonals {
    /// All from (i, j) to (i + 1, j + 1).
    Rising,
    /// All from (i + 1, j) to (i, j + 1).
    Falling,
    /// Both occur.
    Both,
}

/// Needs of all patches, `v` fastest: patch (i, j) stands at `patches[i * along.len() + j]`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Needs {
    /// Strips along u.
    pub u: Axis,
    /// Strips along v.
    pub v: Axis,
    /// The needs.
    pub patches: Vec<Need>,
    /// Patches that the part touches.
    pub covered: Vec<Cover>,
    /// Kinks of `u` that must be lines.
    pub breaks_u: Vec<f64>,
    /// Kinks of `v` that must be lines.
    pub breaks_v: Vec<f64>,
    /// Mean |Su| and |Sv|: what a parameter is worth in millimetres.
    pub speeds: [f64; 2],
}

/// Eight times the greatest distance of a triangle to the quadratic surface with fundamental values `p = n.Suu du^2`,
/// `q = n.Suv du dv`, `r = n.Svv dv^2` over it, for the cell's rising diagonal (the falling one: `-q`).
///
/// On the edges the distance is greatest half-way. Where the form is definite and the triangle acute in its metric,
/// it is half the squared circumradius, `l1 l2 l3 / (16 K^2)` with squared sides l and doubled area 2K.
pub(super) fn quadratic_distance(p: f64, q: f64, r: f64) -> f64 {
    let diagonal = p + 2.0 * q + r;
    let (l1, l2, l3) = (p.abs(), r.abs(), diagonal.abs());
    let edges = l1.max(l2).max(l3);
    let determinant = p * r - q * q;
    if determinant > 0.0 && 2.0 * edges < l1 + l2 + l3 {
        // An acute triangle's circumradius is at most 2/sqrt(3) of half its longest side; the limit guards rounding.
        (l1 * l2 * l3 / determinant).clamp(edges, edges * 4.0 / 3.0)
    } else {
        edges
    }
}

fn chord_need(d: &SurfaceDerivatives, tolerance: f64, diagonals: Diagonals) -> Need {
    let scale = 1.0 / (8.0 * tolerance);
    let normal = d.su.cross(d.sv);
    let length = normal.length();
    if length <= NORMAL_SHARE * d.su.length() * d.sv.length() {
        let part = |x: DVec3| x.length() * scale;
        return Need { a: part(d.suu), b: part(d.suv), c: part(d.svv), k: 1.0, signs: [1.0; 2], ..Need::default() };
    }
    let normal = normal / length;
    let (a, b, c) = (normal.dot(d.suu) * scale, normal.dot(d.suv) * scale, normal.dot(d.svv) * scale);
    // The best cell for the patch alone gives either direction the same share: |a| du^2 = |c| dv^2 = 1.
    let twist = b / (a * c).abs().sqrt();
    let k = if twist.is_finite() {
        let distance = |q: f64| quadratic_distance(a.signum(), q, c.signum());
        let distance = match diagonals {
            Diagonals::Rising => distance(twist),
            Diagonals::Falling => distance(-twist),
            Diagonals::Both => distance(twist).max(distance(-twist)),
        };
        (distance / (2.0 + 2.0 * twist.abs())).min(1.0)
    } else {
        1.0
    };
    let signs = [(a * c).signum(), (a * b).signum()];
    Need { a: a.abs(), b: b.abs(), c: c.abs(), k, signs, ..Need::default() }
}

/// Turning of the normal by twist that one step may cause, as a multiple of what a step of full chord distance turns it by
/// on a surface of the curvature `1 / diagonal`, or of the patch's own twist where that is more. Smaller values bring the
/// area sooner to the surface's; below 0.7 they would divide patches whose cells are square already.
const TWIST_TURN: f64 = 1.4;

/// Needs of du^2 and of dv^2 that keep the turning of the normal by twist to an angle that vanishes with the tolerance.
///
/// With the twist per length `t = |n.Suv| / (|Su| |Sv|)` a step s turns the normal by `t s`. A chord of full distance turns
/// the normal of a surface of curvature k by `sqrt(8 tolerance k)`; twist may do the same.
fn twist_need(d: &SurfaceDerivatives, tolerance: f64, diagonal: f64) -> [f64; 2] {
    let normal = d.su.cross(d.sv);
    let (su, sv, length) = (d.su.length(), d.sv.length(), normal.length());
    if length <= NORMAL_SHARE * su * sv {
        return [0.0; 2];
    }
    let twist = normal.dot(d.suv).abs() / (length * su * sv);
    let angle_squared = TWIST_TURN * TWIST_TURN * 8.0 * tolerance * twist.max(1.0 / diagonal);
    // A part without size or an absurd tolerance asks for nothing here; the chord's need speaks for them.
    let need = |speed: f64| {
        let turned = twist * speed;
        let need = turned * turned / angle_squared;
        if need.is_finite() { need } else { 0.0 }
    };
    [need(su), need(sv)]
}

/// The need of a border along u, whose chords leave the curve `v = const` sideways, too.
fn border_need(first: DVec3, second: DVec3, tolerance: f64) -> f64 {
    let length = first.length_squared();
    let along = if length > 0.0 { second.dot(first) / length } else { 0.0 };
    (second - along * first).length() / (8.0 * tolerance)
}

fn edge_need(d: &SurfaceDerivatives, longest: f64, diagonals: Diagonals) -> Need {
    let scale = 1.0 / (longest * longest);
    let b = match diagonals {
        Diagonals::Rising => d.su.dot(d.sv).max(0.0),
        Diagonals::Falling => (-d.su.dot(d.sv)).max(0.0),
        Diagonals::Both => d.su.dot(d.sv).abs(),
    };
    Need { a: d.su.length_squared() * scale, b: b * scale, c: d.sv.length_squared() * scale, k: 1.0, ..Need::default() }
}

impl Needs {
    /// Samples the surface in the middle of each covered patch; `diagonal` is the part's size, mm.
    pub(super) fn sample(
        surface: &Surface,
        u: Axis,
        v: Axis,
        covered: Vec<Cover>,
        aim: Aim,
        diagonals: Diagonals,
        diagonal: f64,
    ) -> Self {
        let mut patches = vec![Need::default(); covered.len()];
        let (mut speed_u, mut speed_v, mut count) = (0.0, 0.0, 0.0_f64);
        let (columns, along) = (u.len(), v.len());
        let middles = |axis: &Axis| (0..axis.len()).map(|strip| axis.middle(strip)).collect::<Vec<f64>>();
        let mut samples = Vec::new();
        surface.grid_derivatives(&middles(&u), &middles(&v), &mut samples);
        for i in 0..columns {
            for j in 0..along {
                let cover = covered[i * along + j];
                if !cover.inside {
                    continue;
                }
                let d = &samples[j * columns + i];
                speed_u += d.su.length();
                speed_v += d.sv.length();
                count += 1.0;
                patches[i * along + j] = match aim {
                    Aim::Chord(tolerance) => {
                        let mut need = chord_need(d, tolerance, diagonals);
                        [need.twist_a, need.twist_c] = twist_need(d, tolerance, diagonal);
                        if cover.border_u {
                            need.border_a = border_need(d.su, d.suu, tolerance);
                        }
                        if cover.border_v {
                            need.border_c = border_need(d.sv, d.svv, tolerance);
                        }
                        need
                    }
                    Aim::Edge(longest) => edge_need(d, longest, diagonals),
                };
            }
        }
        let count = count.max(1.0);
        let mut needs = Self {
            u,
            v,
            patches,
            covered,
            breaks_u: Vec::new(),
            breaks_v: Vec::new(),
            speeds: [speed_u / count, speed_v / count],
        };
        if let Aim::Chord(tolerance) = aim {
            needs.breaks_u = needs.settle_kinks(surface, tolerance, true);
            needs.breaks_v = needs.settle_kinks(surface, tolerance, false);
        }
        needs
    }

    /// Tells kinks that need a line of their own from those that are better taken for curvature, and does the latter.
    ///
    /// A chord of step h over a turn of the derivative by J leaves the surface by `|n.J| h / 4`. A polyline of fine
    /// steps that stands for a smooth curve turns by so little that every other kink could be left out; such turns are
    /// spread over the strips beside them as the curvature `J / width`.
    fn settle_kinks(&mut self, surface: &Surface, tolerance: f64, along_u: bool) -> Vec<f64> {
        let (axis, other) = if along_u { (&self.u, &self.v) } else { (&self.v, &self.u) };
        let stride = self.v.len();
        let place =
            |strip: usize, across: usize| if along_u { strip * stride + across } else { across * stride + strip };
        let mut breaks = Vec::new();
        for kink in &axis.kinks {
            let after = axis.strip_of(*kink);
            let before = after.saturating_sub(1);
            let reach = axis.width(before) + axis.width(after);
            let near = axis.width(before).min(axis.width(after)) * ONE_SIDE;
            let places = other.len().min(TURN_PLACES);
            let mut seen = [0.0_f64; TURN_PLACES];
            for (k, turn) in seen.iter_mut().enumerate().take(places) {
                let across = (2 * k + 1) * other.len() / (2 * places);
                let at = |t: f64| {
                    let (u, v) = if along_u { (t, other.middle(across)) } else { (other.middle(across), t) };
                    let (_, su, sv) = surface.first_derivatives(u, v);
                    (if along_u { su } else { sv }, su.cross(sv).normalize_or_zero())
                };
                if self.covered[place(before, across)].inside || self.covered[place(after, across)].inside {
                    let (left, left_normal) = at(kink - near);
                    let (right, right_normal) = at(kink + near);
                    *turn =
                        (left_normal + right_normal).normalize_or_zero().dot(right - left).abs() / (4.0 * tolerance);
                }
            }
            let turns: Vec<f64> = (0..other.len()).map(|across| seen[across * places / other.len()]).collect();
            if turns.iter().any(|turn| turn * reach > SMOOTH_TURN) {
                breaks.push(*kink);
                continue;
            }
            for (across, turn) in turns.iter().enumerate() {
                for strip in [before, after] {
                    let patch = &mut self.patches[place(strip, across)];
                    let spread = turn / reach;
                    *(if along_u { &mut patch.a } else { &mut patch.c }) += spread;
                }
            }
        }
        breaks
    }

    /// The greatest use of the allowance if the surface is quadratic over each cell, for given densities.
    pub(super) fn used(&self, u: &[f64], v: &[f64], diagonals: Diagonals) -> f64 {
        let mut greatest = 0.0_f64;
        for (row, density) in self.patches.chunks_exact(v.len()).zip(u) {
            for (need, other) in row.iter().zip(v) {
                greatest = greatest.max(need.used(1.0 / density, 1.0 / other, diagonals));
            }
        }
        greatest
    }

    /// Multiplies what speaks of distance, as when it was found to be off by `factor`.
    pub(super) fn correct(&mut self, factor: f64) {
        for n in &mut self.patches {
            for form in [&mut n.a, &mut n.b, &mut n.c, &mut n.border_a, &mut n.border_c] {
                *form *= factor;
            }
        }
    }

    /// Multiplies all needs, as when the tolerance is divided by `factor`.
    pub(super) fn tighten(&mut self, factor: f64) {
        self.correct(factor);
        for n in &mut self.patches {
            n.twist_a *= factor;
            n.twist_c *= factor;
        }
    }
}

/// Places along a kink at which its turn is measured.
const TURN_PLACES: usize = 6;

/// How far beside a kink, in widths of the narrower strip, a derivative is taken for that of its side: small against
/// what the derivative changes over a strip, large against the rounding of parameters.
const ONE_SIDE: f64 = 1e-6;

/// Share of the tolerance up to which the turn of one kink, stepped over, counts as curvature. More would smooth over
/// edges that are meant; less would make a line of every point of a finely sampled curve.
const SMOOTH_TURN: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Greatest distance of the triangle to the quadratic, by brute force.
    fn sampled(p: f64, q: f64, r: f64) -> f64 {
        // f(x, y) = (p x^2 + 2 q x y + r y^2) / 2 over (0,0), (1,0), (1,1).
        let f = |x: f64, y: f64| 0.5 * (p * x * x + 2.0 * q * x * y + r * y * y);
        let n = 200;
        let mut greatest = 0.0_f64;
        for i in 0..=n {
            for j in 0..=i {
                let (x, y) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let plane = (x - y) * f(1.0, 0.0) + y * f(1.0, 1.0);
                greatest = greatest.max((f(x, y) - plane).abs());
            }
        }
        greatest
    }

    proptest! {
        #[test]
        fn the_distance_of_a_quadratic_is_exact(p in -2.0..2.0_f64, q in -2.0..2.0_f64, r in -2.0..2.0_f64) {
            let exact = quadratic_distance(p, q, r) / 8.0;
            let brute = sampled(p, q, r);
            prop_assert!(brute <= exact * (1.0 + 1e-12) + 1e-15);
            prop_assert!(brute >= exact * 0.995 - 1e-9, "{} {}", brute, exact);
        }

        #[test]
        fn the_bound_of_filip_is_never_below_the_distance(p in -2.0..2.0_f64, q in -2.0..2.0_f64, r in -2.0..2.0_f64) {
            prop_assert!(quadratic_distance(p, q, r) <= (p.abs() + 2.0 * q.abs() + r.abs()) * (1.0 + 1e-12));
        }
    }

    #[test]
    fn an_ellipsoidal_patch_uses_its_allowance_in_the_best_cell() {
        let d = SurfaceDerivatives {
            su: DVec3::X,
            sv: DVec3::Y,
            suu: DVec3::Z * 4.0,
            svv: DVec3::Z,
            ..SurfaceDerivatives::default()
        };
        let need = chord_need(&d, 0.125, Diagonals::Rising);
        let used = need.used(0.5 / 2.0_f64.sqrt(), 1.0 / 2.0_f64.sqrt(), Diagonals::Rising);
        assert!((used - 1.0).abs() < 1e-12);
        assert_eq!(need.k, 1.0);
        let saddle = chord_need(&SurfaceDerivatives { svv: -DVec3::Z, ..d }, 0.125, Diagonals::Rising);
        assert_eq!(saddle.k, 0.5);
    }
}
