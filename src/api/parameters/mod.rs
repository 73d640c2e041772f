//! The parameters of a job as a user writes them, in a request's body, in `set` options, or in the command line's file.
//!
//! Reading goes in two steps, and each gives *all* its faults with JSON Pointers: [`read`] finds what has no place in a
//! job or has the wrong type; [`check`] finds values that have no meaning, alone, together, or on this surface.

mod checks;
mod cost;
mod labels;
mod piece;
mod reading;
mod set;

use serde_json::{Map, Value, json};

use crate::engine::flattening::FlatteningMethod;
use crate::engine::job::{JobKind, JobOptions, Labels};
use crate::engine::pipeline::DEFAULT_CHORD_RELATIVE;
use crate::formats::faults::Fault;

pub use checks::{GRID_POINTS, MAX_BUDGET_S, MAX_TRIANGLES, check, check_kind};
pub use cost::{MAX_VISITS, PartSize, VISITS_PER_SECOND, cost};
pub use set::assign;

/// The kinds of work in words.
pub const KINDS: &str = "triangulate, flatten or optimum-seed-search";

/// A job as it was asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JobRequest {
    /// The kind of work, where it was named.
    pub kind: Option<JobKind>,
    /// The surface's id, where it was named.
    pub surface: Option<String>,
    /// The ids of several surfaces that are one part, where they were named.
    pub surfaces: Option<Vec<String>>,
    /// Labels.
    pub labels: Labels,
    /// Everything else.
    pub options: JobOptions,
}

/// Reads a job from JSON: what could be read of it, and every fault: parameters that do not exist, and values of the
/// wrong type. What has a fault is left at its default.
#[must_use]
pub fn read(value: Value) -> (JobRequest, Vec<Fault>) {
    let mut faults = Vec::new();
    let Value::Object(mut object) = value else {
        faults.push(fault("", "a job is a JSON object, such as { \"kind\": \"flatten\", \"surface\": \"…\" }"));
        return (JobRequest::default(), faults);
    };
    let kind = object.remove("kind").and_then(|value| {
        let kind = serde_json::from_value(value).ok();
        if kind.is_none() {
            faults.push(fault("/kind", format!("the kind of work is {KINDS}")));
        }
        kind
    });
    let surface = match object.remove("surface") {
        None => None,
        Some(Value::String(id)) => Some(id),
        Some(_) => {
            faults.push(fault("/surface", "the id of a surface, as POST /v1/surfaces gave it, is a string"));
            None
        }
    };
    let surfaces = object.remove("surfaces").and_then(|value| {
        let ids = serde_json::from_value::<Vec<String>>(value).ok();
        if ids.is_none() {
            faults.push(fault("/surfaces", "a list of ids of surfaces, as POST /v1/surfaces gave them"));
        }
        ids
    });
    let labels = object.remove("labels").map_or_else(Labels::new, |value| labels::read(value, &mut faults));
    let mut options = reading::options(Value::Object(object), &mut faults).unwrap_or_default();
    if kind == Some(JobKind::OptimumSeedSearch) {
        // The method that seeds belong to.
        options.flattening.method.get_or_insert(FlatteningMethod::Cader);
    }
    (JobRequest { kind, surface, surfaces, labels, options }, faults)
}

/// The options as a job's document shows them: with the defaults that were taken.
#[must_use]
pub fn with_defaults(options: &JobOptions) -> Map<String, Value> {
    // Options hold numbers, words and lists of them: they can always be written.
    let filled = JobOptions { flattening: options.filled_flattening(), ..options.clone() };
    let mut object = match serde_json::to_value(&filled) {
        Ok(Value::Object(object)) => object,
        _ => Map::new(),
    };
    if options.triangulation.grid.is_none()
        && options.triangulation.tolerance.is_none()
        && let Some(Value::Object(triangulation)) = object.get_mut("triangulation")
    {
        triangulation.insert("tolerance".to_owned(), json!({ "chord_relative": DEFAULT_CHORD_RELATIVE }));
    }
    object
}

fn fault(pointer: impl Into<String>, detail: impl Into<String>) -> Fault {
    Fault { pointer: pointer.into(), detail: detail.into(), place: None }
}

/// One step of a JSON Pointer (RFC 6901).
fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_in_full_is_read() {
        let (job, faults) = read(json!({
            "kind": "flatten", "surface": "3f9c",
            "triangulation": { "method": "tracing", "grid": [60, 60], "configuration": "regular" },
            "flattening": {
                "method": "cader", "domain": "base", "seed": "optimum",
                "readings": { "order": "index", "parent": "first", "anchor": "end", "average": "pair", "check": "incident" }
            },
            "labels": { "part_number": "4711-A", "order": "2231" }
        }));
        assert!(faults.is_empty(), "{faults:?}");
        assert_eq!(job.kind, Some(JobKind::Flatten));
        assert_eq!(job.surface.as_deref(), Some("3f9c"));
        assert_eq!(job.options.triangulation.grid, Some([60, 60]));
        assert_eq!(job.labels["order"], "2231");
    }

    #[test]
    fn all_faults_are_found_at_once() {
        let (_, faults) = read(json!({
            "kind": "fold", "surface": 3,
            "labels": { "a": 1 },
            "triangulation": { "grid": [60], "foo": { "x": 1 }, "phase": "no" },
            "flattening": { "sed": "centre", "readings": { "order": "up", "parent": "first" } },
            "colour": "red"
        }));
        let mut pointers: Vec<_> = faults.iter().map(|f| f.pointer.as_str()).collect();
        pointers.sort_unstable();
        assert_eq!(
            pointers,
            [
                "/colour",
                "/flattening/readings/order",
                "/flattening/sed",
                "/kind",
                "/labels/a",
                "/surface",
                "/triangulation/foo",
                "/triangulation/grid",
                "/triangulation/phase",
            ]
        );
    }

    #[test]
    fn settings_that_contradict_each_other_are_refused_in_words() {
        let readings = json!({ "scheme": "symmetric", "order": "fifo" });
        let (_, faults) = read(json!({ "kind": "flatten", "flattening": { "readings": readings } }));
        let said =
            faults.iter().find(|fault| fault.pointer == "/flattening/readings").map(|fault| fault.detail.as_str());
        assert!(said.is_some_and(|said| said.contains("reads no order")), "{said:?}");
    }

    #[test]
    fn the_defaults_that_are_taken_are_shown() {
        let shown = with_defaults(&JobOptions::default());
        assert_eq!(shown["triangulation"]["tolerance"]["chord_relative"], 0.001);
        assert_eq!(shown["flattening"], json!({ "method": "isometric", "domain": "trimmed", "objective": "balanced" }));
        let (search, _) = read(json!({ "kind": "optimum-seed-search" }));
        let shown = with_defaults(&search.options);
        assert_eq!((&shown["flattening"]["method"], &shown["flattening"]["domain"]), (&json!("cader"), &json!("base")));
        assert_eq!(shown["flattening"]["readings"]["average"], "pair");
        let (gridded, _) = read(json!({ "triangulation": { "grid": [4, 4] } }));
        assert!(with_defaults(&gridded.options)["triangulation"].get("tolerance").is_none());
    }
}
