//! The one task that writes. Writes that wait at the same time are made in one transaction: a *group commit*.
//!
//! A commit with `synchronous = FULL` waits for the disk, and that wait is nearly all that a small write costs; a group
//! shares one. Nobody is answered before the commit, so a promise that rests on a write rests on the disk as before.
//! - Within a group each write stands under a savepoint: one that fails, or has nothing to keep, is undone by itself.
//! - Some faults (a full disk) end a whole transaction. The writes of such a group, and of one that could not be
//!   committed, are made once more, each in a transaction of its own, and each gets its own answer. Writes are therefore
//!   functions of what they were given, which can be run twice.
//! - A caller that goes away does not stop its write.
//!
//! *Wishes* are claims that wait for work: when a group has made some (a job was accepted or given back), the wishes that
//! stand are tried within the same transaction, so an idle worker has a job with the very commit that accepts it.
//! A wish that is withdrawn is always answered: with the job, when it had been granted before.
//!
//! Limits: writes wait in memory, as many as there are callers; one that has waited longer than a caller should fails
//! with [`StoreError::Busy`].

use std::collections::VecDeque;
use std::future::Future;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use sqlx::{Connection as _, SqliteConnection};
use tokio::sync::{Notify, broadcast, oneshot};
use uuid::Uuid;

use super::leases::{self, Claim};
use super::{Change, StoreError};
use crate::clock::Clock;
use crate::telemetry::Metrics;

/// Most writes in a group: enough to share a commit among every client of a busy server, few enough that the first does
/// not wait long for the last.
const MOST_TOGETHER: usize = 128;
/// How long a write waits for its turn before it fails with [`StoreError::Busy`]. Above the longest checkpoint stall seen
/// (0.6 s) by far, below what a client would wait.
const PATIENCE: Duration = Duration::from_secs(10);

/// What a write is being run with.
#[derive(Debug)]
pub(super) struct Context {
    /// Names this process in leases.
    pub(super) boot: Uuid,
    pub(super) clock: Clock,
    pub(super) changes: broadcast::Sender<Change>,
    pub(super) metrics: Metrics,
    /// Transactions that were committed.
    pub(super) commits: AtomicU64,
}

impl Context {
    fn tell(&self, changes: impl IntoIterator<Item = Change>) {
        for change in changes {
            if let Some(lasted) = change.ended {
                self.metrics.job_ended(change.state.name(), lasted.kind, lasted.waited_us, lasted.ran_us);
            }
            // No one listening is no fault.
            let _ = self.changes.send(change);
        }
    }
}

/// What a write did.
#[derive(Debug)]
pub(super) struct Written<T> {
    answer: T,
    keep: bool,
    changes: Vec<Change>,
    work: usize,
}

impl<T> Written<T> {
    /// It is to be kept.
    pub(super) fn keep(answer: T) -> Self {
        Self { answer, keep: true, changes: Vec::new(), work: 0 }
    }

    /// Nothing is to be kept of it.
    pub(super) fn undo(answer: T) -> Self {
        Self { answer, keep: false, changes: Vec::new(), work: 0 }
    }

    /// Jobs that it changed: told when it is committed.
    pub(super) fn changing(mut self, changes: impl IntoIterator<Item = Change>) -> Self {
        self.changes.extend(changes);
        self
    }

    /// It made so many jobs that can be claimed.
    pub(super) fn making_work(mut self, jobs: usize) -> Self {
        self.work = jobs;
        self
    }
}

/// A write under way.
pub(super) type Writing<'a, T, E> = Pin<Box<dyn Future<Output = Result<Written<T>, E>> + Send + 'a>>;
/// A write: a function of its data, which may be run a second time.
pub(super) type Write<D, T, E> = for<'a> fn(&'a Context, &'a D, &'a mut SqliteConnection) -> Writing<'a, T, E>;

/// A handle to the task; it ends when the last one is dropped.
#[derive(Debug)]
pub(super) struct Writer {
    line: Arc<Line>,
}

/// What waits for the task.
#[derive(Debug, Default)]
struct Line {
    waiting: Mutex<Waiting>,
    arrived: Notify,
}

#[derive(Default)]
struct Waiting {
    writes: VecDeque<(Instant, Box<dyn Member>)>,
    wishes: Vec<Standing>,
    withdrawn: Vec<u64>,
    wish_numbers: u64,
    close: Option<oneshot::Sender<Result<(), StoreError>>>,
    closed: bool,
}

impl std::fmt::Debug for Waiting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Waiting")
            .field("writes", &self.writes.len())
            .field("wishes", &self.wishes.len())
            .finish_non_exhaustive()
    }
}

impl Line {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put(&self, change: impl FnOnce(&mut Waiting)) {
        let mut waiting = self.waiting();
        if !waiting.closed {
            change(&mut waiting);
        }
        drop(waiting);
        self.arrived.notify_one();
    }
}

impl Writer {
    /// Starts the task on its connection.
    pub(super) fn start(connection: SqliteConnection, context: Arc<Context>) -> Self {
        let line = Arc::new(Line::default());
        let task = Task { connection, context, line: line.clone(), standing: Vec::new() };
        tokio::spawn(task.work());
        Self { line }
    }

    /// Makes a write; when this returns with a kept one, it is on the disk.
    pub(super) async fn write<D, T, E>(&self, data: D, write: Write<D, T, E>) -> Result<T, E>
    where
        D: Send + Sync + 'static,
        T: Send + 'static,
        E: From<StoreError> + Send + 'static,
    {
        let (reply, answer) = oneshot::channel();
        let order = Order { data, write, reply, outcome: None };
        self.line.put(|waiting| waiting.writes.push_back((Instant::now(), Box::new(order))));
        answer.await.unwrap_or_else(|_| Err(StoreError::Interrupted.into()))
    }

    /// Wishes for a job.
    pub(super) fn wish(&self, light_only: bool, lease: Duration) -> Wish {
        let (reply, granted) = oneshot::channel();
        let mut number = 0;
        self.line.put(|waiting| {
            waiting.wish_numbers += 1;
            number = waiting.wish_numbers;
            waiting.wishes.push(Standing { number, light_only, lease, reply });
        });
        Wish { number, granted, line: self.line.clone() }
    }

    /// Writes the log back into the database and closes the connection, after all that waits.
    pub(super) async fn close(&self) -> Result<(), StoreError> {
        let (reply, closed) = oneshot::channel();
        self.line.put(|waiting| waiting.close = Some(reply));
        // No answer: it was closed before.
        closed.await.unwrap_or(Ok(()))
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.line.waiting().closed = true;
        self.line.arrived.notify_one();
    }
}

/// A claim that waits for work.
#[derive(Debug)]
pub struct Wish {
    number: u64,
    granted: oneshot::Receiver<Result<Option<Claim>, StoreError>>,
    line: Arc<Line>,
}

impl Wish {
    /// Waits for it: a job, or what went wrong.
    ///
    /// # Errors
    /// What the database says.
    pub async fn granted(&mut self) -> Result<Option<Claim>, StoreError> {
        (&mut self.granted).await.unwrap_or(Err(StoreError::Interrupted))
    }

    /// Takes it back: `None`, or the job that it was granted before.
    ///
    /// # Errors
    /// What the database says.
    pub async fn withdrawn(mut self) -> Result<Option<Claim>, StoreError> {
        self.line.put(|waiting| waiting.withdrawn.push(self.number));
        self.granted().await
    }
}

/// A wish as the task keeps it.
#[derive(Debug)]
struct Standing {
    number: u64,
    light_only: bool,
    lease: Duration,
    reply: oneshot::Sender<Result<Option<Claim>, StoreError>>,
}

/// What a write left in the transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Left {
    /// Something to keep, and so many jobs to be claimed.
    Kept { work: usize },
    /// Nothing, or it failed: it is to be undone.
    Nothing,
}

/// A write of any type.
trait Member: Send {
    /// Makes it, within a transaction.
    fn run<'a>(
        &'a mut self,
        context: &'a Context,
        connection: &'a mut SqliteConnection,
    ) -> Pin<Box<dyn Future<Output = Left> + Send + 'a>>;
    /// Answers with what it did, or with what became of its transaction.
    fn answer(self: Box<Self>, context: &Context, fate: Result<(), StoreError>);
}

struct Order<D, T, E> {
    data: D,
    write: Write<D, T, E>,
    reply: oneshot::Sender<Result<T, E>>,
    outcome: Option<Result<Written<T>, E>>,
}

impl<D, T, E> Member for Order<D, T, E>
where
    D: Send + Sync,
    T: Send,
    E: From<StoreError> + Send,
{
    fn run<'a>(
        &'a mut self,
        context: &'a Context,
        connection: &'a mut SqliteConnection,
    ) -> Pin<Box<dyn Future<Output = Left> + Send + 'a>> {
        Box::pin(async move {
            let outcome = (self.write)(context, &self.data, connection).await;
            let left = match &outcome {
                Ok(written) if written.keep => Left::Kept { work: written.work },
                _ => Left::Nothing,
            };
            self.outcome = Some(outcome);
            left
        })
    }

    fn answer(self: Box<Self>, context: &Context, fate: Result<(), StoreError>) {
        let answer = match (fate, self.outcome) {
            (Ok(()), Some(Ok(written))) => {
                context.tell(written.changes);
                Ok(written.answer)
            }
            // Its own fault says more than what became of the transaction for it.
            (_, Some(Err(error))) => Err(error),
            (Err(error), _) => Err(error.into()),
            (Ok(()), None) => Err(StoreError::Interrupted.into()),
        };
        // A caller that went away wants no answer.
        let _ = self.reply.send(answer);
    }
}

type Members = Vec<Box<dyn Member>>;

/// Which wishes are tried in a transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wishes {
    /// None.
    None,
    /// As many as there is new work.
    New,
    /// Every one: some are new themselves.
    All,
}

struct Task {
    connection: SqliteConnection,
    context: Arc<Context>,
    line: Arc<Line>,
    /// Wishes that were tried and not granted.
    standing: Vec<Standing>,
}

impl Task {
    async fn work(mut self) {
        loop {
            let arrived = self.line.clone();
            let arrived = arrived.arrived.notified();
            let (members, wishes, withdrawn, close, closed) = {
                let mut waiting = self.line.waiting();
                let taken = waiting.writes.len().min(MOST_TOGETHER);
                let members: Vec<_> = waiting.writes.drain(..taken).collect();
                // Closing comes after everything that waits.
                let close = if waiting.writes.is_empty() { waiting.close.take() } else { None };
                waiting.closed |= close.is_some();
                let wishes = std::mem::take(&mut waiting.wishes);
                (members, wishes, std::mem::take(&mut waiting.withdrawn), close, waiting.closed)
            };
            let idle = members.is_empty() && wishes.is_empty() && withdrawn.is_empty();
            if !idle {
                self.turn(members, wishes, &withdrawn).await;
            }
            if let Some(reply) = close {
                self.close(reply).await;
                return;
            }
            if idle {
                if closed {
                    return;
                }
                arrived.await;
            }
        }
    }

    /// One group and the wishes.
    async fn turn(&mut self, members: Vec<(Instant, Box<dyn Member>)>, fresh: Vec<Standing>, withdrawn: &[u64]) {
        let fresh_from = self.standing.len();
        self.standing.extend(fresh);
        let mut wishes = if fresh_from < self.standing.len() { Wishes::All } else { Wishes::New };
        let (mut gone, mut kept) = (Vec::new(), Vec::new());
        for wish in self.standing.drain(..) {
            if withdrawn.contains(&wish.number) { gone.push(wish) } else { kept.push(wish) }
        }
        self.standing = kept;
        for wish in gone {
            let _ = wish.reply.send(Ok(None));
        }
        // The light lane's own workers come first: the others stay free for what only they can take.
        self.standing.sort_by_key(|wish| (!wish.light_only, wish.number));
        if self.standing.is_empty() {
            wishes = Wishes::New;
        }

        let (late, members): (Vec<_>, Vec<_>) = members.into_iter().partition(|(since, _)| since.elapsed() > PATIENCE);
        for (_, member) in late {
            member.answer(&self.context, Err(StoreError::Busy));
        }
        let mut members: Members = members.into_iter().map(|(_, member)| member).collect();
        if members.is_empty() {
            if wishes == Wishes::All {
                self.alone(None, wishes).await;
            }
            return;
        }
        if members.len() == 1 {
            self.alone(members.pop(), wishes).await;
            return;
        }
        match self.together(&mut members, wishes).await {
            Ok(claims) => {
                for member in members {
                    member.answer(&self.context, Ok(()));
                }
                self.grant(claims);
            }
            Err(StoreError::Busy) => {
                for member in members {
                    member.answer(&self.context, Err(StoreError::Busy));
                }
            }
            Err(error) => {
                tracing::warn!(%error, writes = members.len(), "a group could not be committed; each write is made alone");
                for member in members {
                    self.alone(Some(member), Wishes::None).await;
                }
            }
        }
    }

    /// Several writes in one transaction.
    async fn together(&mut self, members: &mut Members, wishes: Wishes) -> Result<Vec<(u64, Claim)>, StoreError> {
        execute(&mut self.connection, "BEGIN IMMEDIATE").await?;
        let made = self.make(members, wishes).await;
        if made.is_err() {
            undo(&mut self.connection).await;
        }
        made
    }

    async fn make(&mut self, members: &mut Members, wishes: Wishes) -> Result<Vec<(u64, Claim)>, StoreError> {
        let mut work = 0;
        for member in members {
            execute(&mut self.connection, "SAVEPOINT one").await?;
            match member.run(&self.context, &mut self.connection).await {
                Left::Kept { work: more } => work += more,
                // This fails when the fault has ended the whole transaction.
                Left::Nothing => execute(&mut self.connection, "ROLLBACK TO one").await?,
            }
            execute(&mut self.connection, "RELEASE one").await?;
        }
        let claims = self.claims(work, wishes).await?;
        self.commit().await?;
        Ok(claims)
    }

    /// One write, or none and only the wishes, in a transaction of its own.
    async fn alone(&mut self, member: Option<Box<dyn Member>>, wishes: Wishes) {
        let mut member = member;
        if let Err(error) = execute(&mut self.connection, "BEGIN IMMEDIATE").await {
            match member {
                Some(member) => member.answer(&self.context, Err(error)),
                None => self.refuse(error),
            }
            return;
        }
        let left = match &mut member {
            Some(member) => member.run(&self.context, &mut self.connection).await,
            None => Left::Kept { work: 0 },
        };
        let Left::Kept { work } = left else {
            undo(&mut self.connection).await;
            if let Some(member) = member {
                member.answer(&self.context, Ok(()));
            }
            if wishes == Wishes::All {
                Box::pin(self.alone(None, wishes)).await;
            }
            return;
        };
        let claims = match self.claims(work, wishes).await {
            Ok(claims) if claims.is_empty() && member.is_none() => {
                undo(&mut self.connection).await;
                return;
            }
            Ok(claims) => self.commit().await.map(|()| claims),
            Err(error) => Err(error),
        };
        match claims {
            Ok(claims) => {
                if let Some(member) = member {
                    member.answer(&self.context, Ok(()));
                }
                self.grant(claims);
            }
            Err(error) => {
                undo(&mut self.connection).await;
                match member {
                    // It may have been a claim that failed, which is no fault of the write's.
                    Some(member) if wishes != Wishes::None => Box::pin(self.alone(Some(member), Wishes::None)).await,
                    Some(member) => member.answer(&self.context, Err(error)),
                    None => self.refuse(error),
                }
            }
        }
    }

    /// Claims jobs for wishes within the transaction.
    async fn claims(&mut self, work: usize, wishes: Wishes) -> Result<Vec<(u64, Claim)>, StoreError> {
        let mut claims = Vec::new();
        for wish in &self.standing {
            let enough = match wishes {
                Wishes::None => true,
                Wishes::New => claims.len() >= work,
                Wishes::All => false,
            };
            if enough {
                break;
            }
            // A worker that went away without a word.
            if wish.reply.is_closed() {
                continue;
            }
            let claim = leases::claim(&self.context, &mut self.connection, wish.light_only, wish.lease).await?;
            claims.extend(claim.map(|claim| (wish.number, claim)));
        }
        Ok(claims)
    }

    async fn commit(&mut self) -> Result<(), StoreError> {
        execute(&mut self.connection, "COMMIT").await?;
        self.context.commits.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn grant(&mut self, claims: Vec<(u64, Claim)>) {
        for (number, claim) in claims {
            self.context.tell([claim.job.change()]);
            if let Some(at) = self.standing.iter().position(|wish| wish.number == number) {
                // Should the worker be gone, the lease runs out.
                let _ = self.standing.swap_remove(at).reply.send(Ok(Some(claim)));
            }
        }
        self.standing.retain(|wish| !wish.reply.is_closed());
    }

    /// Tells one of those who wish what stands in the way; the others stand, and come again by themselves.
    fn refuse(&mut self, error: StoreError) {
        if !self.standing.is_empty() {
            let _ = self.standing.remove(0).reply.send(Err(error));
        }
    }

    async fn close(mut self, reply: oneshot::Sender<Result<(), StoreError>>) {
        let written_back = async {
            execute(&mut self.connection, "PRAGMA optimize").await?;
            execute(&mut self.connection, "PRAGMA wal_checkpoint(TRUNCATE)").await
        }
        .await;
        let closed = self.connection.close().await.map_err(StoreError::from);
        let _ = reply.send(written_back.and(closed));
    }
}

async fn execute(connection: &mut SqliteConnection, sql: &'static str) -> Result<(), StoreError> {
    sqlx::query(sql).execute(connection).await?;
    Ok(())
}

/// Ends the transaction without keeping anything; there is none any more when the fault itself has ended it.
async fn undo(connection: &mut SqliteConnection) {
    if let Err(error) = execute(connection, "ROLLBACK").await {
        tracing::debug!(%error, "the transaction had been ended by its fault");
    }
}

#[cfg(test)]
mod tests;
