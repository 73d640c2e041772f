//! Every real surface by the methods that release energy: valid, or refused in words with a place.

use std::collections::BTreeMap;
use std::path::Path;

use planish::engine::budget::Unobserved;
use planish::engine::error::Located;
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::pipeline;
use planish::formats::surface::{self, Reading};
use serde_json::json;

/// Points along u and v: coarse, so that all surfaces take seconds.
const GRID: [u32; 2] = [24, 24];

/// Share of the energy that the default threshold may leave in the long waves of a thin strip.
const LEFT: f64 = 0.05;
/// Energy that is rounding, mm.
const NOTHING: f64 = 1e-9;

#[test]
fn every_real_surface_comes_to_rest_without_a_flip_or_is_refused_with_a_place() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: there is no folder {}", folder.display());
        return;
    };
    let mut paths: Vec<_> = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some()).collect();
    paths.sort();
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let mut wrong = Vec::new();
    for path in &paths {
        let name = path.file_stem().unwrap().to_string_lossy();
        let geometry = surface::geometry(&std::fs::read(path).unwrap(), Reading::default()).unwrap();
        let mut energies = Vec::new();
        for method in ["mccartney", "wang"] {
            let options: JobOptions = serde_json::from_value(
                json!({ "triangulation": { "method": "grid", "grid": GRID }, "flattening": { "method": method } }),
            )
            .unwrap();
            match pipeline::run(JobKind::Flatten, geometry.input(), &options, &Unobserved) {
                Ok(outcome) => {
                    let found = outcome.report.flattening.unwrap();
                    let release = found.release.unwrap();
                    let all = outcome.mesh.triangles.len() as u64;
                    let lies = outcome.flat.unwrap().iter().all(|p| p.is_finite());
                    if found.flips != 0 || found.flattened != all || !lies {
                        wrong.push(format!("{name} by {method}: {} of {all} triangles lie", found.flattened));
                    }
                    if release.energy_after_mm > release.energy_before_mm {
                        wrong.push(format!("{name} by {method}: the energy rose"));
                    }
                    let told = outcome.report.warnings.iter().any(|warning| warning.contains("max_moves"));
                    if release.settled == told {
                        wrong.push(format!("{name} by {method}: {:?}", outcome.report.warnings));
                    }
                    println!(
                        "{name} by {method}: {:.3e} -> {:.3e} mm, {} moves",
                        release.energy_before_mm, release.energy_after_mm, release.moves
                    );
                    if release.settled {
                        energies.push(release.energy_after_mm);
                    }
                    let state = if release.settled { "at rest" } else { "moves spent" };
                    *counts.entry(format!("{method}: {state}")).or_default() += 1;
                }
                Err(failure) => {
                    let (code, place) = (failure.error.code(), failure.error.place());
                    println!("{name} by {method}: {}", failure.error);
                    if !["circles-miss", "triangle-flipped"].contains(&code) || place.triangle.is_none() {
                        wrong.push(format!("{name} by {method}: {code} {}", failure.error));
                    }
                    if failure.error.remedies().is_empty() || failure.partial.is_none() {
                        wrong.push(format!("{name} by {method}: no remedy, or nothing to look at"));
                    }
                    *counts.entry(format!("{method}: {code}")).or_default() += 1;
                }
            }
        }
        // The same springs: where both come to rest, they hold the same energy, but for what the threshold leaves.
        if let [one, other] = energies[..]
            && (one - other).abs() > LEFT * one.max(other) + NOTHING
        {
            wrong.push(format!("{name}: {one:e} mm and {other:e} mm"));
        }
    }
    println!("{counts:#?}");
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(counts["mccartney: at rest"] > paths.len() / 2 && counts["wang: at rest"] > paths.len() / 2);
}
