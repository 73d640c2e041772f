//! Jobs on several stored surfaces: they are composed to one part, which is stored under an id of its own with the job.

use serde_json::Value;

use super::Part;
use super::create::{ABSENT, fault};
use crate::api::App;
use crate::api::problem::{Kind, Problem};
use crate::api::surfaces::{self, Reading};
use crate::formats::composition::Composition;
use crate::formats::faults::Fault;
use crate::store::Surface;

/// Most surfaces of a job. Parts of more faces are sent as one file.
pub(crate) const MAX_SURFACES: usize = 100;

/// Most bytes of all of them, as they were sent (16 MiB): they are held in memory together.
const MAX_BYTES: u64 = 16 << 20;

/// The part that surfaces make, where nothing is wrong with their ids.
///
/// # Errors
/// What the store says; what is wrong with the surfaces together.
pub(super) async fn composed(app: &App, ids: &[String], faults: &mut Vec<Fault>) -> Result<Option<Part>, Problem> {
    let before = faults.len();
    if ids.is_empty() || ids.len() > MAX_SURFACES {
        faults.push(fault("/surfaces", &format!("from 1 to {MAX_SURFACES} surfaces are needed")));
        return Ok(None);
    }
    let mut found: Vec<Surface> = Vec::with_capacity(ids.len());
    for (k, text) in ids.iter().enumerate() {
        let pointer = format!("/surfaces/{k}");
        if ids[..k].contains(text) {
            faults.push(fault(&pointer, "this surface is named twice: name each once"));
            continue;
        }
        let surface = match text.parse() {
            Ok(id) => app.store().surface(&id).await?,
            Err(_) => None,
        };
        match surface {
            Some(surface) => found.push(surface),
            None => faults.push(fault(&pointer, ABSENT)),
        }
    }
    if found.iter().map(|surface| surface.length).sum::<u64>() > MAX_BYTES {
        let detail = format!("these surfaces have more than {} MiB together: send fewer", MAX_BYTES >> 20);
        faults.push(fault("/surfaces", &detail));
    }
    if faults.len() > before {
        return Ok(None);
    }
    let mut contents = Vec::with_capacity(found.len());
    for (k, surface) in found.iter().enumerate() {
        let Some((surface, bytes)) = app.store().surface_content(&surface.id).await? else {
            // It was deleted between two questions.
            faults.push(fault(&format!("/surfaces/{k}"), ABSENT));
            return Ok(None);
        };
        contents.push((surface.reading, bytes));
    }
    let new = app.on_a_thread(move || compose(&contents)).await?;
    match new {
        Ok(new) => Ok(Some(Part::New(Box::new(new)))),
        Err(more) => {
            faults.extend(more);
            Ok(None)
        }
    }
}

/// The part as it is stored.
fn compose(contents: &[(Value, axum::body::Bytes)]) -> Result<Result<crate::store::NewSurface, Vec<Fault>>, Problem> {
    let mut whole = Composition::default();
    for (k, (reading, bytes)) in contents.iter().enumerate() {
        let reading: Reading = serde_json::from_value(reading.clone()).map_err(|error| {
            tracing::error!(%error, "a stored reading could not be read");
            Problem::internal()
        })?;
        if let Err(faults) = whole.add(bytes, reading, &format!("/surfaces/{k}")) {
            return Ok(Err(faults));
        }
    }
    match surfaces::read(&whole.text().into(), Reading::default(), "") {
        Ok(read) => Ok(Ok(read.new)),
        // Each was sound by itself; together they may have too much of something.
        Err(faults) => {
            Err(Problem::new(Kind::InvalidSurface, "The surfaces cannot be one part.").with_faults(faults.0))
        }
    }
}
