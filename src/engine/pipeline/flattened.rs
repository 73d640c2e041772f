//! The second half of the way: seeds are chosen, pieces are flattened one by one, each in its own
//! coordinates: the pattern lays them side by side.

use glam::{DVec2, DVec3};

use super::centred::Centred;
use super::meshed::Meshed;
use crate::engine::budget::{Observer, Stage};
use crate::engine::distortion::SeedSearchReport;
use crate::engine::error::EngineError;
use crate::engine::flattening::{FlatteningError, LevelCounts, SeedChoice, cader};
use crate::engine::job::JobOptions;
use crate::engine::mesh::{Mesh, Piece, Topology, pieces};
use crate::engine::seed::{locate, search};

/// Meshes of at most so many triangles have every seed tried when none is named: the search takes time with the square
/// of their number, and this much is done in well under a second on two cores.
pub const OPTIMUM_UP_TO: usize = 8000;

/// A mesh in the plane, all pieces of it.
pub(super) struct Laid {
    /// A place for each vertex; NaN where there is none.
    pub flat: Vec<DVec2>,
    /// The seed of the first piece, as a triangle of the whole mesh.
    pub seed: u32,
    /// How the seed was chosen, the default filled in.
    pub seed_choice: Option<SeedChoice>,
    /// Counts by level of the first piece.
    pub levels: Vec<LevelCounts>,
    /// Points averaged, in all pieces.
    pub averaged: u64,
    /// Triangles flattened, in all pieces.
    pub flattened: u64,
    /// The search, when there was one; of the first piece when there are several.
    pub search: Option<SeedSearchReport>,
    /// What a person should know.
    pub warnings: Vec<String>,
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

/// Flattens all pieces of the mesh. `part` marks the triangles that the seed's choice is judged by.
pub(super) fn flatten(
    meshed: &Meshed,
    options: &JobOptions,
    centred: &Centred,
    part: Option<&[bool]>,
    observer: &dyn Observer,
) -> Result<Laid, Stopped> {
    let mesh = &meshed.lifted.mesh;
    let all = if meshed.topology.piece_count() == 1 { vec![whole(mesh)] } else { pieces(mesh, &meshed.topology) };
    let named = named_seed(meshed, options, centred, part)?;
    let mut laid = Laid {
        flat: vec![DVec2::NAN; mesh.positions.len()],
        seed: 0,
        seed_choice: options.flattening.seed,
        levels: Vec::new(),
        averaged: 0,
        flattened: 0,
        search: None,
        warnings: Vec::new(),
    };
    let several = all.len() > 1;
    for (number, piece) in all.iter().enumerate() {
        observer.check()?;
        let own_topology;
        let topology = if several {
            own_topology = Topology::new(&piece.mesh).map_err(|e| EngineError::from(FlatteningError::from(e)))?;
            &own_topology
        } else {
            &meshed.topology
        };
        // A seed that names a triangle belongs to one piece; the others take the default.
        let own = named.and_then(|seed| piece.triangle_of.binary_search(&seed).ok()).map(|seed| seed as u32);
        let job = PieceJob { piece, topology, options, part, seed: own, first: number == 0 };
        let (flat, error) = job.flatten(observer, &mut laid)?;
        if let Some(error) = error {
            if several && options.skip_bad_pieces {
                laid.warnings.push(format!("piece {number} is left out: {error}"));
                continue;
            }
            place_piece(&mut laid.flat, piece, &flat);
            return Err(Stopped { error: whole_mesh(error, piece).into(), partial: Some(Box::new(laid)) });
        }
        place_piece(&mut laid.flat, piece, &flat);
    }
    Ok(laid)
}

/// The seed as a triangle of the whole mesh, where the options name one.
fn named_seed(
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
        Some(SeedChoice::Xyz(xyz)) => locate::by_xyz(mesh, DVec3::from(xyz) - centred.offset)?,
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
    part: Option<&'a [bool]>,
    seed: Option<u32>,
    first: bool,
}

impl PieceJob<'_> {
    /// The piece in its own coordinates, and why that is partial, if it is.
    fn flatten(
        &self,
        observer: &dyn Observer,
        laid: &mut Laid,
    ) -> Result<(Vec<DVec2>, Option<FlatteningError>), EngineError> {
        let mesh = &self.piece.mesh;
        let readings = self.options.flattening.readings;
        let (seed, failed) = self.choose(observer, laid)?;
        observer.enter(Stage::Flattening);
        observer.check()?;
        let (flattening, error) = cader::flatten_once(mesh, self.topology, readings, seed)?;
        laid.flattened += flattening.sequence.len() as u64;
        laid.averaged += flattening.levels.iter().map(|l| u64::from(l.averaged)).sum::<u64>();
        if self.first {
            laid.seed = self.piece.triangle_of[seed as usize];
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
        let settings = search::SearchSettings {
            readings: self.options.flattening.readings,
            measure: self.options.search.measure,
            part: self.part,
            landscape: false,
        };
        match search::search(mesh, self.topology, &settings, observer) {
            Ok(found) => {
                if self.first {
                    laid.search = Some(found.report());
                }
                Ok((found.best, None))
            }
            Err(EngineError::Flattening(error @ FlatteningError::NoSeed { .. })) => {
                let seed = match &error {
                    FlatteningError::NoSeed { furthest, .. } => match furthest.as_ref() {
                        FlatteningError::Flipped { seed, .. } => *seed,
                        _ => 0,
                    },
                    _ => 0,
                };
                Ok((seed, Some(error)))
            }
            Err(error) => Err(error),
        }
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
        other => other,
    }
}
