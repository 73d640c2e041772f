//! Rectilinear grids over a parameter domain and the configurations of their diagonals (thesis 5.2).
//!
//! A grid of m columns and n rows of *points* has (m - 1)(n - 1) cells. Vertex (i, j) stands at `j * m + i`. Cells are
//! written row by row (j outer, i inner); with a = (i, j), b = (i+1, j), c = (i+1, j+1), d = (i, j+1) the diagonal `/`
//! gives (a, b, c), (a, c, d) and `\` gives (a, b, d), (b, c, d). Cader's mapping order depends on this numbering.

use glam::DVec2;

use super::{Configuration, DomainMesh, GridLines};
use crate::engine::nurbs::Domain;

impl GridLines {
    /// m columns and n rows, equally spaced over the domain, whose ends they meet bit for bit.
    ///
    /// Fewer than two of either are taken as two: a grid has at least one cell.
    #[must_use]
    pub fn uniform(domain: Domain, m: usize, n: usize) -> Self {
        Self { u: equally_spaced(domain.u, m.max(2)), v: equally_spaced(domain.v, n.max(2)) }
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> u64 {
        (self.u.len().saturating_sub(1) as u64) * (self.v.len().saturating_sub(1) as u64)
    }

    /// The rectangle that the lines cover: their first and last values.
    #[must_use]
    pub fn domain(&self) -> Domain {
        let ends = |lines: &[f64]| [lines.first().copied().unwrap_or(0.0), lines.last().copied().unwrap_or(0.0)];
        Domain { u: ends(&self.u), v: ends(&self.v) }
    }
}

/// `count` values from one end to the other. Fractions are divided first, so that the unit interval in five parts has
/// its lines at the numbers written 0.2, 0.4, ...
fn equally_spaced([first, last]: [f64; 2], count: usize) -> Vec<f64> {
    let parts = (count - 1) as f64;
    let mut lines: Vec<f64> = (0..count).map(|i| first + (last - first) * (i as f64 / parts)).collect();
    lines[0] = first;
    lines[count - 1] = last;
    lines
}

impl Configuration {
    /// True when the diagonal of cell (i, j) is `\`, from (i+1, j) to (i, j+1); false when it is `/`.
    ///
    /// An odd `phase` begins with the other diagonal; the two regular configurations, which do not alternate, ignore it.
    /// `fitted` and `random` have no rule of their own, and `/` stands for them: [`super::fitted_mesh`] searches the surface,
    /// [`random_mesh`] has a seed.
    #[must_use]
    pub const fn is_backslash(self, i: usize, j: usize, phase: u8) -> bool {
        let alternating = match self {
            Self::Regular | Self::Fitted | Self::Random => return false,
            Self::RegularMirrored => return true,
            Self::Diamond => i ^ j,
            Self::ChevronRows => j,
            Self::ChevronColumns => i,
        };
        alternating & 1 != (phase & 1) as usize
    }
}

/// The two triangles of a cell with corners a, b, c, d (anticlockwise from the lower left).
pub(super) const fn split_cell([a, b, c, d]: [u32; 4], backslash: bool) -> [[u32; 3]; 2] {
    if backslash { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] }
}

/// The mesh of a whole grid: m n vertices and 2 (m - 1)(n - 1) triangles, numbered as the module says.
///
/// The caller bounds m n (vertices are numbered with `u32`).
#[must_use]
pub fn grid_mesh(lines: &GridLines, configuration: Configuration, phase: u8) -> DomainMesh {
    grid_mesh_by(lines, |i, j| configuration.is_backslash(i, j, phase))
}

/// The same with the diagonal of each cell (i, j) told: true is `\`.
#[must_use]
pub fn grid_mesh_by(lines: &GridLines, is_backslash: impl Fn(usize, usize) -> bool) -> DomainMesh {
    let (m, n) = (lines.u.len(), lines.v.len());
    let uv = lines.v.iter().flat_map(|&v| lines.u.iter().map(move |&u| DVec2::new(u, v))).collect();
    let mut triangles = Vec::with_capacity(2 * m.saturating_sub(1) * n.saturating_sub(1));
    for j in 0..n.saturating_sub(1) {
        for i in 0..m.saturating_sub(1) {
            let a = (j * m + i) as u32;
            let d = a + m as u32;
            triangles.extend(split_cell([a, a + 1, d + 1, d], is_backslash(i, j)));
        }
    }
    DomainMesh { uv, triangles }
}

/// The same with diagonals by chance (thesis 5.5.4): the diagonal of a cell depends on the seed and on the cell's i and j
/// alone, each way equally likely, so that the same seed gives the same diagonals on any grid that has the cell.
#[must_use]
pub fn random_mesh(lines: &GridLines, seed: u32) -> DomainMesh {
    grid_mesh_by(lines, |i, j| {
        // The finaliser of SplitMix64 (Steele, Lea, Flood 2014) over seed and cell, once for each.
        let mixed = mix(mix(u64::from(seed)) ^ ((j as u64) << 32 | i as u64));
        mixed >> 63 == 1
    })
}

/// A bijection of 64-bit numbers that lets no pattern of its argument through.
const fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [(Configuration, &str); 4] = [
        (Configuration::Regular, "regular"),
        (Configuration::Diamond, "diamond"),
        (Configuration::ChevronRows, "chevron_row"),
        (Configuration::ChevronColumns, "chevron_col"),
    ];

    #[test]
    fn uniform_lines_meet_the_domains_ends_bit_for_bit() {
        let domain = Domain { u: [0.1, 0.7], v: [-3.3, 1e5] };
        let lines = GridLines::uniform(domain, 8, 1001);
        assert_eq!(lines.domain(), domain);
        assert_eq!((lines.u.len(), lines.v.len(), lines.cells()), (8, 1001, 7000));
        assert!(lines.u.windows(2).chain(lines.v.windows(2)).all(|w| w[0] < w[1]));
        let unit = GridLines::uniform(Domain { u: [0.0, 1.0], v: [0.0, 1.0] }, 6, 11);
        assert_eq!((unit.u[3], unit.v[7]), (0.6, 0.7));
    }

    #[test]
    fn phase_one_begins_with_the_other_diagonal_where_diagonals_alternate() {
        for (configuration, name) in ALL {
            let alternates = configuration != Configuration::Regular;
            for (i, j) in [(0, 0), (1, 0), (0, 1), (5, 2)] {
                let differs = configuration.is_backslash(i, j, 0) != configuration.is_backslash(i, j, 1);
                assert_eq!(differs, alternates, "{name}");
            }
        }
        assert!(Configuration::RegularMirrored.is_backslash(0, 0, 0));
    }

    #[test]
    fn diagonals_by_chance_belong_to_their_seed_and_are_even() {
        let domain = Domain { u: [0.0, 1.0], v: [0.0, 1.0] };
        let (small, large) = (GridLines::uniform(domain, 11, 21), GridLines::uniform(domain, 101, 101));
        let mesh = random_mesh(&large, 7);
        assert_eq!(mesh, random_mesh(&large, 7));
        assert_ne!(mesh.triangles, random_mesh(&large, 8).triangles);
        // 10 000 fair coins are within five deviations of a half.
        let of_seed = |seed| {
            let mesh = random_mesh(&large, seed);
            (0..10_000).filter(|&c| mesh.triangles[2 * c][2] == mesh.triangles[2 * c][0] + 101).count()
        };
        assert!((0..5).map(of_seed).all(|count| (4750..=5250).contains(&count)));
        let cell = |mesh: &DomainMesh, m: u32, i: u32, j: u32| {
            let t = mesh.triangles[2 * (j * (m - 1) + i) as usize];
            t[2] == t[0] + m
        };
        let few = random_mesh(&small, 7);
        assert!((0..20).all(|j| (0..10).all(|i| cell(&few, 11, i, j) == cell(&mesh, 101, i, j))));
    }

    #[test]
    fn meshes_match_the_reference_counts_and_numbering() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/cases/mesh_and_mapping.json");
        let Ok(text) = std::fs::read_to_string(path) else {
            println!("reference cases are not there: nothing compared");
            return;
        };
        let cases: serde_json::Value = serde_json::from_str(&text).unwrap();
        let domain = Domain { u: [0.0, 1.0], v: [0.0, 1.0] };
        for (configuration, name) in ALL {
            let case = &cases[name];
            let mesh = grid_mesh(&GridLines::uniform(domain, 60, 60), configuration, 0);
            assert_eq!(mesh.uv.len() as u64, case["vertices"].as_u64().unwrap());
            assert_eq!(mesh.triangles.len() as u64, case["triangles"].as_u64().unwrap());
            let first: Vec<[u32; 3]> = serde_json::from_value(case["first_triangles"].clone()).unwrap();
            assert_eq!(mesh.triangles[..first.len()], first[..], "{name}");
            let mut edges: Vec<[u32; 2]> =
                mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
            for edge in &mut edges {
                edge.sort_unstable();
            }
            edges.sort_unstable();
            edges.dedup();
            assert_eq!(edges.len() as u64, case["edges"].as_u64().unwrap());
            let mut valency = vec![0_usize; mesh.uv.len()];
            edges.iter().flatten().for_each(|&v| valency[v as usize] += 1);
            let mut counted = std::collections::BTreeMap::<String, u64>::new();
            for j in 1..59 {
                for i in 1..59 {
                    *counted.entry(valency[j * 60 + i].to_string()).or_default() += 1;
                }
            }
            assert_eq!(serde_json::to_value(counted).unwrap(), case["interior_valencies"], "{name}");
            let denser = grid_mesh(&GridLines::uniform(domain, 70, 70), configuration, 0);
            assert_eq!(denser.uv.len() as u64, case["counts_70"]["vertices"].as_u64().unwrap());
            assert_eq!(denser.triangles.len() as u64, case["counts_70"]["triangles"].as_u64().unwrap());
        }
    }
}
