//! Labels: free key-value strings that come back in listings and stand in the pattern's title block.

use serde_json::Value;

use super::{escaped, fault};
use crate::engine::job::Labels;
use crate::formats::faults::Fault;
use crate::formats::surface_json::{MAX_LABEL_NAME as MAX_KEY, MAX_LABELS, MAX_TEXT as MAX_VALUE};

/// Reads labels; what is wrong is added to `faults`.
pub(super) fn read(value: Value, faults: &mut Vec<Fault>) -> Labels {
    let Value::Object(object) = value else {
        faults.push(fault("/labels", "labels are an object of strings, such as { \"part_number\": \"4711-A\" }"));
        return Labels::new();
    };
    if object.len() > MAX_LABELS {
        faults.push(fault("/labels", format!("there are {} labels, and at most {MAX_LABELS} are kept", object.len())));
        return Labels::new();
    }
    let mut labels = Labels::new();
    for (key, value) in object {
        let pointer = format!("/labels/{}", escaped(&key));
        if !is_name(&key) {
            faults.push(fault(
                pointer,
                format!("the name of a label is 1 to {MAX_KEY} letters, digits, `_`, `-` or `.` of ASCII"),
            ));
            continue;
        }
        match value {
            Value::String(text) if text.chars().count() <= MAX_VALUE && !text.chars().any(char::is_control) => {
                labels.insert(key, text);
            }
            Value::String(_) => faults.push(fault(
                pointer,
                format!("the value of a label has at most {MAX_VALUE} characters and no line breaks or other control characters"),
            )),
            _ => faults.push(fault(pointer, "the value of a label is a string: write \"4711\", not 4711")),
        }
    }
    labels
}

fn is_name(key: &str) -> bool {
    (1..=MAX_KEY).contains(&key.len()) && key.bytes().all(|b| b.is_ascii_alphanumeric() || b"_-.".contains(&b))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn each_bad_label_is_a_fault_of_its_own() {
        let mut faults = Vec::new();
        let long = "x".repeat(MAX_VALUE + 1);
        let labels =
            read(json!({ "good": "4711-Ä", "a b": "x", "line": "a\nb", "long": long, "n": 3, "": "x" }), &mut faults);
        assert_eq!(labels.keys().collect::<Vec<_>>(), ["good"]);
        let mut pointers: Vec<_> = faults.iter().map(|f| f.pointer.as_str()).collect();
        pointers.sort_unstable();
        assert_eq!(pointers, ["/labels/", "/labels/a b", "/labels/line", "/labels/long", "/labels/n"]);
    }

    #[test]
    fn their_number_is_bounded() {
        let mut faults = Vec::new();
        let many: serde_json::Map<_, _> = (0..=MAX_LABELS).map(|i| (format!("k{i}"), json!("v"))).collect();
        read(Value::Object(many), &mut faults);
        assert_eq!(faults.len(), 1);
    }
}
