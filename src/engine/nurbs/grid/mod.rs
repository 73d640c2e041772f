//! Whole grids of surface points as tensor products: positions, normals and derivatives.
//!
//! Basis functions are formed once a row and once a column, the net is contracted along v first, and the remaining sums
//! run over blocks of columns side by side ([`columns`]). Sample `(i, j)` stands at `j * nu + i`: the vertex numbering of
//! a grid mesh. Parameters need not be in order (blocks are longest when they are) and are clamped to the domain.
//! Degenerate points get the limit normal of [`Surface::normal`].

mod columns;

use glam::DVec3;

use self::columns::{LANES, Lanes, Tile, combine, sweep};
use super::{Surface, SurfaceDerivatives};

/// Points of a grid with their unit normals. Reuse one to save its allocations.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GridSamples {
    /// Columns.
    pub nu: usize,
    /// Rows.
    pub nv: usize,
    /// Points, `nu * nv`, sample `(i, j)` at `j * nu + i`.
    pub positions: Vec<DVec3>,
    /// Unit normals, in the same order. Empty when only positions were asked for.
    pub normals: Vec<DVec3>,
}

/// Points of a grid with their first derivatives, in the order of [`GridSamples`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FirstDerivatives {
    /// Points.
    pub s: Vec<DVec3>,
    /// dS/du.
    pub su: Vec<DVec3>,
    /// dS/dv.
    pub sv: Vec<DVec3>,
}

impl Surface {
    /// Points and unit normals at all pairs of `us` and `vs`, into `samples` (whose buffers are reused).
    pub fn grid(&self, us: &[f64], vs: &[f64], samples: &mut GridSamples) {
        samples.resize(us.len(), vs.len(), true);
        let least = self.degenerate_area().powi(2);
        let rational = self.weights().is_some();
        sweep::<2>(self, us, vs, |tile| {
            let degenerate =
                if rational { rational_tile(tile, least, samples) } else { polynomial_tile(tile, least, samples) };
            if degenerate {
                self.mend_normals(tile, us, vs, samples);
            }
        });
    }

    /// Points alone at all pairs of `us` and `vs`.
    pub fn grid_positions(&self, us: &[f64], vs: &[f64], samples: &mut GridSamples) {
        samples.resize(us.len(), vs.len(), false);
        let rational = self.weights().is_some();
        sweep::<1>(self, us, vs, |tile| {
            let mut a = [[0.0; LANES]; 4];
            combine(tile.functions[0], tile.lines[0], tile.block.len, &mut a);
            if rational {
                let w = a[3];
                for sum in a.iter_mut().take(3) {
                    for (x, w) in sum.iter_mut().zip(&w) {
                        *x /= w;
                    }
                }
            }
            scatter(&[a[0], a[1], a[2]], &mut samples.positions[tile.range(us.len())]);
        });
    }

    /// Points and first derivatives at all pairs of `us` and `vs`.
    pub fn grid_first_derivatives(&self, us: &[f64], vs: &[f64], samples: &mut FirstDerivatives) {
        let count = us.len() * vs.len();
        for list in [&mut samples.s, &mut samples.su, &mut samples.sv] {
            list.resize(count, DVec3::ZERO);
        }
        let rational = self.weights().is_some();
        sweep::<2>(self, us, vs, |tile| {
            let range = tile.range(us.len());
            let [mut a, mut au, mut av] = tile.sums::<4>();
            if rational {
                divide(&mut a, &mut au, &mut av);
            }
            scatter(&[a[0], a[1], a[2]], &mut samples.s[range.clone()]);
            scatter(&[au[0], au[1], au[2]], &mut samples.su[range.clone()]);
            scatter(&[av[0], av[1], av[2]], &mut samples.sv[range]);
        });
    }

    /// Points with first and second derivatives at all pairs of `us` and `vs`.
    pub fn grid_derivatives(&self, us: &[f64], vs: &[f64], samples: &mut Vec<SurfaceDerivatives>) {
        samples.resize(us.len() * vs.len(), SurfaceDerivatives::default());
        let rational = self.weights().is_some();
        sweep::<3>(self, us, vs, |tile| {
            // Orders along (u, v) of S, Su, Sv, Suu, Suv, Svv.
            let mut sums = [[[0.0; LANES]; 4]; 6];
            for (sum, (u, v)) in sums.iter_mut().zip([(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]) {
                combine(tile.functions[u], tile.lines[v], tile.block.len, sum);
            }
            for (lane, out) in samples[tile.range(us.len())].iter_mut().enumerate() {
                let at = std::array::from_fn(|k| {
                    let s = &sums[k];
                    (DVec3::new(s[0][lane], s[1][lane], s[2][lane]), s[3][lane])
                });
                *out = SurfaceDerivatives::from_weighted(at, rational);
            }
        });
    }

    /// Replaces the normals of a tile's degenerate points by their limits.
    #[cold]
    fn mend_normals(&self, tile: &Tile<'_, 2>, us: &[f64], vs: &[f64], samples: &mut GridSamples) {
        for (lane, n) in samples.normals[tile.range(us.len())].iter_mut().enumerate() {
            *n = self.normal(us[tile.block.start + lane], vs[tile.row]);
        }
    }
}

impl GridSamples {
    /// Makes room for `nu * nv` samples.
    fn resize(&mut self, nu: usize, nv: usize, normals: bool) {
        self.nu = nu;
        self.nv = nv;
        self.positions.resize(nu * nv, DVec3::ZERO);
        self.normals.resize(if normals { nu * nv } else { 0 }, DVec3::ZERO);
    }
}

impl<const ORDERS: usize> Tile<'_, ORDERS> {
    /// Where the tile's samples stand in a grid of `nu` columns.
    fn range(&self, nu: usize) -> std::ops::Range<usize> {
        let start = self.row * nu + self.block.start;
        start..start + self.block.len
    }
}

impl Tile<'_, 2> {
    /// Sums for the point and its derivatives along u and v.
    #[inline]
    fn sums<const C: usize>(&self) -> [[Lanes; C]; 3] {
        let mut out = [[[0.0; LANES]; C]; 3];
        combine(self.functions[0], self.lines[0], self.block.len, &mut out[0]);
        combine(self.functions[1], self.lines[0], self.block.len, &mut out[1]);
        combine(self.functions[0], self.lines[1], self.block.len, &mut out[2]);
        out
    }
}

/// Points and normals of a tile that is not rational. True when some point is degenerate.
fn polynomial_tile(tile: &Tile<'_, 2>, least: f64, samples: &mut GridSamples) -> bool {
    let [s, su, sv] = tile.sums::<3>();
    let range = tile.range(samples.nu);
    scatter(&s, &mut samples.positions[range.clone()]);
    let (n, squares) = normals(&su, &sv);
    scatter(&n, &mut samples.normals[range]);
    squares[..tile.block.len].iter().any(|&q| q <= least)
}

/// Points and normals of a rational tile. True when some point is degenerate.
fn rational_tile(tile: &Tile<'_, 2>, least: f64, samples: &mut GridSamples) -> bool {
    let [mut a, mut au, mut av] = tile.sums::<4>();
    divide(&mut a, &mut au, &mut av);
    let range = tile.range(samples.nu);
    scatter(&[a[0], a[1], a[2]], &mut samples.positions[range.clone()]);
    let (n, squares) = normals(&[au[0], au[1], au[2]], &[av[0], av[1], av[2]]);
    scatter(&n, &mut samples.normals[range]);
    squares[..tile.block.len].iter().any(|&q| q <= least)
}

/// The quotient rule on a tile: weighted sums become the point and its first derivatives.
#[inline]
fn divide(a: &mut [Lanes; 4], au: &mut [Lanes; 4], av: &mut [Lanes; 4]) {
    let mut over = [0.0; LANES];
    for lane in 0..LANES {
        over[lane] = 1.0 / a[3][lane];
    }
    for c in 0..3 {
        for lane in 0..LANES {
            let s = a[c][lane] * over[lane];
            a[c][lane] = s;
            au[c][lane] = (au[c][lane] - s * au[3][lane]) * over[lane];
            av[c][lane] = (av[c][lane] - s * av[3][lane]) * over[lane];
        }
    }
}

/// Unit normals of a tile and the squared lengths of `su x sv`.
#[inline]
fn normals(su: &[Lanes; 3], sv: &[Lanes; 3]) -> ([Lanes; 3], Lanes) {
    let mut n = [[0.0; LANES]; 3];
    let mut squares = [0.0; LANES];
    for lane in 0..LANES {
        let x = su[1][lane] * sv[2][lane] - su[2][lane] * sv[1][lane];
        let y = su[2][lane] * sv[0][lane] - su[0][lane] * sv[2][lane];
        let z = su[0][lane] * sv[1][lane] - su[1][lane] * sv[0][lane];
        let square = x * x + y * y + z * z;
        let over = 1.0 / square.sqrt();
        n[0][lane] = x * over;
        n[1][lane] = y * over;
        n[2][lane] = z * over;
        squares[lane] = square;
    }
    (n, squares)
}

/// Writes the first lanes as vectors.
#[inline]
fn scatter(lanes: &[Lanes; 3], out: &mut [DVec3]) {
    for (lane, p) in out.iter_mut().enumerate().take(LANES) {
        *p = DVec3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane]);
    }
}
