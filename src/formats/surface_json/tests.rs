use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use crate::engine::nurbs::{Curve2, KnotVector, Surface};
use crate::engine::trimming::{TrimCurve, TrimLoop, TrimShape};

/// A bilinear plate of 40 x 20 with everything that a file may hold.
const PLATE: &str = r#"{
  "name": "plate", "units": "mm", "side": "reversed",
  "degree_u": 1, "degree_v": 2,
  "knots_u": [0, 0, 40, 40], "knots_v": [0, 0, 0, 20, 20, 20],
  "control_points": [[[0,0,0],[0,10,0],[0,20,0]], [[40,0,0],[40,10,0],[40,20,0]]],
  "weights": [[1, 1, 1], [1, 0.5, 1]],
  "trims": [
    [ { "points": [[1,1],[39,1],[39,19]] },
      { "degree": 1, "knots": [0,0,1,1], "control_points": [[1,1],[39,19]], "weights": [1,1], "reversed": true } ]
  ],
  "labels": { "part_number": "4711-A" },
  "extra": { "anything": [1, { "a": null }, "x"] }
}"#;

fn reads(text: &str) -> Result<ReadSurface, Vec<Fault>> {
    read(text.as_bytes(), &ReadOptions::default())
}

/// Faults as `pointer: detail` lines.
fn faults(text: &str) -> Vec<String> {
    let faults = reads(text).expect_err("this document has faults");
    faults.into_iter().map(|f| format!("{}: {}", f.pointer, f.detail)).collect()
}

/// The plate with one piece of its text replaced.
fn plate(from: &str, to: &str) -> String {
    assert!(PLATE.contains(from), "{from}");
    PLATE.replacen(from, to, 1)
}

/// The one fault of the plate with a piece of its text replaced.
fn one_fault(from: &str, to: &str) -> String {
    let all = faults(&plate(from, to));
    assert_eq!(all.len(), 1, "{all:?}");
    all[0].clone()
}

#[test]
fn a_whole_document_is_read_as_it_stands() {
    let read = reads(PLATE).unwrap();
    assert_eq!(read.name.as_deref(), Some("plate"));
    assert_eq!(read.units, Units::Mm);
    assert_eq!(read.labels["part_number"], "4711-A");
    assert_eq!(read.trimmed.side, Side::Reversed);
    let surface = &read.trimmed.surface;
    assert_eq!((surface.knots_u().degree(), surface.knots_v().degree()), (1, 2));
    assert_eq!(surface.control()[4], DVec3::new(40.0, 10.0, 0.0), "u is the slow index");
    assert_eq!(surface.weights().unwrap()[4], 0.5);
    let curves = &read.trimmed.loops[0].curves;
    assert!(matches!(&curves[0].shape, TrimShape::Polyline(p) if p.len() == 3) && !curves[0].reversed);
    assert!(matches!(&curves[1].shape, TrimShape::Nurbs(c) if c.weights().is_some()) && curves[1].reversed);
    assert!(read.inferred.is_empty());
}

#[test]
fn lengths_become_millimetres_and_a_missing_unit_is_refused_with_the_reason() {
    let inches = reads(&plate("\"units\": \"mm\"", "\"units\": \"in\"")).unwrap();
    assert_eq!(inches.trimmed.surface.control()[5], DVec3::new(40.0 * 25.4, 20.0 * 25.4, 0.0));
    let fault = one_fault("\"units\": \"mm\",", "");
    assert!(fault.starts_with("/units: ") && fault.contains("too small"), "{fault}");
    assert_eq!(one_fault("\"units\": \"mm\"", "\"units\": null"), fault);
    assert!(one_fault("\"mm\"", "\"furlong\"").starts_with("/units: "));
    let options = ReadOptions { units: Some(Units::Cm), side: Some(Side::Normal), ..ReadOptions::default() };
    let read = read(PLATE.as_bytes(), &options).unwrap();
    assert_eq!((read.units, read.trimmed.side), (Units::Cm, Side::Normal));
    assert_eq!(read.inferred.len(), 2, "the request went before the file, twice: {:?}", read.inferred);
}

#[test]
fn knots_without_the_first_and_the_last_are_completed_and_reported() {
    let short = plate("[0, 0, 0, 20, 20, 20]", "[0, 0, 20, 20]");
    let read = reads(&short).unwrap();
    assert_eq!(read.trimmed.surface, reads(PLATE).unwrap().trimmed.surface);
    assert_eq!(read.inferred.len(), 1);
    assert!(read.inferred[0].starts_with("/knots_v"), "{:?}", read.inferred);
}

#[test]
fn all_faults_come_out_together_each_with_its_pointer() {
    let text = r#"{
      "units": "mm", "colour": "red", "degree_u": 0, "degree_v": 1, "degree_v": 1,
      "knots_u": [0, 0, 1, 1], "knots_v": [0, 1, 0.5, NaN],
      "control_points": [[[0,0,0],[0,1,1e999]], [[1,0],[1,1,0],[2,2,2]]],
      "weights": [[1, -1], [1, "1"]],
      "trims": [ [], [ { "points": [[0,0]] }, 7, { "degree": 1, "knots": [0,0,1,1] } ] ],
      "labels": { "n": 5 }
    }"#;
    let found = faults(text);
    for pointer in [
        "/colour",
        "/degree_u",
        "/degree_v",
        "/knots_v/2",
        "/knots_v/3",
        "/control_points/0/1/2",
        "/control_points/1/0",
        "/control_points/1",
        "/weights/0/1",
        "/weights/1/1",
        "/trims/0",
        "/trims/1/0/points",
        "/trims/1/1",
        "/trims/1/2/control_points",
        "/labels/n",
    ] {
        let hits = found.iter().filter(|f| f.split(": ").next() == Some(pointer)).count();
        assert_eq!(hits, 1, "{pointer} in {found:#?}");
    }
    assert_eq!(found.len(), 15, "{found:#?}");
}

#[test]
fn each_kind_of_fault_is_named_where_it_is() {
    for (from, to, pointer, words) in [
        ("\"degree_v\": 2", "\"degree_v\": 26", "/degree_v", "1 to 25"),
        ("\"degree_v\": 2", "\"degree_v\": 1.5", "/degree_v", "whole number"),
        ("[0, 0, 40, 40]", "[0, 0, 40]", "/knots_u", "3 knots where 2 rows of control points of degree 1 need 4"),
        ("[0, 0, 40, 40]", "[0, 0, 0, 0]", "/knots_u", "no length"),
        ("[0, 0, 40, 40]", "[0, 0, 40, 1e13]", "/knots_u/3", "scale"),
        ("[0, 0, 40, 40]", "null", "/knots_u", "missing"),
        ("[0, 0, 40, 40]", "\"0 0 1 1\"", "/knots_u", "a list is needed here, this is a text"),
        ("[40,10,0]", "[40,10,Infinity]", "/control_points/1/1/2", "failed to compute"),
        ("[40,10,0]", "[40,10,1e999]", "/control_points/1/1/2", "larger than any"),
        ("[40,10,0]", "[40,10,0,1]", "/control_points/1/1", "weights stand apart"),
        ("[40,10,0]", "[40,10,\"0\"]", "/control_points/1/1/2", "quotes"),
        ("[40,10,0]", "[40,1e10,0]", "/control_points/1/1", "1000 km"),
        ("[40,10,0],", "", "/control_points/1", "2 points, the first row 3"),
        ("0.5", "0", "/weights/1/1", "greater than 0"),
        ("0.5", "1e-10", "/weights/1/1", "factor"),
        ("[[1, 1, 1], [1, 0.5, 1]]", "[[1, 1], [1, 1]]", "/weights", "2 x 2 weights where the control net is 2 x 3"),
        ("\"reversed\",", "\"left\",", "/side", "Su x Sv"),
        ("\"reversed\": true", "\"reversed\": 1", "/trims/0/1/reversed", "true or false"),
        ("\"weights\": [1,1]", "\"weights\": [1,1,1]", "/trims/0/1/weights", "3 weights for 2"),
        ("\"weights\": [1,1]", "\"weights\": [1,-1]", "/trims/0/1/weights/1", "greater than 0"),
        ("\"degree\": 1", "\"degree\": 2", "/trims/0/1", "too few"),
        ("\"points\": [[1,1]", "\"points\": [[1,1,0]", "/trims/0/0/points/0", "u and v"),
        ("{ \"points\":", "{ \"degree\": 1, \"points\":", "/trims/0/0", "not both"),
        ("\"reversed\": true", "\"reverse\": true", "/trims/0/1/reverse", "did you mean \"reversed\""),
        ("\"units\"", "\"unit\": 1, \"units\"", "/unit", "did you mean \"units\""),
        ("\"name\": \"plate\"", "\"name\": 4711", "/name", "a text is needed"),
        ("\"4711-A\"", "4711", "/labels/part_number", "quotes"),
    ] {
        let fault = one_fault(from, to);
        assert!(fault.starts_with(pointer) && fault.contains(words), "{from} -> {to}: {fault}");
    }
}

#[test]
fn too_small_and_too_far_surfaces_are_refused() {
    let flat = plate(
        "[[[0,0,0],[0,10,0],[0,20,0]], [[40,0,0],[40,10,0],[40,20,0]]]",
        "[[[1,1,1],[1,1,1],[1,1,1]],[[1,1,1],[1,1,1],[1,1,1]]]",
    );
    assert!(faults(&flat)[0].contains("no extent"));
    let far = plate(
        "[[[0,0,0],[0,10,0],[0,20,0]], [[40,0,0],[40,10,0],[40,20,0]]]",
        "[[[1e8,0,0],[1e8,0.01,0],[1e8,0.02,0]],[[1e8,0,0.01],[1e8,0.01,0.01],[1e8,0.02,0.01]]]",
    );
    assert!(faults(&far)[0].contains("move it closer"));
}

#[test]
fn text_that_is_not_json_gives_line_and_column_and_what_was_found_before() {
    let found = faults("{ \"degree_u\": 99,\n  \"knots_u\": [0, 0, 1 1] }");
    assert!(found[0].starts_with("/degree_u: "));
    assert_eq!(found[1], "/knots_u: line 2, column 23: a comma or ] is expected here");
    assert!(faults("")[0].contains("line 1, column 1"));
    assert!(faults("{\"units\": \"mm\"} x")[0].contains("after the end"));
    let fault = &read(b"{\"name\": \"\xE4\"}", &ReadOptions::default()).unwrap_err()[0];
    assert!(fault.detail.contains("line 1, column 11") && fault.detail.contains("UTF-8"), "{}", fault.detail);
    assert!(reads(&format!("\u{feff}{PLATE}")).is_ok(), "a byte order mark does no harm");
    assert!(faults("[1, 2]")[0].contains("an object is needed here, this is a list"));
}

#[test]
fn every_count_has_its_limit() {
    let limits = ReadLimits { control_points: 5, loops: 1, curves: 1, trim_points: 4 };
    let options = ReadOptions { limits, ..ReadOptions::default() };
    let found = read(PLATE.as_bytes(), &options).unwrap_err();
    for words in ["more than 2 points", "more than 1 trimming curves"] {
        assert!(found.iter().any(|f| f.detail.contains(words)), "{words}: {found:#?}");
    }
    let labels: Vec<String> = (0..100).map(|i| format!("\"k{i}\": \"v\"")).collect();
    let many = plate("\"part_number\": \"4711-A\"", &labels.join(","));
    assert!(faults(&many)[0].contains("more than 64 labels"));
    let long = plate("\"plate\"", &format!("\"{}\"", "x".repeat(limits::MAX_TEXT + 1)));
    assert!(faults(&long)[0].contains("more than 1000 characters"));
    let bad = plate("[0, 0, 40, 40]", &format!("[{}0]", "null,".repeat(100_000)));
    assert_eq!(faults(&bad).len(), crate::formats::faults::MAX_FAULTS + 1);
}

#[test]
fn faults_of_the_loops_have_their_pointer_and_place() {
    let gap = faults(&plate("\"control_points\": [[1,1],[39,19]]", "\"control_points\": [[2,3],[39,19]]"));
    assert!(gap[0].starts_with("/trims/0/1: ") && gap[0].contains("mm from the start"), "{gap:?}");
    let crossing = reads(&plate("[[1,1],[39,1],[39,19]]", "[[1,1],[39,1],[10,3],[10,1],[39,19]]")).unwrap_err();
    assert!(crossing[0].pointer.starts_with("/trims/0"), "{crossing:?}");
    assert!(crossing[0].place.as_ref().is_some_and(|p| p.uv.is_some()), "{crossing:?}");
    let outside = faults(&plate("[39,1]", "[45,1]"));
    assert!(outside[0].starts_with("/trims/0/0: "), "{outside:?}");
}

#[test]
fn pointers_begin_with_the_prefix() {
    let options = ReadOptions { pointer_prefix: "/surface".into(), ..ReadOptions::default() };
    let found = read(plate("\"degree_u\": 1", "\"degree_u\": 0").as_bytes(), &options).unwrap_err();
    assert_eq!(found[0].pointer, "/surface/degree_u");
}

#[test]
fn the_real_surfaces_are_read_without_faults() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(folder) else {
        println!("skipped: {folder} is not there");
        return;
    };
    let mut count = 0;
    for entry in entries {
        let path = entry.unwrap().path();
        let bytes = std::fs::read(&path).unwrap();
        let read = read(&bytes, &ReadOptions::default()).unwrap_or_else(|f| panic!("{}: {f:?}", path.display()));
        assert!(!read.trimmed.loops.is_empty());
        let again = reads(&write(read.name.as_deref(), &read.labels, &read.trimmed)).unwrap();
        assert_eq!(again.trimmed, read.trimmed, "{}", path.display());
        count += 1;
    }
    assert!(count >= 60, "{count} surfaces");
}

/// A coordinate whose bits have no pattern, within what can be worked with.
fn coordinate() -> impl Strategy<Value = f64> {
    -1e5..1e5_f64
}

fn knot_vector(count: usize, degree: usize) -> impl Strategy<Value = KnotVector> {
    prop::collection::vec(0.1..2.0_f64, count + degree + 1).prop_map(move |steps| {
        let mut at = -3.0;
        let knots = steps.iter().map(|s| {
            at += s;
            at
        });
        KnotVector::new(degree, knots.collect(), "knots").unwrap()
    })
}

fn any_trim_curve() -> impl Strategy<Value = TrimCurve> {
    let point = || [coordinate(), coordinate()].prop_map(DVec2::from_array);
    let nurbs = (1_usize..4, 0_usize..4).prop_flat_map(move |(degree, more)| {
        let count = degree + 1 + more;
        let weights = prop::option::of(prop::collection::vec(0.1..10.0_f64, count));
        (knot_vector(count, degree), prop::collection::vec(point(), count), weights)
            .prop_map(|(k, p, w)| TrimShape::Nurbs(Curve2::new(k, p, w).unwrap()))
    });
    let polyline = prop::collection::vec(point(), 2..6).prop_map(TrimShape::Polyline);
    (prop_oneof![nurbs, polyline], any::<bool>()).prop_map(|(shape, reversed)| TrimCurve { shape, reversed })
}

fn any_surface() -> impl Strategy<Value = TrimmedSurface> {
    (1_usize..4, 1_usize..4, 0_usize..3, 0_usize..3).prop_flat_map(|(pu, pv, mu, mv)| {
        let (nu, nv) = (pu + 1 + mu, pv + 1 + mv);
        let net =
            prop::collection::vec([coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array), nu * nv);
        let weights = prop::option::of(prop::collection::vec(0.1..10.0_f64, nu * nv));
        let loops = prop::collection::vec(prop::collection::vec(any_trim_curve(), 1..3), 0..3);
        (knot_vector(nu, pu), knot_vector(nv, pv), net, weights, loops, any::<bool>()).prop_map(
            |(u, v, p, w, loops, flip)| TrimmedSurface {
                surface: Surface::new(u, v, p, w).unwrap(),
                loops: loops.into_iter().map(|curves| TrimLoop { curves }).collect(),
                side: if flip { Side::Reversed } else { Side::Normal },
            },
        )
    })
}

/// A part of so many plates side by side, 10 mm wide.
fn plates(count: usize) -> serde_json::Value {
    let plate = |k: usize| {
        let x = 10.0 * k as f64;
        serde_json::json!({
            "degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
            "control_points": [[[x, 0, 0], [x, 5, 0]], [[x + 10.0, 0, 0], [x + 10.0, 5, 0]]],
        })
    };
    serde_json::json!({ "name": "plates", "units": "cm", "side": "reversed", "faces": (0..count).map(plate).collect::<Vec<_>>() })
}

fn part_faults(part: &serde_json::Value) -> Vec<String> {
    let faults = read_content(part.to_string().as_bytes(), &ReadOptions::default()).unwrap_err();
    faults.iter().map(|fault| format!("{} {}", fault.pointer, fault.detail)).collect()
}

#[test]
fn the_faces_of_a_part_are_read_with_what_stands_once() {
    let mut part = plates(3);
    part["faces"][1]["side"] = "normal".into();
    let read = read_content(part.to_string().as_bytes(), &ReadOptions::default()).unwrap();
    let ReadContent::Part(read) = read else { panic!("a part was sent") };
    assert_eq!((read.name.as_deref(), read.units, read.part.faces.len()), (Some("plates"), Units::Cm, 3));
    let sides: Vec<Side> = read.part.faces.iter().map(|face| face.side).collect();
    assert_eq!(sides, [Side::Reversed, Side::Normal, Side::Reversed]);
    assert_eq!(read.part.faces[2].surface.control()[3], glam::DVec3::new(300.0, 50.0, 0.0));
}

#[test]
fn faults_of_faces_are_named_where_they_are() {
    let mut part = plates(3);
    part["faces"][1]["knots_v"] = serde_json::json!([0, 0, 1]);
    part["faces"][2]["units"] = "mm".into();
    part["faces"][2]["trims"] = serde_json::json!([[{ "points": [[0, 0], [2, 0], [0, 1], [0, 0]] }]]);
    part["degree_u"] = 1.into();
    let faults = part_faults(&part);
    for pointer in ["/faces/1/knots_v", "/faces/2/units", "/degree_u"] {
        assert!(faults.iter().any(|fault| fault.starts_with(&format!("{pointer} "))), "{pointer}: {faults:?}");
    }
    let mut outside = plates(2);
    outside["faces"][1]["trims"] = serde_json::json!([[{ "points": [[0, 0], [2, 0], [0, 1], [0, 0]] }]]);
    assert!(part_faults(&outside)[0].starts_with("/faces/1/trims/0"), "{:?}", part_faults(&outside));
    assert!(part_faults(&plates(0))[0].contains("at least one face"));
    assert!(part_faults(&plates(1001))[0].contains("more than 1000 faces"));
    let mut nested = plates(1);
    nested["faces"][0]["faces"] = serde_json::json!([]);
    assert!(part_faults(&nested)[0].contains("stands once"));
    let alone = read(plates(2).to_string().as_bytes(), &ReadOptions::default()).unwrap_err();
    assert_eq!(alone[0].pointer, "/faces");
}

proptest! {
    #[test]
    fn what_is_written_reads_back_bit_for_bit(surface in any_surface(), name in "\\PC{0,40}", key in "\\PC{1,20}", value in any::<String>()) {
        let labels = BTreeMap::from([(key, value)]);
        let text = write(Some(&name), &labels, &surface);
        let mut faults = FaultList::default();
        let draft = draft::read(&text, "", &ReadLimits::default(), &mut faults).expect("it is JSON");
        let read = check::check(draft, &ReadOptions::default(), &mut faults);
        prop_assert!(faults.is_empty(), "{:?}", faults.into_faults());
        let read = read.unwrap();
        let check::Content::Surface(trimmed) = &read.content else { panic!("one surface was written") };
        prop_assert_eq!(trimmed, &surface);
        prop_assert_eq!((read.name, read.labels), (Some(name), labels));
        prop_assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok());
    }

    #[test]
    fn arbitrary_bytes_give_faults_or_a_surface_never_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        if let Err(faults) = read(&bytes, &ReadOptions::default()) {
            prop_assert!(!faults.is_empty());
        }
    }

    #[test]
    fn mutated_documents_give_faults_or_a_surface_never_a_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0_usize..40, "[0-9eE.,:\\[\\]{}\"a-z -]{0,6}"), 1..6)
    ) {
        let mut text = PLATE.to_owned();
        for (at, remove, insert) in edits {
            let at = at.index(text.len());
            let end = (at + remove).min(text.len());
            text.replace_range(at..end, &insert);
        }
        if let Err(faults) = read(text.as_bytes(), &ReadOptions::default()) {
            prop_assert!(!faults.is_empty());
            prop_assert!(faults.iter().all(|f| f.pointer.is_empty() || f.pointer.starts_with('/')));
        }
    }
}
