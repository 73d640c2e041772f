//! How many lines each direction gets where: the least number of cells that meets all needs.
//!
//! Unknown are the densities `g_i` (lines per parameter in strip i of u) and `h_j` (of v); a patch (i, j) demands
//! `k (a/g^2 + 2 b/(g h) + c/h^2) <= 1` of them, and the cells that the part covers number `sum g_i h_j` times the
//! patches' sizes. This is a geometric program (convex in log g, log h). One direction follows from the other in closed
//! form, as the greatest root over the patches of a strip; so only the share of the allowance that v takes remains
//! to be searched, and a few shares, each followed by one pass of relaxation either way, come within some percent of
//! the optimum in a time that does not depend on the number of cells.

use super::needs::Needs;

/// Shares of each strip's own limit that the first direction's step is tried with. 0.71 is the balance of a surface of
/// the same needs everywhere; the others serve surfaces whose needs vary more in one direction.
const SHARES: [f64; 4] = [0.71, 0.86, 0.55, 0.38];

/// Steps of a direction without curvature that are tried, as divisions of the whole: they matter to twisted patches
/// (`Suv` alone), where any product of the two divisions will do.
const DIVISIONS: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];

/// How dear a cell of aspect ratio r is against a square one, `1 + ASPECT_PRICE ln r`: it decides between grids
/// of (almost) equal size only.
const ASPECT_PRICE: f64 = 0.02;

/// Share of the allowance within which a direction that takes all of it counts as leaving this much: so the other
/// direction of a cylinder, whose need is rounding errors, stays free whatever the first one is rounded to.
const SLACK: f64 = 1e-6;

/// Lines per parameter in each strip of each direction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Densities {
    /// Along u.
    pub u: Vec<f64>,
    /// Along v.
    pub v: Vec<f64>,
}

/// The least densities of one direction (u if `along_u`) that go with the given ones of the other; infinite where none does.
pub(super) fn follow(needs: &Needs, other: &[f64], along_u: bool) -> Vec<f64> {
    let (count, length) = if along_u { (needs.u.len(), needs.u.length()) } else { (needs.v.len(), needs.v.length()) };
    // Steps first: whether a step is too long is told without a root, and few patches shorten it.
    let mut steps = vec![length; count];
    let across_steps: Vec<f64> = other.iter().map(|density| 1.0 / density).collect();
    for (i, row) in needs.patches.chunks_exact(needs.v.len()).enumerate() {
        for (j, n) in row.iter().enumerate() {
            let (mine, across, own, cross, alone) =
                if along_u { (i, j, n.a, n.c, n.alone_a()) } else { (j, i, n.c, n.a, n.alone_c()) };
            let (step, x) = (across_steps[across], steps[mine]);
            let left = (1.0 - n.k * cross * step * step).max(-SLACK);
            let left = if left < SLACK && left > -SLACK { SLACK } else { left };
            let alone = own.max(alone);
            if alone * x * x > 1.0 {
                steps[mine] = 1.0 / alone.sqrt();
            }
            let half = n.k * n.b * step;
            // k own x^2 + 2 k b x step + k cross step^2 = 1
            if (n.k * own * x + 2.0 * half) * x > left {
                let root = if left > 0.0 { left / (half + (half * half + left * n.k * own).sqrt()) } else { 0.0 };
                steps[mine] = steps[mine].min(root);
            }
        }
    }
    steps.into_iter().map(|x| 1.0 / x).collect()
}

/// Covered cells that the densities give, as a real number, with the price of narrow cells.
fn price(needs: &Needs, d: &Densities) -> f64 {
    let mut cells = 0.0;
    for (i, g) in d.u.iter().enumerate() {
        let mut row = 0.0;
        for (j, h) in d.v.iter().enumerate() {
            if needs.covered[i * d.v.len() + j].inside {
                row += h * needs.v.width(j);
            }
        }
        cells += row * g * needs.u.width(i);
    }
    let lines = |d: &[f64], width: &dyn Fn(usize) -> f64| d.iter().enumerate().map(|(i, x)| x * width(i)).sum::<f64>();
    let du = needs.speeds[0] * needs.u.length() / lines(&d.u, &|i| needs.u.width(i));
    let dv = needs.speeds[1] * needs.v.length() / lines(&d.v, &|j| needs.v.width(j));
    let ratio = if du > 0.0 && dv > 0.0 { (du / dv).max(dv / du) } else { 1.0 };
    cells * (1.0 + ASPECT_PRICE * ratio.ln())
}

/// The densities of the least price among those tried.
pub(super) fn balance(needs: &Needs) -> Densities {
    let stride = needs.v.len();
    let mut own = vec![0.0_f64; stride];
    let mut whole = vec![0.0_f64; stride];
    for row in needs.patches.chunks_exact(stride) {
        for ((own, whole), n) in own.iter_mut().zip(&mut whole).zip(row) {
            *own = own.max(n.k * n.c);
            *whole = whole.max(n.c).max(n.alone_c());
        }
    }
    for x in own.iter_mut().chain(&mut whole) {
        *x = x.sqrt();
    }
    let least = 1.0 / needs.v.length();
    let curved = own.iter().any(|x| *x > least);
    let twisted = needs.patches.iter().any(|n| n.b > 0.0);
    let shares: &[f64] = if curved { &SHARES } else { &[1.0] };
    let divisions: &[f64] = if !curved && twisted { &DIVISIONS } else { &[1.0] };
    let mut best: Option<(f64, Densities)> = None;
    for share in shares {
        for division in divisions {
            let start: Vec<f64> =
                own.iter().zip(&whole).map(|(o, w)| (least * division).max(o / share).max(*w)).collect();
            let u = follow(needs, &start, true);
            if u.iter().any(|x| !x.is_finite()) {
                continue;
            }
            let v = follow(needs, &u, false);
            let found = Densities { u, v };
            let cost = price(needs, &found);
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, found));
            }
        }
    }
    // Every share below 1 is feasible; without curvature along v so is the first division.
    best.map_or_else(|| Densities { u: vec![f64::INFINITY; needs.u.len()], v: vec![f64::INFINITY; stride] }, |b| b.1)
}
