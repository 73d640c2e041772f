//! The thesis's tables beside ours: `cargo run --release --example thesis_tables`.
//!
//! Every figure under "ours" is computed in the run itself, with the library's public functions; those under "thesis" are
//! the printed ones. Names of tables choose some of them, numbers of chapters all of theirs:
//! `cargo run --release --example thesis_tables -- 3.1 5.9 test-3`. Of the readings of Cader's method two are printed, one in
//! Tables 6.4 and 6.5; the word `all-readings` doubles that. What the comparison says is in `docs/thesis.md`.
//!
//! The thesis's industrial surfaces are not public. The stand-ins are in `models.rs` (chapter 3) and `panels.rs`
//! (chapters 5 and 6); no file is read.

#![expect(
    clippy::expect_used,
    reason = "the shapes are constants: what they make is valid, and a slip shows at the first run"
)]

mod configurations;
mod curvature;
mod cylinder;
mod flattening;
mod mapping_order;
mod models;
mod panels;
mod principal;
#[expect(dead_code, reason = "shared with the sample parts, which need more of it")]
#[path = "../make_parts/shapes.rs"]
mod shapes;
mod study;
mod table;
mod tracing;
mod trial;
#[expect(dead_code, reason = "shared with the sample parts, which need more of it")]
#[path = "../make_parts/trims.rs"]
mod trims;

use std::time::Instant;

use anyhow::{Result, bail};
use planish::engine::flattening::Readings;

use trial::READINGS;

/// Asks for [`READINGS`] all; otherwise the first [`USUAL_READINGS`] are printed, which take half the time.
const ALL_READINGS: &str = "all-readings";
const USUAL_READINGS: usize = 2;

/// Tables that are made together, and how.
struct Section {
    tables: &'static [&'static str],
    print: fn(&[Readings]) -> Result<()>,
}

const SECTIONS: [Section; 13] = [
    Section { tables: &["3.1", "3.2"], print: |_| tracing::counts_and_times() },
    Section { tables: &["3.3", "3.4", "graph-3.1"], print: |_| tracing::aspect_ratios() },
    Section { tables: &["5.1"], print: configurations::from_one_seed },
    Section { tables: &["5.2", "5.3", "5.12"], print: |_| configurations::areas_and_counts() },
    Section { tables: &["5.18", "5.20", "5.21"], print: |_| curvature::of_random_diagonals() },
    Section { tables: &["5.4", "5.5", "5.6"], print: |_| curvature::of_configurations() },
    Section { tables: &["5.7", "5.8"], print: flattening::optima },
    Section { tables: &["5.9", "5.10", "5.11"], print: |_| mapping_order::levels() },
    Section { tables: &["test-1", "test-2", "test-3", "severe"], print: |_| cylinder::tests() },
    Section { tables: &["6.1", "6.2", "6.3"], print: |_| principal::meshes() },
    // Half of the readings: a row of these tables costs as much as one of 5.7.
    Section { tables: &["6.4", "6.5"], print: |readings| principal::optima(&readings[..readings.len().div_ceil(2)]) },
    Section { tables: &["oblique"], print: |_| principal::oblique_cylinder() },
    Section { tables: &["study"], print: |_| study::error_against_distortion() },
];

fn main() -> Result<()> {
    let (words, wanted): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|word| word == ALL_READINGS);
    let readings = if words.is_empty() { &READINGS[..USUAL_READINGS] } else { &READINGS[..] };
    let names = || SECTIONS.iter().flat_map(|section| section.tables);
    let belongs = |name: &str, wish: &str| name == wish || name.strip_prefix(wish).is_some_and(|r| r.starts_with('.'));
    if let Some(wish) = wanted.iter().find(|wish| !names().any(|name| belongs(name, wish))) {
        let all: Vec<&str> = names().copied().collect();
        bail!("there is no table {wish}; there are {}, and the word {ALL_READINGS}", all.join(", "));
    }
    let began = Instant::now();
    for section in &SECTIONS {
        if wanted.is_empty() || section.tables.iter().any(|name| wanted.iter().any(|wish| belongs(name, wish))) {
            (section.print)(readings)?;
        }
    }
    println!("\nAll of this took {:.1} s on {} threads.", began.elapsed().as_secs_f64(), rayon::current_num_threads());
    Ok(())
}
