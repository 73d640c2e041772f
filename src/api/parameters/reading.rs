//! Reads [`JobOptions`] from JSON and finds every fault, not the first alone.
//!
//! The option structs say what is allowed through their own serde code, which stops at the first fault. So where the
//! whole cannot be read, each part is tried by itself inside an otherwise empty job: what fails alone is a fault at its
//! own place; what fails only together is a fault of the object. The work is bounded by [`MAX_PROBES`].

use serde::Deserialize;
use serde_json::{Map, Value};

use super::{escaped, fault};
use crate::engine::job::JobOptions;
use crate::formats::faults::Fault;

/// Most parts that are tried: some twenty times the parameters that exist. Beyond it the object as a whole is faulty.
const MAX_PROBES: usize = 2000;

/// What a parameter may be, where serde's words do not say it well.
const HINTS: [(&str, &str); 8] = [
    ("/triangulation/grid", "two whole numbers: the points along u and v"),
    (
        "/triangulation/tolerance",
        "exactly one of { \"chord\": mm }, { \"chord_relative\": x }, { \"area\": mm2 }, { \"area_relative\": x }, { \"edge\": mm }",
    ),
    (
        "/flattening/seed",
        "\"optimum\", \"predicted\", \"centre\", a triangle's index, { \"uv\": [u, v] }, { \"xyz\": [x, y, z] } or { \"vertices\": [a, b, c] }",
    ),
    (
        "/flattening/pins",
        "a list of points with their targets: { \"at\": { \"uv\": [u, v] } or { \"xyz\": [x, y, z] }, \"to_mm\": [x, y] }",
    ),
    (
        "/flattening/keep",
        "a list of curves: { \"curve\": \"borders\" or { \"border\": i }, \"length\": \"soft\", \"weight\": w }",
    ),
    ("/cuts", "a list of cuts: { \"points\": [[u, v], …] or [[x, y, z], …], \"face\": k }"),
    ("/placement/align", "\"u\", \"v\", { \"uv\": [u, v] } or { \"xyz\": [x, y, z] }"),
    ("/triangulation/phase", "0 or 1"),
];

/// The options, or what is wrong with them.
pub(super) fn options(value: Value, faults: &mut Vec<Fault>) -> Option<JobOptions> {
    if let Ok(options) = JobOptions::deserialize(&value) {
        return Some(options);
    }
    let mut probes = 0;
    search(&mut Vec::new(), value, &mut probes, faults);
    None
}

/// Adds the faults of `value`, which stands at `path`. Returns whether there were any.
fn search(path: &mut Vec<String>, value: Value, probes: &mut usize, faults: &mut Vec<Fault>) -> bool {
    *probes += 1;
    let Err(error) = JobOptions::deserialize(nested(path, value.clone())) else { return false };
    let message = error.to_string();
    let names_last = path.last().is_some_and(|key| {
        message.starts_with(&format!("unknown field `{key}`"))
            || message.starts_with(&format!("unknown variant `{key}`"))
    });
    if let Value::Object(object) = value
        && !names_last
        && *probes < MAX_PROBES
    {
        let mut found = false;
        for (key, part) in object {
            path.push(key);
            found |= search(path, part, probes, faults);
            path.pop();
        }
        if found {
            return true;
        }
    }
    let pointer: String = path.iter().flat_map(|key| ["/".to_owned(), escaped(key)]).collect();
    let hint = HINTS.iter().find(|(at, _)| pointer == *at).map(|(_, hint)| *hint);
    let detail = hint.map_or_else(|| plain(&message), |hint| format!("this must be {hint}"));
    faults.push(fault(pointer, detail));
    true
}

/// An object that holds nothing but `value` at `path`.
fn nested(path: &[String], value: Value) -> Value {
    path.iter().rev().fold(value, |inner, key| Value::Object(Map::from_iter([(key.clone(), inner)])))
}

/// serde's message in the words of this API.
fn plain(message: &str) -> String {
    let known = |rest: &str| rest.trim_start_matches("one of ").to_owned();
    if let Some(rest) = message.strip_prefix("unknown field ") {
        return match rest.split_once(", expected ") {
            Some((name, others)) => format!("there is no parameter {name} here; there is {}", known(others)),
            None => format!("there is no parameter {} here", rest.split(',').next().unwrap_or(rest)),
        };
    }
    if let Some(rest) = message.strip_prefix("unknown variant ") {
        return match rest.split_once(", expected ") {
            Some((name, others)) => format!("there is no {name} here; there is {}", known(others)),
            None => format!("there is no {rest} here"),
        };
    }
    if let Some(name) = message.strip_prefix("missing field ") {
        return format!("{name} is missing");
    }
    if let Some((given, wanted)) = message.split_once(", expected ") {
        for start in ["invalid type: ", "invalid value: "] {
            if let Some(given) = given.strip_prefix(start) {
                return format!("this must be {}, and is {}", in_words(wanted), given_in_words(given));
            }
        }
        if let Some(length) = given.strip_prefix("invalid length ") {
            return format!("this must be {}, and has {length}", in_words(wanted));
        }
    }
    // What a type of our own says of settings that contradict each other.
    if message.starts_with("the scheme `") {
        return message.to_owned();
    }
    "this has none of the forms that it may have".to_owned()
}

/// What serde expects.
fn in_words(wanted: &str) -> String {
    let wanted = wanted.trim_start_matches("a borrowed ");
    for (theirs, ours) in [("an array of length ", "a list of "), ("a tuple of size ", "a list of ")] {
        if let Some(length) = wanted.strip_prefix(theirs) {
            return format!("{ours}{length}");
        }
    }
    let ours = match wanted.split(' ').next().unwrap_or(wanted) {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, not below 0",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "struct" | "map" => "an object",
        "string" | "str" => "a text",
        "bool" | "boolean" => "true or false",
        "enum" => "a word",
        _ => return wanted.to_owned(),
    };
    ours.to_owned()
}

/// What was given, as serde names it.
fn given_in_words(given: &str) -> String {
    for (theirs, ours) in
        [("string ", "the text "), ("integer ", "the number "), ("floating point ", "the number "), ("boolean ", "")]
    {
        if let Some(value) = given.strip_prefix(theirs) {
            return format!("{ours}{}", value.replace('`', ""));
        }
    }
    match given {
        "null" | "unit value" => "null".to_owned(),
        "map" => "an object".to_owned(),
        "sequence" => "a list".to_owned(),
        other => other.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    fn faults_of(value: Value) -> Vec<(String, String)> {
        let mut faults = Vec::new();
        assert_eq!(options(value, &mut faults), None);
        faults.into_iter().map(|f| (f.pointer, f.detail)).collect()
    }

    #[test]
    fn two_tolerances_are_a_fault_of_the_object() {
        let faults = faults_of(json!({ "triangulation": { "tolerance": { "chord": 1, "area": 2 } } }));
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert_eq!(faults[0].0, "/triangulation/tolerance");
        assert!(faults[0].1.contains("exactly one"), "{faults:?}");
    }

    #[test]
    fn a_word_in_place_of_a_tolerance_is_pointed_at() {
        let faults = faults_of(json!({ "triangulation": { "tolerance": { "chord": "fine" } } }));
        assert_eq!(faults[0].0, "/triangulation/tolerance/chord");
    }

    #[test]
    fn no_fault_speaks_the_words_of_the_reader() {
        let cases = [
            (
                json!({ "triangulation": { "tolerance": { "chord": "fine" } } }),
                "this must be a number, and is the text \"fine\"",
            ),
            (json!({ "flattening": { "readings": { "order": "up" } } }), "there is no `up` here; there is `fifo`"),
            (json!({ "flattening": { "method": 5 } }), "and is the number 5"),
            (json!({ "triangulation": 7 }), "this must be an object, and is the number 7"),
            (json!({ "triangulation": null }), "this must be an object, and is null"),
            (json!({ "limits": { "stretch_percent": [1] } }), "this must be a number, and is a list"),
        ];
        for (value, words) in cases {
            let faults = faults_of(value);
            assert!(faults.iter().any(|(_, detail)| detail.contains(words)), "{words}: {faults:?}");
            for theirs in ["variant", "f64", "struct", "invalid type", "expected", "sequence"] {
                assert!(faults.iter().all(|(_, detail)| !detail.contains(theirs)), "{theirs}: {faults:?}");
            }
        }
    }

    #[test]
    fn a_pin_of_no_known_form_lists_the_forms() {
        for (name, value) in [
            ("pins", json!([{ "at": [1, 2], "to_mm": [0, 0] }])),
            ("pins", json!([{ "at": { "uv": [1, 2] } }])),
            ("pins", json!({ "at": { "uv": [1, 2] }, "to_mm": [0, 0] })),
            ("keep", json!([{ "curve": "outline" }])),
            ("keep", json!([{ "curve": "borders", "length": "exact" }])),
        ] {
            let faults = faults_of(json!({ "flattening": { name: value } }));
            assert!(faults[0].0.starts_with(&format!("/flattening/{name}")), "{faults:?}");
            assert!(!faults[0].1.contains("variant"), "{faults:?}");
        }
    }

    #[test]
    fn an_unknown_name_lists_the_known_ones() {
        let faults = faults_of(json!({ "flattening": { "sed": 1 } }));
        assert_eq!(faults[0].0, "/flattening/sed");
        assert!(faults[0].1.contains("`seed`"), "{faults:?}");
    }

    #[test]
    fn a_seed_of_no_known_form_lists_the_forms() {
        for seed in [json!("best"), json!(-1), json!([1, 2]), json!(1.5)] {
            let faults = faults_of(json!({ "flattening": { "seed": seed } }));
            assert_eq!(faults[0].0, "/flattening/seed");
            assert!(faults[0].1.contains("triangle's index"), "{faults:?}");
        }
    }

    fn any_json() -> impl Strategy<Value = Value> {
        let key = prop::sample::select(vec![
            "triangulation",
            "flattening",
            "grid",
            "tolerance",
            "chord",
            "seed",
            "uv",
            "readings",
            "order",
            "x~/y",
            "",
        ]);
        let leaf = prop_oneof![
            Just(Value::Null),
            any::<bool>().prop_map(Value::from),
            any::<i32>().prop_map(Value::from),
            "[a-z]{0,6}".prop_map(Value::from),
        ];
        leaf.prop_recursive(4, 40, 5, move |inner| {
            prop_oneof![
                prop::collection::vec(inner.clone(), 0..4).prop_map(Value::from),
                prop::collection::btree_map(key.clone().prop_map(str::to_owned), inner, 0..5)
                    .prop_map(|m| Value::Object(m.into_iter().collect())),
            ]
        })
    }

    proptest! {
        #[test]
        fn whatever_cannot_be_read_has_a_fault_that_points_into_it(value in any_json()) {
            let mut faults = Vec::new();
            let read = options(value.clone(), &mut faults);
            prop_assert_eq!(read.is_some(), faults.is_empty());
            for fault in faults {
                prop_assert!(value.pointer(&fault.pointer).is_some(), "{} in {}", fault.pointer, value);
            }
        }
    }
}
