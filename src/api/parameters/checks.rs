//! Whether the values of a job's parameters have a meaning: each alone, together, and on the surface at hand.

use crate::engine::flattening::energy_release::MAX_MOVES;
use crate::engine::flattening::{
    FlatteningDomain, FlatteningMethod, MAX_KEEP_WEIGHT, MAX_KEEPS, MAX_PINS, MAX_TARGET, PinPlace, SeedChoice,
};
use crate::engine::job::{JobKind, JobOptions, SearchStrategy};
use crate::engine::nurbs::Domain;
use crate::engine::pattern::Align;
use crate::engine::pipeline::MAX_GRID;
use crate::engine::triangulation::ampc::{AmpcOptions, MAX_POINTS};
pub use crate::engine::triangulation::density::MAX_TRIANGLES;
use crate::engine::triangulation::{Configuration, Density, Skew, TriangulationMethod, TriangulationOptions};
use crate::formats::faults::Fault;

use super::{fault, piece};

/// Points of a grid along one direction.
pub const GRID_POINTS: std::ops::RangeInclusive<u32> = 2..=MAX_GRID;
/// A seed or a direction may lie outside the domain by so much of its width and counts as on the border: files and
/// plugins round.
const DOMAIN_SLACK: f64 = 1e-9;

/// Longest budget of a search, seconds: it leaves the rest of a job some time of the ten minutes that it may take.
pub const MAX_BUDGET_S: f64 = 540.0;

/// Every fault of the options on a surface with this domain. An empty list: the job may be queued.
#[must_use]
pub fn check(options: &JobOptions, domain: Option<Domain>) -> Vec<Fault> {
    let mut faults = Vec::new();
    triangulation(options, &mut faults);
    method(options, &mut faults);
    seed(options, domain, &mut faults);
    pins(options, domain, &mut faults);
    keep(options, &mut faults);
    search(options, &mut faults);
    placement(options, &mut faults);
    numbers(options, &mut faults);
    piece::check(options, &mut faults);
    faults
}

fn triangulation(options: &JobOptions, faults: &mut Vec<Fault>) {
    let asked = &options.triangulation;
    if asked.grid.is_some() && asked.tolerance.is_some() {
        faults.push(fault("/triangulation/tolerance", "give either a grid or a tolerance, not both"));
    }
    if let Some(grid) = asked.grid {
        let mut sound = true;
        for (i, points) in grid.iter().enumerate() {
            if !GRID_POINTS.contains(points) {
                sound = false;
                faults.push(fault(
                    format!("/triangulation/grid/{i}"),
                    format!("a grid has {} to {} points along each direction", GRID_POINTS.start(), GRID_POINTS.end()),
                ));
            }
        }
        let triangles = grid_triangles(grid);
        if sound && triangles > MAX_TRIANGLES {
            faults.push(fault(
                "/triangulation/grid",
                format!("this grid gives {triangles} triangles, and at most {MAX_TRIANGLES} are worked on"),
            ));
        }
    }
    if let Some(tolerance) = asked.tolerance {
        let (name, value, greatest) = match tolerance {
            Density::Chord(x) => ("chord", x, f64::MAX),
            Density::ChordRelative(x) => ("chord_relative", x, 1.0),
            Density::Area(x) => ("area", x, f64::MAX),
            Density::AreaRelative(x) => ("area_relative", x, 1.0),
            Density::Edge(x) => ("edge", x, f64::MAX),
        };
        if !(value > 0.0 && value <= greatest) {
            let range = if greatest < f64::MAX { format!(" and at most {greatest}") } else { String::new() };
            faults.push(fault(
                format!("/triangulation/tolerance/{name}"),
                format!("a tolerance is greater than 0{range}"),
            ));
        }
    }
    ampc(asked, faults);
    let of_grid = asked.method == TriangulationMethod::Grid;
    if matches!(asked.configuration, Configuration::Fitted | Configuration::Random) && !of_grid {
        faults.push(fault(
            "/triangulation/configuration",
            "`fitted` and `random` place the diagonals of a whole grid: take the method `grid`",
        ));
    }
    if asked.random_seed.is_some() && asked.configuration != Configuration::Random {
        faults.push(fault("/triangulation/random_seed", "this belongs to the configuration `random`"));
    }
    if let Some(skew) = asked.skew {
        if !of_grid {
            faults.push(fault("/triangulation/skew", "the points of a whole grid are skewed: take the method `grid`"));
        }
        if of_grid && asked.grid.is_none() {
            let detail = "skewed points keep no tolerance: give the `grid` whose points are to be skewed";
            faults.push(fault("/triangulation/skew", detail));
        }
        for (name, percent) in [("u_percent", skew.u_percent), ("v_percent", skew.v_percent)] {
            if percent.is_nan() || percent.abs() >= Skew::LIMIT_PERCENT {
                faults.push(fault(
                    format!("/triangulation/skew/{name}"),
                    format!("a skew is between -{0} and {0} percent, both excluded", Skew::LIMIT_PERCENT),
                ));
            }
        }
    }
    if asked.phase > 1 {
        faults.push(fault("/triangulation/phase", "the phase is 0 or 1"));
    }
}

/// Lines of curvature have settings of their own, and are sampled on a uniform grid.
fn ampc(asked: &TriangulationOptions, faults: &mut Vec<Fault>) {
    if asked.method != TriangulationMethod::Ampc {
        if asked.ampc.is_some() {
            faults.push(fault(
                "/triangulation/ampc",
                "these are settings of the method `ampc`: take it, or leave them out",
            ));
        }
        return;
    }
    for (i, points) in asked.grid.iter().flatten().enumerate() {
        if GRID_POINTS.contains(points) && *points > MAX_POINTS {
            let detail = format!("the method `ampc` samples at most {MAX_POINTS} points along each direction");
            faults.push(fault(format!("/triangulation/grid/{i}"), detail));
        }
    }
    if asked.tolerance.is_some() {
        let detail = "lines of curvature lie where the surface has them, so no tolerance can be promised: give a grid, or nothing";
        faults.push(fault("/triangulation/tolerance", detail));
    }
    if !matches!(asked.configuration, Configuration::Regular | Configuration::Fitted | Configuration::Random) {
        let detail = "the cells between lines of curvature take the configuration `regular`: leave this out";
        faults.push(fault("/triangulation/configuration", detail));
    }
    let settings = asked.ampc.unwrap_or_default();
    if !(2..=AmpcOptions::MAX_STARTS).contains(&settings.starts) {
        let detail = format!("a strip is tried from 2 to {} starts", AmpcOptions::MAX_STARTS);
        faults.push(fault("/triangulation/ampc/starts", detail));
    }
    if !(settings.min_distance_mm >= 0.0 && settings.min_distance_mm.is_finite()) {
        faults.push(fault("/triangulation/ampc/min_distance_mm", "a distance is 0 or greater"));
    }
}

/// Triangles of a whole grid.
pub(super) fn grid_triangles([m, n]: [u32; 2]) -> u64 {
    2 * u64::from(m.saturating_sub(1)) * u64::from(n.saturating_sub(1))
}

/// Whose setting `release` is.
const RELEASES: &str = "energy is released by the methods `mccartney` and `wang`";

/// Each method has settings of its own.
fn method(options: &JobOptions, faults: &mut Vec<Fault>) {
    let asked = &options.flattening;
    let mut foreign = |given: bool, name: &str, detail: &str| {
        if given {
            faults.push(fault(format!("/flattening/{name}"), detail));
        }
    };
    match asked.method() {
        FlatteningMethod::Isometric => {
            foreign(
                asked.seed.is_some(),
                "seed",
                "the method `isometric` has no seed: leave it out, or take the method `cader`",
            );
            foreign(asked.readings.is_some(), "readings", "the readings are those of the method `cader`");
            foreign(asked.release.is_some(), "release", RELEASES);
        }
        FlatteningMethod::Cader => {
            let detail = "this is what the method `isometric` makes least; `cader` (taken here since it is named, or a seed \
                          or readings are) has no choice";
            foreign(asked.objective.is_some(), "objective", detail);
            foreign(asked.weights.is_some(), "weights", detail);
            foreign(
                asked.injective.is_some(),
                "injective",
                "only the method `isometric` goes on to a map that does not lie on itself",
            );
            let detail = "the method `isometric` takes this; `cader` (taken here since it is named, or a seed or readings are) \
                          does not: take `isometric`, or leave this out";
            foreign(!asked.pins().is_empty(), "pins", detail);
            foreign(!asked.keep().is_empty(), "keep", detail);
            foreign(asked.release.is_some(), "release", RELEASES);
        }
        method @ (FlatteningMethod::Mccartney | FlatteningMethod::Wang) => {
            let detail = "the method `isometric` takes this; methods that release energy do not";
            foreign(asked.objective.is_some(), "objective", detail);
            foreign(asked.weights.is_some(), "weights", detail);
            foreign(asked.injective.is_some(), "injective", detail);
            foreign(!asked.pins().is_empty(), "pins", detail);
            foreign(!asked.keep().is_empty(), "keep", detail);
            foreign(asked.readings.is_some(), "readings", "the readings are those of the method `cader`");
            let detail =
                "the optimum is searched for with the method `cader`: take another seed, or none, which is `centre`";
            foreign(matches!(asked.seed, Some(SeedChoice::Optimum | SeedChoice::Predicted)), "seed", detail);
            let release = asked.release.unwrap_or_default();
            let detail = "only `mccartney` moves vertices by a step of its own: leave this out";
            foreign(release.step.is_some() && method == FlatteningMethod::Wang, "release/step", detail);
            let detail = "the step is a share of the edges at a vertex, greater than 0 and at most 1";
            foreign(release.step.is_some_and(|x| !(x > 0.0 && x <= 1.0)), "release/step", detail);
            let detail = "the threshold is an energy in mm, greater than 0";
            foreign(release.threshold.is_some_and(|x| !(x > 0.0 && x.is_finite())), "release/threshold", detail);
            let detail = "at most 1 000 000 000 moves are possible";
            foreign(release.max_moves.is_some_and(|moves| moves > MAX_MOVES), "release/max_moves", detail);
        }
    }
    foreign(
        asked.injective() && !(asked.pins().is_empty() && asked.keep().is_empty()),
        "injective",
        "going on to a map that does not lie on itself would give up pins and kept lengths: leave out the one or the others",
    );
    foreign(
        asked.objective.is_some() && asked.weights.is_some(),
        "weights",
        "give either an objective or weights, not both",
    );
    if let Err(reason) = asked.objective().check() {
        faults.push(fault("/flattening/weights", reason));
    }
}

fn seed(options: &JobOptions, domain: Option<Domain>, faults: &mut Vec<Fault>) {
    match options.flattening.seed {
        Some(SeedChoice::Uv(uv)) => in_domain("/flattening/seed/uv", uv, domain, faults),
        Some(SeedChoice::Index(index)) => {
            // A trimmed mesh may have more triangles than the grid has, and one along lines of curvature too; the mesh of
            // the whole grid never does.
            let whole = match options.triangulation.method {
                TriangulationMethod::Grid => true,
                TriangulationMethod::Tracing => options.domain() == FlatteningDomain::Base,
                TriangulationMethod::Ampc => false,
            };
            if let Some(grid) = options.triangulation.grid
                && whole
                && u64::from(index) >= grid_triangles(grid)
            {
                faults.push(fault(
                    "/flattening/seed",
                    format!("there is no triangle {index}: this grid has {}, counted from 0", grid_triangles(grid)),
                ));
            }
        }
        Some(SeedChoice::Xyz(xyz)) => finite("/flattening/seed/xyz", &xyz, faults),
        Some(SeedChoice::Vertices([a, b, c])) => {
            if a == b || b == c || c == a {
                faults.push(fault("/flattening/seed/vertices", "a triangle has three different vertices"));
            }
        }
        Some(SeedChoice::Centre | SeedChoice::Optimum | SeedChoice::Predicted) | None => {}
    }
}

/// A place must lie in the domain, where there is one.
fn in_domain(pointer: &str, uv: [f64; 2], domain: Option<Domain>, faults: &mut Vec<Fault>) {
    let Some(domain) = domain else { return };
    for (i, (x, [from, to])) in uv.into_iter().zip([domain.u, domain.v]).enumerate() {
        let slack = DOMAIN_SLACK * (to - from);
        if !(x >= from - slack && x <= to + slack) {
            faults.push(fault(
                format!("{pointer}/{i}"),
                format!("{x} is outside the surface's domain, which runs from {from} to {to} here"),
            ));
        }
    }
}

fn pins(options: &JobOptions, domain: Option<Domain>, faults: &mut Vec<Fault>) {
    let pins = options.flattening.pins();
    if pins.len() > MAX_PINS {
        let detail = format!("{} pins: a job has at most {MAX_PINS}", pins.len());
        faults.push(fault("/flattening/pins", detail));
        return;
    }
    for (i, pin) in pins.iter().enumerate() {
        let pointer = format!("/flattening/pins/{i}");
        match pin.at {
            PinPlace::Uv(uv) => {
                finite(&format!("{pointer}/at/uv"), &uv, faults);
                in_domain(&format!("{pointer}/at/uv"), uv, domain, faults);
            }
            PinPlace::Xyz(xyz) => finite(&format!("{pointer}/at/xyz"), &xyz, faults),
        }
        for (k, x) in pin.to_mm.iter().enumerate() {
            if !x.is_finite() || x.abs() > MAX_TARGET {
                let detail = format!("a target is at most {MAX_TARGET} mm from the pattern's origin along either axis");
                faults.push(fault(format!("{pointer}/to_mm/{k}"), detail));
            }
        }
        if let Some(first) = pins[..i].iter().position(|other| other.at == pin.at && other.to_mm != pin.to_mm) {
            let detail = format!("pin {first} is at the same place and has another target: take one of the two out");
            faults.push(fault(pointer, detail));
        }
    }
    if pins.len() > 1 {
        let detail = "pins settle how the pattern is turned: leave this out, or pin one point alone";
        for (turned, name) in
            [(options.placement.align != Align::default(), "align"), (options.placement.to_deg != 0.0, "to_deg")]
        {
            if turned {
                faults.push(fault(format!("/placement/{name}"), detail));
            }
        }
    }
}

fn keep(options: &JobOptions, faults: &mut Vec<Fault>) {
    let keep = options.flattening.keep();
    if keep.len() > MAX_KEEPS {
        let detail = format!("{} lengths are to be kept: at most {MAX_KEEPS} entries are possible", keep.len());
        faults.push(fault("/flattening/keep", detail));
    }
    for (i, kept) in keep.iter().enumerate() {
        if !(kept.weight > 0.0 && kept.weight <= MAX_KEEP_WEIGHT) {
            let detail = format!("a weight is greater than 0 and at most {MAX_KEEP_WEIGHT}");
            faults.push(fault(format!("/flattening/keep/{i}/weight"), detail));
        }
    }
    let isometric = options.flattening.method() == FlatteningMethod::Isometric;
    if isometric && !keep.is_empty() && options.domain() == FlatteningDomain::Base {
        let detail = "with the domain `base` the part's boundaries are no borders of what is flattened: take `domain: trimmed` \
                      and the triangulation `tracing`";
        faults.push(fault("/flattening/keep", detail));
    }
}

fn search(options: &JobOptions, faults: &mut Vec<Fault>) {
    if options.flattening.seed == Some(SeedChoice::Optimum) && options.search.strategy == SearchStrategy::Predicted {
        let detail = "`seed: optimum` tries every seed: take `seed: predicted`, or leave the strategy out";
        faults.push(fault("/search/strategy", detail));
    }
    if options.search.budget_s.is_some_and(|s| !(s > 0.0 && s <= MAX_BUDGET_S)) {
        faults.push(fault(
            "/search/budget_s",
            format!("a search may be given more than 0 and at most {MAX_BUDGET_S} seconds"),
        ));
    }
}

/// What a kind of work does not take.
#[must_use]
pub fn check_kind(kind: JobKind, options: &JobOptions) -> Vec<Fault> {
    if kind != JobKind::OptimumSeedSearch {
        return Vec::new();
    }
    let mut faults = Vec::new();
    if options.flattening.seed.is_some_and(|seed| !matches!(seed, SeedChoice::Optimum | SeedChoice::Predicted)) {
        let detail = "a search for the optimum tries many seeds: leave the seed out, or flatten with this one";
        faults.push(fault("/flattening/seed", detail));
    }
    if options.flattening.method.is_some_and(|method| method != FlatteningMethod::Cader) {
        faults.push(fault("/flattening/method", "seeds are those of the method `cader`"));
    }
    if options.flattening.injective.is_some() {
        let detail = "seeds are those of the method `cader`, which may lie on itself: flatten with `isometric` instead";
        faults.push(fault("/flattening/injective", detail));
    }
    faults
}

fn placement(options: &JobOptions, faults: &mut Vec<Fault>) {
    let direction = match &options.placement.align {
        Align::Uv(d) => Some(("/placement/align/uv", d.as_slice())),
        Align::Xyz(d) => Some(("/placement/align/xyz", d.as_slice())),
        Align::U | Align::V => None,
    };
    if let Some((pointer, d)) = direction {
        finite(pointer, d, faults);
        if d.iter().all(|x| *x == 0.0) {
            faults.push(fault(pointer, "a direction cannot be zero in all coordinates"));
        }
    }
    if !(-360.0..=360.0).contains(&options.placement.to_deg) {
        faults.push(fault("/placement/to_deg", "an angle is from -360 to 360 degrees"));
    }
}

fn numbers(options: &JobOptions, faults: &mut Vec<Fault>) {
    let limits = &options.limits;
    let at_least_zero = [
        ("/limits/stretch_percent", limits.stretch_percent),
        ("/limits/compression_percent", limits.compression_percent),
        ("/limits/area_percent", limits.area_percent),
        ("/limits/shape_percent", limits.shape_percent),
        ("/limits/shear_deg", limits.shear_deg),
        ("/limits/boundary_percent", limits.boundary_percent),
        ("/thresholds/area_mm2", Some(options.thresholds.area_mm2)),
        ("/thresholds/length_mm", Some(options.thresholds.length_mm)),
    ];
    for (pointer, value) in at_least_zero {
        if value.is_some_and(|x| !(x.is_finite() && x >= 0.0)) {
            faults.push(fault(pointer, "this number is 0 or greater"));
        }
    }
    if options.curve_tolerance_mm.is_some_and(|x| !(x.is_finite() && x > 0.0)) {
        faults.push(fault("/curve_tolerance_mm", "a tolerance is greater than 0"));
    }
}

fn finite(pointer: &str, values: &[f64], faults: &mut Vec<Fault>) {
    for (i, x) in values.iter().enumerate() {
        if !x.is_finite() {
            faults.push(fault(format!("{pointer}/{i}"), "this is not a finite number"));
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn pointers(job: Value) -> Vec<String> {
        let (request, faults) = super::super::read(job);
        assert!(faults.is_empty(), "{faults:?}");
        let options = request.options;
        let domain = Domain { u: [0.0, 2.0], v: [-1.0, 1.0] };
        check(&options, Some(domain)).into_iter().map(|f| f.pointer).collect()
    }

    #[test]
    fn the_defaults_have_no_fault() {
        assert!(pointers(json!({})).is_empty());
    }

    #[test]
    fn every_value_without_a_meaning_is_found_at_once() {
        let found = pointers(json!({
            "triangulation": { "tolerance": { "chord": -1 }, "grid": [1, 5000], "phase": 2 },
            "flattening": { "seed": { "uv": [3, 0] } },
            "placement": { "align": { "xyz": [0, 0, 0] }, "to_deg": 400 },
            "limits": { "stretch_percent": -3 },
            "thresholds": { "area_mm2": -0.1 },
            "curve_tolerance_mm": 0
        }));
        assert_eq!(
            found,
            [
                "/triangulation/tolerance",
                "/triangulation/grid/0",
                "/triangulation/grid/1",
                "/triangulation/tolerance/chord",
                "/triangulation/phase",
                "/flattening/seed/uv/0",
                "/placement/align/xyz",
                "/placement/to_deg",
                "/limits/stretch_percent",
                "/thresholds/area_mm2",
                "/curve_tolerance_mm",
            ]
        );
    }

    #[test]
    fn a_grid_of_too_many_triangles_is_refused() {
        assert_eq!(pointers(json!({ "triangulation": { "grid": [4096, 4096] } })), ["/triangulation/grid"]);
        assert!(pointers(json!({ "triangulation": { "grid": [1400, 1400] } })).is_empty());
    }

    #[test]
    fn settings_of_lines_of_curvature_go_with_their_method_and_a_grid_alone() {
        let with = |settings: Value| json!({ "triangulation": settings });
        assert!(pointers(with(json!({ "method": "ampc" }))).is_empty());
        assert!(pointers(with(json!({ "method": "ampc", "ampc": null }))).is_empty());
        let all = json!({
            "np_rule": "printed", "starts": 5, "drop_thin": true, "min_distance_mm": 0.5, "integration": "runge-kutta",
            "border": "free", "families": "both", "direction": "u"
        });
        assert!(pointers(with(json!({ "method": "ampc", "grid": [1024, 2], "ampc": all }))).is_empty());
        assert_eq!(pointers(with(json!({ "method": "grid", "ampc": {} }))), ["/triangulation/ampc"]);
        let wrong = json!({
            "method": "ampc", "tolerance": { "chord": 1 }, "configuration": "diamond",
            "ampc": { "starts": 1, "min_distance_mm": -1 }
        });
        assert_eq!(
            pointers(with(wrong)),
            [
                "/triangulation/tolerance",
                "/triangulation/configuration",
                "/triangulation/ampc/starts",
                "/triangulation/ampc/min_distance_mm"
            ]
        );
        let fitted = json!({ "method": "ampc", "grid": [1025, 4], "configuration": "fitted" });
        assert_eq!(pointers(with(fitted)), ["/triangulation/grid/0", "/triangulation/configuration"]);
        let seeded = |seed: u32| json!({ "triangulation": { "method": "ampc", "grid": [3, 3] }, "flattening": { "seed": seed } });
        assert!(pointers(seeded(9)).is_empty(), "lines beyond the first and last add triangles");
    }

    #[test]
    fn a_seed_beyond_the_grid_is_refused() {
        let job = |seed: u32| json!({ "triangulation": { "grid": [3, 3] }, "flattening": { "seed": seed } });
        assert!(pointers(job(7)).is_empty());
        assert_eq!(pointers(job(8)), ["/flattening/seed"]);
    }

    #[test]
    fn pins_and_kept_lengths_without_a_meaning_are_found_at_once() {
        let pin = |uv: [f64; 2], to: [f64; 2]| json!({ "at": { "uv": uv }, "to_mm": to });
        let pinned = |pins: Value| json!({ "flattening": { "pins": pins } });
        let apart = json!([pin([0.0, 0.0], [0.0, 0.0]), pin([1.0, 0.5], [10.0, 0.0])]);
        assert!(pointers(pinned(apart.clone())).is_empty());
        assert!(pointers(pinned(json!([]))).is_empty() && pointers(pinned(Value::Null)).is_empty());
        assert_eq!(
            pointers(json!({
                "flattening": {
                    "pins": [pin([3.0, 0.0], [0.0, 2e7]), pin([1.0, 0.5], [1.0, 1.0]), pin([1.0, 0.5], [1.0, 1.5])],
                    "keep": [
                        { "curve": "borders", "weight": 0 },
                        { "curve": { "border": 1 }, "length": "soft" },
                        { "curve": { "border": 2 }, "weight": 1e9 }
                    ]
                },
                "placement": { "align": "v", "to_deg": 30 }
            })),
            [
                "/flattening/pins/0/at/uv/0",
                "/flattening/pins/0/to_mm/1",
                "/flattening/pins/2",
                "/placement/align",
                "/placement/to_deg",
                "/flattening/keep/0/weight",
                "/flattening/keep/2/weight",
            ]
        );
        // One pin leaves the turn to the placement.
        let one = json!({ "flattening": { "pins": [pin([0.0, 0.0], [0.0, 0.0])] }, "placement": { "to_deg": 30 } });
        assert!(pointers(one).is_empty());
        let cader = json!({ "flattening": { "seed": "centre", "pins": apart, "keep": [{ "curve": "borders" }] } });
        assert_eq!(pointers(cader), ["/flattening/pins", "/flattening/keep"]);
        let both = json!({ "flattening": { "injective": true, "keep": [{ "curve": "borders" }] } });
        assert_eq!(pointers(both), ["/flattening/injective"]);
        let base = json!({ "flattening": { "domain": "base", "keep": [{ "curve": "borders" }] } });
        assert_eq!(pointers(base), ["/flattening/keep"]);
        let many: Vec<Value> = (0..1001).map(|k| pin([0.001 * f64::from(k), 0.0], [f64::from(k), 0.0])).collect();
        assert_eq!(pointers(pinned(Value::from(many))), ["/flattening/pins"]);
        let many = vec![json!({ "curve": "borders" }); 101];
        assert_eq!(pointers(json!({ "flattening": { "keep": many } })), ["/flattening/keep"]);
    }

    #[test]
    fn a_seed_on_the_border_is_taken() {
        assert!(pointers(json!({ "flattening": { "seed": { "uv": [2.0, -1.0] } } })).is_empty());
    }
}
