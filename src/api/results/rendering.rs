//! Writing a form of a result from what is stored. The same stored bytes and labels give the same bytes.

use std::collections::BTreeMap;

use axum::body::Bytes;

use super::choice::FAIL;
use super::{Choice, ResultKind};
use crate::api::answer::{Form, Tag};
use crate::api::problem::{Kind, Problem};
use crate::api::surfaces::NAME;
use crate::engine::job::Labels;
use crate::formats::seeds;
use crate::formats::stored::{StoredError, decode_mesh, decode_pattern};
use crate::formats::{
    TitleBlock, WriteError, dxf, file_stem, glb, hpgl, mesh_json, obj, pattern_json, ply, stl, svg, triangles_csv,
    vertices_csv,
};
use crate::store::{Digest, EndedJob};

/// What a form is written from.
#[derive(Debug, Clone)]
pub struct Source {
    /// Which result.
    pub kind: ResultKind,
    /// The stored bytes that the form is written from ([`ResultKind::stored_as`]).
    pub bytes: Bytes,
    /// The job's labels: they stand in the title block.
    pub labels: Labels,
    /// The job's verdict, where it has one: `pass`, `fail` or `unchecked`. A drawing that failed says so.
    pub verdict: Option<String>,
}

/// The tag of a form: of everything that its bytes are made of.
#[must_use]
pub(super) fn tag(digest: Digest, kind: ResultKind, form: Form, choice: &Choice, job: &EndedJob) -> Tag {
    // Several results are written from one that is stored: the digest alone does not tell which.
    let (version, named) = (env!("CARGO_PKG_VERSION").as_bytes(), [kind.name().as_bytes(), form.suffix().as_bytes()]);
    let said = [choice.canonical().as_bytes(), job.verdict.as_deref().unwrap_or_default().as_bytes()];
    let mut parts: Vec<&[u8]> = vec![version, digest.bytes(), named[0], named[1], said[0], said[1]];
    for (key, value) in &job.labels {
        parts.push(key.as_bytes());
        parts.push(value.as_bytes());
    }
    Tag::of(&parts)
}

/// Writes a form. Takes long for a large mesh: not for an async thread.
///
/// # Errors
/// 404 when the form cannot hold so much; 500 when the stored bytes are damaged or hold a number that is not finite: the
/// cause is logged.
pub fn render(source: &Source, form: Form) -> Result<Bytes, Problem> {
    written(source, form).map_err(|fault| {
        let cause = match fault {
            Unwritten::Beyond(detail) => {
                let detail = format!("There is no .{} of this {}: {detail}.", form.suffix(), source.kind.name());
                return Problem::new(Kind::ResultNotFound, detail);
            }
            Unwritten::Broken(cause) => cause,
        };
        tracing::error!(
            cause,
            result = source.kind.name(),
            form = form.suffix(),
            "a result could not be written: {cause}"
        );
        Problem::internal()
    })
}

/// Why a form could not be written.
enum Unwritten {
    /// The form cannot hold so much.
    Beyond(String),
    /// What is stored is not as it should be.
    Broken(String),
}

impl From<WriteError> for Unwritten {
    fn from(fault: WriteError) -> Self {
        match fault {
            WriteError::TooLarge { .. } => Self::Beyond(fault.to_string()),
            _ => Self::Broken(fault.to_string()),
        }
    }
}

impl From<StoredError> for Unwritten {
    fn from(fault: StoredError) -> Self {
        Self::Broken(fault.to_string())
    }
}

fn written(source: &Source, form: Form) -> Result<Bytes, Unwritten> {
    let name = source.labels.get(NAME).map(String::as_str);
    let bytes = match source.kind {
        ResultKind::Report if form != Form::Csv => return Ok(source.bytes.clone()),
        ResultKind::Seeds => {
            let landscape = seeds::decode(&source.bytes)?;
            match form {
                Form::Csv => Ok(seeds::csv(&landscape)),
                _ => seeds::json(&landscape),
            }
        }
        ResultKind::Vertices => {
            let mesh = decode_mesh(&source.bytes)?;
            vertices_csv::write(&mesh.parts())
        }
        ResultKind::Report | ResultKind::Mesh => {
            let mesh = decode_mesh(&source.bytes)?;
            match form {
                Form::Csv => triangles_csv::write(&mesh.parts()),
                Form::Glb => glb::write(&mesh.parts(), name),
                Form::Obj => obj::write(&mesh.parts(), &file_stem(name, "part")),
                Form::Stl => stl::write(&mesh.parts()),
                Form::Ply => ply::write(&mesh.parts()),
                _ => mesh_json::write(&mesh.parts()),
            }
        }
        ResultKind::Pattern => {
            let pattern = decode_pattern(&source.bytes)?;
            let mut others: BTreeMap<String, String> = source.labels.clone();
            others.remove(NAME);
            let title = TitleBlock::new(name, &others).rejecting(source.verdict.as_deref() == Some(FAIL));
            match form {
                Form::Dxf => dxf::write(&pattern, &title),
                Form::Svg => svg::write(&pattern, &title),
                Form::Plt => hpgl::write(&pattern, &title),
                _ => pattern_json::write(&pattern),
            }
        }
    };
    Ok(bytes.map(Bytes::from)?)
}
