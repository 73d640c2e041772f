//! The layer that writes problem documents, outermost but for the headers that every answer carries. It also answers
//! `OPTIONS` at every address that there is.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};

use super::{Kind, Problem};
use crate::api::layers::RequestId;

/// Writes the document of a problem, and makes problems of error answers that are none.
pub async fn finish(request: Request, next: Next) -> Response {
    let uri = request.uri().clone();
    let method = request.method().clone();
    let id = request.extensions().get::<RequestId>().cloned();
    let mut response = next.run(request).await;
    if method == Method::OPTIONS && response.status() == StatusCode::METHOD_NOT_ALLOWED {
        // The router adds `Allow`, which is the answer.
        return StatusCode::NO_CONTENT.into_response();
    }
    if !response.status().is_client_error() && !response.status().is_server_error() {
        return response;
    }
    let path = uri.path();
    let problem = response.extensions_mut().remove::<Arc<Problem>>().unwrap_or_else(|| {
        let kind = Kind::of_status(response.status());
        let detail = match kind {
            Kind::NotFound => format!("There is nothing at {path}."),
            Kind::MethodNotAllowed => format!("{path} does not know {method}."),
            _ => kind.text().to_owned(),
        };
        Arc::new(Problem::new(kind, detail))
    });
    let (mut parts, _) = response.into_parts();
    parts.status = problem.kind().status();
    parts.headers.remove(header::CONTENT_LENGTH);
    parts.headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
    parts.headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    // A problem holds strings, numbers that were checked, and nothing that can fail to be written.
    let body = serde_json::to_vec(&problem.document(path).to(id.as_ref().map(RequestId::as_str))).unwrap_or_default();
    Response::from_parts(parts, Body::from(body))
}
