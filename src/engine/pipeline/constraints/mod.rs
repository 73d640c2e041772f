//! Pins and kept lengths of a job: found on the mesh, given to the pieces that they belong to, and measured at the end.
//!
//! A pin belongs to the piece that holds its point. Its target is a place of the pattern, which may show the flattening
//! mirrored; the flattening is solved for the mirrored targets, about their middle, so that a target far from the origin
//! costs no digits. One pin moves its piece and leaves it turned as the placement says; several say both.
//!
//! Where a piece lies flat without strain, or its pins lie as they are to lie anyhow, it is moved as a whole.

mod lengths;
mod places;
#[cfg(test)]
mod tests;

use std::cell::OnceCell;

use glam::{DVec2, DVec3};

use self::places::{Located, Near, OFF, OnSurface, SAME, chord, in_space};
use super::centred::Home;
use super::meshed::Meshed;
use crate::engine::budget::Observer;
use crate::engine::distortion::PinReport;
use crate::engine::error::{EngineError, Place};
use crate::engine::flattening::isometric::{Kept, KeptCurve, Pin};
use crate::engine::flattening::rigid::Rigid;
use crate::engine::flattening::{FlatteningError, FlatteningMethod, KeepCurve, PinAt, PinPlace};
use crate::engine::job::JobOptions;
use crate::engine::mesh::{Mesh, Piece, Topology};
use crate::engine::pattern::{Hold, Locator, Motion, Transform, mirrored};
use crate::engine::trimming::Side;

/// Gap between a rigidly laid developable piece and a target, as a part of the diagonal, that is left as it is: it is
/// beneath what a surface needs to count as developable, and closing it would strain what has no strain.
const RIGID_GAP: f64 = 1e-6;

/// A pin on the mesh.
#[derive(Debug, Clone, Copy)]
struct Found {
    triangle: u32,
    weights: [f64; 3],
    to: DVec2,
    /// In the domain, where there is one.
    uv: Option<DVec2>,
}

/// A kept length in the numbers of the whole mesh.
#[derive(Debug, Clone, Copy)]
enum Length {
    Borders(f64),
    /// A border of the topology.
    Border(u32, f64),
    /// The borders piece by piece, in each the outline first.
    Drawn(u32, f64),
}

/// What a job asks of the map beside its least distortion.
#[derive(Debug, Clone, Default)]
pub(super) struct Constraints {
    pins: Vec<Found>,
    lengths: Vec<Length>,
    mirrored: bool,
    /// Of the part.
    diagonal: f64,
    /// For each piece of the whole how many borders the pieces before it have; counted when first asked for.
    borders_before: OnceCell<Vec<usize>>,
}

/// The pins of one piece, in its own numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct PiecePins {
    /// Which of the job's they are.
    numbers: Vec<u32>,
    pins: Vec<Pin>,
    mirrored: bool,
    diagonal: f64,
}

impl Constraints {
    /// Those of a job on a trimmed surface.
    ///
    /// # Errors
    /// [`FlatteningError::PinOffSurface`], [`FlatteningError::PinsContradict`], [`EngineError::Parameter`] for a boundary
    /// that there is not or that is none of the mesh's, [`EngineError::Cancelled`].
    pub(super) fn of_surface(
        meshed: &Meshed,
        locator: &Locator,
        (options, side, home): (&JobOptions, Side, Home),
        observer: &dyn Observer,
    ) -> Result<Self, EngineError> {
        let mut found = Self::begin(options, side, &meshed.lifted.mesh)?;
        if options.flattening.method() != FlatteningMethod::Isometric {
            return Ok(found);
        }
        let slack = 2.0 * found.diagonal * OFF.max(chord(options, found.diagonal));
        let surface = OnSurface { surface: meshed.surface, lifted: &meshed.lifted, locator, slack };
        let asked = options.flattening.pins();
        let near = Near::new(&meshed.lifted.mesh, asked.iter().any(|pin| matches!(pin.at, PinPlace::Xyz(_))));
        for (number, pin) in asked.iter().enumerate() {
            observer.check()?;
            let (place, at) = match pin.at {
                PinPlace::Uv(uv) => (Place { uv: Some(uv), ..Place::default() }, surface.at_uv(DVec2::from(uv))),
                PinPlace::Xyz(xyz) => {
                    let xyz = DVec3::from(xyz) - home.offset;
                    let place = Place { xyz_mm: Some(xyz.to_array()), ..Place::default() };
                    (place, surface.at_xyz(xyz, &near))
                }
            };
            found.add(number, pin.to_mm, at, place)?;
        }
        found.agree(&meshed.lifted.mesh)?;
        found.lengths = lengths::of_surface(meshed, options)?;
        Ok(found)
    }

    /// Those of a job on a mesh.
    ///
    /// # Errors
    /// As [`Self::of_surface`]; [`EngineError::Parameter`] also for a pin in (u, v), which a mesh has not.
    pub(super) fn of_mesh(
        (mesh, topology): (&Mesh, &Topology),
        (options, side, home): (&JobOptions, Side, Home),
        observer: &dyn Observer,
    ) -> Result<Self, EngineError> {
        let mut found = Self::begin(options, side, mesh)?;
        if options.flattening.method() != FlatteningMethod::Isometric {
            return Ok(found);
        }
        let near = Near::new(mesh, !options.flattening.pins().is_empty());
        for (number, pin) in options.flattening.pins().iter().enumerate() {
            observer.check()?;
            let PinPlace::Xyz(xyz) = pin.at else {
                return Err(EngineError::Parameter {
                    name: format!("flattening.pins.{number}.at"),
                    detail: "a mesh has no (u, v): name the point by { \"xyz\": [x, y, z] }".into(),
                });
            };
            let xyz = DVec3::from(xyz) - home.offset;
            let place = Place { xyz_mm: Some(xyz.to_array()), ..Place::default() };
            let at = near.nearest(xyz).ok_or(None).and_then(|(triangle, weights, away)| {
                if away <= 2.0 * OFF * found.diagonal { Ok((triangle, weights, None)) } else { Err(Some(away)) }
            });
            found.add(number, pin.to_mm, at, place)?;
        }
        found.agree(mesh)?;
        for keep in options.flattening.keep() {
            found.lengths.push(match keep.curve {
                KeepCurve::Borders => Length::Borders(keep.weight),
                KeepCurve::Border(border) => {
                    lengths::in_range(border, topology.border_count())?;
                    Length::Drawn(border, keep.weight)
                }
            });
        }
        Ok(found)
    }

    fn begin(options: &JobOptions, side: Side, mesh: &Mesh) -> Result<Self, EngineError> {
        let asked = &options.flattening;
        if asked.injective() && !(asked.pins().is_empty() && asked.keep().is_empty()) {
            return Err(EngineError::Parameter {
                name: "flattening.injective".into(),
                detail: "going on to a map that does not lie on itself would give up pins and kept lengths".into(),
            });
        }
        let places = || mesh.triangles.as_flattened().iter().map(|&v| mesh.positions[v as usize]);
        let (low, high) = (places().reduce(DVec3::min), places().reduce(DVec3::max));
        let diagonal = low.zip(high).map_or(0.0, |(low, high)| low.distance(high));
        Ok(Self { mirrored: mirrored(side, &options.placement), diagonal, ..Self::default() })
    }

    fn add(&mut self, number: usize, to: [f64; 2], at: Located, place: Place) -> Result<(), EngineError> {
        let (triangle, weights, uv) = at.map_err(|away_mm| FlatteningError::PinOffSurface {
            pin: number as u32,
            away_mm,
            place: Box::new(place),
        })?;
        self.pins.push(Found { triangle, weights, to: DVec2::from(to), uv });
        Ok(())
    }

    /// Whether no two pins at one place have two targets.
    fn agree(&self, mesh: &Mesh) -> Result<(), FlatteningError> {
        let places: Vec<DVec3> = self.pins.iter().map(|pin| in_space(mesh, pin.triangle, pin.weights)).collect();
        let same = SAME * self.diagonal;
        for (b, pin) in self.pins.iter().enumerate() {
            for (a, other) in self.pins[..b].iter().enumerate() {
                if places[a].distance(places[b]) <= same && pin.to.distance(other.to) > same {
                    let place = Place { xyz_mm: Some(places[a].to_array()), ..Place::default() };
                    let pins = [a as u32, b as u32];
                    return Err(FlatteningError::PinsContradict { pins, place: Box::new(place) });
                }
            }
        }
        Ok(())
    }

    /// Whether a piece has pins.
    pub(super) fn pin(&self, piece: &Piece) -> bool {
        self.pins.iter().any(|pin| piece.triangle_of.binary_search(&pin.triangle).is_ok())
    }

    /// The pins of a piece.
    pub(super) fn pins(&self, piece: &Piece) -> PiecePins {
        let mut own = PiecePins { mirrored: self.mirrored, diagonal: self.diagonal, ..PiecePins::default() };
        for (number, pin) in self.pins.iter().enumerate() {
            if let Ok(triangle) = piece.triangle_of.binary_search(&pin.triangle) {
                own.numbers.push(number as u32);
                own.pins.push(Pin { triangle: triangle as u32, weights: pin.weights, to: pin.to });
            }
        }
        own
    }

    /// Whether a kept length is told by the order in which the pattern draws the borders of a piece.
    pub(super) fn asks_for_outline(&self, topology: &Topology) -> bool {
        topology.border_count() > 1 && self.lengths.iter().any(|length| matches!(length, Length::Drawn(..)))
    }

    /// The kept lengths of a piece, in the numbers of its own topology. `outline` is the border that is drawn first.
    pub(super) fn lengths(
        &self,
        (number, piece): (usize, &Piece),
        (whole, own): (&Topology, &Topology),
        outline: usize,
    ) -> Vec<Kept> {
        let mut kept = Vec::new();
        for length in &self.lengths {
            let (curve, weight) = match *length {
                Length::Borders(weight) => (Some(KeptCurve::Borders), weight),
                Length::Border(border, weight) => (lengths::border_in(piece, whole, own, border as usize), weight),
                Length::Drawn(border, weight) => {
                    let before = self.borders_before.get_or_init(|| lengths::borders_before(whole))[number];
                    let index = (border as usize).checked_sub(before).filter(|&k| k < own.border_count());
                    let drawn = index.map(|k| match k {
                        0 => outline,
                        k if k <= outline => k - 1,
                        k => k,
                    });
                    (drawn.map(|k| KeptCurve::Border(k as u32)), weight)
                }
            };
            kept.extend(curve.map(|curve| Kept { curve, weight }));
        }
        kept
    }

    /// Holds the pieces of a flattening that has no strain by their pins. `None` when that leaves a gap somewhere.
    pub(super) fn hold_exactly(&self, topology: &Topology, place: impl Fn(DVec2) -> DVec2) -> Option<Vec<Hold>> {
        let pieces = topology.piece_count();
        let mut holds = vec![Hold::Free; pieces];
        for (piece, hold) in holds.iter_mut().enumerate() {
            let own = || self.pins.iter().filter(|pin| topology.piece_of()[pin.triangle as usize] as usize == piece);
            let from: Option<Vec<DVec2>> = own().map(|pin| pin.uv.map(&place)).collect();
            let to: Vec<DVec2> = own().map(|pin| pin.to).collect();
            *hold = held(self.mirrored, &from?, &to, RIGID_GAP * self.diagonal)?;
        }
        Some(holds)
    }

    /// What the report says of the pins: `place` is where a point of the domain lies flat, where that is exact.
    pub(super) fn report(
        &self,
        options: &JobOptions,
        topology: &Topology,
        (flat, exact): (&[DVec2], Option<&dyn Fn(DVec2) -> DVec2>),
        transform: &Transform,
    ) -> Vec<PinReport> {
        let report = |(asked, pin): (&PinAt, &Found)| {
            let piece =
                if transform.motions.len() > 1 { topology.piece_of()[pin.triangle as usize] as usize } else { 0 };
            let lies = exact.zip(pin.uv).map_or_else(
                || {
                    let corners = topology.triangles()[pin.triangle as usize];
                    corners.iter().zip(pin.weights).map(|(&v, w)| flat[v as usize] * w).sum()
                },
                |(map, uv)| map(uv),
            );
            PinReport { at: asked.at, to_mm: asked.to_mm, residual_mm: transform.point(lies, piece).distance(pin.to) }
        };
        options.flattening.pins().iter().zip(&self.pins).map(report).collect()
    }
}

impl PiecePins {
    /// The pins that the solver must meet, about their middle; none where one pin moves the piece.
    pub(super) fn to_solve(&self) -> Vec<Pin> {
        if self.is_one() {
            return Vec::new();
        }
        let middle = self.middle();
        self.pins.iter().map(|pin| Pin { to: Transform::seen(self.mirrored, pin.to - middle), ..*pin }).collect()
    }

    /// What holds a piece that was solved for [`Self::to_solve`].
    pub(super) fn solved(&self, mesh: &Mesh, flat: &[DVec2]) -> Hold {
        match self.pins.first() {
            None => Hold::Free,
            Some(pin) if self.is_one() => Hold::Point { flat: in_plane(mesh, flat, pin), to: pin.to },
            Some(_) => Hold::Motion(Motion { rotation: DVec2::X, origin: self.middle() }),
        }
    }

    /// What holds a piece without strain. `None` when that leaves a gap.
    pub(super) fn hold_exactly(&self, mesh: &Mesh, flat: &[DVec2]) -> Option<Hold> {
        let from: Vec<DVec2> = self.pins.iter().map(|pin| in_plane(mesh, flat, pin)).collect();
        let to: Vec<DVec2> = self.pins.iter().map(|pin| pin.to).collect();
        held(self.mirrored, &from, &to, RIGID_GAP * self.diagonal)
    }

    /// An error of the piece with the job's own pin and its place.
    pub(super) fn whole(&self, mesh: &Mesh, error: EngineError) -> EngineError {
        match error {
            EngineError::Flattening(FlatteningError::PinsNotMet { pin, residual_mm, .. }) => {
                let own = self.pins.get(pin as usize);
                let xyz_mm = own.map(|own| in_space(mesh, own.triangle, own.weights).to_array());
                let xy_mm = own.map(|own| own.to.to_array());
                let place = Box::new(Place { xyz_mm, xy_mm, ..Place::default() });
                let pin = self.numbers.get(pin as usize).copied().unwrap_or(pin);
                FlatteningError::PinsNotMet { pin, residual_mm, place }.into()
            }
            other => other,
        }
    }

    /// Whether all pins are one: at one place, with one target.
    fn is_one(&self) -> bool {
        let [first, rest @ ..] = self.pins.as_slice() else { return true };
        rest.iter().all(|pin| Pin { to: first.to, ..*pin } == *first && pin.to == first.to)
    }

    fn middle(&self) -> DVec2 {
        self.pins.iter().map(|pin| pin.to).sum::<DVec2>() / self.pins.len().max(1) as f64
    }
}

/// What holds points of a flattening without strain at their targets; `None` when more than `gap` is left.
fn held(mirrored: bool, from: &[DVec2], to: &[DVec2], gap: f64) -> Option<Hold> {
    let ([first, others @ ..], Some(&target)) = (from, to.first()) else { return Some(Hold::Free) };
    if others.iter().all(|p| p.distance(*first) <= gap) && to.iter().all(|p| p.distance(target) <= gap) {
        return Some(Hold::Point { flat: *first, to: target });
    }
    let seen: Vec<DVec2> = from.iter().map(|&p| Transform::seen(mirrored, p)).collect();
    let motion = Rigid::fit(&seen, to);
    let held = Hold::Motion(Motion { rotation: motion.rotation, origin: motion.shift });
    (motion.residual <= gap).then_some(held)
}

fn in_plane(mesh: &Mesh, flat: &[DVec2], pin: &Pin) -> DVec2 {
    mesh.triangles[pin.triangle as usize].iter().zip(pin.weights).map(|(&v, w)| flat[v as usize] * w).sum()
}
