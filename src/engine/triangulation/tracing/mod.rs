//! Tracing triangulation of a trimmed domain (thesis chapter 3; Cripps and Parwana 2011).
//!
//! Loops are walked through the cells of a rectilinear grid ([`walk`]), and leave edge crossing lists in the cells that
//! they meet ([`crossings`]); [`trace`] does that, in time that grows with these cells and not with the grid. Then each
//! row is gone through: the region in a met cell is bounded by its lists and pieces of its border ([`cell`]) and
//! triangulated, and the runs between such cells are filled as the right-edge check tells ([`rows`]);
//! [`Traced::triangulate`] does that.
//!
//! The mesh conforms: every edge inside the region has two triangles, every edge on the border lies on a loop, no two
//! vertices share (u, v), all triangles are anticlockwise by exact predicates. Loops must not cross themselves or each
//! other; they may touch in vertices, slide along grid lines and along the domain's border. They come oriented by
//! nesting ([`TrimRegion`]), the region to their left; the thesis's "orientation is not needed" presupposes that.

mod cell;
mod crossings;
mod rows;
mod walk;

use glam::DVec2;

pub use self::crossings::{CellEdge, CrossingList};
use self::{
    crossings::{Event, What},
    walk::{Step, Walker},
};
use super::{Configuration, DomainMesh, GridLines, TracingCounts, TriangulationError, grid_mesh, region_area};
use crate::engine::{
    budget::Observer,
    error::{EngineError, Place},
    nurbs::{Domain, Surface},
    trimming::TrimRegion,
};

/// More traced points than this are refused (a loop of many long segments across a fine grid): they take about 100 bytes
/// each with their events.
const MOST_POINTS: usize = 10_000_000;

/// The observer is asked after so many points whether to go on: a fraction of a millisecond.
const POINTS_BETWEEN_QUESTIONS: usize = 4096;

/// What a cell is to the loops (thesis 3.3.1). Cells without a label are OUTSIDE until a row's runs show otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CellLabel {
    /// INTERSECT: a loop runs through its interior.
    pub intersect: bool,
    /// CONTAINED: a loop lies in its interior altogether.
    pub contained: bool,
    /// INSIDE, from a loop that slides along one of its edges, or OUTSIDE, `None` when no loop slides.
    pub inside: Option<bool>,
}

/// A cell that a loop met.
#[derive(Debug, Clone, PartialEq)]
pub struct TracedCell {
    /// Column and row.
    pub cell: [u32; 2],
    /// Its label.
    pub label: CellLabel,
    /// Its edge crossing lists, in the order in which they were traced.
    pub lists: Vec<CrossingList>,
}

/// Loops traced on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Traced {
    lines: GridLines,
    /// All loops' points with their crossings.
    steps: Vec<Step>,
    /// What the loops left in the cells, by row and column.
    events: Vec<Event>,
    /// First step of each loop, and the loop's index in the file.
    loops: Vec<(u32, Option<usize>)>,
    counts: TracingCounts,
    /// The region is the domain itself.
    natural: bool,
    aspect: f64,
    /// About how many of the grid's cells the region fills.
    filled: f64,
}

/// Traces the loops of a region on a grid.
///
/// The natural boundary of an untrimmed domain needs no tracing: no cell is touched then, and [`Traced::triangulate`]
/// gives the grid's own mesh with its numbering.
///
/// # Errors
/// [`EngineError::Cancelled`]; [`EngineError::Parameter`] when the lines are not a grid;
/// [`TriangulationError::Polygon`] with its place when a loop leaves the grid; [`TriangulationError::TooManyTriangles`]
/// when the loops meet too many cells.
pub fn trace(lines: &GridLines, region: &TrimRegion, observer: &dyn Observer) -> Result<Traced, EngineError> {
    check_lines(lines)?;
    let size = [lines.u.len() as u32 - 1, lines.v.len() as u32 - 1];
    let mut traced = Traced {
        lines: lines.clone(),
        steps: Vec::new(),
        events: Vec::new(),
        loops: Vec::with_capacity(region.loops.len()),
        counts: TracingCounts { cells: lines.cells(), ..TracingCounts::default() },
        natural: region.natural,
        aspect: 1.0,
        filled: 0.0,
    };
    if region.natural {
        return Ok(traced);
    }
    let Domain { u, v } = lines.domain();
    let share = (region_area(region) / ((u[1] - u[0]) * (v[1] - v[0]))).clamp(0.0, 1.0);
    traced.filled = share * lines.cells() as f64;
    let walker = Walker::new(lines);
    for boundary in &region.loops {
        observer.check()?;
        let first = traced.steps.len();
        traced.loops.push((first as u32, boundary.source_loop));
        traced.walk(&walker, &boundary.points, observer)?;
        let path = &mut traced.steps[first..];
        if path.is_empty() {
            continue; // narrower than the snapping distance: it bounds nothing
        }
        // A loop that meets grid lines begins on one: its first and last list are one then.
        if let Some(start) = path.iter().position(Step::on_line) {
            path.rotate_left(start);
            let again = path[0];
            traced.steps.push(again);
        }
        let visits = crossings::distribute(&traced.steps[first..], first as u32, size, &mut traced.events);
        traced.counts.cells_traced += visits;
        traced.counts.contained_loops += u64::from(visits == 1);
    }
    crossings::sort_by_cell(&mut traced.events, size);
    let visited =
        |events: &[Event]| events.iter().any(|e| !matches!(e.what, What::Touch { .. } | What::Slide { inside: false }));
    let cells = traced.events.chunk_by(|a, b| a.cell == b.cell);
    traced.counts.cells_distinct = cells.filter(|events| visited(events)).count() as u64;
    Ok(traced)
}

/// How many times longer a step along u is in space than the same step along v, on the average over the grid's domain,
/// as the nearest power of two: what [`Traced::with_aspect`] wants.
#[must_use]
pub fn aspect_of(surface: &Surface, lines: &GridLines) -> f64 {
    const SAMPLES: [f64; 4] = [0.125, 0.375, 0.625, 0.875];
    let domain = lines.domain();
    let at = |[first, last]: [f64; 2], t: f64| first + (last - first) * t;
    let (mut along_u, mut along_v) = (0.0, 0.0);
    for s in SAMPLES {
        for t in SAMPLES {
            let (_, su, sv) = surface.first_derivatives(at(domain.u, s), at(domain.v, t));
            along_u += su.length();
            along_v += sv.length();
        }
    }
    let exponent = (along_u / along_v).log2().round();
    if exponent.is_finite() { exponent.clamp(-64.0, 64.0).exp2() } else { 1.0 }
}

impl Traced {
    /// The same, with angles of polygons' triangles judged in the domain stretched by `aspect` along u (1 at first).
    /// A power of two is best: stretching is exact then.
    #[must_use]
    pub fn with_aspect(mut self, aspect: f64) -> Self {
        if aspect.is_finite() && aspect > 0.0 {
            self.aspect = aspect;
        }
        self
    }

    /// What tracing touched (thesis Table 3.1).
    #[must_use]
    pub const fn counts(&self) -> TracingCounts {
        self.counts
    }

    /// The cells that loops met with their crossing lists, by row and column.
    pub fn cells(&self) -> impl Iterator<Item = TracedCell> + '_ {
        self.events.chunk_by(|a, b| a.cell == b.cell).map(|events| {
            let mut label = CellLabel::default();
            let mut lists = Vec::new();
            for event in events {
                match event.what {
                    What::List(list) => lists.push(list),
                    What::Contained { .. } => label.contained = true,
                    What::Slide { inside } => label.inside = Some(inside),
                    What::Touch { .. } => {}
                }
            }
            label.intersect = !lists.is_empty();
            TracedCell { cell: events[0].cell, label, lists }
        })
    }

    /// The traced point of an index in a [`CrossingList`].
    #[must_use]
    pub fn point(&self, index: u32) -> Option<DVec2> {
        self.steps.get(index as usize).map(|step| step.at)
    }

    /// Generates and triangulates the polygons of met cells, and fills the cells between them.
    ///
    /// Vertices are numbered as the rows from the bottom first use them; an untrimmed domain gives [`grid_mesh`].
    ///
    /// # Errors
    /// [`TriangulationError::Polygon`] with its place where the loops do not bound a region;
    /// [`TriangulationError::NoArea`]; [`TriangulationError::TooManyTriangles`].
    pub fn triangulate(&self, configuration: Configuration, phase: u8) -> Result<DomainMesh, TriangulationError> {
        if self.natural {
            return Ok(grid_mesh(&self.lines, configuration, phase));
        }
        rows::triangulate(self, configuration, phase)
    }

    /// Walks one loop and appends its steps, the first point at the end.
    fn walk(&mut self, walker: &Walker<'_>, points: &[DVec2], observer: &dyn Observer) -> Result<(), EngineError> {
        let Some(&first) = points.first() else { return Ok(()) };
        let start = walker.start(first).ok_or_else(|| self.trouble(first, None))?;
        let mut now = start;
        let mut asked = self.steps.len();
        for &p in &points[1..] {
            let next = walker.follow(p, &now).ok_or_else(|| self.trouble(p, None))?;
            walker.segment(now, next, &mut self.steps);
            now = next;
            if self.steps.len() - asked > POINTS_BETWEEN_QUESTIONS {
                asked = self.steps.len();
                observer.check()?;
            }
            if self.steps.len() > MOST_POINTS {
                let (estimate, limit) = (self.steps.len() as u64, MOST_POINTS as u64);
                return Err(TriangulationError::TooManyTriangles { estimate, limit }.into());
            }
        }
        walker.segment(now, start, &mut self.steps);
        Ok(())
    }

    /// The error at a place, with the loop of a traced point (or the loop traced last).
    fn trouble(&self, uv: DVec2, point: Option<u32>) -> TriangulationError {
        let k = point.map_or(self.loops.len(), |point| self.loops.partition_point(|l| l.0 <= point));
        let loop_index = k.checked_sub(1).and_then(|k| self.loops[k].1);
        let place = Place { loop_index, uv: Some(uv.into()), ..Place::default() };
        TriangulationError::Polygon { place: Box::new(place) }
    }
}

/// Checks that lines make a grid.
fn check_lines(lines: &GridLines) -> Result<(), EngineError> {
    for (name, list) in [("u", &lines.u), ("v", &lines.v)] {
        let increasing = list.iter().all(|x| x.is_finite()) && list.windows(2).all(|w| w[0] < w[1]);
        if list.len() < 2 || !increasing {
            let detail = format!("the grid's lines along {name} must be at least two, finite and strictly increasing");
            return Err(EngineError::Parameter { name: "triangulation.grid".to_owned(), detail });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
