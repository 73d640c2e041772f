//! The service in numbers, for Prometheus: one type, one place where every name stands.
//!
//! Counters and histograms grow where things happen; what merely stands at some value (jobs that wait, the size of the
//! database) is read when it is asked for ([`Standing`]). Every label has few values: kinds of work and routes are those
//! of this program, whatever a client sends. Times are seconds, sizes bytes, as Prometheus has it.

use std::collections::HashMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use prometheus_client::encoding::{EncodeLabelSet, text};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::{ConstGauge, Gauge};
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::{Registry, Unit};

/// Upper ends of the classes of request times, seconds: from a `304` to a long-poll.
const REQUEST_CLASSES: [f64; 13] = [0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 2.5, 10.0, 60.0];
/// Upper ends of the classes of job times, seconds: from a small part to the time limit of an attempt.
const JOB_CLASSES: [f64; 13] = [0.001, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 2.5, 10.0, 60.0, 300.0, 600.0];
/// Upper ends of the classes of the times that writes to the database take, seconds.
const WRITE_CLASSES: [f64; 10] = [0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.25, 1.0, 5.0];
/// Kinds of work that have a label value of their own.
const KINDS: [&str; 3] = ["triangulate", "flatten", "optimum-seed-search"];
/// The value for what has none: a kind of a later version, a path that is no route, a method that nobody knows.
const OTHER: &str = "other";
/// Methods that have a label value of their own.
const METHODS: [&str; 7] = ["GET", "HEAD", "POST", "DELETE", "OPTIONS", "PUT", "PATCH"];

/// The label value of a kind of work.
#[must_use]
pub fn kind_label(kind: &str) -> &'static str {
    KINDS.into_iter().find(|known| *known == kind).unwrap_or(OTHER)
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Request {
    method: &'static str,
    route: String,
    status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Route {
    method: &'static str,
    route: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Kind {
    kind: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct KindState {
    kind: &'static str,
    state: &'static str,
}

type Classes = fn() -> Histogram;

/// The numbers of one service; clones share them.
#[derive(Debug, Clone)]
pub struct Metrics(Arc<Inner>);

/// The numbers of a route's answers to one method with one status.
#[derive(Debug)]
struct Answers {
    method: &'static str,
    status: u16,
    count: Counter,
    seconds: Histogram,
}

impl Answers {
    fn one(&self, took: Duration) {
        self.count.inc();
        self.seconds.observe(took.as_secs_f64());
    }
}

#[derive(Debug)]
struct Inner {
    /// By route: what its answers count, so that no labels are made and looked up for each of them.
    answers: RwLock<HashMap<String, Vec<Answers>>>,
    requests: Family<Request, Counter>,
    request_seconds: Family<Route, Histogram, Classes>,
    ended: Family<KindState, Counter>,
    run_seconds: Family<Kind, Histogram, Classes>,
    wait_seconds: Family<Kind, Histogram, Classes>,
    write_seconds: Histogram,
    open: Family<KindState, Gauge>,
    queue_age: Gauge<f64, AtomicU64>,
    workers: Gauge,
    stuck: Gauge,
    streams: Gauge,
    database: Gauge,
    log: Gauge,
    readable: Gauge,
    /// Held while the numbers that stand are set and written, so that two who ask at once do not mix theirs.
    registry: Mutex<Registry>,
}

/// What stands at some value when the numbers are asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Standing {
    /// What the database says; none when it did not answer.
    pub stored: Option<Stored>,
    /// Workers.
    pub workers: u64,
    /// Attempts that were told to stop and do not.
    pub stuck: u64,
    /// Open streams of events.
    pub streams: u64,
}

/// The part of [`Standing`] that the database knows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stored {
    /// Jobs that have not ended: kind, state, how many.
    pub open: Vec<(String, &'static str, u64)>,
    /// How long the oldest waiting job has waited.
    pub queue_age: Duration,
    /// Bytes of the database's file.
    pub database_bytes: u64,
    /// Bytes of its log.
    pub log_bytes: u64,
}

impl Default for Metrics {
    fn default() -> Self {
        Self::new()
    }
}

impl Metrics {
    /// All at zero; the process counts as started now.
    #[must_use]
    pub fn new() -> Self {
        let requests = Family::default();
        let request_seconds = Family::new_with_constructor((|| Histogram::new(REQUEST_CLASSES)) as Classes);
        let ended = Family::default();
        let run_seconds = Family::new_with_constructor((|| Histogram::new(JOB_CLASSES)) as Classes);
        let wait_seconds = Family::new_with_constructor((|| Histogram::new(JOB_CLASSES)) as Classes);
        let write_seconds = Histogram::new(WRITE_CLASSES);
        let open = Family::default();
        let queue_age = Gauge::default();
        let (workers, stuck, streams) = (Gauge::default(), Gauge::default(), Gauge::default());
        let (database, log, readable) = (Gauge::default(), Gauge::default(), Gauge::default());
        let mut registry = Registry::default();
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        let start = ConstGauge::new(since);
        registry.register_with_unit("process_start_time", "When the process started, since 1970", Unit::Seconds, start);
        let all = registry.sub_registry_with_prefix("planish");
        all.register("http_requests", "Requests by method, route and status", Family::clone(&requests));
        all.register_with_unit(
            "http_request_duration",
            "Time until the head of the answer, waits included",
            Unit::Seconds,
            Family::clone(&request_seconds),
        );
        all.register("jobs_ended", "Jobs that ended since the start", Family::clone(&ended));
        all.register_with_unit(
            "job_duration",
            "Time that the last attempt of a job took",
            Unit::Seconds,
            Family::clone(&run_seconds),
        );
        all.register_with_unit(
            "job_wait",
            "Time from acceptance to the last attempt",
            Unit::Seconds,
            Family::clone(&wait_seconds),
        );
        all.register_with_unit(
            "store_write_duration",
            "Time from the wish to write to the commit",
            Unit::Seconds,
            write_seconds.clone(),
        );
        all.register("jobs", "Jobs that wait or run", Family::clone(&open));
        all.register_with_unit(
            "queue_age",
            "How long the oldest waiting job has waited",
            Unit::Seconds,
            queue_age.clone(),
        );
        all.register("workers", "Workers", Gauge::clone(&workers));
        all.register("workers_stuck", "Attempts that were told to stop and do not", Gauge::clone(&stuck));
        all.register("event_streams", "Open streams of events", Gauge::clone(&streams));
        all.register_with_unit("database", "The database's file", Unit::Bytes, Gauge::clone(&database));
        all.register_with_unit("database_log", "The database's write-ahead log", Unit::Bytes, Gauge::clone(&log));
        all.register("store_readable", "1 when the database answered to this very request", Gauge::clone(&readable));
        let version = [("version".into(), env!("CARGO_PKG_VERSION").into())];
        all.sub_registry_with_labels(version.into_iter()).register(
            "build",
            "1; the version is the label",
            ConstGauge::new(1_i64),
        );
        Self(Arc::new(Inner {
            answers: RwLock::default(),
            requests,
            request_seconds,
            ended,
            run_seconds,
            wait_seconds,
            write_seconds,
            open,
            queue_age,
            workers,
            stuck,
            streams,
            database,
            log,
            readable,
            registry: Mutex::new(registry),
        }))
    }

    /// A request was answered. `route` is the pattern that it met, none when it met none.
    pub fn answered(&self, method: &str, route: Option<&str>, status: u16, took: Duration) {
        let method = METHODS.into_iter().find(|known| *known == method).unwrap_or(OTHER);
        let route = route.unwrap_or(OTHER);
        let of = |answers: &&Answers| answers.method == method && answers.status == status;
        let known = self.0.answers.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(answers) = known.get(route).and_then(|known| known.iter().find(of)) {
            return answers.one(took);
        }
        drop(known);
        let route = route.to_owned();
        let answers = Answers {
            method,
            status,
            count: self.0.requests.get_or_create_owned(&Request { method, route: route.clone(), status }),
            seconds: self.0.request_seconds.get_or_create_owned(&Route { method, route: route.clone() }),
        };
        answers.one(took);
        let mut known = self.0.answers.write().unwrap_or_else(PoisonError::into_inner);
        let known = known.entry(route).or_default();
        // Two may have met a new status at once; both counted in the same place.
        if !known.iter().any(|known| of(&known)) {
            known.push(answers);
        }
    }

    /// A job ended in `state`, after it had waited and run so long.
    pub fn job_ended(&self, state: &'static str, kind: &'static str, waited_us: i64, ran_us: Option<i64>) {
        self.0.ended.get_or_create(&KindState { kind, state }).inc();
        self.0.wait_seconds.get_or_create(&Kind { kind }).observe(seconds(waited_us));
        if let Some(ran_us) = ran_us {
            self.0.run_seconds.get_or_create(&Kind { kind }).observe(seconds(ran_us));
        }
    }

    /// A write to the database was made, or given up.
    pub fn written(&self, took: Duration) {
        self.0.write_seconds.observe(took.as_secs_f64());
    }

    /// All of it as `OpenMetrics` text.
    ///
    /// # Errors
    /// None that a string can give.
    pub fn text(&self, standing: &Standing) -> Result<String, std::fmt::Error> {
        let registry = self.0.registry.lock().unwrap_or_else(PoisonError::into_inner);
        self.set(standing);
        let mut out = String::new();
        text::encode(&mut out, &registry)?;
        Ok(out)
    }

    fn set(&self, standing: &Standing) {
        let whole = |number: u64| i64::try_from(number).unwrap_or(i64::MAX);
        self.0.workers.set(whole(standing.workers));
        self.0.stuck.set(whole(standing.stuck));
        self.0.streams.set(whole(standing.streams));
        self.0.readable.set(i64::from(standing.stored.is_some()));
        let Some(stored) = &standing.stored else { return };
        for kind in KINDS.into_iter().chain([OTHER]) {
            for state in ["queued", "running"] {
                let jobs = stored.open.iter().filter(|(of, at, _)| kind_label(of) == kind && *at == state);
                let jobs = jobs.map(|(.., jobs)| jobs).sum();
                self.0.open.get_or_create(&KindState { kind, state }).set(whole(jobs));
            }
        }
        self.0.queue_age.set(stored.queue_age.as_secs_f64());
        self.0.database.set(whole(stored.database_bytes));
        self.0.log.set(whole(stored.log_bytes));
    }
}

fn seconds(us: i64) -> f64 {
    us.max(0) as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_happened_and_what_stands_is_written_under_its_name() {
        let metrics = Metrics::new();
        metrics.answered("GET", Some("/v1/jobs/{job}"), 200, Duration::from_millis(3));
        metrics.answered("GET", Some("/v1/jobs/{job}"), 200, Duration::from_millis(30));
        metrics.job_ended("succeeded", kind_label("flatten"), 1_000, Some(2_000_000));
        metrics.job_ended("cancelled", kind_label("flatten"), 1_000, None);
        metrics.written(Duration::from_millis(2));
        let stored = Stored {
            open: vec![("flatten".to_owned(), "queued", 3), ("fold".to_owned(), "running", 1)],
            queue_age: Duration::from_millis(1500),
            database_bytes: 4096,
            log_bytes: 10,
        };
        let text = metrics.text(&Standing { stored: Some(stored), workers: 2, stuck: 0, streams: 1 }).unwrap();
        for line in [
            "planish_http_requests_total{method=\"GET\",route=\"/v1/jobs/{job}\",status=\"200\"} 2",
            "planish_http_request_duration_seconds_bucket{le=\"0.005\",method=\"GET\",route=\"/v1/jobs/{job}\"} 1",
            "planish_jobs_ended_total{kind=\"flatten\",state=\"cancelled\"} 1",
            "planish_job_duration_seconds_count{kind=\"flatten\"} 1",
            "planish_job_wait_seconds_count{kind=\"flatten\"} 2",
            "planish_store_write_duration_seconds_count 1",
            "planish_jobs{kind=\"flatten\",state=\"queued\"} 3",
            "planish_jobs{kind=\"other\",state=\"running\"} 1",
            "planish_jobs{kind=\"triangulate\",state=\"queued\"} 0",
            "planish_queue_age_seconds 1.5",
            "planish_database_bytes 4096",
            "planish_event_streams 1",
            "planish_store_readable 1",
        ] {
            assert!(text.lines().any(|l| l == line), "{line} is not in\n{text}");
        }
        assert!(text.contains("process_start_time_seconds "), "{text}");
        assert!(text.ends_with("# EOF\n"), "{text}");
    }

    #[test]
    fn nothing_that_a_client_makes_up_becomes_a_label() {
        let metrics = Metrics::new();
        let before = metrics.text(&Standing::default()).unwrap().lines().count();
        for i in 0..1000 {
            metrics.answered(&format!("M{i}"), None, 404, Duration::ZERO);
        }
        let after = metrics.text(&Standing::default()).unwrap().lines().count();
        assert!(after - before < 40, "{before} lines, then {after}");
    }
}
