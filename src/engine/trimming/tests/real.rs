//! Real faces: all pass the checklist, and their regions have the known areas.

use glam::DVec3;
use serde_json::Value;

use super::samples::real_faces;
use crate::engine::nurbs::Surface;
use crate::engine::trimming::{CheckedTrims, TrimRegion};

/// The diagonal of the trimmed part, as the file gives it.
fn diagonal(extra: &Value) -> f64 {
    let corners: Vec<f64> = extra["bbox"].as_array().unwrap().iter().flat_map(flat).collect();
    DVec3::from_slice(&corners[..3]).distance(DVec3::from_slice(&corners[3..]))
}

fn flat(value: &Value) -> Vec<f64> {
    value.as_array().map_or_else(|| vec![value.as_f64().unwrap()], |a| a.iter().flat_map(flat).collect())
}

/// The largest distance of the curves from the chords of a region that are not along a line of constant u or v.
fn deviation(trims: &CheckedTrims, region: &TrimRegion, surface: &Surface) -> f64 {
    let mut worst = 0.0_f64;
    for (l, boundary) in region.loops.iter().enumerate().filter(|_| !region.natural) {
        for (k, [a, b]) in boundary.segments().enumerate() {
            if a.x == b.x || a.y == b.y {
                continue;
            }
            let next = boundary.sources[(k + 1) % boundary.sources.len()];
            let from = boundary.sources[k];
            let walked = trims.loops()[l].curves.iter().find(|c| c.curve == from.curve as usize).unwrap();
            let to = if next.curve == from.curve && (next.t - from.t) * (walked.t_end - walked.t_start) > 0.0 {
                next.t
            } else {
                walked.t_end
            };
            let (p, q) = (surface.point(a.x, a.y), surface.point(b.x, b.y));
            for i in 1..40 {
                let uv = trims.point(l, from.curve as usize, from.t + (to - from.t) * f64::from(i) / 40.0);
                let x = surface.point(uv.x, uv.y);
                let along = ((x - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
                worst = worst.max(x.distance(p.lerp(q, along)));
            }
        }
    }
    worst
}

#[test]
fn every_real_face_passes_and_its_chords_are_within_the_tolerance() {
    let mut wrong = Vec::new();
    for (name, face, extra) in real_faces() {
        let trims = match face.check() {
            Ok(trims) => trims,
            Err(errors) => {
                wrong.push(format!("{name}: {errors:?}"));
                continue;
            }
        };
        for relative in [1e-3, 1e-4] {
            let tolerance = relative * diagonal(&extra);
            let region = trims.polygonise(&face.surface, tolerance).unwrap();
            let off = deviation(&trims, &region, &face.surface);
            if off > 1.05 * tolerance {
                wrong.push(format!("{name} at {relative}: off by {} of the tolerance", off / tolerance));
            }
            for boundary in &region.loops {
                assert_eq!(boundary.signed_area() > 0.0, boundary.depth % 2 == 0, "{name}");
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_regions_of_real_faces_have_the_known_share_of_the_domain() {
    let mut wrong = Vec::new();
    for (name, face, extra) in real_faces() {
        let trims = face.check().unwrap();
        let domain = face.surface.domain();
        let whole = (domain.u[1] - domain.u[0]) * (domain.v[1] - domain.v[0]);
        let region = trims.polygonise(&face.surface, 1e-6 * diagonal(&extra)).unwrap();
        let plane = face.surface.control().len() == 4 && extra["orig_type"] == "Plane";
        // Of a plane the area in space is known to 1e-6; the share of the domain was sampled with less care.
        let (got, known, tolerance) = if plane {
            let (_, su, sv) = face.surface.first_derivatives(domain.u[0], domain.v[0]);
            (region.area() * su.cross(sv).length(), extra["area_occt"].as_f64().unwrap(), 1e-4)
        } else {
            (region.area() / whole, extra["uv_fill"].as_f64().unwrap(), 1e-4)
        };
        let difference = got / known - 1.0;
        if difference.abs() > 1e-6 {
            println!("{name}: {difference:+.1e} ({})", if plane { "area" } else { "share of the domain" });
        }
        if difference.abs() > tolerance {
            wrong.push(format!("{name}: {difference:+.3e}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
