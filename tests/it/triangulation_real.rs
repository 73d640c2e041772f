//! Real faces are triangulated on grids of every kind: each mesh conforms, and its area is the face's.

use planish::engine::{
    budget::Unobserved,
    job::{JobKind, JobOptions},
    nurbs::Surface,
    pipeline::run,
    triangulation::{
        Configuration, Density, GridLines, Lifted, aspect_of, check_domain_mesh, lift, trace, trimmed_area,
    },
    trimming::{TrimRegion, part_box},
};
use planish::formats::surface_json::{ReadOptions, read};

/// Chords of the loops, as a fraction of the control net's diagonal.
const CHORD: f64 = 1e-6;

/// Areas may differ by this fraction: what the chords of the loops cut off, and what the file itself is off by.
const AREA: f64 = 2e-4;

/// A triangle counts as vanished when its area is below this fraction of the square of its longest edge.
const FLAT: f64 = 1e-12;

/// The faces, by name: bytes and facts.
fn faces() -> Vec<(String, Vec<u8>, serde_json::Value)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/surfaces");
    let Ok(entries) = std::fs::read_dir(folder) else {
        println!("the real faces are not there: nothing triangulated");
        return Vec::new();
    };
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let face = |path: std::path::PathBuf| {
        let bytes = std::fs::read(&path).unwrap();
        let facts = serde_json::from_slice(&bytes).unwrap();
        (path.file_stem().unwrap().to_string_lossy().into_owned(), bytes, facts)
    };
    paths.into_iter().map(face).collect()
}

/// Lines of a grid that is anything but uniform.
fn uneven(surface: &Surface, cells_u: usize, cells_v: usize) -> GridLines {
    let mut lines = GridLines::uniform(surface.domain(), cells_u + 1, cells_v + 1);
    for list in [&mut lines.u, &mut lines.v] {
        let [first, last] = [list[0], list[list.len() - 1]];
        let count = list.len();
        for x in &mut list[1..count - 1] {
            let t = (*x - first) / (last - first);
            *x = first + (last - first) * (0.3 * t + 0.7 * t * t);
        }
    }
    lines
}

/// Everything that must hold of a mesh of a face.
fn check(name: &str, surface: &Surface, region: &TrimRegion, lines: &GridLines) -> Lifted {
    let size = [lines.u.len() - 1, lines.v.len() - 1];
    let traced = trace(lines, region, &Unobserved)
        .unwrap_or_else(|error| panic!("{name} on {size:?}: {error} {error:?}"))
        .with_aspect(aspect_of(surface, lines));
    let domain = traced
        .triangulate(Configuration::Diamond, 0)
        .unwrap_or_else(|error| panic!("{name} on {size:?}: {error} {error:?}"));
    let faults = check_domain_mesh(&domain, region);
    assert!(faults.is_empty(), "{name} on {size:?}: {} faults, {:?}", faults.len(), &faults[..faults.len().min(3)]);
    let lifted = lift(surface, domain, lines);
    // On a few cells the corners of a curved face can be collinear in space; no choice of triangles helps then.
    let fine = size.iter().all(|&cells| cells >= 10);
    for (t, corners) in lifted.mesh.triangles.iter().enumerate().filter(|_| fine) {
        let [a, b, c] = corners.map(|k| lifted.mesh.positions[k as usize]);
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        let area = 0.5 * (b - a).cross(c - a).length();
        assert!(
            area > FLAT * longest,
            "{name} on {size:?}: triangle {t} has area {area}, longest edge {}",
            longest.sqrt()
        );
    }
    lifted
}

#[test]
fn every_real_face_is_triangulated_on_coarse_fine_and_uneven_grids() {
    for (name, bytes, facts) in faces() {
        let face = read(&bytes, &ReadOptions::default()).unwrap_or_else(|faults| panic!("{name}: {faults:?}"));
        let surface = &face.trimmed.surface;
        let [low, high] = surface.bounding_box();
        let region = face.checked.polygonise(surface, CHORD * low.distance(high)).unwrap();
        let expected = facts["extra"]["area_occt"].as_f64().unwrap_or_else(|| facts["area_occt"].as_f64().unwrap());
        for (m, n) in [(1, 1), (2, 3), (10, 10), (37, 5)] {
            check(&name, surface, &region, &GridLines::uniform(surface.domain(), m + 1, n + 1));
        }
        check(&name, surface, &region, &uneven(surface, 12, 17));
        let lines = GridLines::uniform(surface.domain(), 61, 61);
        let lifted = check(&name, surface, &region, &lines);
        let area = trimmed_area(surface, &lifted.domain);
        assert!((area - expected).abs() <= AREA * expected, "{name}: area {area} instead of {expected}");
    }
}

/// The sampled distance may exceed what was asked by this factor: lines are judged on samples of their cells.
const CHORD_SLACK: f64 = 1.05;

/// Areas of meshes come within this fraction of the face's.
const MESH_AREA: f64 = 1e-4;

#[test]
fn distances_are_as_asked_and_areas_converge_on_every_real_face() {
    let mut wrong = Vec::new();
    for (name, bytes, facts) in faces() {
        let exact = facts["extra"]["area_occt"].as_f64().unwrap();
        let part = read(&bytes, &ReadOptions::default()).unwrap().trimmed;
        let checked = part.check().unwrap();
        let [low, high] = part.surface.bounding_box();
        let region = checked.polygonise(&part.surface, 1e-3 * low.distance(high)).unwrap();
        let [low, high] = part_box(&part.surface, &region);
        let mut off = f64::INFINITY;
        for share in [1e-3, 1e-4, 1e-5, 1e-6] {
            if share < 5e-5 && off <= MESH_AREA {
                break;
            }
            let mut options = JobOptions::default();
            options.triangulation.tolerance = Some(Density::ChordRelative(share));
            let report = match run(JobKind::Triangulate, &part, &options, &Unobserved) {
                Ok(outcome) => outcome.report.triangulation,
                Err(failure) => {
                    wrong.push(format!("{name} at {share:e}: {}", failure.error));
                    break;
                }
            };
            off = (report.area_mm2 - exact).abs() / exact;
            let used = report.chord_error_mm / (share * low.distance(high));
            println!("{name} {share:e}: {} triangles, area {off:.1e} off, {used:.2} of the chord", report.triangles);
            if share > 5e-5 && used > CHORD_SLACK {
                wrong.push(format!("{name} at {share:e}: {used} of the chord that was asked"));
            }
            if report.triangles > MOST_TRIANGLES {
                wrong.push(format!("{name} at {share:e}: {} triangles", report.triangles));
            }
        }
        if off > MESH_AREA {
            wrong.push(format!("{name}: the area stays {off:e} off"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Triangles that no face needs for all this.
const MOST_TRIANGLES: u64 = 400_000;
