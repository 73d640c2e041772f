//! glTF 2.0 as a surface: the triangles of its scene as one mesh in millimetres.
//!
//! `.glb` files, and `.gltf` files whose buffers are embedded as `data:` URIs. Every number that says where something lies
//! is checked against what is there before it is followed: files may lie, and nodes may go in circles. Other files are
//! never opened. Read are: nodes with their transforms (a mirroring one turns its triangles back), every primitive of
//! triangles, strips or fans with or without indices, sparse and quantized accessors. Lengths are metres by the standard
//! unless the caller says otherwise. Everything that does not shape the surface (materials, textures, normals, lights,
//! cameras, animations) is passed over; skins and morph targets are not applied, with a warning.
//!
//! All faults that can be found are found, each with its JSON Pointer. Work and memory are linear in the size of the file
//! and of the scene, within [`limits`].

mod accessors;
mod buffers;
mod container;
mod document;
pub mod limits;
mod primitives;
mod scene;

use glam::DVec3;

pub use limits::MeshLimits;

use super::faults::{Fault, FaultList};
use super::sniff::BYTE_ORDER_MARK;
use super::summary::SurfaceWarning;
use super::surface_json::limits::{MAX_COORDINATE_MM, MAX_TEXT, MIN_EXTENT_MM, MIN_EXTENT_RELATIVE};
use super::units::Units;
use crate::engine::mesh::assembly::{Assembled, assemble};
use document::Document;

/// How a file is to be read.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Unit of length; metres when it is not said.
    pub units: Option<Units>,
    /// Whether vertices at the same place become one.
    pub weld: bool,
    /// What the file may hold at most.
    pub limits: MeshLimits,
    /// Stands before every pointer.
    pub pointer_prefix: String,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { units: None, weld: true, limits: MeshLimits::default(), pointer_prefix: String::new() }
    }
}

/// A mesh as read.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadMesh {
    /// Its name: that of the first node with a mesh, or of its mesh.
    pub name: Option<String>,
    /// The unit that the file's lengths were taken in.
    pub units: Units,
    /// The mesh, in millimetres, and what is known of it.
    pub assembled: Assembled,
    /// Primitives with triangles, each instance counted.
    pub primitives: u64,
    /// What was passed over although it may matter.
    pub warnings: Vec<SurfaceWarning>,
    /// What the file did not say outright, in words.
    pub inferred: Vec<String>,
}

/// Faults with the prefix of their pointers.
struct Faults {
    list: FaultList,
    prefix: String,
}

impl Faults {
    /// Notes a fault. One without words was noted before.
    fn add(&mut self, pointer: &str, detail: impl Into<String>) {
        let detail = detail.into();
        if !detail.is_empty() {
            self.list.add(format!("{}{pointer}", self.prefix), detail);
        }
    }
}

/// Counts of what was passed over.
#[derive(Default)]
struct Ignored {
    not_triangles: u64,
    without_positions: u64,
    morphed: u64,
}

/// Extensions that a file may require and that do not shape the surface, by the beginnings of their names.
const HARMLESS: [&str; 8] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_",
];

/// Reads a mesh.
///
/// # Errors
/// All faults that were found (at most [`super::faults::MAX_FAULTS`] are listed).
pub fn read(bytes: &[u8], options: &ReadOptions) -> Result<ReadMesh, Vec<Fault>> {
    let mut faults = Faults { list: FaultList::default(), prefix: options.pointer_prefix.clone() };
    match parts(bytes, options, &mut faults) {
        Some(read) if faults.list.is_empty() => Ok(read),
        _ => Err(faults.list.into_faults()),
    }
}

fn parts(bytes: &[u8], options: &ReadOptions, faults: &mut Faults) -> Option<ReadMesh> {
    let container = container::open(bytes).map_err(|detail| faults.add("", detail)).ok()?;
    let text = container.json.strip_prefix(BYTE_ORDER_MARK).unwrap_or(container.json);
    let document: Document = serde_json::from_slice(text)
        .map_err(|error| faults.add("", format!("the JSON of the glTF cannot be read: {error}")))
        .ok()?;
    of_asset(&document, faults);
    let mut inferred = Vec::new();
    let units = options.units.unwrap_or(Units::M);
    if options.units.is_none() {
        inferred.push("lengths are taken in metres, as glTF has them".to_owned());
    }
    let mut ignored = Ignored::default();
    let buffers = buffers::Buffers::read(&document, &container, &options.limits, faults);
    let instances = scene::instances(&document, faults, &mut inferred);
    let soup =
        primitives::read(&document, &buffers, &instances, units.millimetres(), &options.limits, faults, &mut ignored);
    if !faults.list.is_empty() {
        return None;
    }
    if soup.triangles.is_empty() {
        faults.add("", "the scene of this file has no triangles");
        return None;
    }
    in_range(&soup.positions, faults)?;
    let assembled = assemble(&soup.positions, &soup.triangles, options.weld)
        .map_err(|fault| faults.add("", fault.to_string()))
        .ok()?;
    if assembled.mesh.triangles.is_empty() {
        faults.add("", format!("none of the {} triangles of this file has an area", soup.triangles.len()));
        return None;
    }
    let skinned = instances.iter().filter_map(|i| i.node).filter(|n| document.nodes[*n].skin.is_some()).count() as u64;
    Some(ReadMesh {
        name: name(&document, &instances),
        units,
        assembled,
        primitives: soup.primitives,
        warnings: warnings(&ignored, skinned),
        inferred,
    })
}

/// The version, and extensions that the file cannot be read without.
fn of_asset(document: &Document, faults: &mut Faults) {
    match &document.asset {
        None => faults.add("", "a glTF file has a field `asset` with its version; this has none"),
        Some(asset) => {
            let version = asset.version.as_deref().unwrap_or_default();
            if version != "2" && !version.starts_with("2.") {
                let shown: String = version.chars().take(20).collect();
                faults.add("/asset/version", format!("glTF 2.0 is read; this says {shown:?}. Export it as glTF 2.0."));
            }
        }
    }
    for (k, name) in document.extensions_required.iter().enumerate() {
        if HARMLESS.iter().any(|harmless| name.starts_with(harmless)) {
            continue;
        }
        let remedy = if name.contains("draco") {
            "Export the mesh without Draco compression."
        } else if name.contains("meshopt") {
            "Export the mesh without meshopt compression."
        } else {
            "Export the mesh without it."
        };
        let shown: String = name.chars().take(60).filter(|c| !c.is_control()).collect();
        let detail =
            format!("the file cannot be read without the extension {shown}, which is not known here. {remedy}");
        faults.add(&format!("/extensionsRequired/{k}"), detail);
    }
}

/// Whether the coordinates can be worked on.
fn in_range(positions: &[DVec3], faults: &mut Faults) -> Option<()> {
    let low = positions.iter().copied().reduce(DVec3::min)?;
    let high = positions.iter().copied().reduce(DVec3::max)?;
    let greatest = low.abs().max(high.abs()).max_element();
    if !positions.iter().all(|p| p.is_finite()) || greatest > MAX_COORDINATE_MM {
        faults.add("", format!("a coordinate lies beyond {MAX_COORDINATE_MM} mm: check the units"));
        return None;
    }
    let extent = (high - low).max_element();
    if extent < MIN_EXTENT_MM || extent < MIN_EXTENT_RELATIVE * greatest {
        faults.add(
            "",
            format!("the mesh is only {extent} mm large, {greatest} mm from the origin: that is next to nothing"),
        );
        return None;
    }
    Some(())
}

fn name(document: &Document, instances: &[scene::Instance]) -> Option<String> {
    let first = instances.first()?;
    let of_node = first.node.and_then(|node| document.nodes[node].name.as_deref());
    let name = of_node.or(document.meshes[first.mesh].name.as_deref())?;
    let name: String = name.chars().filter(|c| !c.is_control()).take(MAX_TEXT).collect();
    (!name.trim().is_empty()).then_some(name)
}

fn warnings(ignored: &Ignored, skinned: u64) -> Vec<SurfaceWarning> {
    let mut warnings = Vec::new();
    let mut warn = |count: u64, code: &str, detail: &str| {
        if count > 0 {
            let detail = format!("{count} {detail}");
            warnings.push(SurfaceWarning { code: code.to_owned(), detail, place: None });
        }
    };
    warn(ignored.not_triangles, "not-triangles", "primitives of points or lines were passed over");
    warn(ignored.without_positions, "no-positions", "primitives without positions were passed over");
    warn(ignored.morphed, "morph-targets", "primitives have morph targets, which were not applied");
    warn(skinned, "skin", "nodes have a skin: their meshes were taken as they are, without it");
    warnings
}

#[cfg(test)]
mod tests;
