//! What few trials find of the optimum seed, and what is foretold of a flattening, over the real surfaces.

use std::path::{Path, PathBuf};

use planish::engine::budget::Unobserved;
use planish::engine::distortion::Report;
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::pipeline;
use planish::formats::surface::{self, Geometry, Reading};
use serde_json::{Value, json};

/// Changes of area below this, in percent, are rounding: there is nothing to find.
const NOTHING: f64 = 1e-6;

fn surfaces() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: there is no folder {}", folder.display());
        return Vec::new();
    };
    let mut paths: Vec<_> = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some()).collect();
    paths.sort();
    paths
}

/// The report of a job on the base surface's grid, also of one that failed, with whether it succeeded.
fn reported(geometry: &Geometry, kind: JobKind, flattening: &Value) -> (Report, bool) {
    let job = json!({ "triangulation": { "method": "grid", "grid": [40, 40] }, "flattening": flattening });
    let options: JobOptions = serde_json::from_value(job).unwrap();
    match pipeline::run(kind, geometry.input(), &options, &Unobserved) {
        Ok(outcome) => (outcome.report, true),
        Err(failure) => (failure.partial.map(|partial| partial.report).unwrap_or_default(), false),
    }
}

/// The correlation of ranks (Spearman).
fn rank_correlation(pairs: &[(f64, f64)]) -> f64 {
    let ranks = |of: fn(&(f64, f64)) -> f64| {
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.sort_by(|&a, &b| of(&pairs[a]).total_cmp(&of(&pairs[b])));
        let mut ranks = vec![0.0; pairs.len()];
        for (rank, k) in order.into_iter().enumerate() {
            ranks[k] = rank as f64;
        }
        ranks
    };
    let middle = (pairs.len() as f64 - 1.0) / 2.0;
    let (one, two) = (ranks(|p| p.0), ranks(|p| p.1));
    let product: f64 = one.iter().zip(&two).map(|(a, b)| (a - middle) * (b - middle)).sum();
    let square: f64 = one.iter().map(|a| (a - middle) * (a - middle)).sum();
    product / square
}

#[test]
fn few_trials_come_near_the_optimum_of_real_surfaces_and_the_strain_is_foretold() {
    let paths = surfaces();
    if paths.is_empty() {
        return;
    }
    let (mut ratios, mut foretold, mut failing) = (Vec::new(), Vec::new(), Vec::new());
    for path in &paths {
        let name = path.file_stem().unwrap().to_string_lossy();
        let geometry = surface::geometry(&std::fs::read(path).unwrap(), Reading::default()).unwrap();
        let (all, succeeds) = reported(&geometry, JobKind::OptimumSeedSearch, &json!({}));
        let all = all.seed_search.unwrap();
        assert_eq!(all.almost_developable, Some(succeeds), "{name}");
        let before = reported(&geometry, JobKind::Triangulate, &json!({})).0.triangulation.developability.unwrap();
        let points = before.points.unwrap();
        let sum = points.elliptic_percent + points.hyperbolic_percent + points.developable_percent;
        assert!((sum - 100.0).abs() < 1e-9, "{name}: {points:?}");
        let Some(optimum) = all.best_percent.filter(|best| *best > NOTHING) else { continue };
        let (few, found) = reported(&geometry, JobKind::Flatten, &json!({ "seed": "predicted" }));
        let few = few.seed_search.unwrap();
        assert_eq!((few.strategy.as_str(), few.seeds), ("predicted", all.seeds), "{name}");
        assert!(few.tried * 100 < few.seeds && few.complete != (few.tried < few.seeds), "{name}: {few:?}");
        assert_eq!((few.best.is_some(), few.almost_developable), (found, found.then_some(true)), "{name}");
        let ratio = few.best_percent.map_or(f64::INFINITY, |percent| percent / optimum);
        assert!(ratio >= 1.0, "{name}: {ratio}");
        let strain = before.predicted_strain_percent.unwrap();
        println!(
            "{name}: optimum {optimum:.3e} %, {ratio:.3} times that by {} of {} seeds; foretold strain {strain:.2e} %, \
             failure index {:.2e}, {:.0} % of seeds succeed",
            few.tried,
            few.seeds,
            before.failure_index,
            all.success_percent.unwrap()
        );
        ratios.push(ratio);
        foretold.push((strain, optimum));
        failing.push((before.failure_index, 100.0 - all.success_percent.unwrap()));
    }
    ratios.sort_by(f64::total_cmp);
    let (count, median, tenth) = (ratios.len(), ratios[ratios.len() / 2], ratios[ratios.len() * 9 / 10]);
    let [best, fail] = [&foretold, &failing].map(|pairs| rank_correlation(pairs));
    println!(
        "{count} surfaces: median {median:.3}, 90th percentile {tenth:.3}; rank correlations: optimum {best:.2}, failing seeds {fail:.2}"
    );
    let mut indices: Vec<f64> = failing.iter().map(|(index, _)| *index).collect();
    indices.sort_by(f64::total_cmp);
    let middle = indices[indices.len() / 2];
    let hard: Vec<_> = failing.iter().filter(|(_, failed)| *failed > 50.0).collect();
    let told = hard.iter().filter(|(index, _)| *index >= middle).count();
    println!(
        "most seeds fail on {}: on {told} of these the failure index is in the upper half, {middle:.2} or more",
        hard.len()
    );
    assert!(count > 20 && median <= 1.1 && tenth <= 1.3, "{ratios:?}");
    assert!(best > 0.8 && fail > 0.3, "{foretold:?} {failing:?}");
}
