//! What a glTF file may hold at most. One home for all of these numbers.

/// Most nodes, meshes, accessors, views, buffers and primitives, each. CAD programs write some thousands of each; the
/// bound keeps what a small file can make of itself in memory small.
pub const MAX_OBJECTS: usize = 100_000;
/// Most triangles in all instances of all meshes: what jobs work on.
pub const MAX_TRIANGLES: u64 = 2_000_000;
/// Most vertices in all instances of all meshes: three a triangle, as files without indices have.
pub const MAX_VERTICES: u64 = 6_000_000;
/// Deepest nesting of nodes.
pub const MAX_DEPTH: usize = 64;
/// Most bytes of all embedded buffers, decoded.
pub const MAX_BUFFER_BYTES: u64 = 512 << 20;

/// The limits of a request that a server may tighten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshLimits {
    /// Triangles in all instances.
    pub triangles: u64,
    /// Vertices in all instances.
    pub vertices: u64,
    /// Bytes of all buffers, decoded.
    pub buffer_bytes: u64,
}

impl Default for MeshLimits {
    fn default() -> Self {
        Self { triangles: MAX_TRIANGLES, vertices: MAX_VERTICES, buffer_bytes: MAX_BUFFER_BYTES }
    }
}
