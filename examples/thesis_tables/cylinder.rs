//! Tests 1 to 3 of thesis 6.1 and its severe case: a part of a cylinder, sampled uniformly and skewed.
//!
//! u runs along the axis, v around; 20 x 20 points, regular diagonals. The thesis says neither how much of the circle its
//! part is nor how long it is: half a cylinder of length 0.55 of its arc is one choice; it gives the severe case's number of
//! seeds under one reading. Points are those of the circle itself.

use std::f64::consts::PI;

use anyhow::Result;
use glam::{DVec2, DVec3};
use planish::engine::curvature::rings;
use planish::engine::flattening::cader::flatten_once;
use planish::engine::flattening::{Anchor, Order, Parent, Readings};
use planish::engine::mesh::measures::areas;
use planish::engine::mesh::{Mesh, Topology};
use planish::engine::nurbs::Domain;
use planish::engine::triangulation::{Configuration, GridLines, Skew, SkewedPoints, SkewedSide, grid_mesh};

use crate::study::correlation;
use crate::table::{NONE, OURS, THESIS, Table, figure, figure_or_none, note};
use crate::trial::{Trial, name, reading};

/// Points along u and v.
const POINTS: usize = 20;
/// Length over radius.
const LENGTH: f64 = 0.55 * PI;

/// Below this share of the area, percent, a change is rounding.
const ROUNDING_PERCENT: f64 = 1e-9;

struct Case {
    title: &'static str,
    skew: Option<Skew>,
    /// Least area and shape change, greatest area and shape change, percent; seeds that succeed.
    printed: [&'static str; 5],
}

fn cases() -> Vec<Case> {
    let none = Skew::default();
    let skew_v = Skew { v_percent: -90.0, v_along: SkewedSide::Last, ..none };
    let severe =
        Skew { u_percent: -90.0, v_percent: -90.0, u_along: SkewedSide::Last, points: SkewedPoints::Odd, ..none };
    let zero = ["0", "0", NONE, NONE, NONE];
    vec![
        Case { title: "Test 1. Uniform", skew: None, printed: zero },
        Case { title: "Test 2. u skewed by 90 %", skew: Some(Skew { u_percent: 90.0, ..none }), printed: zero },
        Case {
            title: "Test 3. v skewed by 90 %",
            skew: Some(skew_v),
            printed: ["0.00136", "0.006", "0.02", "0.025", NONE],
        },
        Case {
            title: "Test 3, v skewed the other way",
            skew: Some(Skew { v_percent: 90.0, ..skew_v }),
            printed: ["0.00136", "0.006", "0.02", "0.025", NONE],
        },
        Case { title: "Severe case", skew: Some(severe), printed: [NONE, NONE, "9.26", "2.83", "375"] },
    ]
}

/// All tests under all readings of order, parent and anchor.
pub(crate) fn tests() -> Result<()> {
    let mut greatest_curvature = Vec::new();
    for case in cases() {
        let mesh = mesh(case.skew.as_ref())?;
        let topology = Topology::new(&mesh)?;
        let curvatures = rings(&mesh, &topology).into_iter().flatten().map(|ring| ring.compensated());
        let [least, greatest] =
            curvatures.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        greatest_curvature.push((case.title, greatest));
        let head =
            ["Reading", "", "least area %", "least shape %", "greatest area %", "greatest shape %", "seeds of 722"];
        let mut table = Table::new(case.title, &head);
        table.labelled(&["", THESIS], case.printed);
        for readings in readings() {
            let trial = Trial::of(&mesh, readings)?;
            let of_optimum = trial.optimum.map(|o| [o.area_percent, o.shape_percent]);
            let change = |x: Option<f64>| {
                x.map_or_else(|| NONE.to_owned(), |x| if x < ROUNDING_PERCENT { "0".to_owned() } else { figure(x) })
            };
            let figures = [
                change(of_optimum.map(|[area, _]| area)),
                change(of_optimum.map(|[_, shape]| shape)),
                change(trial.area.last().copied()),
                change(trial.shape.last().copied()),
                trial.succeeded.to_string(),
            ];
            table.labelled(&[&name(readings), OURS], figures);
        }
        table.print();
        let zero = |x: f64| if x.abs() < 1e-10 { "0".to_owned() } else { figure(x) };
        note(&format!("K of the mesh by (5.7), in units of 1/radius^2: {} to {}.", zero(least), zero(greatest)));
    }
    movement_and_area()?;
    if let [.., (_, test_3), _, (_, severe)] = greatest_curvature[..] {
        let factor = figure_or_none(Some(severe / test_3));
        note(&format!(
            "Greatest K, severe case over Test 3: thesis 6, ours {factor}. \"Least shape\" is that of the seed of least area change."
        ));
    }
    Ok(())
}

/// Movements and changes below this, relative to the radius and its square, are rounding.
const ROUNDING: f64 = 1e-12;

/// Figures 6.6 and 6.7: whether triangles change their area where vertices are moved by averaging.
fn movement_and_area() -> Result<()> {
    let mut table = Table::new(
        "Figures 6.6 and 6.7. Test 3 from the optimum seed: vertices moved, triangles changed",
        &["Reading", "vertices moved", "triangles changed", "of these without a moved corner", "rank correlation"],
    );
    let skew = cases().into_iter().find(|case| case.title.starts_with("Test 3")).and_then(|case| case.skew);
    let mesh = mesh(skew.as_ref())?;
    let topology = Topology::new(&mesh)?;
    for readings in readings() {
        let Some(optimum) = Trial::of(&mesh, readings)?.optimum else { continue };
        let (flattening, _) = flatten_once(&mesh, &topology, readings, optimum.seed)?;
        let movement: Vec<f64> = (mesh.triangles.iter())
            .map(|corners| corners.iter().map(|&v| flattening.movement[v as usize]).fold(0.0, f64::max))
            .collect();
        let change: Vec<f64> = (mesh.triangles.iter().zip(areas(&mesh)))
            .map(|(corners, area)| {
                let [a, b, c] = corners.map(|v| flattening.flat[v as usize]);
                (0.5 * (b - a).perp_dot(c - a) - area).abs()
            })
            .collect();
        let changed = || movement.iter().zip(&change).filter(|(_, change)| **change > ROUNDING);
        let rank = correlation(&movement, &change).map_or_else(|| NONE.to_owned(), |rho| format!("{rho:+.2}"));
        table.row([
            name(readings),
            format!("{} of {}", flattening.movement.iter().filter(|m| **m > ROUNDING).count(), mesh.positions.len()),
            format!("{} of {}", changed().count(), mesh.triangles.len()),
            changed().filter(|(movement, _)| **movement <= ROUNDING).count().to_string(),
            rank,
        ]);
    }
    table.print();
    Ok(())
}

/// The eight readings of order, parent and anchor, the default first.
fn readings() -> Vec<Readings> {
    let mut all = Vec::new();
    for order in [Order::Index, Order::Fifo] {
        for parent in [Parent::First, Parent::Last] {
            all.extend([Anchor::End, Anchor::Start].map(|anchor| reading(order, parent, anchor)));
        }
    }
    all
}

/// The mesh on half a cylinder of radius 1.
fn mesh(skew: Option<&Skew>) -> Result<Mesh> {
    let lines = GridLines::uniform(Domain { u: [0.0, 1.0], v: [0.0, 1.0] }, POINTS, POINTS);
    let mut domain = grid_mesh(&lines, Configuration::Regular, 0);
    if let Some(skew) = skew {
        skew.apply(&mut domain, &lines)?;
    }
    let at = |p: &DVec2| {
        let angle = (p.y - 0.5) * PI;
        DVec3::new(LENGTH * p.x, angle.sin(), angle.cos())
    };
    Ok(Mesh { positions: domain.uv.iter().map(at).collect(), uv: Some(domain.uv), triangles: domain.triangles })
}
