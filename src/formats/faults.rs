//! Faults of an input file, each with the JSON Pointer of the place it is at.

use serde::{Deserialize, Serialize};

use crate::engine::error::Place;

/// One fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// JSON Pointer (RFC 6901) into the document, such as `/knots_u/5`. Empty for the document as a whole.
    pub pointer: String,
    /// What is wrong and what would do, in words.
    pub detail: String,
    /// Place in the geometry, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
}

/// The most faults that are listed. A file of a million bad numbers must not give an answer larger than the file, and
/// nobody mends more than this many by hand; what goes beyond is counted.
pub const MAX_FAULTS: usize = 100;

/// Collects faults, at most [`MAX_FAULTS`] of them, and counts the others.
#[derive(Debug, Default)]
pub(crate) struct FaultList {
    faults: Vec<Fault>,
    unlisted: usize,
}

impl FaultList {
    /// Adds a fault at `pointer`.
    pub(crate) fn add(&mut self, pointer: String, detail: impl Into<String>) {
        self.push(Fault { pointer, detail: detail.into(), place: None });
    }

    /// Adds a fault.
    pub(crate) fn push(&mut self, fault: Fault) {
        if self.faults.len() < MAX_FAULTS {
            self.faults.push(fault);
        } else {
            self.unlisted += 1;
        }
    }

    /// True when nothing is wrong so far.
    pub(crate) fn is_empty(&self) -> bool {
        self.faults.is_empty()
    }

    /// All that was found, in the order of finding, with a last line for those that are not listed.
    pub(crate) fn into_faults(mut self) -> Vec<Fault> {
        if self.unlisted > 0 {
            let detail = format!("{} more faults are not listed", self.unlisted);
            self.faults.push(Fault { pointer: String::new(), detail, place: None });
        }
        self.faults
    }
}

/// One step of a JSON Pointer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Step {
    /// A field of our own format.
    Field(&'static str),
    /// A field of the sender's own, such as a label.
    Named(String),
    /// An element of an array.
    Index(usize),
}

/// Writes `prefix` and the steps as a JSON Pointer; `~` and `/` in names are escaped as RFC 6901 says.
pub(crate) fn pointer(prefix: &str, steps: &[Step]) -> String {
    let mut out = prefix.to_owned();
    for step in steps {
        out.push('/');
        match step {
            Step::Field(name) => out.push_str(name),
            Step::Named(name) => out.push_str(&name.replace('~', "~0").replace('/', "~1")),
            Step::Index(index) => out.push_str(&index.to_string()),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pointer_escapes_tilde_and_slash() {
        let steps = [Step::Field("labels"), Step::Named("a/b~c".into()), Step::Index(3)];
        assert_eq!(pointer("/surface", &steps), "/surface/labels/a~1b~0c/3");
    }

    #[test]
    fn faults_beyond_the_limit_are_counted_not_listed() {
        let mut list = FaultList::default();
        for i in 0..MAX_FAULTS + 7 {
            list.add(format!("/{i}"), "bad");
        }
        let faults = list.into_faults();
        assert_eq!(faults.len(), MAX_FAULTS + 1);
        assert!(faults[MAX_FAULTS].detail.starts_with("7 more"));
    }
}
