//! Sparse Cholesky factorisation of symmetric matrices over the vertices of a mesh, made for being repeated.
//!
//! Method: multifrontal (Duff and Reid 1983) along a nested dissection of the vertices ([`dissection`]). Every separator
//! is one front: a dense panel for its own unknowns and a dense square for what it passes on to its parent. All that
//! depends on the graph alone (order, tree, where each number goes) is found once in [`Symbolic`]; a factorisation then
//! allocates nothing. Each vertex carries `D` unknowns: 1 for Laplacians, 2 for maps into the plane.
//!
//! Memory: the factor of n vertices of a surface has at most about 5 `D^2` n log2 n numbers. Sums run in one order: the same matrix gives
//! the same factor on the same kind of processor. Unknowns without a positive pivot are held still.

mod dissection;
mod kernel;
mod numeric;
mod symbolic;
#[cfg(test)]
mod tests;

pub(crate) use dissection::Graph;
pub(crate) use numeric::Factor;
pub(crate) use symbolic::{Matrix, Symbolic};
