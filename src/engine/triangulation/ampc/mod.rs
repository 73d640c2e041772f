//! Triangulation along the axis of minimum principal curvature, AMPC (thesis 6.3 and 6.4, all eight stages).
//!
//! The stages: (1) the domain is sampled by m x n points; (2) the modal direction of minimum curvature (of smaller magnitude) is that
//! of most of them ([`field`]); (3) the domain is divided into floor(m/2) strips along it; (4) in each the straightest line of
//! curvature is kept; (5) with none there is a strip fewer ([`strips`]); (6) lines are blended in between and (8) offset
//! beyond ([`lines`]); (7) lines and rows make cells ([`lattice`]), which are cut along `/` ([`cells`],
//! and [`ends`] at free borders).
//!
//! Beyond the thesis, as options: a fourth-order rule, free ends at the border, and rows along the other family, so that
//! cells have right angles in space (its chapter 7 suggests them). Choices that the text leaves open are told in
//! [`AmpcOptions`]; the defaults are the thesis's method.
//!
//! The mesh covers the whole domain unless thin cells are dropped. Vertices are numbered row by row, rows being lines of
//! constant t (see [`field`]); where lines run along u the numbering is that of the exchanged domain and triangles are turned
//! so that they are anticlockwise in (u, v). Limits: m and n at most [`MAX_POINTS`]; lines are functions of t, so a line of curvature that
//! turns back (round an umbilic, say) is never kept; time grows with m n times the strips that hold no line.

mod cells;
mod ends;
mod field;
mod lattice;
mod lines;
mod options;
#[cfg(test)]
mod reference_tests;
mod strips;
#[cfg(test)]
mod tests;

use glam::DVec2;
use serde::{Deserialize, Serialize};

pub use field::Along;
pub use options::{AmpcBorder, AmpcDirection, AmpcFamilies, AmpcOptions, Integration, NpRule};

use self::cells::{Cut, Thin};
use self::field::{Family, Field};
use self::lattice::Lattice;
use self::lines::Lines;
use super::density::MAX_TRIANGLES;
use super::{DomainFault, DomainMesh, GridLines, TriangulationError, check_domain_mesh};
use crate::engine::budget::Observer;
use crate::engine::error::{EngineError, Place};
use crate::engine::nurbs::{Domain, Surface};
use crate::engine::trimming::TrimRegion;

/// Most points along each direction: lines closer than a thousandth of the part say nothing more of its curvature. How long
/// strips are searched for lines is bounded apart (`strips::MAX_STEPS`).
pub const MAX_POINTS: u32 = 1024;

/// What was counted of one family of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct FamilyCounts {
    /// Strips at first: floor(m / 2).
    pub strips_initial: u32,
    /// Strips when lines were found.
    pub strips_used: u32,
    /// Lines that were found, one a strip at most.
    pub polylines_found: u32,
    /// The same with those in between.
    pub polylines_inner: u32,
    /// Lines beyond the first and beyond the last of these; the outermost lies outside entirely.
    pub beyond: [u32; 2],
}

/// What was counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct AmpcCounts {
    /// Which way lines of minimum curvature run.
    pub direction: Along,
    /// Points of the grid whose direction is rather that of u, and rather that of v.
    pub votes: [u64; 2],
    /// The lines of minimum curvature.
    pub minimum: FamilyCounts,
    /// Those of maximum curvature, with `families: both`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maximum: Option<FamilyCounts>,
    /// Thin cells that were left out.
    pub cells_dropped: u64,
}

/// A mesh along lines of curvature.
#[derive(Debug, Clone, PartialEq)]
pub struct Ampc {
    /// The mesh of the domain.
    pub domain: DomainMesh,
    /// The grid that directions were sampled on.
    pub lines: GridLines,
    /// The lines of minimum curvature that were found in strips, in (u, v).
    pub polylines: Vec<Vec<DVec2>>,
    /// Triangles that `drop_thin` left out; with `domain` they cover the rectangle.
    pub dropped: DomainMesh,
    /// Counts.
    pub counts: AmpcCounts,
}

/// Triangulates the whole domain of `surface` along its lines of minimum curvature, from m points along u and n along v.
/// Numbers below 2 are taken as 2, `starts` likewise.
///
/// # Errors
/// [`TriangulationError::NoPolyline`] where no number of strips holds a line, [`TriangulationError::LinesTangle`] where
/// lines of two families are out of order, [`TriangulationError::TooManyTriangles`],
/// [`EngineError::Parameter`] where m or n is greater than [`MAX_POINTS`], [`EngineError::Cancelled`].
pub fn ampc(
    surface: &Surface,
    [m, n]: [u32; 2],
    options: &AmpcOptions,
    observer: &dyn Observer,
) -> Result<Ampc, EngineError> {
    let [m, n] = [m, n].map(|points| points.max(2));
    if m.max(n) > MAX_POINTS {
        return Err(EngineError::Parameter {
            name: "triangulation.grid".into(),
            detail: format!("[{m}, {n}] points: the method `ampc` follows lines over at most {MAX_POINTS} each way"),
        });
    }
    let lines = GridLines::uniform(surface.domain(), m as usize, n as usize);
    let mut votes = [0; 2];
    for row in &lines.v {
        observer.check()?;
        let of_row = field::votes(surface, &lines.u, std::slice::from_ref(row));
        votes = [votes[0] + of_row[0], votes[1] + of_row[1]];
    }
    let along = match options.direction {
        AmpcDirection::U => Along::U,
        AmpcDirection::Modal if votes[0] > votes[1] => Along::U,
        AmpcDirection::V | AmpcDirection::Modal => Along::V,
    };
    let size = if along == Along::V { [m, n] } else { [n, m] }.map(|points| points as usize);
    let field = Field::new(surface, along, Family::Minimum, options.integration);
    let (found, columns, minimum) = family(&field, size, options, observer)?;
    let free = options.border == AmpcBorder::Free;
    let (lattice, beyond, maximum) = match options.families {
        AmpcFamilies::One => {
            check_size(columns.x.len(), size[1])?;
            (Lattice::of_one_family(&columns.x, size[1], free), [columns.beyond, [0; 2]], None)
        }
        AmpcFamilies::Both => {
            let other = Field::new(surface, along.other(), Family::Maximum, options.integration);
            let (_, rows, maximum) = family(&other, [size[1], size[0]], options, observer)?;
            check_size(columns.x.len(), rows.x.len())?;
            (Lattice::of_both(&columns.x, &rows.x, free), [columns.beyond, rows.beyond], Some(maximum))
        }
    };
    observer.check()?;
    let point = |p: DVec2| {
        let uv = field.uv(p);
        surface.point(uv.x, uv.y)
    };
    let thin = options.drop_thin.then_some(Thin { point: &point, distance: options.min_distance_mm, beyond });
    let cut = cells::cut(&lattice, thin.as_ref()).map_err(|tangled| {
        let uv = Some(field.uv(tangled.at).to_array());
        TriangulationError::LinesTangle { place: Box::new(Place { uv, ..Place::default() }) }
    })?;
    let triangles = cut.triangles.len() as u64;
    if triangles > MAX_TRIANGLES {
        return Err(TriangulationError::TooManyTriangles { estimate: triangles, limit: MAX_TRIANGLES }.into());
    }
    if options.families == AmpcFamilies::Both {
        // Free ends of lines that lean on each other at the border may leave a gap there.
        let all: Vec<[u32; 3]> = cut.triangles.iter().chain(&cut.dropped).copied().collect();
        conforms(&mesh(&field, &cut, &all), surface.domain())?;
    }
    let polyline = |x: &Vec<f64>| {
        let place = |(row, &x): (usize, &f64)| field.uv(DVec2::new(x, strips::row_at(row, size[1])));
        x.iter().enumerate().map(place).collect()
    };
    Ok(Ampc {
        polylines: found.lines.iter().map(polyline).collect(),
        counts: AmpcCounts { direction: along, votes, minimum, maximum, cells_dropped: cut.cells_dropped },
        domain: mesh(&field, &cut, &cut.triangles),
        dropped: mesh(&field, &cut, &cut.dropped),
        lines,
    })
}

/// The lines of one family.
fn family(
    field: &Field,
    size: [usize; 2],
    options: &AmpcOptions,
    observer: &dyn Observer,
) -> Result<(strips::Found, Lines, FamilyCounts), EngineError> {
    let starts = options.starts.min(AmpcOptions::MAX_STARTS) as usize;
    let found = strips::find(field, size, starts, observer)?;
    if found.lines.is_empty() {
        return Err(TriangulationError::NoPolyline { along: field.along, strips: found.strips_initial }.into());
    }
    let lines = lines::fill(field, &found, size[0], options, observer)?;
    let counts = FamilyCounts {
        strips_initial: found.strips_initial,
        strips_used: found.strips_used,
        polylines_found: found.lines.len() as u32,
        polylines_inner: (lines.x.len() - lines.beyond[0] - lines.beyond[1]) as u32,
        beyond: lines.beyond.map(|count| count as u32),
    };
    Ok((found, lines, counts))
}

/// Cells of the lattice hold memory before most of those outside vanish.
fn check_size(columns: usize, rows: usize) -> Result<(), TriangulationError> {
    let cells = (columns as u64).saturating_mul(rows as u64);
    if cells > MAX_TRIANGLES {
        return Err(TriangulationError::TooManyTriangles { estimate: 2 * cells, limit: MAX_TRIANGLES });
    }
    Ok(())
}

/// Whether a mesh covers the domain whole.
fn conforms(mesh: &DomainMesh, domain: Domain) -> Result<(), TriangulationError> {
    let Some(fault) = check_domain_mesh(mesh, &TrimRegion::whole(domain)).into_iter().next() else { return Ok(()) };
    let uv = match fault {
        DomainFault::Crack(a, b) | DomainFault::Edge(a, b) | DomainFault::Duplicate(a, b) => {
            Some(mesh.uv[a as usize].midpoint(mesh.uv[b as usize]).to_array())
        }
        DomainFault::Orientation { triangle } => {
            Some(mesh.uv[mesh.triangles[triangle as usize][0] as usize].to_array())
        }
        _ => None,
    };
    Err(TriangulationError::LinesTangle { place: Box::new(Place { uv, ..Place::default() }) })
}

/// Some of the triangles with the vertices that they use, in (u, v).
fn mesh(field: &Field, cut: &Cut, triangles: &[[u32; 3]]) -> DomainMesh {
    let mut used = vec![false; cut.points.len()];
    triangles.iter().flatten().for_each(|&k| used[k as usize] = true);
    let mut number = vec![0_u32; cut.points.len()];
    let mut uv = Vec::new();
    for (k, &p) in cut.points.iter().enumerate() {
        if used[k] {
            number[k] = uv.len() as u32;
            uv.push(field.uv(p));
        }
    }
    let turned = field.along == Along::U;
    let triangles = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|k| number[k as usize]);
            if turned { [a, c, b] } else { [a, b, c] }
        })
        .collect();
    DomainMesh { uv, triangles }
}
