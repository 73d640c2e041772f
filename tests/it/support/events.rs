//! A client of server-sent events that reads one event at a time.

use std::time::Duration;

use reqwest::Response;
use serde_json::{Value, json};

use super::api::Live;
use super::contract::validate;
use super::queue::LONG;

/// One event of a stream, or a comment.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Event {
    pub(crate) id: Option<i64>,
    pub(crate) name: String,
    pub(crate) data: Value,
    pub(crate) retry: Option<u64>,
    pub(crate) comment: Option<String>,
}

/// An open stream.
pub(crate) struct Stream {
    response: Response,
    text: String,
}

impl Stream {
    /// Opens the events of a job, after the event with this id.
    pub(crate) async fn open(live: &Live, job: &str, after: Option<i64>) -> Self {
        let mut request = live.client.get(format!("{}/v1/jobs/{job}/events", live.address));
        // What browsers send, and a coding that must not be used here.
        request = request.header("Accept", "text/event-stream").header("Accept-Encoding", "gzip, zstd");
        if let Some(id) = after {
            request = request.header("Last-Event-ID", id.to_string());
        }
        let response = request.send().await.expect("an answer");
        assert_eq!(response.status(), 200);
        assert_eq!(response.headers()["content-type"], "text/event-stream");
        assert!(response.headers().contains_key("x-request-id"));
        assert!(!response.headers().contains_key("content-encoding"), "a compressor collects events");
        Self { response, text: String::new() }
    }

    /// Opens the events of a job as soon as there is a place for one more stream.
    pub(crate) async fn open_when_free(live: &Live, job: &str) -> Self {
        loop {
            let response = live.client.get(format!("{}/v1/jobs/{job}/events", live.address)).send().await.unwrap();
            if response.status() == 200 {
                return Self { response, text: String::new() };
            }
            assert_eq!(response.status(), 503);
            tokio::task::yield_now().await;
        }
    }

    /// The next event or comment; `None` when the stream has ended.
    pub(crate) async fn next(&mut self) -> Option<Event> {
        self.within(LONG).await.expect("an event, or the end")
    }

    /// The same, if it comes in time.
    pub(crate) async fn within(&mut self, time: Duration) -> Result<Option<Event>, tokio::time::error::Elapsed> {
        tokio::time::timeout(time, async {
            loop {
                if let Some((event, rest)) = self.text.split_once("\n\n") {
                    let (event, rest) = (read(event), rest.to_owned());
                    self.text = rest;
                    return Some(event);
                }
                let chunk = self.response.chunk().await.expect("the stream is not cut")?;
                self.text.push_str(std::str::from_utf8(&chunk).unwrap());
            }
        })
        .await
    }

    /// The next event that is named, comments and the like left out.
    pub(crate) async fn named(&mut self) -> Option<Event> {
        loop {
            let event = self.next().await?;
            if !event.name.is_empty() {
                return Some(event);
            }
        }
    }

    /// All named events until the end.
    pub(crate) async fn rest(mut self) -> Vec<Event> {
        let mut events = Vec::new();
        while let Some(event) = self.named().await {
            events.push(event);
        }
        events
    }
}

/// Reads an event and holds it against the contract.
pub(crate) fn read(text: &str) -> Event {
    let mut event = Event::default();
    for line in text.lines() {
        match line.split_once(':').map(|(field, value)| (field, value.trim_start())) {
            Some(("id", value)) => event.id = Some(value.parse().unwrap()),
            Some(("event", value)) => value.clone_into(&mut event.name),
            Some(("data", value)) => event.data = serde_json::from_str(value).unwrap(),
            Some(("retry", value)) => event.retry = Some(value.parse().unwrap()),
            Some(("", value)) => event.comment = Some(value.to_owned()),
            other => panic!("no field of an event: {other:?}"),
        }
    }
    if !event.name.is_empty() {
        let id = event.id.expect("an id").to_string();
        let whole = json!({ "event": event.name, "id": id, "data": event.data.to_string() });
        validate(&json!({ "$ref": "#/components/schemas/JobEvent" }), &whole, "an event");
        validate(&json!({ "$ref": "#/components/schemas/JobEventData" }), &event.data, "an event's data");
    }
    event
}
