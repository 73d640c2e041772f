//! Density: where the lines of the grid go so that the mesh is as fine as asked and no finer.
//!
//! A tolerance becomes *needs* of patches of the domain ([`needs`]), needs become line densities of least cell count
//! ([`mod@balance`]), densities become lines ([`lines`]), and the lines are judged on their real cells ([`check`]). What
//! the judge finds tightens or loosens the needs, until the worst cell is within the allowance and close to it.
//!
//! - `chord`: greatest distance between mesh and surface [Filip, Magedson, Markot 1986: Surface algorithms using bounds
//!   on derivatives, Computer Aided Geometric Design 3], sharpened to the exact distance of the local quadratic.
//! - `edge`: longest edge.
//! - `area`: the mesh's area is within so much of the surface's (thesis chapter 5): the chord grid whose area is.
//!
//! Units: millimetres, and the surface's own parameters. Limits: the grid is rectilinear, so a small place of strong
//! curvature sends its lines across the whole part; what is judged is the middles of cells' edges, and a ripple much
//! finer than a strip of [`axis`] may hide from needs and judge alike. A mesh's final distance is sampled again,
//! densely, by [`super::sampled_chord_error`].

mod axis;
mod balance;
mod check;
mod coverage;
mod lines;
mod needs;
#[cfg(test)]
mod tests;

use axis::Axis;
use balance::{Densities, balance, follow};
use needs::{Aim, Diagonals, Needs};

use super::{Configuration, Density, GridLines, TriangulationError};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::nurbs::Surface;
use crate::engine::trimming::TrimRegion;

/// Most triangles of a mesh unless the caller allows others: four million need about half a gigabyte with everything
/// that is made of them.
pub const MAX_TRIANGLES: u64 = 4_000_000;

/// Rounds of planning and judging. Two are the rule: one to see how far the bound is from the truth, one to use it.
const ROUNDS: usize = 6;

/// Use of the allowance from which a grid is close enough. The number of cells is inverse to the use: 0.8 wastes at most
/// a fifth, and another round of judging costs about as much time as making those cells.
const CLOSE: f64 = 0.8;

/// The use that a correction aims at: as far inside the allowance as the prediction is off.
const AIMED: f64 = 0.95;

/// Foretold use from which a grid is judged as it is.
const FORETOLD: f64 = 0.9;

/// Cells in one direction up to which neighbouring whole numbers of lines are tried, too: where a dozen lines do,
/// rounding one direction up gives the other one room.
const FEW_CELLS: f64 = 40.0;

/// How many cells a triangle-range clamp is steered towards: the middle of what is allowed would change parts that
/// already are within it; the ends are kept to this margin.
const CLAMP_MARGIN: f64 = 0.97;

/// Bounds on the number of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DensityLimits {
    /// More are refused.
    pub max_triangles: u64,
    /// The number is brought into this range (both ends included) by scaling rows and columns: for methods that fail on
    /// meshes that are too dense.
    pub clamp: Option<(u64, u64)>,
}

impl Default for DensityLimits {
    fn default() -> Self {
        Self { max_triangles: MAX_TRIANGLES, clamp: None }
    }
}

/// What a grid is to be planned for.
#[derive(Debug, Clone, Copy)]
pub struct DensityInput<'a> {
    /// The base surface.
    pub surface: &'a Surface,
    /// The part, when only that is triangulated; `None`: the whole domain.
    pub region: Option<&'a TrimRegion>,
    /// Diagonal of the part's box in space, mm: what `chord_relative` is a fraction of.
    pub diagonal: f64,
    /// What is asked for.
    pub density: Density,
    /// How the diagonals will run.
    pub configuration: Configuration,
    /// Bounds.
    pub limits: DensityLimits,
}

/// A grid that was planned, with what it was planned from.
struct Planned {
    u: Vec<f64>,
    v: Vec<f64>,
    used: f64,
    /// Densities that came of whole cells.
    made_u: Vec<f64>,
    made_v: Vec<f64>,
}

impl Planned {
    fn cells(&self) -> usize {
        (self.u.len() - 1) * (self.v.len() - 1)
    }
}

/// The lines of the grid that the density asks for.
///
/// # Errors
/// [`TriangulationError::TooManyTriangles`] before anything of that size is allocated, [`TriangulationError::NoArea`]
/// when the region has no extent, [`EngineError::Cancelled`].
pub fn plan(input: &DensityInput, observer: &dyn Observer) -> Result<GridLines, EngineError> {
    let planner = Planner::new(input, observer)?;
    let planned = match input.density {
        Density::Chord(tolerance) => planner.aim(Aim::Chord(tolerance))?,
        Density::ChordRelative(share) => planner.aim(Aim::Chord(share * input.diagonal))?,
        Density::Edge(longest) => planner.aim(Aim::Edge(longest))?,
        Density::Area(tolerance) => planner.area(|_| tolerance)?,
        Density::AreaRelative(share) => planner.area(|area| share * area)?,
    };
    Ok(GridLines { u: lines::of_domain(&planner.u, &planned.u), v: lines::of_domain(&planner.v, &planned.v) })
}

/// Whether weights differ along u and along v: only then is a direction of degree 1 not straight at an even speed.
fn curved_by_weights(surface: &Surface) -> [bool; 2] {
    let Some(weights) = surface.weights() else { return [false; 2] };
    let rows = surface.knots_v().control_count();
    let along_u = weights.iter().enumerate().any(|(k, w)| *w != weights[k % rows]);
    let along_v = weights.chunks_exact(rows).any(|row| row.iter().any(|w| *w != row[0]));
    [along_u, along_v]
}

/// Lines along one direction, and the densities that they make in its strips.
type Columns = (Vec<f64>, Vec<f64>);

struct Planner<'a> {
    input: &'a DensityInput<'a>,
    observer: &'a dyn Observer,
    u: Axis,
    v: Axis,
    covered: Vec<coverage::Cover>,
    diagonals: Diagonals,
    /// Share of the extents' cells that the part fills.
    fill: f64,
}

impl<'a> Planner<'a> {
    fn new(input: &'a DensityInput<'a>, observer: &'a dyn Observer) -> Result<Self, EngineError> {
        let domain = input.surface.domain();
        let region = input.region.filter(|r| !r.natural);
        let [u, v] = match region {
            Some(region) => {
                let [u, v] = coverage::extents(region).ok_or(TriangulationError::NoArea)?;
                let within = |r: [f64; 2], d: [f64; 2]| [r[0].max(d[0]), r[1].min(d[1])];
                let clipped = [within(u, domain.u), within(v, domain.v)];
                if clipped.iter().any(|r| r[0] >= r[1]) {
                    return Err(TriangulationError::NoArea.into());
                }
                clipped
            }
            None => [domain.u, domain.v],
        };
        let bent = curved_by_weights(input.surface);
        let (u, v) = (Axis::new(input.surface.knots_u(), u, bent[0]), Axis::new(input.surface.knots_v(), v, bent[1]));
        let fill = region
            .map_or(1.0, |r| (coverage::domain_area(r) / (u.length() * v.length())).clamp(f64::MIN_POSITIVE, 1.0));
        let covered = coverage::covered(&u, &v, region);
        let diagonals = match input.configuration {
            Configuration::Regular => Diagonals::Rising,
            Configuration::RegularMirrored => Diagonals::Falling,
            _ => Diagonals::Both,
        };
        Ok(Self { input, observer, u, v, covered, diagonals, fill })
    }

    /// Triangles of a grid of so many cells over the extents, about.
    fn triangles(&self, cells: f64) -> f64 {
        2.0 * cells * self.fill
    }

    fn afford(&self, cells: f64) -> Result<(), EngineError> {
        let (estimate, limit) = (self.triangles(cells), self.input.limits.max_triangles);
        if estimate.is_finite() && estimate <= limit as f64 {
            return Ok(());
        }
        // Saturates: a float beyond u64 becomes its greatest value.
        Err(TriangulationError::TooManyTriangles { estimate: estimate.min(1e18) as u64, limit }.into())
    }

    fn sample(&self, aim: Aim) -> Needs {
        let (u, v, covered) = (self.u.clone(), self.v.clone(), self.covered.clone());
        Needs::sample(self.input.surface, u, v, covered, aim, self.diagonals, self.input.diagonal)
    }

    /// Judges a grid's cells.
    fn judge(&self, u: &[f64], v: &[f64], aim: Aim) -> f64 {
        let rows = self.v.len();
        let all = self.covered.iter().all(|c| c.inside);
        let skip = |u: f64, v: f64| !all && !self.covered[self.u.strip_of(u) * rows + self.v.strip_of(v)].inside;
        check::worst(self.input.surface, u, v, aim, self.diagonals, &skip)
    }

    /// Plans, judges and corrects until the worst cell is close to its allowance.
    fn aim(&self, aim: Aim) -> Result<Planned, EngineError> {
        let mut needs = self.sample(aim);
        if let Some(range) = self.input.limits.clamp {
            return self.clamped(aim, needs, range);
        }
        let mut best: Option<Planned> = None;
        // What the needs were multiplied by, and how the judge's use compares with the foretold one.
        let (mut scale, mut truth) = (1.0, 1.0);
        for _ in 0..ROUNDS {
            self.observer.check()?;
            let mut planned = self.settle(&needs)?;
            let foretell = |needs: &Needs, planned: &Planned, scale: f64| {
                needs.used(&planned.made_u, &planned.made_v, self.diagonals) / scale
            };
            let mut foretold = foretell(&needs, &planned, scale);
            if matches!(aim, Aim::Chord(_)) && foretold > 0.0 {
                // The needs foretell the use: it costs little to correct for that before the judge is asked.
                let off = truth * foretold;
                if off.is_finite() && !(FORETOLD..=1.0).contains(&off) {
                    needs.correct(off / AIMED);
                    scale *= off / AIMED;
                    planned = self.settle(&needs)?;
                    foretold = foretell(&needs, &planned, scale);
                }
            }
            planned.used = self.judge(&planned.u, &planned.v, aim);
            if foretold > 0.0 && planned.used > 0.0 && foretold.is_finite() {
                truth = (planned.used / foretold).clamp(1e-2, 1e2);
            }
            let used = planned.used;
            let stuck = best.as_ref().is_some_and(|b| b.used <= 1.0 && planned.cells() >= b.cells());
            if used <= 1.0 && !stuck || best.as_ref().is_none_or(|b| b.used > 1.0 && used < b.used) {
                best = Some(planned);
            }
            let flat = best.as_ref().is_some_and(|b| b.cells() == 1);
            if stuck || (used <= 1.0 && (used >= CLOSE || flat)) {
                break;
            }
            let factor = if used > 0.0 { (used / AIMED).clamp(1e-2, 1e3) } else { 1e-2 };
            needs.correct(factor);
            scale *= factor;
        }
        best.ok_or_else(|| TriangulationError::NoArea.into())
    }

    /// Lines for the needs: the balanced densities, rounded to whole cells in the way that gives the fewest.
    fn settle(&self, needs: &Needs) -> Result<Planned, EngineError> {
        let densities = balance(needs);
        let count_u = |d: &[f64], scale: f64| lines::count(&needs.u, &needs.breaks_u, d, scale);
        let count_v = |d: &[f64]| lines::count(&needs.v, &needs.breaks_v, d, 1.0);
        let (columns, rows) = (count_u(&densities.u, 1.0), count_v(&densities.v));
        // Each direction alone must be affordable before lines are made.
        self.afford(columns.max(rows))?;
        let whole: f64 = densities.u.iter().enumerate().map(|(i, d)| d * needs.u.width(i)).sum();
        // Cells, columns with the densities that they make, and the rows' densities.
        let mut best: Option<(f64, Columns, Vec<f64>)> = None;
        let few = columns <= FEW_CELLS && needs.breaks_u.is_empty();
        for more in if few { -1..=2 } else { 0..=0 } {
            let cells = columns + f64::from(more);
            if cells < 1.0 {
                continue;
            }
            let scale = if few { cells / whole } else { 1.0 };
            let (u, made) = lines::place(&needs.u, &needs.breaks_u, &densities.u, scale);
            let h = follow(needs, &made, false);
            let product = cells * count_v(&h);
            if product.is_finite() && best.as_ref().is_none_or(|b| product < b.0) {
                best = Some((product, (u, made), h));
            }
        }
        let (product, (u, made_u), h) = best.unwrap_or((f64::INFINITY, (Vec::new(), Vec::new()), Vec::new()));
        self.afford(product)?;
        let (v, made_v) = lines::place(&needs.v, &needs.breaks_v, &h, 1.0);
        Ok(Planned { u, v, used: 0.0, made_u, made_v })
    }

    /// The grid for the needs with its triangles brought into a range; the aim is then a wish.
    fn clamped(&self, aim: Aim, mut needs: Needs, (least, most): (u64, u64)) -> Result<Planned, EngineError> {
        let free = DensityLimits { clamp: None, max_triangles: most };
        let input = DensityInput { limits: free, ..*self.input };
        let planner = Planner {
            input: &input,
            observer: self.observer,
            u: self.u.clone(),
            v: self.v.clone(),
            covered: self.covered.clone(),
            diagonals: self.diagonals,
            fill: self.fill,
        };
        let wished = match planner.aim(aim) {
            Ok(planned) => Some(planned),
            Err(EngineError::Triangulation(TriangulationError::TooManyTriangles { .. })) => None,
            Err(other) => return Err(other),
        };
        match wished {
            Some(planned) if planner.triangles(planned.cells() as f64) >= least as f64 => Ok(planned),
            Some(planned) => self.at_least(&planned, least as f64),
            None => {
                // The number of cells is nearly proportional to the needs.
                for _ in 0..4 * ROUNDS {
                    self.observer.check()?;
                    let d = balance(&needs);
                    let cells = lines::count(&needs.u, &needs.breaks_u, &d.u, 1.0)
                        * lines::count(&needs.v, &needs.breaks_v, &d.v, 1.0);
                    if self.triangles(cells) <= most as f64 {
                        break;
                    }
                    let factor = (CLAMP_MARGIN * most as f64 / self.triangles(cells)).clamp(1e-12, CLAMP_MARGIN);
                    needs.tighten(if factor.is_finite() { factor } else { 1e-12 });
                }
                self.settle(&needs)
            }
        }
    }

    /// A coarse grid with lines added where edges are longest until there are enough triangles.
    fn at_least(&self, coarse: &Planned, least: f64) -> Result<Planned, EngineError> {
        let area = check::surface_area(self.input.surface, &self.u.edges, &self.v.edges);
        if area <= 0.0 {
            return Err(TriangulationError::NoArea.into());
        }
        let wanted = Aim::Edge((4.0 * area * self.fill / least).sqrt());
        let mut needs = self.sample(wanted);
        let lines_of = |axis: &Axis, lines: &[f64]| -> Vec<f64> {
            (0..axis.len())
                .map(|i| {
                    let at = lines.partition_point(|l| *l <= axis.middle(i)).clamp(1, lines.len() - 1);
                    1.0 / (lines[at] - lines[at - 1])
                })
                .collect()
        };
        let base = Densities { u: lines_of(&self.u, &coarse.u), v: lines_of(&self.v, &coarse.v) };
        for _ in 0..4 * ROUNDS {
            self.observer.check()?;
            let mut d = balance(&needs);
            for (x, y) in d.u.iter_mut().zip(&base.u).chain(d.v.iter_mut().zip(&base.v)) {
                *x = x.max(*y);
            }
            let (columns, rows) = (lines::count(&needs.u, &[], &d.u, 1.0), lines::count(&needs.v, &[], &d.v, 1.0));
            self.afford(columns * rows)?;
            let triangles = self.triangles(columns * rows);
            if triangles >= least {
                let (u, made_u) = lines::place(&needs.u, &[], &d.u, 1.0);
                let (v, made_v) = lines::place(&needs.v, &[], &d.v, 1.0);
                return Ok(Planned { u, v, used: 0.0, made_u, made_v });
            }
            needs.tighten((least / triangles).clamp(1.02, 1e3));
        }
        Err(TriangulationError::NoArea.into())
    }

    /// The coarsest chord grid found whose area is within a tolerance, given the surface's area, of the surface's.
    fn area(&self, tolerance: impl Fn(f64) -> f64) -> Result<Planned, EngineError> {
        let exact = check::surface_area(self.input.surface, &self.u.edges, &self.v.edges);
        let tolerance = tolerance(exact);
        // A first guess: the share of the area that may be missing is about the share of the size that may bend.
        let mut chord = self.input.diagonal * (tolerance / exact).clamp(1e-9, 1e-2);
        let mut best: Option<Planned> = None;
        for _ in 0..ROUNDS {
            let mut planned = self.aim(Aim::Chord(chord))?;
            if self.input.limits.clamp.is_some() {
                return Ok(planned);
            }
            let area = check::mesh_area(self.input.surface, &planned.u, &planned.v, self.diagonals);
            planned.used = (area - exact).abs() * self.fill / tolerance;
            let used = planned.used;
            if best
                .as_ref()
                .is_none_or(|b| if used <= 1.0 { b.used > 1.0 || planned.cells() < b.cells() } else { used < b.used })
            {
                best = Some(planned);
            }
            if (CLOSE..=1.0).contains(&used) || used == 0.0 {
                break;
            }
            // The missing area is proportional to the chord distance where the surface bends evenly.
            chord *= (AIMED / used).clamp(1e-3, 30.0);
        }
        best.ok_or_else(|| TriangulationError::NoArea.into())
    }
}
