//! The JSON of a glTF file, as far as a mesh needs it. Numbers are read as they come; whether they have a meaning is
//! looked at where they are used. Lists are bounded while they are read.

#![expect(clippy::zero_sized_map_values, reason = "serde fills maps; a set of names would need a visitor of its own")]

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use serde::de::{IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::limits::MAX_OBJECTS;

/// Names of extensions. What they hold is not looked at.
pub(super) type Extensions = BTreeMap<String, IgnoredAny>;

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    pub(super) asset: Option<Asset>,
    pub(super) scene: Option<f64>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) scenes: Vec<Scene>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) nodes: Vec<Node>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) buffer_views: Vec<View>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) buffers: Vec<Buffer>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) extensions_required: Vec<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Asset {
    pub(super) version: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default, deserialize_with = "bounded")]
    pub(super) nodes: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    pub(super) name: Option<String>,
    pub(super) mesh: Option<f64>,
    pub(super) skin: Option<IgnoredAny>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) children: Vec<f64>,
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    pub(super) name: Option<String>,
    #[serde(default, deserialize_with = "bounded")]
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub(super) attributes: Attributes,
    pub(super) indices: Option<f64>,
    pub(super) mode: Option<f64>,
    pub(super) targets: Option<IgnoredAny>,
    #[serde(default)]
    pub(super) extensions: Extensions,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub(super) position: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<f64>,
    pub(super) byte_offset: Option<f64>,
    pub(super) component_type: Option<f64>,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: Option<f64>,
    #[serde(rename = "type")]
    pub(super) kind: Option<String>,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub(super) count: Option<f64>,
    pub(super) indices: SparsePart,
    pub(super) values: SparsePart,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparsePart {
    pub(super) buffer_view: Option<f64>,
    pub(super) byte_offset: Option<f64>,
    pub(super) component_type: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub(super) buffer: Option<f64>,
    pub(super) byte_offset: Option<f64>,
    pub(super) byte_length: Option<f64>,
    pub(super) byte_stride: Option<f64>,
    #[serde(default)]
    pub(super) extensions: Extensions,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) byte_length: Option<f64>,
    pub(super) uri: Option<String>,
}

/// A whole number that is at least 0 and exact in a double; absent: `None`.
pub(super) fn whole(number: f64) -> Option<u64> {
    ((0.0..=9e15).contains(&number) && number.fract() == 0.0).then_some(number as u64)
}

/// A list of at most [`MAX_OBJECTS`].
fn bounded<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    struct Bounded<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for Bounded<T> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "a list of at most {MAX_OBJECTS}")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
            let mut list = Vec::new();
            while let Some(item) = seq.next_element()? {
                if list.len() == MAX_OBJECTS {
                    return Err(serde::de::Error::invalid_length(MAX_OBJECTS + 1, &self));
                }
                list.push(item);
            }
            Ok(list)
        }
    }
    deserializer.deserialize_seq(Bounded(PhantomData))
}
