//! From the flattening of a mesh to its pattern: the outlines are the mesh's borders, point by point.
//!
//! Each flattened piece gives one sheet: of its borders the one that encloses the largest area in the plane is the
//! outline, the others are holes. A piece is turned by a direction of space (the x axis, unless the placement says
//! otherwise) laid into the tangent plane of the triangle nearest to the piece's area centroid and mapped with it: a mesh
//! has no (u, v). An axis that stands upright there gives way to the next one (x, y, z, x).

use glam::{DVec2, DVec3};

use super::draw::{DEFAULT_CURVE_TOLERANCE, contour, lay_out, placement_report, report, signed_area, size};
use super::outline::FlatLoop;
use super::placement::{Hold, IN_PLANE, Motion, Transform, mirrored};
use super::settle::{self, CurveTolerances};
use super::{Align, Drawn, Pattern, Piece, Placement};
use crate::engine::budget::Observer;
use crate::engine::distortion::BoundaryReport;
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, Topology, measures};
use crate::engine::trimming::Side;

/// A border point where the outline turns by more than this, radians (30 degrees), is a corner. Smaller, and a round hole
/// of a dozen edges would be all corners; larger, and the corners of a hexagon would be lost.
const CORNER: f64 = std::f64::consts::FRAC_PI_6;

/// Centroids whose distances from the area centroid differ by less than this part are equally near: the least triangle is
/// taken, and rounding does not choose.
const TIE: f64 = 1e-9;

/// What the pattern of a mesh is drawn from.
#[derive(Debug, Clone, Copy)]
pub struct MeshDrawInput<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Its topology.
    pub topology: &'a Topology,
    /// Its show side.
    pub side: Side,
    /// Where its vertices lie in the plane, mm; NaN where they do not. Triangles are anticlockwise.
    pub flat: &'a [DVec2],
    /// How the pattern is to lie.
    pub placement: &'a Placement,
    /// What is settled already of that, by piece; none where nothing is.
    pub holds: &'a [Hold],
    /// Border points within this distance of a chord between others are left out, and curves are fitted so closely, mm; `None`: all
    /// points stay, and curves are fitted by [`DEFAULT_CURVE_TOLERANCE`] of the widest piece.
    pub curve_tolerance_mm: Option<f64>,
}

/// Draws the pattern of a flattened mesh. Pieces that are not flattened are left out.
///
/// # Errors
/// [`EngineError::Parameter`] for `placement.align` when the direction has no meaning on this mesh, for
/// `curve_tolerance_mm` when it is not positive; [`EngineError::Cancelled`] when the observer asks for it.
pub fn draw_mesh(input: &MeshDrawInput<'_>, observer: &dyn Observer) -> Result<Drawn, EngineError> {
    let count = input.topology.piece_count();
    let (sheets, boundary) = sheets(input, observer)?;
    let mirrored = mirrored(input.side, input.placement);
    let mut transform = Transform { mirrored, motions: Vec::with_capacity(count), motion_of: Vec::new() };
    for middle in central_triangles(input.mesh, input.topology) {
        transform.motions.push(Motion { rotation: rotation(input, middle, mirrored)?, origin: DVec2::ZERO });
    }
    observer.check()?;
    lay_out(&mut transform, input.holds, sheets.iter().map(|(outline, _)| outline));
    if count > 1 {
        transform.motion_of = pieces_of_vertices(input.mesh, input.topology);
    }
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
    // A border is its points; curves are fitted through them all the same.
    let across = pattern.pieces.iter().map(|p| settle::size(&p.outline.points)).fold(0.0, f64::max);
    let fitted = input.curve_tolerance_mm.unwrap_or(DEFAULT_CURVE_TOLERANCE * across);
    let curves = CurveTolerances { fitted, kept: input.curve_tolerance_mm };
    Ok(Drawn { report: report(&pattern), pattern, transform, placement, boundary, curves })
}

type Sheets = Vec<(FlatLoop, Vec<FlatLoop>)>;

/// The outline and the holes of each flattened piece, in the order of the pieces, and the lengths of all of them.
fn sheets(input: &MeshDrawInput<'_>, observer: &dyn Observer) -> Result<(Sheets, Vec<BoundaryReport>), EngineError> {
    if let Some(t) = input.curve_tolerance_mm
        && !(t.is_finite() && t > 0.0)
    {
        let detail = format!("{t} is not a positive length");
        return Err(EngineError::Parameter { name: "curve_tolerance_mm".into(), detail });
    }
    // Per piece: its loops with their areas in the plane and their lengths.
    let mut loops: Vec<Vec<(f64, FlatLoop, BoundaryReport)>> = vec![Vec::new(); input.topology.piece_count()];
    for border in input.topology.borders() {
        observer.check()?;
        let Some(&first) = border.first() else { continue };
        let piece = input.topology.piece_of()[first as usize / 3];
        let vertices: Vec<usize> = border.iter().map(|&h| input.topology.origin(h) as usize).collect();
        let points: Vec<DVec2> = vertices.iter().map(|&v| input.flat[v]).collect();
        if points.len() < 3 || !points.iter().all(|p| p.is_finite()) {
            continue;
        }
        let next = |k: usize| (k + 1) % points.len();
        let length_mm: f64 = (0..points.len())
            .map(|k| input.mesh.positions[vertices[k]].distance(input.mesh.positions[vertices[next(k)]]))
            .sum();
        let lengths = BoundaryReport {
            source_loop: None,
            hole: false,
            length_3d_mm: length_mm,
            length_mesh_mm: length_mm,
            length_2d_mm: (0..points.len()).map(|k| points[k].distance(points[next(k)])).sum(),
        };
        let area = signed_area(&points);
        let corners = corners(&points);
        loops[piece as usize].push((area, FlatLoop { points, corners, piece }, lengths));
    }
    let mut sheets = Vec::new();
    let mut boundary = Vec::new();
    for mut of_piece in loops {
        // The first of equals.
        let mut outer = 0;
        for k in 1..of_piece.len() {
            if of_piece[k].0.abs() > of_piece[outer].0.abs() {
                outer = k;
            }
        }
        if outer >= of_piece.len() {
            continue;
        }
        let (_, outline, lengths) = of_piece.remove(outer);
        boundary.push(lengths);
        let mut holes = Vec::with_capacity(of_piece.len());
        for (_, hole, lengths) in of_piece {
            boundary.push(BoundaryReport { hole: true, ..lengths });
            holes.push(hole);
        }
        sheets.push((outline, holes));
    }
    Ok((sheets, boundary))
}

/// Which points of a closed polyline are corners.
fn corners(points: &[DVec2]) -> Vec<bool> {
    let count = points.len();
    (0..count)
        .map(|k| {
            let [before, here, after] = [points[(k + count - 1) % count], points[k], points[(k + 1) % count]];
            let (from, to) = (here - before, after - here);
            from.perp_dot(to).atan2(from.dot(to)).abs() > CORNER
        })
        .collect()
}

/// For each piece the triangle whose centroid is nearest to the piece's area centroid, the least of several.
fn central_triangles(mesh: &Mesh, topology: &Topology) -> Vec<u32> {
    let count = topology.piece_count();
    let mut sums = vec![(DVec3::ZERO, 0.0); count];
    let triangles = || topology.piece_of().iter().enumerate().map(|(t, &piece)| (t as u32, piece as usize));
    for (t, piece) in triangles() {
        let corners = measures::corners(mesh, t);
        let area = measures::area(corners);
        sums[piece].0 += measures::centroid(corners) * area;
        sums[piece].1 += area;
    }
    let distance = |t: u32, piece: usize| {
        let (moment, area) = sums[piece];
        measures::centroid(measures::corners(mesh, t)).distance(moment / area)
    };
    let mut reach = vec![(f64::INFINITY, 0.0_f64); count];
    for (t, piece) in triangles() {
        let (nearest, farthest) = &mut reach[piece];
        (*nearest, *farthest) = (nearest.min(distance(t, piece)), farthest.max(distance(t, piece)));
    }
    let mut central = vec![u32::MAX; count];
    for (t, piece) in triangles() {
        let (nearest, farthest) = reach[piece];
        if central[piece] == u32::MAX && distance(t, piece) <= nearest + TIE * farthest {
            central[piece] = t;
        }
    }
    central
}

/// The rotation of a piece by what its central triangle says; none where it is not flattened.
fn rotation(input: &MeshDrawInput<'_>, triangle: u32, mirrored: bool) -> Result<DVec2, EngineError> {
    let Some(corners) = input.mesh.triangles.get(triangle as usize) else { return Ok(DVec2::X) };
    let [p, q, r] = corners.map(|v| input.mesh.positions[v as usize]);
    let [fp, fq, fr] = corners.map(|v| input.flat[v as usize]);
    let frame = Frame { edges: [q - p, r - p], flat: [fq - fp, fr - fp] };
    if !frame.flat.iter().all(|f| f.is_finite()) {
        return Ok(DVec2::X);
    }
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::X];
    let d = match input.placement.align {
        Align::U => axes.iter().find_map(|&axis| frame.laid_down(axis)),
        Align::V => axes[1..].iter().find_map(|&axis| frame.laid_down(axis)),
        Align::Xyz(d) => {
            Some(DVec3::from_array(d).try_normalize().and_then(|d| frame.laid_down(d)).ok_or_else(|| {
                refused(
                    "the direction has no length or is normal to the mesh at a piece's middle; one along it is needed",
                )
            })?)
        }
        Align::Uv(_) => {
            return Err(refused("a mesh has no (u, v): give a direction in space, such as { \"xyz\": [1, 0, 0] }"));
        }
    };
    let d = d.unwrap_or(DVec2::X);
    Ok(input.placement.rotation(if mirrored { DVec2::new(d.x, -d.y) } else { d }))
}

fn refused(detail: &str) -> EngineError {
    EngineError::Parameter { name: "placement.align".into(), detail: detail.into() }
}

/// Two edges of a triangle in space and in the plane.
struct Frame {
    edges: [DVec3; 2],
    flat: [DVec2; 2],
}

impl Frame {
    /// A unit direction of space in the plane: its part along the triangle, mapped with it. `None` when it stands upright.
    fn laid_down(&self, direction: DVec3) -> Option<DVec2> {
        let [a, b] = self.edges;
        let (e, f, g) = (a.dot(a), a.dot(b), b.dot(b));
        let (x, y) = (a.dot(direction), b.dot(direction));
        let determinant = e * g - f * f;
        let (s, t) = ((g * x - f * y) / determinant, (e * y - f * x) / determinant);
        let along = a * s + b * t;
        (along.is_finite() && along.length() >= IN_PLANE).then(|| self.flat[0] * s + self.flat[1] * t)
    }
}

/// For each vertex its piece.
fn pieces_of_vertices(mesh: &Mesh, topology: &Topology) -> Vec<u32> {
    let mut of_vertex = vec![0; mesh.positions.len()];
    for (corners, &piece) in mesh.triangles.iter().zip(topology.piece_of()) {
        for &v in corners {
            of_vertex[v as usize] = piece;
        }
    }
    of_vertex
}
