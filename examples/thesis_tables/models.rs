//! Stand-ins for the four trimmed surfaces of thesis 3.6.
//!
//! What the thesis says of each is kept: the kind of surface, the number of loops, the number of cells. The outlines are
//! ours; they are so large that the loops visit about as many cells as the thesis's do at the coarser density. How that
//! number and all others grow, and what triangles come out, is then for the program to say.

use planish::engine::trimming::{Side, TrimLoop, TrimmedSurface};

use crate::shapes::{Profile, Sheet};
use crate::trims::{circle, ellipse, polygon, rounded, smooth};

/// A figure of Tables 3.1 and 3.2: cells, cells traced, per cent, time of tracing in ms, triangles, time of triangulation.
pub(crate) type Row = (u32, u32, f64, f64, u32, f64);

/// A model with the thesis's figures.
pub(crate) struct Model {
    pub(crate) name: &'static str,
    /// Cells along u and v at the density of Table 3.1.
    pub(crate) cells: [usize; 2],
    /// So many times as many in each direction in Table 3.2.
    pub(crate) denser: usize,
    pub(crate) trimmed: TrimmedSurface,
    /// Rows of Tables 3.1 and 3.2.
    pub(crate) printed: [Row; 2],
}

pub(crate) fn all() -> Vec<Model> {
    vec![letter(), lamp(), car_panel(), chassis()]
}

/// A letter G in one loop on a patch of a sphere.
fn letter() -> Model {
    let surface = Profile::arc([0.0, 0.0], 100.0, [-60.0, 60.0]).turned([-80.0, 80.0], 2);
    // Once round: the outer arc, the upper end, the inner arc back, the bar. Ellipses in (u, v), wider along v since
    // there are fewer cells.
    let at = |degrees: f64, radius: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [0.5 + 0.062 * radius * cos, 0.5 + 0.108 * radius * sin]
    };
    let outer = (0..=60).map(|k| at(45.0 + 270.0 * f64::from(k) / 60.0, 1.0));
    let bar = [[0.95, -0.71], [0.95, 0.1], [0.2, 0.1], [0.2, -0.2], [0.62, -0.2], [0.62, -0.45]];
    let bar = bar.map(|[x, y]| [0.5 + 0.062 * x, 0.5 + 0.108 * y]);
    let inner = (0..=40).map(|k| at(310.0 - 265.0 * f64::from(k) / 40.0, 0.62));
    let outline: Vec<[f64; 2]> = outer.chain(bar).chain(inner).collect();
    Model {
        name: "G",
        cells: [56, 32],
        denser: 10,
        trimmed: trimmed(surface, vec![polygon(&outline)]),
        printed: [(1792, 48, 2.68, 2.87, 294, 3.073), (179_200, 446, 0.25, 10.33, 3633, 41.87)],
    }
}

/// A lobed outline with a hole in the middle and one beside it, on half a sphere.
fn lamp() -> Model {
    let surface = Profile::arc([0.0, 0.0], 70.0, [-80.0, 80.0]).turned([0.0, 180.0], 2);
    let lobed: Vec<[f64; 2]> = (0..72)
        .map(|k| {
            let turn = std::f64::consts::TAU * f64::from(k) / 72.0;
            let radius = 0.38 * (1.0 + 0.22 * (9.0 * turn).cos());
            [0.5 + radius * turn.cos(), 0.5 + radius * turn.sin()]
        })
        .collect();
    let loops = vec![smooth(&lobed), ellipse([0.5, 0.5], [0.09, 0.11]), ellipse([0.68, 0.58], [0.04, 0.05])];
    Model {
        name: "Lamp",
        cells: [110, 50],
        denser: 5,
        trimmed: trimmed(surface, loops),
        printed: [(5500, 416, 7.56, 49.54, 5638, 37.34), (137_500, 2066, 1.50, 78.57, 100_819, 371.33)],
    }
}

/// A side panel with a window, on a patch of a sphere.
fn car_panel() -> Model {
    let surface = Profile::arc([0.0, 0.0], 1500.0, [-20.0, 20.0]).turned([-30.0, 30.0], 1);
    let outline = [[0.04, 0.08], [0.96, 0.12], [0.93, 0.6], [0.7, 0.9], [0.3, 0.93], [0.06, 0.66]];
    let window = [[0.34, 0.55], [0.66, 0.53], [0.58, 0.8], [0.38, 0.82]];
    Model {
        name: "Car body",
        cells: [38, 20],
        denser: 10,
        trimmed: trimmed(surface, vec![rounded(&outline, 0.05), rounded(&window, 0.03)]),
        printed: [(760, 128, 16.82, 44.60, 1449, 32.29), (76_000, 1314, 1.73, 64.49, 73_215, 238.30)],
    }
}

/// The plate of a toy car: an outline with wheel arches, a central cut-away, and ten round holes, eight of them so small
/// that each lies in one of the 25 cells (80 x 32 mm).
fn chassis() -> Model {
    let sheet = Sheet { degree: 1, count: [2, 2], size: [400.0, 160.0], clamped: true };
    let outline = [
        [20.0, 40.0],
        [70.0, 40.0],
        [70.0, 56.0],
        [125.0, 56.0],
        [125.0, 30.0],
        [275.0, 30.0],
        [275.0, 56.0],
        [330.0, 56.0],
        [330.0, 40.0],
        [384.0, 40.0],
        [384.0, 120.0],
        [330.0, 120.0],
        [330.0, 104.0],
        [275.0, 104.0],
        [275.0, 130.0],
        [125.0, 130.0],
        [125.0, 104.0],
        [70.0, 104.0],
        [70.0, 120.0],
        [20.0, 120.0],
    ];
    let cut_away = [[172.0, 70.0], [228.0, 70.0], [228.0, 90.0], [172.0, 90.0]];
    let small = [40.0, 100.0, 300.0, 360.0].map(|x| [[x, 72.0], [x, 88.0]]);
    let mut loops = vec![rounded(&outline, 5.0), rounded(&cut_away, 4.0)];
    loops.extend(small.as_flattened().iter().map(|&at| circle(at, 4.0)));
    loops.extend([[160.0, 50.0], [240.0, 110.0]].map(|at| circle(at, 8.0)));
    Model {
        name: "Chassis",
        cells: [5, 5],
        denser: 56,
        trimmed: trimmed(sheet.lifted(|_, _| 0.0), loops),
        printed: [(25, 30, 120.0, 4.33, 344, 25.46), (78_400, 1994, 2.54, 56.42, 72_124, 268.74)],
    }
}

fn trimmed(surface: planish::engine::nurbs::Surface, loops: Vec<TrimLoop>) -> TrimmedSurface {
    TrimmedSurface { surface, loops, side: Side::Normal }
}
