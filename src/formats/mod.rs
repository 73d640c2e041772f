//! Bytes to geometry and back. In: trimmed-surface JSON, glTF. Out: GLB, OBJ, STL, PLY, DXF, SVG, CSV, JSON.
//!
//! | module | what |
//! |---|---|
//! | [`sniff`] | what the first bytes of a body are |
//! | [`surface_json`] | reads and writes a trimmed surface; finds all faults at once |
//! | [`gltf_mesh`] | reads the triangles of a glTF scene as one mesh; trusts no number in it |
//! | [`surface`] | a surface of either kind, by its bytes |
//! | [`summary`], [`mesh_summary`] | what is said of a surface when it is sent |
//! | [`dxf`], [`svg`], [`hpgl`], [`pattern_json`] | a pattern to cut |
//! | [`glb`], [`obj`], [`stl`], [`ply`], [`mesh_json`] | a mesh in space with its flattening |
//! | [`triangles_csv`], [`vertices_csv`] | a mesh's triangles and its vertices as tables |
//! | [`report_json`] | the report |
//! | [`seeds`] | what became of each seed of a search |
//! | [`stored`] | mesh and pattern as they are kept, exact to the bit |
//!
//! Every writer is a pure function from values to bytes: the same values give the same bytes. A number that is not
//! finite is refused ([`WriteError`]) and never written as `null` or `NaN` by accident.

pub mod composition;
mod drawing;
pub mod faults;
pub mod gltf_mesh;
pub mod mesh_summary;
mod model;
mod numbers;
pub mod part_summary;
pub mod report_json;
pub mod seeds;
pub mod sniff;
pub mod stored;
pub mod summary;
pub mod surface;
pub mod surface_json;
pub mod units;

pub use drawing::{TitleBlock, dxf, file_stem, hpgl, pattern_json, svg};
pub use model::{MeshParts, glb, mesh_json, obj, ply, stl, triangles_csv, vertices_csv};
pub use numbers::WriteError;
