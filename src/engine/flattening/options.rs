//! How a mesh is to be flattened: the very names that a job uses.

use serde::{Deserialize, Serialize};

/// The method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FlatteningMethod {
    /// Cader et al. 2005: triangle by triangle in mapping order, averaging (thesis 4.2).
    #[default]
    Cader,
}

/// What is flattened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FlatteningDomain {
    /// The whole base surface; the trimming loops are mapped on (thesis 4.4.3).
    #[default]
    Base,
    /// The trimmed mesh alone.
    Trimmed,
}

/// Order of the triangles within a level of the mapping order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// As discovered.
    Fifo,
    /// By triangle number.
    #[default]
    Index,
}

/// Which shared edge a triangle whose three vertices are placed unfolds over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parent {
    /// The one to the neighbour that was flattened first.
    #[default]
    First,
    /// The one to the neighbour that was flattened last.
    Last,
}

/// Which end of the new triangle's own half-edge the position is measured from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Anchor {
    /// Its start.
    Start,
    /// Its end.
    #[default]
    End,
}

/// How several positions of one vertex become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Average {
    /// (old + new) / 2.
    #[default]
    Pair,
    /// The mean of all positions so far.
    Running,
}

/// Which triangles are tested for a flip, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Check {
    /// Every flattened triangle at the vertex that moved.
    #[default]
    Incident,
    /// The triangle being processed alone.
    Current,
    /// All, at the end.
    Final,
}

/// One resolution of what the thesis leaves open in Cader's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Readings {
    /// Order within a level.
    pub order: Order,
    /// Shared edge of a triangle whose vertices are all placed.
    pub parent: Parent,
    /// Anchor `p_s`.
    pub anchor: Anchor,
    /// Averaging.
    pub average: Average,
    /// Flip check.
    pub check: Check,
}

/// The seed triangle (thesis 4.4.4).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SeedChoice {
    /// `"centre"`: the triangle whose centroid is nearest to the area centroid, lowest index.
    Centre,
    /// `"optimum"`: the one with the least area change (lowest index on ties), every seed tried.
    Optimum,
    /// `{ "uv": [u, v] }`: the triangle that holds this place of the domain.
    Uv([f64; 2]),
    /// `{ "xyz": [x, y, z] }`: the triangle nearest to this place in space, mm.
    Xyz([f64; 3]),
    /// A triangle's index.
    #[serde(untagged)]
    Index(u32),
}

/// The `flattening` object of a job.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlatteningOptions {
    /// The method.
    pub method: FlatteningMethod,
    /// What is flattened.
    pub domain: FlatteningDomain,
    /// The seed. Absent: `optimum` up to 8000 triangles, else `centre`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<SeedChoice>,
    /// The readings.
    pub readings: Readings,
}
