//! Meshes for tests: grids with the vertex numbering and the diagonals of the reference notes.

use glam::{DVec2, DVec3};

use super::Mesh;

/// How the diagonals of a grid run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Diagonal {
    /// All `/`.
    Regular,
    /// All `\`.
    Mirrored,
    /// A checkerboard that begins with `/`.
    Diamond,
    /// Alternating by row.
    ChevronRows,
    /// Alternating by column.
    ChevronColumns,
}

impl Diagonal {
    /// All of them.
    pub(crate) const ALL: [Self; 5] =
        [Self::Regular, Self::Mirrored, Self::Diamond, Self::ChevronRows, Self::ChevronColumns];

    /// By its name in the reference cases.
    pub(crate) fn of_name(name: &str) -> Option<Self> {
        Some(match name {
            "regular" => Self::Regular,
            "regular_flip" => Self::Mirrored,
            "diamond" => Self::Diamond,
            "chevron_row" => Self::ChevronRows,
            "chevron_col" => Self::ChevronColumns,
            _ => return None,
        })
    }

    const fn falls(self, i: usize, j: usize) -> bool {
        match self {
            Self::Regular => false,
            Self::Mirrored => true,
            Self::Diamond => (i + j) % 2 == 1,
            Self::ChevronRows => j % 2 == 1,
            Self::ChevronColumns => i % 2 == 1,
        }
    }
}

/// Triangles of a grid of m x n points, vertex `j * m + i`, cells row by row.
pub(crate) fn grid_triangles(m: usize, n: usize, diagonal: Diagonal) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(2 * (m - 1) * (n - 1));
    for j in 0..n - 1 {
        for i in 0..m - 1 {
            let a = (j * m + i) as u32;
            let (b, c, d) = (a + 1, a + m as u32 + 1, a + m as u32);
            if diagonal.falls(i, j) {
                triangles.extend([[a, b, d], [b, c, d]]);
            } else {
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    triangles
}

/// A grid of m x n points over the unit square, lifted by a surface.
pub(crate) fn grid(m: usize, n: usize, diagonal: Diagonal, surface: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let mut mesh = Mesh { triangles: grid_triangles(m, n, diagonal), ..Mesh::default() };
    let mut uv = Vec::with_capacity(m * n);
    for j in 0..n {
        for i in 0..m {
            let (u, v) = (i as f64 / (m - 1) as f64, j as f64 / (n - 1) as f64);
            uv.push(DVec2::new(u, v));
            mesh.positions.push(surface(u, v));
        }
    }
    mesh.uv = Some(uv);
    mesh
}
