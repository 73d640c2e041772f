//! The route table: every address of the service on one page.

use axum::Router;
use axum::handler::Handler;
use axum::http::{Extensions, HeaderMap, Method, StatusCode, Uri, Version};
use axum::middleware::{from_fn, from_fn_with_state};
use axum::routing::{MethodFilter, on};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{NotForContentType, Predicate as _, SizeAbove};

use super::answer::{Coded, finish_tags, not_acceptable};
use super::problem::{Kind, Problem, finish, panicked};
use super::results::ResultKind;
use super::service::{contract, docs, health, metrics, problems};
use super::{App, flatten, jobs, layers, results, surfaces};
use crate::telemetry::Metrics;

/// Answers shorter than this are not worth compressing, bytes.
const COMPRESSED_ABOVE: u64 = 1024;

/// The table.
fn table() -> Routes {
    Routes::default()
        .get("/v1/surfaces", surfaces::list)
        .post("/v1/surfaces", surfaces::create)
        .get("/v1/surfaces/{surface}", surfaces::show)
        .delete("/v1/surfaces/{surface}", surfaces::delete)
        .get("/v1/surfaces/{surface}/content", surfaces::content)
        .get("/v1/jobs", jobs::list)
        .post("/v1/jobs", jobs::create)
        .get("/v1/jobs/{job}", jobs::show)
        .delete("/v1/jobs/{job}", jobs::delete)
        .post("/v1/jobs/{job}/cancel", jobs::cancel)
        .get("/v1/jobs/{job}/events", jobs::events)
        .get("/v1/feed", jobs::feed)
        .result("/v1/jobs/{job}/mesh", results::mesh)
        .result("/v1/jobs/{job}/mesh.glb", results::mesh_glb)
        .result("/v1/jobs/{job}/mesh.obj", results::mesh_obj)
        .result("/v1/jobs/{job}/mesh.stl", results::mesh_stl)
        .result("/v1/jobs/{job}/mesh.ply", results::mesh_ply)
        .result("/v1/jobs/{job}/mesh.json", results::mesh_json)
        .result("/v1/jobs/{job}/pattern", results::pattern)
        .result("/v1/jobs/{job}/pattern.svg", results::pattern_svg)
        .result("/v1/jobs/{job}/pattern.dxf", results::pattern_dxf)
        .result("/v1/jobs/{job}/pattern.plt", results::pattern_plt)
        .result("/v1/jobs/{job}/pattern.json", results::pattern_json)
        .result("/v1/jobs/{job}/report", results::report)
        .result("/v1/jobs/{job}/report.json", results::report_json)
        .result("/v1/jobs/{job}/report.csv", results::report_csv)
        .result("/v1/jobs/{job}/seeds", results::seeds)
        .result("/v1/jobs/{job}/seeds.json", results::seeds_json)
        .result("/v1/jobs/{job}/seeds.csv", results::seeds_csv)
        .result("/v1/jobs/{job}/vertices", results::vertices)
        .result("/v1/jobs/{job}/vertices.csv", results::vertices_csv)
        .post("/v1/flatten", flatten::flatten)
        .get("/healthz", health::healthz)
        .get("/readyz", health::readyz)
        .get("/metrics", metrics::metrics)
        .get("/openapi.yaml", contract::contract)
        .get("/docs", docs::docs)
        .get("/problems", problems::list)
        .get("/problems/{problem}", problems::show)
}

/// The service's router, with everything that surrounds its handlers.
pub fn router(app: App) -> Router {
    let metrics = app.store().metrics().clone();
    let Routes { router, results, .. } = table();
    surrounded(router, results, metrics).with_state(app)
}

/// Every method and path that there is.
#[must_use]
pub fn paths() -> Vec<(Method, &'static str)> {
    table().paths
}

/// What every request goes through, from the inside out: a panic becomes an answer, every error a problem document,
/// long answers are compressed, and compressed ones have tags of their own. `results` are kept compressed: for them those
/// last two would be a way to walk for nothing, at each of many reads.
fn surrounded<S>(router: Router<S>, results: Router<S>, metrics: Metrics) -> Router<S>
where
    S: Clone + Send + Sync + 'static,
{
    let faultless = |router: Router<S>| router.layer(CatchPanicLayer::custom(panicked)).layer(from_fn(finish));
    faultless(router.fallback(nothing_here))
        // Events go out one by one; a compressor would collect them.
        .layer(
            CompressionLayer::new()
                .compress_when(SizeAbove::new(COMPRESSED_ABOVE).and(NotForContentType::SSE).and(is_not_coded)),
        )
        .layer(from_fn(finish_tags))
        .merge(faultless(results))
        .layer(from_fn_with_state(metrics, layers::surround))
}

/// An answer that has made its own choice of a coding is left as it is.
fn is_not_coded(_: StatusCode, _: Version, _: &HeaderMap, extensions: &Extensions) -> bool {
    extensions.get::<Coded>().is_none()
}

/// There is nothing here; a result's form that there is not is told so.
async fn nothing_here(uri: Uri) -> Problem {
    let path = uri.path();
    let result = path.strip_prefix("/v1/jobs/").and_then(|rest| rest.split_once('/')).map(|(_, name)| name);
    if let Some((name, _)) = result.and_then(|name| name.split_once('.'))
        && let Some(kind) = ResultKind::by_name(name)
    {
        return not_acceptable(kind.forms());
    }
    Problem::new(Kind::NotFound, format!("There is nothing at {path}. /openapi.yaml lists what there is."))
}

/// A router that knows what is in it.
#[derive(Default)]
struct Routes {
    router: Router<App>,
    /// Those whose answers come in a coding and with a tag of their own.
    results: Router<App>,
    paths: Vec<(Method, &'static str)>,
}

impl Routes {
    fn get<H: Handler<T, App>, T: 'static>(self, path: &'static str, handler: H) -> Self {
        self.on(Method::GET, MethodFilter::GET, path, handler)
    }

    fn result<H: Handler<T, App>, T: 'static>(mut self, path: &'static str, handler: H) -> Self {
        self.results = self.results.route(path, on(MethodFilter::GET, handler));
        self.paths.push((Method::GET, path));
        self
    }

    fn post<H: Handler<T, App>, T: 'static>(self, path: &'static str, handler: H) -> Self {
        self.on(Method::POST, MethodFilter::POST, path, handler)
    }

    fn delete<H: Handler<T, App>, T: 'static>(self, path: &'static str, handler: H) -> Self {
        self.on(Method::DELETE, MethodFilter::DELETE, path, handler)
    }

    fn on<H: Handler<T, App>, T: 'static>(
        mut self,
        method: Method,
        filter: MethodFilter,
        path: &'static str,
        handler: H,
    ) -> Self {
        self.router = self.router.route(path, on(filter, handler));
        self.paths.push((method, path));
        self
    }
}

#[cfg(test)]
mod tests {
    use axum::body::Body;
    use axum::http::Request;
    use axum::routing::get;
    use http_body_util::BodyExt as _;
    use tower::ServiceExt as _;

    use super::*;

    async fn panics() -> &'static str {
        panic!("something secret")
    }

    async fn asked(router: &Router, path: &str) -> (StatusCode, String) {
        let request = Request::get(path).body(Body::empty()).unwrap();
        let answer = router.clone().oneshot(request).await.unwrap();
        assert_eq!(answer.headers()["x-content-type-options"], "nosniff");
        let status = answer.status();
        let body = answer.into_body().collect().await.unwrap().to_bytes();
        (status, String::from_utf8(body.to_vec()).unwrap())
    }

    #[tokio::test]
    async fn a_panic_is_a_problem_that_tells_nothing_and_the_next_request_is_served() {
        let router = surrounded(
            Router::new().route("/panic", get(panics)).route("/good", get(|| async { "good" })),
            Router::new().route("/result", get(panics)),
            Metrics::new(),
        );
        for path in ["/panic", "/result"] {
            let (status, text) = asked(&router, path).await;
            assert_eq!(status, StatusCode::INTERNAL_SERVER_ERROR);
            assert!(text.contains("/problems/internal") && !text.contains("secret"), "{text}");
        }
        assert_eq!(asked(&router, "/good").await, (StatusCode::OK, "good".to_owned()));
    }

    #[tokio::test]
    async fn errors_that_the_framework_makes_are_problems_too() {
        let refusing = get(|| async { (StatusCode::PAYLOAD_TOO_LARGE, "too long") });
        let router = surrounded(Router::new().route("/long", refusing), Router::new(), Metrics::new());
        let (status, text) = asked(&router, "/long").await;
        assert_eq!(status, StatusCode::PAYLOAD_TOO_LARGE);
        assert!(text.contains("/problems/body-too-large"), "{text}");
        let (status, text) = asked(&router, "/nowhere").await;
        assert_eq!(status, StatusCode::NOT_FOUND);
        assert!(text.contains("/problems/not-found"), "{text}");
    }
}
