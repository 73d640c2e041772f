//! From a flattening to its pattern.

use glam::DVec2;

use super::flat_map::FlatMap;
use super::locator::Locator;
use super::outline::{FlatLoop, Tracer};
use super::part::area_centroids;
use super::piece::{Finishing, change, second};
use super::placement::{Hold, Motion, Placement, Transform, View, mirrored};
use super::settle::{CurveTolerances, curves_report, settle};
use super::{Contour, Pattern, Piece};
use crate::engine::budget::Observer;
use crate::engine::distortion::{BoundaryReport, PatternReport, PlacementReport};
use crate::engine::error::EngineError;
use crate::engine::flattening::developable::Unrolled;
use crate::engine::mesh::Topology;
use crate::engine::nurbs::Surface;
use crate::engine::triangulation::Lifted;
use crate::engine::trimming::{CheckedTrims, Side};

/// The default chord tolerance of the pattern's curves, as a part of the part's diagonal: finer than a knife follows,
/// and some hundred points on a circle.
pub const DEFAULT_CURVE_TOLERANCE: f64 = 1e-4;

/// The finest chord tolerance, as a part of the part's diagonal: what is asked below it is rounded up to it.
const FINEST_CURVE_TOLERANCE: f64 = 1e-8;

/// Pieces of a mesh that are flattened each by itself are laid side by side with this part of the widest one between.
const GAP: f64 = 0.05;

/// What a pattern is drawn from.
#[derive(Debug, Clone, Copy)]
pub struct DrawInput<'a> {
    /// The surface.
    pub surface: &'a Surface,
    /// Its show side.
    pub side: Side,
    /// Its trimming loops.
    pub trims: &'a CheckedTrims,
    /// The mesh that was flattened: of the whole base surface, or of what lies inside the loops.
    pub lifted: &'a Lifted,
    /// The topology of the mesh.
    pub topology: &'a Topology,
    /// The locator of the domain mesh.
    pub locator: &'a Locator<'a>,
    /// The map that placed them, when the surface was unrolled exactly: curves are then mapped by it as well.
    pub exact: Option<&'a Unrolled>,
    /// Where the mesh's vertices lie in the plane, mm; NaN where they do not. Triangles are anticlockwise.
    pub flat: &'a [DVec2],
    /// For each triangle of the mesh whether it belongs to the part (see [`super::triangles_of_part`]).
    pub part: &'a [bool],
    /// How the pattern is to lie.
    pub placement: &'a Placement,
    /// What is settled already of that, by piece; none where nothing is.
    pub holds: &'a [Hold],
    /// Largest distance between curves and their polylines, mm; `None`: [`DEFAULT_CURVE_TOLERANCE`].
    pub curve_tolerance_mm: Option<f64>,
}

/// A pattern and what is said of it. Until it is finished its contours are all that was sampled.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawn {
    /// The pattern, its bounding box from (0, 0) unless points hold it elsewhere. Pieces that are not flattened are left out.
    pub pattern: Pattern,
    /// How the flattening is brought to where the pattern lies.
    pub transform: Transform,
    /// The same for the report; of the first piece where there are several.
    pub placement: PlacementReport,
    /// Sizes and counts.
    pub report: PatternReport,
    /// Lengths of the loops that were drawn, in the order of the file.
    pub boundary: Vec<BoundaryReport>,
    /// How near its curves are to be followed.
    pub curves: CurveTolerances,
}

impl Drawn {
    /// Does to the pieces what is asked, fits curves through their samples, and reports on them anew. Where the flattening lies
    /// stays as it was.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`] when the observer asks for it.
    pub fn finish(&mut self, asked: &Finishing, observer: &dyn Observer) -> Result<(), EngineError> {
        change(&mut self.pattern, asked);
        settle(&mut self.pattern, self.curves, observer)?;
        second(&mut self.pattern, asked);
        self.report = PatternReport {
            compensation: asked.compensation,
            curves: curves_report(&self.pattern),
            ..report(&self.pattern)
        };
        Ok(())
    }
}

/// Draws the pattern of a flattening.
///
/// # Errors
/// [`EngineError::Parameter`] for `placement.align` when the direction has no meaning at the part's middle, for
/// `curve_tolerance_mm` when it is not positive or asks for too many points; [`EngineError::Trimming`] when the loops cannot
/// be polygonised that finely; [`EngineError::Cancelled`] when the observer asks for it.
pub fn draw(input: &DrawInput<'_>, observer: &dyn Observer) -> Result<Drawn, EngineError> {
    let tolerance = curve_tolerance(input)?;
    let region = input.trims.polygonise(input.surface, tolerance)?;
    let map = FlatMap::new(input.surface, input.lifted, input.topology, input.locator, input.flat, input.exact);
    let tracer = Tracer { surface: input.surface, trims: input.trims, region: &region, map: &map, tolerance, observer };
    let mut budget = 0;
    let loops = (0..region.loops.len()).map(|l| tracer.flat_loop(l, &mut budget)).collect::<Result<Vec<_>, _>>()?;

    // A hole is drawn only with the outline around it.
    let mut sheets: Vec<(FlatLoop, Vec<FlatLoop>)> = Vec::new();
    let mut drawn_loops = Vec::new();
    for index in (0..region.loops.len()).filter(|&l| region.loops[l].depth % 2 == 0) {
        let Some(outline) = loops[index].clone() else { continue };
        let mut holes = Vec::new();
        drawn_loops.push(index);
        for (hole, l) in region.loops.iter().enumerate() {
            if l.parent == Some(index)
                && l.depth % 2 == 1
                && let Some(flat) = &loops[hole]
            {
                holes.push(flat.clone());
                drawn_loops.push(hole);
            }
        }
        sheets.push((outline, holes));
    }
    drawn_loops.sort_unstable();

    observer.check()?;
    let transform = transform(input, &map, &sheets, observer)?;
    let pieces: Vec<Piece> = sheets
        .iter()
        .enumerate()
        .map(|(k, (outline, holes))| Piece {
            name: format!("piece {}", k + 1),
            outline: contour(outline, &transform, true),
            holes: holes.iter().map(|hole| contour(hole, &transform, false)).collect(),
            ..Piece::default()
        })
        .collect();
    let bounding_box_mm = size(&pieces, input.holds);
    let pattern = Pattern { pieces, bounding_box_mm, ..Pattern::default() };
    let placement = placement_report(input.placement, &transform);
    let boundary = drawn_loops.into_iter().map(|l| tracer.lengths(l)).collect::<Result<_, _>>()?;
    let curves = CurveTolerances { fitted: tolerance, kept: Some(0.5 * tolerance) };
    Ok(Drawn { report: report(&pattern), pattern, transform, placement, boundary, curves })
}

/// How the pattern lies: the motion of the first piece.
pub(super) fn placement_report(placement: &Placement, transform: &Transform) -> PlacementReport {
    let first = transform.motions.first().copied().unwrap_or_default();
    PlacementReport {
        side_up: match placement.view {
            View::Show => "show".into(),
            View::Back => "back".into(),
        },
        mirrored: transform.mirrored,
        rotation_deg: first.rotation.to_angle().to_degrees(),
        origin_mm: first.origin.to_array(),
    }
}

/// The chord tolerance in millimetres.
fn curve_tolerance(input: &DrawInput<'_>) -> Result<f64, EngineError> {
    let mesh = &input.lifted.mesh;
    let places = || {
        let triangles = mesh.triangles.iter().zip(input.part).filter(|(_, belongs)| **belongs);
        triangles.flat_map(|(t, _)| t.map(|k| mesh.positions[k as usize]))
    };
    let low = places().fold(glam::DVec3::INFINITY, glam::DVec3::min);
    let high = places().fold(glam::DVec3::NEG_INFINITY, glam::DVec3::max);
    let diagonal = if low.is_finite() { low.distance(high) } else { 1.0 };
    match input.curve_tolerance_mm {
        None => Ok(DEFAULT_CURVE_TOLERANCE * diagonal),
        Some(t) if t.is_finite() && t > 0.0 => Ok(t.max(FINEST_CURVE_TOLERANCE * diagonal)),
        Some(t) => Err(EngineError::Parameter {
            name: "curve_tolerance_mm".into(),
            detail: format!("{t} is not a positive length; {:.3} would do", DEFAULT_CURVE_TOLERANCE * diagonal),
        }),
    }
}

/// Turns every piece of the mesh as the placement says and lays them from (0, 0) on, side by side.
fn transform(
    input: &DrawInput<'_>,
    map: &FlatMap<'_>,
    sheets: &[(FlatLoop, Vec<FlatLoop>)],
    observer: &dyn Observer,
) -> Result<Transform, EngineError> {
    let count = map.piece_count();
    let mirrored = mirrored(input.side, input.placement);
    let mut transform = Transform { mirrored, motions: Vec::with_capacity(count), motion_of: Vec::new() };
    let middles = area_centroids(input.lifted, input.part, input.topology.piece_of(), count);
    for (piece, middle) in middles.into_iter().enumerate() {
        observer.check()?;
        let rotation = rotation(input, map, piece as u32, middle, mirrored)?;
        transform.motions.push(Motion { rotation, origin: DVec2::ZERO });
    }
    lay_out(&mut transform, input.holds, sheets.iter().map(|(outline, _)| outline));
    if count > 1 {
        transform.motion_of = map.pieces_of_vertices();
    }
    Ok(transform)
}

/// Width and height of the pattern.
pub(super) fn size(pieces: &[Piece], holds: &[Hold]) -> [f64; 2] {
    let points = || pieces.iter().flat_map(|p| &p.outline.points);
    let low = if holds.iter().all(|hold| *hold == Hold::Free) {
        DVec2::ZERO
    } else {
        points().copied().reduce(DVec2::min).unwrap_or(DVec2::ZERO)
    };
    (points().fold(low, |m, p| m.max(*p)) - low).to_array()
}

/// Gives each motion what holds its piece, and else the origin that lays it beside the one before: the first from (0, 0) on,
/// or beside all pieces that are held.
pub(super) fn lay_out<'a>(transform: &mut Transform, holds: &[Hold], outlines: impl Iterator<Item = &'a FlatLoop>) {
    let mirrored = transform.mirrored;
    for (motion, hold) in transform.motions.iter_mut().zip(holds) {
        match *hold {
            Hold::Free => {}
            Hold::Point { flat, to } => {
                motion.origin = to - motion.rotation.rotate(Transform::seen(mirrored, flat));
            }
            Hold::Motion(held) => *motion = held,
        }
    }
    let mut boxes = vec![[DVec2::INFINITY, DVec2::NEG_INFINITY]; transform.motions.len()];
    for outline in outlines {
        let [low, high] = &mut boxes[outline.piece as usize];
        for &p in &outline.points {
            let p = transform.point(p, outline.piece as usize);
            (*low, *high) = (low.min(p), high.max(p));
        }
    }
    let widest = boxes.iter().filter(|b| b[0].is_finite()).map(|[low, high]| high.x - low.x).fold(0.0, f64::max);
    let is_held = |piece: usize| holds.get(piece).is_some_and(|hold| *hold != Hold::Free);
    let held = || boxes.iter().enumerate().filter(|(piece, b)| is_held(*piece) && b[0].is_finite()).map(|(_, b)| b);
    let right = held().map(|[_, high]| high.x).reduce(f64::max);
    let mut x = right.map_or(0.0, |x| x + GAP * widest);
    let bottom = held().map(|[low, _]| low.y).reduce(f64::min).unwrap_or(0.0);
    for (piece, (motion, [low, high])) in transform.motions.iter_mut().zip(&boxes).enumerate() {
        if low.is_finite() && !is_held(piece) {
            motion.origin = DVec2::new(x - low.x, bottom - low.y);
            x += high.x - low.x + GAP * widest;
        }
    }
}

/// The rotation of one piece of the mesh, `middle` being the area centroid of what of the part lies in it.
fn rotation(
    input: &DrawInput<'_>,
    map: &FlatMap<'_>,
    piece: u32,
    middle: Option<DVec2>,
    mirrored: bool,
) -> Result<DVec2, EngineError> {
    let Some(middle) = middle else { return Ok(DVec2::X) };
    let along = input.placement.align.direction(input.surface, middle)?;
    let Some([du, dv]) = map.jacobian(middle, piece) else { return Ok(DVec2::X) };
    let d = du * along.x + dv * along.y;
    Ok(input.placement.rotation(if mirrored { DVec2::new(d.x, -d.y) } else { d }))
}

/// A loop where it lies in the pattern, outlines anticlockwise and holes clockwise, from its first point on.
pub(super) fn contour(flat: &FlatLoop, transform: &Transform, anticlockwise: bool) -> Contour {
    let mut points: Vec<DVec2> = flat.points.iter().map(|&p| transform.point(p, flat.piece as usize)).collect();
    let mut corners = flat.corners.clone();
    if (signed_area(&points) > 0.0) != anticlockwise {
        points[1..].reverse();
        corners[1..].reverse();
    }
    Contour { points, corners, ..Contour::default() }
}

/// Area of a closed polygon, positive when it is anticlockwise. Relative to its first point, so that place costs no digits.
pub(super) fn signed_area(points: &[DVec2]) -> f64 {
    let Some(&origin) = points.first() else { return 0.0 };
    points.windows(2).map(|w| 0.5 * (w[0] - origin).perp_dot(w[1] - origin)).sum()
}

/// Sizes and counts of a pattern.
pub(super) fn report(pattern: &Pattern) -> PatternReport {
    let contours = || pattern.pieces.iter().flat_map(|p| std::iter::once(&p.outline).chain(&p.holes));
    let perimeter = |c: &Contour| -> f64 {
        let next = c.points.iter().skip(1).chain(c.points.first());
        c.points.iter().zip(next).map(|(a, b)| a.distance(*b)).sum()
    };
    PatternReport {
        // Holes are clockwise: their areas count negative.
        area_mm2: contours().map(|c| signed_area(&c.points)).sum(),
        perimeter_mm: contours().map(perimeter).sum(),
        bounding_box_mm: pattern.bounding_box_mm,
        pieces: pattern.pieces.len() as u64,
        holes: pattern.pieces.iter().map(|p| p.holes.len() as u64).sum(),
        points: contours().map(|c| c.points.len() as u64).sum(),
        compensation: None,
        curves: None,
    }
}
