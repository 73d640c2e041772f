//! `GET /docs`: the contract as a page to read, made from `openapi.yaml` itself. One file, no scripts, no outside host.

use std::fmt::Write as _;
use std::sync::LazyLock;

use axum::body::Bytes;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value};

use super::contract::CONTRACT;
use crate::api::answer::Tag;
use crate::api::problem::Problem;
use crate::api::request::Query;

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222;\
background:#fff}code,pre{font-family:ui-monospace,monospace;font-size:.9em;background:#f3f3f3;border-radius:3px}\
code{padding:0 .2em}pre{padding:.7em;overflow:auto}table{border-collapse:collapse;width:100%}\
td,th{border-top:1px solid #ddd;padding:.3em .6em;text-align:left;vertical-align:top}section{margin:2.5rem 0}\
h3{border-top:2px solid #222;padding-top:.5rem}.method{display:inline-block;min-width:4.5rem;font-weight:700}\
.quiet{color:#555}nav li{list-style:none}@media(prefers-color-scheme:dark){body{background:#181818;color:#ddd}\
code,pre{background:#282828}a{color:#8bf}td,th{border-color:#444}h3{border-color:#ddd}.quiet{color:#aaa}}";

/// The page is made once. The contract is a part of the program, so what cannot be read of it is a fault of the build.
static PAGE: LazyLock<Option<Bytes>> = LazyLock::new(|| {
    let contract: Value = serde_saphyr::from_str(CONTRACT)
        .inspect_err(|error| tracing::error!(%error, "the contract cannot be read"))
        .ok()?;
    Some(page(&contract).into())
});

/// The page.
pub(crate) async fn docs(query: Query, headers: HeaderMap) -> Result<Response, Problem> {
    query.only(&[])?;
    let tag = Tag::of(&[CONTRACT.as_bytes(), STYLE.as_bytes(), env!("CARGO_PKG_VERSION").as_bytes()]);
    if let Some(answer) = tag.not_modified(&headers) {
        return Ok(answer);
    }
    let page = PAGE.clone().ok_or_else(Problem::internal)?;
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8")),
        (header::ETAG, tag.header()),
        (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
    ];
    Ok((headers, page).into_response())
}

fn page(contract: &Value) -> String {
    let title = escaped(text(&contract["info"]["title"]));
    let mut out = format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{title} API</title><style>{STYLE}</style></head><body><h1>{title} {}</h1>",
        escaped(text(&contract["info"]["version"]))
    );
    out.push_str(&prose(text(&contract["info"]["description"])));
    out.push_str(
        "<p class=\"quiet\">Made from <a href=\"/openapi.yaml\">openapi.yaml</a>, which is what holds.</p><nav>",
    );
    let operations = operations(contract);
    for tag in contract["tags"].as_array().into_iter().flatten() {
        let name = text(&tag["name"]);
        put(&mut out, format_args!("<h2>{}</h2><p>{}</p><ul>", escaped(name), escaped(text(&tag["description"]))));
        for operation in operations.iter().filter(|operation| operation.is_of(name)) {
            let id = escaped(text(&operation.what["operationId"]));
            put(
                &mut out,
                format_args!(
                    "<li><a href=\"#{id}\"><code>{} {}</code></a> {}</li>",
                    operation.method,
                    escaped(operation.path),
                    escaped(text(&operation.what["summary"]))
                ),
            );
        }
        out.push_str("</ul>");
    }
    out.push_str("</nav>");
    for operation in &operations {
        operation.write(contract, &mut out);
    }
    out.push_str("<h2>Schemas</h2>");
    for (name, schema) in fields(&contract["components"]["schemas"]) {
        put(&mut out, format_args!("<section id=\"schema-{0}\"><h3>{0}</h3>", escaped(name)));
        out.push_str(&prose(text(&schema["description"])));
        properties(schema, &mut out);
        out.push_str("</section>");
    }
    out.push_str("</body></html>");
    out
}

/// A call.
struct Operation<'a> {
    path: &'a str,
    method: String,
    what: &'a Value,
    /// Parameters of the path and of the call.
    parameters: Vec<&'a Value>,
}

fn operations(contract: &Value) -> Vec<Operation<'_>> {
    let mut found = Vec::new();
    for (path, item) in fields(&contract["paths"]) {
        let shared = item["parameters"].as_array();
        for (method, what) in fields(item).filter(|(key, _)| *key != "parameters") {
            let own = what["parameters"].as_array();
            let parameters = shared.into_iter().chain(own).flatten().map(|p| resolved(contract, p)).collect();
            found.push(Operation { path, method: method.to_uppercase(), what, parameters });
        }
    }
    found
}

impl Operation<'_> {
    fn is_of(&self, tag: &str) -> bool {
        self.what["tags"].as_array().is_some_and(|tags| tags.iter().any(|other| other == tag))
    }

    fn write(&self, contract: &Value, out: &mut String) {
        let (id, path) = (escaped(text(&self.what["operationId"])), escaped(self.path));
        put(
            out,
            format_args!(
                "<section id=\"{id}\"><h3><span class=\"method\">{}</span> <code>{path}</code></h3>",
                self.method
            ),
        );
        put(out, format_args!("<p><strong>{}</strong></p>", escaped(text(&self.what["summary"]))));
        out.push_str(&prose(text(&self.what["description"])));
        if !self.parameters.is_empty() {
            out.push_str("<table><tr><th>Parameter</th><th>in</th><th>is</th><th></th></tr>");
            for parameter in &self.parameters {
                let need = if parameter["required"] == true { " <em>needed</em>" } else { "" };
                put(
                    out,
                    format_args!(
                        "<tr><td><code>{}</code>{need}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                        escaped(text(&parameter["name"])),
                        escaped(text(&parameter["in"])),
                        kind(&parameter["schema"]),
                        prose(text(&parameter["description"]))
                    ),
                );
            }
            out.push_str("</table>");
        }
        contents(&self.what["requestBody"]["content"], "Body", out);
        out.push_str("<table><tr><th>Status</th><th>Answer</th><th>Body</th></tr>");
        for (status, response) in fields(&self.what["responses"]) {
            let response = resolved(contract, response);
            put(out, format_args!("<tr><td>{status}</td><td>{}</td><td>", prose(text(&response["description"]))));
            for (media, content) in fields(&response["content"]) {
                put(out, format_args!("<code>{}</code> {}<br>", escaped(media), kind(&content["schema"])));
            }
            out.push_str("</td></tr>");
        }
        out.push_str("</table></section>");
    }
}

/// The forms of a body, with their examples.
fn contents(content: &Value, title: &str, out: &mut String) {
    for (media, form) in fields(content) {
        put(out, format_args!("<p>{title}: <code>{}</code> {}</p>", escaped(media), kind(&form["schema"])));
        for example in fields(&form["examples"]).filter_map(|(_, example)| example.get("value")) {
            let shown = serde_json::to_string_pretty(example).unwrap_or_default();
            put(out, format_args!("<details><summary>Example</summary><pre>{}</pre></details>", escaped(&shown)));
        }
    }
}

/// The properties of an object as a table, or what the schema is.
fn properties(schema: &Value, out: &mut String) {
    if schema["properties"].is_null() {
        put(out, format_args!("<p>{}</p>", kind(schema)));
        return;
    }
    let needed = |name: &str| schema["required"].as_array().is_some_and(|list| list.iter().any(|other| other == name));
    out.push_str("<table><tr><th>Field</th><th>is</th><th></th></tr>");
    for (name, property) in fields(&schema["properties"]) {
        let need = if needed(name) { " <em>needed</em>" } else { "" };
        let about = prose(text(&property["description"]));
        put(
            out,
            format_args!("<tr><td><code>{}</code>{need}</td><td>{}</td><td>{about}", escaped(name), kind(property)),
        );
        // Objects that have no name of their own are shown where they stand.
        for inner in [property, &property["items"]] {
            if !inner["properties"].is_null() {
                properties(inner, out);
            }
        }
        out.push_str("</td></tr>");
    }
    out.push_str("</table>");
}

/// What a value of a schema is, in a few words.
fn kind(schema: &Value) -> String {
    if let Some(pointer) = schema["$ref"].as_str() {
        let name = escaped(pointer.rsplit('/').next().unwrap_or(pointer));
        return format!("<a href=\"#schema-{name}\">{name}</a>");
    }
    for (word, between) in [("anyOf", " or "), ("oneOf", " or "), ("allOf", " and ")] {
        if let Some(list) = schema[word].as_array() {
            return list.iter().map(kind).collect::<Vec<_>>().join(between);
        }
    }
    if let Some(list) = schema["enum"].as_array() {
        return list
            .iter()
            .map(|value| format!("<code>{}</code>", escaped(&bare(value))))
            .collect::<Vec<_>>()
            .join(", ");
    }
    if let Some(value) = schema.get("const") {
        return format!("<code>{}</code>", escaped(&bare(value)));
    }
    let mut words = match &schema["type"] {
        Value::String(word) => word.clone(),
        Value::Array(list) => list.iter().map(bare).collect::<Vec<_>>().join(" or "),
        _ => "any value".to_owned(),
    };
    if !schema["items"].is_null() {
        words = format!("{words} of {}", kind(&schema["items"]));
    }
    let mut bounds: Vec<String> = Vec::new();
    for (name, said) in [("minimum", "from"), ("exclusiveMinimum", "above"), ("maximum", "to"), ("default", "default")]
    {
        if let Some(value) = schema.get(name) {
            bounds.push(format!("{said} {}", escaped(&bare(value))));
        }
    }
    if bounds.is_empty() { words } else { format!("{words}, {}", bounds.join(", ")) }
}

/// The contract's texts: paragraphs, lists of `- ` items, and `code`.
fn prose(source: &str) -> String {
    let mut out = String::new();
    for block in source.split("\n\n").filter(|block| !block.trim().is_empty()) {
        if block.trim_start().starts_with("- ") {
            let items = block.trim_start().trim_start_matches("- ").split("\n- ");
            out.push_str("<ul>");
            for item in items {
                put(&mut out, format_args!("<li>{}</li>", inline(item)));
            }
            out.push_str("</ul>");
        } else {
            put(&mut out, format_args!("<p>{}</p>", inline(block)));
        }
    }
    out
}

fn inline(source: &str) -> String {
    let parts = source.split('`').enumerate();
    parts.map(|(i, part)| if i % 2 == 1 { format!("<code>{}</code>", escaped(part)) } else { escaped(part) }).collect()
}

fn escaped(source: &str) -> String {
    source.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// A value without the quotes of a text.
fn bare(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn fields(value: &Value) -> impl Iterator<Item = (&str, &Value)> {
    value.as_object().into_iter().flat_map(Map::iter).map(|(name, value)| (name.as_str(), value))
}

fn resolved<'a>(contract: &'a Value, value: &'a Value) -> &'a Value {
    let pointer = value["$ref"].as_str().map(|pointer| pointer.trim_start_matches('#'));
    pointer.and_then(|pointer| contract.pointer(pointer)).unwrap_or(value)
}

fn put(out: &mut String, what: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = out.write_fmt(what);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_call_and_every_schema_of_the_contract_is_on_the_page_and_every_link_leads_somewhere() {
        let contract: Value = serde_saphyr::from_str(CONTRACT).unwrap();
        let page = page(&contract);
        for operation in operations(&contract) {
            let id = text(&operation.what["operationId"]);
            assert!(page.contains(&format!("<section id=\"{id}\">")), "{id}");
            assert!(page.contains(&format!("<a href=\"#{id}\">")), "{id} is in no list");
        }
        for link in page.split("href=\"#").skip(1) {
            let target = link.split('"').next().unwrap();
            assert!(page.contains(&format!("id=\"{target}\"")), "#{target} leads nowhere");
        }
        for asks in ["<script", "<link", "<img", "src=", "url(", "@import", "href=\"http"] {
            assert!(!page.contains(asks), "the page asks for something else: {asks}");
        }
    }

    #[test]
    fn texts_are_shown_and_not_obeyed() {
        assert_eq!(
            prose("a <b> `<i>`\n\n- one\n- two"),
            "<p>a &lt;b&gt; <code>&lt;i&gt;</code></p><ul><li>one</li><li>two</li></ul>"
        );
    }
}
