//! What an answer with a result says before its bytes: made once for each form of a job's result, and kept.
//!
//! An ended job never changes, and no other job gets its id; so what is kept here can never be out of date. A job that is
//! removed needs no word to this cache: who asks has found the job first.

use std::sync::Arc;

use axum::http::{HeaderMap, HeaderValue, header};
use quick_cache::sync::Cache;

use super::rendering::tag;
use super::{Choice, ResultKind};
use crate::api::answer::{Coding, Form, Tag, disposition};
use crate::api::surfaces::NAME;
use crate::store::{EndedJob, JobId};

/// Heads that are kept: about a kilobyte each. One that is made anew costs some microseconds.
const KEPT: usize = 4096;

/// The tag and the headers of a form of a result.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) tag: Tag,
    /// Those of the bytes as they are.
    headers: HeaderMap,
}

impl Head {
    fn new(job: &EndedJob, kind: ResultKind, form: Form, choice: &Choice) -> Option<Self> {
        let tag = tag(job.result(kind.stored_as(form))?.digest, kind, form, choice, job);
        let stem = job.labels.get("part_number").or_else(|| job.labels.get(NAME)).map_or("", String::as_str);
        // A browser shows what it can show; what is made for other programs is saved.
        let inline = matches!(form, Form::Svg | Form::Json);
        let headers = HeaderMap::from_iter([
            (header::CONTENT_TYPE, HeaderValue::from_static(form.media())),
            (header::ETAG, tag.header()),
            (header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache")),
            (header::VARY, HeaderValue::from_static("accept, accept-encoding")),
            (header::CONTENT_DISPOSITION, disposition(stem, kind.name(), form.suffix(), inline)),
        ]);
        Some(Self { tag, headers })
    }

    /// The headers of the bytes in this coding.
    pub(super) fn headers(&self, coding: Coding) -> HeaderMap {
        let mut headers = self.headers.clone();
        if let Some(name) = coding.header() {
            headers.insert(header::CONTENT_ENCODING, name);
            headers.insert(header::ETAG, self.tag.coded(coding));
        }
        headers
    }
}

/// The heads that are kept.
#[derive(Debug)]
pub(crate) struct Heads(Cache<(JobId, ResultKind, Form, Choice), Arc<Head>>);

impl Heads {
    pub(crate) fn new() -> Self {
        Self(Cache::new(KEPT))
    }

    /// The head of a form of a job's result. `None`: the job has no such result.
    pub(super) fn of(&self, job: &EndedJob, kind: ResultKind, form: Form, choice: &Choice) -> Option<Arc<Head>> {
        let name = (job.id, kind, form, choice.clone());
        if let Some(kept) = self.0.get(&name) {
            return Some(kept);
        }
        let head = Arc::new(Head::new(job, kind, form, choice)?);
        self.0.insert(name, head.clone());
        Some(head)
    }
}
