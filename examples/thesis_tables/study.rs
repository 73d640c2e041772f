//! The study that thesis chapter 7 asks for: does a mesh that estimates curvature better also flatten better?
//!
//! On each surface many configurations are made from the same points: the named ones, diagonals by chance with equal odds,
//! and ones where only every fourth or eighth diagonal is `\`, so that errors are spread between the regular configuration's
//! and the random ones'. Each gets the sum of |estimate - K| over its interior vertices, by each estimate, and an exhaustive
//! seed search. The answer is Spearman's rank correlation: +1 when a larger error always goes with a larger change.

use anyhow::Result;
use planish::engine::triangulation::Configuration;

use crate::curvature::{ESTIMATES, Sampled};
use crate::panels::{Diagonals, Panel, backlight, bulging_sheet, saddle, windscreen};
use crate::table::{NONE, Table, note};
use crate::trial::{READINGS, Trial, median};

/// Points along u and v: few, so that a search is short and there can be many.
const POINTS: [usize; 2] = [20, 20];

/// Configurations by chance of each density of `\`: 1/2, 1/4, 1/8.
const RANDOM: [(u32, u32); 3] = [(1, 40), (2, 16), (3, 16)];

const NAMED: [Configuration; 6] = [
    Configuration::Regular,
    Configuration::RegularMirrored,
    Configuration::Diamond,
    Configuration::ChevronRows,
    Configuration::ChevronColumns,
    Configuration::Fitted,
];

/// One configuration: error sums by the estimates, optimum's and median change, share of seeds that fail.
struct Point {
    errors: [f64; ESTIMATES.len()],
    changes: [f64; 3],
}

/// The table of correlations.
pub(crate) fn error_against_distortion() -> Result<()> {
    let head = [
        "Surface",
        "configurations",
        "estimate",
        "optimum's area change",
        "median area change",
        "failing seeds",
        "5 % level",
    ];
    let mut table = Table::new("Chapter 7's question: rank correlation of the curvature error with ...", &head);
    for panel in [backlight(), windscreen(), bulging_sheet(40.0), saddle()] {
        let panel = panel.with_points(POINTS);
        let mut random = Vec::new();
        for (sparsity, count) in RANDOM {
            for seed in 0..count {
                random.extend(point(&panel, Diagonals::Sparse { seed, sparsity })?.map(|point| (sparsity, point)));
            }
        }
        let mut named = Vec::new();
        for configuration in NAMED {
            named.extend(point(&panel, Diagonals::Named(configuration))?);
        }
        let even: Vec<&Point> = random.iter().filter(|(sparsity, _)| *sparsity == 1).map(|(_, point)| point).collect();
        let all: Vec<&Point> = random.iter().map(|(_, point)| point).chain(&named).collect();
        for (name, points) in [("all", all), ("random, even odds", even)] {
            for (k, (estimate, _)) in ESTIMATES.iter().enumerate() {
                let errors: Vec<f64> = points.iter().map(|point| point.errors[k]).collect();
                let correlations = [0, 1, 2].map(|c| {
                    let changes: Vec<f64> = points.iter().map(|point| point.changes[c]).collect();
                    correlation(&errors, &changes).map_or_else(|| NONE.to_owned(), |rho| format!("{rho:+.2}"))
                });
                let count = format!("{} ({name})", points.len());
                let level = format!("{:.2}", 1.96 / ((points.len().max(2) - 1) as f64).sqrt());
                table.row(
                    [panel.name.to_owned(), count, (*estimate).to_owned()]
                        .into_iter()
                        .chain(correlations)
                        .chain([level]),
                );
            }
        }
    }
    table.print();
    note(
        "20 x 20 points, readings of the default. Beyond the 5 % level a correlation is more than chance gives in one of \
         twenty. \"All\" are 6 named configurations, 40 random ones with even odds, and 32 where every fourth or eighth \
         diagonal is turned; a configuration that no seed flattens is left out.",
    );
    Ok(())
}

/// `None` when no seed flattens the mesh.
fn point(panel: &Panel, diagonals: Diagonals) -> Result<Option<Point>> {
    let mesh = panel.mesh(diagonals)?;
    let sampled = Sampled::of(panel, &mesh)?;
    let trial = Trial::of(&mesh, READINGS[0])?;
    let (Some(optimum), Some(middle)) = (trial.optimum, median(&trial.area)) else { return Ok(None) };
    let errors = ESTIMATES.map(|(_, estimate)| sampled.differences(estimate).sum);
    Ok(Some(Point { errors, changes: [optimum.area_percent, middle, 100.0 - trial.success_percent()] }))
}

/// Spearman's rank correlation; `None` where one side is all the same.
pub(crate) fn correlation(xs: &[f64], ys: &[f64]) -> Option<f64> {
    let (a, b) = (ranks(xs), ranks(ys));
    let mean = f64::midpoint(xs.len() as f64, 1.0);
    let product = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(p, q)| (p - mean) * (q - mean)).sum::<f64>();
    let scale = (product(&a, &a) * product(&b, &b)).sqrt();
    (scale > 0.0).then(|| product(&a, &b) / scale)
}

/// Ranks from 1; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |x: f64| {
        let below = values.iter().filter(|y| **y < x).count() as f64;
        let equal = values.iter().filter(|y| **y == x).count() as f64;
        below + f64::midpoint(equal, 1.0)
    };
    values.iter().map(|&x| rank(x)).collect()
}
