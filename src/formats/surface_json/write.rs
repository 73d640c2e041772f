//! Writes a trimmed surface as JSON, one row of the net, one curve a line, every number to its last bit.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::{DVec2, DVec3};

use super::check::side_word;
use crate::engine::trimming::{TrimCurve, TrimShape, TrimmedSurface};

/// The file's text, in millimetres. The engine's types hold finite numbers alone, so that it is always valid JSON.
#[must_use]
pub fn write(name: Option<&str>, labels: &BTreeMap<String, String>, trimmed: &TrimmedSurface) -> String {
    let mut out = head(name);
    out.push_str(&fields(trimmed));
    out.push_str(&tail(labels));
    out
}

/// The text of a part of several faces, in millimetres.
#[must_use]
pub fn write_part(name: Option<&str>, labels: &BTreeMap<String, String>, faces: &[TrimmedSurface]) -> String {
    let mut out = head(name);
    let faces: Vec<String> = faces
        .iter()
        .map(|face| {
            let fields = fields(face);
            format!("{{\n{}\n}}", fields.strip_suffix(",\n").unwrap_or(&fields))
        })
        .collect();
    let _ = writeln!(out, "  \"faces\": [{}],", faces.join(", "));
    out.push_str(&tail(labels));
    out
}

fn head(name: Option<&str>) -> String {
    let mut out = String::from("{\n");
    if let Some(name) = name {
        let _ = writeln!(out, "  \"name\": {},", quoted(name));
    }
    out.push_str("  \"units\": \"mm\",\n");
    out
}

fn tail(labels: &BTreeMap<String, String>) -> String {
    let labels: Vec<String> = labels.iter().map(|(k, v)| format!("{}: {}", quoted(k), quoted(v))).collect();
    format!("  \"labels\": {{ {} }}\n}}\n", labels.join(", "))
}

/// The fields of a surface, or of a face, each with a comma after it.
fn fields(trimmed: &TrimmedSurface) -> String {
    let surface = &trimmed.surface;
    let mut out = String::new();
    let _ = writeln!(out, "  \"side\": {},", quoted(side_word(trimmed.side)));
    let (u, v) = (surface.knots_u(), surface.knots_v());
    let _ = writeln!(out, "  \"degree_u\": {},\n  \"degree_v\": {},", u.degree(), v.degree());
    let _ = writeln!(out, "  \"knots_u\": {},\n  \"knots_v\": {},", list(u.knots()), list(v.knots()));
    let columns = v.control_count();
    let rows: Vec<String> = surface.control().chunks(columns).map(points3).collect();
    let _ = writeln!(out, "  \"control_points\": [\n    {}\n  ],", rows.join(",\n    "));
    match surface.weights() {
        Some(weights) => {
            let rows: Vec<String> = weights.chunks(columns).map(list).collect();
            let _ = writeln!(out, "  \"weights\": [\n    {}\n  ],", rows.join(",\n    "));
        }
        None => out.push_str("  \"weights\": null,\n"),
    }
    let loops: Vec<String> = trimmed
        .loops
        .iter()
        .map(|l| {
            let curves: Vec<String> = l.curves.iter().map(curve).collect();
            format!("[\n      {}\n    ]", curves.join(",\n      "))
        })
        .collect();
    if loops.is_empty() {
        out.push_str("  \"trims\": [],\n");
    } else {
        let _ = writeln!(out, "  \"trims\": [\n    {}\n  ],", loops.join(",\n    "));
    }
    out
}

fn curve(curve: &TrimCurve) -> String {
    match &curve.shape {
        TrimShape::Nurbs(c) => format!(
            "{{ \"degree\": {}, \"knots\": {}, \"control_points\": {}, \"weights\": {}, \"reversed\": {} }}",
            c.knots().degree(),
            list(c.knots().knots()),
            points2(c.control()),
            c.weights().map_or_else(|| "null".to_owned(), list),
            curve.reversed
        ),
        TrimShape::Polyline(points) => {
            format!("{{ \"points\": {}, \"reversed\": {} }}", points2(points), curve.reversed)
        }
    }
}

fn points3(points: &[DVec3]) -> String {
    let points: Vec<String> = points.iter().map(|p| list(&p.to_array())).collect();
    format!("[{}]", points.join(", "))
}

fn points2(points: &[DVec2]) -> String {
    let points: Vec<String> = points.iter().map(|p| list(&p.to_array())).collect();
    format!("[{}]", points.join(", "))
}

/// Numbers in the shortest form that reads back to the same bits.
fn list(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers
        .iter()
        .map(|x| {
            let text = format!("{x:?}");
            text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
        })
        .collect();
    format!("[{}]", numbers.join(", "))
}

fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
