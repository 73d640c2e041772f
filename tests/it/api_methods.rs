//! The methods of flattening through the service: what each takes, what its report says, and what belongs to the other.

use std::sync::Arc;

use planish::queue::EngineRunner;
use serde_json::{Value, json};

use crate::support::api::{Live, settings};

async fn live() -> Live {
    Live::start(Arc::new(EngineRunner), &settings(|_| {})).await
}

/// Stores one of the example parts.
async fn stored(live: &Live, name: &str) -> String {
    let path = format!("{}/examples/parts/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let surface: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    live.post("/v1/surfaces", &surface).await.expect(201).json()["id"].as_str().unwrap().to_owned()
}

/// The job's document and the report of a flattening with these options.
async fn flattened(live: &Live, surface: &str, flattening: Value) -> (Value, Value) {
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "flattening": flattening })).await;
    let document = live.ended(&job).await;
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    (document, report)
}

#[tokio::test(flavor = "multi_thread")]
async fn the_default_is_the_least_distortion_and_objectives_trade_area_against_shape() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    let (document, balanced) = flattened(&live, &surface, json!({})).await;
    let taken = json!({ "method": "isometric", "domain": "trimmed", "objective": "balanced" });
    assert_eq!(document["parameters"]["flattening"], taken);
    let found = &balanced["flattening"];
    assert_eq!((&found["method"], &found["flips"], &found["seed"]), (&json!("isometric"), &json!(0), &Value::Null));
    assert_eq!((&found["solver"]["converged"], &found["developable"]), (&json!(true), &Value::Null));

    let (_, sequential) = flattened(&live, &surface, json!({ "method": "cader", "domain": "trimmed" })).await;
    let change = |report: &Value, of: &str| report["distortion"][of].as_f64().unwrap();
    for of in ["area_change_percent", "shape_change_percent"] {
        assert!(change(&balanced, of) < change(&sequential, of), "{of}");
    }

    let (document, area) = flattened(&live, &surface, json!({ "objective": "area" })).await;
    assert_eq!(document["parameters"]["flattening"]["objective"], "area");
    assert!(change(&area, "area_change_percent") < change(&balanced, "area_change_percent"));
    // The same as weights.
    let (document, weighted) = flattened(&live, &surface, json!({ "weights": { "area": 20 } })).await;
    assert_eq!(document["parameters"]["flattening"]["weights"], json!({ "area": 20.0, "shape": 1.0 }));
    assert_eq!(weighted["flattening"]["objective"], "weights");
    assert!(change(&weighted, "area_change_percent") < change(&balanced, "area_change_percent"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_developable_part_is_laid_flat_without_strain_and_the_report_says_what_it_is() {
    let live = live().await;
    let surface = stored(&live, "cone-with-holes").await;
    let (_, report) = flattened(&live, &surface, json!({})).await;
    let found = &report["flattening"]["developable"];
    assert_eq!((&found["kind"], &report["flattening"]["solver"]), (&json!("cone"), &Value::Null));
    assert!(found["strain"].as_f64().unwrap() < 1e-10, "{found}");
    assert_eq!(report["distortion"]["hot_spots"], json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_symmetric_scheme_strains_less_than_the_one_in_turn_and_says_what_it_read() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    let with = |readings: Value| json!({ "method": "cader", "seed": "centre", "readings": readings });
    let (in_turn, before) = flattened(&live, &surface, with(json!({}))).await;
    let (document, report) = flattened(&live, &surface, with(json!({ "scheme": "symmetric" }))).await;
    assert_eq!(in_turn["parameters"]["flattening"]["readings"]["scheme"], "in-turn");
    let taken = &document["parameters"]["flattening"]["readings"];
    assert_eq!(*taken, json!({ "scheme": "symmetric", "check": "incident" }));
    let change = |report: &Value| report["distortion"]["area_change_percent"].as_f64().unwrap();
    assert!(change(&report) < change(&before), "{} {}", change(&report), change(&before));
    // The same levels, whatever lays them.
    assert_eq!(report["flattening"]["levels"], before["flattening"]["levels"]);
    // What was taken can be asked for again; the search for the optimum goes by the scheme too.
    let mut again = document["parameters"]["flattening"].clone();
    again["seed"] = json!("optimum");
    let (_, best) = flattened(&live, &surface, again).await;
    assert!(change(&best) <= change(&report));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_belongs_to_one_method_is_refused_by_the_other() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    for (flattening, pointers) in [
        (json!({ "method": "isometric", "seed": "centre" }), vec!["/flattening/seed"]),
        (json!({ "method": "isometric", "readings": { "order": "fifo" } }), vec!["/flattening/readings"]),
        (json!({ "readings": { "scheme": "symmetric", "order": "index" } }), vec!["/flattening/readings"]),
        (json!({ "readings": { "scheme": "symmetric", "check": "current" } }), vec!["/flattening/readings"]),
        (json!({ "readings": { "scheme": "level" } }), vec!["/flattening/readings/scheme"]),
        (json!({ "seed": "centre", "objective": "area" }), vec!["/flattening/objective"]),
        (json!({ "method": "cader", "weights": { "area": 2 } }), vec!["/flattening/weights"]),
        (json!({ "objective": "area", "weights": { "area": 2 } }), vec!["/flattening/weights"]),
        (json!({ "weights": { "area": -1 } }), vec!["/flattening/weights"]),
        (json!({ "method": "cader", "injective": true }), vec!["/flattening/injective"]),
        (json!({ "seed": "centre", "injective": false }), vec!["/flattening/injective"]),
        (json!({ "injective": 1 }), vec!["/flattening/injective"]),
        (json!({ "method": "cader", "release": {} }), vec!["/flattening/release"]),
        (json!({ "release": { "step": 0.1 } }), vec!["/flattening/release"]),
        (json!({ "method": "mccartney", "seed": "optimum" }), vec!["/flattening/seed"]),
        (
            json!({ "method": "mccartney", "objective": "area", "injective": true, "readings": {} }),
            vec!["/flattening/injective", "/flattening/objective", "/flattening/readings"],
        ),
        (json!({ "method": "wang", "release": { "step": 0.1 } }), vec!["/flattening/release/step"]),
        (
            json!({ "method": "mccartney", "release": { "step": 2, "threshold": 0, "max_moves": 1_000_000_001 } }),
            vec!["/flattening/release/max_moves", "/flattening/release/step", "/flattening/release/threshold"],
        ),
        (json!({ "method": "mccartney", "release": { "steps": 3 } }), vec!["/flattening/release/steps"]),
        (json!({ "objective": "minimal" }), vec!["/flattening/objective"]),
    ] {
        let job = json!({ "kind": "flatten", "surface": surface, "flattening": flattening });
        assert_eq!(live.post("/v1/jobs", &job).await.expect(422).pointers(), pointers, "{flattening}");
    }
    let search = json!({ "kind": "optimum-seed-search", "surface": surface, "flattening": { "method": "isometric" } });
    assert_eq!(live.post("/v1/jobs", &search).await.expect(422).pointers(), ["/flattening/method"]);
    let search = json!({ "kind": "optimum-seed-search", "surface": surface, "flattening": { "method": "wang" } });
    assert_eq!(live.post("/v1/jobs", &search).await.expect(422).pointers(), ["/flattening/method"]);
    // What stands for nothing is as good as absent.
    let job = json!({ "kind": "flatten", "surface": surface, "flattening": { "method": "isometric", "seed": null } });
    live.post("/v1/jobs", &job).await.expect(202);
}

#[tokio::test(flavor = "multi_thread")]
async fn pins_lie_where_they_are_to_in_the_report_and_in_the_drawing_and_kept_lengths_are_kept() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    let (_, free) = flattened(&live, &surface, json!({})).await;
    assert_eq!(free["flattening"]["pins"], json!([]));
    let change = |report: &Value| {
        let boundary = &report["distortion"]["boundary"][0];
        (boundary["length_2d_mm"].as_f64().unwrap() / boundary["length_3d_mm"].as_f64().unwrap() - 1.0).abs()
    };
    let (document, kept) = flattened(&live, &surface, json!({ "keep": [{ "curve": { "border": 0 } }] })).await;
    let shown = json!([{ "curve": { "border": 0 }, "length": "soft", "weight": 10.0 }]);
    assert_eq!(document["parameters"]["flattening"]["keep"], shown);
    assert!(change(&kept) < 0.5 * change(&free), "{} {}", change(&kept), change(&free));

    // Two points of the outline as it lies freely, a hundredth farther apart.
    let job = live.job(&json!({ "kind": "flatten", "surface": surface })).await;
    live.ended(&job).await;
    let mesh = live.get(&format!("/v1/jobs/{job}/mesh.json")).await.expect(200).json();
    let (flat, positions) = (mesh["flat"].as_array().unwrap(), mesh["positions"].as_array().unwrap());
    let x = |k: &usize| flat[*k][0].as_f64().unwrap();
    let left = (0..flat.len()).min_by(|a, b| x(a).total_cmp(&x(b))).unwrap();
    let right = (0..flat.len()).max_by(|a, b| x(a).total_cmp(&x(b))).unwrap();
    let to = |k: usize| [1.01 * x(&k) - 1000.0, 1.01 * flat[k][1].as_f64().unwrap() + 500.0];
    let pins = json!([
        { "at": { "xyz": positions[left] }, "to_mm": to(left) },
        { "at": { "xyz": positions[right] }, "to_mm": to(right) },
    ]);
    let asked = json!({ "kind": "flatten", "surface": surface, "flattening": { "pins": pins } });
    let job = live.job(&asked).await;
    let document = live.ended(&job).await;
    assert_eq!(document["parameters"]["flattening"]["pins"], pins);
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    let found = report["flattening"]["pins"].as_array().unwrap();
    assert_eq!((found.len(), &found[1]["at"], &found[1]["to_mm"]), (2, &pins[1]["at"], &pins[1]["to_mm"]));
    assert!(found.iter().all(|pin| pin["residual_mm"].as_f64().unwrap() < 1e-6), "{found:?}");
    let pattern = live.get(&format!("/v1/jobs/{job}/pattern.json")).await.expect(200).json();
    let outline = pattern["pieces"][0]["outline"].as_array().unwrap();
    for k in [left, right] {
        let near = outline.iter().map(|p| {
            let [x, y] = [0, 1].map(|i| p[i].as_f64().unwrap() - to(k)[i]);
            x.hypot(y)
        });
        let nearest = near.fold(f64::INFINITY, f64::min);
        assert!(nearest < 2.0, "{k}: {nearest}");
    }
    live.get(&format!("/v1/jobs/{job}/pattern.dxf")).await.expect(200);

    // Pins in another order than on the part, and one that is not on it.
    let error = async |pins: Value| {
        let job = live.job(&json!({ "kind": "flatten", "surface": surface, "flattening": { "pins": pins } })).await;
        live.ended(&job).await["problem"].clone()
    };
    let off = error(json!([{ "at": { "xyz": [1e4, 0, 0] }, "to_mm": [0, 0] }])).await;
    assert_eq!(off["code"], "pin-off-surface", "{off}");
    assert_eq!(off["remedies"][1]["set"], json!({ "flattening.pins": null }), "{off}");
}

#[tokio::test(flavor = "multi_thread")]
async fn pins_and_kept_lengths_without_a_meaning_are_refused_in_words() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    let pin = json!({ "at": { "xyz": [0, 0, 0] }, "to_mm": [0, 0] });
    let other = json!({ "at": { "xyz": [0, 0, 0] }, "to_mm": [1, 0] });
    for (flattening, pointers) in [
        (json!({ "method": "cader", "pins": [pin] }), vec!["/flattening/pins"]),
        (json!({ "seed": 0, "keep": [{ "curve": "borders" }] }), vec!["/flattening/keep"]),
        (json!({ "pins": [pin, other] }), vec!["/flattening/pins/1"]),
        (json!({ "pins": [{ "at": { "uv": [1e9, 0] }, "to_mm": [0, 0] }] }), vec!["/flattening/pins/0/at/uv/0"]),
        (json!({ "pins": [{ "at": "centre", "to_mm": [0, 0] }] }), vec!["/flattening/pins"]),
        (json!({ "keep": [{ "curve": "outline" }] }), vec!["/flattening/keep"]),
        (json!({ "domain": "base", "keep": [{ "curve": "borders" }] }), vec!["/flattening/keep"]),
        (json!({ "injective": true, "pins": [pin] }), vec!["/flattening/injective"]),
    ] {
        let job = json!({ "kind": "flatten", "surface": surface, "flattening": flattening });
        assert_eq!(live.post("/v1/jobs", &job).await.expect(422).pointers(), pointers, "{flattening}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn methods_that_release_energy_tell_how_it_went_and_where_they_began() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    let grid = json!({ "grid": [25, 25] });
    let mut left = Vec::new();
    for method in ["mccartney", "wang"] {
        let job = json!({ "kind": "flatten", "surface": surface, "triangulation": grid,
            "flattening": { "method": method, "release": { "max_moves": 2_000_000 } } });
        let job = live.job(&job).await;
        let document = live.ended(&job).await;
        assert_eq!(document["state"], "succeeded", "{document:#}");
        let taken =
            json!({ "method": method, "domain": "base", "seed": "centre", "release": { "max_moves": 2_000_000 } });
        assert_eq!(document["parameters"]["flattening"]["release"], taken["release"]);
        let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
        let found = &report["flattening"];
        assert_eq!((&found["method"], &found["domain"], &found["flips"]), (&json!(method), &json!("base"), &json!(0)));
        assert!(found["seed"].is_u64() && found["levels"].is_u64() && found["averaged_points"].is_null());
        let release = &found["release"];
        let number = |key: &str| release[key].as_f64().unwrap();
        assert_eq!(release["settled"], true, "{release}");
        assert!(number("energy_after_mm") < number("energy_before_mm") && number("threshold_mm") > 0.0);
        let history = release["history"].as_array().unwrap();
        assert_eq!(history[0], json!([0, number("energy_before_mm")]));
        assert_eq!(history[history.len() - 1][1].as_f64(), Some(number("energy_after_mm")));
        left.push(number("energy_after_mm"));
    }
    assert!((left[0] / left[1] - 1.0).abs() < 0.02, "both come to rest at the least energy: {left:?}");
    // A named seed is taken; spent moves are told, and the pattern is there all the same.
    let (document, report) = flattened(
        &live,
        &surface,
        json!({ "method": "mccartney", "seed": 3, "release": { "max_moves": 10, "threshold": 1e-9, "step": 0.05 } }),
    )
    .await;
    assert_eq!(document["state"], "succeeded", "{document:#}");
    assert_eq!((&report["flattening"]["seed"], &report["flattening"]["release"]["moves"]), (&json!(3), &json!(10)));
    assert_eq!(report["flattening"]["release"]["settled"], false);
    assert!(report["warnings"].to_string().contains("max_moves"), "{}", report["warnings"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn fitted_diagonals_belong_to_the_grid_and_are_refused_to_a_tracing() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    let with = |method: &str, configuration: &str| {
        let triangulation = json!({ "method": method, "grid": [20, 16], "configuration": configuration });
        json!({ "kind": "triangulate", "surface": surface, "triangulation": triangulation })
    };
    let mut meshes = Vec::new();
    for configuration in ["fitted", "fitted", "regular"] {
        let job = live.job(&with("grid", configuration)).await;
        let document = live.ended(&job).await;
        assert_eq!(document["parameters"]["triangulation"]["configuration"], configuration);
        meshes.push(live.get(&format!("/v1/jobs/{job}/mesh.json")).await.expect(200).json());
    }
    assert_eq!(meshes[0], meshes[1]);
    assert_ne!(meshes[0], meshes[2]);
    let refused = live.post("/v1/jobs", &with("tracing", "fitted")).await.expect(422).json();
    assert!(refused.to_string().contains("/triangulation/configuration"), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn sampling_skewed_off_a_cylinders_rulings_costs_area_and_along_them_it_does_not() {
    let live = live().await;
    // u runs round the half cylinder, v along its rulings.
    let surface = stored(&live, "half-cylinder").await;
    let skewed = async |skew: Value| {
        let triangulation = json!({ "method": "grid", "grid": [20, 20], "skew": skew });
        let flattening = json!({ "method": "cader", "seed": "optimum" });
        let job =
            json!({ "kind": "flatten", "surface": surface, "triangulation": triangulation, "flattening": flattening });
        let job = live.job(&job).await;
        live.ended(&job).await;
        live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json()["distortion"]["area_change_percent"]
            .as_f64()
            .unwrap()
    };
    assert!(skewed(Value::Null).await < 1e-10);
    assert!(skewed(json!({ "v_percent": 90 })).await < 1e-10);
    let off = skewed(json!({ "u_percent": -90, "u_along": "last" })).await;
    assert!(off > 1e-5, "{off}");

    let over = json!({ "u_percent": -90, "v_percent": -90, "u_along": "last", "points": "odd" });
    let triangulation =
        json!({ "method": "grid", "grid": [20, 20], "configuration": "regular-mirrored", "skew": over });
    let job = live.job(&json!({ "kind": "triangulate", "surface": surface, "triangulation": triangulation })).await;
    let document = live.ended(&job).await;
    assert_eq!((&document["state"], &document["problem"]["code"]), (&json!("failed"), &json!("skew-turns-over")));
    assert_eq!(document["problem"]["remedies"][0]["set"], json!({ "triangulation.skew": null }));

    for triangulation in [
        json!({ "skew": { "u_percent": 10 } }),
        json!({ "method": "grid", "skew": { "u_percent": 100 } }),
        json!({ "configuration": "random" }),
        json!({ "method": "grid", "random_seed": 3 }),
    ] {
        let job = json!({ "kind": "triangulate", "surface": surface, "triangulation": triangulation });
        live.post("/v1/jobs", &job).await.expect(422);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn random_configurations_are_told_apart_by_their_seed_and_compared_from_the_same_triangle() {
    let live = live().await;
    let surface = stored(&live, "saddle").await;
    let change = async |triangulation: Value, seed: Value| {
        let flattening = json!({ "method": "cader", "seed": seed });
        let job =
            json!({ "kind": "flatten", "surface": surface, "triangulation": triangulation, "flattening": flattening });
        let job = live.job(&job).await;
        live.ended(&job).await;
        let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
        (report["flattening"]["seed"].as_u64(), report["distortion"]["area_change_percent"].as_f64())
    };
    let random =
        |seed: u32| json!({ "method": "grid", "grid": [12, 12], "configuration": "random", "random_seed": seed });
    let (_, one) = change(random(1), json!("optimum")).await;
    assert_eq!(change(random(1), json!("optimum")).await.1, one);
    assert_ne!(change(random(2), json!("optimum")).await.1, one);

    // Cell (5, 5): the triangle below its diagonal, named by its corners in either order.
    let regular = json!({ "method": "grid", "grid": [12, 12] });
    let by_corners = change(regular.clone(), json!({ "vertices": [78, 65, 66] })).await;
    assert_eq!(by_corners.0, Some(120));
    assert_eq!(by_corners, change(regular.clone(), json!(120)).await);
    let job = json!({ "kind": "flatten", "surface": surface, "triangulation": regular,
        "flattening": { "method": "cader", "seed": { "vertices": [0, 1, 2] } } });
    let job = live.job(&job).await;
    assert_eq!(live.ended(&job).await["problem"]["code"], "seed-not-found");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_triangulation_tells_its_curvature_and_a_sequential_flattening_what_averaging_moved() {
    let live = live().await;
    let surface = stored(&live, "torus-segment").await;
    let triangulation = json!({ "method": "grid", "grid": [31, 31], "configuration": "diamond" });
    let job = live.job(&json!({ "kind": "triangulate", "surface": surface, "triangulation": triangulation })).await;
    live.ended(&job).await;
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    let curvature = &report["triangulation"]["curvature"];
    assert_eq!(curvature["vertices"], 29 * 29);
    assert_eq!(curvature["valencies"], json!([[4, 420], [8, 421]]));
    // Valencies of 4 and 8 spoil the barycentric estimate, and not the compensated one.
    let mean = |by: &str| curvature[by]["difference"]["mean_per_mm2"].as_f64().unwrap();
    assert!(mean("compensated") < 0.3 * mean("barycentric"), "{curvature:#}");
    assert!(mean("voronoi") < 0.3 * mean("barycentric"), "{curvature:#}");

    let flattening = json!({ "method": "cader", "seed": "centre" });
    let job =
        json!({ "kind": "flatten", "surface": surface, "triangulation": triangulation, "flattening": flattening });
    let job = live.job(&job).await;
    assert_eq!(live.ended(&job).await["state"], "succeeded");
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    let found = &report["flattening"];
    let levels = found["level_counts"].as_array().unwrap();
    let sum = |k: usize| levels.iter().map(|level| level[k].as_u64().unwrap()).sum::<u64>();
    assert_eq!(levels.len() as u64, found["levels"].as_u64().unwrap());
    assert_eq!((sum(0), sum(1)), (1800, found["averaged_points"].as_u64().unwrap()));
    // The lines of the grid that the part reaches.
    let lines = report["distortion"]["iso_lines"]["lines"].as_array().unwrap();
    assert!(lines.iter().all(|n| (25..=31).contains(&n.as_u64().unwrap())), "{lines:?}");
    let along = report["distortion"]["iso_lines"]["shape_change_percent"].as_f64().unwrap();
    assert!(along > 0.0 && along < 5.0, "{along}");

    let csv = live.get(&format!("/v1/jobs/{job}/vertices.csv")).await.expect(200);
    let text = csv.text();
    let rows: Vec<Vec<&str>> = text.split_terminator("\r\n").map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 31 * 31 + 1);
    let column = |name: &str| rows[0].iter().position(|n| *n == name).unwrap();
    let moved = rows[1..].iter().map(|row| row[column("movement_mm")].parse::<f64>().unwrap()).fold(0.0, f64::max);
    assert_eq!(found["greatest_movement_mm"].as_f64().unwrap(), moved);
    assert!(moved > 0.0);

    // Who wants the pattern alone is not told.
    let job = live.job(&json!({ "kind": "flatten", "surface": surface })).await;
    live.ended(&job).await;
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    assert_eq!(report["triangulation"]["curvature"], Value::Null);
    assert_eq!(report["flattening"]["level_counts"], Value::Null);
}

#[tokio::test(flavor = "multi_thread")]
async fn lines_of_curvature_are_a_method_with_settings_counts_and_typed_refusals() {
    let live = live().await;
    let surface = stored(&live, "sphere-cap").await;
    let with = |triangulation: Value| json!({ "kind": "flatten", "surface": surface, "triangulation": triangulation });
    let settings = json!({ "integration": "runge-kutta", "border": "free", "families": "both" });
    for settings in [Value::Null, settings] {
        let asked = json!({ "method": "ampc", "grid": [14, 12], "ampc": settings });
        let job = live.job(&with(asked)).await;
        let document = live.ended(&job).await;
        assert_eq!(document["state"], "succeeded", "{document:#}");
        let taken = &document["parameters"]["triangulation"];
        assert_eq!((&taken["method"], &taken["ampc"]["starts"]), (&json!("ampc"), &json!(8)), "{taken:#}");
        assert_eq!(document["parameters"]["flattening"]["domain"], "base");
        let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
        let counts = &report["triangulation"]["ampc"];
        assert_eq!(counts["maximum"].is_null(), settings.is_null(), "{counts:#}");
        assert!(counts["minimum"]["polylines_found"].as_u64().unwrap() > 0);
    }
    // Without a grid as many points as the default tolerance asks for are taken, and told.
    let job = live.job(&with(json!({ "method": "ampc" }))).await;
    let document = live.ended(&job).await;
    let taken = &document["parameters"]["triangulation"];
    assert!(taken["grid"][0].as_u64().unwrap() >= 5 && taken["tolerance"].is_null(), "{taken:#}");
    for (wrong, pointer) in [
        (json!({ "method": "grid", "ampc": {} }), "/triangulation/ampc"),
        (json!({ "method": "ampc", "tolerance": { "chord": 1 } }), "/triangulation/tolerance"),
        (json!({ "method": "ampc", "ampc": { "starts": 1 } }), "/triangulation/ampc/starts"),
        (json!({ "method": "ampc", "ampc": { "border": "soft" } }), "/triangulation/ampc/border"),
    ] {
        let refused = live.post("/v1/jobs", &with(wrong)).await.expect(422).json();
        assert!(refused.to_string().contains(pointer), "{refused}");
    }
}
