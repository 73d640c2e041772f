//! What can be wrong with a triangle mesh, each with its place.

use glam::DVec3;

use super::{Mesh, Piece};
use crate::engine::error::{Located, Place, Remedy};

/// One fault of a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFault {
    /// More triangles than can be numbered.
    #[error("the mesh has {triangles} triangles, more than the {limit} that can be numbered")]
    TooLarge {
        /// How many there are.
        triangles: u64,
        /// How many there may be.
        limit: u64,
    },
    /// A corner names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but the mesh has {vertices} vertices")]
    VertexOutOfRange {
        /// The triangle.
        triangle: u32,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        vertices: u32,
    },
    /// A triangle has the same vertex twice.
    #[error("triangle {triangle} has vertex {vertex} twice")]
    RepeatedVertex {
        /// The triangle.
        triangle: u32,
        /// The vertex.
        vertex: u32,
    },
    /// More than two triangles share an edge.
    #[error("{count} triangles share the edge between vertices {} and {} (triangles {triangles:?} among them)", vertices[0], vertices[1])]
    NonManifoldEdge {
        /// The edge.
        vertices: [u32; 2],
        /// Its first three triangles.
        triangles: [u32; 3],
        /// How many triangles share it.
        count: u32,
    },
    /// Two neighbours run through their edge in the same direction: one of them is turned over.
    #[error("triangles {} and {} are oriented differently", triangles[0], triangles[1])]
    Orientation {
        /// The edge.
        vertices: [u32; 2],
        /// The two.
        triangles: [u32; 2],
    },
    /// A coordinate is not a number.
    #[error("vertex {vertex} has a coordinate that is not finite")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
    /// A triangle has no area.
    #[error("triangle {triangle} has no area")]
    ZeroArea {
        /// The triangle.
        triangle: u32,
    },
    /// A vertex lies on the inside of a border edge that does not know it: the mesh has a crack.
    #[error("vertex {vertex} lies on the border edge between vertices {} and {} without belonging to it", vertices[0], vertices[1])]
    TJunction {
        /// The vertex.
        vertex: u32,
        /// The edge.
        vertices: [u32; 2],
        /// The edge's triangle.
        triangle: u32,
    },
    /// A piece has no border.
    #[error("the piece is closed: its {triangles} triangles have no border, so it cannot lie flat without a cut")]
    Closed {
        /// Its first triangle.
        triangle: u32,
        /// How many it has.
        triangles: u32,
    },
    /// A piece has one side only.
    #[error(
        "the piece has one side only, as a Moebius band has: triangles {} and {} cannot be oriented alike",
        triangles[0], triangles[1]
    )]
    NotOrientable {
        /// The edge where two orientations meet.
        vertices: [u32; 2],
        /// Its triangles.
        triangles: [u32; 2],
    },
    /// A piece has handles, as a torus has.
    #[error("the piece has {handles} handle{}, as a cup has: it cannot lie flat without a cut", if *handles == 1 { "" } else { "s" })]
    Handles {
        /// How many.
        handles: u32,
        /// Its first triangle.
        triangle: u32,
    },
    /// Triangles of one piece meet at a vertex without sharing an edge there.
    #[error("vertex {vertex} is touched by {fans} separate fans of triangles")]
    PinchedVertex {
        /// The vertex.
        vertex: u32,
        /// How many fans.
        fans: u32,
    },
}

impl MeshFault {
    /// The triangle to look at, if one is named.
    #[must_use]
    pub const fn triangle(&self) -> Option<u32> {
        match self {
            Self::VertexOutOfRange { triangle, .. }
            | Self::RepeatedVertex { triangle, .. }
            | Self::ZeroArea { triangle }
            | Self::TJunction { triangle, .. }
            | Self::Closed { triangle, .. }
            | Self::Handles { triangle, .. } => Some(*triangle),
            Self::NonManifoldEdge { triangles, .. } => Some(triangles[0]),
            Self::Orientation { triangles, .. } | Self::NotOrientable { triangles, .. } => Some(triangles[0]),
            Self::TooLarge { .. } | Self::NotFinite { .. } | Self::PinchedVertex { .. } => None,
        }
    }

    /// The place in space and in the domain, which the fault alone does not know.
    #[must_use]
    pub fn place_in(&self, mesh: &Mesh) -> Place {
        let vertices: &[u32] = match self {
            Self::NonManifoldEdge { vertices, .. }
            | Self::Orientation { vertices, .. }
            | Self::NotOrientable { vertices, .. } => vertices,
            Self::RepeatedVertex { vertex, .. }
            | Self::TJunction { vertex, .. }
            | Self::NotFinite { vertex }
            | Self::PinchedVertex { vertex, .. } => std::slice::from_ref(vertex),
            Self::ZeroArea { triangle } | Self::Closed { triangle, .. } | Self::Handles { triangle, .. } => {
                mesh.triangles.get(*triangle as usize).map_or(&[], |t| t.as_slice())
            }
            Self::TooLarge { .. } | Self::VertexOutOfRange { .. } => &[],
        };
        let mut place = Place { triangle: self.triangle(), ..Place::default() };
        let points: Vec<DVec3> = vertices.iter().filter_map(|&v| mesh.positions.get(v as usize).copied()).collect();
        let share = 1.0 / points.len().max(1) as f64;
        let middle = points.iter().sum::<DVec3>() * share;
        if !points.is_empty() && middle.is_finite() {
            place.xyz_mm = Some(middle.to_array());
            if let Some(uv) = &mesh.uv
                && vertices.iter().all(|&v| (v as usize) < uv.len())
            {
                place.uv = Some((vertices.iter().map(|&v| uv[v as usize]).sum::<glam::DVec2>() * share).to_array());
            }
        }
        place
    }

    /// The same fault of a piece, with the numbers that vertices and triangles have in the whole mesh.
    #[must_use]
    pub fn in_whole(mut self, piece: &Piece) -> Self {
        let of = |numbers: &[u32], own: &mut u32| *own = numbers.get(*own as usize).copied().unwrap_or(*own);
        let (vertices, triangles): (&mut [u32], &mut [u32]) = match &mut self {
            Self::TooLarge { .. } => (&mut [], &mut []),
            Self::VertexOutOfRange { triangle, .. }
            | Self::ZeroArea { triangle }
            | Self::Closed { triangle, .. }
            | Self::Handles { triangle, .. } => (&mut [], std::slice::from_mut(triangle)),
            Self::RepeatedVertex { vertex, triangle } => (std::slice::from_mut(vertex), std::slice::from_mut(triangle)),
            Self::NonManifoldEdge { vertices, triangles, .. } => (vertices, triangles),
            Self::Orientation { vertices, triangles } | Self::NotOrientable { vertices, triangles } => {
                (vertices, triangles)
            }
            Self::NotFinite { vertex } | Self::PinchedVertex { vertex, .. } => (std::slice::from_mut(vertex), &mut []),
            Self::TJunction { vertex, vertices, triangle } => {
                of(&piece.vertex_of, vertex);
                (vertices, std::slice::from_mut(triangle))
            }
        };
        for vertex in vertices {
            of(&piece.vertex_of, vertex);
        }
        for triangle in triangles {
            of(&piece.triangle_of, triangle);
        }
        self
    }
}

impl Located for MeshFault {
    fn code(&self) -> &'static str {
        match self {
            Self::TooLarge { .. } => "mesh-too-large",
            Self::VertexOutOfRange { .. } => "mesh-vertex-out-of-range",
            Self::RepeatedVertex { .. } => "mesh-repeated-vertex",
            Self::NonManifoldEdge { .. } => "mesh-non-manifold-edge",
            Self::Orientation { .. } => "mesh-orientation",
            Self::NotFinite { .. } => "mesh-not-finite",
            Self::ZeroArea { .. } => "mesh-zero-area",
            Self::TJunction { .. } => "mesh-t-junction",
            Self::PinchedVertex { .. } => "mesh-pinched-vertex",
            Self::Closed { .. } => "mesh-closed",
            Self::NotOrientable { .. } => "mesh-not-orientable",
            Self::Handles { .. } => "mesh-handles",
        }
    }

    fn place(&self) -> Place {
        Place { triangle: self.triangle(), ..Place::default() }
    }

    fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::NonManifoldEdge { .. } => {
                vec![Remedy::say("Divide the mesh so that no more than two triangles share an edge.")]
            }
            Self::Orientation { .. } => {
                vec![Remedy::say("Orient all triangles alike: anticlockwise seen from the show side.")]
            }
            Self::Closed { .. } | Self::NotOrientable { .. } | Self::Handles { .. } => {
                vec![Remedy::say(
                    "Cut the mesh open where a seam may run, so that each piece is a sheet with a border.",
                )]
            }
            Self::TooLarge { .. } => vec![Remedy::say("Send a coarser mesh.")],
            _ => {
                vec![Remedy::say("Repair the mesh where it is exported: remove empty triangles and join its vertices.")]
            }
        }
    }
}
