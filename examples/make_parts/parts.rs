//! The sample parts: what they are, their sizes in millimetres, and what each exercises.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use planish::engine::nurbs::Surface;
use planish::engine::trimming::{Side, TrimLoop, TrimmedSurface};
use planish::formats::surface_json;

use super::shapes::{Profile, Sheet};
use super::trims::{circle, ellipse, polygon, rectangle, rounded, smooth};

/// One part and the file that it is written to.
pub(crate) struct Part {
    pub(crate) file: &'static str,
    name: &'static str,
    number: &'static str,
    surface: TrimmedSurface,
}

impl Part {
    fn new(
        file: &'static str,
        name: &'static str,
        number: &'static str,
        surface: Surface,
        loops: Vec<TrimLoop>,
    ) -> Self {
        Self { file, name, number, surface: TrimmedSurface { surface, loops, side: Side::Normal } }
    }

    /// The file's text.
    pub(crate) fn json(&self) -> String {
        let labels = BTreeMap::from([
            ("material".to_owned(), "sample".to_owned()),
            ("part_number".to_owned(), self.number.to_owned()),
        ]);
        surface_json::write(Some(self.name), &labels, &self.surface)
    }
}

/// All parts, in the order of their files.
pub(crate) fn all() -> Vec<Part> {
    vec![
        car_glass(),
        cone_with_holes(),
        cup_decal(),
        f_on_cylinder(),
        gasket(),
        half_cylinder(),
        micro_lens(),
        roof_membrane(),
        saddle(),
        sail_panel(),
        seat_panel(),
        shoe_quarter(),
        sphere_cap(),
        torus_segment(),
    ]
}

/// A bulge that is 1 in the middle and 0 at both ends.
fn bulge(s: f64) -> f64 {
    4.0 * s * (1.0 - s)
}

/// A side window: 820 x 460, 26 mm of bulge along, 18 across; a trapezoid with rounded corners.
fn car_glass() -> Part {
    let sheet = Sheet { degree: 3, count: [5, 5], size: [820.0, 460.0], clamped: true };
    let surface = sheet.lifted(|s, t| 26.0 * bulge(s) + 18.0 * bulge(t));
    let outline = rounded(&[[30.0, 25.0], [790.0, 40.0], [640.0, 425.0], [180.0, 435.0]], 45.0);
    Part::new("car-glass.json", "side window, left", "SW-0820-L", surface, vec![outline])
}

/// Half of a funnel: 120 mm at the foot, 60 at the top, 150 high; three round holes and a slot.
fn cone_with_holes() -> Part {
    let surface = Profile::line([120.0, 0.0], [60.0, 150.0]).turned([0.0, 180.0], 2);
    let outline = polygon(&rectangle([0.02, 0.03], [0.98, 0.97]));
    let holes = [[0.25, 0.3], [0.75, 0.3], [0.5, 0.75]].map(|at| ellipse(at, [0.05, 0.1]));
    let slot = rounded(&rectangle([0.44, 0.25], [0.56, 0.45]), 0.03);
    let loops = std::iter::once(outline).chain(holes).chain([slot]).collect();
    Part::new("cone-with-holes.json", "funnel shell with holes", "FN-120-60", surface, loops)
}

/// The printed sleeve of a paper cup: 38 to 45 mm radius, 92 high, 160 degrees around, rounded corners.
fn cup_decal() -> Part {
    let surface = Profile::line([38.0, 0.0], [45.0, 92.0]).turned([-80.0, 80.0], 2);
    let outline = rounded(&rectangle([0.04, 0.08], [0.96, 0.92]), 0.05);
    Part::new("cup-decal.json", "cup decal", "CD-300-ML", surface, vec![outline])
}

/// The letter F on a cylinder of 80 mm radius: whoever sees it in the pattern knows that nothing is mirrored.
fn f_on_cylinder() -> Part {
    let surface = Profile::line([80.0, 0.0], [80.0, 120.0]).turned([-45.0, 45.0], 1);
    let letter = polygon(&[
        [0.15, 0.08],
        [0.35, 0.08],
        [0.35, 0.42],
        [0.7, 0.42],
        [0.7, 0.58],
        [0.35, 0.58],
        [0.35, 0.76],
        [0.85, 0.76],
        [0.85, 0.92],
        [0.15, 0.92],
    ]);
    Part::new("f-on-cylinder.json", "letter F", "LT-F-080", surface, vec![letter])
}

/// A flat sheet of gaskets: a frame with bolt holes, in its window a ring, and a second frame beside it.
fn gasket() -> Part {
    let sheet = Sheet { degree: 1, count: [2, 2], size: [300.0, 180.0], clamped: true };
    let surface = sheet.lifted(|_, _| 0.0);
    let mut loops = vec![
        rounded(&rectangle([10.0, 10.0], [190.0, 170.0]), 20.0),
        rounded(&rectangle([40.0, 40.0], [160.0, 140.0]), 12.0),
        circle([100.0, 90.0], 38.0),
        circle([100.0, 90.0], 22.0),
        rounded(&rectangle([205.0, 30.0], [290.0, 150.0]), 15.0),
        circle([247.5, 90.0], 25.0),
    ];
    loops.extend([[25.0, 25.0], [175.0, 25.0], [175.0, 155.0], [25.0, 155.0]].map(|at| circle(at, 5.0)));
    Part::new("gasket.json", "gasket set", "GS-300-180", surface, loops)
}

/// Half a pipe of 60 mm radius and 200 length, untrimmed: flattens to a rectangle of 60 pi by 200.
fn half_cylinder() -> Part {
    let surface = Profile::line([60.0, 0.0], [60.0, 200.0]).turned([0.0, 180.0], 2);
    Part::new("half-cylinder.json", "half shell, 60 pi x 200", "HS-060-200", surface, vec![])
}

/// A lens of a micrometre: everything must work at this size too.
fn micro_lens() -> Part {
    let size = 1.2e-3;
    let sheet = Sheet { degree: 2, count: [4, 4], size: [size; 2], clamped: true };
    let surface = sheet.lifted(|s, t| 0.03 * size * (bulge(s) + bulge(t)));
    Part::new("micro-lens.json", "micro lens", "ML-0.0012", surface, vec![circle([0.5 * size; 2], 0.45 * size)])
}

/// A membrane of 100 m: a slack saddle between four masts, its edges drawn in.
fn roof_membrane() -> Part {
    let sheet = Sheet { degree: 3, count: [6, 5], size: [100_000.0, 60_000.0], clamped: true };
    let surface = sheet.lifted(|s, t| 12_000.0 + 2500.0 * bulge(s) - 2000.0 * bulge(t));
    let corners =
        [[2e3, 2e3], [5e4, 5e3], [9.8e4, 2e3], [9.5e4, 3e4], [9.8e4, 5.8e4], [5e4, 5.5e4], [2e3, 5.8e4], [5e3, 3e4]];
    Part::new("roof-membrane.json", "roof membrane, bay 3", "RM-100M-3", surface, vec![polygon(&corners)])
}

/// A saddle of 300 x 300, z = (x^2 - y^2) / 1800 about its middle, exact, untrimmed.
fn saddle() -> Part {
    let sheet = Sheet { degree: 2, count: [3, 3], size: [300.0, 300.0], clamped: true };
    // The Bezier heights of a parabola: the ends' height, and in the middle what the tangents meet in.
    let height = |s: f64| if s == 0.5 { -12.5 } else { 12.5 };
    let surface = sheet.lifted(|s, t| height(s) - height(t));
    Part::new("saddle.json", "saddle", "SD-300-300", surface, vec![])
}

/// A panel of a sail, 900 x 600, on equally spaced knots that run over the ends of the domain.
fn sail_panel() -> Part {
    let sheet = Sheet { degree: 3, count: [7, 6], size: [900.0, 600.0], clamped: false };
    let surface = sheet.lifted(|s, t| 40.0 * bulge(s) * (0.6 + 0.4 * t) + 6.0 * bulge(t));
    let outline = polygon(&[[20.0, 20.0], [880.0, 40.0], [860.0, 560.0], [300.0, 580.0], [60.0, 400.0]]);
    Part::new("sail-panel.json", "mainsail, panel 4", "MS-900-4", surface, vec![outline])
}

/// The cushion of a seat, 480 x 520, raised at the sides; two slots for the belt and three holes.
fn seat_panel() -> Part {
    let sheet = Sheet { degree: 3, count: [7, 6], size: [480.0, 520.0], clamped: true };
    let surface = sheet.lifted(|s, t| 24.0 * (1.0 - bulge(s)).powi(2) + 10.0 * (PI * t).sin());
    let mut loops = vec![rounded(&[[40.0, 20.0], [440.0, 20.0], [465.0, 480.0], [15.0, 480.0]], 50.0)];
    loops.extend([110.0, 330.0].map(|u| rounded(&rectangle([u, 380.0], [u + 40.0, 396.0]), 7.0)));
    loops.extend([[240.0, 90.0], [120.0, 200.0], [360.0, 200.0]].map(|at| circle(at, 9.0)));
    Part::new("seat-panel.json", "seat cushion, top", "SP-480-520", surface, loops)
}

/// The quarter of a shoe, 150 x 110: curved both ways, cut along a smooth closed line, with two eyelets.
fn shoe_quarter() -> Part {
    let sheet = Sheet { degree: 3, count: [6, 5], size: [150.0, 110.0], clamped: true };
    let surface = sheet.lifted(|s, t| 16.0 * bulge(s) * (1.0 - 0.4 * t) + 5.0 * t * t + 3.0 * bulge(t));
    let outline = smooth(&[
        [12.0, 14.0],
        [60.0, 10.0],
        [120.0, 12.0],
        [142.0, 30.0],
        [132.0, 60.0],
        [104.0, 72.0],
        [84.0, 98.0],
        [48.0, 100.0],
        [24.0, 84.0],
        [8.0, 46.0],
    ]);
    let eyelets = [[88.0, 80.0], [98.0, 66.0]].map(|at| circle(at, 2.5));
    let loops = std::iter::once(outline).chain(eyelets).collect();
    Part::new("shoe-quarter.json", "shoe quarter, size 42, outer", "SQ-42-L", surface, loops)
}

/// A patch of a ball of 150 mm radius, 50 degrees each way, cut round.
fn sphere_cap() -> Part {
    let surface = Profile::arc([0.0, 0.0], 150.0, [-25.0, 25.0]).turned([-25.0, 25.0], 1);
    Part::new("sphere-cap.json", "ball segment", "BS-150", surface, vec![circle([0.5, 0.5], 0.46)])
}

/// A piece of a duct's bend: a ring of 200 mm radius, its tube 60, 40 degrees around and 60 across.
fn torus_segment() -> Part {
    let surface = Profile::arc([200.0, 0.0], 60.0, [-30.0, 30.0]).turned([-20.0, 20.0], 1);
    let outline = rounded(&rectangle([0.05, 0.05], [0.95, 0.95]), 0.08);
    Part::new("torus-segment.json", "duct bend, outer strip", "DB-200-60", surface, vec![outline])
}
