//! Settings by dotted name, as in `flattening.seed=centre`: the `set` option of the command line and of the one-call form.

use serde_json::{Map, Value};

use super::fault;
use crate::formats::faults::Fault;

/// Deepest name: one more than any parameter has.
const MAX_DEPTH: usize = 6;

/// Puts one assignment `a.b=VALUE` into a job. VALUE is JSON where it parses as JSON, else a string; a label's is a string.
///
/// # Errors
/// A fault when there is no `=`, the name is empty somewhere or too deep, or goes through something that is no object.
pub fn assign(job: &mut Value, assignment: &str) -> Result<(), Box<Fault>> {
    let Some((name, text)) = assignment.split_once('=') else {
        let detail = format!("`{assignment}` is not of the form NAME=VALUE, as in flattening.seed=centre");
        return Err(Box::new(fault("", detail)));
    };
    let path: Vec<&str> = match name.split_once('.') {
        // The names of labels may hold dots themselves.
        Some(("labels", key)) => vec!["labels", key],
        _ => name.split('.').collect(),
    };
    let pointer = || format!("/{}", path.join("/"));
    let through = || Box::new(fault(pointer(), format!("`{name}` goes through a value that has no parts")));
    if path.len() > MAX_DEPTH || path.iter().any(|step| step.is_empty()) {
        return Err(Box::new(fault(pointer(), format!("`{name}` is not the name of a parameter"))));
    }
    let value = if path[0] == "labels" {
        Value::from(text)
    } else {
        serde_json::from_str(text).unwrap_or_else(|_| Value::from(text))
    };
    let mut at = job;
    for step in &path[..path.len() - 1] {
        let Value::Object(object) = at else {
            return Err(through());
        };
        at = object.entry(*step).or_insert_with(|| Value::Object(Map::new()));
    }
    match at {
        Value::Object(object) => {
            object.insert(path[path.len() - 1].to_owned(), value);
            Ok(())
        }
        _ => Err(through()),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn assigned(assignments: &[&str]) -> Result<Value, Box<Fault>> {
        let mut job = json!({});
        assignments.iter().try_for_each(|a| assign(&mut job, a)).map(|()| job)
    }

    #[test]
    fn words_numbers_lists_and_labels_are_told_apart() {
        let job = assigned(&[
            "flattening.seed=centre",
            "triangulation.grid=[60, 40]",
            "limits.stretch_percent=3",
            "flattening.readings.order=fifo",
            "labels.part.number=4711",
            "labels.note=a=b",
        ]);
        assert_eq!(
            job.unwrap(),
            json!({
                "flattening": { "seed": "centre", "readings": { "order": "fifo" } },
                "triangulation": { "grid": [60, 40] },
                "limits": { "stretch_percent": 3 },
                "labels": { "part.number": "4711", "note": "a=b" }
            })
        );
    }

    #[test]
    fn the_last_one_wins() {
        assert_eq!(assigned(&["a=1", "a=2"]).unwrap(), json!({ "a": 2 }));
    }

    #[test]
    fn what_is_no_assignment_is_refused() {
        for bad in ["", "a", "=1", "a..b=1", "a.=1", "a.b.c.d.e.f.g=1"] {
            assert!(assigned(&[bad]).is_err(), "{bad}");
        }
        assert!(assigned(&["a=1", "a.b=2"]).is_err());
    }
}
