//! A surface of any kind as it was sent: its bytes tell what it is, and the reading how it is to be understood.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::faults::Fault;
use super::sniff::{Sniffed, sniff};
use super::surface_json::{ReadContent, is_gltf};
use super::units::Units;
use super::{gltf_mesh, mesh_summary, part_summary, summary, surface_json};
use crate::engine::pipeline::{Input, SurfaceMesh};
use crate::engine::sewing::Part;
use crate::engine::trimming::{Side, TrimmedSurface};

/// Whether the vertices of a mesh that lie at the same place are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weld {
    /// They are.
    #[default]
    Position,
    /// They stay apart: a seam stays open.
    None,
}

/// What decides, besides the bytes, what a surface is. It is stored with the surface and is a part of its id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Reading {
    /// Unit of length, before what the file says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<Units>,
    /// The show side, before what the file says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
    /// For meshes, whether vertices are welded. Absent: they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weld: Option<Weld>,
}

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Media {
    /// A trimmed surface, or a part of several.
    SurfaceJson,
    /// glTF binary.
    GltfBinary,
    /// glTF as JSON.
    GltfJson,
}

impl Media {
    /// What the bytes are. What is neither binary nor JSON with the fields of glTF is taken for a trimmed surface, whose
    /// reader says what is wrong.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        match sniff(bytes) {
            Some(Sniffed::GltfBinary) => Self::GltfBinary,
            _ if is_gltf(bytes) => Self::GltfJson,
            _ => Self::SurfaceJson,
        }
    }

    /// Its media type.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::SurfaceJson => "application/json",
            Self::GltfBinary => "model/gltf-binary",
            Self::GltfJson => "model/gltf+json",
        }
    }

    /// The suffix of a file of a media type, as [`Media::name`] gives it.
    #[must_use]
    pub fn suffix(name: &str) -> &'static str {
        match name {
            "model/gltf-binary" => "glb",
            "model/gltf+json" => "gltf",
            _ => "json",
        }
    }
}

/// The geometry of a surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// A trimmed surface.
    Trimmed(Box<TrimmedSurface>),
    /// A mesh.
    Mesh(SurfaceMesh),
    /// A part of several faces.
    Part(Part),
}

impl Geometry {
    /// As the pipeline takes it.
    #[must_use]
    pub fn input(&self) -> Input<'_> {
        match self {
            Self::Trimmed(surface) => Input::Trimmed(surface),
            Self::Mesh(mesh) => Input::Mesh(mesh),
            Self::Part(part) => Input::Part(part),
        }
    }
}

/// A surface with everything that is said of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadSurface {
    /// What the file is.
    pub media: Media,
    /// Its name in the file.
    pub name: Option<String>,
    /// The unit that the file's lengths were taken in.
    pub units: Units,
    /// The labels in the file.
    pub labels: BTreeMap<String, String>,
    /// The geometry.
    pub geometry: Geometry,
    /// The summary, a JSON object.
    pub summary: Value,
}

/// Reads a surface of any kind and sums it up. `prefix` stands before every pointer.
///
/// # Errors
/// Every fault that was found.
pub fn read(bytes: &[u8], reading: Reading, prefix: &str) -> Result<ReadSurface, Vec<Fault>> {
    let media = Media::of(bytes);
    if media == Media::SurfaceJson {
        return Ok(match surface_json::read_content(bytes, &surface_options(reading, prefix))? {
            ReadContent::Surface(surface) => ReadSurface {
                media,
                summary: serde_json::to_value(summary::summarise(&surface)).unwrap_or(Value::Null),
                name: surface.name,
                units: surface.units,
                labels: surface.labels,
                geometry: Geometry::Trimmed(Box::new(surface.trimmed)),
            },
            ReadContent::Part(part) => ReadSurface {
                media,
                summary: serde_json::to_value(part_summary::summarise(&part)).unwrap_or(Value::Null),
                name: part.name,
                units: part.units,
                labels: part.labels,
                geometry: Geometry::Part(part.part),
            },
        });
    }
    let mesh = gltf_mesh::read(bytes, &mesh_options(reading, prefix))?;
    let side = reading.side.unwrap_or_default();
    let summary = serde_json::to_value(mesh_summary::summarise(&mesh, side)).unwrap_or(Value::Null);
    Ok(ReadSurface {
        media,
        name: mesh.name,
        units: mesh.units,
        labels: BTreeMap::new(),
        geometry: Geometry::Mesh(SurfaceMesh { mesh: mesh.assembled.mesh, side }),
        summary,
    })
}

/// Reads the geometry alone.
///
/// # Errors
/// Every fault that was found.
pub fn geometry(bytes: &[u8], reading: Reading) -> Result<Geometry, Vec<Fault>> {
    if Media::of(bytes) == Media::SurfaceJson {
        return Ok(match surface_json::read_content(bytes, &surface_options(reading, ""))? {
            ReadContent::Surface(surface) => Geometry::Trimmed(Box::new(surface.trimmed)),
            ReadContent::Part(part) => Geometry::Part(part.part),
        });
    }
    let mesh = gltf_mesh::read(bytes, &mesh_options(reading, ""))?;
    Ok(Geometry::Mesh(SurfaceMesh { mesh: mesh.assembled.mesh, side: reading.side.unwrap_or_default() }))
}

fn surface_options(reading: Reading, prefix: &str) -> surface_json::ReadOptions {
    surface_json::ReadOptions {
        units: reading.units,
        side: reading.side,
        pointer_prefix: prefix.to_owned(),
        ..surface_json::ReadOptions::default()
    }
}

fn mesh_options(reading: Reading, prefix: &str) -> gltf_mesh::ReadOptions {
    gltf_mesh::ReadOptions {
        units: reading.units,
        weld: reading.weld.unwrap_or_default() == Weld::Position,
        pointer_prefix: prefix.to_owned(),
        ..gltf_mesh::ReadOptions::default()
    }
}
