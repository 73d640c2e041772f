//! The report as JSON, in the names that the engine's types give.

use serde::Serialize;

use super::numbers::WriteError;
use super::numbers::finite::first_not_finite;
use crate::engine::distortion::Report;

/// The document, indented for people.
///
/// # Errors
/// [`WriteError::NotFinite`] with the JSON Pointer of the number.
pub fn write(report: &Report) -> Result<Vec<u8>, WriteError> {
    to_json(report)
}

/// Any value as indented JSON, once it is sure that no number in it would become `null`.
///
/// # Errors
/// [`WriteError::NotFinite`] with the JSON Pointer of the number.
pub fn to_json(value: &impl Serialize) -> Result<Vec<u8>, WriteError> {
    if let Some(what) = first_not_finite(value) {
        return Err(WriteError::NotFinite { what });
    }
    serde_json::to_vec_pretty(value).map_err(|e| WriteError::NotFinite { what: e.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::distortion::DistortionReport;

    #[test]
    fn a_report_reads_back_as_it_was() {
        let mut report = Report::default();
        report.triangulation.area_mm2 = 0.1 + 0.2;
        report.distortion = Some(DistortionReport::default());
        report.warnings.push("a".into());
        let text = write(&report).unwrap();
        assert_eq!(serde_json::from_slice::<Report>(&text).unwrap(), report);
    }

    #[test]
    fn a_number_that_is_not_finite_is_named_not_written() {
        let mut report = Report::default();
        let mut distortion = DistortionReport::default();
        distortion.part.strain_percent.at_max.xyz_mm[1] = f64::NAN;
        report.distortion = Some(distortion);
        let error = write(&report).unwrap_err();
        assert_eq!(error, WriteError::NotFinite { what: "/distortion/strain_percent/at_max/xyz_mm/1".into() });
    }
}
