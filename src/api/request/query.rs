//! A request's query, checked: a parameter that does not exist is a fault, not silence.

use std::fmt::Write as _;

use axum::extract::FromRequestParts;
use axum::http::request::Parts;

use crate::api::parameters::assign;
use crate::api::problem::{Kind, Problem};
use crate::formats::faults::Fault;

/// Most parameters of a query.
const MAX_PARAMETERS: usize = 64;

/// The parameters of a query, in the order in which they were given.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Query(Vec<(String, String)>);

impl<S: Send + Sync> FromRequestParts<S> for Query {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let axum::extract::Query(pairs) =
            axum::extract::Query::<Vec<(String, String)>>::from_request_parts(parts, state).await?;
        if pairs.len() > MAX_PARAMETERS {
            return Err(Problem::new(Kind::BadRequest, format!("A query has at most {MAX_PARAMETERS} parameters.")));
        }
        Ok(Self(pairs))
    }
}

impl Query {
    /// Refuses every parameter that is not one of `known`, and every one but `set` that is given twice.
    ///
    /// # Errors
    /// A problem that names each.
    pub(crate) fn only(&self, known: &[&str]) -> Result<(), Problem> {
        let mut faults = Vec::new();
        for (i, (name, _)) in self.0.iter().enumerate() {
            if !known.contains(&name.as_str()) {
                let detail = if known.is_empty() {
                    format!("there is no query parameter `{name}` here, nor any other")
                } else {
                    format!("there is no query parameter `{name}` here; there is {}", known.join(", "))
                };
                faults.push(Fault { pointer: String::new(), detail, place: None });
            } else if name != "set" && self.0[..i].iter().any(|(other, _)| other == name) {
                let detail = format!("the query parameter `{name}` is given twice");
                faults.push(Fault { pointer: String::new(), detail, place: None });
            }
        }
        if faults.is_empty() {
            return Ok(());
        }
        Err(Problem::new(Kind::BadRequest, "The query has parameters that have no meaning here.").with_faults(faults))
    }

    /// The value of a parameter.
    #[must_use]
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(other, _)| other == name).map(|(_, value)| value.as_str())
    }

    /// The names of all parameters.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(name, _)| name.as_str())
    }

    /// The parameters but for these, sorted by name, as a query's text.
    #[must_use]
    pub(crate) fn canonical_without(&self, left_out: &[&str]) -> String {
        let mut kept: Vec<&(String, String)> =
            self.0.iter().filter(|(name, _)| !left_out.contains(&name.as_str())).collect();
        kept.sort();
        let parts: Vec<String> =
            kept.iter().map(|(name, value)| format!("{}={}", percent_encoded(name), percent_encoded(value))).collect();
        parts.join("&")
    }

    /// The parameters but for these, in the order in which they were given, as a query's text.
    #[must_use]
    pub(crate) fn in_order_without(&self, left_out: &[&str]) -> String {
        let kept = self.0.iter().filter(|(name, _)| !left_out.contains(&name.as_str()));
        let parts: Vec<String> =
            kept.map(|(name, value)| format!("{}={}", percent_encoded(name), percent_encoded(value))).collect();
        parts.join("&")
    }

    /// The value of a parameter, read as a `T`.
    ///
    /// # Errors
    /// A problem that says what the value must be.
    pub(crate) fn parsed<T: std::str::FromStr>(&self, name: &str, what: &str) -> Result<Option<T>, Problem> {
        self.get(name)
            .map(|text| text.parse().map_err(|_| Problem::query(name, &format!("must be {what}"))))
            .transpose()
    }

    /// The value of a parameter which is a word of a vocabulary that serde knows.
    ///
    /// # Errors
    /// A problem that says what the value must be.
    pub(crate) fn word<T: serde::de::DeserializeOwned>(&self, name: &str, what: &str) -> Result<Option<T>, Problem> {
        self.get(name)
            .map(|text| {
                serde_json::from_value(serde_json::Value::from(text))
                    .map_err(|_| Problem::query(name, &format!("must be {what}")))
            })
            .transpose()
    }

    /// Puts all `set` parameters into a job.
    ///
    /// # Errors
    /// Every one that cannot be put.
    pub(crate) fn assign_to(&self, job: &mut serde_json::Value) -> Result<(), Vec<Fault>> {
        let faults: Vec<Fault> = self
            .0
            .iter()
            .filter(|(name, _)| name == "set")
            .filter_map(|(_, text)| assign(job, text).err())
            .map(|fault| *fault)
            .collect();
        if faults.is_empty() { Ok(()) } else { Err(faults) }
    }
}

/// Text as it stands in a query: everything but what RFC 3986 calls unreserved is written by its bytes.
fn percent_encoded(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            out.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(out, "%{byte:02X}");
        }
    }
    out
}

impl Problem {
    /// A query parameter whose value has no meaning.
    #[must_use]
    pub(crate) fn query(name: &str, what: &str) -> Self {
        Self::new(Kind::BadRequest, format!("The query parameter `{name}` {what}."))
    }

    /// A header whose value has no meaning.
    #[must_use]
    pub(crate) fn header(name: &str, what: &str) -> Self {
        Self::new(Kind::BadRequest, format!("The header {name} {what}."))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn query(pairs: &[(&str, &str)]) -> Query {
        Query(pairs.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect())
    }

    #[test]
    fn names_that_do_not_exist_and_names_given_twice_are_refused() {
        let known = ["wait", "set"];
        assert!(query(&[("wait", "1"), ("set", "a=1"), ("set", "b=1")]).only(&known).is_ok());
        assert!(query(&[("wiat", "1")]).only(&known).is_err());
        assert!(query(&[("wait", "1"), ("wait", "2")]).only(&known).is_err());
    }

    #[test]
    fn a_query_is_written_the_same_whatever_its_order() {
        let one = query(&[("state", "failed"), ("label.order", "a b&c/ä"), ("limit", "3")]);
        let other = query(&[("label.order", "a b&c/ä"), ("state", "failed")]);
        assert_eq!(one.canonical_without(&["limit"]), other.canonical_without(&[]));
        assert_eq!(other.canonical_without(&[]), "label.order=a%20b%26c%2F%C3%A4&state=failed");
    }

    #[test]
    fn values_are_read_or_refused() {
        let query = query(&[("limit", "x"), ("wait", "7")]);
        assert!(query.parsed::<u32>("limit", "a number").is_err());
        assert_eq!(query.parsed::<u32>("wait", "a number").unwrap(), Some(7));
        assert_eq!(query.parsed::<u32>("other", "a number").unwrap(), None);
    }
}
