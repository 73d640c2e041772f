//! Factors and solutions against the matrices that they come from.

#![expect(clippy::needless_range_loop, reason = "rows and columns are indices of several arrays, as in the formulae")]

use glam::DVec3;
use proptest::prelude::*;

use super::{Factor, Graph, Matrix, Symbolic};
use crate::engine::budget::Unobserved;
use crate::engine::mesh::test_meshes::{Diagonal, grid_triangles};

fn places(m: usize, n: usize) -> Vec<DVec3> {
    (0..m * n).map(|v| DVec3::new((v % m) as f64, (v / m) as f64, 0.3 * ((v * v) % 7) as f64)).collect()
}

/// Edges of a grid, each once.
fn edges(m: usize, n: usize) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = grid_triangles(m, n, Diagonal::Diamond)
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Fills a matrix: every edge's block as given (in the direction lesser to greater vertex), diagonals on top.
fn fill<const D: usize>(
    symbolic: &Symbolic<D>,
    edges: &[[u32; 2]],
    blocks: &[[[f64; D]; D]],
    diagonal: f64,
) -> Matrix<D> {
    let mut matrix = symbolic.matrix();
    for (&[a, b], block) in edges.iter().zip(blocks) {
        let [i, j] = [a, b].map(|v| symbolic.rank[v as usize]);
        let target = &mut matrix.below[symbolic.block(i.max(j), i.min(j)).unwrap() as usize];
        for c in 0..D {
            for r in 0..D {
                target[c][r] = if i < j { block[c][r] } else { block[r][c] };
            }
        }
    }
    for (v, block) in matrix.diagonal.iter_mut().enumerate() {
        for (d, column) in block.iter_mut().enumerate() {
            column[d] = diagonal + (v % 3) as f64 + d as f64;
        }
    }
    matrix
}

fn product<const D: usize>(
    symbolic: &Symbolic<D>,
    edges: &[[u32; 2]],
    matrix: &Matrix<D>,
    x: &[[f64; D]],
) -> Vec<[f64; D]> {
    let mut y = vec![[0.0; D]; x.len()];
    for v in 0..x.len() {
        for c in 0..D {
            for r in 0..D {
                y[v][r] += matrix.diagonal[v][c][r] * x[v][c];
            }
        }
    }
    for &[a, b] in edges {
        let [i, j] = [a, b].map(|v| symbolic.rank[v as usize]);
        let (row, column) = (i.max(j), i.min(j));
        let block = matrix.below[symbolic.block(row, column).unwrap() as usize];
        let (row, column) = (row as usize, column as usize);
        for c in 0..D {
            for r in 0..D {
                y[row][r] += block[c][r] * x[column][c];
                y[column][c] += block[c][r] * x[row][r];
            }
        }
    }
    y
}

fn residual<const D: usize>(m: usize, n: usize, edges: &[[u32; 2]], numbers: &[f64]) -> f64 {
    let symbolic =
        Symbolic::<D>::new(&places(m, n), &Graph::of_edges(m * n, edges.iter().copied()), &Unobserved).unwrap();
    let number = |k: usize| numbers[k % numbers.len()];
    let blocks: Vec<[[f64; D]; D]> =
        (0..edges.len()).map(|e| std::array::from_fn(|c| std::array::from_fn(|r| number(7 * e + 3 * c + r)))).collect();
    // At most eight neighbours with entries up to 1: diagonally dominant.
    let mut matrix = fill(&symbolic, edges, &blocks, 8.0 * D as f64 + 1.0);
    let mut factor = Factor::new(&symbolic);
    factor.factorise(&symbolic, &mut matrix, (0, &mut |_, _| panic!("it is positive")), &Unobserved).unwrap();
    let right: Vec<[f64; D]> = (0..m * n).map(|v| std::array::from_fn(|d| number(v + 11 * d))).collect();
    let mut x = right.clone();
    factor.solve(&symbolic, &mut x);
    let found = product(&symbolic, edges, &matrix, &x);
    found.as_flattened().iter().zip(right.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn solutions_solve_their_systems(
        m in 1_usize..40, n in 1_usize..30, numbers in proptest::collection::vec(-1.0..1.0_f64, 101),
    ) {
        let edges = if m > 1 && n > 1 { edges(m, n) } else { Vec::new() };
        prop_assert!(residual::<1>(m, n, &edges, &numbers) < 1e-12);
        prop_assert!(residual::<2>(m, n, &edges, &numbers) < 1e-12);
    }

    #[test]
    fn graphs_that_fall_apart_are_factorised_too(keep in 2_usize..9, numbers in proptest::collection::vec(-1.0..1.0_f64, 31)) {
        let few: Vec<_> = edges(24, 17).into_iter().enumerate().filter(|(e, _)| e % 9 >= keep).map(|(_, e)| e).collect();
        prop_assert!(residual::<2>(24, 17, &few, &numbers) < 1e-12);
    }
}

#[test]
fn a_matrix_that_is_not_positive_is_found_out() {
    let (m, n) = (20, 15);
    let edges = edges(m, n);
    let graph = Graph::of_edges(m * n, edges.iter().copied());
    let symbolic = Symbolic::<1>::new(&places(m, n), &graph, &Unobserved).unwrap();
    let mut factor = Factor::new(&symbolic);
    // The Laplacian is singular by one; shifted down it has a negative eigenvalue more.
    let blocks = vec![[[-1.0]]; edges.len()];
    let mut matrix = fill(&symbolic, &edges, &blocks, 0.0);
    for v in 0..m * n {
        matrix.diagonal[v] = [[graph.of(symbolic.order[v]).len() as f64 + 1e-6]];
    }
    let mut asked = |matrix: &mut Matrix<1>, allowed: usize| {
        let mut ranges = Vec::new();
        let mut repair = |range: std::ops::Range<u32>, _: &mut Matrix<1>| {
            ranges.push(range);
            false
        };
        factor.factorise(&symbolic, matrix, (allowed, &mut repair), &Unobserved).unwrap();
        ranges
    };
    assert_eq!(asked(&mut matrix, 0), []);
    for block in &mut matrix.diagonal {
        block[0][0] -= 1e-3;
    }
    // The last front fails, into which everything went.
    let found = asked(&mut matrix, 0);
    assert!(found.len() == 1 && found[0] == (0..(m * n) as u32));
    assert_eq!(asked(&mut matrix, 1), [], "one unknown is held, the rest is positive");
}

#[test]
fn a_matrix_is_repaired_where_it_is_not_positive_and_nowhere_else() {
    let (m, n) = (40, 30);
    let edges = edges(m, n);
    let symbolic =
        Symbolic::<2>::new(&places(m, n), &Graph::of_edges(m * n, edges.iter().copied()), &Unobserved).unwrap();
    let blocks = vec![[[-1.0, 0.2], [0.1, -1.0]]; edges.len()];
    let sound = fill(&symbolic, &edges, &blocks, 20.0);
    for spoilt in [0_usize, 417, m * n - 1] {
        let mut matrix = sound.clone();
        matrix.diagonal[spoilt][1][1] = -3.0;
        let mut ranges = Vec::new();
        let mut repair = |range: std::ops::Range<u32>, matrix: &mut Matrix<2>| {
            assert!(range.contains(&(spoilt as u32)));
            matrix.diagonal[spoilt] = sound.diagonal[spoilt];
            ranges.push(range);
            ranges.len() == 1
        };
        let mut factor = Factor::new(&symbolic);
        factor.factorise(&symbolic, &mut matrix, (0, &mut repair), &Unobserved).unwrap();
        assert_eq!(ranges.len(), 1, "the first repair was enough");
        let right: Vec<[f64; 2]> = (0..m * n).map(|v| [v as f64, 1.0]).collect();
        let mut x = right.clone();
        factor.solve(&symbolic, &mut x);
        let found = product(&symbolic, &edges, &sound, &x);
        let error = found.as_flattened().iter().zip(right.as_flattened()).map(|(a, b)| (a - b).abs());
        assert!(error.fold(0.0, f64::max) < 1e-9);
    }
}

#[test]
fn the_factor_of_a_grid_stays_sparse() {
    for m in [31, 61, 121] {
        let graph = Graph::of_edges(m * m, edges(m, m).iter().copied());
        let symbolic = Symbolic::<1>::new(&places(m, m), &graph, &Unobserved).unwrap();
        let bound = (m * m) as f64 * 5.0 * ((m * m) as f64).log2();
        assert!((symbolic.len as f64) < bound, "{m}: {} of {bound}", symbolic.len);
    }
}

#[test]
fn vertices_at_one_place_are_divided_all_the_same() {
    let (m, n) = (30, 20);
    let edges = edges(m, n);
    let graph = Graph::of_edges(m * n, edges.iter().copied());
    for places in [vec![DVec3::ZERO; m * n], vec![DVec3::NAN; m * n]] {
        let symbolic = Symbolic::<1>::new(&places, &graph, &Unobserved).unwrap();
        let mut order = symbolic.order.clone();
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(k, &v)| k == v as usize));
    }
}
