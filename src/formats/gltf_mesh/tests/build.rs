//! glTF files built piece by piece, sound ones and lying ones.

use serde_json::{Value, json};

/// A file in the making.
#[derive(Debug, Clone)]
pub(super) struct File {
    pub(super) json: Value,
    pub(super) binary: Vec<u8>,
}

impl File {
    pub(super) fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [] }], "nodes": [], "meshes": [],
            "accessors": [], "bufferViews": [], "buffers": [],
        });
        Self { json, binary: Vec::new() }
    }

    pub(super) fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// A view of these bytes.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        let from = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": from, "byteLength": bytes.len() }))
    }

    pub(super) fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }))
    }

    pub(super) fn positions(&mut self, points: &[[f32; 3]]) -> usize {
        let bytes: Vec<u8> = points.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, "VEC3", points.len())
    }

    pub(super) fn indices_u8(&mut self, indices: &[u8]) -> usize {
        self.accessor(indices, 5121, "SCALAR", indices.len())
    }

    pub(super) fn indices_u16(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, 5123, "SCALAR", indices.len())
    }

    pub(super) fn indices_u32(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, 5125, "SCALAR", indices.len())
    }

    /// A mesh of these primitives.
    pub(super) fn mesh(&mut self, primitives: &[Value]) -> usize {
        self.push("meshes", json!({ "primitives": primitives }))
    }

    /// A node in the scene.
    pub(super) fn root(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(index));
        index
    }

    /// A file of one node with one mesh of one primitive.
    pub(super) fn of(points: &[[f32; 3]], triangles: &[u32]) -> Self {
        let mut file = Self::new();
        let (positions, indices) = (file.positions(points), file.indices_u32(triangles));
        let mesh = file.mesh(&[json!({ "attributes": { "POSITION": positions }, "indices": indices })]);
        file.root(json!({ "mesh": mesh }));
        file
    }

    fn with_buffer(&self, buffer: &Value) -> Value {
        let mut json = self.json.clone();
        if json["buffers"] == json!([]) && !self.binary.is_empty() {
            json["buffers"] = json!([buffer]);
        }
        json
    }

    /// As `.glb`.
    pub(super) fn glb(&self) -> Vec<u8> {
        let json = self.with_buffer(&json!({ "byteLength": self.binary.len() }));
        container(json.to_string().as_bytes(), Some(&self.binary))
    }

    /// As `.gltf` with its buffer embedded.
    pub(super) fn gltf(&self) -> Vec<u8> {
        let uri = format!("data:application/octet-stream;base64,{}", base64(&self.binary));
        self.with_buffer(&json!({ "byteLength": self.binary.len(), "uri": uri })).to_string().into_bytes()
    }
}

/// A binary file of these chunks.
pub(super) fn container(json: &[u8], binary: Option<&[u8]>) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    let mut chunk = |kind: &[u8; 4], bytes: &[u8]| {
        out.extend_from_slice(&(bytes.len() as u32).to_le_bytes());
        out.extend_from_slice(kind);
        out.extend_from_slice(bytes);
    };
    chunk(b"JSON", &json);
    if let Some(binary) = binary {
        chunk(b"BIN\0", binary);
    }
    let length = out.len() as u32;
    out[8..12].copy_from_slice(&length.to_le_bytes());
    out
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |chunk: &[u8]| -> String {
        let bits = chunk.iter().fold(0_u32, |bits, b| bits << 8 | u32::from(*b)) << (8 * (3 - chunk.len()));
        (0..4)
            .map(|k| if k <= chunk.len() { DIGITS[(bits >> (18 - 6 * k)) as usize & 63] as char } else { '=' })
            .collect()
    };
    bytes.chunks(3).map(group).collect()
}
