//! Figures 5.18 to 5.21 and Tables 5.4 to 5.6: Gaussian curvature of the mesh against the surface's own.
//!
//! Curvatures are printed per cm^2: per mm^2, the thesis's figures would bend its panels round more than a whole sphere.

use anyhow::Result;
use planish::engine::curvature::{Differences, Ring, rings};
use planish::engine::mesh::{Mesh, Topology};

use crate::panels::{COMPARED, Diagonals, Panel, backlight, windscreen};
use crate::table::{NONE, OURS, THESIS, Table, figure, note};

/// From 1/mm^2 to 1/cm^2.
const PER_CM2: f64 = 100.0;

/// How a ring gives a curvature, 1/mm^2.
type Estimate = fn(&Ring) -> f64;

/// The estimates: how a ring gives one, and its name.
pub(crate) const ESTIMATES: [(&str, Estimate); 3] =
    [("(5.5)", Ring::barycentric), ("(5.7)", Ring::compensated), ("Voronoi", Ring::voronoi)];

/// The interior vertices of a mesh: ring and the surface's own curvature, 1/cm^2 for both.
pub(crate) struct Sampled {
    rings: Vec<(Ring, f64)>,
}

impl Sampled {
    pub(crate) fn of(panel: &Panel, mesh: &Mesh) -> Result<Self> {
        let topology = Topology::new(mesh)?;
        let uv = mesh.uv.as_deref().unwrap_or_default();
        let own = |k: usize| panel.surface.curvature(uv[k].x, uv[k].y).gaussian * PER_CM2;
        let rings = rings(mesh, &topology).into_iter().enumerate();
        Ok(Self { rings: rings.filter_map(|(k, ring)| ring.map(|ring| (ring, own(k)))).collect() })
    }

    /// Least and greatest of an estimate.
    fn extremes(&self, estimate: Estimate) -> [f64; 2] {
        extremes(self.rings.iter().map(|(ring, _)| estimate(ring) * PER_CM2))
    }

    /// Least and greatest of the surface's own.
    pub(crate) fn own(&self) -> [f64; 2] {
        extremes(self.rings.iter().map(|(_, own)| *own))
    }

    pub(crate) fn differences(&self, estimate: Estimate) -> Differences {
        Differences::of(self.rings.iter().map(|(ring, own)| (estimate(ring) * PER_CM2, *own)))
    }

    /// The same at vertices of one valency.
    fn at_valency(&self, estimate: Estimate, valency: u32) -> Differences {
        let there = self.rings.iter().filter(|(ring, _)| ring.triangles == valency);
        Differences::of(there.map(|(ring, own)| (estimate(ring) * PER_CM2, *own)))
    }

    fn least_difference(&self, estimate: Estimate) -> f64 {
        extremes(self.rings.iter().map(|(ring, own)| (estimate(ring) * PER_CM2 - own).abs()))[0]
    }
}

fn extremes(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// Figures 5.18, 5.20 and 5.21 in numbers.
pub(crate) fn of_random_diagonals() -> Result<()> {
    let panel = backlight();
    let head = [
        "Diagonals",
        "Estimate",
        "",
        "least K, error %",
        "greatest K, error %",
        "greatest difference",
        "mean difference",
    ];
    let mut table = Table::new("Figures 5.18, 5.20, 5.21. Random diagonals on the backlight, K per cm2", &head);
    let printed = |estimate: &str| match estimate {
        "(5.5)" => Some(["-13", "+19", "2.30e-5", NONE]),
        "(5.7)" => Some(["-8", "0", "5.00e-6", NONE]),
        _ => None,
    };
    let meshes =
        [("Figure 5.18", panel.mesh(Diagonals::Random(1))?), ("mirrored", panel.mesh(Diagonals::Mirrored(1))?)];
    let mut reductions = Vec::new();
    for (label, mesh) in &meshes {
        let sampled = Sampled::of(&panel, mesh)?;
        let own = sampled.own();
        for (name, estimate) in ESTIMATES {
            if let Some(printed) = printed(name).filter(|_| *label == "Figure 5.18") {
                table.labelled(&[label, name, THESIS], printed);
            }
            let [least, greatest] = sampled.extremes(estimate);
            let differences = sampled.differences(estimate);
            let errors = [(least, own[0]), (greatest, own[1])]
                .map(|(x, own)| format!("{:+.0}", (100.0 * (x - own) / own).round() + 0.0));
            let [least, greatest] = errors;
            table.labelled(
                &[label, name, OURS],
                [least, greatest, figure(differences.greatest), figure(differences.mean())],
            );
        }
        let [plain, compensated] = [0, 1].map(|k| sampled.differences(ESTIMATES[k].1).greatest);
        reductions.push(format!("{:.0} % ({label})", 100.0 * (1.0 - compensated / plain)));
    }
    table.print();
    note(&format!(
        "Reduction of the greatest difference from (5.5) to (5.7): thesis 79 % (its 0.000023 and 0.000005 give 78 %), ours {}.",
        reductions.join(", ")
    ));
    let mut table = Table::new(
        "Figures 5.18, 5.20. Mean difference by valency, K per cm2",
        &["Valency", "vertices", "(5.5)", "(5.7)", "Voronoi"],
    );
    let sampled = Sampled::of(&panel, &meshes[0].1)?;
    for valency in 4..=8 {
        let differences = ESTIMATES.map(|(_, estimate)| sampled.at_valency(estimate, valency));
        let means = differences.map(|d| figure(d.mean()));
        table.row([valency.to_string(), differences[0].vertices.to_string()].into_iter().chain(means));
    }
    table.print();
    Ok(())
}

/// Least and greatest K, least and greatest difference and difference per vertex: chevron, diamond, regular, optimised.
const TABLE_5_5: [[f64; 5]; 4] = [
    [0.000_013, 0.000_099, 0.0, 0.000_006, 0.000_000_8],
    [0.000_005, 0.000_102, 0.0, 0.000_034, 0.000_001_21],
    [0.000_018, 0.000_098, 0.0, 0.000_004, 0.000_000_77],
    [0.000_019, 0.000_098, 0.0, 0.000_004, 0.000_000_77],
];
const TABLE_5_6: [[f64; 5]; 4] = [
    [0.000_002, 0.000_094, 0.0, 0.000_008, 0.000_000_35],
    [0.000_002, 0.000_096, 0.0, 0.000_009, 0.000_000_61],
    [0.000_002, 0.000_094, 0.0, 0.000_008, 0.000_000_34],
    [0.000_002, 0.000_092, 0.0, 0.000_007, 0.000_000_31],
];

pub(crate) const DIFFERENCE_HEAD: [&str; 7] =
    ["", "", "K min", "K max", "least difference", "greatest difference", "mean difference"];

/// Tables 5.4 to 5.6.
pub(crate) fn of_configurations() -> Result<()> {
    let mut table =
        Table::new("Table 5.4. Surface's own K at the grid points, per cm2", &["Surface", "", "K min", "K max"]);
    for (panel, printed) in [(backlight(), ["1.90e-5", "9.60e-5"]), (windscreen(), ["2.00e-6", "8.90e-5"])] {
        table.labelled(&[panel.name, THESIS], printed);
        let lines = panel.lines();
        let all = lines.v.iter().flat_map(|&v| lines.u.iter().map(move |&u| (u, v)));
        let own = extremes(all.map(|(u, v)| panel.surface.curvature(u, v).gaussian * PER_CM2));
        table.labelled(&["", OURS], own.map(figure));
    }
    table.print();
    let mut orders = Vec::new();
    for (panel, title, printed) in [(backlight(), "Table 5.5", TABLE_5_5), (windscreen(), "Table 5.6", TABLE_5_6)] {
        let mut table = Table::new(&format!("{title}. {}: K by (5.7), per cm2", panel.name), &DIFFERENCE_HEAD);
        let mut means = Vec::new();
        for ((label, diagonals), row) in COMPARED.iter().zip(crate::flattening::PRINTED_ROW) {
            let sampled = Sampled::of(&panel, &panel.mesh(*diagonals)?)?;
            table.labelled(&[label, THESIS], printed[row].map(figure));
            table.labelled(&["", OURS], sampled.row());
            means.push((*label, sampled.differences(Ring::compensated).mean()));
        }
        table.print();
        means.sort_by(|a, b| a.1.total_cmp(&b.1));
        let order: Vec<&str> = means.iter().map(|(label, _)| *label).collect();
        orders.push(format!("{}: {}", panel.name, order.join(" < ")));
    }
    note(&format!("Mean difference, least first:\n- {}", orders.join("\n- ")));
    note(
        "Thesis, both: RATC Optimised <= Regular < Chevron < Diamond. Means are over interior vertices; borders have no estimate.",
    );
    Ok(())
}

impl Sampled {
    /// The figures of a row of Tables 5.5, 5.6 and 6.3, by (5.7).
    pub(crate) fn row(&self) -> [String; 5] {
        let [least, greatest] = self.extremes(Ring::compensated);
        let differences = self.differences(Ring::compensated);
        let difference = self.least_difference(Ring::compensated);
        [least, greatest, difference, differences.greatest, differences.mean()].map(figure)
    }
}
