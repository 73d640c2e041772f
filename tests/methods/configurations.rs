//! Every real surface on a whole grid, with diagonals fitted and by chance and with skewed points: a sound mesh of the surface.

use std::path::Path;

use planish::engine::budget::Unobserved;
use planish::engine::job::{JobKind, JobOptions};
use planish::engine::mesh::Topology;
use planish::engine::pipeline;
use planish::formats::surface::{self, Geometry, Reading};
use serde_json::{Value, json};

const GRID: [u64; 2] = [24, 24];
/// Share of its area that a surface may be off its mesh by, at this density; the roughest of the faces are nearly closed tubes.
const AREA: f64 = 0.1;

#[test]
fn every_real_surface_has_a_sound_mesh_with_any_diagonals_and_skew() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: there is no folder {}", folder.display());
        return;
    };
    let mut paths: Vec<_> = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some()).collect();
    paths.sort();
    let mut wrong = Vec::new();
    for path in &paths {
        let name = path.file_stem().unwrap().to_string_lossy();
        let geometry = surface::geometry(&std::fs::read(path).unwrap(), Reading::default()).unwrap();
        let skew = json!({ "u_percent": 60, "v_percent": -60, "v_along": "last" });
        let of = |settings: Value| faults(&geometry, settings).err().map(|fault| format!("{name}: {fault}"));
        wrong.extend(of(json!({ "configuration": "fitted" })));
        wrong.extend(of(json!({ "configuration": "random", "random_seed": 11 })));
        wrong.extend(of(json!({ "skew": skew })));
        wrong.extend(of(json!({ "configuration": "fitted", "skew": skew })));
    }
    assert!(paths.len() > 10 && wrong.is_empty(), "{wrong:#?}");
}

/// What is wrong with the triangulation of a surface with these settings.
fn faults(geometry: &Geometry, mut settings: Value) -> Result<(), String> {
    settings["method"] = json!("grid");
    settings["grid"] = json!(GRID);
    let options: JobOptions = serde_json::from_value(json!({ "triangulation": settings })).unwrap();
    let outcome = pipeline::run(JobKind::Triangulate, geometry.input(), &options, &Unobserved)
        .map_err(|failure| failure.error.to_string())?;
    let found = outcome.report.triangulation;
    let most = 2 * (GRID[0] - 1) * (GRID[1] - 1);
    // A pole takes the triangles that vanish in it.
    if found.triangles > most || found.triangles < most - 4 * GRID[0] {
        return Err(format!("{} triangles", found.triangles));
    }
    let off = (found.area_mm2 - found.surface_area_mm2).abs() / found.surface_area_mm2;
    // Skewed rows of slender cells fold the mesh as Schwarz's lantern does: its area then says nothing of its soundness.
    let skewed = options.triangulation.skew.is_some();
    if off.is_nan() || (off > AREA && !skewed) {
        return Err(format!("its area is off by {off:.2e}"));
    }
    let curvature = found.curvature.ok_or("nothing is told of its curvature")?;
    let (topology, edges_at_fault) = Topology::cut(&outcome.mesh.triangles, outcome.mesh.positions.len()).unwrap();
    if !edges_at_fault.is_empty() {
        return Err(format!("{edges_at_fault:?}"));
    }
    let mut inner = vec![true; outcome.mesh.positions.len()];
    topology.borders().flatten().for_each(|&h| inner[topology.origin(h) as usize] = false);
    let inner = inner.iter().filter(|inner| **inner).count() as u64;
    let valencies: u64 = curvature.valencies.iter().map(|(_, vertices)| vertices).sum();
    if [curvature.vertices, valencies] != [inner; 2] || !curvature.integral.is_finite() {
        return Err(format!("{inner} interior vertices, {curvature:?}"));
    }
    Ok(())
}
