//! Tables 5.7 and 5.8: the optimum flattening of each configuration, under several readings.

use anyhow::Result;
use planish::engine::flattening::Readings;
use planish::engine::mesh::Mesh;

use crate::panels::{COMPARED, Panel, backlight, windscreen};
use crate::table::{NONE, OURS, THESIS, Table, note};
use crate::trial::{Trial, median, name};

/// Area change in percent and per triangle, shape change in percent and per edge, seed success in percent: chevron,
/// diamond, regular, optimised.
const TABLE_5_7: [[f64; 5]; 4] = [
    [0.49, 0.405, 0.134, 0.515, 54.0],
    [0.492, 0.457, 0.135, 0.601, 34.0],
    [0.475, 0.4, 0.137, 0.591, 92.0],
    [0.478, 0.428, 0.128, 0.589, 30.0],
];
const TABLE_5_8: [[f64; 5]; 4] = [
    [0.192, 0.220, 0.052, 0.314, 69.0],
    [0.205, 0.294, 0.057, 0.38, 26.0],
    [0.178, 0.209, 0.058, 0.322, 90.0],
    [0.181, 0.317, 0.055, 0.461, 20.0],
];

/// For each of [`COMPARED`] its row in the thesis.
pub(crate) const PRINTED_ROW: [usize; 5] = [0, 0, 1, 2, 3];

const HEAD: [&str; 8] =
    ["Configuration", "", "area %", "mm2/triangle", "shape %", "mm/edge", "Seed success %", "median area %"];

/// Tables 5.7 and 5.8.
pub(crate) fn optima(readings: &[Readings]) -> Result<()> {
    of_panel(&backlight(), "Table 5.7", &TABLE_5_7, readings)?;
    of_panel(&windscreen(), "Table 5.8", &TABLE_5_8, readings)?;
    note(
        "Area and shape change are those of the optimum seed; the averages count changes above 0.1 mm2 and 0.1 mm; the last \
         column is the median over all seeds that succeed.",
    );
    Ok(())
}

fn of_panel(panel: &Panel, title: &str, printed: &[[f64; 5]; 4], all_readings: &[Readings]) -> Result<()> {
    let rows = ["Chevron", "Diamond", "Regular", "RATC Optimised"].map(String::from);
    let mut orders = vec![format!("thesis: {}", ranking(rows.into_iter().zip(printed.iter().map(|row| row[0]))))];
    let meshes = COMPARED.map(|(_, diagonals)| panel.mesh(diagonals));
    let meshes = meshes.into_iter().collect::<Result<Vec<Mesh>>>()?;
    for (k, readings) in all_readings.iter().copied().enumerate() {
        let usual = if k == 0 { ", the default" } else { "" };
        let mut table = Table::new(&format!("{title}. {}: {}{usual}", panel.name, name(readings)), &HEAD);
        let mut changes = Vec::new();
        for ((label, _), (mesh, row)) in COMPARED.iter().zip(meshes.iter().zip(PRINTED_ROW)) {
            let [area, per_triangle, shape, per_edge, success] = printed[row];
            let printed = [area, per_triangle, shape, per_edge].map(|x| format!("{x:.3}"));
            let success = [format!("{success:.0}"), NONE.to_owned()];
            table.labelled(&[label, THESIS], printed.into_iter().chain(success));
            let trial = Trial::of(mesh, readings)?;
            let success = format!("{:.1}", trial.success_percent());
            let ours = match trial.optimum {
                Some(o) => {
                    [o.area_percent, o.area_average, o.shape_percent, o.shape_average].map(|x| format!("{x:.3}"))
                }
                None => [NONE; 4].map(str::to_owned),
            };
            let middle = median(&trial.area).map_or_else(|| NONE.to_owned(), |x| format!("{x:.3}"));
            table.labelled(&["", OURS], ours.into_iter().chain([success, middle]));
            if let Some(optimum) = trial.optimum {
                changes.push(((*label).to_owned(), optimum.area_percent));
            }
        }
        table.print();
        orders.push(format!("{}: {}", name(readings), ranking(changes.into_iter())));
    }
    note(&format!("{title}, least area change first:\n- {}", orders.join("\n- ")));
    Ok(())
}

/// The labels from the least to the greatest figure.
fn ranking(figures: impl Iterator<Item = (String, f64)>) -> String {
    let mut list: Vec<(String, f64)> = figures.collect();
    list.sort_by(|a, b| a.1.total_cmp(&b.1));
    list.into_iter().map(|(label, _)| label).collect::<Vec<_>>().join(" < ")
}
