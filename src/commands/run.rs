//! `planish run KIND SURFACE_FILE --out DIR`: one job on files, without a server, by the same code.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context as _, bail};
use axum::body::Bytes;
use clap::Args;
use planish::api::parameters::{self, JobRequest};
use planish::api::problem::{Kind, Problem};
use planish::api::{CheckedSurface, Form, NAME, ResultKind, Source, render};
use planish::engine::budget::{Observer, Stage};
use planish::engine::distortion::{Verdict, VerdictResult};
use planish::engine::job::{JobKind, Labels};
use planish::engine::pipeline::{self, Outcome};
use planish::formats::stored::{encode_mesh, encode_pattern};
use planish::formats::{MeshParts, report_json, seeds};
use serde_json::{Value, json};

use super::input::{SurfaceArguments, file};
use super::{FAILED, USAGE, VERDICT_FAIL, complain, complain_of, say};

/// What `run` takes.
#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    /// The kind of work: triangulate, flatten or optimum-seed-search
    #[arg(value_parser = kind)]
    kind: JobKind,
    #[command(flatten)]
    surface: SurfaceArguments,
    /// File with the job's parameters, as POST /v1/jobs takes them
    #[arg(long, value_name = "JOB.json")]
    job: Option<PathBuf>,
    /// A parameter by its dotted name, as in flattening.seed=centre; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Folder for the report and every form of the results; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Tells a search when its budget is spent.
struct Watch(Mutex<(Option<Stage>, Instant)>);

impl Watch {
    fn new() -> Self {
        Self(Mutex::new((None, Instant::now())))
    }
}

impl Observer for Watch {
    fn enter(&self, stage: Stage) {
        let mut now = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // Further pieces are searched in what the first one has left of the time.
        if now.0 != Some(Stage::SeedSearch) && stage == Stage::SeedSearch {
            *now = (Some(stage), Instant::now());
        }
    }

    fn out_of_time(&self, budget_s: f64) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).1.elapsed().as_secs_f64() >= budget_s
    }
}

fn kind(text: &str) -> Result<JobKind, String> {
    serde_json::from_value(Value::from(text)).map_err(|error| error.to_string())
}

/// Does the job and writes what comes out.
pub(crate) fn run(arguments: &RunArguments) -> anyhow::Result<ExitCode> {
    let bytes = arguments.surface.bytes()?;
    let surface = match planish::api::read(&bytes, arguments.surface.reading(), "") {
        Ok(surface) => surface,
        Err(faults) => {
            complain_of(&faults.into_problem(&bytes), &arguments.surface.name());
            return Ok(ExitCode::from(FAILED));
        }
    };
    let request = match request(arguments, &surface)? {
        Ok(request) => request,
        Err(problem) => {
            complain_of(&problem, "planish run");
            return Ok(ExitCode::from(USAGE));
        }
    };
    let mut labels = planish::api::labels_of(&surface.new.summary, surface.new.name.as_deref());
    labels.extend(request.labels);
    fs::create_dir_all(&arguments.out).with_context(|| format!("{} cannot be made", arguments.out.display()))?;
    match pipeline::run(arguments.kind, surface.geometry.input(), &request.options, &Watch::new()) {
        Ok(outcome) => {
            say(&write(&arguments.out, &outcome, &labels)?).context("standard output cannot be written")?;
            let verdict = outcome.report.verdict.unwrap_or_default();
            if verdict.result != VerdictResult::Fail {
                return Ok(ExitCode::SUCCESS);
            }
            complain(&broken(&verdict));
            Ok(ExitCode::from(VERDICT_FAIL))
        }
        Err(failure) => {
            if let Some(partial) = &failure.partial {
                say(&write(&arguments.out, partial, &labels)?).context("standard output cannot be written")?;
            }
            let problem = Problem::new(Kind::JobFailed, failure.error.to_string()).located(&failure.error);
            complain_of(&problem, &arguments.surface.name());
            Ok(ExitCode::from(FAILED))
        }
    }
}

/// The job: the file's parameters, then the settings of the command line; checked on this surface.
fn request(arguments: &RunArguments, surface: &CheckedSurface) -> anyhow::Result<Result<JobRequest, Problem>> {
    let mut job = match &arguments.job {
        None => json!({}),
        Some(path) => {
            serde_json::from_slice(&file(path)?).with_context(|| format!("{} is not JSON", path.display()))?
        }
    };
    let mut faults = Vec::new();
    for assignment in &arguments.set {
        faults.extend(parameters::assign(&mut job, assignment).err().map(|fault| *fault));
    }
    // What is absent depends on the kind of work, which the command line names.
    if let Value::Object(job) = &mut job {
        job.entry("kind").or_insert_with(|| json!(arguments.kind));
    }
    let (request, read) = parameters::read(job);
    faults.extend(read);
    if request.kind.is_some_and(|kind| kind != arguments.kind) {
        bail!("the job's file names another kind of work than the command line");
    }
    faults.extend(parameters::check_kind(arguments.kind, &request.options));
    faults.extend(parameters::check(&request.options, planish::api::domain_of(&surface.new.summary)));
    if faults.is_empty() {
        return Ok(Ok(request));
    }
    Ok(Err(Problem::new(Kind::InvalidParameters, "The job's parameters have faults.").with_faults(faults)))
}

/// The limits that are not kept, in a line.
fn broken(verdict: &Verdict) -> String {
    let failed = verdict.limits.iter().filter(|limit| !limit.ok);
    let list: Vec<String> =
        failed.map(|l| format!("{} is {:.4} ({}), the limit is {}", l.name, l.value, l.of, l.limit)).collect();
    // Where every limit is kept it is an overlap that fails.
    let reason = if list.is_empty() { "the pattern lies on itself".to_owned() } else { list.join("; ") };
    format!("verdict fail: {reason}")
}

/// Writes the report and every form of the results; gives a line that names the files.
fn write(folder: &Path, outcome: &Outcome, labels: &Labels) -> anyhow::Result<String> {
    let report = report_json::write(&outcome.report).context("the report cannot be written")?;
    let mesh = encode_mesh(&MeshParts::from(outcome));
    let mut stored = vec![(ResultKind::Report, Bytes::from(report)), (ResultKind::Mesh, Bytes::from(mesh))];
    stored.extend(outcome.pattern.as_ref().map(|pattern| (ResultKind::Pattern, Bytes::from(encode_pattern(pattern)))));
    stored.extend(outcome.seeds.as_ref().map(|found| (ResultKind::Seeds, Bytes::from(seeds::encode(found)))));
    // Whoever runs the program sees its exit code; the drawings say it too.
    let verdict = outcome.report.verdict.as_ref().and_then(|verdict| word(verdict.result));
    let mut files = Vec::new();
    for kind in ResultKind::ALL {
        for form in kind.forms() {
            let name = kind.stored_as(*form);
            let Some((_, bytes)) = stored.iter().find(|(kind, _)| kind.name() == name) else { continue };
            let source = Source { kind, bytes: bytes.clone(), labels: labels.clone(), verdict: verdict.clone() };
            files.extend(write_form(folder, &source, *form)?);
        }
    }
    Ok(format!("{}: {}", folder.display(), files.join(", ")))
}

/// The verdict's word, as the service stores it.
fn word(result: VerdictResult) -> Option<String> {
    serde_json::to_value(result).ok()?.as_str().map(str::to_owned)
}

/// Writes a form; none, and a word on standard error, where the form cannot hold so much.
fn write_form(folder: &Path, source: &Source, form: Form) -> anyhow::Result<Option<String>> {
    let name = format!("{}.{}", source.kind.name(), form.suffix());
    let bytes = match render(source, form) {
        Ok(bytes) => bytes,
        Err(problem) => {
            complain_of(&problem, &name);
            if problem.kind() == Kind::ResultNotFound {
                return Ok(None);
            }
            bail!("{name} of {:?} could not be written", source.labels.get(NAME));
        }
    };
    let path = folder.join(&name);
    fs::write(&path, bytes).with_context(|| format!("{} cannot be written", path.display()))?;
    Ok(Some(name))
}
