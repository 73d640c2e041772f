//! The real work of a job: the stored surface is read, the engine runs, and what comes out is encoded for the store.

use serde_json::{Value, json};

use super::runner::{Failed, FailureClass, Finished, Runner, Task};
use crate::engine::budget::Observer;
use crate::engine::distortion::VerdictResult;
use crate::engine::error::{EngineError, Located};
use crate::engine::job::{JobKind, JobOptions};
use crate::engine::pipeline::{self, Failure, Outcome};
use crate::formats::seeds;
use crate::formats::surface::{self, Reading};
use crate::formats::{MeshParts, report_json, stored};
use crate::store::NewResult;

/// Runs jobs with the engine.
#[derive(Debug, Clone, Copy, Default)]
pub struct EngineRunner;

impl Runner for EngineRunner {
    fn run(&self, task: &Task, observer: &dyn Observer) -> Result<Finished, Failed> {
        let kind: JobKind =
            serde_json::from_value(json!(task.kind)).map_err(|e| unreadable("kind of work", &e.to_string()))?;
        let options: JobOptions = serde_json::from_value(task.parameters.clone())
            .map_err(|e| unreadable("job's parameters", &e.to_string()))?;
        let reading: Reading = serde_json::from_value(task.surface.reading.clone())
            .map_err(|e| unreadable("surface's reading", &e.to_string()))?;
        let geometry = surface::geometry(&task.content, reading).map_err(|faults| {
            unreadable("surface", &faults.first().map_or_else(String::new, |f| format!("{} {}", f.pointer, f.detail)))
        })?;
        match pipeline::run(kind, geometry.input(), &options, observer) {
            Ok(outcome) => Ok(Finished {
                verdict: outcome.report.verdict.as_ref().map(|v| verdict(v.result).to_owned()),
                parameters: serde_json::to_value(&outcome.options).ok(),
                results: results(&outcome).map_err(|detail| unreadable("result", &detail))?,
            }),
            Err(failure) => Err(failed(&failure)),
        }
    }
}

const fn verdict(result: VerdictResult) -> &'static str {
    match result {
        VerdictResult::Pass => "pass",
        VerdictResult::Fail => "fail",
        VerdictResult::Unchecked => "unchecked",
    }
}

/// What is stored of an outcome.
fn results(outcome: &Outcome) -> Result<Vec<NewResult>, String> {
    let mesh = stored::encode_mesh(&MeshParts::from(outcome));
    let report = report_json::write(&outcome.report).map_err(|e| e.to_string())?;
    let mut results =
        vec![NewResult::new("mesh", stored::MESH_MEDIA, mesh), NewResult::new("report", "application/json", report)];
    if let Some(seeds) = &outcome.seeds {
        results.push(NewResult::new("seeds", seeds::MEDIA, seeds::encode(seeds)));
    }
    if let Some(pattern) = &outcome.pattern {
        results.push(NewResult::new("pattern", stored::PATTERN_MEDIA, stored::encode_pattern(pattern)));
    }
    Ok(results)
}

/// A failure of the engine, with its place, its remedies, and what there is of a result.
fn failed(failure: &Failure) -> Failed {
    let class = FailureClass::of(&failure.error);
    let partial = failure.partial.as_deref();
    Failed {
        problem: problem(&failure.error),
        results: partial.and_then(|outcome| results(outcome).ok()).unwrap_or_default(),
        parameters: partial.and_then(|outcome| serde_json::to_value(&outcome.options).ok()),
        class,
    }
}

/// The problem document of an engine error: the API adds what HTTP wants.
#[must_use]
pub fn problem(error: &EngineError) -> Value {
    json!({
        "code": error.code(),
        "title": "The geometry could not be worked on",
        "detail": error.to_string(),
        "place": error.place(),
        "remedies": error.remedies(),
    })
}

/// Something that was checked before it was stored, and cannot be read now.
fn unreadable(what: &str, detail: &str) -> Failed {
    Failed {
        problem: json!({
            "code": "unreadable",
            "title": "The job cannot be read",
            "detail": format!("The {what} cannot be read: {detail}"),
        }),
        results: Vec::new(),
        parameters: None,
        class: FailureClass::Deterministic,
    }
}
