//! `GET /v1/jobs/{job}/mesh`, `/pattern`, `/report`: by `Accept`, or by suffix.

use axum::body::Body;
use axum::extract::{Path, Request, State};
use axum::http::HeaderMap;
use axum::response::Response;

use super::choice::FAIL;
use super::renderings::{Wanted, rendered};
use super::{Choice, ResultKind};
use crate::api::App;
use crate::api::answer::{Coded, Coding, Form, choose};
use crate::api::jobs::{Failure, absent, id_of};
use crate::api::problem::{Kind, Problem};
use crate::api::request::Query;
use crate::store::{EndedJob, Standing, State as JobState};

/// One handler for each address: the result, and the form where the suffix names it.
macro_rules! handlers {
    ($($(#[$doc:meta])* $name:ident: $kind:ident $($form:ident)?;)*) => {
        $($(#[$doc])*
        pub(crate) async fn $name(
            State(app): State<App>,
            Path(id): Path<String>,
            query: Query,
            request: Request,
        ) -> Result<Response, Problem> {
            let choice = Choice::of(&query, ResultKind::$kind)?;
            let form = None::<Form>$(.or(Some(Form::$form)))?;
            // The headers are moved out, not copied.
            let (parts, _) = request.into_parts();
            show(&app, &id, &parts.headers, ResultKind::$kind, form, choice).await
        })*
    };
}

handlers! {
    /// The mesh.
    mesh: Mesh;
    /// The mesh as GLB.
    mesh_glb: Mesh Glb;
    /// The mesh as OBJ.
    mesh_obj: Mesh Obj;
    /// The mesh as STL.
    mesh_stl: Mesh Stl;
    /// The mesh as PLY.
    mesh_ply: Mesh Ply;
    /// The mesh as JSON.
    mesh_json: Mesh Json;
    /// The pattern.
    pattern: Pattern;
    /// The pattern as SVG.
    pattern_svg: Pattern Svg;
    /// The pattern as DXF.
    pattern_dxf: Pattern Dxf;
    /// The pattern as HPGL.
    pattern_plt: Pattern Plt;
    /// The pattern as JSON.
    pattern_json: Pattern Json;
    /// The report.
    report: Report;
    /// The report as JSON.
    report_json: Report Json;
    /// The mesh's triangles as a table.
    report_csv: Report Csv;
    /// What became of each seed.
    seeds: Seeds;
    /// The same as JSON.
    seeds_json: Seeds Json;
    /// The same as CSV.
    seeds_csv: Seeds Csv;
    /// The mesh's vertices as a table.
    vertices: Vertices;
    /// The same by its suffix.
    vertices_csv: Vertices Csv;
}

async fn show(
    app: &App,
    id: &str,
    headers: &HeaderMap,
    kind: ResultKind,
    form: Option<Form>,
    choice: Choice,
) -> Result<Response, Problem> {
    let form = match form {
        Some(form) => form,
        None => choose(headers, kind.forms())?,
    };
    let standing = app.store().standing(id_of(id)?).await?.ok_or_else(absent)?;
    answer(app, &standing, headers, kind, form, choice).await
}

/// A result of a job in a form.
///
/// # Errors
/// 409 while there is none yet, since the job was cancelled, or for what is cut by where the verdict is `fail` and that was
/// not allowed; 404 when the job has ended without it.
pub(crate) async fn answer(
    app: &App,
    standing: &Standing,
    headers: &HeaderMap,
    kind: ResultKind,
    form: Form,
    choice: Choice,
) -> Result<Response, Problem> {
    let job = match standing {
        Standing::Open(state) => {
            return Err(Problem::new(
                Kind::JobNotEnded,
                format!("The job is {state}; its results come when it has ended."),
            )
            .retry_after(1));
        }
        Standing::Ended(job) if job.state == JobState::Cancelled => {
            return Err(Problem::new(Kind::JobCancelled, "The job was cancelled before it ended."));
        }
        Standing::Ended(job) => job,
    };
    let choice = choice.that_matters(form, job.verdict.as_deref());
    if kind == ResultKind::Pattern && form.is_cut_by() && job.verdict.as_deref() == Some(FAIL) && !choice.allow_fail {
        return Err(rejected(form));
    }
    let head = app.heads().of(job, kind, form, &choice).ok_or_else(|| none(job, kind))?;
    if let Some(answer) = head.tag.not_modified(headers) {
        return Ok(answer);
    }
    let wanted = Wanted { job: job.clone(), kind, form, tag: head.tag.clone(), coding: Coding::choose(headers) };
    let written = rendered(app, wanted).await?.ok_or_else(absent)?;
    let mut response = Response::new(Body::from(written.bytes));
    *response.headers_mut() = head.headers(written.coding);
    // It is in the coding that was chosen, and its tag says so; the compression layer is to leave it so.
    response.extensions_mut().insert(Coded);
    Ok(response)
}

/// The pattern did not keep its limits: it is not given to a cutter by accident.
fn rejected(form: Form) -> Problem {
    let suffix = form.suffix();
    Problem::new(
        Kind::PatternRejected,
        format!(
            "The verdict on this pattern is fail, so its .{suffix} is not given out. The report tells which limits are not kept; \
             pattern.json can be read as it is. Ask for the .{suffix} with ?allow=fail to have it all the same, marked REJECTED."
        ),
    )
}

/// The job has ended without this result.
fn none(job: &EndedJob, kind: ResultKind) -> Problem {
    match Failure::stored(job.id, job.problem.as_ref()) {
        Some(failure) => {
            let detail = format!("The job failed and left no {}: {}", kind.name(), failure.detail);
            Problem::new(Kind::ResultNotFound, detail).stored(failure.code, failure.place, failure.remedies)
        }
        None => Problem::new(Kind::ResultNotFound, format!("A {} job has no {}.", job.kind, kind.name())),
    }
}
