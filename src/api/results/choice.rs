//! What a client can choose about a form beside its name: options in the query of a result's address.

use super::ResultKind;
use crate::api::answer::Form;
use crate::api::problem::Problem;
use crate::api::request::Query;

/// What was chosen. It is part of what names a form: two forms of which it differs are kept apart.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub(crate) struct Choice {
    /// Whether a form that is cut by is also given where the verdict is `fail`: `allow=fail`.
    pub(crate) allow_fail: bool,
}

impl Choice {
    /// Options that the results of a kind have.
    #[must_use]
    const fn names(kind: ResultKind) -> &'static [&'static str] {
        match kind {
            ResultKind::Pattern => &["allow"],
            _ => &[],
        }
    }

    /// Reads the options of a kind's result.
    ///
    /// # Errors
    /// 400 for a parameter that the kind does not have, for one given twice, and for a value that is none of its values.
    pub(crate) fn of(query: &Query, kind: ResultKind) -> Result<Self, Problem> {
        query.only(Self::names(kind))?;
        Self::read(query)
    }

    /// Reads the options, whatever else the query has.
    ///
    /// # Errors
    /// 400 for a value that is none of an option's.
    pub(crate) fn read(query: &Query) -> Result<Self, Problem> {
        let allow_fail = match query.get("allow") {
            None => false,
            Some("fail") => true,
            Some(_) => return Err(Problem::query("allow", "must be fail, or be left out")),
        };
        Ok(Self { allow_fail })
    }

    /// Without what makes no difference to this form: what is left names its bytes.
    pub(super) fn that_matters(mut self, form: Form, verdict: Option<&str>) -> Self {
        self.allow_fail &= form.is_cut_by() && verdict == Some(FAIL);
        self
    }

    /// The choice in one text, for tags.
    pub(super) fn canonical(&self) -> &'static str {
        if self.allow_fail { "allow=fail" } else { "" }
    }
}

/// The verdict that keeps a pattern from the cutter.
pub(super) const FAIL: &str = "fail";
