//! Ended jobs as their results are read, kept in memory.
//!
//! An ended job never changes: the schema forbids it. So a job that was found to have ended is remembered (a bounded
//! number of them), and reading its results again asks the database nothing. It is forgotten when it is removed.
//!
//! A read that began before a removal must not remember what the removal took away. The cache sees to that: a read takes
//! the place of its job before it asks the database, a removal clears the place after its commit and before it is
//! answered, and a read whose place was cleared cannot fill it any more.

use std::collections::BTreeMap;
use std::sync::Arc;

use quick_cache::sync::Cache;
use serde_json::Value;

use super::{Job, JobId, State, Store, StoreError, StoredResult};

/// Jobs that are remembered: some kilobytes each, and those that are read again and again are few.
const REMEMBERED: usize = 4096;

/// What can change no more of an ended job, as far as its results are concerned.
#[derive(Debug, Clone, PartialEq)]
pub struct EndedJob {
    /// Its name.
    pub id: JobId,
    /// What kind of work.
    pub kind: String,
    /// How it ended.
    pub state: State,
    /// Free key-value strings.
    pub labels: BTreeMap<String, String>,
    /// Why it failed.
    pub problem: Option<Value>,
    /// The verdict on its pattern.
    pub verdict: Option<String>,
    /// What it stored, by name.
    pub results: Vec<StoredResult>,
}

impl EndedJob {
    /// The stored result of this name.
    #[must_use]
    pub fn result(&self, name: &str) -> Option<&StoredResult> {
        self.results.iter().find(|result| result.name == name)
    }
}

/// A job as its results are read.
#[derive(Debug, Clone, PartialEq)]
pub enum Standing {
    /// It has ended.
    Ended(Arc<EndedJob>),
    /// It has not; it stands so.
    Open(State),
}

/// The ended jobs that are remembered.
#[derive(Debug)]
pub(super) struct EndedJobs(Cache<JobId, Arc<EndedJob>>);

impl EndedJobs {
    pub(super) fn new() -> Self {
        Self(Cache::new(REMEMBERED))
    }

    /// Forgets a job, and keeps a read under way from remembering it. Call it after the removal's commit.
    pub(super) fn forget(&self, id: JobId) {
        self.0.remove(&id);
    }
}

impl Store {
    /// A job as its results are read. `None`: there is no such job.
    ///
    /// # Errors
    /// What the database says.
    pub async fn standing(&self, id: JobId) -> Result<Option<Standing>, StoreError> {
        let place = match self.0.ended.0.get_value_or_guard_async(&id).await {
            Ok(ended) => return Ok(Some(Standing::Ended(ended))),
            Err(place) => place,
        };
        let Some(job) = self.job(id).await? else { return Ok(None) };
        if !job.state.has_ended() {
            return Ok(Some(Standing::Open(job.state)));
        }
        let results = self.results(id).await?;
        let Job { id, kind, state, labels, problem, verdict, .. } = job;
        let ended = Arc::new(EndedJob { id, kind, state, labels, problem, verdict, results });
        // Refused when the job was removed meanwhile: then only this one answer has seen it.
        let _ = place.insert(ended.clone());
        Ok(Some(Standing::Ended(ended)))
    }
}
