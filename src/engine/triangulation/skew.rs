//! Skewed sampling of a grid (thesis 6.1, Figure 6.3): points are moved along their own row or column of the domain, so that
//! the strings of points no longer follow the surface's lines of zero curvature.
//!
//! Along one side of the domain each point but the two ends is moved by a share of the way to its next neighbour on that
//! side; the share falls linearly, in the parameter, to nothing on the opposite side. A skew of u moves points along v = first
//! or v = last, one of v along u = first or u = last. Both together are applied to the unskewed points. With
//! [`SkewedPoints::Odd`] only points (i, j) with i and j odd are moved: the thesis's severe case.
//!
//! Limits: a skew of less than a whole cell keeps neighbours of one row or column apart, but where both directions are
//! skewed and neighbours are not, triangles of the domain can turn over. They are found exactly and refused.

use glam::DVec2;
use robust::{Coord, orient2d};
use serde::{Deserialize, Serialize};

use super::{DomainMesh, GridLines, TriangulationError};
use crate::engine::error::Place;

/// The side of the domain along which points are moved in full.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SkewedSide {
    /// That of the first parameter of the other direction.
    #[default]
    First,
    /// That of its last.
    Last,
}

/// Which points are moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SkewedPoints {
    /// All but those at the ends of their row or column.
    #[default]
    All,
    /// Of these only those whose numbers i and j are both odd.
    Odd,
}

/// The skew of a grid's sampling.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Skew {
    /// How far points are moved along u: 100 would be to the next point, a negative number moves to the one before.
    pub u_percent: f64,
    /// The same along v.
    pub v_percent: f64,
    /// The side, v first or v last, along which the skew of u is full.
    pub u_along: SkewedSide,
    /// The side, u first or u last, along which the skew of v is full.
    pub v_along: SkewedSide,
    /// Which points are moved.
    pub points: SkewedPoints,
}

impl Skew {
    /// A skew must be less than this, in percent: at a whole cell points would meet.
    pub const LIMIT_PERCENT: f64 = 100.0;

    /// The skewed points of a grid, numbered as in its mesh.
    #[must_use]
    pub fn points(&self, lines: &GridLines) -> Vec<DVec2> {
        let (m, n) = (lines.u.len(), lines.v.len());
        let weights = |lines: &[f64], side| (0..lines.len()).map(|k| weight(lines, k, side)).collect::<Vec<f64>>();
        let (along_v, along_u) = (weights(&lines.v, self.u_along), weights(&lines.u, self.v_along));
        let mut points = Vec::with_capacity(m * n);
        for (j, &of_u) in along_v.iter().enumerate() {
            for (i, &of_v) in along_u.iter().enumerate() {
                let moved = self.points == SkewedPoints::All || (i % 2 == 1 && j % 2 == 1);
                let by = |lines: &[f64], k: usize, percent: f64, weight: f64| {
                    if moved { lines[k] + percent / 100.0 * weight * step(lines, k, percent) } else { lines[k] }
                };
                let u = by(&lines.u, i, self.u_percent, of_u);
                let v = by(&lines.v, j, self.v_percent, of_v);
                points.push(DVec2::new(u, v));
            }
        }
        points
    }

    /// Moves the points of a whole grid's mesh.
    ///
    /// # Errors
    /// [`TriangulationError::SkewTurnsOver`] when a triangle of the domain is no longer anticlockwise.
    pub fn apply(&self, mesh: &mut DomainMesh, lines: &GridLines) -> Result<(), TriangulationError> {
        mesh.uv = self.points(lines);
        let coord = |v: u32| Coord { x: mesh.uv[v as usize].x, y: mesh.uv[v as usize].y };
        let turned = |t: &[u32; 3]| orient2d(coord(t[0]), coord(t[1]), coord(t[2])) <= 0.0;
        let mut over = mesh.triangles.iter().enumerate().filter(|(_, t)| turned(t));
        let Some((triangle, corners)) = over.next() else { return Ok(()) };
        let triangles = 1 + over.count() as u64;
        let middle = corners.iter().map(|&v| mesh.uv[v as usize]).sum::<DVec2>() / 3.0;
        let place = Place { triangle: Some(triangle as u32), uv: Some(middle.to_array()), ..Place::default() };
        Err(TriangulationError::SkewTurnsOver { triangles, place: Box::new(place) })
    }
}

/// How much of the skew a line has: all of it on its side, none on the opposite one.
fn weight(lines: &[f64], k: usize, side: SkewedSide) -> f64 {
    let (first, last) = (lines[0], lines[lines.len() - 1]);
    match side {
        SkewedSide::First => (last - lines[k]) / (last - first),
        SkewedSide::Last => (lines[k] - first) / (last - first),
    }
}

/// The way to the neighbour that a point is moved to; none at the ends, which stay.
fn step(lines: &[f64], k: usize, percent: f64) -> f64 {
    if k == 0 || k + 1 == lines.len() {
        0.0
    } else if percent > 0.0 {
        lines[k + 1] - lines[k]
    } else {
        lines[k] - lines[k - 1]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::nurbs::Domain;
    use crate::engine::triangulation::{Configuration, grid_mesh};

    fn lines(m: usize, n: usize) -> GridLines {
        GridLines::uniform(Domain { u: [0.0, 1.0], v: [0.0, 1.0] }, m, n)
    }

    #[test]
    fn points_are_those_of_the_reference_cases() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/cases/cylinder.json");
        let Ok(text) = std::fs::read_to_string(path) else {
            println!("reference cases are not there: nothing compared");
            return;
        };
        let cases: serde_json::Value = serde_json::from_str(&text).unwrap();
        let last = SkewedSide::Last;
        let skews = [
            ("test1_uniform", Skew::default()),
            ("test2_u_skew", Skew { u_percent: 90.0, ..Skew::default() }),
            ("test3_v_skew", Skew { v_percent: -90.0, v_along: last, ..Skew::default() }),
            ("test3_v_skew_plus", Skew { v_percent: 90.0, v_along: last, ..Skew::default() }),
            (
                "severe",
                Skew {
                    u_percent: -90.0,
                    v_percent: -90.0,
                    u_along: last,
                    points: SkewedPoints::Odd,
                    ..Skew::default()
                },
            ),
        ];
        for (name, skew) in skews {
            let expected: Vec<[f64; 2]> = serde_json::from_value(cases["cases"][name]["uv"].clone()).unwrap();
            let found = skew.points(&lines(20, 20));
            assert_eq!(found.len(), expected.len());
            for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
                assert!(found.distance(DVec2::from(expected)) < 1e-14, "{name}, point {k}: {found} {expected:?}");
            }
        }
    }

    #[test]
    fn triangles_that_turn_over_are_refused_with_their_place() {
        let lines = lines(20, 20);
        let skew = Skew {
            u_percent: -90.0,
            v_percent: -90.0,
            u_along: SkewedSide::Last,
            points: SkewedPoints::Odd,
            ..Skew::default()
        };
        let mut along = grid_mesh(&lines, Configuration::Regular, 0);
        assert_eq!(skew.apply(&mut along, &lines), Ok(()));
        let mut across = grid_mesh(&lines, Configuration::RegularMirrored, 0);
        let error = skew.apply(&mut across, &lines).expect_err("points beyond the diagonals across them");
        let TriangulationError::SkewTurnsOver { triangles, place } = error else { panic!("{error}") };
        assert!(triangles > 0 && place.triangle.is_some() && place.uv.is_some());
    }

    proptest! {
        #[test]
        fn one_direction_alone_turns_nothing_over_and_borders_stay(
            percent in -99.9..99.9_f64, along_last in any::<bool>(), of_v in any::<bool>(), m in 2_usize..9, n in 2_usize..9
        ) {
            let side = if along_last { SkewedSide::Last } else { SkewedSide::First };
            let skew = if of_v {
                Skew { v_percent: percent, v_along: side, ..Skew::default() }
            } else {
                Skew { u_percent: percent, u_along: side, ..Skew::default() }
            };
            let lines = lines(m, n);
            for configuration in [Configuration::Regular, Configuration::RegularMirrored, Configuration::Diamond] {
                let mut mesh = grid_mesh(&lines, configuration, 0);
                prop_assert_eq!(skew.apply(&mut mesh, &lines), Ok(()));
                for (k, p) in mesh.uv.iter().enumerate() {
                    let (i, j) = (k % m, k / m);
                    prop_assert!(i != 0 || p.x == 0.0);
                    prop_assert!(i != m - 1 || p.x == 1.0);
                    prop_assert!(j != 0 || p.y == 0.0);
                    prop_assert!(j != n - 1 || p.y == 1.0);
                }
            }
        }
    }
}
