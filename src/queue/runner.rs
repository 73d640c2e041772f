//! What the machine runs: the work itself is behind a trait, so that it knows nothing of leases and the machine
//! nothing of geometry.

use std::collections::BTreeMap;

use bytes::Bytes;
use serde_json::Value;

use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::store::{JobId, NewResult, Surface};

/// The work of a job. One value serves all workers.
pub trait Runner: Send + Sync + 'static {
    /// Does the work on the calling thread, which belongs to a rayon pool of its own: `par_iter` stays among this job's
    /// threads. It reports to the observer and stops when that says so. A panic fails this job alone.
    ///
    /// # Errors
    /// [`Failed`] with the problem document, what there is of a result, and whether to try again.
    fn run(&self, task: &Task, observer: &dyn Observer) -> Result<Finished, Failed>;
}

/// A job as its runner sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// The job.
    pub job: JobId,
    /// How often it was started, this time included.
    pub attempt: u32,
    /// What kind of work.
    pub kind: String,
    /// The surface: name, media type, units and how it is to be read.
    pub surface: Surface,
    /// The surface's bytes as they were sent.
    pub content: Bytes,
    /// The parameters as they were asked for.
    pub parameters: Value,
    /// Free key-value strings.
    pub labels: BTreeMap<String, String>,
}

/// Work that was done.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Finished {
    /// What came out.
    pub results: Vec<NewResult>,
    /// `pass`, `fail` or `unchecked`.
    pub verdict: Option<String>,
    /// The parameters with every default filled in.
    pub parameters: Option<Value>,
}

/// Work that could not be done.
#[derive(Debug, Clone, PartialEq)]
pub struct Failed {
    /// The problem document: at least `code`, `title` and `detail`.
    pub problem: Value,
    /// What there is of a result; kept when the job ends failed.
    pub results: Vec<NewResult>,
    /// The parameters with every default filled in.
    pub parameters: Option<Value>,
    /// Whether another attempt could help.
    pub class: FailureClass,
}

/// Whether another attempt could help.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FailureClass {
    /// The same input fails the same way: never tried again.
    Deterministic,
    /// Reading or writing went wrong: tried again while attempts are left.
    Transient,
    /// It stopped because the observer said so; why it did decides.
    Interrupted,
}

impl FailureClass {
    /// The class of an engine error. The engine computes and nothing else, so whatever it cannot do it will not do the
    /// next time either.
    #[must_use]
    pub const fn of(error: &EngineError) -> Self {
        match error {
            EngineError::Cancelled => Self::Interrupted,
            EngineError::Nurbs(_)
            | EngineError::Trimming(_)
            | EngineError::Triangulation(_)
            | EngineError::Flattening(_)
            | EngineError::Parameter { .. } => Self::Deterministic,
        }
    }
}

/// A problem that the machine itself states; the API adds what HTTP wants.
pub(super) fn problem(code: &str, title: &str, detail: &str) -> Value {
    serde_json::json!({ "code": code, "title": title, "detail": detail })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::nurbs::NurbsError;
    use crate::engine::triangulation::TriangulationError;

    #[test]
    fn r5_no_engine_error_is_worth_another_attempt() {
        let deterministic = [
            EngineError::from(NurbsError::Degree { what: "degree_u", degree: 99, max: 25 }),
            EngineError::from(TriangulationError::TooManyTriangles { estimate: 2, limit: 1 }),
            EngineError::Parameter { name: "flattening.seed".to_owned(), detail: "no such triangle".to_owned() },
        ];
        for error in &deterministic {
            assert_eq!(FailureClass::of(error), FailureClass::Deterministic, "{error}");
        }
        assert_eq!(FailureClass::of(&EngineError::Cancelled), FailureClass::Interrupted);
    }
}
