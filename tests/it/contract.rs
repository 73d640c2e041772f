//! The contract and the service say the same: every path and method, every documented call, every answer.

use std::collections::BTreeSet;
use std::sync::Arc;

use planish::queue::EngineRunner;
use serde_json::{Value, json};

use crate::support::api::{Held, Live, Sketch, plate, settings};
use crate::support::contract::{CONTRACT, operations, resolved, seen, validate, validator};

#[test]
fn the_route_table_and_the_contract_have_the_same_paths_and_methods() {
    let routes: BTreeSet<(String, String)> =
        planish::api::paths().into_iter().map(|(method, path)| (method.to_string(), path.to_owned())).collect();
    assert_eq!(routes, operations());
}

#[test]
fn every_schema_is_sound_and_every_example_is_as_its_schema_says() {
    for (name, schema) in CONTRACT["components"]["schemas"].as_object().unwrap() {
        let judge = validator(&json!({ "$ref": format!("#/components/schemas/{name}") }));
        for example in schema["examples"].as_array().unwrap_or(&Vec::new()) {
            assert!(judge.is_valid(example), "{name}: {example}");
        }
    }
    let mut examples = 0;
    for (path, item) in CONTRACT["paths"].as_object().unwrap() {
        for (_, operation) in item.as_object().unwrap().iter().filter(|(key, _)| *key != "parameters") {
            let content = &operation["requestBody"]["content"]["application/json"];
            for (_, example) in content["examples"].as_object().into_iter().flatten() {
                let example = match example["$ref"].as_str() {
                    Some(pointer) => CONTRACT.pointer(pointer.trim_start_matches('#')).unwrap(),
                    None => example,
                };
                validate(&content["schema"], &example["value"], path);
                examples += 1;
            }
        }
    }
    assert!(examples >= 4, "{examples}");
}

#[test]
fn the_defaults_that_the_contract_names_are_those_that_are_taken() {
    let taken = Value::Object(planish::api::parameters::with_defaults(&planish::engine::job::JobOptions::default()));
    validate(&json!({ "$ref": "#/components/schemas/TakenParameters" }), &taken, "the default parameters");
    let schemas = &CONTRACT["components"]["schemas"];
    for (object, schema) in [
        ("triangulation", "Triangulation"),
        ("flattening", "Flattening"),
        ("search", "Search"),
        ("placement", "Placement"),
    ] {
        for (name, property) in schemas[schema]["properties"].as_object().unwrap() {
            if let Some(default) = property.get("default") {
                let same = taken[object][name] == *default
                    || taken[object][name].as_f64().is_some_and(|x| default.as_f64() == Some(x));
                assert!(same, "{object}.{name}: {} and {default}", taken[object][name]);
            }
        }
    }
    let flattening = json!({ "method": "isometric", "domain": "trimmed", "objective": "balanced" });
    assert_eq!(taken["flattening"], flattening, "as the contract says in words");
    let mut sequential = planish::engine::job::JobOptions::default();
    sequential.flattening.method = Some(planish::engine::flattening::FlatteningMethod::Cader);
    let taken = Value::Object(planish::api::parameters::with_defaults(&sequential));
    validate(&json!({ "$ref": "#/components/schemas/TakenParameters" }), &taken, "the default parameters of cader");
    for (name, property) in schemas["Flattening"]["properties"]["readings"]["properties"].as_object().unwrap() {
        assert_eq!(taken["flattening"]["readings"][name], property["default"], "{name}");
    }
}

#[test]
fn every_problem_has_a_text_that_says_more_than_its_title() {
    for kind in planish::api::problem::Kind::ALL {
        assert!(kind.text().len() > kind.title().len(), "{kind:?}");
        let documented = planish::api::CONTRACT.contains(&format!("`{}`", kind.slug()));
        // A header that is too large is refused before there is an operation.
        assert!(documented || kind.slug() == "too-many-headers" || kind.slug() == "method-not-allowed", "{kind:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_documented_call_answers_as_documented() {
    let live = Live::start(Arc::new(Held::<Sketch>::default()), &settings(|_| {})).await;
    // Surfaces.
    let created = live.post("/v1/surfaces", &plate()).await.expect(201);
    let again = live.post("/v1/surfaces", &plate()).await.expect(200);
    assert_eq!(created.json()["id"], again.json()["id"]);
    let surface = created.json()["id"].as_str().unwrap().to_owned();
    let address = format!("/v1/surfaces/{surface}");
    assert_eq!(created.header("location"), Some(address.as_str()));
    live.get(&address).await.expect(200);
    let content = live.get(&format!("{address}/content")).await.expect(200);
    assert_eq!(content.json(), plate());
    live.get("/v1/surfaces?limit=1").await.expect(200);
    // Jobs.
    let job = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "part_number": "4711" } })).await;
    let document = live.ended(&job).await;
    assert_eq!(document["state"], "succeeded", "{document:#}");
    live.get("/v1/jobs?state=succeeded&kind=flatten&label.part_number=4711").await.expect(200);
    // What happened to it: the events, for whom they are new, and the feed.
    let events = format!("/v1/jobs/{job}/events");
    let told = live.get(&events).await.expect(200).text();
    let last = told.lines().filter_map(|line| line.strip_prefix("id: ")).next_back().unwrap().to_owned();
    live.send(reqwest::Method::GET, &events, |r| r.header("Last-Event-ID", last)).await.expect(204);
    live.get("/v1/feed?state=succeeded&kind=flatten&label.part_number=4711").await.expect(200);
    // Results: every link of the job leads somewhere, and so do the addresses without a suffix.
    for link in document["results"].as_array().unwrap() {
        let answer = live.get(link["href"].as_str().unwrap()).await.expect(200);
        assert_eq!(answer.header("content-type"), link["type"].as_str());
        let tag = answer.header("etag").unwrap().to_owned();
        let path = link["href"].as_str().unwrap();
        let same = live.send(reqwest::Method::GET, path, |r| r.header("If-None-Match", &tag)).await.expect(304);
        assert_eq!(same.header("etag"), Some(tag.as_str()));
    }
    for result in ["mesh", "pattern", "report", "vertices"] {
        live.get(&format!("/v1/jobs/{job}/{result}")).await.expect(200);
    }
    let search = live.job(&json!({ "kind": "optimum-seed-search", "surface": surface })).await;
    let document = live.ended(&search).await;
    let links = document["results"].as_array().unwrap().iter().filter(|link| link["rel"] == "seeds");
    let links: Vec<&str> = links.map(|link| link["href"].as_str().unwrap()).collect();
    assert_eq!(links.len(), 2, "{document:#}");
    for path in links.into_iter().chain([format!("/v1/jobs/{search}/seeds").as_str()]) {
        live.get(path).await.expect(200);
    }
    // The one-call form.
    for format in ["svg", "dxf", "plt", "json"] {
        live.post(&format!("/v1/flatten?format={format}"), &plate()).await.expect(200);
    }
    // Cancelling and deleting.
    live.send(reqwest::Method::POST, &format!("/v1/jobs/{job}/cancel"), |r| r).await.expect(409).problem("job-final");
    let endless = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "endless" } })).await;
    live.delete(&address).await.expect(409).problem("surface-in-use");
    live.delete(&format!("/v1/jobs/{endless}")).await.expect(409).problem("job-not-ended");
    live.get(&format!("/v1/jobs/{endless}/report.json")).await.expect(409).problem("job-not-ended");
    for _ in 0..2 {
        live.send(reqwest::Method::POST, &format!("/v1/jobs/{endless}/cancel"), |r| r).await.expect(202);
    }
    assert_eq!(live.ended(&endless).await["state"], "cancelled");
    live.get(&format!("/v1/jobs/{endless}/mesh.json")).await.expect(409).problem("job-cancelled");
    live.delete(&format!("/v1/jobs/{job}")).await.expect(204);
    live.get(&format!("/v1/jobs/{job}")).await.expect(404).problem("job-not-found");
    live.delete(&address).await.expect(204);
    live.get(&address).await.expect(404).problem("surface-not-found");
    // Around them.
    live.get("/healthz").await.expect(200);
    live.get("/readyz").await.expect(200);
    assert_eq!(live.get("/openapi.yaml").await.expect(200).text(), planish::api::CONTRACT);
    live.get("/metrics").await.expect(200);
    live.get("/docs").await.expect(200);
    let list = live.get("/problems").await.expect(200).text();
    for kind in planish::api::problem::Kind::ALL {
        assert!(list.contains(kind.slug()), "{kind:?}");
        live.get(&format!("/problems/{}", kind.slug())).await.expect(200);
    }
    // Every operation was called, and answered with each of its good statuses save the late answer of the one call.
    let seen = seen();
    for (path, item) in CONTRACT["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap().iter().filter(|(key, _)| *key != "parameters") {
            let name = operation["operationId"].as_str().unwrap();
            let good = operation["responses"].as_object().unwrap().keys().filter(|status| status.starts_with('2'));
            for status in good.filter(|status| (name, status.as_str()) != ("flatten", "202")) {
                let status: u16 = status.parse().unwrap();
                assert!(seen.contains(&(name.to_owned(), status)), "{method} {path} was never answered with {status}");
            }
        }
    }
}

/// The path of an operation with these ids in it.
fn filled(template: &str, surface: &str, job: &str, problem: &str) -> String {
    template.replace("{surface}", surface).replace("{job}", job).replace("{problem}", problem)
}

#[tokio::test(flavor = "multi_thread")]
async fn every_operation_knows_the_query_parameters_that_the_contract_lists_and_no_other() {
    let live = Live::start(Arc::new(Held::<Sketch>::default()), &settings(|_| {})).await;
    for (method, path) in operations() {
        let item = &CONTRACT["paths"][&path];
        let operation = &item[method.to_lowercase()];
        if operation["responses"]["400"].is_null() {
            // A probe is answered whatever it asks.
            assert!(["/healthz", "/readyz"].contains(&path.as_str()), "{path} does not document 400");
            continue;
        }
        let listed: BTreeSet<String> = [&item["parameters"], &operation["parameters"]]
            .into_iter()
            .filter_map(Value::as_array)
            .flatten()
            .map(resolved)
            .filter(|parameter| parameter["in"] == "query")
            .map(|parameter| parameter["name"].as_str().unwrap().to_owned())
            .collect();
        let id = "0".repeat(40);
        let address = format!("{}?no-such-parameter=1", filled(&path, &id, &id, "internal"));
        let method = reqwest::Method::from_bytes(method.as_bytes()).unwrap();
        let refused = live.send(method, &address, |r| r).await.expect(400).problem("bad-request");
        let detail = refused["errors"][0]["detail"].as_str().unwrap().to_owned();
        let known: BTreeSet<String> = match detail.split_once("; there is ") {
            Some((_, names)) => names.split(", ").map(str::to_owned).collect(),
            None => BTreeSet::new(),
        };
        assert_eq!(known, listed, "{address}: {detail}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_refusal_that_the_contract_lists_is_given_and_every_other_method_is_refused() {
    let live =
        Arc::new(Live::start(Arc::new(Held::<EngineRunner>::default()), &settings(|s| s.max_body_mib = 1)).await);
    let surface = live.surface(&plate()).await;
    // A search has every result that there is.
    let done = live.job(&json!({ "kind": "optimum-seed-search", "surface": surface })).await;
    assert_eq!(live.ended(&done).await["state"], "succeeded");
    let runs = live.job(&json!({ "kind": "flatten", "surface": surface, "labels": { "test": "endless" } })).await;
    let long = format!("{{{}}}", " ".repeat(1 << 20));
    for (method, path) in operations() {
        let responses = &CONTRACT["paths"][&path][method.to_lowercase()]["responses"];
        let documented = |status: &str| !responses[status].is_null();
        let method = reqwest::Method::from_bytes(method.as_bytes()).unwrap();
        let send = |job: &str, header: &'static str, value: &'static str, body: String| {
            let (live, method, address) = (live.clone(), method.clone(), filled(&path, &surface, job, "internal"));
            async move { live.send(method, &address, |r| r.header(header, value).body(body)).await }
        };
        if documented("304") {
            send(&done, "If-None-Match", "*", String::new()).await.expect(304);
        }
        if documented("400") {
            let address = format!("{}?no-such-parameter=1", filled(&path, &surface, &done, "internal"));
            live.send(method.clone(), &address, |r| r).await.expect(400);
        }
        if documented("404") && path.contains('{') {
            live.send(method.clone(), &filled(&path, "x", "x", "x"), |r| r).await.expect(404);
        }
        if documented("406") {
            let body = plate().to_string();
            send(&done, "Accept", "application/x-nothing", body).await.expect(406).problem("not-acceptable");
        }
        if documented("413") {
            send(&done, "Accept", "*/*", long.clone()).await.expect(413).problem("body-too-large");
        }
        if documented("415") {
            send(&done, "Content-Type", "model/step", "{}".to_owned()).await.expect(415);
        }
        if documented("422") {
            send(&done, "Content-Type", "application/json", "{}".to_owned()).await.expect(422);
        }
        if documented("409") && path != "/v1/flatten" {
            // What needs an end does not work on one that runs, and the other way round.
            let job = if path.ends_with("/cancel") { &done } else { &runs };
            send(job, "Accept", "*/*", String::new()).await.expect(409);
        }
        // Methods that the contract does not list.
        for other in ["PUT", "PATCH", "DELETE", "POST", "TRACE", "BREW"] {
            let address = filled(&path, &surface, &done, "internal");
            let other = reqwest::Method::from_bytes(other.as_bytes()).unwrap();
            if CONTRACT["paths"][&path][other.as_str().to_lowercase()].is_null() {
                let refused = live.send(other.clone(), &address, |r| r).await.expect(405);
                refused.problem("method-not-allowed");
                let allowed = refused.header("allow").unwrap_or_default();
                assert!(allowed.contains(method.as_str()) && !allowed.contains(other.as_str()), "{path}: {allowed}");
            }
        }
    }
    // A job that is cancelled while the one call waits for it.
    let waiting = tokio::spawn({
        let live = live.clone();
        async move { live.post("/v1/flatten?set=labels.test=endless&set=labels.one=call", &plate()).await }
    });
    let job = loop {
        let page = live.get("/v1/jobs?label.one=call").await.expect(200).json();
        if let Some(id) = page["items"][0]["id"].as_str() {
            break id.to_owned();
        }
    };
    for job in [&job, &runs] {
        live.send(reqwest::Method::POST, &format!("/v1/jobs/{job}/cancel"), |r| r).await.expect(202);
    }
    waiting.await.unwrap().expect(409).problem("job-cancelled");
    // All of what is documented was seen, save a body that comes too slowly, which takes a minute.
    let seen = seen();
    for (path, item) in CONTRACT["paths"].as_object().unwrap() {
        for (_, operation) in item.as_object().unwrap().iter().filter(|(key, _)| *key != "parameters") {
            let name = operation["operationId"].as_str().unwrap();
            for status in operation["responses"].as_object().unwrap().keys().filter(|s| s.starts_with(['3', '4'])) {
                let was = seen.contains(&(name.to_owned(), status.parse().unwrap()));
                assert!(was || status == "408", "{name} ({path}) was never answered with {status}");
            }
        }
    }
}
