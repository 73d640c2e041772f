//! A surface as the API tells of it, and what jobs need to know of one.

use serde_json::{Map, Value, json};

use crate::api::times::rfc3339;
use crate::engine::job::Labels;
use crate::engine::nurbs::Domain;
use crate::store::Surface;

/// The document: what the service knows, and the summary that was made when the surface came.
#[must_use]
pub(crate) fn document(surface: &Surface) -> Value {
    let address = format!("/v1/surfaces/{}", surface.id);
    let mut document = match &surface.summary {
        Value::Object(summary) => summary.clone(),
        _ => Map::new(),
    };
    let mut put = |name: &str, value: Value| document.insert(name.to_owned(), value);
    put("id", json!(surface.id));
    put("name", json!(surface.name));
    put("kind", json!(surface.kind));
    put("units", json!(surface.units));
    put("bytes", json!(surface.length));
    put("media_type", json!(surface.media));
    put("reading", surface.reading.clone());
    put("created_at", json!(rfc3339(surface.created_us)));
    put("links", json!({ "self": address, "content": format!("{address}/content") }));
    Value::Object(document)
}

/// The domain of a surface's parameters.
#[must_use]
pub(crate) fn domain(surface: &Surface) -> Option<Domain> {
    domain_of(&surface.summary)
}

/// The same from a summary.
#[must_use]
pub fn domain_of(summary: &Value) -> Option<Domain> {
    let [u, v]: [[f64; 2]; 2] = serde_json::from_value(summary.get("domain")?.clone()).ok()?;
    Some(Domain { u, v })
}

/// The labels that a surface's file carries, from its summary, and its name as one of them, so that both stay with a
/// job's results when the surface is deleted.
#[must_use]
pub fn labels_of(summary: &Value, name: Option<&str>) -> Labels {
    let mut labels: Labels =
        summary.get("labels").and_then(|labels| serde_json::from_value(labels.clone()).ok()).unwrap_or_default();
    if let Some(name) = name {
        labels.entry(NAME.to_owned()).or_insert_with(|| name.to_owned());
    }
    labels
}

/// The label that holds the part's name.
pub const NAME: &str = "name";
