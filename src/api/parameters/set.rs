//! Settings by dotted name, as in `flattening.seed=centre`: the `set` option of the command line and of the one-call form.

use serde_json::{Map, Value};

use super::fault;
use crate::formats::faults::Fault;

/// Deepest name: one more than any parameter has.
const MAX_DEPTH: usize = 6;

/// Puts one assignment `a.b=VALUE` into a job. VALUE is JSON where it parses as JSON, a list where
/// it is numbers between commas (brackets mean something to shells and to curl), else a string; a label's is a string.
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
        serde_json::from_str(text).ok().or_else(|| numbers(text)).unwrap_or_else(|| Value::from(text))
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

/// Two or more numbers between commas, as a list.
fn numbers(text: &str) -> Option<Value> {
    let list: Option<Vec<Value>> =
        text.split(',').map(|part| serde_json::from_str(part).ok().filter(Value::is_number)).collect();
    list.filter(|list| list.len() > 1).map(Value::from)
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
            "triangulation.grid=[60, 40]",
            "flattening.seed.uv=0.5,1e-1",
            "name.of.list=1,b",
            "limits.stretch_percent=3",
            "flattening.readings.order=fifo",
            "labels.part.number=4711",
            "labels.note=a=b",
        ]);
        assert_eq!(
            job.unwrap(),
            json!({
                "flattening": { "seed": { "uv": [0.5, 0.1] }, "readings": { "order": "fifo" } },
                "name": { "of": { "list": "1,b" } },
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
