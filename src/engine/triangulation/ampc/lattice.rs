//! Where lines meet: the points of the structured grid, held in the domain.
//!
//! Column i is a line of the family that was asked for, row j either a line of constant t or a line of the other family
//! (x and t exchanged). Point (i, j) is where they meet after both have been held in [0, 1], so that the first and last
//! column and row run along the border and every corner of the domain is a point. With the border `clamped` the *points*
//! of lines are held (stage 8), with `free` the lines themselves: then they have crossings, places where they leave the
//! domain or come back.

use glam::DVec2;

use super::strips::row_at;

/// Points nearer to the border, or to each other along it, than this share of the domain are on it, or one. More moves
/// points off their rulings; less leaves triangles too thin to be laid flat.
pub(super) const COINCIDENT: f64 = 1e-6;

/// Halvings by which two lines are brought to meet: to rounding.
const HALVINGS: usize = 50;

/// A line that leaves the domain or comes back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    /// The border: x (for a row, t) is 0 or 1.
    pub border: f64,
    /// Where on it.
    pub at: f64,
}

/// Points and crossings in strip coordinates.
pub(super) struct Lattice {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Point (i, j) at `j * columns + i`.
    pub points: Vec<DVec2>,
    /// Crossings of each column, by t; empty unless they are free.
    pub of_columns: Vec<Vec<Crossing>>,
    /// Crossings of each row, by x.
    pub of_rows: Vec<Vec<Crossing>>,
}

impl Lattice {
    /// Columns against `n` rows of constant t.
    pub(super) fn of_one_family(columns: &[Vec<f64>], n: usize, free: bool) -> Self {
        let points = (0..n)
            .flat_map(|j| columns.iter().map(move |x| DVec2::new(on_border(x[j].clamp(0.0, 1.0)), row_at(j, n))))
            .collect();
        Self {
            size: [columns.len(), n],
            points,
            of_columns: columns.iter().map(|x| if free { crossings(x) } else { Vec::new() }).collect(),
            of_rows: vec![Vec::new(); n],
        }
    }

    /// Columns x(t) against rows t(x).
    pub(super) fn of_both(columns: &[Vec<f64>], rows: &[Vec<f64>], free: bool) -> Self {
        let held = |lines: &[Vec<f64>]| -> Vec<Graph> { lines.iter().map(|x| Graph::new(x, free)).collect() };
        let (f, g) = (held(columns), held(rows));
        let points = g.iter().flat_map(|g| f.iter().map(move |f| meet(f, g))).collect();
        let of = |lines: &[Vec<f64>]| lines.iter().map(|x| if free { crossings(x) } else { Vec::new() }).collect();
        Self { size: [columns.len(), rows.len()], points, of_columns: of(columns), of_rows: of(rows) }
    }
}

/// A line as a function over [0, 1] with values there.
struct Graph(Vec<f64>);

impl Graph {
    fn new(values: &[f64], free: bool) -> Self {
        Self(if free { values.to_vec() } else { values.iter().map(|x| x.clamp(0.0, 1.0)).collect() })
    }

    fn at(&self, t: f64) -> f64 {
        let parts = (self.0.len() - 1) as f64;
        let k = ((t * parts) as usize).min(self.0.len() - 2);
        let share = t * parts - k as f64;
        let value = self.0[k] + (self.0[k + 1] - self.0[k]) * share;
        on_border(value.clamp(0.0, 1.0))
    }
}

/// Where x = f(t) and t = g(x): both take [0, 1] into itself, so they do meet.
fn meet(f: &Graph, g: &Graph) -> DVec2 {
    let ahead = |t: f64| g.at(f.at(t)) - t;
    let t = if ahead(0.0) <= 0.0 {
        0.0
    } else if ahead(1.0) >= 0.0 {
        1.0
    } else {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if ahead(middle) > 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    // On a border the coordinates are those of the border and of the other line there, the same for every line along it.
    let x = f.at(t);
    let y = g.at(x);
    DVec2::new(if y <= 0.0 || y >= 1.0 { f.at(y) } else { x }, y)
}

/// 0 or 1 for what is within `COINCIDENT` of it.
fn on_border(x: f64) -> f64 {
    if x < COINCIDENT {
        0.0
    } else if x > 1.0 - COINCIDENT {
        1.0
    } else {
        x
    }
}

/// Where the chords of a line cross 0 and 1, in their order.
fn crossings(x: &[f64]) -> Vec<Crossing> {
    let mut found = Vec::new();
    for (row, ends) in x.windows(2).enumerate() {
        let mut here: Vec<(f64, f64)> = [0.0, 1.0]
            .into_iter()
            .filter(|border| (ends[0] - border) * (ends[1] - border) < 0.0)
            .map(|border| ((border - ends[0]) / (ends[1] - ends[0]), border))
            .collect();
        here.sort_by(|a, b| a.0.total_cmp(&b.0));
        let parts = (x.len() - 1) as f64;
        found.extend(here.into_iter().map(|(share, border)| Crossing { border, at: (row as f64 + share) / parts }));
    }
    found
}
