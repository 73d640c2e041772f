//! Strain as colours: blue where the material is gathered, white where it keeps its length, red where it is stretched.
//!
//! A triangle's strain is the principal one of larger magnitude; a vertex takes the mean of its triangles
//! ([`super::vertex_strains`]). The scale is symmetric about zero and reaches to the 98th percentile by count of the part's
//! triangles, rounded up to 1, 2 or 5 times a power of ten, so
//! that one corner triangle does not pale all others and two similar parts get the same scale. Colours are linear, as
//! glTF wants them.

use super::MeshParts;
use super::vertex_strains::{VertexStrain, larger, vertex_strains};

/// Share of triangles whose strain the scale reaches.
const SCALE_SHARE: f64 = 0.98;
/// Smallest scale, percent: strains below it are rounding, not distortion.
const SCALE_LEAST: f64 = 0.01;

/// Linear red, green, blue, opacity, 0 to 255.
pub(super) type Colour = [u8; 4];

const STRETCHED: [f64; 3] = [0.60, 0.01, 0.02];
const EVEN: [f64; 3] = [0.90, 0.90, 0.90];
const GATHERED: [f64; 3] = [0.02, 0.10, 0.60];
/// Vertices that have no strain.
const UNKNOWN: Colour = [110, 110, 110, 255];

/// Strains of vertices as colours, with their scale.
pub(super) struct StrainColours {
    /// The strain at each vertex; `None` where there is none.
    pub(super) vertices: Vec<Option<VertexStrain>>,
    /// The strain that has the full colour, percent.
    pub(super) scale_percent: f64,
}

impl StrainColours {
    /// From the strains of a mesh's triangles.
    pub(super) fn of(parts: &MeshParts<'_>, strains: &[[f64; 2]]) -> Self {
        let of_part = strains.iter().enumerate().filter(|(t, _)| parts.is_of_part(*t));
        let mut sizes: Vec<f64> = of_part.map(|(_, s)| larger(*s).abs()).filter(|s| s.is_finite()).collect();
        Self { vertices: vertex_strains(parts, strains), scale_percent: scale(&mut sizes) }
    }

    /// The colour of each vertex.
    pub(super) fn colours(&self) -> impl Iterator<Item = Colour> + '_ {
        self.vertices.iter().map(|strain| strain.map_or(UNKNOWN, |strain| colour(strain.signed / self.scale_percent)))
    }
}

fn scale(sizes: &mut [f64]) -> f64 {
    if sizes.is_empty() {
        return SCALE_LEAST;
    }
    let rank = ((sizes.len() as f64 * SCALE_SHARE) as usize).min(sizes.len() - 1);
    let (_, size, _) = sizes.select_nth_unstable_by(rank, f64::total_cmp);
    let size = *size;
    if size <= SCALE_LEAST {
        return SCALE_LEAST;
    }
    let decade = 10_f64.powf(size.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|k| k * decade).find(|s| *s >= size).unwrap_or(10.0 * decade)
}

/// The colour of a strain given as a fraction of the scale.
fn colour(fraction: f64) -> Colour {
    let full = if fraction > 0.0 { STRETCHED } else { GATHERED };
    let t = fraction.abs().min(1.0);
    let mut out = [255; 4];
    for k in 0..3 {
        out[k] = (255.0 * (EVEN[k] + t * (full[k] - EVEN[k]))).round() as u8;
    }
    out
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::mesh::Mesh;

    fn mesh(vertices: usize, triangles: Vec<[u32; 3]>) -> Mesh {
        Mesh { positions: vec![DVec3::ZERO; vertices], uv: None, triangles }
    }

    #[test]
    fn stretched_is_red_gathered_is_blue_and_unknown_is_grey() {
        let mesh = mesh(10, vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
        let found = StrainColours::of(&MeshParts::of(&mesh), &[[0.0, 3.0], [-3.0, 1.0], [f64::NAN; 2]]);
        assert_eq!(found.scale_percent, 5.0);
        let colours: Vec<Colour> = found.colours().collect();
        assert!(colours[0][0] > colours[0][2], "red");
        assert!(colours[3][2] > colours[3][0], "blue");
        assert_eq!((colours[6], colours[9]), (UNKNOWN, UNKNOWN));
    }

    #[test]
    fn one_wild_triangle_does_not_set_the_scale_and_waste_does_not_either() {
        let strains: Vec<[f64; 2]> = (0..1000).map(|i| [0.0, if i == 7 || i >= 500 { 400.0 } else { 0.9 }]).collect();
        let mesh = mesh(3, vec![[0, 1, 2]; 1000]);
        let part: Vec<bool> = (0..1000).map(|i| i < 500).collect();
        let scale = |part| StrainColours::of(&MeshParts { part, ..MeshParts::of(&mesh) }, &strains).scale_percent;
        assert_eq!(scale(Some(part.as_slice())), 1.0);
        assert_eq!(scale(None), 500.0);
    }
}
