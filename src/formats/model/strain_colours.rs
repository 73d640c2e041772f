//! Strain as colours: blue where the material is gathered, white where it keeps its length, red where it is stretched.
//!
//! A triangle's strain is the principal one of larger magnitude; a vertex takes the mean of its triangles. The scale is
//! symmetric about zero and reaches to the 98th percentile by count, rounded up to 1, 2 or 5 times a power of ten, so
//! that one corner triangle does not pale all others and two similar parts get the same scale. Colours are linear, as
//! glTF wants them.

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

/// Colours of vertices and their scale.
pub(super) struct StrainColours {
    /// A colour for each vertex.
    pub(super) colours: Vec<Colour>,
    /// The strain that has the full colour, percent.
    pub(super) scale_percent: f64,
}

/// Colours for `vertices` vertices from the strains of `triangles`.
pub(super) fn colours(vertices: usize, triangles: &[[u32; 3]], strains: &[[f64; 2]]) -> StrainColours {
    let signed: Vec<f32> = strains.iter().map(|[a, b]| (if a.abs() > b.abs() { *a } else { *b }) as f32).collect();
    let mut sizes: Vec<f32> = signed.iter().filter(|s| s.is_finite()).map(|s| s.abs()).collect();
    let scale_percent = scale(&mut sizes);
    let mut sums = vec![(0.0_f32, 0_u32); vertices];
    for (corners, strain) in triangles.iter().zip(&signed) {
        if strain.is_finite() {
            for &corner in corners {
                if let Some((sum, count)) = sums.get_mut(corner as usize) {
                    *sum += strain;
                    *count += 1;
                }
            }
        }
    }
    let colours = sums
        .into_iter()
        .map(
            |(sum, count)| if count == 0 { UNKNOWN } else { colour(f64::from(sum) / f64::from(count) / scale_percent) },
        )
        .collect();
    StrainColours { colours, scale_percent }
}

fn scale(sizes: &mut [f32]) -> f64 {
    if sizes.is_empty() {
        return SCALE_LEAST;
    }
    let rank = ((sizes.len() as f64 * SCALE_SHARE) as usize).min(sizes.len() - 1);
    let (_, size, _) = sizes.select_nth_unstable_by(rank, f32::total_cmp);
    let size = f64::from(*size);
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
    use super::*;

    #[test]
    fn stretched_is_red_gathered_is_blue_and_unknown_is_grey() {
        let triangles = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        let found = colours(10, &triangles, &[[0.0, 3.0], [-3.0, 1.0], [f64::NAN; 2]]);
        assert_eq!(found.scale_percent, 5.0);
        assert!(found.colours[0][0] > found.colours[0][2], "red");
        assert!(found.colours[3][2] > found.colours[3][0], "blue");
        assert_eq!(found.colours[6], UNKNOWN);
        assert_eq!(found.colours[9], UNKNOWN);
    }

    #[test]
    fn one_wild_triangle_does_not_set_the_scale() {
        let strains: Vec<[f64; 2]> = (0..1000).map(|i| [0.0, if i == 7 { 400.0 } else { 0.9 }]).collect();
        let triangles = vec![[0, 1, 2]; 1000];
        assert_eq!(colours(3, &triangles, &strains).scale_percent, 1.0);
    }
}
