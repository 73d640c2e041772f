//! Every real surface along its lines of curvature, by every setting: a conforming mesh of the whole domain, or refused in
//! words with a remedy.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec2;
use planish::engine::budget::Unobserved;
use planish::engine::error::Located;
use planish::engine::mesh::{Topology, measures};
use planish::engine::nurbs::Domain;
use planish::engine::pipeline::Input;
use planish::engine::triangulation::ampc::{AmpcBorder, AmpcFamilies, AmpcOptions, Integration, ampc};
use planish::engine::triangulation::{Configuration, check_domain_mesh, grid_mesh, lift};
use planish::engine::trimming::{BoundaryLoop, TrimRegion};
use planish::formats::surface::{self, Reading};

/// Points along u and v.
const GRID: [u32; 2] = [40, 40];

/// How much farther from the surface's area than a uniform grid of as many points a mesh may be: lines that fan out or lean
/// leave wider cells.
const TIMES_GRID: f64 = 8.0;
/// The share of the area that both may be off, where the grid is exact.
const OFF: f64 = 5e-3;

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

fn whole(Domain { u, v }: Domain) -> TrimRegion {
    let points = [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])].map(DVec2::from).to_vec();
    let border =
        BoundaryLoop { points, sources: Vec::new(), corners: vec![true; 4], source_loop: None, depth: 0, parent: None };
    TrimRegion { loops: vec![border], natural: true }
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
            let faults = check_domain_mesh(&made.domain, &whole(surface.domain()));
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
            if along > OFF.max(TIMES_GRID * grid) {
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
