//! From traced cells to triangles, row by row (thesis 3.4, 3.5).
//!
//! Each row is gone through from left to right. Cells with events give polygons; after each of them the right-edge check
//! says whether the cells up to the next one lie inside. Those become two triangles each, by the configuration.

use glam::DVec2;

use super::{
    Traced,
    cell::{CellRegion, Shape, Source},
    crossings::Event,
};
use crate::engine::{
    error::Place,
    triangulation::{Configuration, DomainMesh, TriangulationError, grid::split_cell, polygon::PolygonTriangulator},
};

/// More triangles than this are refused: at about 60 bytes a triangle in the domain and in space it is 3 GB.
const MOST_TRIANGLES: usize = 50_000_000;

/// Marks a vertex that has no number yet.
const NONE: u32 = u32::MAX;

/// The mesh as it grows.
struct Builder<'a> {
    traced: &'a Traced,
    configuration: Configuration,
    phase: u8,
    mesh: DomainMesh,
    /// Numbers of the grid's vertices below and above the present row.
    below: Vec<u32>,
    above: Vec<u32>,
    /// Numbers of the traced points.
    points: Vec<u32>,
    region: CellRegion,
    triangulator: PolygonTriangulator,
}

/// Triangulates what was traced.
pub(super) fn triangulate(
    traced: &Traced,
    configuration: Configuration,
    phase: u8,
) -> Result<DomainMesh, TriangulationError> {
    let columns = traced.lines.u.len();
    // A guess that saves growing; a grid of rows and columns by need can be off by any factor.
    let expected = (traced.filled as usize).min(MOST_TRIANGLES / 2) + traced.steps.len();
    let mut builder = Builder {
        traced,
        configuration,
        phase,
        mesh: DomainMesh { uv: Vec::with_capacity(expected), triangles: Vec::with_capacity(2 * expected) },
        below: vec![NONE; columns],
        above: vec![NONE; columns],
        points: vec![NONE; traced.steps.len()],
        region: CellRegion::default(),
        triangulator: PolygonTriangulator::default(),
    };
    let mut row_before = None;
    for row in traced.events.chunk_by(|a, b| a.cell[1] == b.cell[1]) {
        let j = row[0].cell[1];
        std::mem::swap(&mut builder.below, &mut builder.above);
        builder.above.fill(NONE);
        if row_before != j.checked_sub(1) {
            builder.below.fill(NONE);
        }
        row_before = Some(j);
        builder.row(row)?;
    }
    if builder.mesh.triangles.is_empty() {
        return Err(TriangulationError::NoArea);
    }
    Ok(builder.mesh)
}

impl Builder<'_> {
    /// All cells of a row that has events.
    fn row(&mut self, events: &[Event]) -> Result<(), TriangulationError> {
        let j = events[0].cell[1] as usize;
        let last = self.traced.lines.u.len() - 1;
        let mut inside = false;
        let mut column = 0;
        for here in events.chunk_by(|a, b| a.cell == b.cell) {
            let i = here[0].cell[0] as usize;
            if inside {
                self.run(column..i, j)?;
            }
            inside = self.cell([i, j], here, inside)?;
            column = i + 1;
        }
        if inside && column < last {
            // The region would reach the domain's border without a loop along it.
            let uv = DVec2::new(self.traced.lines.u[last], self.traced.lines.v[j]);
            return Err(TriangulationError::Polygon {
                place: Box::new(Place { uv: Some(uv.into()), ..Place::default() }),
            });
        }
        Ok(())
    }

    /// Cells that lie inside altogether.
    fn run(&mut self, columns: std::ops::Range<usize>, j: usize) -> Result<(), TriangulationError> {
        let triangles = self.mesh.triangles.len() + 2 * columns.len();
        if triangles > MOST_TRIANGLES {
            let (estimate, limit) = (triangles as u64, MOST_TRIANGLES as u64);
            return Err(TriangulationError::TooManyTriangles { estimate, limit });
        }
        for i in columns {
            self.whole(i, j);
        }
        Ok(())
    }

    /// A cell that lies inside altogether and whose edges carry no points.
    fn whole(&mut self, i: usize, j: usize) {
        let corners = [0, 1, 2, 3].map(|k| self.corner(i, j, k));
        self.mesh.triangles.extend(split_cell(corners, self.configuration.is_backslash(i, j, self.phase)));
    }

    /// A cell with events. Returns whether the region lies inside it along its right edge.
    fn cell(&mut self, [i, j]: [usize; 2], events: &[Event], left_inside: bool) -> Result<bool, TriangulationError> {
        let lines = &self.traced.lines;
        let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|[i, j]| DVec2::new(lines.u[i], lines.v[j]));
        let (shape, right_inside) = self
            .region
            .collect(&self.traced.steps, corners, events[0].cell, events, left_inside)
            .map_err(|point| self.traced.trouble(self.traced.steps[point as usize].at, Some(point)))?;
        match shape {
            Shape::Outside => {}
            Shape::Whole => self.whole(i, j),
            Shape::Polygon => self.polygon(i, j)?,
        }
        Ok(right_inside)
    }

    /// Triangulates the region collected in cell (i, j).
    fn polygon(&mut self, i: usize, j: usize) -> Result<(), TriangulationError> {
        let region = std::mem::take(&mut self.region);
        let mut triangulator = std::mem::take(&mut self.triangulator);
        let triangles =
            triangulator.triangulate(&region.points, &region.edges, self.traced.aspect).map_err(|trouble| {
                let k = trouble.point as usize;
                let point = if let Source::Point(point) = region.sources[k] { Some(point) } else { None };
                self.traced.trouble(region.points[k], point)
            })?;
        for triangle in triangles {
            let corners = triangle.map(|k| match region.sources[k as usize] {
                Source::Corner(k) => self.corner(i, j, k),
                Source::Point(point) => self.point(point),
            });
            self.mesh.triangles.push(corners);
        }
        self.region = region;
        self.triangulator = triangulator;
        Ok(())
    }

    /// The number of corner `k` (anticlockwise from the lower left) of cell (i, j).
    fn corner(&mut self, i: usize, j: usize, k: u8) -> u32 {
        let column = if k == 1 || k == 2 { i + 1 } else { i };
        let (row, numbers) = if k < 2 { (j, &mut self.below) } else { (j + 1, &mut self.above) };
        let number = &mut numbers[column];
        if *number == NONE {
            *number = self.mesh.uv.len() as u32;
            self.mesh.uv.push(DVec2::new(self.traced.lines.u[column], self.traced.lines.v[row]));
        }
        *number
    }

    /// The number of a traced point.
    fn point(&mut self, point: u32) -> u32 {
        let number = &mut self.points[point as usize];
        if *number == NONE {
            *number = self.mesh.uv.len() as u32;
            self.mesh.uv.push(self.traced.steps[point as usize].at);
        }
        *number
    }
}
