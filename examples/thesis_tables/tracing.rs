//! Tables 3.1 to 3.4 and Graph 3.1: cells traced, times, aspect ratios.

use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use planish::engine::budget::Unobserved;
use planish::engine::distortion::AspectRatio;
use planish::engine::triangulation::{
    Configuration, DomainMesh, GridLines, Lifted, TracingCounts, aspect_of, check_domain_mesh, lift, trace,
};
use planish::engine::trimming::TrimRegion;

use crate::models::{self, Model, Row};
use crate::table::{NONE, OURS, THESIS, Table, figure, note};

/// Runs of which the fastest counts: on a machine that does other things too the least is nearest to the work itself.
const RUNS: usize = 7;

/// How far chords of the loops may be from their curves, as a fraction of the surface's extent.
const CHORD: f64 = 2e-4;

/// A model traced and triangulated at one density.
struct Triangulated {
    counts: TracingCounts,
    region: TrimRegion,
    lines: GridLines,
    domain: DomainMesh,
    tracing: Duration,
    triangulation: Duration,
}

fn triangulate(model: &Model, denser: usize) -> Result<Triangulated> {
    let surface = &model.trimmed.surface;
    let checked = model.trimmed.check().map_err(|faults| anyhow!("{}: {faults:?}", model.name))?;
    let [low, high] = surface.bounding_box();
    let region = checked.polygonise(surface, CHORD * low.distance(high))?;
    let [m, n] = model.cells.map(|cells| denser * cells + 1);
    let lines = GridLines::uniform(surface.domain(), m, n);
    let aspect = aspect_of(surface, &lines);
    let mut best: Option<Triangulated> = None;
    let (mut tracing, mut triangulation) = (Duration::MAX, Duration::MAX);
    for _ in 0..RUNS {
        let start = Instant::now();
        let traced = trace(&lines, &region, &Unobserved)?.with_aspect(aspect);
        tracing = tracing.min(start.elapsed());
        let start = Instant::now();
        let domain = traced.triangulate(Configuration::Regular, 0)?;
        triangulation = triangulation.min(start.elapsed());
        let (counts, region, lines) = (traced.counts(), region.clone(), lines.clone());
        best = Some(Triangulated { counts, region, lines, domain, tracing, triangulation });
    }
    best.ok_or_else(|| anyhow!("nothing was run"))
}

/// Tables 3.1 and 3.2.
pub(crate) fn counts_and_times() -> Result<()> {
    let head = [
        "Surface",
        "",
        "Loops",
        "Cells",
        "Traced",
        "distinct",
        "% traced",
        "Tracing ms",
        "Triangles",
        "2D ms",
        "Cracks",
    ];
    let mut growth = Table::new(
        "From Table 3.1 to Table 3.2: factors",
        &["Surface", "", "Cells", "Traced", "Tracing time", "Triangles"],
    );
    let titles = ["Table 3.1. Tracing and triangulation", "Table 3.2. The same, over-sampled"];
    let mut tables = titles.map(|title| Table::new(title, &head));
    for model in models::all() {
        let (loops, mut rows) = (model.trimmed.loops.len(), Vec::new());
        for (k, table) in tables.iter_mut().enumerate() {
            let done = triangulate(&model, if k == 0 { 1 } else { model.denser })?;
            let (cells, traced, percent, tracing, triangles, triangulation) = model.printed[k];
            table.row([
                model.name.to_owned(),
                THESIS.to_owned(),
                loops.to_string(),
                cells.to_string(),
                traced.to_string(),
                NONE.to_owned(),
                format!("{percent:.2}"),
                figure(tracing),
                triangles.to_string(),
                figure(triangulation),
                NONE.to_owned(),
            ]);
            let counts = done.counts;
            let milliseconds = |time: Duration| figure(1e3 * time.as_secs_f64());
            table.row([
                String::new(),
                OURS.to_owned(),
                loops.to_string(),
                counts.cells.to_string(),
                counts.cells_traced.to_string(),
                counts.cells_distinct.to_string(),
                format!("{:.2}", 100.0 * counts.cells_traced as f64 / counts.cells as f64),
                milliseconds(done.tracing),
                done.domain.triangles.len().to_string(),
                milliseconds(done.triangulation),
                check_domain_mesh(&done.domain, &done.region).len().to_string(),
            ]);
            rows.push([
                counts.cells as f64,
                counts.cells_traced as f64,
                done.tracing.as_secs_f64(),
                done.domain.triangles.len() as f64,
            ]);
        }
        let printed = |(cells, traced, _, tracing, triangles, _): Row| {
            [f64::from(cells), f64::from(traced), tracing, f64::from(triangles)]
        };
        let factors = |low: [f64; 4], high: [f64; 4]| [0, 1, 2, 3].map(|k| figure(high[k] / low[k]));
        growth.labelled(&[model.name, THESIS], factors(printed(model.printed[0]), printed(model.printed[1])));
        growth.labelled(&["", OURS], factors(rows[0], rows[1]));
    }
    tables.iter().for_each(Table::print);
    note(
        "Times are those of this machine, the least of seven runs on one thread; the thesis's are of a Pentium of its day. \
         \"Traced\" counts visits, as the thesis does. Cracks: violations of conformity (3.6.2), each mesh checked whole.",
    );
    growth.print();
    Ok(())
}

/// The thesis's shares of Table 3.3 (Rockwood) and Table 3.4 (its own), percent.
const ROCKWOOD: [f64; 16] = [0.1, 1.6, 1.7, 1.1, 2.4, 3.7, 4.6, 6.9, 7.9, 12.4, 21.4, 21.7, 8.9, 4.1, 0.2, 1.3];
const TRACED: [f64; 16] = [1.5, 2.9, 6.1, 4.7, 7.6, 7.8, 10.2, 7.8, 14.2, 19.5, 7.8, 7.0, 2.9, 0.0, 0.0, 0.0];

/// Tables 3.3 and 3.4 and Graph 3.1, of the chassis.
pub(crate) fn aspect_ratios() -> Result<()> {
    let model = models::all().pop().ok_or_else(|| anyhow!("there are no models"))?;
    let done = triangulate(&model, 1)?;
    let Lifted { mesh, .. } = lift(&model.trimmed.surface, done.domain, &done.lines);
    let aspect = AspectRatio::of(&mesh);
    let head = ["Aspect ratio", "3.3 Rockwood (thesis)", "3.4 tracing (thesis)", "3.4 tracing (ours)"];
    let mut table = Table::new("Tables 3.3 and 3.4. Chassis: percent of the triangles by aspect ratio", &head);
    for (k, &(from, to, share)) in aspect.histogram.iter().enumerate() {
        let range = to.map_or_else(|| format!("> {from}"), |to| format!("{from} - {to}"));
        table.row([range, format!("{:.1}", ROCKWOOD[k]), format!("{:.1}", TRACED[k]), format!("{share:.1}")]);
    }
    table.row(["least".to_owned(), "1.50".to_owned(), "1.19".to_owned(), format!("{:.2}", aspect.min)]);
    table.row(["greatest".to_owned(), "infinite".to_owned(), "870.93".to_owned(), format!("{:.2}", aspect.max)]);
    table.row(["triangles".to_owned(), NONE.to_owned(), "344".to_owned(), mesh.triangles.len().to_string()]);
    table.print();
    note("Graph 3.1. The same as bars, one mark a percent: R Rockwood (thesis), t tracing (thesis), o tracing (ours)");
    println!();
    for (k, &(from, _, share)) in aspect.histogram.iter().enumerate() {
        for (mark, percent) in [("R", ROCKWOOD[k]), ("t", TRACED[k]), ("o", share)] {
            let label = if mark == "R" { format!("{from}") } else { String::new() };
            println!("{label:>7} {mark} {}", mark.repeat(percent.round() as usize));
        }
    }
    Ok(())
}
