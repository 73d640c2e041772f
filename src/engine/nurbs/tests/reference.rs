//! Evaluation against the reference cases, read in place.

use glam::{DVec2, DVec3};
use serde_json::Value;

use crate::engine::nurbs::{Curve3, GridSamples, KnotVector, Surface};

/// Of `max(1, |value|)`.
const TOLERANCE: f64 = 1e-9;

fn cases() -> Option<Value> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/cases/evaluation.json");
    let Ok(text) = std::fs::read_to_string(path) else {
        eprintln!("skipped: the reference case evaluation.json is not there");
        return None;
    };
    Some(serde_json::from_str(&text).expect("the reference case is JSON"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_slice(&numbers(value))
}

fn knots(value: &Value, degree: &str, name: &str) -> KnotVector {
    let degree = value[degree].as_u64().expect("a degree") as usize;
    KnotVector::new(degree, numbers(&value[name]), "knots").expect("valid knots")
}

fn surface(value: &Value) -> Surface {
    let rows = value["control_points"].as_array().expect("rows");
    let control = rows.iter().flat_map(|r| r.as_array().expect("a row").iter().map(vector)).collect();
    let weights = value["weights"].as_array().map(|rows| rows.iter().flat_map(numbers).collect());
    Surface::new(knots(value, "degree_u", "knots_u"), knots(value, "degree_v", "knots_v"), control, weights)
        .expect("a valid surface")
}

fn curve(value: &Value) -> Curve3 {
    let control = value["control_points"].as_array().expect("points").iter().map(vector).collect();
    let weights = value["weights"].as_array().map(|_| numbers(&value["weights"]));
    Curve3::new(knots(value, "degree", "knots"), control, weights).expect("a valid curve")
}

fn assert_number(name: &str, found: f64, expected: f64) {
    let error = (found - expected).abs() / expected.abs().max(1.0);
    assert!(error <= TOLERANCE, "{name}: {found} where {expected} is expected ({error:e})");
}

fn assert_vector(name: &str, found: DVec3, expected: DVec3) {
    for c in 0..3 {
        assert_number(name, found[c], expected[c]);
    }
}

fn assert_direction(name: &str, found: DVec2, expected: &Value) {
    let expected = DVec2::from_slice(&numbers(expected));
    let error = found.distance(expected).min(found.distance(-expected));
    assert!(error <= TOLERANCE, "{name}: {found} where {expected} is expected up to sign");
}

#[test]
fn every_quantity_of_the_reference_surfaces_agrees() {
    let Some(cases) = cases() else { return };
    for (name, case) in cases["surfaces"].as_object().expect("surfaces") {
        let s = surface(&case["surface"]);
        let points = case["uv"].as_array().expect("points");
        assert!(!points.is_empty());
        for (k, uv) in points.iter().enumerate() {
            let uv = numbers(uv);
            let at = |field: &str| format!("{name} {field}[{k}]");
            let d = s.derivatives(uv[0], uv[1]);
            let pairs = [("S", d.s), ("Su", d.su), ("Sv", d.sv), ("Suu", d.suu), ("Suv", d.suv), ("Svv", d.svv)];
            for (field, found) in pairs {
                assert_vector(&at(field), found, vector(&case[field][k]));
            }
            let (p, su, sv) = s.first_derivatives(uv[0], uv[1]);
            assert_vector(&at("S"), p, d.s);
            assert_vector(&at("Su"), su, d.su);
            assert_vector(&at("Sv"), sv, d.sv);
            assert_vector(&at("S"), s.point(uv[0], uv[1]), d.s);
            assert_vector(&at("n"), s.normal(uv[0], uv[1]), vector(&case["n"][k]));
            let c = s.curvature(uv[0], uv[1]);
            let pairs = [
                ("E", c.e),
                ("F", c.f),
                ("G", c.g),
                ("L", c.l),
                ("M", c.m),
                ("N", c.n),
                ("K", c.gaussian),
                ("H", c.mean),
                ("k1", c.k1),
                ("k2", c.k2),
                ("kmag", c.kmag),
            ];
            for (field, found) in pairs {
                assert_number(&at(field), found, case[field][k].as_f64().expect("a number"));
            }
            assert_direction(&at("d1"), c.d1, &case["d1"][k]);
            assert_direction(&at("d2"), c.d2, &case["d2"][k]);
            assert_direction(&at("dmag"), c.dmag, &case["dmag"][k]);
        }
        let grid_points: Vec<Vec<f64>> = points.iter().map(numbers).collect();
        let (us, vs): (Vec<f64>, Vec<f64>) = grid_points.iter().map(|p| (p[0], p[1])).unzip();
        let mut grid = GridSamples::default();
        s.grid(&us, &vs, &mut grid);
        for k in 0..us.len() {
            assert_vector(&format!("{name} grid"), grid.positions[k * us.len() + k], vector(&case["S"][k]));
            assert_vector(&format!("{name} grid normal"), grid.normals[k * us.len() + k], vector(&case["n"][k]));
        }
        assert_number(&format!("{name} area"), s.area(1e-11), case["area"].as_f64().expect("a number"));
    }
}

#[test]
fn knot_insertion_gives_the_reference_nets() {
    let Some(cases) = cases() else { return };
    for (name, case) in cases["surfaces"].as_object().expect("surfaces") {
        let after = &case["after_knot_insertion"];
        let inserted = surface(&case["surface"])
            .insert_knots_u(&numbers(&after["inserted"]["u"]))
            .and_then(|s| s.insert_knots_v(&numbers(&after["inserted"]["v"])))
            .expect("the knots can be inserted");
        let expected = surface(&after["surface"]);
        assert_eq!(inserted.knots_u(), expected.knots_u());
        assert_eq!(inserted.knots_v(), expected.knots_v());
        for (a, b) in inserted.control().iter().zip(expected.control()) {
            assert_vector(name, *a, *b);
        }
        assert_eq!(inserted.weights().is_some(), expected.weights().is_some());
        for (a, b) in inserted.weights().iter().flat_map(|w| w.iter()).zip(expected.weights().unwrap_or_default()) {
            assert_number(name, *a, *b);
        }
    }
}

#[test]
fn the_reference_curve_and_its_bezier_form_agree() {
    let Some(cases) = cases() else { return };
    let case = &cases["curve"];
    let c = curve(case);
    for (k, t) in numbers(&case["t"]).into_iter().enumerate() {
        let found = c.derivatives(t);
        for (d, field) in ["C", "C1", "C2"].into_iter().enumerate() {
            assert_vector(&format!("{field}({t})"), found[d], vector(&case[field][k]));
        }
        assert_vector("point", c.point(t), found[0]);
    }
    let mut bezier = case["bezier"].clone();
    bezier["degree"] = case["degree"].clone();
    let expected = curve(&bezier);
    let segments = c.to_bezier();
    assert_eq!(segments.len() * 3 + 1, expected.control().len());
    for (k, segment) in segments.iter().enumerate() {
        for j in 0..=3 {
            assert_vector("bezier", segment.control[j], expected.control()[3 * k + j]);
            let weights = segment.weights.as_ref().expect("rational");
            assert_number("bezier weight", weights[j], expected.weights().expect("rational")[3 * k + j]);
        }
    }
}
