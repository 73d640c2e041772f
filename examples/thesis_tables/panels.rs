//! Stand-ins for the untrimmed surfaces of chapters 5 and 6, and their meshes.
//!
//! The backlight and the windscreen are smooth bicubic panels with the areas that the thesis prints (362035 and
//! 475724 mm^2), bent along u and slightly along v. Their cross curvature was chosen by whoever made them so that one
//! reading of Cader's method gives the regular configuration's printed area change: that this figure comes out near says
//! nothing, and the tables do not rest on it. The sheet of 5.2.1 is ours, of no known area.

use anyhow::Result;
use glam::DVec3;
use planish::engine::budget::Unobserved;
use planish::engine::mesh::Mesh;
use planish::engine::nurbs::{Domain, Surface};
use planish::engine::triangulation::{
    Configuration, DomainMesh, GridLines, fitted_mesh, grid_mesh, grid_mesh_by, lift, random_mesh,
};

use crate::shapes::{Sheet, knots};

/// A surface that is triangulated whole.
pub(crate) struct Panel {
    pub(crate) name: &'static str,
    pub(crate) surface: Surface,
    /// Points along u and v.
    pub(crate) points: [usize; 2],
}

/// How the cells of a grid are split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Diagonals {
    Named(Configuration),
    /// By chance.
    Random(u32),
    /// The same mirrored in u, as in Figure 5.19.
    Mirrored(u32),
    /// By chance, but `\\` only with odds of one to `2^sparsity`.
    Sparse {
        seed: u32,
        sparsity: u32,
    },
}

/// Seeds of sparse diagonals stay apart by this.
const SPARSE_SEEDS: u32 = 1000;

/// The configurations of Tables 5.5 to 5.8 in their order; the thesis does not say which of the two chevrons it means.
pub(crate) const COMPARED: [(&str, Diagonals); 5] = [
    ("Chevron (rows)", Diagonals::Named(Configuration::ChevronRows)),
    ("Chevron (columns)", Diagonals::Named(Configuration::ChevronColumns)),
    ("Diamond", Diagonals::Named(Configuration::Diamond)),
    ("Regular", Diagonals::Named(Configuration::Regular)),
    ("RATC Optimised", Diagonals::Named(Configuration::Fitted)),
];

impl Panel {
    /// The same with other densities.
    pub(crate) fn with_points(self, points: [usize; 2]) -> Self {
        Self { points, ..self }
    }

    pub(crate) fn lines(&self) -> GridLines {
        GridLines::uniform(self.surface.domain(), self.points[0], self.points[1])
    }

    /// The mesh in space; its triangles are numbered cell by cell, its `uv` are filled.
    pub(crate) fn mesh(&self, diagonals: Diagonals) -> Result<Mesh> {
        let lines = self.lines();
        let domain = match diagonals {
            Diagonals::Named(Configuration::Fitted) => fitted_mesh(&self.surface, &lines, None, &Unobserved)?,
            Diagonals::Named(configuration) => grid_mesh(&lines, configuration, 0),
            Diagonals::Random(seed) => random_mesh(&lines, seed),
            Diagonals::Sparse { seed, sparsity } => {
                // As many fair coins a cell, each of its own seed: all have to fall on `\\`.
                let coins: Vec<DomainMesh> =
                    (0..sparsity).map(|k| random_mesh(&lines, SPARSE_SEEDS * (k + 1) + seed)).collect();
                let columns = self.points[0] - 1;
                grid_mesh_by(&lines, |i, j| coins.iter().all(|coin| is_backslash(coin, columns, i, j)))
            }
            Diagonals::Mirrored(seed) => {
                let (original, columns) = (random_mesh(&lines, seed), self.points[0] - 1);
                grid_mesh_by(&lines, |i, j| !is_backslash(&original, columns, columns - 1 - i, j))
            }
        };
        Ok(lift(&self.surface, domain, &lines).mesh)
    }
}

/// Which way the diagonal of a cell runs: `\\` splits the cell's four corners a, b, c, d into (a, b, d) and (b, c, d).
fn is_backslash(mesh: &DomainMesh, columns: usize, i: usize, j: usize) -> bool {
    let cell = 2 * (j * columns + i);
    mesh.triangles[cell][2] == mesh.triangles[cell + 1][2]
}

/// The car's rear window, 60 x 60 points.
pub(crate) fn backlight() -> Panel {
    Panel { name: "Backlight", surface: of_half_net(&BACKLIGHT), points: [60, 60] }
}

/// The windscreen, 70 x 70 points.
pub(crate) fn windscreen() -> Panel {
    Panel { name: "Windscreen", surface: of_half_net(&WINDSCREEN), points: [70, 70] }
}

/// A sheet of 400 x 300 mm that is plainly not developable, 60 x 60 points: a bulge of some height, mm, more to one side.
pub(crate) fn bulging_sheet(height: f64) -> Panel {
    let sheet = Sheet { degree: 3, count: [7, 7], size: [400.0, 300.0], clamped: true };
    let half_wave = |s: f64| (std::f64::consts::PI * s).sin();
    let surface = sheet.lifted(|s, t| height * half_wave(s) * half_wave(t) * (1.0 + 0.5 * (s - 0.5)));
    Panel { name: "Sheet", surface, points: [60, 60] }
}

/// A saddle of 300 x 300 mm, for curvature of the other sign.
pub(crate) fn saddle() -> Panel {
    let sheet = Sheet { degree: 3, count: [5, 5], size: [300.0, 300.0], clamped: true };
    let surface = sheet.lifted(|s, t| 90.0 * ((s - 0.5).powi(2) - (t - 0.5).powi(2)));
    Panel { name: "Saddle", surface, points: [60, 60] }
}

/// A bicubic surface over the unit square from the control points of u > 1/2; the others are their mirror image in x.
fn of_half_net(half: &[[[f64; 3]; 7]; 4]) -> Surface {
    let mirrored = |row: &[[f64; 3]; 7]| row.map(|[x, y, z]| [-x, y, z]);
    let rows: Vec<[[f64; 3]; 7]> = half.iter().rev().map(mirrored).chain(half.iter().copied()).collect();
    let control = rows.iter().flatten().map(|&p| DVec3::from_array(p)).collect();
    let u = knots(3, vec![0.0, 0.0, 0.0, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 1.0, 1.0]);
    let v = knots(3, vec![0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 1.0]);
    let surface = Surface::new(u, v, control, None).expect("the net is sound");
    debug_assert_eq!(surface.domain(), Domain { u: [0.0, 1.0], v: [0.0, 1.0] });
    surface
}

/// Control points of the backlight, mm: four rows along u, from the middle outwards, of seven along v.
const BACKLIGHT: [[[f64; 3]; 7]; 4] = [
    [
        [69.158_912, -271.198_626, -14.384_258],
        [68.506_469, -225.890_114, -10.741_437],
        [67.201_584, -135.273_092, -5.394_002],
        [65.244_256, 0.652_443, -2.218_372],
        [63.286_929, 136.577_977, -4.857_366],
        [61.982_044, 227.194_999, -9.847_044],
        [61.329_601, 272.503_511, -13.310_987],
    ],
    [
        [207.476_735, -265.979_085, -36.493_024],
        [205.519_408, -220.670_574, -32.115_167],
        [201.604_752, -130.053_551, -25.308_31],
        [195.732_769, 5.871_983, -19.970_164],
        [189.860_786, 141.797_517, -20.478_588],
        [185.946_131, 232.414_54, -24.065_631],
        [183.988_803, 277.723_051, -26.833_58],
    ],
    [
        [299.688_618, -259.599_647, -63.526_485],
        [296.861_366, -214.291_135, -58.250_252],
        [291.206_864, -123.674_113, -49.659_655],
        [282.725_111, 12.251_421, -41.678_436],
        [274.243_358, 148.176_956, -39.582_828],
        [268.588_855, 238.793_978, -41.455_54],
        [265.761_604, 284.102_49, -43.372_831],
    ],
    [
        [345.794_559, -255.540_004, -80.736_261],
        [342.532_346, -210.231_493, -74.888_333],
        [336.007_92, -119.614_47, -65.162_63],
        [326.221_282, 16.311_064, -55.499_454],
        [316.434_643, 152.236_598, -51.746_735],
        [309.910_218, 242.853_621, -52.528_509],
        [306.648_005, 288.162_132, -53.904_472],
    ],
];

/// Control points of the windscreen, likewise.
const WINDSCREEN: [[[f64; 3]; 7]; 4] = [
    [
        [74.148_588, -332.302_927, -8.379_219],
        [73.449_073, -276.785_865, -6.659_824],
        [72.050_043, -165.751_741, -4.098_13],
        [69.951_498, 0.799_446, -2.448_333],
        [67.852_953, 167.350_632, -3.429_829],
        [66.453_923, 278.384_756, -5.545_988],
        [65.754_408, 333.901_819, -7.042_617],
    ],
    [
        [222.445_765, -325.907_362, -33.384_979],
        [220.347_22, -270.390_299, -30.752_97],
        [216.150_13, -159.356_175, -26.377_802],
        [209.854_495, 7.195_011, -22.037_173],
        [203.558_86, 173.746_198, -20.363_093],
        [199.361_77, 284.780_322, -20.728_455],
        [197.263_225, 340.297_384, -21.355_561],
    ],
    [
        [321.310_549, -318.090_559, -63.952_835],
        [318.279_317, -262.573_497, -60.205_41],
        [312.216_854, -151.539_373, -53.613_773],
        [303.123_159, 15.011_814, -45.984_35],
        [294.029_465, 181.563, -41.064_565],
        [287.967_001, 292.597_124, -39.290_063],
        [284.935_77, 348.114_186, -38.854_418],
    ],
    [
        [370.742_941, -313.116_23, -83.408_119],
        [367.245_366, -257.599_168, -78.950_884],
        [360.250_216, -146.565_044, -70.948_767],
        [349.757_492, 19.986_142, -61.226_475],
        [339.264_767, 186.537_329, -54.241_241],
        [332.269_617, 297.571_453, -51.105_008],
        [328.772_042, 353.088_515, -49.993_068],
    ],
];
