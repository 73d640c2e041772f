//! A body that has parts, as a form sends it: `multipart/form-data` (RFC 7578) with `surface` and `job`.

use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, FromRequest as _, Multipart, Request};
use axum::http::{HeaderValue, header};

use crate::api::problem::{Kind, Problem};

/// Most names of parts without a meaning that are kept: a body with more is refused as a whole.
const MAX_OTHERS: usize = 32;

/// The parts of a body.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Parts {
    /// The surface.
    pub surface: Option<Bytes>,
    /// The job.
    pub job: Option<Bytes>,
    /// Names of parts that have no meaning here.
    pub others: Vec<String>,
}

/// Takes a body apart. `media` is its type, which has the boundary between the parts; they come in any order.
///
/// # Errors
/// 400 when it is not what it is said to be, or a part comes twice; 413 when the job is longer than `longest_job`.
pub(crate) async fn parts(bytes: Bytes, media: &HeaderValue, longest_job: usize) -> Result<Parts, Problem> {
    let broken = |_| Problem::new(Kind::BadRequest, "The body is not multipart/form-data as its type says.");
    let mut request = Request::new(Body::from(bytes));
    request.headers_mut().insert(header::CONTENT_TYPE, media.clone());
    // The body has been read with the limits of this service.
    DefaultBodyLimit::disable().apply(&mut request);
    let boundary = |_| Problem::new(Kind::BadRequest, "The type multipart/form-data has no boundary.");
    let mut form = Multipart::from_request(request, &()).await.map_err(boundary)?;
    let mut parts = Parts::default();
    while let Some(field) = form.next_field().await.map_err(broken)? {
        let name = field.name().unwrap_or_default().to_owned();
        let place = match name.as_str() {
            "surface" => &mut parts.surface,
            "job" => &mut parts.job,
            _ if parts.others.len() < MAX_OTHERS => {
                parts.others.push(name.chars().take(100).collect());
                continue;
            }
            _ => return Err(Problem::new(Kind::BadRequest, "The body has too many parts.")),
        };
        if place.is_some() {
            return Err(Problem::new(Kind::BadRequest, format!("The part `{name}` comes twice: keep one of them.")));
        }
        *place = Some(field.bytes().await.map_err(broken)?);
    }
    if parts.job.as_ref().is_some_and(|job| job.len() > longest_job) {
        return Err(Problem::new(Kind::BodyTooLarge, format!("A job has at most {longest_job} bytes.")));
    }
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn taken(body: &str) -> Result<Parts, Kind> {
        let media = HeaderValue::from_static("multipart/form-data; boundary=x");
        parts(Bytes::from(body.replace('\n', "\r\n")), &media, 10).await.map_err(|problem| problem.kind())
    }

    #[tokio::test]
    async fn parts_come_in_any_order_and_each_once() {
        let job = "--x\nContent-Disposition: form-data; name=\"job\"\n\n{}\n";
        let surface = "--x\nContent-Disposition: form-data; name=\"surface\"; filename=\"a.glb\"\nContent-Type: model/gltf-binary\n\nglTF\n";
        let other = "--x\nContent-Disposition: form-data; name=\"colour\"\n\nred\n";
        for body in [format!("{job}{surface}{other}--x--\n"), format!("{surface}{other}{job}--x--\n")] {
            let parts = taken(&body).await.unwrap();
            assert_eq!((parts.surface, parts.job), (Some("glTF".into()), Some("{}".into())));
            assert_eq!(parts.others, ["colour"]);
        }
        assert_eq!(taken(&format!("{job}{job}--x--\n")).await, Err(Kind::BadRequest));
        assert_eq!(taken(&format!("{job}{surface}")).await, Err(Kind::BadRequest));
        assert_eq!(taken("nothing of the sort").await, Err(Kind::BadRequest));
        assert_eq!(taken(&format!("{}--x--\n", job.replace("{}", "[1,2,3,4,5,6]"))).await, Err(Kind::BodyTooLarge));
        assert_eq!(taken(&format!("{}--x--\n", other.repeat(100))).await, Err(Kind::BadRequest));
        let none = parts(Bytes::from_static(b"--x--"), &HeaderValue::from_static("multipart/form-data"), 10).await;
        assert_eq!(none.unwrap_err().kind(), Kind::BadRequest);
    }
}
