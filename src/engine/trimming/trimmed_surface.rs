//! A trimmed surface as a user sends it.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::engine::nurbs::{Curve2, Surface};

/// Which side of the surface is the show side of the material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The side that `Su x Sv` points to.
    #[default]
    Normal,
    /// The other one.
    Reversed,
}

/// The shape of one trimming curve in (u, v).
#[derive(Debug, Clone, PartialEq)]
pub enum TrimShape {
    /// A NURBS curve.
    Nurbs(Curve2),
    /// A polyline through at least two points; its parameter runs from 0 to the number of segments.
    Polyline(Vec<DVec2>),
}

/// One curve of a trimming loop.
#[derive(Debug, Clone, PartialEq)]
pub struct TrimCurve {
    /// Its shape.
    pub shape: TrimShape,
    /// True when it is walked from its end to its start.
    pub reversed: bool,
}

/// A closed loop of curves, end to start, of any orientation.
#[derive(Debug, Clone, PartialEq)]
pub struct TrimLoop {
    /// The curves in order.
    pub curves: Vec<TrimCurve>,
}

/// A surface with its trimming loops, in any order and of any orientation. No loops: the whole domain.
#[derive(Debug, Clone, PartialEq)]
pub struct TrimmedSurface {
    /// The base surface, in millimetres.
    pub surface: Surface,
    /// The loops.
    pub loops: Vec<TrimLoop>,
    /// The show side.
    pub side: Side,
}
