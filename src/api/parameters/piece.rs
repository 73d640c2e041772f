//! Whether what is asked of the pattern's pieces has a meaning.

use crate::engine::job::JobOptions;
use crate::engine::pattern::GREATEST_COMPENSATION;
use crate::engine::sewing::{MAX_CUT_POINTS, MAX_CUTS};
use crate::formats::faults::Fault;

use super::fault;

/// Every fault of the options about pieces.
pub(super) fn check(options: &JobOptions, faults: &mut Vec<Fault>) {
    compensation(options, faults);
    sewing(options, faults);
    cuts(options, faults);
}

fn compensation(options: &JobOptions, faults: &mut Vec<Fault>) {
    let Some(asked) = options.compensation else { return };
    for (name, percent) in [("along_percent", asked.along_percent), ("across_percent", asked.across_percent)] {
        if !(-GREATEST_COMPENSATION..=GREATEST_COMPENSATION).contains(&percent) {
            let detail =
                format!("pieces are compensated by -{GREATEST_COMPENSATION} to {GREATEST_COMPENSATION} percent");
            faults.push(fault(format!("/compensation/{name}"), detail));
        }
    }
}

fn cuts(options: &JobOptions, faults: &mut Vec<Fault>) {
    let points: usize = options.cuts.iter().map(|cut| cut.points.len()).sum();
    if options.cuts.len() > MAX_CUTS || points > MAX_CUT_POINTS {
        faults.push(fault("/cuts", format!("at most {MAX_CUTS} cuts of {MAX_CUT_POINTS} points in all are made")));
    }
    for (k, cut) in options.cuts.iter().enumerate().take(MAX_CUTS) {
        if cut.points.len() < 2 || !cut.points.is_finite() {
            faults.push(fault(format!("/cuts/{k}/points"), "a cut has at least two points, of finite numbers"));
        }
    }
}

fn sewing(options: &JobOptions, faults: &mut Vec<Fault>) {
    if let Some(tolerance) = options.sewing.and_then(|asked| asked.tolerance_mm)
        && !(tolerance > 0.0 && tolerance.is_finite())
    {
        faults.push(fault("/sewing/tolerance_mm", "a tolerance is greater than 0"));
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    fn pointers(job: Value) -> Vec<String> {
        let (request, faults) = super::super::read(job);
        let checked = super::super::check(&request.options, None);
        faults.into_iter().chain(checked).map(|f| f.pointer).collect()
    }

    #[test]
    fn a_compensation_is_a_percentage_within_reason() {
        let with = |along: f64| json!({ "compensation": { "along_percent": along, "across_percent": -30 } });
        assert!(pointers(with(30.0)).is_empty());
        assert_eq!(pointers(with(30.5)), ["/compensation/along_percent"]);
        assert_eq!(pointers(json!({ "compensation": { "along": 1 } })), ["/compensation/along"]);
    }

    #[test]
    fn faces_are_sewn_within_a_length() {
        assert!(pointers(json!({ "sewing": { "join": "none", "tolerance_mm": 0.01 } })).is_empty());
        assert_eq!(pointers(json!({ "sewing": { "tolerance_mm": 0 } })), ["/sewing/tolerance_mm"]);
        assert_eq!(pointers(json!({ "sewing": { "join": "some" } })), ["/sewing/join"]);
    }

    #[test]
    fn a_cut_has_points_of_one_kind() {
        let cut = |points: Value| json!({ "cuts": [{ "points": points }] });
        assert!(pointers(cut(json!([[0, 0], [1, 1]]))).is_empty());
        assert!(pointers(cut(json!([[0, 0, 0], [1, 1, 2]]))).is_empty());
        assert_eq!(pointers(cut(json!([[0, 0]]))), ["/cuts/0/points"]);
        assert_eq!(pointers(cut(json!([[0, 0], [1, 1, 2]]))), ["/cuts"]);
        assert_eq!(pointers(json!({ "cuts": vec![json!({ "points": [[0, 0], [1, 1]] }); 101] })), ["/cuts"]);
    }

    #[test]
    fn a_pair_is_a_mirror_image_or_nothing() {
        assert!(pointers(json!({ "pair": "mirror" })).is_empty());
        assert_eq!(pointers(json!({ "pair": "turned" })), ["/pair"]);
    }
}
