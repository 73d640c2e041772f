//! Each feature of glTF that shapes a mesh, in a file built for it.

use glam::DVec3;
use serde_json::{Value, json};

use super::build::File;
use crate::engine::mesh::{Mesh, measures};
use crate::formats::gltf_mesh::{ReadMesh, ReadOptions, read};
use crate::formats::units::Units;
use crate::formats::{MeshParts, glb};

/// The unit square, anticlockwise seen from +z.
const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
const HALVES: [u32; 6] = [0, 1, 2, 0, 2, 3];

fn of(bytes: &[u8]) -> ReadMesh {
    read(bytes, &ReadOptions::default()).unwrap_or_else(|faults| panic!("{faults:?}"))
}

fn primitive(position: usize, indices: Option<usize>, mode: u32) -> Value {
    let mut primitive = json!({ "attributes": { "POSITION": position }, "mode": mode });
    if let Some(indices) = indices {
        primitive["indices"] = json!(indices);
    }
    primitive
}

/// The sum of the triangles' normals times their areas, mm^2.
fn facing(mesh: &Mesh) -> DVec3 {
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            0.5 * (b - a).cross(c - a)
        })
        .sum()
}

/// A square metre that faces +z, as two triangles on four vertices.
fn assert_square(read: &ReadMesh) {
    let mesh = &read.assembled.mesh;
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
    assert!((facing(mesh) - DVec3::new(0.0, 0.0, 1e6)).length() < 1e-6, "{}", facing(mesh));
    assert_eq!(read.assembled.pieces.len(), 1);
    assert_eq!(read.assembled.pieces[0].borders_mm, [4000.0]);
}

#[test]
fn metres_become_millimetres_unless_it_is_said_otherwise() {
    let file = File::of(&SQUARE, &HALVES).glb();
    assert_square(&of(&file));
    assert_eq!(of(&file).units, Units::M);
    let options = ReadOptions { units: Some(Units::Mm), ..ReadOptions::default() };
    let read = read(&file, &options).unwrap();
    assert_eq!(measures::total_area(&read.assembled.mesh), 1.0);
    assert!(read.inferred.is_empty());
}

#[test]
fn a_data_uri_holds_the_same_mesh_as_the_binary_chunk() {
    let file = File::of(&SQUARE, &HALVES);
    assert_eq!(of(&file.gltf()).assembled, of(&file.glb()).assembled);
    let text = String::from_utf8(file.gltf()).unwrap();
    assert_square(&of(format!("\u{feff}  {text}").replace("data:", "DATA:").as_bytes()));
}

#[test]
fn indices_of_each_width_and_none_at_all_give_the_same() {
    let mut widths = Vec::new();
    for width in 0..4 {
        let mut file = File::new();
        let mode = 4;
        let primitive = if width == 3 {
            let points: Vec<[f32; 3]> = HALVES.iter().map(|&k| SQUARE[k as usize]).collect();
            let positions = file.positions(&points);
            primitive(positions, None, mode)
        } else {
            let positions = file.positions(&SQUARE);
            let indices = match width {
                0 => file.indices_u8(&HALVES.map(|i| i as u8)),
                1 => file.indices_u16(&HALVES.map(|i| i as u16)),
                _ => file.indices_u32(&HALVES),
            };
            primitive(positions, Some(indices), mode)
        };
        let mesh = file.mesh(&[primitive]);
        file.root(json!({ "mesh": mesh }));
        let read = of(&file.glb());
        assert_square(&read);
        widths.push(read.assembled.mesh);
    }
    assert!(widths.windows(2).all(|w| w[0] == w[1]));
}

#[test]
fn strips_and_fans_face_as_lists_do() {
    for (mode, order, indexed) in
        [(5, [0, 1, 3, 2], true), (5, [0, 1, 3, 2], false), (6, [0, 1, 2, 3], true), (6, [0, 1, 2, 3], false)]
    {
        let mut file = File::new();
        let primitive = if indexed {
            let positions = file.positions(&SQUARE);
            let indices = file.indices_u8(&order);
            primitive(positions, Some(indices), mode)
        } else {
            let positions = file.positions(&order.map(|k| SQUARE[k as usize]));
            primitive(positions, None, mode)
        };
        let mesh = file.mesh(&[primitive]);
        file.root(json!({ "mesh": mesh }));
        let read = of(&file.glb());
        assert_square(&read);
        assert_eq!(read.assembled.changes.turned, 0, "mode {mode}");
    }
}

#[test]
fn a_strip_that_leads_on_over_repeated_corners_loses_nothing_and_warns_of_nothing() {
    let mut file = File::new();
    let far = SQUARE.map(|p| [p[0] + 5.0, p[1], p[2]]);
    let positions = file.positions(&[SQUARE, far].concat());
    let indices = file.indices_u16(&[0, 1, 3, 2, 2, 4, 4, 5, 7, 6]);
    let mesh = file.mesh(&[primitive(positions, Some(indices), 5)]);
    file.root(json!({ "mesh": mesh }));
    let read = of(&file.glb());
    assert_eq!(read.assembled.mesh.triangles.len(), 4);
    assert_eq!(read.assembled.changes.without_area, 0);
    assert_eq!(facing(&read.assembled.mesh), DVec3::new(0.0, 0.0, 2e6));
}

#[test]
fn several_primitives_and_meshes_become_one_mesh_where_they_meet() {
    let mut file = File::new();
    let positions = file.positions(&SQUARE);
    let halves = [file.indices_u8(&[0, 1, 2]), file.indices_u8(&[0, 2, 3])];
    let one = file.mesh(&[primitive(positions, Some(halves[0]), 4), primitive(positions, Some(halves[1]), 4)]);
    file.root(json!({ "mesh": one }));
    assert_square(&of(&file.glb()));
    let mut file = File::new();
    for half in [[0, 1, 2], [0, 2, 3]] {
        let positions = file.positions(&half.map(|k: usize| SQUARE[k]));
        let mesh = file.mesh(&[primitive(positions, None, 4)]);
        file.root(json!({ "mesh": mesh }));
    }
    let read = of(&file.glb());
    assert_square(&read);
    assert_eq!((read.primitives, read.assembled.changes.welded), (2, 2));
}

#[test]
fn a_mesh_that_two_nodes_show_is_there_twice() {
    let mut file = File::of(&SQUARE, &HALVES);
    file.root(json!({ "mesh": 0, "translation": [1.0, 0.0, 0.0], "name": "again" }));
    let read = of(&file.glb());
    assert_eq!(read.assembled.mesh.triangles.len(), 4);
    assert_eq!(read.assembled.pieces.len(), 1, "the two share an edge");
    assert_eq!(read.assembled.pieces[0].borders_mm, [6000.0]);
    file.json["nodes"][1]["translation"] = json!([3.0, 0.0, 0.0]);
    assert_eq!(of(&file.glb()).assembled.pieces.len(), 2);
    file.json["nodes"][1]["translation"] = json!([0.0, 0.0, 0.0]);
    let read = of(&file.glb());
    assert_eq!((read.assembled.mesh.triangles.len(), read.assembled.changes.doubled), (2, 2));
}

#[test]
fn transforms_of_nested_nodes_work_from_the_inside_out() {
    // A quarter turn about z (x to y), then twice as large, then moved; written as TRS in two nodes and as one matrix.
    let mut file = File::of(&SQUARE, &HALVES);
    file.json["nodes"] = json!([
        { "children": [1], "translation": [10.0, 0.0, 0.0] },
        { "children": [2], "rotation": [0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()], "scale": [2.0, 2.0, 2.0] },
        { "mesh": 0 },
    ]);
    let nested = of(&file.glb()).assembled.mesh;
    file.json["nodes"] = json!([
        { "mesh": 0, "matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 10, 0, 0, 1] },
    ]);
    let matrix = of(&file.glb()).assembled.mesh;
    let want = [[10.0, 0.0], [10.0, 2.0], [8.0, 2.0], [8.0, 0.0]].map(|p: [f64; 2]| DVec3::new(p[0], p[1], 0.0) * 1e3);
    for mesh in [nested, matrix] {
        for (p, want) in mesh.positions.iter().zip(want) {
            assert!(p.distance(want) < 1e-9, "{p} {want}");
        }
        assert!((facing(&mesh).z - 4e6).abs() < 1e-3);
    }
}

#[test]
fn a_mirroring_transform_turns_its_triangles_back() {
    let mut file = File::of(&SQUARE, &HALVES);
    file.json["nodes"][0]["scale"] = json!([-1.0, 1.0, 1.0]);
    let read = of(&file.glb());
    assert!(facing(&read.assembled.mesh).z > 0.0, "the square still faces +z");
    assert_eq!(read.assembled.changes.turned, 0);
    // Two mirrors make no mirror.
    let mut file = File::of(&SQUARE, &HALVES);
    file.json["nodes"] = json!([{ "children": [1], "scale": [1, -1, 1] }, { "mesh": 0, "scale": [-1, 1, 1] }]);
    assert!(facing(&of(&file.glb()).assembled.mesh).z > 0.0);
    // Half of a part and its mirror image at the plane x = 0 meet in one sheet that faces one way.
    let mut file = File::of(&SQUARE, &HALVES);
    file.root(json!({ "mesh": 0, "scale": [-1.0, 1.0, 1.0] }));
    let read = of(&file.glb());
    assert_eq!((read.assembled.pieces.len(), read.assembled.changes.turned), (1, 0));
    assert_eq!(facing(&read.assembled.mesh), DVec3::new(0.0, 0.0, 2e6));
}

#[test]
fn interleaved_vertices_are_read_at_their_stride() {
    let mut file = File::new();
    // Position, normal, and a byte of colour padded to four: 28 bytes a vertex; the last one is not padded.
    let mut bytes = vec![9_u8; 8];
    for p in SQUARE {
        for x in p.into_iter().chain([0.0, 0.0, 1.0]) {
            bytes.extend_from_slice(&x.to_le_bytes());
        }
        bytes.extend_from_slice(&[255, 0, 0, 0]);
    }
    bytes.truncate(bytes.len() - 16);
    let view = file.view(&bytes);
    file.json["bufferViews"][view]["byteStride"] = json!(28);
    let positions = file.push(
        "accessors",
        json!({ "bufferView": view, "byteOffset": 8, "componentType": 5126, "type": "VEC3", "count": 4 }),
    );
    let indices = file.indices_u32(&HALVES);
    let mesh = file.mesh(&[primitive(positions, Some(indices), 4)]);
    file.root(json!({ "mesh": mesh }));
    assert_square(&of(&file.glb()));
}

#[test]
fn sparse_accessors_set_what_they_name() {
    let mut moved = SQUARE;
    moved[2] = [7.0, 7.0, 7.0];
    let mut file = File::of(&moved, &HALVES);
    let (places, values) = (file.view(&[2]), file.view(&[1.0_f32, 1.0, 0.0].map(f32::to_le_bytes).concat()));
    file.json["accessors"][0]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": places, "componentType": 5121 }, "values": { "bufferView": values },
    });
    assert_square(&of(&file.glb()));
    // Without a view the others are zero.
    file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let faults = read(&file.glb(), &ReadOptions::default()).unwrap_err();
    assert!(faults[0].detail.contains("area"), "{faults:?}");
}

#[test]
fn quantized_positions_are_numbers_or_fractions() {
    for (component, normalized, one, scale) in [
        (5121, true, vec![255], 1.0),
        (5120, true, vec![127], 1.0),
        (5123, true, vec![255, 255], 1.0),
        (5122, true, vec![255, 127], 1.0),
        (5121, false, vec![200], 200.0),
        (5122, false, vec![0, 1], 256.0),
    ] {
        let mut file = File::new();
        let zero = vec![0_u8; one.len()];
        let bytes: Vec<u8> = SQUARE
            .iter()
            .flat_map(|p| p.iter().flat_map(|&x| if x > 0.0 { one.clone() } else { zero.clone() }).collect::<Vec<_>>())
            .collect();
        let positions = file.accessor(&bytes, component, "VEC3", 4);
        file.json["accessors"][positions]["normalized"] = json!(normalized);
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let indices = file.indices_u8(&HALVES.map(|i| i as u8));
        let mesh = file.mesh(&[primitive(positions, Some(indices), 4)]);
        file.root(json!({ "mesh": mesh, "scale": [1.0 / scale, 1.0 / scale, 1.0] }));
        assert_square(&of(&file.glb()));
    }
}

#[test]
fn points_and_lines_are_passed_over_with_a_warning() {
    let mut file = File::of(&SQUARE, &HALVES);
    for mode in 0..4 {
        let lines = primitive(0, None, mode);
        file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(lines);
    }
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(json!({ "attributes": {} }));
    file.json["nodes"][0]["skin"] = json!(0);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }]);
    let read = of(&file.glb());
    assert_square(&read);
    let codes: Vec<&str> = read.warnings.iter().map(|w| w.code.as_str()).collect();
    assert_eq!(codes, ["not-triangles", "no-positions", "morph-targets", "skin"]);
    assert!(read.warnings[0].detail.starts_with("4 "));
}

#[test]
fn without_a_scene_all_nodes_are_taken_and_without_nodes_all_meshes() {
    let mut file = File::of(&SQUARE, &HALVES);
    file.json["scenes"] = json!([{ "nodes": [] }, { "nodes": [0] }]);
    file.json["scene"] = json!(1);
    assert_square(&of(&file.glb()));
    file.json.as_object_mut().unwrap().remove("scene");
    let read = of(&file.glb());
    assert_square(&read);
    assert!(read.inferred.iter().any(|i| i.contains("no scene")), "{:?}", read.inferred);
    for field in ["nodes", "scenes"] {
        file.json.as_object_mut().unwrap().remove(field);
    }
    assert_square(&of(&file.glb()));
}

#[test]
fn seams_of_normals_are_welded_unless_they_shall_stay_open() {
    // A tube of eight faces whose last column of vertices repeats the first.
    let point = |i: u32, z: f32| {
        let a = f64::from(i % 8) * std::f64::consts::FRAC_PI_4;
        [a.cos() as f32, a.sin() as f32, z]
    };
    let points: Vec<[f32; 3]> = (0..9).flat_map(|i| [point(i, 0.0), point(i, 2.0)]).collect();
    let triangles: Vec<u32> =
        (0..8).flat_map(|i| [2 * i, 2 * i + 2, 2 * i + 1, 2 * i + 1, 2 * i + 2, 2 * i + 3]).collect();
    let file = File::of(&points, &triangles).glb();
    let welded = of(&file);
    assert_eq!((welded.assembled.changes.welded, welded.assembled.mesh.positions.len()), (2, 16));
    assert_eq!(welded.assembled.topology.border_count(), 2);
    let apart = read(&file, &ReadOptions { weld: false, ..ReadOptions::default() }).unwrap();
    assert_eq!(apart.assembled.mesh.positions.len(), 18);
    assert_eq!(apart.assembled.topology.border_count(), 1);
}

#[test]
fn our_own_files_come_back_where_they_were() {
    let far = DVec3::new(1e6, -2e6, 3e5);
    let mesh = Mesh {
        positions: [[0.0, 0.0, 0.0], [100.0, 0.0, 3.0], [100.0, 60.0, 5.0], [0.0, 60.0, 1.0]]
            .map(|p: [f64; 3]| DVec3::from_array(p) + far)
            .to_vec(),
        uv: None,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let normals = vec![DVec3::Z; 4];
    let parts = MeshParts { normals: &normals, ..MeshParts::of(&mesh) };
    let read = of(&glb::write(&parts, Some("panel 7")).unwrap());
    assert_eq!(read.name.as_deref(), Some("panel 7"));
    assert_eq!(read.assembled.mesh.triangles, mesh.triangles);
    for (p, want) in read.assembled.mesh.positions.iter().zip(&mesh.positions) {
        // Single precision of the part's own size, not of its distance from the origin.
        assert!(p.distance(*want) < 1e-5, "{p} {want}");
    }
}
