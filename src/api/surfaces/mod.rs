//! Surfaces: what was sent in.

mod content;
mod create;
mod delete;
mod document;
mod list;
mod reading;
mod show;

use crate::api::problem::{Kind, Problem};
use crate::store::SurfaceId;

pub(crate) use content::content;
pub(crate) use create::create;
pub(crate) use delete::delete;
pub(crate) use list::list;
pub(crate) use show::show;

pub use document::{NAME, domain_of, labels_of};
pub(crate) use document::{document, domain};
pub use reading::{CheckedSurface, Reading, SurfaceFaults, read};

/// The id of a surface from an address. What is no id names no surface.
fn id_of(text: &str) -> Result<SurfaceId, Problem> {
    text.parse().map_err(|_| absent())
}

/// There is no such surface.
fn absent() -> Problem {
    Problem::new(Kind::SurfaceNotFound, "No surface has this id. Send the surface again; it will have the same id.")
}
