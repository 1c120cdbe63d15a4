//! Tasks that build on their neighbours, taken by workers lowest rank first.
//!
//! ```text
//!   calling thread and worker 1 … worker n - 1, each:
//!     ┌─> take a task ──> run it, catch its panic ──> tell that it is done ─┐
//!     └── park while none may start <──────────────────────────────────────┘
//!   under one lock: tasks that may start, results, observer
//! ```
//!
//! A worker takes its next task itself. A thread that handed tasks out would have to be woken for each of them, and
//! with every core busy that takes up to a tick of the system's scheduler.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::panic::resume_unwind;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use crate::attempt::{Attempt, Outcome, attempt};
use crate::{RankedTasks, ScheduleError, Workers};
use crossbeam::sync::{Parker, Unparker};

/// What happens, told by one worker at a time, in the order in which it happens.
#[derive(Debug)]
pub enum Event<'a, R> {
    /// A worker took a task.
    Started(usize),
    /// A task is done; told before any task that waits for it starts.
    Done(usize, &'a R),
}

/// Runs every task once all its neighbours of lower rank are done, never two neighbours at once; of the tasks that may
/// start, the one of lowest rank first. Results are in task order.
///
/// `on_done` runs before any task that waits for the finished one starts. The calling thread is one of the workers.
///
/// # Errors
/// The first failure or panic in rank order among the tasks that ran, after which no task starts; `Stopped` when
/// `stop` was raised before every task had started. Running tasks always finish first.
pub fn in_rank_order<R: Send, E: Send>(
    plan: &RankedTasks,
    workers: &Workers,
    stop: &AtomicBool,
    task: impl Fn(usize) -> Result<R, E> + Sync,
    mut on_done: impl FnMut(usize, &R) + Send,
) -> Result<Vec<R>, ScheduleError<R, E>> {
    let observe = |event: Event<R>| {
        if let Event::Done(task, result) = event {
            on_done(task, result);
        }
    };
    in_rank_order_observed(plan, workers, stop, task, observe)
}

/// [`in_rank_order`] that also tells when a task starts: a live board of tiles, or a trace.
///
/// # Errors
/// As [`in_rank_order`].
pub fn in_rank_order_observed<R: Send, E: Send>(
    plan: &RankedTasks,
    workers: &Workers,
    stop: &AtomicBool,
    task: impl Fn(usize) -> Result<R, E> + Sync,
    observe: impl FnMut(Event<R>) + Send,
) -> Result<Vec<R>, ScheduleError<R, E>> {
    let outcome = Outcome::new(plan.len());
    let walk = Walk { plan, ready: Ready::new(plan), outcome, in_progress: 0, is_called_off: false, stop, observe };
    let threads = workers.count().min(plan.len()).max(1);
    let walk = walk_with_threads(walk, threads, &task)
        .map_err(|message| ScheduleError::NoThread { workers: workers.count(), message })?;
    walk.outcome.into_results()
}

/// The state of one run.
struct Walk<'a, R, E, O> {
    plan: &'a RankedTasks,
    ready: Ready<'a>,
    outcome: Outcome<R, E>,
    in_progress: usize,
    /// Whether a thread was not to be had.
    is_called_off: bool,
    stop: &'a AtomicBool,
    observe: O,
}

impl<R, E, O: FnMut(Event<R>)> Walk<'_, R, E, O> {
    /// What a worker is to do now; nothing more to start after a failure or a request to stop.
    fn next(&mut self) -> Next {
        let is_halted = self.is_called_off || self.outcome.is_failed() || self.stop.load(Ordering::Relaxed);
        match (!is_halted).then(|| self.ready.start()).flatten() {
            Some(task) => {
                self.in_progress += 1;
                (self.observe)(Event::Started(task));
                Next::Run(task)
            }
            None if self.in_progress == 0 || is_halted => Next::GoHome,
            None => Next::Wait,
        }
    }

    fn finish(&mut self, task: usize, attempt: Attempt<R, E>) {
        self.in_progress -= 1;
        if let Some(result) = self.outcome.accept(task, self.plan.place(task), attempt) {
            (self.observe)(Event::Done(task, result));
            self.ready.finish(task);
        }
    }
}

/// What a worker is to do.
enum Next {
    Run(usize),
    /// Until another worker has finished a task.
    Wait,
    GoHome,
}

/// Walks on the calling thread and as many others as make up `threads`, until nothing may start any more and all have
/// come home.
fn walk_with_threads<'a, R: Send, E: Send, O: FnMut(Event<R>) + Send>(
    walk: Walk<'a, R, E, O>,
    threads: usize,
    task: &(impl Fn(usize) -> Result<R, E> + Sync),
) -> Result<Walk<'a, R, E, O>, String> {
    let walk = Mutex::new(walk);
    let parkers: Vec<Parker> = (0..threads).map(|_| Parker::new()).collect();
    let unparkers: Vec<Unparker> = parkers.iter().map(|parker| parker.unparker().clone()).collect();
    thread::scope(|scope| {
        let (mut parkers, walk) = (parkers.into_iter(), &walk);
        let own = parkers.next().expect("there is a thread at least");
        // No task starts before all workers are there.
        let mut held = walk.lock().expect("no observer was called yet");
        let mut others = Vec::new();
        for (number, parker) in (1..).zip(parkers) {
            let others_wake = WakeOthers(&unparkers);
            let named = thread::Builder::new().name(format!("worker {number}"));
            let spawned = named.spawn_scoped(scope, move || work(walk, &parker, &others_wake, task));
            let spawned = spawned.map_err(|error| error.to_string());
            held.is_called_off = spawned.is_err();
            others.push(spawned?);
        }
        drop(held);
        work(walk, &own, &WakeOthers(&unparkers), task);
        // A panic of the observer goes on to the caller.
        others.into_iter().for_each(|other| other.join().unwrap_or_else(|panic| resume_unwind(panic)));
        Ok::<(), String>(())
    })?;
    Ok(walk.into_inner().expect("an observer that panicked has ended this run"))
}

/// Wakes all workers that wait, also when its owner panics.
struct WakeOthers<'a>(&'a [Unparker]);

impl WakeOthers<'_> {
    fn wake(&self) {
        self.0.iter().for_each(Unparker::unpark);
    }
}

impl Drop for WakeOthers<'_> {
    fn drop(&mut self) {
        self.wake();
    }
}

/// What a worker does until nothing may start any more, or an observer panicked beside it.
fn work<R, E, O: FnMut(Event<R>)>(
    walk: &Mutex<Walk<'_, R, E, O>>,
    parker: &Parker,
    others: &WakeOthers,
    task: &impl Fn(usize) -> Result<R, E>,
) {
    let Ok(mut held) = walk.lock() else { return };
    loop {
        let now = held.next();
        drop(held);
        let ended = match now {
            Next::GoHome => return,
            Next::Wait => {
                parker.park();
                None
            }
            Next::Run(number) => Some((number, attempt(|| task(number)))),
        };
        let Ok(again) = walk.lock() else { return };
        held = again;
        if let Some((number, ended)) = ended {
            held.finish(number, ended);
            others.wake();
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Waiting,
    InProgress,
    Done,
}

/// Which tasks may start, given what is done. Asserts the rule that no two neighbours are in progress together.
pub(crate) struct Ready<'a> {
    plan: &'a RankedTasks,
    states: Vec<State>,
    /// Lower-ranked neighbours not yet done, per task.
    missing: Vec<usize>,
    /// (urgency, task) of every task that may start.
    queue: BinaryHeap<Reverse<(u64, usize)>>,
}

impl<'a> Ready<'a> {
    pub(crate) fn new(plan: &'a RankedTasks) -> Self {
        let missing: Vec<usize> = (0..plan.len()).map(|task| plan.lower(task).len()).collect();
        let free = (0..plan.len()).filter(|&task| missing[task] == 0);
        let queue = free.map(|task| Reverse((plan.urgency(task), task))).collect();
        Self { plan, states: vec![State::Waiting; plan.len()], missing, queue }
    }

    /// Takes the most urgent task that may start.
    pub(crate) fn start(&mut self) -> Option<usize> {
        let Reverse((_, task)) = self.queue.pop()?;
        let done = |&other: &usize| self.states[other] == State::Done;
        assert!(self.plan.lower(task).iter().all(done), "task {task} starts after its lower-ranked neighbours");
        let busy = |&other: &usize| self.states[other] == State::InProgress;
        assert!(!self.plan.higher(task).iter().any(busy), "task {task} never starts beside a running neighbour");
        self.states[task] = State::InProgress;
        Some(task)
    }

    /// Notes that `task` is done, which may let others start.
    pub(crate) fn finish(&mut self, task: usize) {
        assert!(self.states[task] == State::InProgress, "task {task} finishes once, after it started");
        self.states[task] = State::Done;
        for &other in self.plan.higher(task) {
            self.missing[other] -= 1;
            if self.missing[other] == 0 {
                self.queue.push(Reverse((self.plan.urgency(other), other)));
            }
        }
    }
}
