//! Typed errors of the engine. Each says what is wrong, where (a [`Place`]), and what to try next ([`Remedy`]).
//!
//! The API turns them into problem documents in one place; the texts here are written for a CAD user and are safe to show.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Where something is wrong. Every field that applies is filled.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Place {
    /// Index of the trimming loop in the file.
    #[serde(rename = "loop", skip_serializing_if = "Option::is_none")]
    pub loop_index: Option<usize>,
    /// Index of the curve in its loop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curve: Option<usize>,
    /// Parameter on that curve.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t: Option<f64>,
    /// Place in the surface's domain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uv: Option<[f64; 2]>,
    /// Place in space, millimetres.
    #[serde(rename = "xyz", skip_serializing_if = "Option::is_none")]
    pub xyz_mm: Option<[f64; 3]>,
    /// Place in the flat pattern, millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xy_mm: Option<[f64; 2]>,
    /// Index of the triangle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangle: Option<u32>,
    /// Level of the mapping order (thesis 4.2.2).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<u32>,
}

/// A value that a remedy sets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum SetValue {
    /// Yes or no.
    Flag(bool),
    /// A number.
    Number(f64),
    /// A word.
    Text(String),
    /// A list of whole numbers, such as a grid.
    Integers(Vec<u32>),
    /// The setting is taken away (`null`): it contradicts another one that is set.
    Nothing,
}

/// Something to try, in words and as settings that a plugin can put on a button.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Remedy {
    /// What to try, in words.
    pub say: String,
    /// Settings that do it: dotted parameter name to value. Empty when no setting helps.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub set: BTreeMap<String, SetValue>,
}

impl Remedy {
    /// A remedy in words alone.
    #[must_use]
    pub fn say(text: impl Into<String>) -> Self {
        Self { say: text.into(), set: BTreeMap::new() }
    }

    /// The same with a setting that does it.
    #[must_use]
    pub fn with(mut self, name: &str, value: SetValue) -> Self {
        self.set.insert(name.to_owned(), value);
        self
    }

    /// A remedy that sets the density: a uniform grid in place of whatever density was asked for.
    pub(super) fn on_grid(text: &str, grid: [u32; 2]) -> Self {
        Self::say(text)
            .with("triangulation.grid", SetValue::Integers(grid.to_vec()))
            .with("triangulation.tolerance", SetValue::Nothing)
    }
}

/// Why the engine could not do what was asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    /// The observer no longer wants the result.
    #[error("the job was cancelled")]
    Cancelled,
    /// The surface or a curve is not valid.
    #[error(transparent)]
    Nurbs(#[from] super::nurbs::NurbsError),
    /// The trimming loops do not bound a region.
    #[error(transparent)]
    Trimming(#[from] super::trimming::TrimmingError),
    /// The domain could not be triangulated.
    #[error(transparent)]
    Triangulation(#[from] super::triangulation::TriangulationError),
    /// The mesh could not be flattened.
    #[error(transparent)]
    Flattening(#[from] super::flattening::FlatteningError),
    /// A parameter does not fit this surface.
    #[error("{name}: {detail}")]
    Parameter {
        /// Dotted name of the parameter.
        name: String,
        /// What is wrong with it, and what would do.
        detail: String,
    },
}

/// What every error of the engine can tell.
pub trait Located {
    /// Stable machine-readable code in kebab case, such as `triangle-flipped`.
    fn code(&self) -> &'static str;
    /// Where it is wrong.
    fn place(&self) -> Place;
    /// What to try next.
    fn remedies(&self) -> Vec<Remedy>;
}

impl Located for EngineError {
    fn code(&self) -> &'static str {
        match self {
            Self::Cancelled => "cancelled",
            Self::Nurbs(e) => e.code(),
            Self::Trimming(e) => e.code(),
            Self::Triangulation(e) => e.code(),
            Self::Flattening(e) => e.code(),
            Self::Parameter { .. } => "parameter",
        }
    }

    fn place(&self) -> Place {
        match self {
            Self::Cancelled | Self::Parameter { .. } => Place::default(),
            Self::Nurbs(e) => e.place(),
            Self::Trimming(e) => e.place(),
            Self::Triangulation(e) => e.place(),
            Self::Flattening(e) => e.place(),
        }
    }

    fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::Cancelled | Self::Parameter { .. } => Vec::new(),
            Self::Nurbs(e) => e.remedies(),
            Self::Trimming(e) => e.remedies(),
            Self::Triangulation(e) => e.remedies(),
            Self::Flattening(e) => e.remedies(),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::engine::flattening::FlatteningError;
    use crate::engine::job::JobOptions;
    use crate::engine::triangulation::TriangulationError;
    use crate::engine::triangulation::ampc::Along;

    /// The job with one setting changed.
    fn assigned(mut job: Value, name: &str, value: &SetValue) -> Value {
        let mut at = &mut job;
        for step in name.split('.') {
            at = &mut at[step];
        }
        *at = serde_json::to_value(value).unwrap();
        job
    }

    #[test]
    fn a_job_whose_pins_fail_can_be_sent_again_without_them() {
        let place = Box::new(Place::default());
        let job = json!({ "flattening": { "pins": [{ "at": { "uv": [0.5, 0.5] }, "to_mm": [0, 0] }] } });
        for error in [
            FlatteningError::PinsNotMet { pin: 0, residual_mm: 1.0, place: place.clone() },
            FlatteningError::PinOffSurface { pin: 0, away_mm: None, place: place.clone() },
            FlatteningError::PinsContradict { pins: [0, 1], place },
        ] {
            let set = error.remedies().into_iter().map(|r| r.set).find(|set| !set.is_empty()).expect("a setting");
            let freed = set.iter().fold(job.clone(), |job, (name, value)| assigned(job, name, value));
            let read: JobOptions = serde_json::from_value(freed).expect("a job");
            assert!(read.flattening.pins().is_empty(), "{error}");
        }
    }

    #[test]
    fn the_settings_of_every_remedy_make_a_job_that_can_be_read_and_has_one_density() {
        let place = Box::new(Place::default());
        let flipped = FlatteningError::Flipped { triangle: 7, level: 2, seed: 0, flattened: 6, total: 9, place };
        let errors = [
            EngineError::from(flipped.clone()),
            FlatteningError::NoSeed { tried: 9, furthest: Box::new(flipped) }.into(),
            FlatteningError::SeedOutOfRange { seed: 10, triangles: 9 }.into(),
            FlatteningError::SeedNotFound.into(),
            TriangulationError::TooManyTriangles { estimate: 5_000_000, limit: 4_000_000 }.into(),
            TriangulationError::NoPolyline { along: Along::U, strips: 4 }.into(),
            TriangulationError::LinesTangle { place: Box::default() }.into(),
            TriangulationError::ThinInPart { count: 3 }.into(),
        ];
        for error in errors {
            let with_settings: Vec<Remedy> = error.remedies().into_iter().filter(|r| !r.set.is_empty()).collect();
            assert!(!with_settings.is_empty(), "{error}");
            for remedy in with_settings {
                for density in [json!({ "tolerance": { "chord": 0.01 } }), json!({ "grid": [900, 900] })] {
                    let job = json!({ "triangulation": density, "flattening": { "seed": 3 } });
                    let job = remedy.set.iter().fold(job, |job, (name, value)| assigned(job, name, value));
                    let read: JobOptions = serde_json::from_value(job.clone()).unwrap_or_else(|e| panic!("{job}: {e}"));
                    let asked = &read.triangulation;
                    assert!(asked.grid.is_none() || asked.tolerance.is_none(), "{job}");
                    assert_ne!(
                        read,
                        JobOptions::deserialize(json!({ "triangulation": density, "flattening": { "seed": 3 } }))
                            .unwrap(),
                        "a remedy changes the job"
                    );
                }
                let stored = serde_json::to_value(&remedy).unwrap();
                assert_eq!(serde_json::from_value::<Remedy>(stored).unwrap(), remedy);
            }
        }
    }
}
