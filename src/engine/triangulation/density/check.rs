//! The judge of a planned grid: distances, edges and areas on the cells that it would really have.
//!
//! Positions are taken on the lines and between them, as a tensor grid: half-way, where a surface that bends one way is
//! farthest from the triangles' edges, and on grids of few cells at the quarters, too, since a large cell may hold an
//! inflection. The distance to the triangle is measured along the cell's own normal.

use glam::DVec3;

use super::needs::{Aim, Diagonals};
use crate::engine::nurbs::{FirstDerivatives, GridSamples, Surface};

/// Cells in one direction up to which all are judged with all of the other's. Beyond it runs of cells are left out evenly:
/// neighbours in so fine a grid differ little, and judging a mesh would cost as much as making it.
const JUDGED: usize = 160;

/// Cells across a finer grid along which every cell of the other direction is judged: lines crowd where curvature is
/// strong, and what even leaps pass over may be just that.
const FOLLOWED: usize = 8;

/// Cells along such a run that are judged at most.
const RUN: usize = 4096;

/// Cells of a grid up to which quarters are looked at: a coarse grid's cells are far from quadratic and cost little.
const FEW: usize = 256;

/// Parameters of one direction that are evaluated, and for each judged cell the index of its start among them; its
/// inner places and its end follow.
struct Judged {
    parameters: Vec<f64>,
    starts: Vec<usize>,
}

impl Judged {
    /// At most `most` (two or more) cells, each divided into `parts`.
    fn new(lines: &[f64], parts: usize, most: usize) -> Self {
        let cells = lines.len() - 1;
        let count = cells.min(most);
        let mut judged =
            Self { parameters: Vec::with_capacity(count * (parts + 1)), starts: Vec::with_capacity(count) };
        for k in 0..count {
            let cell = if cells <= most { k } else { k * (cells - 1) / (most - 1) };
            let (from, to) = (lines[cell], lines[cell + 1]);
            if judged.parameters.last() != Some(&from) {
                judged.parameters.push(from);
            }
            judged.starts.push(judged.parameters.len() - 1);
            judged.parameters.extend((1..parts).map(|p| from + (to - from) * p as f64 / parts as f64));
            judged.parameters.push(to);
        }
        judged
    }
}

/// The worst use of the allowance over the cells between the lines, those that `skip(u, v)` names by their middle aside.
pub(super) fn worst(
    surface: &Surface,
    u: &[f64],
    v: &[f64],
    aim: Aim,
    diagonals: Diagonals,
    skip: &dyn Fn(f64, f64) -> bool,
) -> f64 {
    let parts = match aim {
        Aim::Edge(_) => 1,
        Aim::Chord(_) if (u.len() - 1) * (v.len() - 1) <= FEW => 4,
        Aim::Chord(_) => 2,
    };
    let judge = |cells: [Judged; 2]| worst_of(surface, &cells, parts, aim, diagonals, skip);
    let mut worst = judge([Judged::new(u, parts, JUDGED), Judged::new(v, parts, JUDGED)]);
    if u.len() - 1 > JUDGED {
        worst = worst.max(judge([Judged::new(u, parts, RUN), Judged::new(v, parts, FOLLOWED)]));
    }
    if v.len() - 1 > JUDGED {
        worst = worst.max(judge([Judged::new(u, parts, FOLLOWED), Judged::new(v, parts, RUN)]));
    }
    worst
}

/// The worst use over the judged cells, each divided into `parts`.
fn worst_of(
    surface: &Surface,
    [us, vs]: &[Judged; 2],
    parts: usize,
    aim: Aim,
    diagonals: Diagonals,
    skip: &dyn Fn(f64, f64) -> bool,
) -> f64 {
    let mut samples = GridSamples::default();
    surface.grid_positions(&us.parameters, &vs.parameters, &mut samples);
    let mut worst = 0.0_f64;
    for &j in &vs.starts {
        let row_middle = 0.5 * (vs.parameters[j] + vs.parameters[j + parts]);
        for &i in &us.starts {
            if skip(0.5 * (us.parameters[i] + us.parameters[i + parts]), row_middle) {
                continue;
            }
            let cell = Cell { points: &samples.positions, columns: samples.nu, at: j * samples.nu + i, parts };
            if let Aim::Chord(tolerance) = aim {
                let ends = [0, us.parameters.len() - 1 - parts];
                let border_v = ends.contains(&i).then(|| cell.side(if i == 0 { 0 } else { parts }, false));
                let ends = [0, vs.parameters.len() - 1 - parts];
                let border_u = ends.contains(&j).then(|| cell.side(if j == 0 { 0 } else { parts }, true));
                worst = worst.max(border_u.unwrap_or(0.0).max(border_v.unwrap_or(0.0)) / tolerance);
            }
            worst = worst.max(match aim {
                Aim::Chord(tolerance) => cell.distance(diagonals) / tolerance,
                Aim::Edge(longest) => cell.longest_squared(diagonals) / (longest * longest),
            });
        }
    }
    worst
}

/// The samples of one cell.
struct Cell<'a> {
    points: &'a [DVec3],
    columns: usize,
    at: usize,
    parts: usize,
}

impl Cell<'_> {
    fn point(&self, a: usize, b: usize) -> DVec3 {
        self.points[self.at + b * self.columns + a]
    }

    fn corners(&self) -> [DVec3; 4] {
        let n = self.parts;
        [self.point(0, 0), self.point(n, 0), self.point(n, n), self.point(0, n)]
    }

    /// Greatest distance of a side, the one at `at` of the other direction, to the curve on the surface.
    fn side(&self, at: usize, along_u: bool) -> f64 {
        let point = |k: usize| if along_u { self.point(k, at) } else { self.point(at, k) };
        let (from, to) = (point(0), point(self.parts));
        let chord = (to - from).normalize_or_zero();
        (1..self.parts)
            .map(|k| {
                let d = point(k) - from;
                (d - d.dot(chord) * chord).length()
            })
            .fold(0.0, f64::max)
    }

    /// Greatest distance of the cell's triangles to the surface at the samples.
    fn distance(&self, diagonals: Diagonals) -> f64 {
        let [p00, p10, p11, p01] = self.corners();
        let normal = (p11 - p00).cross(p01 - p10).normalize_or_zero();
        // Without a normal (a cell that closes on itself) the whole distance counts.
        let along = |d: DVec3| if normal == DVec3::ZERO { d.length() } else { d.dot(normal).abs() };
        let mut greatest = 0.0_f64;
        for b in 0..=self.parts {
            for a in 0..=self.parts {
                let (x, y) = (a as f64 / self.parts as f64, b as f64 / self.parts as f64);
                let point = self.point(a, b);
                if diagonals != Diagonals::Falling {
                    let on = p00
                        + if y <= x { x * (p10 - p00) + y * (p11 - p10) } else { y * (p01 - p00) + x * (p11 - p01) };
                    greatest = greatest.max(along(on - point));
                }
                if diagonals != Diagonals::Rising {
                    let on = if x + y <= 1.0 {
                        p00 + x * (p10 - p00) + y * (p01 - p00)
                    } else {
                        p11 + (1.0 - x) * (p01 - p11) + (1.0 - y) * (p10 - p11)
                    };
                    greatest = greatest.max(along(on - point));
                }
            }
        }
        greatest
    }

    /// Square of the cell's longest edge.
    fn longest_squared(&self, diagonals: Diagonals) -> f64 {
        let corners = self.corners();
        let mut square = 0.0_f64;
        for k in 0..4 {
            square = square.max(corners[k].distance_squared(corners[(k + 1) % 4]));
        }
        if diagonals != Diagonals::Falling {
            square = square.max(corners[0].distance_squared(corners[2]));
        }
        if diagonals != Diagonals::Rising {
            square = square.max(corners[1].distance_squared(corners[3]));
        }
        square
    }
}

/// Area of the grid's triangles.
pub(super) fn mesh_area(surface: &Surface, u: &[f64], v: &[f64], diagonals: Diagonals) -> f64 {
    let mut samples = GridSamples::default();
    surface.grid_positions(u, v, &mut samples);
    let columns = u.len();
    let mut sum = 0.0;
    for j in 0..v.len() - 1 {
        for i in 0..columns - 1 {
            let [[a, b], [d, c]] = [j, j + 1].map(|row| [0, 1].map(|k| samples.positions[row * columns + i + k]));
            sum += if diagonals == Diagonals::Falling {
                (b - a).cross(d - a).length() + (b - c).cross(d - c).length()
            } else {
                (b - a).cross(c - a).length() + (c - a).cross(d - a).length()
            };
        }
    }
    0.5 * sum
}

/// Area of the surface between the first and last edges, by Gauss's rule of four points in each strip and direction.
pub(super) fn surface_area(surface: &Surface, u: &[f64], v: &[f64]) -> f64 {
    let nodes = |edges: &[f64]| -> Vec<(f64, f64)> {
        edges
            .windows(2)
            .flat_map(|w| {
                let (middle, half) = (0.5 * (w[0] + w[1]), 0.5 * (w[1] - w[0]));
                GAUSS.map(|(x, weight)| (middle + half * x, half * weight))
            })
            .collect()
    };
    let (us, vs) = (nodes(u), nodes(v));
    let parameters = |nodes: &[(f64, f64)]| nodes.iter().map(|n| n.0).collect::<Vec<f64>>();
    let mut samples = FirstDerivatives::default();
    surface.grid_first_derivatives(&parameters(&us), &parameters(&vs), &mut samples);
    let mut sum = 0.0;
    for (j, (_, dv)) in vs.iter().enumerate() {
        let mut row = 0.0;
        for (i, (_, du)) in us.iter().enumerate() {
            row += du * samples.su[j * us.len() + i].cross(samples.sv[j * us.len() + i]).length();
        }
        sum += dv * row;
    }
    sum
}

/// Gauss's rule of four points on [-1, 1]: (place, weight).
const GAUSS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_2),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_2),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];
