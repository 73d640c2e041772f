//! R6: a job moves only along the published edges, whatever is done to it in whatever order.

use std::time::Duration;

use planish::clock::{Clock, FakeClock};
use planish::queue::{JobId, NewResult};
use planish::store::{Cancelled, Claim, Committed, Ending, Lane, Reclaim, Removal, State, Store, SurfaceId};
use proptest::prelude::*;
use proptest::sample::Index;
use serde_json::json;
use sqlx::AssertSqlSafe;
use tempfile::TempDir;

use crate::support::queue::{new_job, surface};
use crate::support::{assert_whole, raw};

const LEASE: Duration = Duration::from_secs(30);
const MOST_ATTEMPTS: u32 = 3;

/// What may be done to the store.
#[derive(Debug, Clone)]
enum Command {
    Enqueue { light: bool },
    Claim { light_only: bool },
    Finish { claim: Index, how: State },
    GiveBack { claim: Index, counts: bool },
    Renew { claim: Index },
    Cancel { job: Index },
    Remove { job: Index },
    LetLeasesRunOut,
    Reclaim,
    Die,
}

fn command() -> impl Strategy<Value = Command> {
    let ends = prop_oneof![Just(State::Succeeded), Just(State::Failed), Just(State::Cancelled)];
    prop_oneof![
        3 => any::<bool>().prop_map(|light| Command::Enqueue { light }),
        5 => any::<bool>().prop_map(|light_only| Command::Claim { light_only }),
        4 => (any::<Index>(), ends).prop_map(|(claim, how)| Command::Finish { claim, how }),
        1 => (any::<Index>(), any::<bool>()).prop_map(|(claim, counts)| Command::GiveBack { claim, counts }),
        1 => any::<Index>().prop_map(|claim| Command::Renew { claim }),
        2 => any::<Index>().prop_map(|job| Command::Cancel { job }),
        1 => any::<Index>().prop_map(|job| Command::Remove { job }),
        1 => Just(Command::LetLeasesRunOut),
        2 => Just(Command::Reclaim),
        1 => Just(Command::Die),
    ]
}

/// A job as the model has it.
#[derive(Debug, Clone)]
struct Model {
    id: JobId,
    light: bool,
    state: State,
    attempt: u32,
    crashes: u32,
    cancel: bool,
    /// Which of all claims holds it, and whether its lease has run out.
    holder: Option<(usize, bool)>,
    gone: bool,
}

impl Model {
    fn end(&mut self, how: State) {
        self.state = if self.cancel { State::Cancelled } else { how };
        self.holder = None;
    }

    /// Its worker is dead or past its lease.
    fn lose(&mut self) {
        if self.cancel || self.attempt >= MOST_ATTEMPTS {
            self.end(State::Failed);
        } else {
            self.state = State::Queued;
            self.crashes += 1;
            self.holder = None;
        }
    }
}

struct World {
    directory: TempDir,
    store: Store,
    hand: FakeClock,
    surface: SurfaceId,
    jobs: Vec<Model>,
    claims: Vec<(usize, Claim)>,
    ended: usize,
}

impl World {
    async fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let (clock, hand) = Clock::fake(1_700_000_000_000_000);
        let store = Store::open(directory.path(), clock).await.unwrap();
        let surface = surface(&store).await;
        Self { directory, store, hand, surface, jobs: Vec::new(), claims: Vec::new(), ended: 0 }
    }

    async fn obey(&mut self, command: &Command) {
        match command {
            Command::Enqueue { light } => {
                let lane = if *light { Lane::Light } else { Lane::Heavy };
                let job =
                    self.store.enqueue(new_job(&self.surface, json!({})), lane, 1000).await.unwrap().job().clone();
                self.jobs.push(Model {
                    id: job.id,
                    light: *light,
                    state: State::Queued,
                    attempt: 0,
                    crashes: 0,
                    cancel: false,
                    holder: None,
                    gone: false,
                });
            }
            Command::Claim { light_only } => {
                let got = self.store.claim(*light_only, LEASE).await.unwrap();
                let suspect_runs = self.jobs.iter().any(|job| job.state == State::Running && job.crashes > 0);
                let expected = self.jobs.iter().position(|job| {
                    job.state == State::Queued && (job.light || !light_only) && (job.crashes == 0 || !suspect_runs)
                });
                assert_eq!(got.as_ref().map(|claim| claim.job.id), expected.map(|job| self.jobs[job].id));
                if let (Some(claim), Some(job)) = (got, expected) {
                    let number = self.claims.len();
                    let model = &mut self.jobs[job];
                    (model.state, model.holder) = (State::Running, Some((number, false)));
                    model.attempt += 1;
                    self.claims.push((job, claim));
                }
            }
            Command::Finish { claim, how } => {
                let Some((held, job, claim)) = self.pick(*claim) else { return };
                let results = vec![NewResult::new("mesh", "text/plain", "a mesh")];
                let ending = match how {
                    State::Succeeded => Ending::Succeeded { results, verdict: None, resolved: None },
                    State::Failed => Ending::Failed { problem: json!({}), results, resolved: None },
                    _ => Ending::Cancelled,
                };
                let committed = self.store.finish(&claim, ending, None).await.unwrap();
                assert_eq!(matches!(committed, Committed::Ended(_)), held);
                if held {
                    self.jobs[job].end(*how);
                }
            }
            Command::GiveBack { claim, counts } => {
                let Some((held, job, claim)) = self.pick(*claim) else { return };
                let model = &mut self.jobs[job];
                let expected = held && !model.cancel;
                assert_eq!(self.store.give_back(claim, *counts).await.unwrap(), expected);
                if expected {
                    (model.state, model.holder) = (State::Queued, None);
                    model.attempt -= u32::from(!counts);
                }
            }
            Command::Renew { claim } => {
                let Some((held, job, claim)) = self.pick(*claim) else { return };
                assert_eq!(self.store.renew(vec![(claim, None)], LEASE).await.unwrap(), [held]);
                if let (true, Some((_, expired))) = (held, &mut self.jobs[job].holder) {
                    *expired = false;
                }
            }
            Command::Cancel { job } => {
                let Some(job) = self.job(*job) else { return };
                let cancelled = self.store.cancel(self.jobs[job].id).await.unwrap();
                let model = &mut self.jobs[job];
                match (model.gone, model.state, cancelled) {
                    (true, _, None)
                    | (_, State::Cancelled, Some(Cancelled::Ended(_)))
                    | (_, State::Succeeded | State::Failed, Some(Cancelled::TooLate(_))) => {}
                    (_, State::Queued, Some(Cancelled::Ended(_))) => model.end(State::Cancelled),
                    (_, State::Running, Some(Cancelled::Requested(_))) => model.cancel = true,
                    (gone, state, cancelled) => panic!("cancelling {state} (gone: {gone}) gave {cancelled:?}"),
                }
            }
            Command::Remove { job } => {
                let Some(job) = self.job(*job) else { return };
                let removal = self.store.remove_job(self.jobs[job].id).await.unwrap();
                let model = &mut self.jobs[job];
                let expected = match (model.gone, model.state.has_ended()) {
                    (true, _) => Removal::Absent,
                    (_, true) => Removal::Removed,
                    (_, false) => Removal::InUse,
                };
                assert_eq!(removal, expected);
                model.gone |= expected == Removal::Removed;
            }
            Command::LetLeasesRunOut => {
                self.hand.advance(LEASE);
                for (_, expired) in self.jobs.iter_mut().filter_map(|job| job.holder.as_mut()) {
                    *expired = true;
                }
            }
            Command::Reclaim => {
                self.store.reclaim(Reclaim::Expired, MOST_ATTEMPTS, json!({})).await.unwrap();
                self.jobs.iter_mut().filter(|job| matches!(job.holder, Some((_, true)))).for_each(Model::lose);
            }
            Command::Die => {
                // To the database a process that closed without ending its jobs is one that died.
                self.store.close().await.unwrap();
                let clock = self.store.clock().clone();
                self.store = Store::open(self.directory.path(), clock).await.unwrap();
                self.store.reclaim(Reclaim::OtherBoots, MOST_ATTEMPTS, json!({})).await.unwrap();
                self.jobs.iter_mut().filter(|job| job.holder.is_some()).for_each(Model::lose);
            }
        }
    }

    /// A claim that was ever given, whether it still holds, and its job.
    fn pick(&self, which: Index) -> Option<(bool, usize, Claim)> {
        let number = (!self.claims.is_empty()).then(|| which.index(self.claims.len()))?;
        let (job, claim) = &self.claims[number];
        Some((self.jobs[*job].holder.is_some_and(|(holder, _)| holder == number), *job, claim.clone()))
    }

    fn job(&self, which: Index) -> Option<usize> {
        (!self.jobs.is_empty()).then(|| which.index(self.jobs.len()))
    }

    async fn assert_as_modelled(&mut self) {
        for model in &self.jobs {
            let job = self.store.job(model.id).await.unwrap();
            assert_eq!(job.is_none(), model.gone);
            if let Some(job) = job {
                assert_eq!((job.state, job.attempt, job.cancel_requested), (model.state, model.attempt, model.cancel));
                assert_eq!(job.end_seq.is_some(), model.state.has_ended());
            }
        }
        let ended = self.jobs.iter().filter(|job| job.state.has_ended()).count();
        assert!(ended >= self.ended, "a job that had ended has not any more");
        self.ended = ended;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn r6_any_sequence_of_commands_leaves_each_job_where_the_model_says(
        commands in prop::collection::vec(command(), 1..48),
    ) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let mut world = World::new().await;
            for command in &commands {
                world.obey(command).await;
                world.assert_as_modelled().await;
            }
            // A job that was failed after its last attempt has no results, so only those that ended by a worker count.
            world.store.close().await.unwrap();
            assert_whole(&mut raw(world.directory.path()).await).await;
        });
    }
}

#[tokio::test]
async fn r6_the_database_itself_refuses_every_edge_that_is_not_published() {
    let directory = tempfile::tempdir().unwrap();
    let (clock, _hand) = Clock::fake(1_700_000_000_000_000);
    let store = Store::open(directory.path(), clock).await.unwrap();
    let surface = surface(&store).await;
    let mut raw = raw(directory.path()).await;
    for from in State::ALL {
        for to in State::ALL {
            let id = store.enqueue(new_job(&surface, json!({})), Lane::Light, 1000).await.unwrap().job().id;
            if from == State::Cancelled {
                store.cancel(id).await.unwrap();
            } else if from != State::Queued {
                let claim = store.claim(true, LEASE).await.unwrap().unwrap();
                assert_eq!(claim.job.id, id);
                let ending = match from {
                    State::Succeeded => Some(Ending::Succeeded { results: vec![], verdict: None, resolved: None }),
                    State::Failed => Some(Ending::Failed { problem: json!({}), results: vec![], resolved: None }),
                    _ => None,
                };
                if let Some(ending) = ending {
                    store.finish(&claim, ending, None).await.unwrap();
                }
            }
            // All that the state demands is set with it, so the edge alone decides.
            let set = match to {
                State::Queued => {
                    "boot = NULL, lease_token = NULL, lease_until_us = NULL, needs_surface = surface, finished_us = NULL, \
                     end_seq = NULL, problem = NULL"
                }
                State::Running => {
                    "boot = x'00', lease_token = zeroblob(16), lease_until_us = 1, attempt = attempt + 1, started_us = 1, \
                     needs_surface = surface, finished_us = NULL, end_seq = NULL, problem = NULL"
                }
                State::Succeeded | State::Failed | State::Cancelled => {
                    "boot = NULL, lease_token = NULL, lease_until_us = NULL, needs_surface = NULL, finished_us = 1, \
                     attempt = max(attempt, 1), started_us = 1, end_seq = 1000 + seq"
                }
            };
            let problem = if to == State::Failed { ", problem = '{}'" } else { "" };
            let seq = store.job(id).await.unwrap().unwrap().seq;
            let sql =
                format!("UPDATE jobs SET state = '{to}', revision = revision + 1, {set}{problem} WHERE seq = {seq}");
            let outcome = sqlx::query(AssertSqlSafe(sql)).execute(&mut raw).await;
            assert_eq!(outcome.is_ok(), from.may_become(to), "{from} to {to}: {outcome:?}");
            // Out of the way of the next claim.
            store.cancel(id).await.unwrap();
        }
    }
    let born = "INSERT INTO jobs (id, kind, surface, parameters, labels, cost, lane, state, created_us, finished_us, end_seq) \
         VALUES (zeroblob(16), 'k', 's', '{}', '{}', 0, 0, 'cancelled', 0, 0, 99999)";
    assert!(sqlx::query(born).execute(&mut raw).await.is_err(), "a job starts queued");
}
