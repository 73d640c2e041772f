//! The contract as a judge: every answer of a service under test must be one that `openapi.yaml` describes.

use std::collections::BTreeSet;
use std::io::Read as _;
use std::sync::{LazyLock, Mutex};

use jsonschema::Validator;
use reqwest::{Method, StatusCode, header};
use serde_json::{Map, Value, json};

/// The contract, as the service serves it.
pub(crate) static CONTRACT: LazyLock<Value> =
    LazyLock::new(|| serde_saphyr::from_str(planish::api::CONTRACT).expect("openapi.yaml is YAML"));

/// Operations and statuses that answers of this process were seen with.
static SEEN: Mutex<BTreeSet<(String, u16)>> = Mutex::new(BTreeSet::new());

/// An answer that was read whole and found to be as the contract says.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: StatusCode,
    pub(crate) headers: header::HeaderMap,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {}", self.text()))
    }

    /// The body without its content coding.
    pub(crate) fn decoded(&self) -> Vec<u8> {
        match self.header("content-encoding") {
            Some("gzip") => {
                let mut bytes = Vec::new();
                flate2::read::GzDecoder::new(self.body.as_slice()).read_to_end(&mut bytes).expect("gzip");
                bytes
            }
            Some("zstd") => zstd::stream::decode_all(self.body.as_slice()).expect("zstd"),
            _ => self.body.clone(),
        }
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        self.headers.get(name).map(|value| value.to_str().expect("a header of text"))
    }

    /// The answer must have this status.
    pub(crate) fn expect(self, status: u16) -> Self {
        assert_eq!(self.status.as_u16(), status, "{}", self.text());
        self
    }

    /// The answer must be a problem of this type; gives its document.
    pub(crate) fn problem(&self, slug: &str) -> Value {
        let document = self.json();
        assert_eq!(document["type"], format!("/problems/{slug}"), "{document:#}");
        assert_eq!(document["status"], self.status.as_u16(), "{document:#}");
        document
    }

    /// The pointers of all faults, sorted.
    pub(crate) fn pointers(&self) -> Vec<String> {
        let document = self.json();
        let errors = document["errors"].as_array().unwrap_or_else(|| panic!("no errors in {document:#}"));
        let mut pointers: Vec<String> = errors.iter().map(|e| e["pointer"].as_str().unwrap().to_owned()).collect();
        pointers.sort();
        pointers
    }
}

/// Operations that the contract describes: method and path template.
pub(crate) fn operations() -> BTreeSet<(String, String)> {
    let mut operations = BTreeSet::new();
    for (path, item) in CONTRACT["paths"].as_object().unwrap() {
        for method in item.as_object().unwrap().keys().filter(|key| *key != "parameters") {
            operations.insert((method.to_uppercase(), path.clone()));
        }
    }
    operations
}

/// Operations (by their id) and statuses that were seen so far in this process.
pub(crate) fn seen() -> BTreeSet<(String, u16)> {
    SEEN.lock().unwrap().clone()
}

/// Reads an answer and holds it against the contract.
pub(crate) async fn judge(method: &Method, path: &str, response: reqwest::Response) -> Answer {
    let status = response.status();
    let headers = response.headers().clone();
    let body = response.bytes().await.expect("the answer comes whole").to_vec();
    let answer = Answer { status, headers, body };
    assert_eq!(answer.header("x-content-type-options"), Some("nosniff"));
    assert!(answer.header("content-security-policy").is_some_and(|p| p.contains("default-src 'none'")));
    assert!(answer.header("x-request-id").is_some());
    let documented = answer.status.is_client_error() || answer.status.is_server_error();
    if documented && *method != Method::HEAD {
        assert_eq!(answer.header("content-type"), Some("application/problem+json"));
        assert_eq!(answer.json()["request_id"].as_str(), answer.header("x-request-id"));
    }
    // These two are answered at every address there is, without a word in the contract's list of operations.
    if *method == Method::OPTIONS && status == StatusCode::NO_CONTENT {
        assert!(answer.header("allow").is_some_and(|allow| !allow.is_empty()));
        return answer;
    }
    if *method == Method::HEAD && status != StatusCode::METHOD_NOT_ALLOWED {
        assert!(answer.body.is_empty());
        assert!(operation(&Method::GET, path).is_none_or(|get| get["responses"][status.as_str()].is_object()));
        return answer;
    }
    let Some(operation) = operation(method, path) else {
        assert!(status.is_client_error(), "{method} {path} is not in the contract, and was answered with {status}");
        validate(&json!({ "$ref": "#/components/schemas/Problem" }), &answer.json(), path);
        return answer;
    };
    let name = operation["operationId"].as_str().unwrap().to_owned();
    SEEN.lock().unwrap().insert((name.clone(), status.as_u16()));
    let described = &operation["responses"][status.as_str()];
    assert!(described.is_object(), "{name} is not to answer {status}: {}", answer.text());
    let described = resolved(described);
    let Some(contents) = described.get("content") else {
        assert!(answer.body.is_empty(), "{name} {status} is to have no body, and has {}", answer.text());
        return answer;
    };
    let media = answer.header("content-type").unwrap_or_else(|| panic!("{name} {status} has no type"));
    let essence = media.split(';').next().unwrap().trim();
    let content = &contents[essence];
    assert!(content.is_object(), "{name} {status} is not to be {essence}");
    if essence.ends_with("json") {
        let body = serde_json::from_slice(&answer.decoded()).expect("JSON");
        validate(&content["schema"], &body, &name);
    }
    if essence == "text/event-stream" {
        answer.text().split_terminator("\n\n").for_each(|event| drop(super::events::read(event)));
    }
    for (header, described) in described.get("headers").and_then(Value::as_object).unwrap_or(&Map::new()) {
        if let Some(value) = answer.header(header) {
            let schema = resolved(described)["schema"].clone();
            let value = if schema["type"] == "integer" { json!(value.parse::<i64>().unwrap()) } else { json!(value) };
            validate(&schema, &value, header);
        }
    }
    answer
}

/// The operation that a request meant.
fn operation(method: &Method, path: &str) -> Option<Value> {
    let path = path.split('?').next().unwrap();
    let fits = |template: &str| {
        let (a, b): (Vec<_>, Vec<_>) = (template.split('/').collect(), path.split('/').collect());
        a.len() == b.len()
            && a.iter().zip(&b).all(|(a, b)| a == b || (a.starts_with('{') && a.ends_with('}') && !b.is_empty()))
    };
    let paths = CONTRACT["paths"].as_object().unwrap();
    // A path without parameters goes before one with them.
    let item = paths.get(path).or_else(|| paths.iter().find(|(template, _)| fits(template)).map(|(_, item)| item))?;
    item.get(method.as_str().to_lowercase()).cloned()
}

/// Follows a `$ref` into the components.
pub(crate) fn resolved(value: &Value) -> &Value {
    match value.get("$ref").and_then(Value::as_str) {
        Some(pointer) => CONTRACT.pointer(pointer.trim_start_matches('#')).expect("a reference that leads somewhere"),
        None => value,
    }
}

/// A validator of a schema that may refer to the components.
pub(crate) fn validator(schema: &Value) -> Validator {
    let mut root = schema.as_object().expect("a schema is an object").clone();
    root.insert("$schema".to_owned(), json!("https://json-schema.org/draft/2020-12/schema"));
    root.insert("components".to_owned(), CONTRACT["components"].clone());
    jsonschema::draft202012::new(&Value::Object(root)).expect("a sound schema")
}

/// The value must be as the schema says.
pub(crate) fn validate(schema: &Value, value: &Value, what: &str) {
    let faults: Vec<String> =
        validator(schema).iter_errors(value).map(|e| format!("{}: {e}", e.instance_path())).collect();
    assert!(faults.is_empty(), "{what} is not as the contract says: {faults:#?}\n{value:#}");
}
