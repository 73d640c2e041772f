//! From the domain to space: every vertex of a domain mesh is mapped on the surface (thesis 3.2, last step).
//!
//! Vertices on crossings of grid lines are evaluated as one tensor product, the others point by point. A degenerate edge
//! of the domain (a pole) becomes one vertex, and triangles of which two corners lie on one pole vanish. A seam stays a
//! cut: vertices with different (u, v) are never merged elsewhere, even where they meet in space.

use glam::{DVec2, DVec3};

use super::{DomainMesh, GridLines, Lifted, flat::flip_flat};
use crate::engine::{
    mesh::Mesh,
    nurbs::{Domain, GridSamples, Surface},
};

/// An edge of the domain is a pole when its image stays within this fraction of the control net's diagonal. Larger
/// merges the ends of slender surfaces; smaller misses poles whose points were rounded when the file was written.
const POLE_TOLERANCE: f64 = 1e-9;

/// A tensor product over the lines that are in use is worth its samples when at least one in so many is wanted.
const WORTHWHILE: usize = 4;

/// Stands for "has no counterpart in the mesh".
const NONE: u32 = u32::MAX;

/// Maps a domain mesh on the surface.
///
/// Triangles that would have no area in space are flipped first where that helps, so the domain mesh can come back with
/// other triangles in their places.
///
/// `lines` are those that the domain mesh was made with; they only decide how points are evaluated. The mesh's `uv` are
/// filled; at a pole they are the middle of the degenerate edge, and so is the place of its normal.
#[must_use]
pub fn lift(surface: &Surface, mut domain: DomainMesh, lines: &GridLines) -> Lifted {
    let samples = evaluate(surface, &domain.uv, lines);
    flip_flat(&mut domain, &samples.positions);
    let poles = Poles::of(surface);
    if poles.is_empty() {
        let mesh =
            Mesh { positions: samples.positions, uv: Some(domain.uv.clone()), triangles: domain.triangles.clone() };
        let vertex_of = (0..domain.uv.len() as u32).collect();
        let triangle_of = (0..domain.triangles.len() as u32).collect();
        return Lifted { mesh, normals: samples.normals, vertex_of, triangle_of, domain };
    }
    with_poles(surface, domain, &samples, &poles)
}

/// Points and normals at places of the domain.
struct Samples {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
}

/// Evaluates the surface at `uv`.
fn evaluate(surface: &Surface, uv: &[DVec2], lines: &GridLines) -> Samples {
    let places = grid_places(uv, lines);
    let on_grid = places.iter().flatten().count();
    let mut samples = Samples { positions: vec![DVec3::ZERO; uv.len()], normals: vec![DVec3::Z; uv.len()] };
    let mut alone = |k: usize| {
        samples.positions[k] = surface.point(uv[k].x, uv[k].y);
        samples.normals[k] = surface.normal(uv[k].x, uv[k].y);
    };
    // The smallest box of lines that holds all grid vertices in use.
    let start = [[usize::MAX; 2], [0; 2]];
    let [low, high] = places
        .iter()
        .flatten()
        .fold(start, |[low, high], &[i, j]| [[low[0].min(i), low[1].min(j)], [high[0].max(i), high[1].max(j)]]);
    let (columns, rows) = ((high[0] + 1).saturating_sub(low[0]), (high[1] + 1).saturating_sub(low[1]));
    if on_grid == 0 || on_grid * WORTHWHILE < columns * rows {
        (0..uv.len()).for_each(alone);
        return samples;
    }
    (0..uv.len()).filter(|&k| places[k].is_none()).for_each(&mut alone);
    let mut grid = GridSamples::default();
    surface.grid(&lines.u[low[0]..=high[0]], &lines.v[low[1]..=high[1]], &mut grid);
    for (k, place) in places.iter().enumerate() {
        if let Some([i, j]) = place {
            let at = (j - low[1]) * columns + (i - low[0]);
            samples.positions[k] = grid.positions[at];
            samples.normals[k] = grid.normals[at];
        }
    }
    samples
}

/// For each place the crossing of grid lines at which it lies bit for bit, if it does.
fn grid_places(uv: &[DVec2], lines: &GridLines) -> Vec<Option<[usize; 2]>> {
    // Neighbours in the list are mostly neighbours in the grid: the last place and the one after it are tried first.
    let (mut i, mut j) = (0, 0);
    uv.iter()
        .map(|p| {
            i = line_at(&lines.u, p.x, i)?;
            j = line_at(&lines.v, p.y, j)?;
            Some([i, j])
        })
        .collect()
}

/// Index of the line at exactly `x`.
fn line_at(lines: &[f64], x: f64, hint: usize) -> Option<usize> {
    if lines.get(hint) == Some(&x) {
        return Some(hint);
    }
    if lines.get(hint + 1) == Some(&x) {
        return Some(hint + 1);
    }
    let at = lines.partition_point(|&line| line < x);
    (lines.get(at) == Some(&x)).then_some(at)
}

/// The degenerate edges of a domain.
struct Poles {
    domain: Domain,
    /// For the edges u first, u last, v first, v last: the number of the pole that it is, if it is one.
    edges: [Option<usize>; 4],
}

impl Poles {
    fn of(surface: &Surface) -> Self {
        let [low, high] = surface.bounding_box();
        let degenerate = surface.degenerate_edges(low.distance(high) * POLE_TOLERANCE);
        // Edges that share a corner share their pole: any edge of constant u meets any edge of constant v.
        let all_one = (degenerate[0] || degenerate[1]) && (degenerate[2] || degenerate[3]);
        let number = |e: usize| degenerate[e].then_some(if all_one { 0 } else { e % 2 });
        Self { domain: surface.domain(), edges: [0, 1, 2, 3].map(number) }
    }

    fn is_empty(&self) -> bool {
        self.edges.iter().all(Option::is_none)
    }

    /// The number (0 or 1) of the pole that `p` lies on.
    fn at(&self, p: DVec2) -> Option<usize> {
        let Domain { u, v } = self.domain;
        let on = [p.x == u[0], p.x == u[1], p.y == v[0], p.y == v[1]];
        (0..4).find_map(|e| if on[e] { self.edges[e] } else { None })
    }

    /// The middle of a pole's edge.
    fn place(&self, pole: usize) -> DVec2 {
        let Domain { u, v } = self.domain;
        let middle = DVec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
        match self.edges.iter().position(|&e| e == Some(pole)) {
            Some(0) => DVec2::new(u[0], middle.y),
            Some(1) => DVec2::new(u[1], middle.y),
            Some(2) => DVec2::new(middle.x, v[0]),
            _ => DVec2::new(middle.x, v[1]),
        }
    }
}

/// The mesh in space of a surface with poles.
fn with_poles(surface: &Surface, domain: DomainMesh, samples: &Samples, poles: &Poles) -> Lifted {
    let mut lifted = Lifted { vertex_of: vec![NONE; domain.uv.len()], ..Lifted::default() };
    let mut uv = Vec::with_capacity(domain.uv.len());
    let mut pole_vertex = [NONE; 2];
    for (k, &p) in domain.uv.iter().enumerate() {
        let pole = poles.at(p);
        if let Some(known) = pole.map(|pole| pole_vertex[pole]).filter(|&known| known != NONE) {
            lifted.vertex_of[k] = known;
            continue;
        }
        let fresh = lifted.mesh.positions.len() as u32;
        lifted.vertex_of[k] = fresh;
        let (place, position, normal) = match pole {
            Some(pole) => {
                pole_vertex[pole] = fresh;
                let place = poles.place(pole);
                (place, surface.point(place.x, place.y), surface.normal(place.x, place.y))
            }
            None => (p, samples.positions[k], samples.normals[k]),
        };
        uv.push(place);
        lifted.mesh.positions.push(position);
        lifted.normals.push(normal);
    }
    lifted.triangle_of.reserve(domain.triangles.len());
    for corners in &domain.triangles {
        let [a, b, c] = corners.map(|k| lifted.vertex_of[k as usize]);
        if a == b || b == c || c == a {
            lifted.triangle_of.push(NONE);
        } else {
            lifted.triangle_of.push(lifted.mesh.triangles.len() as u32);
            lifted.mesh.triangles.push([a, b, c]);
        }
    }
    lifted.mesh.uv = Some(uv);
    lifted.domain = domain;
    lifted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{
        nurbs::shapes,
        triangulation::{Configuration, grid_mesh},
    };

    fn area(mesh: &Mesh) -> impl Iterator<Item = f64> + '_ {
        mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|k| mesh.positions[k as usize]);
            0.5 * (b - a).cross(c - a).length()
        })
    }

    fn lifted(surface: &Surface, m: usize, n: usize) -> Lifted {
        let lines = GridLines::uniform(surface.domain(), m, n);
        lift(surface, grid_mesh(&lines, Configuration::Regular, 0), &lines)
    }

    #[test]
    fn vertices_lie_on_the_surface_and_normals_are_its_normals() {
        let surface = shapes::torus(3.0, 1.0);
        let l = lifted(&surface, 13, 9);
        for (k, p) in l.domain.uv.iter().enumerate() {
            assert!(surface.point(p.x, p.y).distance(l.mesh.positions[k]) < 1e-13);
            assert!(surface.normal(p.x, p.y).distance(l.normals[k]) < 1e-12);
        }
    }

    #[test]
    fn a_seam_stays_a_cut() {
        let l = lifted(&shapes::cylinder(2.0, 5.0), 17, 4);
        assert_eq!(l.mesh.positions.len(), 17 * 4);
        assert_eq!(l.mesh.triangles.len(), 2 * 16 * 3);
        assert!(l.mesh.triangles == l.domain.triangles);
        let ends = [0, 16].map(|k| l.mesh.positions[k]);
        assert!(ends[0].distance(ends[1]) < 1e-12, "the seam's two sides meet in space");
    }

    #[test]
    fn a_pole_is_one_vertex_and_no_triangle_vanishes() {
        let surface = shapes::sphere(2.0);
        let (m, n) = (25, 13);
        let l = lifted(&surface, m, n);
        let poles = surface.degenerate_edges(1e-9).iter().filter(|&&pole| pole).count();
        assert_eq!(poles, 2);
        let along = if surface.degenerate_edges(1e-9)[2] { m } else { n };
        assert_eq!(l.mesh.positions.len(), m * n - 2 * (along - 1));
        assert_eq!(l.mesh.triangles.len(), 2 * (m - 1) * (n - 1) - 2 * (along - 1));
        let mean = area(&l.mesh).sum::<f64>() / l.mesh.triangles.len() as f64;
        assert!(area(&l.mesh).all(|a| a > 1e-3 * mean));
        assert_eq!(l.normals.len(), l.mesh.positions.len());
        assert!(l.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12));
        for (t, &to) in l.triangle_of.iter().enumerate() {
            let corners = l.domain.triangles[t].map(|k| l.vertex_of[k as usize]);
            let vanished = corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
            assert_eq!(vanished, to == NONE);
            assert!(vanished || l.mesh.triangles[to as usize] == corners);
        }
    }

    #[test]
    fn a_few_vertices_of_a_large_grid_are_evaluated_alike() {
        let surface = shapes::sphere(1.0);
        let lines = GridLines::uniform(surface.domain(), 200, 100);
        let uv = vec![
            DVec2::new(lines.u[3], lines.v[90]),
            DVec2::new(lines.u[150], lines.v[7]),
            DVec2::new(0.5 * (lines.u[3] + lines.u[4]), lines.v[50]),
        ];
        let l = lift(&surface, DomainMesh { uv: uv.clone(), triangles: vec![[0, 1, 2]] }, &lines);
        for (k, p) in uv.iter().enumerate() {
            assert_eq!(l.mesh.positions[k], surface.point(p.x, p.y));
        }
    }
}
