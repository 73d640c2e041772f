//! What a pattern consists of: pieces with their outlines, holes, sew lines, grain and marks, and the seams between them.
//!
//! All coordinates are millimetres in the plane of the pattern, y upwards. Polylines carry what was mapped, point by
//! point; [`Fits`] carry the same curves as lines with arcs or with cubics, where they have been fitted.

use glam::DVec2;
use serde::{Deserialize, Serialize};

/// How curves are written: `curves` of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Curves {
    /// Chains of chords.
    #[default]
    Polyline,
    /// Lines and circular arcs.
    Arcs,
    /// Lines and cubic splines; a circle stays one.
    Spline,
}

/// One stretch of a fitted curve, from where the one before it ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Segment {
    /// A straight line.
    Line {
        /// Its end.
        to: DVec2,
    },
    /// A circular arc of less than a full turn.
    Arc {
        /// Its end.
        to: DVec2,
        /// Tangent of a quarter of the angle that it sweeps; positive anticlockwise.
        bulge: f64,
    },
    /// A cubic Bezier curve.
    Cubic {
        /// First inner control point.
        a: DVec2,
        /// Second inner control point.
        b: DVec2,
        /// Its end.
        to: DVec2,
    },
}

impl Segment {
    /// Where it ends.
    #[must_use]
    pub const fn to(&self) -> DVec2 {
        match *self {
            Self::Line { to } | Self::Arc { to, .. } | Self::Cubic { to, .. } => to,
        }
    }
}

/// A curve as lines, arcs and cubics. A closed one ends exactly where it starts; a circle is two arcs of half a turn.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Fit {
    /// Where it starts.
    pub start: DVec2,
    /// Its segments, end to start.
    pub segments: Vec<Segment>,
    /// Centre and radius, where the whole curve is one circle.
    pub circle: Option<(DVec2, f64)>,
    /// For each segment whether its end is a corner (a new entity begins there); as long as `segments`.
    pub corners: Vec<bool>,
    /// Greatest distance from the mapped curve, mm.
    pub deviation_mm: f64,
}

/// The forms that a curve was fitted in.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Fits {
    /// Lines and arcs.
    pub arcs: Option<Fit>,
    /// Lines and cubics.
    pub spline: Option<Fit>,
}

/// One closed polyline of a pattern. The first point is not repeated.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Contour {
    /// Points, millimetres.
    pub points: Vec<DVec2>,
    /// True where a point is a corner.
    pub corners: Vec<bool>,
    /// The same as curves.
    pub fits: Fits,
}

/// What a mark is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MarkKind {
    /// A place on the border that must meet its like on another piece.
    Notch,
    /// The middle of a hole to drill.
    Drill,
    /// A line that is drawn, not cut.
    Draw,
    /// A line inside the piece that is cut.
    Cut,
    /// A text to plot.
    Text,
    /// The line along which the piece folds or mirrors.
    Fold,
}

/// A mark on a piece.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// What it is for.
    pub kind: MarkKind,
    /// Its name or text; empty without.
    pub text: String,
    /// Its line; a single point for notches, drill points and texts.
    pub points: Vec<DVec2>,
    /// True where a point is a corner; as long as `points`.
    pub corners: Vec<bool>,
    /// Whether the line closes; the first point is not repeated.
    pub closed: bool,
    /// For a notch the unit direction into the piece.
    pub inward: Option<DVec2>,
    /// For a notch its depth, for a drill point its diameter, mm; zero where nothing is said.
    pub size_mm: f64,
    /// The same line as curves.
    pub fits: Fits,
}

/// Which way a material may lie along its grain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sense {
    /// Either way.
    #[default]
    Either,
    /// One way only: the material has a nap.
    OneWay,
}

/// The grain line of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grain {
    /// Where it starts.
    pub from: DVec2,
    /// Where it ends; the grain runs this way.
    pub to: DVec2,
    /// Whether the material has a nap.
    pub sense: Sense,
}

/// One piece: outline anticlockwise, holes clockwise.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Piece {
    /// Its name.
    pub name: String,
    /// The outline: what is cut, with the seam allowance where there is one.
    pub outline: Contour,
    /// The holes.
    pub holes: Vec<Contour>,
    /// The sew line, where an allowance lies outside it; anticlockwise.
    pub sew: Option<Contour>,
    /// The grain.
    pub grain: Option<Grain>,
    /// The marks.
    pub marks: Vec<Mark>,
    /// True for a piece that is the mirror image of the one before it.
    pub mirrored: bool,
}

/// One side of a seam: a run of a piece's border.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SeamSide {
    /// The piece's index.
    pub piece: u32,
    /// The run, from the seam's start to its end.
    pub points: Vec<DVec2>,
    /// Its length, mm.
    pub length_mm: f64,
}

/// Two runs of borders that were one line on the surface and are to be joined.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Seam {
    /// Its name: the notches of both sides carry it.
    pub name: String,
    /// Both sides, walked the same way.
    pub sides: [SeamSide; 2],
    /// Its length on the surface, mm.
    pub length_3d_mm: f64,
}

impl Seam {
    /// Difference of the two lengths, mm.
    #[must_use]
    pub fn mismatch_mm(&self) -> f64 {
        (self.sides[0].length_mm - self.sides[1].length_mm).abs()
    }
}

/// The pattern, in the first quadrant unless points were given places of their own.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Pattern {
    /// The pieces.
    pub pieces: Vec<Piece>,
    /// The seams.
    pub seams: Vec<Seam>,
    /// Width and height, millimetres.
    pub bounding_box_mm: [f64; 2],
}
