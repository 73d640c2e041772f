//! What became of each seed of a search: as it is kept, as JSON, as CSV.
//!
//! Kept little-endian, without padding: `PLNS`, version u32, measure u32 (0 area, 1 shape), pieces u64 with a u32 each
//! (the best seed, `u32::MAX` for none), seeds u64 with 20 bytes each: what became of it u32, then
//!
//! | u32 | meaning | 16 bytes |
//! |---|---|---|
//! | 0 | its turn did not come | zero |
//! | 1 | it flattened the whole mesh | area and shape change f64, percent; NaN when not measured |
//! | 2 | a triangle turned over | triangle, level, triangles flattened u32; zero |
//! | 3 | it could no longer win | triangles flattened u32; zero |
//!
//! In JSON and CSV a seed that was given up counts as untried: nothing is known of it.

use std::fmt::Write;

use serde::Serialize;

use super::numbers::{WriteError, compact_json};
use super::stored::{Reader, StoredError, damaged};
use crate::engine::flattening::cader::Stop;
use crate::engine::job::SearchMeasure;
use crate::engine::seed::{Changes, SeedLandscape, SeedOutcome};

const MAGIC: [u8; 4] = *b"PLNS";
/// The only version so far.
const VERSION: u32 = 1;
/// Media type under which encoded seeds are stored.
pub const MEDIA: &str = "application/vnd.planish.seeds";

const UNTRIED: u32 = 0;
const FLATTENED: u32 = 1;
const FLIPPED: u32 = 2;
const ABANDONED: u32 = 3;
/// Bytes of a seed.
const SEED_BYTES: usize = 20;

/// Encodes a landscape.
#[must_use]
pub fn encode(landscape: &SeedLandscape) -> Vec<u8> {
    let mut out = Vec::with_capacity(28 + 4 * landscape.best.len() + SEED_BYTES * landscape.seeds.len());
    out.extend_from_slice(&MAGIC);
    out.extend_from_slice(&VERSION.to_le_bytes());
    let measure: u32 = match landscape.measure {
        SearchMeasure::Area => 0,
        SearchMeasure::Shape => 1,
    };
    out.extend_from_slice(&measure.to_le_bytes());
    out.extend_from_slice(&(landscape.best.len() as u64).to_le_bytes());
    for best in &landscape.best {
        out.extend_from_slice(&best.unwrap_or(u32::MAX).to_le_bytes());
    }
    out.extend_from_slice(&(landscape.seeds.len() as u64).to_le_bytes());
    for outcome in &landscape.seeds {
        let (what, words) = match *outcome {
            SeedOutcome::Flattened(changes) => {
                let words = |x: Option<f64>| {
                    let bits = x.unwrap_or(f64::NAN).to_bits();
                    [bits as u32, (bits >> 32) as u32]
                };
                let ([a, b], [c, d]) = (words(changes.area_percent), words(changes.shape_percent));
                (FLATTENED, [a, b, c, d])
            }
            SeedOutcome::Stopped(Stop::Flipped { triangle, level, flattened }) => {
                (FLIPPED, [triangle, level, flattened, 0])
            }
            SeedOutcome::Stopped(Stop::Abandoned { flattened }) => (ABANDONED, [flattened, 0, 0, 0]),
            // A search with a seed that reaches too little has no landscape.
            SeedOutcome::Untried | SeedOutcome::Stopped(Stop::SeedOutOfRange | Stop::Unreached { .. }) => {
                (UNTRIED, [0; 4])
            }
        };
        out.extend_from_slice(&what.to_le_bytes());
        for word in words {
            out.extend_from_slice(&word.to_le_bytes());
        }
    }
    out
}

/// Decodes a landscape.
///
/// # Errors
/// [`StoredError`].
pub fn decode(bytes: &[u8]) -> Result<SeedLandscape, StoredError> {
    let (mut read, _) = Reader::open(bytes, MAGIC, "landscape of seeds", VERSION)?;
    let measure = match read.u32()? {
        0 => SearchMeasure::Area,
        1 => SearchMeasure::Shape,
        _ => return Err(damaged("there is no such measure")),
    };
    let pieces = read.count(4)?;
    let mut best = Vec::with_capacity(pieces);
    for _ in 0..pieces {
        best.push(Some(read.u32()?).filter(|seed| *seed != u32::MAX));
    }
    let count = read.count(SEED_BYTES)?;
    let mut seeds = Vec::with_capacity(count);
    for _ in 0..count {
        let what = read.u32()?;
        let words = [read.u32()?, read.u32()?, read.u32()?, read.u32()?];
        let change = |low: u32, high: u32| {
            Some(f64::from_bits(u64::from(low) | u64::from(high) << 32)).filter(|x| x.is_finite())
        };
        seeds.push(match what {
            UNTRIED => SeedOutcome::Untried,
            FLATTENED => SeedOutcome::Flattened(Changes {
                area_percent: change(words[0], words[1]),
                shape_percent: change(words[2], words[3]),
            }),
            FLIPPED => SeedOutcome::Stopped(Stop::Flipped { triangle: words[0], level: words[1], flattened: words[2] }),
            ABANDONED => SeedOutcome::Stopped(Stop::Abandoned { flattened: words[0] }),
            _ => return Err(damaged("a seed has an unknown outcome")),
        });
    }
    if read.rest.is_empty() { Ok(SeedLandscape { measure, seeds, best }) } else { Err(damaged("bytes are left over")) }
}

/// A seed as it is written.
#[derive(Serialize)]
struct Row {
    seed: usize,
    outcome: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    area_change_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shape_change_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangle: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    level: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    flattened: Option<u32>,
}

impl Row {
    fn new(seed: usize, outcome: &SeedOutcome) -> Self {
        let untried = Self {
            seed,
            outcome: "untried",
            area_change_percent: None,
            shape_change_percent: None,
            triangle: None,
            level: None,
            flattened: None,
        };
        let finite = |x: Option<f64>| x.filter(|x| x.is_finite());
        match *outcome {
            SeedOutcome::Flattened(changes) => Self {
                outcome: "flattened",
                area_change_percent: finite(changes.area_percent),
                shape_change_percent: finite(changes.shape_percent),
                ..untried
            },
            SeedOutcome::Stopped(Stop::Flipped { triangle, level, flattened }) => Self {
                outcome: "flipped",
                triangle: Some(triangle),
                level: Some(level),
                flattened: Some(flattened),
                ..untried
            },
            SeedOutcome::Stopped(_) | SeedOutcome::Untried => untried,
        }
    }
}

#[derive(Serialize)]
struct Document<'a> {
    measure: &'static str,
    best: &'a [Option<u32>],
    seeds: Vec<Row>,
}

/// The landscape as JSON, compact: a seed that flattened the mesh has its changes, one that flipped says where.
///
/// # Errors
/// None that a landscape can give: numbers that are not finite are left out.
pub fn json(landscape: &SeedLandscape) -> Result<Vec<u8>, WriteError> {
    compact_json(&Document {
        measure: landscape.measure.name(),
        best: &landscape.best,
        seeds: landscape.seeds.iter().enumerate().map(|(seed, outcome)| Row::new(seed, outcome)).collect(),
    })
}

/// The landscape as CSV (RFC 4180): a header, then a line a seed; what does not apply is empty.
#[must_use]
pub fn csv(landscape: &SeedLandscape) -> Vec<u8> {
    let mut out = "seed,outcome,area_change_percent,shape_change_percent,triangle,level,flattened\r\n".to_owned();
    let number = |x: Option<f64>| x.map_or_else(String::new, |x| x.to_string());
    let count = |x: Option<u32>| x.map_or_else(String::new, |x| x.to_string());
    for (seed, outcome) in landscape.seeds.iter().enumerate() {
        let row = Row::new(seed, outcome);
        // Writing to a string cannot fail.
        let _ = write!(
            out,
            "{seed},{},{},{},{},{},{}\r\n",
            row.outcome,
            number(row.area_change_percent),
            number(row.shape_change_percent),
            count(row.triangle),
            count(row.level),
            count(row.flattened),
        );
    }
    out.into_bytes()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn outcome() -> impl Strategy<Value = SeedOutcome> {
        let change = || prop::option::of(0.0..1e3_f64);
        prop_oneof![
            Just(SeedOutcome::Untried),
            (change(), change()).prop_map(|(area_percent, shape_percent)| SeedOutcome::Flattened(Changes {
                area_percent,
                shape_percent
            })),
            any::<[u32; 3]>().prop_map(|[triangle, level, flattened]| SeedOutcome::Stopped(Stop::Flipped {
                triangle,
                level,
                flattened
            })),
            any::<u32>().prop_map(|flattened| SeedOutcome::Stopped(Stop::Abandoned { flattened })),
        ]
    }

    fn landscape() -> impl Strategy<Value = SeedLandscape> {
        let best = prop::collection::vec(prop::option::of(0..u32::MAX), 0..4);
        (any::<bool>(), prop::collection::vec(outcome(), 0..30), best).prop_map(|(shape, seeds, best)| SeedLandscape {
            measure: if shape { SearchMeasure::Shape } else { SearchMeasure::Area },
            seeds,
            best,
        })
    }

    proptest! {
        #[test]
        fn a_landscape_comes_back_as_it_was(landscape in landscape()) {
            prop_assert_eq!(decode(&encode(&landscape)).unwrap(), landscape);
        }

        #[test]
        fn damage_gives_an_error_or_other_values_never_a_panic(
            landscape in landscape(), at in any::<prop::sample::Index>(), bits in 1..=255_u8, cut in any::<prop::sample::Index>()
        ) {
            let mut bytes = encode(&landscape);
            let i = at.index(bytes.len());
            bytes[i] ^= bits;
            let _ = decode(&bytes);
            bytes.truncate(cut.index(bytes.len()));
            prop_assert!(decode(&bytes).is_err());
        }

        #[test]
        fn both_forms_have_a_row_for_every_seed(landscape in landscape()) {
            let document: serde_json::Value = serde_json::from_slice(&json(&landscape).unwrap()).unwrap();
            prop_assert_eq!(document["seeds"].as_array().unwrap().len(), landscape.seeds.len());
            let text = String::from_utf8(csv(&landscape)).unwrap();
            prop_assert_eq!(text.lines().count(), landscape.seeds.len() + 1);
            prop_assert!(text.lines().all(|line| line.matches(',').count() == 6));
        }
    }

    #[test]
    fn the_forms_say_what_became_of_a_seed() {
        let landscape = SeedLandscape {
            measure: SearchMeasure::Area,
            seeds: vec![
                SeedOutcome::Flattened(Changes { area_percent: Some(0.5), shape_percent: Some(0.25) }),
                SeedOutcome::Stopped(Stop::Flipped { triangle: 7, level: 2, flattened: 9 }),
                SeedOutcome::Untried,
            ],
            best: vec![Some(0)],
        };
        assert_eq!(
            String::from_utf8(json(&landscape).unwrap()).unwrap(),
            r#"{"measure":"area","best":[0],"seeds":[{"seed":0,"outcome":"flattened","area_change_percent":0.5,"shape_change_percent":0.25},{"seed":1,"outcome":"flipped","triangle":7,"level":2,"flattened":9},{"seed":2,"outcome":"untried"}]}"#
        );
        let text = String::from_utf8(csv(&landscape)).unwrap();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, ["0,flattened,0.5,0.25,,,", "1,flipped,,,7,2,9", "2,untried,,,,,"]);
    }
}
