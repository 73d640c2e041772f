//! What a file may hold at most, and the numbers that can be worked on. One home for all of them.

/// Most control points of a surface's net. Real nets have some thousands; this bounds memory (24 bytes each, 32 when
/// rational) and the work of a job before a triangle is made.
pub const MAX_CONTROL_POINTS: usize = 1_000_000;
/// Most trimming loops. Perforated panels have hundreds.
pub const MAX_LOOPS: usize = 10_000;
/// Most trimming curves in all loops.
pub const MAX_CURVES: usize = 100_000;
/// Most control points and polyline points in all trimming curves.
pub const MAX_TRIM_POINTS: usize = 1_000_000;
/// Most labels of a surface, and of a job: a title block has room for a few, a listing shows them all.
pub const MAX_LABELS: usize = 64;
/// Most characters of a label's name: it stands in filters (`label.NAME=VALUE`).
pub const MAX_LABEL_NAME: usize = 64;
/// Most characters of a surface's name or a label's value. They go into title blocks and listings.
pub const MAX_TEXT: usize = 1000;

/// Largest coordinate, millimetres (1000 km). A double keeps 16 digits: beyond this a tenth of a micrometre is lost.
pub const MAX_COORDINATE_MM: f64 = 1e9;
/// Smallest extent of a control net, millimetres (a femtometre is smaller, an atom larger): below it the squares and
/// products of the exact predicates leave the range of doubles.
pub const MIN_EXTENT_MM: f64 = 1e-9;
/// Smallest extent of a control net against the size of its coordinates. A double keeps 16 digits; a part that takes
/// up less than the last 7 of them is a staircase.
pub const MIN_EXTENT_RELATIVE: f64 = 1e-9;
/// Largest knot or trimming coordinate.
pub const MAX_PARAMETER: f64 = 1e12;
/// Smallest length of a domain against the size of its parameters, for the same reason as [`MIN_EXTENT_RELATIVE`].
pub const MIN_DOMAIN_RELATIVE: f64 = 1e-9;
/// Smallest length of a domain, whatever the size of its parameters: their squares must not vanish.
pub const MIN_DOMAIN: f64 = 1e-100;
/// Largest weight against the smallest. The quotient rule loses this many times a double's precision.
pub const MAX_WEIGHT_RATIO: f64 = 1e9;

/// The limits of a request that a server may tighten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadLimits {
    /// Control points of the surface.
    pub control_points: usize,
    /// Trimming loops.
    pub loops: usize,
    /// Trimming curves in all loops.
    pub curves: usize,
    /// Points of all trimming curves.
    pub trim_points: usize,
}

impl Default for ReadLimits {
    fn default() -> Self {
        Self { control_points: MAX_CONTROL_POINTS, loops: MAX_LOOPS, curves: MAX_CURVES, trim_points: MAX_TRIM_POINTS }
    }
}
