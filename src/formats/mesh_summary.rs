//! What is said of a mesh when it is sent: sizes, counts, its pieces, and what a person would want to know before asking
//! for a pattern.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::gltf_mesh::ReadMesh;
use super::summary::{SurfaceKind, SurfaceWarning, unusual_size};
use super::units::Units;
use crate::engine::error::{Located as _, Place};
use crate::engine::mesh::assembly::{Changes, PieceFacts};
use crate::engine::trimming::Side;

/// Pieces that are listed one by one; of more only the number is given.
const MAX_LISTED: usize = 100;
/// Faults of pieces that get a warning of their own; the others are counted.
const MAX_TOLD: usize = 20;

/// A piece: triangles joined by edges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PieceSummary {
    /// Its least triangle.
    pub first_triangle: u32,
    /// Triangles.
    pub triangles: u64,
    /// Area.
    pub area_mm2: f64,
    /// Lengths of its borders.
    pub borders_mm: Vec<f64>,
    /// Code of the reason why it cannot be flattened, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

/// The summary of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshSummary {
    /// Its name in the file.
    pub name: Option<String>,
    /// What it is.
    pub kind: SurfaceKind,
    /// The unit that the file's lengths were taken in. Everything below is in millimetres.
    pub units: Units,
    /// The show side.
    pub side: Side,
    /// Least and greatest corner.
    pub bounding_box_mm: [[f64; 3]; 2],
    /// Length of the box's diagonal.
    pub diagonal_mm: f64,
    /// Area of all triangles.
    pub area_mm2: f64,
    /// Vertices, welded.
    pub vertices: u64,
    /// Edges.
    pub edges: u64,
    /// Triangles.
    pub triangles: u64,
    /// Borders of all pieces.
    pub border_count: u64,
    /// Pieces.
    pub piece_count: u64,
    /// The pieces, at most a hundred of them.
    pub pieces: Vec<PieceSummary>,
    /// What was mended or looks odd.
    pub warnings: Vec<SurfaceWarning>,
    /// What the file did not say outright.
    pub inferred: Vec<String>,
}

/// Sums up a mesh.
#[must_use]
pub fn summarise(read: &ReadMesh, side: Side) -> MeshSummary {
    let assembled = &read.assembled;
    let mesh = &assembled.mesh;
    let low = mesh.positions.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let high = mesh.positions.iter().copied().reduce(DVec3::max).unwrap_or_default();
    let diagonal_mm = low.distance(high);
    let mut warnings = read.warnings.clone();
    warnings.extend(unusual_size(diagonal_mm, read.units));
    changes(&assembled.changes, &mut warnings);
    pieces(&assembled.pieces, &mut warnings);
    let listed = assembled.pieces.iter().take(MAX_LISTED).map(|piece| PieceSummary {
        first_triangle: piece.first_triangle,
        triangles: piece.triangles,
        area_mm2: piece.area_mm2,
        borders_mm: piece.borders_mm.iter().copied().take(MAX_LISTED).collect(),
        fault: piece.fault.as_ref().map(|(fault, _)| fault.code().to_owned()),
    });
    MeshSummary {
        name: read.name.clone(),
        kind: SurfaceKind::Mesh,
        units: read.units,
        side,
        bounding_box_mm: [low.to_array(), high.to_array()],
        diagonal_mm,
        area_mm2: assembled.pieces.iter().map(|piece| piece.area_mm2).sum(),
        vertices: mesh.positions.len() as u64,
        edges: assembled.topology.edge_count() as u64,
        triangles: mesh.triangles.len() as u64,
        border_count: assembled.topology.border_count() as u64,
        piece_count: assembled.pieces.len() as u64,
        pieces: listed.collect(),
        warnings,
        inferred: read.inferred.clone(),
    }
}

fn warning(code: &str, detail: String, place: Option<Place>) -> SurfaceWarning {
    SurfaceWarning { code: code.to_owned(), detail, place }
}

/// What was mended.
fn changes(changes: &Changes, warnings: &mut Vec<SurfaceWarning>) {
    if changes.without_area > 0 {
        let place = changes.first_without_area.map(|p| Place { xyz_mm: Some(p.to_array()), ..Place::default() });
        let detail = format!("{} triangles have no area and were left out", changes.without_area);
        warnings.push(warning("triangles-without-area", detail, place));
    }
    if changes.doubled > 0 {
        let detail = format!("{} triangles lie on others with the same corners and were left out", changes.doubled);
        warnings.push(warning("doubled-triangles", detail, None));
    }
    if changes.turned > 0 {
        let detail = format!("{} triangles were turned over to agree with their neighbours", changes.turned);
        warnings.push(warning("turned-triangles", detail, None));
    }
    if changes.split > 0 {
        let detail = format!("pieces only touch in vertices: {} vertices were added to part them there", changes.split);
        warnings.push(warning("touching-vertices", detail, None));
    }
}

/// What the pieces are, and what of them cannot be flattened.
fn pieces(pieces: &[PieceFacts], warnings: &mut Vec<SurfaceWarning>) {
    let several = pieces.len() > 1;
    if several {
        let detail = format!("the mesh has {} pieces: their patterns are laid side by side", pieces.len());
        warnings.push(warning("several-pieces", detail, None));
    }
    let name = |k: usize| if several { format!("piece {}: ", k + 1) } else { String::new() };
    let mut told = 0;
    for (k, piece) in pieces.iter().enumerate() {
        if let Some((fault, place)) = &piece.fault {
            told += 1;
            if told <= MAX_TOLD {
                let detail = format!("{}{fault}; a flatten job would fail with this", name(k));
                warnings.push(warning(fault.code(), detail, Some(place.clone())));
            }
        } else if piece.borders_mm.len() > 1 {
            told += 1;
            if told <= MAX_TOLD {
                let detail = format!("{}it has {} borders: one outline and holes", name(k), piece.borders_mm.len());
                warnings.push(warning("several-borders", detail, None));
            }
        }
    }
    if told > MAX_TOLD {
        let detail = format!("{} more pieces have faults or several borders", told - MAX_TOLD);
        warnings.push(warning("more-pieces", detail, None));
    }
}
