//! Tables 6.1 to 6.5: triangulation along lines of minimum curvature against the regular grid.

use anyhow::Result;
use glam::DVec3;
use planish::engine::budget::Unobserved;
use planish::engine::curvature::Ring;
use planish::engine::flattening::Readings;
use planish::engine::mesh::{Mesh, Topology};
use planish::engine::nurbs::Surface;
use planish::engine::triangulation::ampc::{AmpcBorder, AmpcFamilies, AmpcOptions, Integration, NpRule, ampc};
use planish::engine::triangulation::{Configuration, lift};

use crate::curvature::{DIFFERENCE_HEAD, Sampled};
use crate::panels::{Diagonals, Panel, backlight, windscreen};
use crate::shapes::knots;
use crate::table::{NONE, OURS, THESIS, Table, figure, figure_or_none, note};
use crate::trial::{READINGS, Trial, median, name};

/// What the thesis prints of one panel.
struct Printed {
    /// Table 6.1: vertices, edges, triangles.
    counts: [u32; 3],
    /// Table 6.2: least and greatest K at the vertices.
    own: [f64; 2],
    /// Table 6.3: a row as in Table 5.5.
    estimated: [f64; 5],
    /// Tables 6.4 and 6.5: rows as in Table 5.7.
    along: [f64; 5],
    regular: [f64; 5],
}

const BACKLIGHT: Printed = Printed {
    counts: [3542, 10_381, 6840],
    own: [0.000_022, 0.000_098],
    estimated: [0.000_021, 0.000_098, 0.0, 0.000_004, 0.000_000_74],
    along: [0.452, 0.378, 0.131, 0.548, 88.0],
    regular: [0.475, 0.4, 0.137, 0.591, 92.0],
};
const WINDSCREEN: Printed = Printed {
    counts: [4901, 14_392, 9492],
    own: [0.000_002, 0.000_088],
    estimated: [0.000_002, 0.000_091, 0.0, 0.000_009, 0.000_000_31],
    along: [0.16, 0.196, 0.052, 0.299, 90.0],
    regular: [0.178, 0.209, 0.058, 0.322, 90.0],
};

/// The thesis's method: thin cells at the border left out.
const AS_PRINTED: AmpcOptions = AmpcOptions {
    np_rule: NpRule::Needed,
    starts: 8,
    drop_thin: true,
    min_distance_mm: 1.0,
    integration: Integration::Cells,
    border: AmpcBorder::Clamped,
    families: AmpcFamilies::One,
    direction: planish::engine::triangulation::ampc::AmpcDirection::Modal,
};

const FREE: AmpcOptions =
    AmpcOptions { drop_thin: false, integration: Integration::RungeKutta, border: AmpcBorder::Free, ..AS_PRINTED };

/// What Tables 6.4 and 6.5 compare, and how it goes beyond them.
const VARIANTS: [(&str, AmpcOptions); 2] = [("AMPC", AS_PRINTED), ("AMPC, free border, 4th order", FREE)];

fn mesh(surface: &Surface, points: [usize; 2], options: &AmpcOptions) -> Result<Mesh> {
    let made = ampc(surface, points.map(|count| count as u32), options, &Unobserved)?;
    Ok(lift(surface, made.domain, &made.lines).mesh)
}

/// The panels at the densities of 6.5.1.
fn panels() -> [(Panel, Printed); 2] {
    [(backlight().with_points([62, 62]), BACKLIGHT), (windscreen(), WINDSCREEN)]
}

/// Tables 6.1 to 6.3.
pub(crate) fn meshes() -> Result<()> {
    let head = ["Surface", "", "Vertices", "Edges", "Triangles", "lines found", "lines in all", "cells dropped"];
    let mut counts = Table::new("Table 6.1. AMPC: topological data", &head);
    let mut own = Table::new("Table 6.2. Surface's own K at its vertices, per cm2", &["Surface", "", "K min", "K max"]);
    let mut estimated = Table::new("Table 6.3. K by (5.7), per cm2", &DIFFERENCE_HEAD);
    let mut gains = Vec::new();
    for (panel, printed) in panels() {
        let rest = [NONE; 3].map(str::to_owned);
        counts.labelled(&[panel.name, THESIS], printed.counts.map(|x| x.to_string()).into_iter().chain(rest));
        for (label, np_rule) in [("needed", NpRule::Needed), ("printed (6.1)", NpRule::Printed)] {
            let options = AmpcOptions { np_rule, ..AS_PRINTED };
            let made = ampc(&panel.surface, panel.points.map(|count| count as u32), &options, &Unobserved)?;
            let found = made.counts;
            let mesh = lift(&panel.surface, made.domain, &made.lines).mesh;
            counts.labelled(
                &["", label],
                [
                    mesh.positions.len() as u64,
                    Topology::new(&mesh)?.edge_count() as u64,
                    mesh.triangles.len() as u64,
                    u64::from(found.minimum.polylines_found),
                    u64::from(found.minimum.polylines_inner + found.minimum.beyond[0] + found.minimum.beyond[1]),
                    found.cells_dropped,
                ],
            );
        }
        let along = Sampled::of(&panel, &mesh(&panel.surface, panel.points, &AS_PRINTED)?)?;
        own.labelled(&[panel.name, THESIS], printed.own.map(figure));
        own.labelled(&["", OURS], along.own().map(figure));
        estimated.labelled(&[panel.name, THESIS], printed.estimated.map(figure));
        estimated.labelled(&["", OURS], along.row());
        let regular = Sampled::of(&panel, &panel.mesh(Diagonals::Named(Configuration::Regular))?)?;
        let mean = |sampled: &Sampled| sampled.differences(Ring::compensated).mean();
        gains.push(format!("{} {:+.0} %", panel.name, 100.0 * (mean(&along) / mean(&regular) - 1.0)));
    }
    counts.print();
    note(
        "\"needed\" and \"printed\" are the two rules for the lines in between: (6.1)'s -2 is one too many for its purpose.",
    );
    own.print();
    estimated.print();
    note(&format!(
        "Mean difference against the regular grid of the same density: thesis Backlight -4 %, Windscreen -9 %; ours {}.",
        gains.join(", ")
    ));
    Ok(())
}

/// Tables 6.4 and 6.5, and what they were to show.
pub(crate) fn optima(all_readings: &[Readings]) -> Result<()> {
    let head = [
        "Surface",
        "Mesh",
        "",
        "area %",
        "mm2/triangle",
        "shape %",
        "mm/edge",
        "Seed success %",
        "median area %",
        "greatest area %",
    ];
    for (k, readings) in all_readings.iter().copied().enumerate() {
        let usual = if k == 0 { ", the default" } else { "" };
        let mut table = Table::new(&format!("Tables 6.4 and 6.5. {}{usual}", name(readings)), &head);
        let mut gains = Vec::new();
        for (panel, printed) in panels() {
            // Table 6.5 repeats Tables 5.7 and 5.8, whose backlight has 60 x 60 points.
            let grid = if panel.name == "Backlight" { backlight() } else { windscreen() };
            let regular = Trial::of(&grid.mesh(Diagonals::Named(Configuration::Regular))?, readings)?;
            add(&mut table, panel.name, "6.5 regular", Some(printed.regular), &regular);
            for (label, options) in VARIANTS {
                let printed = (options == AS_PRINTED).then_some(printed.along);
                // What goes beyond the thesis is tried under the default alone.
                if printed.is_none() && k > 0 {
                    continue;
                }
                let along = Trial::of(&mesh(&panel.surface, panel.points, &options)?, readings)?;
                add(&mut table, panel.name, if printed.is_some() { "6.4 AMPC" } else { label }, printed, &along);
                if let (Some(before), Some(after)) = (regular.optimum, along.optimum) {
                    let gain = |before: f64, after: f64| format!("{:+.1} %", 100.0 * (after / before - 1.0));
                    gains.push(format!(
                        "{}, {label}: area {}, shape {}",
                        panel.name,
                        gain(before.area_percent, after.area_percent),
                        gain(before.shape_percent, after.shape_percent)
                    ));
                }
            }
        }
        table.print();
        note(&format!(
            "Against the regular grid: thesis Backlight area -5 %, shape -4 %, Windscreen -10 %, -10 %; ours:\n- {}",
            gains.join("\n- ")
        ));
    }
    Ok(())
}

fn add(table: &mut Table, panel: &str, label: &str, printed: Option<[f64; 5]>, trial: &Trial) {
    if let Some([area, per_triangle, shape, per_edge, success]) = printed {
        let figures = [area, per_triangle, shape, per_edge].map(|x| format!("{x:.3}"));
        let rest = [format!("{success:.0}"), NONE.to_owned(), NONE.to_owned()];
        table.labelled(&[panel, label, THESIS], figures.into_iter().chain(rest));
    }
    let ours = match trial.optimum {
        Some(o) => [o.area_percent, o.area_average, o.shape_percent, o.shape_average].map(|x| format!("{x:.3}")),
        None => [NONE; 4].map(str::to_owned),
    };
    let rest = [
        format!("{:.1}", trial.success_percent()),
        figure_or_none(median(&trial.area)),
        figure_or_none(trial.area.last().copied()),
    ];
    let label = if printed.is_some() { "" } else { label };
    table.labelled(&[if printed.is_some() { "" } else { panel }, label, OURS], ours.into_iter().chain(rest));
}

/// Points along u and v of the oblique cylinder.
const OBLIQUE_POINTS: [usize; 2] = [30, 30];

/// The hypothesis of 6.2 on a surface that is developable exactly: a parabolic cylinder whose rulings run oblique to the
/// parameter lines, with which a uniform grid is not developable.
pub(crate) fn oblique_cylinder() -> Result<()> {
    let head = [
        "Mesh",
        "Triangles",
        "least area %",
        "median area %",
        "greatest area %",
        "Seed success %",
        "greatest |K|, 1/cm2",
    ];
    for degrees in [20.0, 40.0] {
        let surface = parabolic_cylinder(degrees);
        let panel = Panel { name: "Oblique", surface, points: OBLIQUE_POINTS };
        let title = format!("6.2's hypothesis: a cylinder whose rulings are {degrees} degrees off the parameter lines");
        let mut table = Table::new(&title, &head);
        let variants = [
            ("AMPC (6.4)", AmpcOptions { drop_thin: false, ..AS_PRINTED }),
            ("AMPC, thin cells dropped", AS_PRINTED),
            ("AMPC, free border", AmpcOptions { integration: Integration::Cells, ..FREE }),
            ("AMPC, free border, 4th order", FREE),
            ("AMPC, free border, both families", AmpcOptions { families: AmpcFamilies::Both, ..FREE }),
        ];
        let mut meshes = vec![("regular grid", panel.mesh(Diagonals::Named(Configuration::Regular)))];
        meshes.extend(variants.map(|(label, options)| (label, mesh(&panel.surface, panel.points, &options))));
        for (label, mesh) in meshes {
            let mesh = match mesh {
                Ok(mesh) => mesh,
                Err(error) => {
                    table.row([format!("{label}: {error}")]);
                    continue;
                }
            };
            let trial = Trial::of(&mesh, READINGS[0])?;
            let greatest = Sampled::of(&panel, &mesh)?.differences(Ring::compensated).greatest;
            table.row([
                label.to_owned(),
                mesh.triangles.len().to_string(),
                figure_or_none(trial.area.first().copied()),
                figure_or_none(median(&trial.area)),
                figure_or_none(trial.area.last().copied()),
                format!("{:.1}", trial.success_percent()),
                figure(greatest),
            ]);
        }
        table.print();
    }
    note(
        "Every figure but the seeds' share would be 0 on a mesh that is developable as the surface is. Reading: the default.",
    );
    Ok(())
}

/// z = (x cos a + y sin a)^2 / 250 over 200 x 200 mm: exact, as a biquadratic patch.
fn parabolic_cylinder(degrees: f64) -> Surface {
    const SIDE: f64 = 200.0;
    let (sin, cos) = f64::to_radians(degrees).sin_cos();
    // Control values over [-1/2, 1/2] of 1, s and s^2.
    let (linear, square) = ([-0.5, 0.0, 0.5], [0.25, -0.25, 0.25]);
    let mut control = Vec::new();
    for i in 0..3 {
        for j in 0..3 {
            let z = cos * cos * square[i] + 2.0 * sin * cos * linear[i] * linear[j] + sin * sin * square[j];
            control.push(DVec3::new(SIDE * linear[i], SIDE * linear[j], SIDE * SIDE * z / 250.0));
        }
    }
    let quadratic = || knots(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    Surface::new(quadratic(), quadratic(), control, None).expect("the net is sound")
}
