//! Tables 5.9 to 5.11: triangles and averaged points by level of the mapping order.

use anyhow::Result;
use planish::engine::flattening::cader::flatten_once;
use planish::engine::flattening::{Anchor, LevelCounts, Order, Parent};
use planish::engine::mesh::Topology;
use planish::engine::triangulation::Configuration;

use crate::panels::{Diagonals, backlight};
use crate::table::{OURS, THESIS, Table, note};
use crate::trial::{name, reading};

/// Levels that the tables print: the seed and eleven more.
const LEVELS: usize = 12;

/// Triangles and averaged points a level, as printed; (5.8) and (5.9) share theirs.
const SIX: [[u32; LEVELS]; 2] = [[1, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 33], [0, 0, 0, 3, 3, 6, 6, 9, 9, 12, 12, 15]];
const DIAMOND: [[u32; LEVELS]; 2] =
    [[1, 3, 5, 8, 11, 13, 16, 19, 21, 24, 27, 29], [0, 0, 1, 1, 4, 5, 5, 8, 9, 9, 12, 13]];
const DUPLICATES: [u32; LEVELS] = [0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 3, 0];

/// Tables 5.9 to 5.11.
pub(crate) fn levels() -> Result<()> {
    let cases = [
        ("Table 5.9. Regular", Configuration::Regular, SIX, [0; LEVELS]),
        ("Table 5.10. Chevron (rows)", Configuration::ChevronRows, SIX, [0; LEVELS]),
        ("Table 5.10. Chevron (columns)", Configuration::ChevronColumns, SIX, [0; LEVELS]),
        ("Table 5.11. Diamond", Configuration::Diamond, DIAMOND, DUPLICATES),
    ];
    let mut same = Vec::new();
    for (title, configuration, [triangles, averaged], duplicates) in cases {
        let head: Vec<String> =
            ["Level", "", "seed"].map(str::to_owned).into_iter().chain((1..LEVELS).map(|k| k.to_string())).collect();
        let mut table = Table::new(title, &head.iter().map(String::as_str).collect::<Vec<_>>());
        let first = counts(configuration, Order::Index, Parent::First)?;
        let of = |count: fn(&LevelCounts) -> u32| first.iter().map(count).collect::<Vec<u32>>();
        let mut pair = |label: &str, printed: &[u32], ours: &[u32]| {
            table.labelled(&[label, THESIS], printed);
            table.labelled(&["", OURS], ours);
            same.push((format!("{title}, {label}"), printed == ours));
        };
        pair("Triangles", &triangles, &of(|l| l.triangles));
        pair("Total", &running(&triangles), &running(&of(|l| l.triangles)));
        pair("Averaged points (AP)", &averaged, &of(|l| l.averaged));
        pair("Total AP", &running(&averaged), &running(&of(|l| l.averaged)));
        if configuration == Configuration::Diamond {
            table.labelled(&["Duplicate AP", THESIS], duplicates);
            for (order, parent) in [
                (Order::Index, Parent::First),
                (Order::Index, Parent::Last),
                (Order::Fifo, Parent::First),
                (Order::Fifo, Parent::Last),
            ] {
                let ours: Vec<u32> = counts(configuration, order, parent)?.iter().map(|l| l.duplicates).collect();
                let label = name(reading(order, parent, Anchor::End));
                table.labelled(&["", label.trim_end_matches(", end")], &ours);
                same.push((format!("{title}, duplicates, {label}"), duplicates[..] == ours[..]));
            }
        }
        table.print();
    }
    let equal = same.iter().filter(|(_, equal)| *equal).count();
    let others: Vec<&str> = same.iter().filter(|(_, equal)| !equal).map(|(row, _)| row.as_str()).collect();
    note(&format!("{equal} of {} rows are the thesis's to the last figure. Not: {}.", same.len(), others.join("; ")));
    Ok(())
}

/// Counts of the first levels from the middle of the backlight's grid.
fn counts(configuration: Configuration, order: Order, parent: Parent) -> Result<Vec<LevelCounts>> {
    let panel = backlight();
    let mesh = panel.mesh(Diagonals::Named(configuration))?;
    let [m, n] = panel.points;
    let seed = 2 * ((n / 2 - 1) * (m - 1) + m / 2 - 1) as u32;
    let readings = reading(order, parent, Anchor::End);
    let (flattening, _) = flatten_once(&mesh, &Topology::new(&mesh)?, readings, seed)?;
    Ok(flattening.levels.into_iter().take(LEVELS).collect())
}

fn running(counts: &[u32]) -> Vec<u32> {
    let mut sum = 0;
    let add = |count: &u32| {
        sum += count;
        sum
    };
    counts.iter().map(add).collect()
}
