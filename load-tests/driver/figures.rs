//! What was measured: rows of a table, quantiles, and thresholds that were met or missed.

use std::fmt;
use std::time::Duration;

/// The table of a run.
#[derive(Debug, Default)]
pub(crate) struct Figures {
    rows: Vec<Row>,
}

#[derive(Debug)]
struct Row {
    profile: &'static str,
    what: String,
    value: String,
    bar: Option<(String, bool)>,
}

/// A bound that a figure is to keep.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Bar {
    /// At most so much.
    AtMost(f64),
    /// At least so much.
    AtLeast(f64),
}

impl Figures {
    /// A figure without a bound.
    pub(crate) fn note(&mut self, profile: &'static str, what: impl Into<String>, value: impl Into<String>) {
        self.rows.push(Row { profile, what: what.into(), value: value.into(), bar: None });
    }

    /// A figure with a bound.
    pub(crate) fn judge(&mut self, profile: &'static str, what: impl Into<String>, value: f64, unit: &str, bar: Bar) {
        let (text, met) = match bar {
            Bar::AtMost(most) => (format!("at most {most}{unit}"), value <= most),
            Bar::AtLeast(least) => (format!("at least {least}{unit}"), value >= least),
        };
        let value = format!("{}{unit}", digits(value));
        self.rows.push(Row { profile, what: what.into(), value, bar: Some((text, met)) });
    }

    /// Median, 99th percentile and worst of some times.
    pub(crate) fn times(&mut self, profile: &'static str, what: &str, times: &Times) {
        let value = format!(
            "p50 {} · p99 {} · max {} ms",
            digits(times.quantile(0.5)),
            digits(times.quantile(0.99)),
            digits(times.quantile(1.0))
        );
        self.note(profile, format!("{what} ({})", times.0.len()), value);
    }

    /// The bounds that were missed.
    pub(crate) fn missed(&self) -> Vec<String> {
        let missed = self.rows.iter().filter_map(|row| match &row.bar {
            Some((bar, false)) => Some(format!("{}: {} is {}, and should be {bar}", row.profile, row.what, row.value)),
            _ => None,
        });
        missed.collect()
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| profile | what | measured | bar |\n|---|---|---|---|")?;
        for row in &self.rows {
            let bar = match &row.bar {
                None => String::new(),
                Some((text, met)) => format!("{text}: {}", if *met { "met" } else { "**missed**" }),
            };
            writeln!(f, "| {} | {} | {} | {bar} |", row.profile, row.what, row.value)?;
        }
        Ok(())
    }
}

/// Times in milliseconds, ascending.
#[derive(Debug, Clone)]
pub(crate) struct Times(Vec<f64>);

impl FromIterator<Duration> for Times {
    fn from_iter<I: IntoIterator<Item = Duration>>(times: I) -> Self {
        let mut milliseconds: Vec<f64> = times.into_iter().map(|time| time.as_secs_f64() * 1e3).collect();
        milliseconds.sort_by(f64::total_cmp);
        Self(milliseconds)
    }
}

impl Times {
    /// The least time that this share of all does not exceed; 0 when there are none.
    pub(crate) fn quantile(&self, share: f64) -> f64 {
        let rank = (share * self.0.len() as f64).ceil() as usize;
        self.0.get(rank.clamp(1, self.0.len().max(1)) - 1).copied().unwrap_or(0.0)
    }
}

/// Three significant digits, and none behind the point from a hundred on.
pub(crate) fn digits(value: f64) -> String {
    match value.abs() {
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}
