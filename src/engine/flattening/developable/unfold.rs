//! A mesh whose angle defects vanish, laid flat triangle by triangle.
//!
//! Every interior vertex's angles sum to a full turn exactly when the mesh is intrinsically flat; then it does not matter
//! in which order its triangles are unfolded over their edges, and no length changes. Each triangle keeps its corners in a
//! frame of its own, computed from its edges in space; a frame is turned by the two directions of the edge over which it
//! is reached. So directions lose one rounding a step however small the triangle is, and a fine mesh stays as exact as a
//! coarse one. Triangles are reached breadth first, piece by piece. The strain is measured afterwards on all triangles, so
//! a mesh with holes whose sides do not meet (a closed cylinder that is not cut) is found out.
//!
//! Limits: a mesh whose vertices were sampled from a smooth developable surface is flat only if its edges follow the
//! rulings; else its defects are small but not zero and it is a matter of least distortion.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::engine::budget::Observer;
use crate::engine::distortion::TriangleStrain;
use crate::engine::error::EngineError;
use crate::engine::mesh::topology::{NONE, next, prev};
use crate::engine::mesh::{Mesh, Topology, measures};

/// The angles around an interior vertex may miss a full turn by so much, rad. A strain of about this size is left where
/// they do, so that the measured strain decides; larger values only mean that hopeless meshes are unfolded for nothing.
const ANGLE_DEFECT: f64 = 1e-7;

/// Strain up to which an unfolded mesh counts as exact: above what rounding leaves on a million triangles, below
/// everything that a cutter or a file can show.
pub const UNFOLDED_STRAIN: f64 = 1e-10;

/// Triangles between two questions whether to go on.
const BETWEEN_CHECKS: usize = 1 << 14;

/// A mesh in the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfolded {
    /// A place for each vertex; vertices of no triangle stand at the origin.
    pub flat: Vec<DVec2>,
    /// The greatest `|s - 1|` of the triangles' singular values `s`.
    pub strain: f64,
}

/// Lays a mesh flat whose angle defects vanish and whose triangles keep their shape up to a strain of `tolerance` (usually
/// [`UNFOLDED_STRAIN`]). `None` for others. Pieces keep no distance from each other.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub fn unfold(
    mesh: &Mesh,
    topology: &Topology,
    tolerance: f64,
    observer: &dyn Observer,
) -> Result<Option<Unfolded>, EngineError> {
    if !is_flat(mesh, topology) {
        return Ok(None);
    }
    observer.check()?;
    let count = mesh.triangles.len();
    let mut flat = vec![DVec2::ZERO; mesh.positions.len()];
    let mut placed = vec![false; mesh.positions.len()];
    let mut turn = vec![DVec2::ZERO; count];
    let mut order: Vec<u32> = Vec::with_capacity(count);
    let mut done = 0;
    for root in 0..count as u32 {
        if turn[root as usize] != DVec2::ZERO {
            continue;
        }
        turn[root as usize] = DVec2::X;
        order.push(root);
        while let Some(&t) = order.get(done) {
            if done.is_multiple_of(BETWEEN_CHECKS) {
                observer.check()?;
            }
            done += 1;
            let own = frame(mesh, t);
            place(mesh, t, own, turn[t as usize], &mut flat, &mut placed);
            for h in [3 * t, 3 * t + 1, 3 * t + 2] {
                let twin = topology.twin(h);
                if twin == NONE || turn[(twin / 3) as usize] != DVec2::ZERO {
                    continue;
                }
                let there = frame(mesh, twin / 3);
                let (Some(here), Some(across)) = (direction(own, h), direction(there, twin)) else { return Ok(None) };
                // The twin runs the other way.
                let relative = -across;
                let step = DVec2::new(relative.x, -relative.y).rotate(here).rotate(turn[t as usize]);
                turn[(twin / 3) as usize] = step.normalize_or(DVec2::X);
                order.push(twin / 3);
            }
        }
    }
    let mut strain = 0.0_f64;
    for t in 0..count as u32 {
        let plane = mesh.triangles[t as usize].map(|v| flat[v as usize]);
        let Some(s) = TriangleStrain::new(measures::corners(mesh, t), plane) else { return Ok(None) };
        let upright = (plane[1] - plane[0]).perp_dot(plane[2] - plane[0]) > 0.0;
        strain = strain.max(if upright { (s.s1 - 1.0).abs().max((s.s2 - 1.0).abs()) } else { f64::INFINITY });
    }
    Ok((strain <= tolerance).then_some(Unfolded { flat, strain }))
}

/// A triangle's corners in the frame along its first edge, from its first corner.
fn frame(mesh: &Mesh, t: u32) -> [DVec2; 3] {
    let [a, b, c] = measures::corners(mesh, t);
    let (ab, ac) = (b - a, c - a);
    let length = ab.length();
    [DVec2::ZERO, DVec2::new(length, 0.0), DVec2::new(ac.dot(ab), ab.cross(ac).length()) / length]
}

/// Unit direction of a half-edge in its triangle's frame.
fn direction(corners: [DVec2; 3], halfedge: u32) -> Option<DVec2> {
    (corners[(next(halfedge) % 3) as usize] - corners[(halfedge % 3) as usize]).try_normalize()
}

/// Places those corners of a triangle that have no place yet, from the first that has one.
fn place(mesh: &Mesh, t: u32, own: [DVec2; 3], turn: DVec2, flat: &mut [DVec2], placed: &mut [bool]) {
    let corners = mesh.triangles[t as usize].map(|v| v as usize);
    let anchor = (0..3).find(|&k| placed[corners[k]]).unwrap_or(0);
    placed[corners[anchor]] = true;
    for k in 0..3 {
        if !placed[corners[k]] {
            placed[corners[k]] = true;
            flat[corners[k]] = flat[corners[anchor]] + turn.rotate(own[k] - own[anchor]);
        }
    }
}

/// Whether the angles around every interior vertex make a full turn.
fn is_flat(mesh: &Mesh, topology: &Topology) -> bool {
    let mut angles = vec![0.0; mesh.positions.len()];
    let mut border = vec![false; mesh.positions.len()];
    for t in 0..mesh.triangles.len() as u32 {
        let corners = measures::corners(mesh, t);
        for k in 0..3 {
            let h = 3 * t + k;
            let v = topology.origin(h) as usize;
            let (p, q, r) = (corners[k as usize], corners[(next(h) % 3) as usize], corners[(prev(h) % 3) as usize]);
            angles[v] += (q - p).cross(r - p).length().atan2((q - p).dot(r - p));
            if topology.twin(h) == NONE {
                border[v] = true;
                border[topology.target(h) as usize] = true;
            }
        }
    }
    angles.iter().zip(&border).all(|(&a, &b)| b || a == 0.0 || (a - TAU).abs() <= ANGLE_DEFECT)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::engine::budget::Unobserved;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};

    fn unfolded(mesh: &Mesh) -> Option<Unfolded> {
        unfold(mesh, &Topology::new(mesh).unwrap(), UNFOLDED_STRAIN, &Unobserved).unwrap()
    }

    /// A strip of cells between two rulings each: `n` points across, 2 along.
    fn ruled(n: usize, point: impl Fn(f64, f64) -> DVec3) -> Mesh {
        grid(n, 2, Diagonal::Regular, point)
    }

    #[test]
    fn a_cylinder_and_a_cone_that_are_meshed_along_their_rulings_unfold_exactly() {
        let cylinder = ruled(200, |u, v| DVec3::new(20.0 * (3.0 * u).cos(), 20.0 * (3.0 * u).sin(), 50.0 * v));
        let flat = unfolded(&cylinder).expect("flat");
        assert!(flat.strain < 1e-12, "{:e}", flat.strain);
        // The two long borders are as far apart as the chords are long together.
        let chords = 199.0 * 2.0 * 20.0 * (3.0_f64 / 199.0 / 2.0).sin();
        let end = flat.flat[199].distance(flat.flat[0]);
        assert!((end - chords).abs() < 1e-11, "{end} {chords}");
        let cone = ruled(90, |u, v| {
            let r = 5.0 + 20.0 * v;
            DVec3::new(r * (PI * u).cos(), r * (PI * u).sin(), 2.0 * r)
        });
        assert!(unfolded(&cone).expect("flat").strain < 1e-12);
    }

    #[test]
    fn a_million_triangles_of_a_folded_sheet_stay_exact() {
        // A plane with sharp folds along its columns, finely meshed.
        let fold = |u: f64| {
            (100.0 * u, if ((10.0 * u) as u32).is_multiple_of(2) { 10.0 * u % 1.0 } else { 1.0 - 10.0 * u % 1.0 })
        };
        let mesh = grid(701, 701, Diagonal::Regular, |u, v| {
            let (x, z) = fold(u);
            DVec3::new(x, 80.0 * v, 3.0 * z)
        });
        let flat = unfolded(&mesh).expect("flat");
        assert!(flat.strain < UNFOLDED_STRAIN, "{:e}", flat.strain);
    }

    #[test]
    fn what_is_curved_or_closed_is_not_unfolded() {
        let dome = grid(12, 12, Diagonal::Regular, |u, v| DVec3::new(u, v, 0.1 * (u * u + v * v)));
        assert_eq!(unfolded(&dome), None);
        // A prism without lids has no interior vertex with a defect, but it does not lie flat without a cut.
        let n = 8_u32;
        let at = |k: u32, z: f64| DVec3::new((f64::from(k) * PI / 4.0).cos(), (f64::from(k) * PI / 4.0).sin(), z);
        let positions = (0..n).map(|k| at(k, 0.0)).chain((0..n).map(|k| at(k, 1.0))).collect();
        let triangles = (0..n).flat_map(|k| [[k, (k + 1) % n, n + k], [(k + 1) % n, n + (k + 1) % n, n + k]]).collect();
        assert_eq!(unfolded(&Mesh { positions, uv: None, triangles }), None);
    }

    proptest! {
        #[test]
        fn a_turned_plane_comes_back_with_all_its_distances(
            heights in proptest::collection::vec(0.1..1.0_f64, 9), angle in 0.0..6.0_f64, tilt in -1.5..1.5_f64
        ) {
            let bent = |u: f64, v: f64| DVec2::new(u + 0.3 * v * heights[(8.0 * u) as usize], v * (1.0 + 0.2 * u));
            let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, tilt, angle, 0.4);
            let mesh = grid(7, 6, Diagonal::Regular, |u, v| turn * bent(u, v).extend(0.0));
            prop_assume!((0..mesh.triangles.len() as u32).all(|t| {
                let [a, b, c] = measures::corners(&mesh, t);
                (turn.inverse() * (b - a).cross(c - a)).z > 1e-3
            }));
            let flat = unfolded(&mesh).expect("a plane");
            for (p, q) in mesh.positions.iter().zip(&flat.flat) {
                let (space, plane) = (p.distance(mesh.positions[0]), q.distance(flat.flat[0]));
                prop_assert!((space - plane).abs() < 1e-12);
            }
        }
    }
}
