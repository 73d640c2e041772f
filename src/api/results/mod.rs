//! Results: what came out of a job, in the form that is asked for.

mod choice;
mod heads;
mod kinds;
mod rendering;
mod renderings;
mod show;

pub(crate) use choice::Choice;
pub(crate) use heads::Heads;
pub use kinds::ResultKind;
pub use rendering::{Source, render};
pub(crate) use renderings::Renderings;
pub(crate) use show::{
    answer, mesh, mesh_glb, mesh_json, mesh_obj, mesh_ply, mesh_stl, pattern, pattern_dxf, pattern_json, pattern_plt,
    pattern_svg, report, report_csv, report_json, seeds, seeds_csv, seeds_json, vertices, vertices_csv,
};
