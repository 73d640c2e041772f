//! Forms of results that were written lately, kept in memory up to a number of bytes.
//!
//! A form is named by its tag and its coding, and the tag by everything that its bytes are made of; so what is kept here
//! can never be out of date, and a result that is removed needs no word to this cache: without its job nobody can ask
//! for it. A form that many ask for at once is written once. Whoever asked first may go away; the writing goes on and is
//! kept. A form larger than the whole cache is handed out and not kept.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::body::Bytes;
use quick_cache::sync::{Cache, DefaultLifecycle};
use quick_cache::{DefaultHashBuilder, OptionsBuilder, Weighter};

use super::rendering::{Source, render};
use crate::api::answer::{Coding, Form, Tag};
use crate::api::problem::Problem;
use crate::api::{App, ResultKind};
use crate::store::EndedJob;

/// Bytes that an entry takes beside its own.
const OVERHEAD: u64 = 256;
/// Bytes of a form as one guesses them: it decides how much room the cache keeps for its own records.
const USUAL_FORM: usize = 64 << 10;
/// Shorter forms are not compressed: a packet more or less is all that it could save.
const COMPRESSED_FROM: usize = 1024;

/// A written form, in the coding that it ended up in.
#[derive(Debug, Clone)]
pub(crate) struct Rendered {
    /// The bytes.
    pub(crate) bytes: Bytes,
    /// How they are coded: as asked, or as they are where coding them saves nothing.
    pub(crate) coding: Coding,
}

#[derive(Debug, Clone)]
struct ByLength;

impl Weighter<(Tag, Coding), Rendered> for ByLength {
    fn weight(&self, _: &(Tag, Coding), form: &Rendered) -> u64 {
        form.bytes.len() as u64 + OVERHEAD
    }
}

/// The forms that are kept.
#[derive(Debug)]
pub(crate) struct Renderings {
    forms: Cache<(Tag, Coding), Rendered, ByLength>,
    written: AtomicU64,
}

impl Renderings {
    /// Keeps up to so many bytes.
    pub(crate) fn new(bytes: usize) -> Self {
        // One shard: a form may be as large as the whole cache, and several shards would each have a share only.
        let options = OptionsBuilder::new()
            .shards(1)
            .estimated_items_capacity((bytes / USUAL_FORM).max(16))
            .weight_capacity(bytes as u64)
            .build();
        let (hasher, lifecycle) = (DefaultHashBuilder::default(), DefaultLifecycle::default());
        let forms = match options {
            Ok(options) => Cache::with_options(options, ByLength, hasher, lifecycle),
            // Both capacities are set above; a cache with the usual shards does as well.
            Err(_) => Cache::with(16, bytes as u64, ByLength, hasher, lifecycle),
        };
        Self { forms, written: AtomicU64::new(0) }
    }

    /// How many forms were written from what is stored, or compressed, so far.
    pub(crate) fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    fn count(&self) {
        self.written.fetch_add(1, Ordering::Relaxed);
    }
}

/// What is asked for: a form of a result of a job, in a coding.
#[derive(Debug, Clone)]
pub(super) struct Wanted {
    pub(super) job: Arc<EndedJob>,
    pub(super) kind: ResultKind,
    pub(super) form: Form,
    /// The tag of the form.
    pub(super) tag: Tag,
    pub(super) coding: Coding,
}

/// The form, from memory or newly written. `None`: the result was removed while it was asked for.
///
/// # Errors
/// What the store says; 500 when it cannot be written; 503 when no thread comes free to write it.
pub(super) async fn rendered(app: &App, wanted: Wanted) -> Result<Option<Rendered>, Problem> {
    if let Some(found) = app.renderings().forms.get(&(wanted.tag.clone(), wanted.coding)) {
        return Ok(Some(found));
    }
    // In a task of its own: it is finished and kept also when the client goes away.
    let app = app.clone();
    let written = tokio::spawn(async move {
        match wanted.coding {
            Coding::Identity => plain(&app, &wanted).await,
            _ => coded(&app, &wanted).await,
        }
    });
    written.await.unwrap_or_else(|fault| {
        tracing::error!(%fault, "the task that writes a result ended early");
        Err(Problem::internal())
    })
}

async fn plain(app: &App, wanted: &Wanted) -> Result<Option<Rendered>, Problem> {
    let place = match app.renderings().forms.get_value_or_guard_async(&(wanted.tag.clone(), Coding::Identity)).await {
        Ok(found) => return Ok(Some(found)),
        Err(place) => place,
    };
    let name = wanted.kind.stored_as(wanted.form);
    let Some((_, bytes)) = app.store().result(wanted.job.id, name).await? else { return Ok(None) };
    let source =
        Source { kind: wanted.kind, bytes, labels: wanted.job.labels.clone(), verdict: wanted.job.verdict.clone() };
    let form = wanted.form;
    let bytes = app.on_a_thread(move || render(&source, form)).await?;
    app.renderings().count();
    let rendered = Rendered { bytes, coding: Coding::Identity };
    // Nobody removes what is kept here, so the place is still there.
    let _ = place.insert(rendered.clone());
    Ok(Some(rendered))
}

async fn coded(app: &App, wanted: &Wanted) -> Result<Option<Rendered>, Problem> {
    let place = match app.renderings().forms.get_value_or_guard_async(&(wanted.tag.clone(), wanted.coding)).await {
        Ok(found) => return Ok(Some(found)),
        Err(place) => place,
    };
    let Some(plain) = plain(app, wanted).await? else { return Ok(None) };
    let coding = wanted.coding;
    let rendered = if plain.bytes.len() < COMPRESSED_FROM {
        plain
    } else {
        let bytes = plain.bytes.clone();
        let coded = app
            .on_a_thread(move || {
                coding.encode(&bytes).map_err(|fault| {
                    tracing::error!(%fault, coding = coding.name(), "a result could not be compressed");
                    Problem::internal()
                })
            })
            .await?;
        app.renderings().count();
        if coded.len() < plain.bytes.len() { Rendered { bytes: coded.into(), coding } } else { plain }
    };
    let _ = place.insert(rendered.clone());
    Ok(Some(rendered))
}
