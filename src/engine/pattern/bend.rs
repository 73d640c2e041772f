//! What lies between the vertices: the surface bulges out of a triangle's plane and slides along it, and so does its image.
//!
//! Vertices tell the map along an edge to second order only if the edge's own middle is asked too. The surface's point at the
//! middle of an edge in the domain stands off the middle of the chord by `d`; the part of `d` in the planes of the triangles
//! on both sides goes with their affine maps, and the mean of the two images is the edge's bend `m`. Over a triangle the
//! map is then the quadratic `sum w_i x_i + 4 sum w_i w_j m_ij`: continuous from triangle to triangle, with an error of
//! third order in the edge length instead of second. A circle's arc between two vertices comes out as a parabola rather than
//! as its chord.

use glam::{DVec2, DVec3};

/// The corners of a triangle on the mesh and in the plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Laid {
    pub(super) mesh: [DVec3; 3],
    pub(super) flat: [DVec2; 3],
}

impl Laid {
    /// Where the triangle's map takes the part of a small step that lies in its plane; `None` in a sliver, where that says
    /// nothing: then the step's image differs from the step by more than a factor of `most`.
    fn image(&self, step: DVec3, most: f64) -> Option<DVec2> {
        let [e, f] = [self.mesh[1] - self.mesh[0], self.mesh[2] - self.mesh[0]];
        let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
        let (se, sf) = (step.dot(e), step.dot(f));
        let area = ee * ff - ef * ef;
        let (x, y) = ((se * ff - sf * ef) / area, (sf * ee - se * ef) / area);
        let image = (self.flat[1] - self.flat[0]) * x + (self.flat[2] - self.flat[0]) * y;
        // Not a number fails the comparison too.
        (image.length() <= most * step.length()).then_some(image)
    }
}

/// The bend of an edge: `off` is how far the surface stands off the middle of the chord, `sides` are the triangles there.
pub(super) fn bend(off: DVec3, sides: [Option<Laid>; 2], most: f64) -> DVec2 {
    let images = sides.map(|side| side.and_then(|laid| laid.image(off, most)));
    match images {
        [Some(a), Some(b)] => 0.5 * (a + b),
        [Some(one), None] | [None, Some(one)] => one,
        [None, None] => DVec2::ZERO,
    }
}

/// What the bends of the edges (0, 1), (1, 2), (2, 0) add at barycentric coordinates.
pub(super) fn bent([a, b, c]: [f64; 3], bends: &[DVec2; 3]) -> DVec2 {
    4.0 * (a * b * bends[0] + b * c * bends[1] + c * a * bends[2])
}

/// What they add to the derivative, where the coordinates change by `d`.
pub(super) fn bent_along([a, b, c]: [f64; 3], d: [f64; 3], bends: &[DVec2; 3]) -> DVec2 {
    let product = |x: f64, y: f64, dx: f64, dy: f64| dx * y + x * dy;
    4.0 * (product(a, b, d[0], d[1]) * bends[0]
        + product(b, c, d[1], d[2]) * bends[1]
        + product(c, a, d[2], d[0]) * bends[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laid() -> Laid {
        Laid {
            mesh: [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0)],
            flat: [DVec2::ZERO, DVec2::new(0.0, 2.0), DVec2::new(-1.0, 0.0)],
        }
    }

    #[test]
    fn a_step_in_the_plane_goes_with_the_map_and_one_out_of_it_goes_nowhere() {
        let image = laid().image(DVec3::new(0.1, 0.2, 0.5), 2.0).unwrap();
        assert!(image.distance(DVec2::new(-0.2, 0.1)) < 1e-15, "{image}");
        assert_eq!(laid().image(DVec3::Z, 2.0), Some(DVec2::ZERO));
    }

    #[test]
    fn a_sliver_bends_nothing() {
        let mut sliver = laid();
        sliver.mesh[2] = DVec3::new(1.0, 0.0, 0.0);
        assert_eq!(bend(DVec3::new(0.1, 0.2, 0.5), [Some(sliver), None], 2.0), DVec2::ZERO);
        let honest = bend(DVec3::new(0.1, 0.2, 0.5), [Some(sliver), Some(laid())], 2.0);
        assert!(honest.distance(DVec2::new(-0.2, 0.1)) < 1e-15, "{honest}");
    }

    #[test]
    fn the_derivative_is_that_of_what_is_added() {
        let bends = [DVec2::new(0.3, 0.1), DVec2::new(-0.2, 0.7), DVec2::new(0.5, -0.4)];
        let (at, d, step) = ([0.2, 0.5, 0.3], [0.7, -0.9, 0.2], 1e-6);
        let moved = |s: f64| bent(std::array::from_fn(|k| at[k] + s * d[k]), &bends);
        let slope = (moved(step) - moved(-step)) / (2.0 * step);
        assert!(slope.distance(bent_along(at, d, &bends)) < 1e-9);
        // A middle of an edge moves by its bend.
        assert!(bent([0.5, 0.5, 0.0], &bends).distance(bends[0]) < 1e-15);
    }
}
