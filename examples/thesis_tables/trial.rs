//! One mesh, one reading, every seed: what Tables 5.7, 5.8, 6.4 and 6.5 are made of.

use anyhow::Result;
use planish::engine::budget::Unobserved;
use planish::engine::distortion::{Original, Thresholds};
use planish::engine::flattening::cader::flatten_once;
use planish::engine::flattening::{Anchor, Order, Parent, Readings};
use planish::engine::mesh::{Mesh, Topology};
use planish::engine::seed::{SearchSettings, search};

/// Readings that the tables compare. The first is the program's default.
pub(crate) const READINGS: [Readings; 4] = [
    reading(Order::Index, Parent::First, Anchor::End),
    reading(Order::Fifo, Parent::First, Anchor::Start),
    reading(Order::Index, Parent::Last, Anchor::Start),
    reading(Order::Fifo, Parent::Last, Anchor::End),
];

/// A reading by what matters most; average and check are the defaults.
pub(crate) const fn reading(order: Order, parent: Parent, anchor: Anchor) -> Readings {
    use planish::engine::flattening::{Average, Check, Scheme};
    let (average, check) = (Average::Pair, Check::Incident);
    Readings { scheme: Scheme::InTurn, order, parent, anchor, average, check }
}

/// A reading's name.
pub(crate) fn name(readings: Readings) -> String {
    let order = if readings.order == Order::Index { "index" } else { "fifo" };
    let parent = if readings.parent == Parent::First { "first" } else { "last" };
    let anchor = if readings.anchor == Anchor::Start { "start" } else { "end" };
    format!("{order}, {parent}, {anchor}")
}

/// What all seeds of a mesh came to.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trial {
    /// Seeds that flattened the mesh, and seeds there are.
    pub(crate) succeeded: usize,
    pub(crate) seeds: usize,
    /// Area changes (4.9) and shape changes (4.10) of those that succeeded, percent, in rising order.
    pub(crate) area: Vec<f64>,
    pub(crate) shape: Vec<f64>,
    /// The flattening from the seed of least area change.
    pub(crate) optimum: Option<Optimum>,
}

/// A row of Table 5.7.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Optimum {
    pub(crate) seed: u32,
    pub(crate) area_percent: f64,
    pub(crate) area_average: f64,
    pub(crate) shape_percent: f64,
    pub(crate) shape_average: f64,
}

impl Trial {
    pub(crate) fn of(mesh: &Mesh, readings: Readings) -> Result<Self> {
        let topology = Topology::new(mesh)?;
        let settings = SearchSettings { readings, landscape: true, ..SearchSettings::default() };
        let found = search(mesh, &topology, &settings, &Unobserved)?;
        let changes = || found.outcomes.iter().filter_map(|outcome| outcome.changes());
        let rising = |mut list: Vec<f64>| {
            list.sort_by(f64::total_cmp);
            list
        };
        let optimum = match &found.best {
            Ok(best) => {
                let (flattening, _) = flatten_once(mesh, &topology, readings, best.seed)?;
                let original = Original::new(mesh, &topology, None);
                let area = original.area_change(&flattening.flat, Thresholds::default());
                let shape = original.shape_change(&flattening.flat, Thresholds::default());
                Some(Optimum {
                    seed: best.seed,
                    area_percent: area.percent(),
                    area_average: area.average,
                    shape_percent: shape.percent(),
                    shape_average: shape.average,
                })
            }
            Err(_) => None,
        };
        Ok(Self {
            succeeded: found.succeeded as usize,
            seeds: found.outcomes.len(),
            area: rising(changes().filter_map(|c| c.area_percent).collect()),
            shape: rising(changes().filter_map(|c| c.shape_percent).collect()),
            optimum,
        })
    }

    /// Share of seeds that succeeded, percent.
    pub(crate) fn success_percent(&self) -> f64 {
        100.0 * self.succeeded as f64 / self.seeds.max(1) as f64
    }
}

/// The middle of a rising list.
pub(crate) fn median(rising: &[f64]) -> Option<f64> {
    rising.get(rising.len() / 2).copied()
}
