//! The verdict: measures against limits.

use super::{BoundaryReport, DistortionMeasures, LimitCheck, Limits, Verdict, VerdictResult};

/// Judges the measures of a part by the limits that were given, in the order in which [`Limits`] names them.
///
/// Stretch and compression are judged by the percentiles by area, compression as a positive number; a material that is
/// not stretched (gathered) anywhere has the value 0. Boundaries are judged by the one whose length changes most.
#[must_use]
pub fn verdict(limits: &Limits, measures: &DistortionMeasures, boundaries: &[BoundaryReport]) -> Verdict {
    let boundary = boundaries
        .iter()
        .filter(|b| b.length_3d_mm > 0.0)
        .map(|b| 100.0 * (b.length_2d_mm - b.length_3d_mm).abs() / b.length_3d_mm)
        .fold(0.0, f64::max);
    let values = [
        ("stretch_percent", "p99", limits.stretch_percent, measures.strain_percent.p99.max(0.0)),
        ("compression_percent", "p01", limits.compression_percent, (-measures.strain_percent.p01).max(0.0)),
        ("area_percent", "total", limits.area_percent, measures.area_change_percent),
        ("shape_percent", "total", limits.shape_percent, measures.shape_change_percent),
        ("shear_deg", "p99", limits.shear_deg, measures.shear_deg[1]),
        ("boundary_percent", "max", limits.boundary_percent, boundary),
    ];
    let checks: Vec<LimitCheck> = values
        .into_iter()
        .filter_map(|(name, of, limit, value)| {
            limit.map(|limit| LimitCheck { name: name.to_owned(), limit, value, of: of.to_owned(), ok: value <= limit })
        })
        .collect();
    let result = match checks.as_slice() {
        [] => VerdictResult::Unchecked,
        checks if checks.iter().all(|c| c.ok) => VerdictResult::Pass,
        _ => VerdictResult::Fail,
    };
    Verdict { result, limits: checks }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measures() -> DistortionMeasures {
        let mut m = DistortionMeasures { area_change_percent: 0.5, ..DistortionMeasures::default() };
        (m.strain_percent.p01, m.strain_percent.p99) = (-1.5, 0.8);
        (m.strain_percent.min, m.strain_percent.max) = (-40.0, 40.0);
        m
    }

    #[test]
    fn without_limits_nothing_is_judged() {
        assert_eq!(verdict(&Limits::default(), &measures(), &[]).result, VerdictResult::Unchecked);
    }

    #[test]
    fn percentiles_are_judged_and_not_extremes() {
        let limits = Limits { stretch_percent: Some(1.0), compression_percent: Some(2.0), ..Limits::default() };
        let verdict = verdict(&limits, &measures(), &[]);
        assert_eq!(verdict.result, VerdictResult::Pass);
        let values: Vec<_> = verdict.limits.iter().map(|l| (l.name.as_str(), l.of.as_str(), l.value)).collect();
        assert_eq!(values, [("stretch_percent", "p99", 0.8), ("compression_percent", "p01", 1.5)]);
    }

    #[test]
    fn one_limit_that_is_not_kept_fails_the_part() {
        let limits = Limits { area_percent: Some(0.4), shape_percent: Some(1.0), ..Limits::default() };
        let verdict = verdict(&limits, &measures(), &[]);
        assert_eq!(verdict.result, VerdictResult::Fail);
        assert_eq!(verdict.limits.iter().map(|l| l.ok).collect::<Vec<_>>(), [false, true]);
    }

    #[test]
    fn the_worst_boundary_counts() {
        let boundary = |length_2d_mm| BoundaryReport { length_3d_mm: 200.0, length_2d_mm, ..BoundaryReport::default() };
        let limits = Limits { boundary_percent: Some(0.6), ..Limits::default() };
        let result = |b: &[BoundaryReport]| verdict(&limits, &measures(), b).result;
        assert_eq!(result(&[boundary(199.0), boundary(200.5)]), VerdictResult::Pass);
        assert_eq!(result(&[boundary(200.0), boundary(198.0)]), VerdictResult::Fail);
    }
}
