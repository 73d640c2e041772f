//! The second half of the way: seeds are chosen, pieces are flattened one by one, each in its own
//! coordinates: the pattern lays them side by side.

mod least;
mod of_whole;
mod released;

use glam::{DVec2, DVec3};

pub(super) use self::least::lies_on_itself;
use self::of_whole::{furthest, piece_fault, reason, whole_mesh};
use super::centred::Centred;
use super::constraints::Constraints;
use super::meshed::Meshed;
use crate::engine::budget::{Observer, Stage};
use crate::engine::distortion::{DevelopableReport, InjectiveReport, SeedSearchReport, SolverReport};
use crate::engine::error::EngineError;
use crate::engine::flattening::cader::{self, Stop};
use crate::engine::flattening::energy_release::ReleaseReport;
use crate::engine::flattening::{FlatteningError, FlatteningMethod, LevelCounts, Scheme, SeedChoice};
use crate::engine::job::{JobOptions, SearchStrategy};
use crate::engine::mesh::{Mesh, Piece, Topology, check_sheet, pieces, sheet as sheet_of};
use crate::engine::pattern::Hold;
use crate::engine::seed::{SeedLandscape, SeedOutcome, SeedSearch, locate, search};

/// Meshes of at most so many triangles have every seed tried when none is named, larger ones the predicted: the search of all
/// takes time with the square of their number, and this much is done in well under a second on two cores.
pub const OPTIMUM_UP_TO: usize = 8000;

/// The same by the scheme of the readings: a run by `symmetric` takes some 60 times as long as one in turn.
#[must_use]
pub const fn optimum_up_to(scheme: Scheme) -> usize {
    match scheme {
        Scheme::InTurn => OPTIMUM_UP_TO,
        Scheme::Symmetric => OPTIMUM_UP_TO / 8,
    }
}

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
    /// How far averaging moved each vertex, mm, by the method that averages; NaN where there is none.
    pub movement: Option<Vec<f64>>,
    /// Triangles flattened, in all pieces.
    pub flattened: u64,
    /// How the map of least energy was found, with the area that its mean is over, in all pieces that needed one.
    pub solver: Option<(SolverReport, f64)>,
    /// What it took that no piece lies on itself, where that was asked for, with the area that its means are over.
    pub injective: Option<(InjectiveReport, f64)>,
    /// The kind and the strain of what lies flat without strain.
    pub developable: Option<DevelopableReport>,
    /// How energy was released, in all pieces; the history is that of the first.
    pub release: Option<ReleaseReport>,
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
            movement: None,
            flattened: 0,
            solver: None,
            injective: None,
            developable: None,
            release: None,
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
        Some(SeedChoice::Vertices(corners)) => locate::by_vertices(mesh, corners)?,
        Some(SeedChoice::Xyz(xyz)) => locate::by_xyz(mesh, DVec3::from(xyz) - centred.home.offset)?,
        Some(SeedChoice::Centre) if meshed.topology.piece_count() == 1 => locate::centre(mesh, part)?,
        Some(SeedChoice::Centre | SeedChoice::Optimum | SeedChoice::Predicted) | None => return Ok(None),
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
            FlatteningMethod::Mccartney | FlatteningMethod::Wang => self.released(observer, laid),
        }
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
        let movement = laid.movement.get_or_insert_with(|| vec![f64::NAN; laid.flat.len()]);
        for (&v, &moved) in self.piece.vertex_of.iter().zip(&flattening.movement) {
            movement[v as usize] = moved;
        }
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
        let choice = match self.options.flattening.seed {
            Some(choice @ (SeedChoice::Optimum | SeedChoice::Predicted | SeedChoice::Centre)) => choice,
            _ if self.options.search.strategy == SearchStrategy::Predicted => SeedChoice::Predicted,
            _ if mesh.triangles.len() <= optimum_up_to(self.options.flattening.readings().scheme) => {
                SeedChoice::Optimum
            }
            _ => SeedChoice::Predicted,
        };
        if self.first && self.options.flattening.seed.is_none() {
            laid.seed_choice = Some(choice);
        }
        let mut options = self.options.search;
        match choice {
            SeedChoice::Centre => return Ok((locate::centre(mesh, self.part)?, None)),
            SeedChoice::Predicted => options.strategy = SearchStrategy::Predicted,
            _ => {}
        }
        observer.enter(Stage::SeedSearch);
        // The part in the numbers of the piece.
        let part: Option<Vec<bool>> =
            self.part.map(|part| self.piece.triangle_of.iter().map(|&t| part.get(t as usize) == Some(&true)).collect());
        let settings = search::SearchSettings {
            readings: self.options.flattening.readings(),
            options,
            part: part.as_deref(),
            landscape: laid.landscape.is_some(),
        };
        let found = search::search(mesh, self.topology, &settings, observer)?;
        if self.first {
            laid.search = Some(found.report(&self.piece.triangle_of));
        }
        if found.spent {
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
