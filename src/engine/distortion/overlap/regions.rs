//! From crossings and winding numbers to regions: pieces of edges that separate one from two, joined into closed curves.

use glam::DVec2;

use super::border::{Border, Crossing};
use super::{BorderPlace, Overlap, Overlaps, TOUCH};

/// A piece of an edge with the mesh once on its right and twice on its left.
struct Side {
    from: DVec2,
    to: DVec2,
    /// The curve it belongs to: a number that [`Curves`] joins with others.
    curve: u32,
}

/// Sets of numbers that are joined step by step (union-find; the least number stands for a set).
struct Curves(Vec<u32>);

impl Curves {
    fn new_curve(&mut self) -> u32 {
        self.0.push(self.0.len() as u32);
        self.0.len() as u32 - 1
    }

    fn root(&mut self, mut k: u32) -> u32 {
        while self.0[k as usize] != k {
            self.0[k as usize] = self.0[self.0[k as usize] as usize];
            k = self.0[k as usize];
        }
        k
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// What is gathered of one closed curve.
#[derive(Clone)]
struct Gathered {
    origin: DVec2,
    twice_area: f64,
    length: f64,
    bounds: [DVec2; 2],
    crossing: Option<u32>,
    edge: u32,
}

/// The overlaps of borders with known crossings; `starts` gives for each loop an edge and the winding number to its right
/// where it starts.
pub(super) fn regions(border: &Border, crossings: &[Crossing], starts: &[(usize, i32)]) -> Overlaps {
    let mut on_edges: Vec<(u32, f64, u32)> = Vec::with_capacity(2 * crossings.len());
    for (k, c) in crossings.iter().enumerate() {
        on_edges.extend([(c.edges[0], c.at[0], k as u32), (c.edges[1], c.at[1], k as u32)]);
    }
    on_edges.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut curves = Curves(Vec::new());
    let mut at_crossing: Vec<Option<u32>> = vec![None; crossings.len()];
    let mut sides: Vec<(Side, u32)> = Vec::new();
    for (number, &(start, windings)) in starts.iter().enumerate() {
        let nodes = border.nodes(number);
        let mut right = windings;
        // The curve that the walk is on while it separates one from two.
        let mut on: Option<u32> = None;
        let first_side = sides.len();
        for k in 0..nodes.len() {
            let edge = nodes.start + (start - nodes.start + k) % nodes.len();
            let [a, b] = border.ends(edge);
            let run = on_edges.partition_point(|o| (o.0 as usize) < edge);
            let mut from = a;
            for &(_, _, crossing) in on_edges[run..].iter().take_while(|o| o.0 as usize == edge) {
                let c = &crossings[crossing as usize];
                on = walked(&mut curves, &mut sides, right == 1, on, [from, c.point], edge);
                meet(&mut curves, &mut at_crossing[crossing as usize], on);
                right += if (c.edges[0] as usize == edge) == c.to_left { 1 } else { -1 };
                // What goes on beyond a crossing is another piece, on the same curve only if it says so there.
                on = (right == 1).then(|| curves.new_curve());
                meet(&mut curves, &mut at_crossing[crossing as usize], on);
                from = c.point;
            }
            on = walked(&mut curves, &mut sides, right == 1, on, [from, b], edge);
        }
        // The walk ends where it began.
        if let (Some(on), Some((side, _))) = (on, sides.get(first_side))
            && windings == 1
        {
            curves.join(on, side.curve);
        }
    }
    gathered(border, crossings, curves, &sides, &at_crossing)
}

/// Adds a piece when it separates one from two, and gives the curve that the walk is on.
fn walked(
    curves: &mut Curves,
    sides: &mut Vec<(Side, u32)>,
    separates: bool,
    on: Option<u32>,
    [from, to]: [DVec2; 2],
    edge: usize,
) -> Option<u32> {
    if !separates {
        return None;
    }
    let curve = on.unwrap_or_else(|| curves.new_curve());
    sides.push((Side { from, to, curve }, edge as u32));
    Some(curve)
}

/// Joins the curves that come to a crossing and leave it.
fn meet(curves: &mut Curves, there: &mut Option<u32>, on: Option<u32>) {
    match (*there, on) {
        (Some(a), Some(b)) => curves.join(a, b),
        (None, Some(_)) => *there = on,
        _ => {}
    }
}

fn gathered(
    border: &Border,
    crossings: &[Crossing],
    mut curves: Curves,
    sides: &[(Side, u32)],
    at_crossing: &[Option<u32>],
) -> Overlaps {
    let mut of_curve: Vec<Option<Gathered>> = vec![None; curves.0.len()];
    for (side, edge) in sides {
        let root = curves.root(side.curve) as usize;
        let g = of_curve[root].get_or_insert(Gathered {
            origin: side.from,
            twice_area: 0.0,
            length: 0.0,
            bounds: [side.from; 2],
            crossing: None,
            edge: *edge,
        });
        g.twice_area += (side.from - g.origin).perp_dot(side.to - g.origin);
        g.length += side.from.distance(side.to);
        for p in [side.from, side.to] {
            g.bounds = [g.bounds[0].min(p), g.bounds[1].max(p)];
        }
    }
    for (k, curve) in at_crossing.iter().enumerate() {
        if let Some(g) = curve.and_then(|c| of_curve[curves.root(c) as usize].as_mut()) {
            g.crossing.get_or_insert(k as u32);
        }
    }
    let low = border.points.iter().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = border.points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let width = TOUCH * low.distance(high);
    let wide = |g: &Gathered| g.twice_area.abs() > width * g.length;
    let mut found = Overlaps { complete: true, ..Overlaps::default() };
    for g in of_curve.into_iter().flatten().filter(wide) {
        found.area_mm2 += 0.5 * g.twice_area;
        if g.twice_area > 0.0 {
            found.regions.push(region(border, crossings, &g));
        }
    }
    // Stable: equal areas stay in the order of the borders.
    found.regions.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2));
    found
}

fn region(border: &Border, crossings: &[Crossing], g: &Gathered) -> Overlap {
    let place = |edge: u32, along: f64| BorderPlace { halfedge: border.halfedges[edge as usize], along };
    let (at, places) = match g.crossing.map(|k| &crossings[k as usize]) {
        Some(c) => (c.point, vec![place(c.edges[0], c.at[0]), place(c.edges[1], c.at[1])]),
        None => (g.origin, vec![place(g.edge, 0.0)]),
    };
    Overlap { area_mm2: 0.5 * g.twice_area, at, bounds: g.bounds, places }
}
