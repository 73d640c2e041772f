//! Geometry: pure, synchronous, `f64`. Values and typed errors come out; there is no I/O, clock, thread or global here.
//!
//! # Conventions
//! - Lengths are millimetres, areas square millimetres, angles radians unless a name says otherwise (`_percent`, `_deg`).
//! - `S(u, v)` is a surface, `Su`, `Sv`, ... its derivatives, `n` its unit normal `Su x Sv / |Su x Sv|`.
//! - A *mesh* is a 3D triangulation; a *flattening* gives its vertices 2D positions; a *pattern* is what is cut.
//! - Triangles are anticlockwise seen from the side that `n` points to; in the domain (u right, v up) likewise.
//! - Half-edge `3 * t + e` runs from corner `e` to corner `(e + 1) % 3` of triangle `t`.
//! - Inside the engine a map goes from 3D to 2D with singular values `s1 >= s2`. Strain as users read it has the
//!   opposite direction: `strain_percent = 100 (1 / s - 1)`, positive where the material is stretched onto the part.
//!
//! # The pipeline
//! [`pipeline`] is the whole way in six steps: trimming loops are polygonised and nested ([`trimming`]); a density is
//! chosen and the domain triangulated ([`triangulation`]); the mesh is lifted to 3D; a seed is found ([`seed`]) and the
//! mesh flattened ([`flattening`]); the distortion is measured ([`distortion`]); the loops are mapped on ([`pattern`]).

pub(crate) mod boxes;
pub mod budget;
pub mod curvature;
pub mod distortion;
pub mod error;
pub mod flattening;
pub mod job;
pub mod mesh;
pub mod nurbs;
pub mod pattern;
pub mod pipeline;
pub mod seed;
pub mod sewing;
pub mod triangulation;
pub mod trimming;
