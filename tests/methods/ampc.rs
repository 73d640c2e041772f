//! Every real surface along its lines of curvature, by every setting: a conforming mesh of the whole domain, or refused in
//! words with a remedy.

use std::collections::BTreeMap;
use std::path::Path;

use planish::engine::budget::Unobserved;
use planish::engine::error::Located;
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::mesh::{Topology, measures};
use planish::engine::pipeline::{self, Input};
use planish::engine::triangulation::ampc::{AmpcBorder, AmpcFamilies, AmpcOptions, Integration, ampc};
use planish::engine::triangulation::{Configuration, check_domain_mesh, grid_mesh, lift};
use planish::engine::trimming::TrimRegion;
use planish::formats::surface::{self, Geometry, Reading};
use serde_json::json;

/// Points along u and v.
const GRID: [u32; 2] = [40, 40];

/// How much farther from the surface's area than a uniform grid of as many points a mesh may be: lines that fan out or lean
/// leave wider cells.
const TIMES_GRID: f64 = 8.0;
/// The share of the area that both may be off, where the grid is exact: beyond it a job is warned.
const OFF: f64 = pipeline::AREA_WARNING;

fn settings() -> Vec<(String, AmpcOptions)> {
    let mut all = Vec::new();
    for integration in [Integration::Cells, Integration::RungeKutta] {
        for border in [AmpcBorder::Clamped, AmpcBorder::Free] {
            for families in [AmpcFamilies::One, AmpcFamilies::Both] {
                let name = format!("{integration:?}, {border:?}, {families:?}");
                all.push((name, AmpcOptions { integration, border, families, ..AmpcOptions::default() }));
            }
        }
    }
    all
}

/// Whether a job along these lines is told that its mesh is not the surface.
fn warned(geometry: &Geometry, ampc: &AmpcOptions) -> bool {
    let triangulation = json!({ "method": "ampc", "grid": GRID, "ampc": ampc });
    let options: JobOptions = serde_json::from_value(json!({ "triangulation": triangulation })).unwrap();
    let outcome = pipeline::run(JobKind::Triangulate, geometry.input(), &options, &Unobserved).unwrap();
    outcome.report.warnings.iter().any(|warning| warning.starts_with("the mesh's area"))
}

#[test]
fn every_real_surface_is_covered_whole_along_its_lines_or_refused_with_a_remedy() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: there is no folder {}", folder.display());
        return;
    };
    let mut paths: Vec<_> = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some()).collect();
    paths.sort();
    let mut counts: BTreeMap<String, [usize; 2]> = BTreeMap::new();
    let mut wrong = Vec::new();
    for path in &paths {
        let name = path.file_stem().unwrap().to_string_lossy();
        let geometry = surface::geometry(&std::fs::read(path).unwrap(), Reading::default()).unwrap();
        let Input::Trimmed(part) = geometry.input() else { continue };
        let surface = &part.surface;
        let exact = surface.area(1e-7);
        for (setting, options) in settings() {
            let count = counts.entry(setting.clone()).or_default();
            let made = match ampc(surface, GRID, &options, &Unobserved) {
                Ok(made) => made,
                Err(error) => {
                    count[1] += 1;
                    println!("{name}, {setting}: {error}");
                    if !["no-polyline", "lines-tangle"].contains(&error.code()) || error.remedies().is_empty() {
                        wrong.push(format!("{name}, {setting}: {error}"));
                    }
                    continue;
                }
            };
            count[0] += 1;
            let faults = check_domain_mesh(&made.domain, &TrimRegion::whole(surface.domain()));
            if !faults.is_empty() {
                wrong.push(format!("{name}, {setting}: {:?}", &faults[..faults.len().min(3)]));
            }
            let uniform = lift(surface, grid_mesh(&made.lines, Configuration::Regular, 0), &made.lines);
            let lifted = lift(surface, made.domain, &made.lines);
            if let Err(fault) = Topology::new(&lifted.mesh) {
                wrong.push(format!("{name}, {setting}: {fault}"));
            }
            let off = |mesh| (measures::total_area(mesh) - exact).abs() / exact;
            let (along, grid) = (off(&lifted.mesh), off(&uniform.mesh));
            if along > OFF.max(TIMES_GRID * grid) && !warned(&geometry, &options) {
                wrong.push(format!("{name}, {setting}: area off by {along:.2e}, a uniform grid's by {grid:.2e}"));
            }
        }
    }
    println!("meshed, refused: {counts:#?}");
    assert!(wrong.is_empty(), "{wrong:#?}");
    for (setting, [meshed, refused]) in &counts {
        assert!(refused <= meshed, "{setting}: {meshed} meshed, {refused} refused");
    }
}
