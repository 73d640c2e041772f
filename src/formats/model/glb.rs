//! A mesh as binary glTF 2.0, to look at and to load into CAD and CG programs.
//!
//! - Metres, as glTF demands. Positions are stored about the centre of the part's bounding box, so that single precision
//!   is enough far from the origin; the centre is the node's translation. Axes are those of the model.
//! - `TEXCOORD_0` is the flattening: `x_mm = u * mm_per_uv`, `y_mm = (1 - v) * mm_per_uv`, one scale for both directions,
//!   all within [0, 1]. glTF's v points down; so a program that shows the unwrapped mesh, or lays the pattern's picture
//!   on it, shows the pattern as it is cut, not its mirror image.
//! - `COLOR_0` is the strain ([`super::strain_colours`]); its scale stands in the mesh's `extras`. `_STRAIN_MIN` and
//!   `_STRAIN_MAX` are the principal strains at vertices in percent ([`super::vertex_strains`]).
//! - Where the mesh is that of the whole base surface, the part and the waste are two primitives over the same vertices,
//!   with materials of their own; `extras.part` of a primitive says which it is.
//! - glTF has no word for "no value". Vertices that a partial flattening did not get to have texture coordinates (0, 1) and
//!   strain 0, are grey, and have 0 in the attribute `_PLACED` (1: placed), which is there only then; `extras` counts them.
//!
//! The file is written into one buffer of its final size.

use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use super::MeshParts;
use super::strain_colours::StrainColours;
use crate::formats::numbers::WriteError;

const METRES_PER_MM: f64 = 1e-3;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
/// Bytes before the JSON chunk's text: the file's header and the chunk's.
const HEADER: usize = 12 + 8;

/// The file. `name` names the node and the mesh.
///
/// # Errors
/// [`WriteError::Empty`] without triangles, [`WriteError::NotFinite`] for a position that is not finite, and
/// [`WriteError::TooLarge`] beyond the format's 4 GiB.
pub fn write(parts: &MeshParts<'_>, name: Option<&str>) -> Result<Vec<u8>, WriteError> {
    parts.check()?;
    let mesh = parts.mesh;
    let (low, high) =
        mesh.positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
    let frame = Frame { centre: low.midpoint(high), atlas: parts.flat.and_then(Atlas::of) };
    let strain = parts.strain_percent.map(|strains| StrainColours::of(parts, strains));
    let normals = parts.normals();
    let groups = Group::of(parts);

    let layout = Layout::new(parts, &groups, &frame, strain.as_ref(), name)?;
    let mut out = Vec::with_capacity(layout.total);
    let word = |out: &mut Vec<u8>, x: u32| out.extend_from_slice(&x.to_le_bytes());
    out.extend_from_slice(b"glTF");
    word(&mut out, 2);
    word(&mut out, layout.total as u32);
    word(&mut out, layout.json.len() as u32);
    out.extend_from_slice(b"JSON");
    out.extend_from_slice(&layout.json);
    word(&mut out, layout.binary as u32);
    out.extend_from_slice(b"BIN\0");
    for group in &groups {
        for (_, triangle) in mesh.triangles.iter().enumerate().filter(|(t, _)| parts.is_of_part(*t) == group.of_part) {
            for index in triangle {
                word(&mut out, *index);
            }
        }
    }
    for p in &mesh.positions {
        floats(&mut out, frame.position(*p));
    }
    for n in normals.unwrap_or_default() {
        floats(&mut out, unit(*n));
    }
    if let (Some(atlas), Some(flat)) = (&frame.atlas, parts.flat) {
        for p in flat {
            floats(&mut out, atlas.coordinate(*p));
        }
        if atlas.unreached > 0 {
            for p in flat {
                floats(&mut out, [f32::from(u8::from(p.is_finite()))]);
            }
        }
    }
    if let Some(strain) = &strain {
        strain.colours().for_each(|colour| out.extend_from_slice(&colour));
        let values = || strain.vertices.iter().map(|s| s.map_or([0.0; 2], |s| [s.min, s.max]));
        values().for_each(|[min, _]| floats(&mut out, [single(min)]));
        values().for_each(|[_, max]| floats(&mut out, [single(max)]));
    }
    debug_assert_eq!(out.len(), layout.total, "the layout counts every byte");
    Ok(out)
}

fn floats<const N: usize>(out: &mut Vec<u8>, values: [f32; N]) {
    for x in values {
        // Adding positive zero drops the sign of zero.
        out.extend_from_slice(&(x + 0.0).to_le_bytes());
    }
}

/// In single precision, never infinite.
fn single(x: f64) -> f32 {
    (x as f32).clamp(f32::MIN, f32::MAX)
}

/// A unit vector in single precision; z for a normal that has no direction.
fn unit(n: DVec3) -> [f32; 3] {
    n.try_normalize().unwrap_or(DVec3::Z).as_vec3().to_array()
}

struct Frame {
    centre: DVec3,
    atlas: Option<Atlas>,
}

impl Frame {
    fn position(&self, p: DVec3) -> [f32; 3] {
        ((p - self.centre) * METRES_PER_MM).as_vec3().to_array()
    }
}

/// From the flattening to texture coordinates.
struct Atlas {
    origin: DVec2,
    mm_per_uv: f64,
    unreached: usize,
}

impl Atlas {
    /// `None` when no vertex has a place.
    fn of(flat: &[DVec2]) -> Option<Self> {
        let placed = || flat.iter().filter(|p| p.is_finite());
        let low = placed().copied().reduce(DVec2::min)?;
        let high = placed().copied().reduce(DVec2::max)?;
        // A placed pattern begins near the origin: keep that origin when everything lies right of and above it.
        let origin = low.min(DVec2::ZERO);
        let size = (high - origin).max_element();
        let mm_per_uv = if size > 0.0 { size } else { 1.0 };
        Some(Self { origin, mm_per_uv, unreached: flat.len() - placed().count() })
    }

    fn coordinate(&self, p: DVec2) -> [f32; 2] {
        if !p.is_finite() {
            return [0.0, 1.0];
        }
        let q = (p - self.origin) / self.mm_per_uv;
        [q.x as f32, (1.0 - q.y) as f32]
    }
}

/// Triangles that are drawn together.
struct Group {
    of_part: bool,
    triangles: usize,
}

impl Group {
    /// The part, and the waste where there is any; none is empty.
    fn of(parts: &MeshParts<'_>) -> Vec<Self> {
        let all = parts.mesh.triangles.len();
        let inside = (0..all).filter(|t| parts.is_of_part(*t)).count();
        let groups = [Self { of_part: true, triangles: inside }, Self { of_part: false, triangles: all - inside }];
        groups.into_iter().filter(|group| group.triangles > 0).collect()
    }

    /// The material, the one that the primitive of this group names by its place in the file.
    fn material(&self) -> Value {
        let (name, colour) = if self.of_part { ("part", [1.0; 4]) } else { ("waste", [0.35, 0.35, 0.35, 1.0]) };
        json!({
            "name": name, "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.8 }
        })
    }
}

struct Layout {
    /// The JSON chunk, padded.
    json: Vec<u8>,
    /// Bytes of the binary chunk.
    binary: usize,
    /// Bytes of the file.
    total: usize,
}

impl Layout {
    fn new(
        parts: &MeshParts<'_>,
        groups: &[Group],
        frame: &Frame,
        strain: Option<&StrainColours>,
        name: Option<&str>,
    ) -> Result<Self, WriteError> {
        let vertices = parts.mesh.positions.len();
        let mut table = Table::default();
        let indices: Vec<Value> = groups
            .iter()
            .map(|group| {
                let index = json!({ "componentType": UNSIGNED_INT, "type": "SCALAR" });
                table.add(group.triangles * 3, 4, ELEMENT_ARRAY_BUFFER, index)
            })
            .collect();
        let scalar = || json!({ "componentType": FLOAT, "type": "SCALAR" });
        let mut attributes = serde_json::Map::new();
        let (low, high) =
            parts.mesh.positions.iter().map(|p| frame.position(*p)).fold(
                ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]),
                |(low, high), p| {
                    (std::array::from_fn(|k| low[k].min(p[k])), std::array::from_fn(|k| high[k].max(p[k])))
                },
            );
        let bounds = |b: [f32; 3]| b.map(|x| f64::from(x) + 0.0);
        let position = json!({ "componentType": FLOAT, "type": "VEC3", "min": bounds(low), "max": bounds(high) });
        attributes.insert("POSITION".into(), table.add(vertices, 12, ARRAY_BUFFER, position));
        if parts.normals().is_some() {
            let normal = json!({ "componentType": FLOAT, "type": "VEC3" });
            attributes.insert("NORMAL".into(), table.add(vertices, 12, ARRAY_BUFFER, normal));
        }
        let mut extras = json!({ "units": "m", "lengths_in_extras": "mm" });
        if let Some(atlas) = &frame.atlas {
            let coordinate = json!({ "componentType": FLOAT, "type": "VEC2" });
            attributes.insert("TEXCOORD_0".into(), table.add(vertices, 8, ARRAY_BUFFER, coordinate));
            extras["mm_per_uv"] = json!(atlas.mm_per_uv);
            extras["uv_origin_mm"] = json!(atlas.origin.to_array().map(|x| x + 0.0));
            extras["uv"] =
                json!("x_mm = uv_origin_mm[0] + u * mm_per_uv, y_mm = uv_origin_mm[1] + (1 - v) * mm_per_uv");
            if atlas.unreached > 0 {
                extras["vertices_without_uv"] = json!(atlas.unreached);
                attributes.insert("_PLACED".into(), table.add(vertices, 4, ARRAY_BUFFER, scalar()));
            }
        }
        if let Some(strain) = strain {
            let colour = json!({ "componentType": UNSIGNED_BYTE, "normalized": true, "type": "VEC4" });
            attributes.insert("COLOR_0".into(), table.add(vertices, 4, ARRAY_BUFFER, colour));
            let scale = strain.scale_percent;
            extras["strain_percent"] = json!({
                "blue": -scale, "white": 0.0, "red": scale,
                "meaning": "positive: the material is stretched when it is laid on the part",
                "attributes": "_STRAIN_MIN and _STRAIN_MAX: least and greatest principal strain at vertices, percent"
            });
            for name in ["_STRAIN_MIN", "_STRAIN_MAX"] {
                attributes.insert(name.into(), table.add(vertices, 4, ARRAY_BUFFER, scalar()));
            }
            let unknown = strain.vertices.iter().filter(|s| s.is_none()).count();
            if unknown > 0 {
                extras["vertices_without_strain"] = json!(unknown);
            }
        }
        let name = name.unwrap_or("part");
        let primitives: Vec<Value> = groups
            .iter()
            .zip(&indices)
            .enumerate()
            .map(|(material, (group, indices))| {
                json!({
                    "attributes": &attributes, "indices": indices, "material": material,
                    "extras": { "part": group.of_part }
                })
            })
            .collect();
        let materials: Vec<Value> = groups.iter().map(Group::material).collect();
        let document = json!({
            "asset": { "version": "2.0", "generator": concat!("planish ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "name": name, "mesh": 0, "translation": (frame.centre * METRES_PER_MM).to_array().map(|x| x + 0.0) }],
            "meshes": [{
                "name": name,
                "primitives": primitives,
                "extras": extras,
            }],
            "materials": materials,
            "accessors": table.accessors,
            "bufferViews": table.views,
            "buffers": [{ "byteLength": table.bytes }],
        });
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = HEADER + json.len() + 8 + table.bytes;
        if u32::try_from(total).is_err() {
            return Err(WriteError::TooLarge { detail: format!("{total} bytes, binary glTF holds 4 GiB") });
        }
        Ok(Self { json, binary: table.bytes, total })
    }
}

/// Buffer views and accessors, one after the other. All strides are multiples of 4, so that nothing needs padding.
#[derive(Default)]
struct Table {
    accessors: Vec<Value>,
    views: Vec<Value>,
    bytes: usize,
}

impl Table {
    /// Adds `count` elements of `stride` bytes; gives the accessor's index.
    fn add(&mut self, count: usize, stride: usize, target: u32, mut accessor: Value) -> Value {
        let bytes = count * stride;
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes, "byteLength": bytes, "target": target }));
        self.bytes += bytes;
        accessor["bufferView"] = json!(self.views.len() - 1);
        accessor["count"] = json!(count);
        self.accessors.push(accessor);
        json!(self.accessors.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::mesh::Mesh;

    /// A strip of two triangles far from the origin.
    fn strip() -> (Mesh, Vec<DVec3>, Vec<DVec2>) {
        let flat: Vec<DVec2> = [[0.0, 0.0], [40.0, 0.0], [40.0, 100.0], [0.0, 100.0]].map(DVec2::from_array).to_vec();
        let positions = flat.iter().map(|p| DVec3::new(p.x + 1e6, p.y, 5.0)).collect();
        (Mesh { positions, uv: None, triangles: vec![[0, 1, 2], [0, 2, 3]] }, vec![DVec3::Z; 4], flat)
    }

    #[test]
    fn the_gltf_reader_gives_back_mesh_flattening_and_scale() {
        let (mesh, normals, flat) = strip();
        let strain = [[-1.0, 0.5], [0.0, 2.0]];
        let parts =
            MeshParts { normals: &normals, flat: Some(&flat), strain_percent: Some(&strain), ..MeshParts::of(&mesh) };
        let bytes = write(&parts, Some("a \"strip\"")).unwrap();
        assert_eq!(bytes.len() % 4, 0);
        let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = gltf.blob.as_deref().unwrap();
        let node = gltf.nodes().next().unwrap();
        let (translation, ..) = node.transform().decomposed();
        let primitive = gltf.meshes().next().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(blob));
        for (read, want) in reader.read_positions().unwrap().zip(&mesh.positions) {
            let at = DVec3::from_array(std::array::from_fn(|k| f64::from(read[k]) + f64::from(translation[k])));
            assert!((at * 1000.0 - *want).length() < 1e-1, "{at} {want}");
        }
        let json_end = HEADER + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let document: Value = serde_json::from_slice(&bytes[HEADER..json_end]).unwrap();
        let extras = &document["meshes"][0]["extras"];
        assert_eq!((&extras["mm_per_uv"], &extras["units"]), (&json!(100.0), &json!("m")));
        assert_eq!(extras["strain_percent"]["red"], json!(2.0));
        for (read, want) in reader.read_tex_coords(0).unwrap().into_f32().zip(&flat) {
            assert!((DVec2::new(f64::from(read[0]), 1.0 - f64::from(read[1])) * 100.0 - *want).length() < 1e-4);
        }
        assert_eq!(reader.read_indices().unwrap().into_u32().collect::<Vec<_>>(), [0, 1, 2, 0, 2, 3]);
        assert_eq!(reader.read_colors(0).unwrap().into_rgba_u8().count(), 4);
        assert_eq!(scalars(&bytes, "_STRAIN_MIN"), [-0.5, -1.0, -0.5, 0.0]);
        assert_eq!(scalars(&bytes, "_STRAIN_MAX"), [1.25, 0.5, 1.25, 2.0]);
        assert_eq!(document["meshes"][0]["primitives"].as_array().unwrap().len(), 1);
        assert!(document["meshes"][0]["primitives"][0]["attributes"].get("_PLACED").is_none());
    }

    /// The values of an attribute of the first primitive, straight from the file.
    fn scalars(bytes: &[u8], name: &str) -> Vec<f32> {
        let gltf = gltf::Gltf::from_slice_without_validation(bytes).unwrap();
        let json_end = HEADER + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let document: Value = serde_json::from_slice(&bytes[HEADER..json_end]).unwrap();
        let index = document["meshes"][0]["primitives"][0]["attributes"][name].as_u64().unwrap() as usize;
        let accessor = &document["accessors"][index];
        let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let start = view["byteOffset"].as_u64().unwrap() as usize;
        let count = accessor["count"].as_u64().unwrap() as usize;
        let blob = &gltf.blob.unwrap()[start..start + 4 * count];
        blob.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
    }

    #[test]
    fn part_and_waste_are_two_primitives_over_the_same_vertices() {
        let (mesh, normals, flat) = strip();
        let part = [false, true];
        let parts = MeshParts { normals: &normals, flat: Some(&flat), part: Some(&part), ..MeshParts::of(&mesh) };
        let bytes = write(&parts, None).unwrap();
        let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = gltf.blob.as_deref().unwrap();
        let primitives: Vec<_> = gltf.meshes().next().unwrap().primitives().collect();
        let indices = |k: usize| -> Vec<u32> {
            primitives[k].reader(|_| Some(blob)).read_indices().unwrap().into_u32().collect()
        };
        assert_eq!((indices(0), indices(1)), (vec![0, 2, 3], vec![0, 1, 2]));
        let names: Vec<_> = primitives.iter().map(|p| p.material().name().unwrap().to_owned()).collect();
        assert_eq!(names, ["part", "waste"]);
    }

    #[test]
    fn what_a_partial_flattening_did_not_reach_is_marked_and_never_nan() {
        let (mesh, normals, mut flat) = strip();
        flat[3] = DVec2::NAN;
        let strain = [[-1.0, 0.5], [f64::NAN; 2]];
        let parts =
            MeshParts { normals: &normals, flat: Some(&flat), strain_percent: Some(&strain), ..MeshParts::of(&mesh) };
        let bytes = write(&parts, None).unwrap();
        assert_eq!(scalars(&bytes, "_PLACED"), [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(scalars(&bytes, "_STRAIN_MIN"), [-1.0, -1.0, -1.0, 0.0]);
        let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = gltf.blob.as_deref().unwrap();
        let primitive = gltf.meshes().next().unwrap().primitives().next().unwrap();
        for uv in primitive.reader(|_| Some(blob)).read_tex_coords(0).unwrap().into_f32() {
            assert!(uv.iter().all(|x| (0.0..=1.0).contains(x)), "{uv:?}");
        }
    }
}
