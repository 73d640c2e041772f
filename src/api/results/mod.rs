//! Results: what came out of a job, in the form that is asked for.

mod kinds;
mod rendering;
mod show;

pub use kinds::ResultKind;
pub(crate) use rendering::tag;
pub use rendering::{Source, render};
pub(crate) use show::{
    answer, mesh, mesh_glb, mesh_json, pattern, pattern_dxf, pattern_json, pattern_svg, report, report_json,
};
