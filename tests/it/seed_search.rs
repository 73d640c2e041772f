//! A search for the best seed through the whole service: its results, its limits, and a kill in the middle of it.

use std::sync::Arc;
use std::time::Duration;

use planish::queue::EngineRunner;
use serde_json::{Value, json};

use crate::support::api::{Live, settings};
use crate::support::service::Service;

/// A square of 100 mm over which the surface rises as a paraboloid by `height` from the middle to a side's middle.
fn bowl(height: f64) -> Value {
    let z = |i: usize, j: usize| height * ([1.0, -1.0, 1.0][i] + [1.0, -1.0, 1.0][j]);
    let row = |i: usize| (0..3).map(|j| json!([50 * i, 50 * j, z(i, j)])).collect::<Vec<_>>();
    json!({
        "units": "mm", "degree_u": 2, "degree_v": 2,
        "knots_u": [0, 0, 0, 1, 1, 1], "knots_v": [0, 0, 0, 1, 1, 1],
        "control_points": [row(0), row(1), row(2)]
    })
}

fn search(surface: &str, grid: [u32; 2]) -> Value {
    json!({
        "kind": "optimum-seed-search", "surface": surface,
        "triangulation": { "method": "grid", "grid": grid }
    })
}

async fn live() -> Live {
    Live::start(Arc::new(EngineRunner), &settings(|_| {})).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_search_tells_what_became_of_every_seed_and_flattens_from_the_best() {
    let live = live().await;
    let surface = live.surface(&bowl(8.0)).await;
    let job = live.job(&search(&surface, [12, 12])).await;
    let document = live.ended(&job).await;
    assert_eq!(document["state"], "succeeded", "{document:#}");
    assert_eq!(document["parameters"]["flattening"]["seed"], "optimum");
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    let found = &report["seed_search"];
    assert_eq!((&found["seeds"], &found["tried"], &found["abandoned"]), (&json!(242), &json!(242), &json!(0)));
    assert_eq!(found["complete"], true);
    assert_eq!(report["flattening"]["seed"], found["best"]);
    // The report adds up the same triangles in another order.
    let [measured, searched] =
        [&report["distortion"]["area_change_percent"], &found["best_percent"]].map(|x| x.as_f64().unwrap());
    assert!((measured / searched - 1.0).abs() < 1e-12, "{measured} {searched}");
    let seeds = live.get(&format!("/v1/jobs/{job}/seeds")).await.expect(200).json();
    let all = seeds["seeds"].as_array().unwrap();
    assert_eq!((all.len(), &seeds["best"]), (242, &json!([found["best"]])));
    let change = |seed: &Value| seed["area_change_percent"].as_f64();
    let least = all.iter().filter_map(change).fold(f64::INFINITY, f64::min);
    let greatest = all.iter().filter_map(change).fold(0.0, f64::max);
    assert_eq!((found["best_percent"].as_f64(), found["worst_percent"].as_f64()), (Some(least), Some(greatest)));
    assert_eq!(found["best"].as_u64().unwrap() as usize, all.iter().position(|s| change(s) == Some(least)).unwrap());
    assert_eq!(change(&all[found["worst"].as_u64().unwrap() as usize]), Some(greatest));
    assert_eq!(found["succeeded"].as_u64().unwrap() as usize, all.iter().filter_map(change).count());
    let csv = live.get(&format!("/v1/jobs/{job}/seeds.csv")).await.expect(200);
    assert_eq!(csv.text().lines().count(), 243);
    for result in ["mesh.glb", "pattern.svg"] {
        live.get(&format!("/v1/jobs/{job}/{result}")).await.expect(200);
    }
    // The same seed wins where losers are abandoned.
    let mut flatten = search(&surface, [12, 12]);
    flatten["kind"] = json!("flatten");
    flatten["flattening"] = json!({ "method": "cader" });
    let job = live.job(&flatten).await;
    live.ended(&job).await;
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    for name in ["best", "best_percent"] {
        assert_eq!(report["seed_search"][name], found[name]);
    }
    live.get(&format!("/v1/jobs/{job}/seeds")).await.expect(404).problem("result-not-found");
}

#[tokio::test(flavor = "multi_thread")]
async fn when_no_seed_succeeds_the_job_fails_and_what_became_of_each_can_be_read() {
    let live = live().await;
    let surface = live.surface(&bowl(1000.0)).await;
    let mut job = search(&surface, [24, 24]);
    job["triangulation"]["configuration"] = json!("diamond");
    let job = live.job(&job).await;
    let document = live.ended(&job).await;
    assert_eq!((&document["state"], &document["problem"]["code"]), (&json!("failed"), &json!("no-seed-succeeds")));
    let seeds = live.get(&format!("/v1/jobs/{job}/seeds.json")).await.expect(200).json();
    assert_eq!(seeds["best"], json!([null]));
    for seed in seeds["seeds"].as_array().unwrap() {
        assert_eq!(seed["outcome"], "flipped");
        assert!(seed["triangle"].is_u64() && seed["level"].is_u64() && seed["flattened"].is_u64(), "{seed}");
    }
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    assert_eq!(report["seed_search"]["succeeded"], 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_search_that_would_take_too_long_is_refused_unless_it_has_a_budget() {
    let live = live().await;
    let surface = live.surface(&bowl(8.0)).await;
    let mut job = search(&surface, [400, 400]);
    let refused = live.post("/v1/jobs", &job).await.expect(422).problem("too-large");
    assert_eq!(refused["remedies"][0]["set"]["search.budget_s"], 60.0, "{refused:#}");
    for (budget, pointer) in [(json!(0), "/search/budget_s"), (json!(1e9), "/search/budget_s")] {
        job["search"] = json!({ "budget_s": budget });
        assert_eq!(live.post("/v1/jobs", &job).await.expect(422).pointers(), [pointer]);
    }
    job["search"] = json!({ "budget_s": 0.05 });
    job["flattening"] = json!({ "seed": 3 });
    assert_eq!(live.post("/v1/jobs", &job).await.expect(422).pointers(), ["/flattening/seed"]);
    // On a mesh of which every seed takes long the budget is over after the first slices.
    job["flattening"] = json!({ "readings": { "check": "final" } });
    job["triangulation"]["grid"] = json!([150, 150]);
    let job = live.job(&job).await;
    live.ended(&job).await;
    let report = live.get(&format!("/v1/jobs/{job}/report.json")).await.expect(200).json();
    let found = &report["seed_search"];
    assert_eq!((&found["complete"], &found["budget_s"]), (&json!(false), &json!(0.05)), "{report:#}");
    assert!(found["tried"].as_u64() < found["seeds"].as_u64());
    let told = |warning: &Value| warning.as_str().is_some_and(|text| text.contains("ran out of its time"));
    assert!(report["warnings"].as_array().unwrap().iter().any(told), "{}", report["warnings"]);
    let seeds = live.get(&format!("/v1/jobs/{job}/seeds")).await.expect(200).json();
    let untried = seeds["seeds"].as_array().unwrap().iter().filter(|seed| seed["outcome"] == "untried").count() as u64;
    assert_eq!(untried + found["tried"].as_u64().unwrap(), found["seeds"].as_u64().unwrap());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_search_that_is_killed_runs_again_and_ends_with_the_very_bytes() {
    let data = tempfile::tempdir().unwrap();
    let service = Service::start(data.path(), &[]);
    let surface = service.post("/v1/surfaces", &bowl(1.0)).await.json()["id"].as_str().unwrap().to_owned();
    let asked = search(&surface, [70, 70]);
    let job = service.post("/v1/jobs", &asked).await.expect(202).header("location").unwrap().to_owned();
    loop {
        let document = service.get(&job).await.expect(200).json();
        assert!(document["finished_at"].is_null(), "it was too fast to be killed");
        let progress = &document["progress"];
        if progress["stage"] == "seed_search" && progress["fraction"].as_f64() > Some(0.0) {
            assert!(progress["remaining_s"].is_number(), "{document:#}");
            break;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    service.signal("KILL");
    service.ended();
    let service = Service::start(data.path(), &[]);
    // The same job, undisturbed.
    let other = service.post("/v1/jobs", &asked).await.expect(202).header("location").unwrap().to_owned();
    let mut results = Vec::new();
    for (address, attempts) in [(&job, 2), (&other, 1)] {
        let document = service.get(&format!("{address}?wait=60")).await.expect(200).json();
        assert_eq!((&document["state"], &document["attempts"]), (&json!("succeeded"), &json!(attempts)));
        assert_eq!(document["progress"]["remaining_s"], Value::Null);
        let mut bytes = Vec::new();
        for result in ["report.json", "seeds.json", "seeds.csv", "mesh.json", "pattern.json"] {
            bytes.push(service.get(&format!("{address}/{result}")).await.expect(200).body);
        }
        results.push(bytes);
    }
    assert!(results[0] == results[1], "the killed search has other bytes than the undisturbed one");
}
