//! Where a flat mesh lies on itself: overlaps of far parts of a flattening without flips.
//!
//! A map of a mesh that flips no triangle covers a point of the plane as often as the borders wind around it (the degree of
//! the map). So the mesh overlaps where the winding number is two or more, and the border of that set consists of pieces
//! of the mesh's own borders. Crossings of border edges are found with a tree of boxes; the winding number to the right of
//! each loop is counted once by a half-line, then carried along: an edge that crosses another from its right to its left
//! gains one. What separates one from two bounds the overlaps. A hole whose border lies over the mesh, and a border that
//! lies inside without crossing anything, come out of the same count.
//!
//! Nodes are first moved by about a hundred thousand millionth of the extent, so that borders which touch or coincide cross
//! in single points; all decisions on the moved nodes are exact ([`predicate`]). What is left of a touch are slivers, which
//! [`TOUCH`] tells from overlaps.
//!
//! Places mm, areas mm^2. Time is `O(n log n)` for borders as parts have them. Limits: the mesh must have no flipped
//! triangle (a flip winds backwards and may hide an overlap); an overlap's own hole that lies in no crossing border is
//! taken off the total area, but not off the area of its region.

mod border;
mod predicate;
mod regions;
#[cfg(test)]
mod tests;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use self::border::Border;
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::mesh::Topology;

/// An overlap whose mean width is below this part of the mesh's extent is a touch: rounding of the flattening leaves
/// about 1e-13 of it, a cutter sees 1e-5 of it at the most.
const TOUCH: f64 = 1e-9;

/// A place on a border of the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BorderPlace {
    /// The half-edge of the mesh.
    pub halfedge: u32,
    /// How far along it, in [0, 1].
    pub along: f64,
}

impl BorderPlace {
    /// The value there of something that the mesh's vertices have, between the two of the half-edge.
    #[must_use]
    pub fn of<T>(self, topology: &Topology, values: &[T]) -> T
    where
        T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
    {
        let [a, b] = [topology.origin(self.halfedge), topology.target(self.halfedge)];
        values[a as usize] * (1.0 - self.along) + values[b as usize] * self.along
    }
}

/// A part of the plane that the mesh covers more than once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Overlap {
    /// Its area, mm^2. Where the mesh lies three times or more it counts once.
    pub area_mm2: f64,
    /// A place on its edge: where two borders cross, if any do.
    pub at: DVec2,
    /// Least and greatest corner of its box.
    pub bounds: [DVec2; 2],
    /// The two places on the mesh's borders that meet at `at`; one when no borders cross there.
    pub places: Vec<BorderPlace>,
}

/// The overlaps of a flat mesh.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Overlaps {
    /// The regions, the largest first.
    pub regions: Vec<Overlap>,
    /// Area of all that is covered more than once, mm^2.
    pub area_mm2: f64,
    /// False when the borders cross too often to be sorted out: then `regions` is empty although there are overlaps.
    pub complete: bool,
}

/// Finds the overlaps of a flat mesh without flips. `flat[k]` is the place of vertex `k`; borders of what is not flattened
/// (NaN) are not looked at.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub fn overlaps(flat: &[DVec2], topology: &Topology, observer: &dyn Observer) -> Result<Overlaps, EngineError> {
    of_border(&Border::new(flat, topology), observer)
}

fn of_border(border: &Border, observer: &dyn Observer) -> Result<Overlaps, EngineError> {
    if border.points.is_empty() {
        return Ok(Overlaps { complete: true, ..Overlaps::default() });
    }
    let tree = border.tree();
    let Some(crossings) = border.crossings(&tree, observer)? else { return Ok(Overlaps::default()) };
    let starts = (0..border.loops.len())
        .map(|number| {
            observer.check()?;
            Ok(border.start(&tree, number))
        })
        .collect::<Result<Vec<_>, EngineError>>()?;
    observer.check()?;
    Ok(regions::regions(border, &crossings, &starts))
}
