//! Files that lie, are cut off, or are no files at all: refused in words, with the place, and never with a panic.

use proptest::prelude::*;
use serde_json::{Value, json};

use super::build::{File, container};
use crate::formats::faults::Fault;
use crate::formats::gltf_mesh::{MeshLimits, ReadOptions, read};

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

fn sound() -> File {
    File::of(&SQUARE, &[0, 1, 2, 0, 2, 3])
}

fn refused(bytes: &[u8]) -> Vec<Fault> {
    read(bytes, &ReadOptions::default()).expect_err("this file has a fault")
}

/// The file with one value changed must be refused there, in these words.
fn refuse(pointer: &str, value: Value, at: &str, words: &str) {
    let mut file = sound();
    set(&mut file.json, pointer, value);
    let faults = refused(&file.glb());
    assert!(
        faults.iter().any(|f| f.pointer == at && f.detail.contains(words)),
        "{pointer}: wanted {words:?} at {at:?}: {faults:?}"
    );
}

/// Sets a value, also of a field that is not there yet.
fn set(json: &mut Value, pointer: &str, value: Value) {
    let (parent, field) = pointer.rsplit_once('/').unwrap();
    let parent = json.pointer_mut(parent).unwrap();
    match parent {
        Value::Array(list) => list[field.parse::<usize>().unwrap()] = value,
        _ => parent[field] = value,
    }
}

/// A change to what an accessor says.
type Change = fn(&mut Value);

#[test]
fn accessors_that_lie_are_refused_at_their_place() {
    for (pointer, value, at, words) in [
        ("/accessors/0/count", json!(5), "/accessors/0", "do not fit"),
        ("/accessors/0/count", json!(0), "/accessors/0", "count is 0"),
        ("/accessors/0/count", json!(-1), "/accessors/0", "count is -1"),
        ("/accessors/0/count", json!(2.5), "/accessors/0", "count is 2.5"),
        ("/accessors/0/count", json!(4_000_000_000_u64), "/meshes/0/primitives/0", "coarser"),
        ("/accessors/0/count", json!(1e300), "/accessors/0", "count is"),
        ("/accessors/0/byteOffset", json!(4), "/accessors/0", "do not fit"),
        ("/accessors/0/byteOffset", json!(9e15), "/accessors/0", "do not fit"),
        ("/accessors/0/byteOffset", json!(-4), "/accessors/0", "byteOffset"),
        ("/accessors/0/componentType", json!(5125), "/accessors/0", "componentType"),
        ("/accessors/0/componentType", json!(17), "/accessors/0", "componentType"),
        ("/accessors/0/type", json!("VEC2"), "/accessors/0", "VEC3"),
        ("/accessors/0/bufferView", json!(9), "/accessors/0", "no view 9"),
        ("/accessors/1/count", json!(7), "/accessors/1", "do not fit"),
        ("/accessors/1/count", json!(5), "/accessors/1", "whole number of triangles"),
        ("/accessors/1/type", json!("VEC3"), "/accessors/1", "SCALAR"),
        ("/accessors/1/componentType", json!(5126), "/accessors/1", "unsigned"),
        ("/bufferViews/0/byteStride", json!(4), "/accessors/0", "byteStride"),
        ("/bufferViews/0/byteStride", json!(24), "/accessors/0", "do not fit"),
        ("/bufferViews/0/byteStride", json!(9e15), "/accessors/0", "do not fit"),
        ("/bufferViews/0/byteOffset", json!(9e15), "/accessors/0", "buffer has"),
        ("/bufferViews/0/byteLength", json!(9e15), "/accessors/0", "buffer has"),
        ("/bufferViews/0/byteLength", json!(47), "/accessors/0", "do not fit"),
        ("/bufferViews/0/byteLength", json!(-1), "/accessors/0", "byteLength"),
        ("/bufferViews/0/buffer", json!(3), "/accessors/0", "buffer that is not among"),
        ("/meshes/0/primitives/0/indices", json!(5), "/accessors/5", "no accessor 5"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(-2), "/accessors/-2", "no accessor -2"),
        ("/meshes/0/primitives/0/mode", json!(7), "/meshes/0/primitives/0/mode", "no mode 7"),
        ("/nodes/0/mesh", json!(1), "/nodes/0/mesh", "no mesh 1"),
        ("/scene", json!(4), "/scene", "no scene 4"),
        ("/scenes/0/nodes/0", json!(4), "/scenes/0/nodes/0", "no node 4"),
        ("/asset/version", json!("1.0"), "/asset/version", "2.0"),
        ("/nodes/0/matrix", json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), "/nodes/0/matrix", "last row"),
        ("/nodes/0/rotation", json!([0, 0, 0, 0]), "/nodes/0/rotation", "quaternion"),
        ("/nodes/0/scale", json!([1e300, 1e300, 1e300]), "", "beyond"),
        ("/nodes/0/scale", json!([1e-30, 1e-30, 1e-30]), "", "next to nothing"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "/extensionsRequired/0", "without Draco"),
        ("/extensionsRequired", json!(["EXT_meshopt_compression"]), "/extensionsRequired/0", "without meshopt"),
        ("/extensionsRequired", json!(["ACME_shape"]), "/extensionsRequired/0", "ACME_shape"),
        ("/bufferViews/0/extensions", json!({ "EXT_meshopt_compression": {} }), "/accessors/0", "compressed"),
        (
            "/meshes/0/primitives/0/extensions",
            json!({ "KHR_draco_mesh_compression": {} }),
            "/meshes/0/primitives/0",
            "Draco",
        ),
        ("/buffers", json!([{ "byteLength": 999 }]), "/buffers/0", "byteLength is 999"),
        ("/buffers", json!([{ "byteLength": -1 }]), "/buffers/0", "byteLength"),
        ("/accessors", json!("none"), "", "list"),
    ] {
        refuse(pointer, value, at, words);
    }
}

#[test]
fn sparse_parts_that_lie_are_refused() {
    let sparse = |change: fn(&mut Value)| {
        let mut file = sound();
        let (places, values) = (file.view(&[2]), file.view(&[0; 12]));
        let mut sparse = json!({
            "count": 1, "indices": { "bufferView": places, "componentType": 5121 }, "values": { "bufferView": values },
        });
        change(&mut sparse);
        file.json["accessors"][0]["sparse"] = sparse;
        file
    };
    let cases: [(Change, &str); 4] = [
        (|s| s["count"] = json!(5), "sparse count"),
        (|s| s["count"] = json!(2), "do not fit"),
        (|s| s["indices"]["componentType"] = json!(5126), "unsigned"),
        (|s| s["values"] = json!({}), "names no view"),
    ];
    for (change, words) in cases {
        let faults = refused(&sparse(change).glb());
        assert!(faults[0].detail.contains(words), "{words}: {faults:?}");
    }
    let mut file = sparse(|_| {});
    let at = file.json["bufferViews"][2]["byteOffset"].as_u64().unwrap() as usize;
    file.binary[at] = 77;
    assert!(refused(&file.glb())[0].detail.contains("sets element 77"));
    // A small file cannot ask for a large list of zeros.
    file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    file.json["accessors"][0]["count"] = json!(1_000_000);
    assert!(refused(&file.glb())[0].detail.contains("1000000 elements"));
}

#[test]
fn an_index_beyond_the_vertices_and_a_position_that_is_no_number_are_named() {
    let faults = refused(&File::of(&SQUARE, &[0, 1, 2, 0, 2, 4]).glb());
    assert_eq!(faults[0].pointer, "/accessors/1");
    assert!(faults[0].detail.contains("index 5 names vertex 4"), "{faults:?}");
    for x in [f32::NAN, f32::INFINITY] {
        let mut points = SQUARE;
        points[3][1] = x;
        let faults = refused(&File::of(&points, &[0, 1, 2, 0, 2, 3]).glb());
        assert_eq!(faults[0].pointer, "/accessors/0");
        assert!(faults[0].detail.contains("position 3"), "{faults:?}");
    }
}

#[test]
fn other_files_are_never_opened() {
    for uri in [
        "part.bin",
        "file:///etc/passwd",
        "http://127.0.0.1/x",
        "//host/x",
        "../x",
        "%ff%00",
        "",
        "dat",
        "é",
        "data:,abc",
    ] {
        let mut file = sound();
        file.json["buffers"] = json!([{ "byteLength": 72, "uri": uri }]);
        let faults = refused(&file.glb());
        assert_eq!(faults[0].pointer, "/buffers/0", "{uri}");
        let words = if uri.starts_with("data") { "base64" } else { "embedded buffers" };
        assert!(faults[0].detail.contains(words), "{uri}: {faults:?}");
    }
}

#[test]
fn circles_of_nodes_and_nodes_of_two_parents_are_refused() {
    for (nodes, scene) in [
        (json!([{ "mesh": 0, "children": [0] }]), json!([0])),
        (json!([{ "children": [1] }, { "mesh": 0, "children": [0] }]), json!([0])),
        (json!([{ "mesh": 0 }]), json!([0, 0])),
    ] {
        let mut file = sound();
        file.json["nodes"] = nodes;
        file.json["scenes"] = json!([{ "nodes": scene }]);
        assert!(refused(&file.glb()).iter().any(|f| f.detail.contains("circle")));
    }
    let mut file = sound();
    file.json["nodes"] = json!([{ "children": [1] }, { "children": [0] }]);
    file.json.as_object_mut().unwrap().remove("scene");
    file.json["scenes"] = json!([]);
    assert!(refused(&file.glb())[0].detail.contains("circle"));
    // Each node twice under the next: a few dozen of them would show the mesh a million million times.
    let mut file = sound();
    let mut nodes = vec![json!({ "mesh": 0 })];
    nodes.extend((0..50).map(|k| json!({ "children": [k, k] })));
    file.json["nodes"] = json!(nodes);
    file.json["scenes"] = json!([{ "nodes": [50] }]);
    assert!(refused(&file.glb()).iter().any(|f| f.detail.contains("two nodes")));
}

#[test]
fn depth_and_size_have_bounds() {
    let chain = |depth: usize| {
        let mut file = sound();
        let mut nodes = vec![json!({ "mesh": 0 })];
        nodes.extend((0..depth - 1).map(|k| json!({ "children": [k] })));
        file.json["nodes"] = json!(nodes);
        file.json["scenes"] = json!([{ "nodes": [depth - 1] }]);
        file.glb()
    };
    assert!(read(&chain(64), &ReadOptions::default()).is_ok());
    assert!(refused(&chain(65))[0].detail.contains("deeper than 64"));
    let mut many = sound();
    many.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0 }, { "mesh": 0 }]);
    many.json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
    let limits = MeshLimits { triangles: 5, ..MeshLimits::default() };
    let faults = read(&many.glb(), &ReadOptions { limits, ..ReadOptions::default() }).unwrap_err();
    assert!(faults[0].detail.contains("more than 5 triangles"), "{faults:?}");
    let nothing = format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{}]}}"#, vec!["{}"; 100_001].join(","));
    assert!(refused(nothing.as_bytes())[0].detail.contains("at most 100000"));
}

#[test]
fn containers_that_are_cut_off_or_of_another_kind_are_refused() {
    let whole = sound().glb();
    for length in 0..whole.len() {
        assert!(read(&whole[..length], &ReadOptions::default()).is_err(), "{length} of {} bytes", whole.len());
    }
    for (bytes, words) in [
        (b"glTF\x01\0\0\0\x14\0\0\0".to_vec(), "version 1"),
        (b"glTF\x02\0\0\0\x0c\0\0\0".to_vec(), "no chunks"),
        (b"glTF\x02\0\0\0\x03\0\0\0".to_vec(), "shorter"),
        (b"glTF\x02\0\0\0\x14\0\0\0\xff\xff\xff\xffJSON".to_vec(), "more than are left"),
        (b"glTF\x02\0\0\0\x14\0\0\0\0\0\0\0BIN\0".to_vec(), "not JSON"),
        (container(b"{", None), "cannot be read"),
        (container(b"[]", None), "cannot be read"),
        (container(b"{}", None), "asset"),
        (container(br#"{"asset":{"version":"2.0"}}"#, None), "no triangles"),
        (container(sound().json.to_string().as_bytes(), None), "no triangles"),
    ] {
        let faults = read(&bytes, &ReadOptions::default()).unwrap_err();
        let found = faults.iter().any(|f| f.detail.contains(words)) || faults[0].pointer.starts_with("/accessors");
        assert!(found, "{words}: {faults:?}");
    }
}

#[test]
fn every_fault_is_listed_with_the_prefix_of_its_document() {
    let mut file = sound();
    file.json["accessors"][0]["type"] = json!("VEC4");
    file.json["asset"] = json!({ "version": "3.0" });
    file.json["extensionsRequired"] = json!(["ACME_a", "KHR_materials_unlit", "ACME_b"]);
    file.root(json!({ "mesh": 8 }));
    let options = ReadOptions { pointer_prefix: "/surface".into(), ..ReadOptions::default() };
    let faults = read(&file.gltf(), &options).unwrap_err();
    let pointers: Vec<&str> = faults.iter().map(|f| f.pointer.as_str()).collect();
    assert_eq!(
        pointers,
        [
            "/surface/asset/version",
            "/surface/extensionsRequired/0",
            "/surface/extensionsRequired/2",
            "/surface/nodes/1/mesh",
            "/surface/accessors/0",
        ]
    );
}

/// A file with most of what can be in one.
fn rich() -> File {
    let mut file = sound();
    let (places, values) = (file.view(&[2]), file.view(&[0; 12]));
    file.json["accessors"][0]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": places, "componentType": 5121 }, "values": { "bufferView": values },
    });
    file.json["bufferViews"][0]["byteStride"] = json!(12);
    file.json["nodes"][0]["children"] = json!([1]);
    file.push("nodes", json!({ "mesh": 0, "translation": [2, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, -1] }));
    file
}

/// All pointers to values that are no objects or lists.
fn leaves(value: &Value, at: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(fields) => fields.iter().for_each(|(k, v)| leaves(v, &format!("{at}/{k}"), out)),
        Value::Array(items) => items.iter().enumerate().for_each(|(k, v)| leaves(v, &format!("{at}/{k}"), out)),
        _ => out.push(at.to_owned()),
    }
}

fn wild() -> impl Strategy<Value = Value> {
    prop_oneof![
        any::<i64>().prop_map(|x| json!(x)),
        (-2_i64..40).prop_map(|x| json!(x)),
        any::<f64>().prop_map(|x| json!(x)),
        prop::sample::select(vec![5120, 5121, 5122, 5123, 5125, 5126]).prop_map(|x| json!(x)),
        Just(json!(null)),
        Just(json!("SCALAR")),
        Just(json!([])),
        Just(json!({})),
        Just(json!(u64::MAX)),
    ]
}

proptest! {
    #[test]
    fn arbitrary_bytes_are_read_or_refused_and_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read(&bytes, &ReadOptions::default());
        let mut magic = b"glTF\x02\0\0\0".to_vec();
        magic.extend_from_slice(&bytes);
        let _ = read(&magic, &ReadOptions::default());
        let _ = read(&container(&bytes, Some(&bytes)), &ReadOptions::default());
    }

    #[test]
    fn sound_files_with_a_few_wrong_values_are_read_or_refused_and_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), wild()), 1..4),
        embedded in any::<bool>(),
    ) {
        let mut file = rich();
        for (index, value) in changes {
            let mut all = Vec::new();
            leaves(&file.json, "", &mut all);
            let at = &all[index.index(all.len())];
            set(&mut file.json, at, value);
        }
        let bytes = if embedded { file.gltf() } else { file.glb() };
        if let Err(faults) = read(&bytes, &ReadOptions::default()) {
            prop_assert!(!faults.is_empty());
            prop_assert!(faults.iter().all(|f| !f.detail.is_empty()));
        }
    }

    #[test]
    fn sound_files_with_wrong_bytes_are_read_or_refused_and_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = rich().glb();
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        let _ = read(&bytes, &ReadOptions::default());
        let _ = read(&bytes[..cut.index(bytes.len())], &ReadOptions::default());
    }
}
