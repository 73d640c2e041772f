//! The second half of the way: seeds are chosen, pieces are flattened one by one, each in its own
//! coordinates: the pattern lays them side by side.

use glam::{DVec2, DVec3};

use super::centred::Centred;
use super::constraints::Constraints;
use super::meshed::Meshed;
use crate::engine::budget::{Observer, Stage};
use crate::engine::distortion::{self, DevelopableReport, InjectiveReport, SeedSearchReport, SolverReport};
use crate::engine::error::EngineError;
use crate::engine::flattening::cader::{self, Stop};
use crate::engine::flattening::developable::{self, UNFOLDED_STRAIN};
use crate::engine::flattening::isometric::{self, Injective, IsometricOptions};
use crate::engine::flattening::{FlatteningError, FlatteningMethod, LevelCounts, SeedChoice};
use crate::engine::job::JobOptions;
use crate::engine::mesh::{Mesh, MeshFault, Piece, Topology, check_sheet, measures, pieces, sheet as sheet_of};
use crate::engine::pattern::Hold;
use crate::engine::seed::{SeedLandscape, SeedOutcome, SeedSearch, locate, search};

/// Meshes of at most so many triangles have every seed tried when none is named: the search takes time with the square
/// of their number, and this much is done in well under a second on two cores.
pub const OPTIMUM_UP_TO: usize = 8000;

/// A mesh in the plane, all pieces of it.
pub(super) struct Laid {
    /// A place for each vertex; NaN where there is none.
    pub flat: Vec<DVec2>,
    /// The seed of the first piece, as a triangle of the whole mesh, where the method has one.
    pub seed: Option<u32>,
    /// How the seed was chosen, the default filled in.
    pub seed_choice: Option<SeedChoice>,
    /// Counts by level of the first piece.
    pub levels: Vec<LevelCounts>,
    /// Points averaged, in all pieces.
    pub averaged: u64,
    /// Triangles flattened, in all pieces.
    pub flattened: u64,
    /// How the map of least energy was found, with the area that its mean is over, in all pieces that needed one.
    pub solver: Option<(SolverReport, f64)>,
    /// What it took that no piece lies on itself, where that was asked for, with the area that its means are over.
    pub injective: Option<(InjectiveReport, f64)>,
    /// The kind and the strain of what lies flat without strain.
    pub developable: Option<DevelopableReport>,
    /// The search, when there was one; of the first piece when there are several.
    pub search: Option<SeedSearchReport>,
    /// What became of each seed, of all pieces, when that was asked for.
    pub landscape: Option<SeedLandscape>,
    /// What a person should know.
    pub warnings: Vec<String>,
    /// For each piece what settles how it lies; none where nothing is settled.
    pub holds: Vec<Hold>,
}

impl Laid {
    /// These places, and nothing known of how they were found.
    pub(super) const fn at(flat: Vec<DVec2>) -> Self {
        Self {
            flat,
            seed: None,
            seed_choice: None,
            levels: Vec::new(),
            averaged: 0,
            flattened: 0,
            solver: None,
            injective: None,
            developable: None,
            search: None,
            landscape: None,
            warnings: Vec::new(),
            holds: Vec::new(),
        }
    }
}

/// Why not everything lies flat.
pub(super) struct Stopped {
    pub error: EngineError,
    pub partial: Option<Box<Laid>>,
}

impl From<EngineError> for Stopped {
    fn from(error: EngineError) -> Self {
        Self { error, partial: None }
    }
}

/// What is to be flattened.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sheet<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Its topology.
    pub topology: &'a Topology,
    /// True when no edge of the mesh is at fault.
    pub sound: bool,
    /// True when the mesh is the surface itself: that it has no curvature then means that the surface has none.
    pub is_surface: bool,
    /// The seed as a triangle of the whole mesh, where one is named.
    pub seed: Option<u32>,
    /// The triangles that the seed's choice is judged by; `None`: all.
    pub part: Option<&'a [bool]>,
    /// Whether the search runs every seed to its end, to tell of them all.
    pub landscape: bool,
    /// Pins and kept lengths.
    pub constraints: &'a Constraints,
}

/// Flattens all pieces of the mesh. That each can be flattened is looked at before any is.
pub(super) fn flatten(sheet: &Sheet, options: &JobOptions, observer: &dyn Observer) -> Result<Laid, Stopped> {
    let mesh = sheet.mesh;
    let several = sheet.topology.piece_count() > 1;
    let all = if several { pieces(mesh, sheet.topology) } else { vec![whole(mesh)] };
    let mut laid = Laid {
        seed_choice: options.flattening.seed,
        landscape: sheet.landscape.then(|| SeedLandscape {
            measure: options.search.measure,
            seeds: vec![SeedOutcome::Untried; mesh.triangles.len()],
            best: Vec::new(),
        }),
        holds: vec![Hold::Free; all.len()],
        ..Laid::at(vec![DVec2::NAN; mesh.positions.len()])
    };
    let mut first_error = None;
    let mut left_out = |laid: &mut Laid, number: usize, error: FlatteningError| -> Result<(), FlatteningError> {
        if !(several && options.skip_bad_pieces) || sheet.constraints.pin(&all[number]) {
            return Err(error);
        }
        laid.warnings.push(format!("piece {} is left out: {}", number + 1, reason(&error)));
        first_error.get_or_insert(error);
        Ok(())
    };
    let mut topologies = Vec::with_capacity(all.len());
    for (number, piece) in all.iter().enumerate() {
        observer.check()?;
        let own = match (several, sheet.sound) {
            (false, true) => check_sheet(sheet.topology).map(|()| None),
            _ => sheet_of(&piece.mesh).map(Some),
        };
        let own = own.map_err(|fault| piece_fault(fault, piece, number, all.len()));
        match own {
            Ok(own) => topologies.push((number, own)),
            Err(error) => left_out(&mut laid, number, error).map_err(EngineError::from)?,
        }
    }
    let mut lie = 0;
    for (number, own) in &topologies {
        let piece = &all[*number];
        observer.check()?;
        // A seed that names a triangle belongs to one piece; the others take the default.
        let seed = sheet.seed.and_then(|seed| piece.triangle_of.binary_search(&seed).ok()).map(|seed| seed as u32);
        let topology = own.as_ref().unwrap_or(sheet.topology);
        let job = PieceJob {
            piece,
            topology,
            options,
            is_surface: sheet.is_surface,
            part: sheet.part,
            seed,
            first: lie == 0,
            number: *number,
            whole: sheet.topology,
            constraints: sheet.constraints,
        };
        let (flat, error) = match job.flatten(observer, &mut laid) {
            Ok(done) => done,
            Err(EngineError::Flattening(error)) => {
                let error = match error {
                    FlatteningError::Mesh(fault) => piece_fault(fault, piece, *number, all.len()),
                    other => whole_mesh(other, piece),
                };
                left_out(&mut laid, *number, error).map_err(EngineError::from)?;
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        if let Some(error) = error {
            if let Err(error) = left_out(&mut laid, *number, whole_mesh(error, piece)) {
                place_piece(&mut laid.flat, piece, &flat);
                return Err(Stopped { error: error.into(), partial: Some(Box::new(laid)) });
            }
            continue;
        }
        lie += 1;
        place_piece(&mut laid.flat, piece, &flat);
    }
    match first_error {
        Some(error) if lie == 0 => Err(EngineError::from(error).into()),
        _ => Ok(laid),
    }
}

/// Why a piece is left out, without its number.
fn reason(error: &FlatteningError) -> String {
    match error {
        FlatteningError::Piece { fault, .. } => fault.to_string(),
        other => other.to_string(),
    }
}

/// The fault of a piece in the numbers of the whole mesh, with its place.
fn piece_fault(fault: MeshFault, piece: &Piece, number: usize, pieces: usize) -> FlatteningError {
    let mut place = fault.place_in(&piece.mesh);
    let fault = fault.in_whole(piece);
    place.triangle = fault.triangle();
    FlatteningError::Piece { piece: number as u32, pieces: pieces as u32, fault, place: Box::new(place) }
}

/// The seed as a triangle of the whole mesh, where the options name one.
pub(super) fn named_seed(
    meshed: &Meshed,
    options: &JobOptions,
    centred: &Centred,
    part: Option<&[bool]>,
) -> Result<Option<u32>, EngineError> {
    let (mesh, lifted) = (&meshed.lifted.mesh, &meshed.lifted);
    let seed = match options.flattening.seed {
        Some(SeedChoice::Index(seed)) => locate::by_index(mesh, seed)?,
        Some(SeedChoice::Uv(uv)) => {
            let domain = locate::Domain {
                uv: &lifted.domain.uv,
                triangles: &lifted.domain.triangles,
                triangle_of: &lifted.triangle_of,
            };
            locate::by_uv(domain, DVec2::from(uv))?
        }
        Some(SeedChoice::Xyz(xyz)) => locate::by_xyz(mesh, DVec3::from(xyz) - centred.home.offset)?,
        Some(SeedChoice::Centre) if meshed.topology.piece_count() == 1 => locate::centre(mesh, part)?,
        Some(SeedChoice::Centre | SeedChoice::Optimum) | None => return Ok(None),
    };
    Ok(Some(seed))
}

/// One piece and how it is to be flattened.
struct PieceJob<'a> {
    piece: &'a Piece,
    topology: &'a Topology,
    options: &'a JobOptions,
    is_surface: bool,
    part: Option<&'a [bool]>,
    seed: Option<u32>,
    first: bool,
    number: usize,
    /// The topology of all pieces.
    whole: &'a Topology,
    constraints: &'a Constraints,
}

impl PieceJob<'_> {
    /// The piece in its own coordinates, and why that is partial, if it is.
    fn flatten(
        &self,
        observer: &dyn Observer,
        laid: &mut Laid,
    ) -> Result<(Vec<DVec2>, Option<FlatteningError>), EngineError> {
        match self.options.flattening.method() {
            FlatteningMethod::Isometric => Ok((self.isometric(observer, laid)?, None)),
            FlatteningMethod::Cader => self.cader(observer, laid),
        }
    }

    /// The map of least distortion; of a piece without curvature the one without any.
    fn isometric(&self, observer: &dyn Observer, laid: &mut Laid) -> Result<Vec<DVec2>, EngineError> {
        let mesh = &self.piece.mesh;
        observer.enter(Stage::Flattening);
        observer.check()?;
        let pins = self.constraints.pins(self.piece);
        if self.is_surface
            && let Some(unfolded) = developable::unfold(mesh, self.topology, UNFOLDED_STRAIN, observer)?
            && let Some(hold) = pins.hold_exactly(mesh, &unfolded.flat)
        {
            laid.holds[self.number] = hold;
            let free = Free { flat: unfolded.flat, energy: 0.0 };
            return match self.without_overlaps(free, observer, laid)? {
                Continued::Not(flat) => {
                    let strain =
                        laid.developable.as_ref().map_or(unfolded.strain, |all| all.strain.max(unfolded.strain));
                    laid.developable = Some(DevelopableReport { kind: "mesh".to_owned(), strain });
                    laid.flattened += mesh.triangles.len() as u64;
                    Ok(flat)
                }
                Continued::Yes(found) => {
                    Ok(self.solved(found.flat, (found.rounds, found.energy_after), found.converged, laid))
                }
            };
        }
        let objective = self.options.flattening.objective();
        let outline = if self.constraints.asks_for_outline(self.topology) {
            let free = IsometricOptions { objective, ..IsometricOptions::default() };
            outline_of(self.topology, &isometric::flatten(mesh, self.topology, &free, observer)?.flat)
        } else {
            0
        };
        let topologies = (self.whole, self.topology);
        let keep = self.constraints.lengths((self.number, self.piece), topologies, outline);
        let asked = IsometricOptions { objective, pins: pins.to_solve(), keep };
        let found = isometric::flatten(mesh, self.topology, &asked, observer).map_err(|e| pins.whole(mesh, e))?;
        laid.holds[self.number] = pins.solved(mesh, &found.flat);
        let (rounds, energy, converged) = (found.run.rounds, found.run.energy, found.run.converged);
        match self.without_overlaps(Free { flat: found.flat, energy }, observer, laid)? {
            Continued::Not(flat) => Ok(self.solved(flat, (rounds, energy), converged, laid)),
            Continued::Yes(found) => {
                let rounds = rounds + found.rounds;
                Ok(self.solved(found.flat, (rounds, found.energy_after), found.converged, laid))
            }
        }
    }

    /// Notes how a map was found, and gives it back.
    fn solved(&self, flat: Vec<DVec2>, (rounds, energy): (usize, f64), converged: bool, laid: &mut Laid) -> Vec<DVec2> {
        let mesh = &self.piece.mesh;
        laid.flattened += mesh.triangles.len() as u64;
        let area = measures::total_area(mesh);
        let (all, before) =
            laid.solver.get_or_insert((SolverReport { converged: true, ..SolverReport::default() }, 0.0));
        all.rounds += rounds as u64;
        all.converged &= converged;
        all.energy = (all.energy * *before + energy * area) / (*before + area);
        *before += area;
        flat
    }

    /// The map as it is, or, where that is asked for and it lies on itself, one that does not.
    fn without_overlaps(&self, free: Free, observer: &dyn Observer, laid: &mut Laid) -> Result<Continued, EngineError> {
        if !self.options.flattening.injective() {
            return Ok(Continued::Not(free.flat));
        }
        let mesh = &self.piece.mesh;
        let part: Option<Vec<bool>> =
            self.part.map(|part| self.piece.triangle_of.iter().map(|&t| part.get(t as usize) == Some(&true)).collect());
        let asked = IsometricOptions { objective: self.options.flattening.objective(), ..IsometricOptions::default() };
        let found = if lies_on_itself((mesh, self.topology), part.as_deref(), &free.flat, observer)? {
            let found = isometric::flatten_injectively(mesh, self.topology, &asked, &free.flat, observer)?;
            if found.is_none() {
                laid.warnings.push("no map was found that does not lie on itself: the part is too curved".to_owned());
            }
            found
        } else {
            None
        };
        let area = measures::total_area(mesh);
        let (all, before) =
            laid.injective.get_or_insert((InjectiveReport { converged: true, ..InjectiveReport::default() }, 0.0));
        let mean = |all: f64, own: f64| (all * *before + own * area) / (*before + area);
        let own = found.as_ref().map_or([free.energy; 2], |found| [found.energy_before, found.energy_after]);
        all.energy_before = mean(all.energy_before, own[0]);
        all.energy_after = mean(all.energy_after, own[1]);
        *before += area;
        Ok(match found {
            Some(found) => {
                all.continued = true;
                all.rounds += found.rounds as u64;
                all.converged &= found.converged;
                Continued::Yes(Box::new(found))
            }
            None => Continued::Not(free.flat),
        })
    }

    /// Cader's flattening from the seed that was chosen.
    fn cader(
        &self,
        observer: &dyn Observer,
        laid: &mut Laid,
    ) -> Result<(Vec<DVec2>, Option<FlatteningError>), EngineError> {
        let mesh = &self.piece.mesh;
        let readings = self.options.flattening.readings();
        let (seed, failed) = self.choose(observer, laid)?;
        observer.enter(Stage::Flattening);
        observer.check()?;
        let (flattening, error) = cader::flatten_once(mesh, self.topology, readings, seed)?;
        laid.flattened += flattening.sequence.len() as u64;
        laid.averaged += flattening.levels.iter().map(|l| u64::from(l.averaged)).sum::<u64>();
        if self.first {
            laid.seed = Some(self.piece.triangle_of[seed as usize]);
            laid.levels = flattening.levels;
        }
        Ok((flattening.flat, failed.or(error)))
    }

    /// The seed, and the failure of the search when no seed succeeds (the seed is then the one that got furthest).
    fn choose(&self, observer: &dyn Observer, laid: &mut Laid) -> Result<(u32, Option<FlatteningError>), EngineError> {
        let mesh = &self.piece.mesh;
        if let Some(seed) = self.seed {
            return Ok((seed, None));
        }
        let optimum = match self.options.flattening.seed {
            Some(SeedChoice::Optimum) => true,
            Some(SeedChoice::Centre) => false,
            _ => mesh.triangles.len() <= OPTIMUM_UP_TO,
        };
        if self.first && self.options.flattening.seed.is_none() {
            laid.seed_choice = Some(if optimum { SeedChoice::Optimum } else { SeedChoice::Centre });
        }
        if !optimum {
            return Ok((locate::centre(mesh, self.part)?, None));
        }
        observer.enter(Stage::SeedSearch);
        // The part in the numbers of the piece.
        let part: Option<Vec<bool>> =
            self.part.map(|part| self.piece.triangle_of.iter().map(|&t| part.get(t as usize) == Some(&true)).collect());
        let settings = search::SearchSettings {
            readings: self.options.flattening.readings(),
            options: self.options.search,
            part: part.as_deref(),
            landscape: laid.landscape.is_some(),
        };
        let found = search::search(mesh, self.topology, &settings, observer)?;
        if self.first {
            laid.search = Some(found.report(&self.piece.triangle_of));
        }
        if !found.complete() {
            let (tried, seeds) = (found.tried, found.outcomes.len());
            laid.warnings.push(format!("the search ran out of its time: {tried} of {seeds} seeds were tried"));
        }
        if let Some(landscape) = &mut laid.landscape {
            self.enter(&found, landscape);
        }
        match found.best {
            Ok(best) => Ok((best.seed, None)),
            Err(error) => Ok((furthest(&error), Some(error))),
        }
    }

    /// Writes what became of the piece's seeds into the landscape of the whole mesh.
    fn enter(&self, found: &SeedSearch, landscape: &mut SeedLandscape) {
        let triangle_of = &self.piece.triangle_of;
        for (&whole, &outcome) in triangle_of.iter().zip(&found.outcomes) {
            landscape.seeds[whole as usize] = match outcome {
                SeedOutcome::Stopped(Stop::Flipped { triangle, level, flattened }) => {
                    let triangle = triangle_of[triangle as usize];
                    SeedOutcome::Stopped(Stop::Flipped { triangle, level, flattened })
                }
                other => other,
            };
        }
        landscape.best.push(found.best.as_ref().ok().map(|best| triangle_of[best.seed as usize]));
    }
}

/// The seed that got furthest when none succeeds.
fn furthest(error: &FlatteningError) -> u32 {
    match error {
        FlatteningError::Flipped { seed, .. } => *seed,
        FlatteningError::NoSeed { furthest: error, .. } | FlatteningError::BudgetSpent { furthest: error, .. } => {
            furthest(error)
        }
        _ => 0,
    }
}

/// A map that may lie on itself.
struct Free {
    flat: Vec<DVec2>,
    energy: f64,
}

/// What became of it.
enum Continued {
    Not(Vec<DVec2>),
    Yes(Box<Injective>),
}

/// Whether the part of a flat mesh (all of it where none is named) lies on itself anywhere.
///
/// # Errors
/// [`EngineError::Cancelled`] when the observer asks for it.
pub(super) fn lies_on_itself(
    (mesh, topology): (&Mesh, &Topology),
    part: Option<&[bool]>,
    flat: &[DVec2],
    observer: &dyn Observer,
) -> Result<bool, EngineError> {
    let own = part.and_then(|part| {
        let triangles: Vec<[u32; 3]> =
            mesh.triangles.iter().zip(part).filter(|(_, belongs)| **belongs).map(|(t, _)| *t).collect();
        Topology::of_triangles(&triangles, mesh.positions.len()).ok()
    });
    let found = distortion::overlaps(flat, own.as_ref().unwrap_or(topology), observer)?;
    Ok(!(found.complete && found.regions.is_empty()))
}

/// The border that encloses the largest area in the plane, the first of equals.
fn outline_of(topology: &Topology, flat: &[DVec2]) -> usize {
    let area = |border: &[u32]| {
        let origin = border.first().map_or(DVec2::ZERO, |&h| flat[topology.origin(h) as usize]);
        let at = |v: u32| flat[v as usize] - origin;
        border.iter().map(|&h| at(topology.origin(h)).perp_dot(at(topology.target(h)))).sum::<f64>().abs()
    };
    let areas = topology.borders().map(area).enumerate();
    areas.fold((0, f64::NEG_INFINITY), |best, (k, area)| if area > best.1 { (k, area) } else { best }).0
}

/// The mesh as its own only piece.
fn whole(mesh: &Mesh) -> Piece {
    Piece {
        mesh: mesh.clone(),
        vertex_of: (0..mesh.positions.len() as u32).collect(),
        triangle_of: (0..mesh.triangles.len() as u32).collect(),
    }
}

fn place_piece(all: &mut [DVec2], piece: &Piece, flat: &[DVec2]) {
    for (&v, &p) in piece.vertex_of.iter().zip(flat) {
        all[v as usize] = p;
    }
}

/// An error of a piece with the triangles of the whole mesh.
fn whole_mesh(error: FlatteningError, piece: &Piece) -> FlatteningError {
    let of_whole = |t: u32| piece.triangle_of.get(t as usize).copied().unwrap_or(t);
    match error {
        FlatteningError::Flipped { triangle, level, seed, flattened, total, mut place } => {
            place.triangle = place.triangle.map(of_whole);
            FlatteningError::Flipped {
                triangle: of_whole(triangle),
                level,
                seed: of_whole(seed),
                flattened,
                total,
                place,
            }
        }
        FlatteningError::NoSeed { tried, furthest } => {
            FlatteningError::NoSeed { tried, furthest: Box::new(whole_mesh(*furthest, piece)) }
        }
        FlatteningError::BudgetSpent { tried, seeds, furthest } => {
            FlatteningError::BudgetSpent { tried, seeds, furthest: Box::new(whole_mesh(*furthest, piece)) }
        }
        other => other,
    }
}
