//! The coordinator: tasks that build on their neighbours, handed to workers lowest rank first.
//!
//! ```text
//!   calling thread: ready queue, results, observer
//!        │ task number, only when a worker is idle        ▲ (task, how it ended)
//!        ▼                                                │
//!     worker 1 … worker n: run the task, catch its panic ─┘
//! ```

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use crossbeam::channel::{self, Receiver, Sender};

use crate::attempt::{Attempt, Outcome, attempt};
use crate::ready::Ready;
use crate::{RankedTasks, ScheduleError, Workers};

/// What the coordinator tells, on the calling thread, in the order in which it happens.
#[derive(Debug)]
pub enum Event<'a, R> {
    /// A task was given to a worker.
    Started(usize),
    /// A task is done; told before any task that waits for it starts.
    Done(usize, &'a R),
}

/// Runs every task once all its neighbours of lower rank are done, never two neighbours at once; of the tasks that may
/// start, the one of lowest rank first. Results are in task order.
///
/// `on_done` runs on the calling thread, before any task that waits for the finished one starts. With one worker the
/// tasks run on the calling thread too.
///
/// # Errors
/// The first failure or panic in rank order among the tasks that ran, after which no task starts; `Stopped` when
/// `stop` was raised before every task had started. Running tasks always finish first.
pub fn in_rank_order<R: Send, E: Send>(
    plan: &RankedTasks,
    workers: &Workers,
    stop: &AtomicBool,
    task: impl Fn(usize) -> Result<R, E> + Sync,
    mut on_done: impl FnMut(usize, &R),
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
    observe: impl FnMut(Event<R>),
) -> Result<Vec<R>, ScheduleError<R, E>> {
    let mut walk = Walk { plan, ready: Ready::new(plan), outcome: Outcome::new(plan.len()), stop, observe };
    let threads = workers.count().min(plan.len());
    if threads <= 1 {
        while let Some(next) = walk.start() {
            walk.finish(next, attempt(|| task(next)));
        }
    } else if let Err(message) = walk_with_threads(&mut walk, threads, &task) {
        return Err(ScheduleError::NoThread { workers: workers.count(), message });
    }
    walk.outcome.into_results()
}

/// The state of one run, on the calling thread.
struct Walk<'a, R, E, O> {
    plan: &'a RankedTasks,
    ready: Ready<'a>,
    outcome: Outcome<R, E>,
    stop: &'a AtomicBool,
    observe: O,
}

impl<R, E, O: FnMut(Event<R>)> Walk<'_, R, E, O> {
    /// The next task to run now; none after a failure or a request to stop.
    fn start(&mut self) -> Option<usize> {
        if self.outcome.is_failed() || self.stop.load(Ordering::Relaxed) {
            return None;
        }
        let task = self.ready.start()?;
        (self.observe)(Event::Started(task));
        Some(task)
    }

    fn finish(&mut self, task: usize, attempt: Attempt<R, E>) {
        if let Some(result) = self.outcome.accept(task, self.plan.place(task), attempt) {
            (self.observe)(Event::Done(task, result));
            self.ready.finish(task);
        }
    }
}

/// A task and how it ended.
type Report<R, E> = (usize, Attempt<R, E>);

/// Spawns the workers and keeps them busy until nothing may start any more and all have reported.
///
/// The channel of tasks is closed when this function's closure ends, however it ends, and that is what sends the
/// workers home; so a panic in the observer cannot leave the scope waiting for them.
fn walk_with_threads<R: Send, E: Send, O: FnMut(Event<R>)>(
    walk: &mut Walk<'_, R, E, O>,
    threads: usize,
    task: &(impl Fn(usize) -> Result<R, E> + Sync),
) -> Result<(), String> {
    thread::scope(|scope| {
        let (give, tasks) = channel::bounded::<usize>(threads);
        let (report, reports) = channel::bounded::<Report<R, E>>(threads);
        for number in 0..threads {
            let (tasks, report) = (tasks.clone(), report.clone());
            let named = thread::Builder::new().name(format!("worker {number}"));
            named.spawn_scoped(scope, move || work(&tasks, &report, task)).map_err(|e| e.to_string())?;
        }
        coordinate(walk, threads, &give, &reports);
        Ok(())
    })
}

/// What a worker does until the channel of tasks closes.
fn work<R, E>(tasks: &Receiver<usize>, report: &Sender<Report<R, E>>, task: &impl Fn(usize) -> Result<R, E>) {
    for number in tasks {
        if report.send((number, attempt(|| task(number)))).is_err() {
            return;
        }
    }
}

/// Hands out a task whenever a worker is idle and one may start. A task is handed out only then, so that the choice is
/// always the lowest rank known at that moment.
fn coordinate<R, E, O: FnMut(Event<R>)>(
    walk: &mut Walk<'_, R, E, O>,
    threads: usize,
    give: &Sender<usize>,
    reports: &Receiver<Report<R, E>>,
) {
    let mut in_progress = 0;
    loop {
        while in_progress < threads
            && let Some(next) = walk.start()
        {
            give.send(next).expect("workers take tasks until this sender is dropped");
            in_progress += 1;
        }
        if in_progress == 0 {
            return;
        }
        let (task, attempt) = reports.recv().expect("a worker reports every task it took, panic or not");
        in_progress -= 1;
        walk.finish(task, attempt);
    }
}
