//! One task run with its panic caught, what many of them add up to, and why a run ended before all were done.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Why a run of tasks ended before all of them were done. Tasks that were running when it happened have finished.
#[derive(Debug, PartialEq, Eq)]
pub enum ScheduleError<R, E> {
    /// A task panicked; of several, the one first in rank (or index) order.
    Panicked {
        /// Which task.
        task: usize,
        /// What it said.
        message: String,
    },
    /// A task returned an error; of several, the one first in rank (or index) order.
    Failed {
        /// Which task.
        task: usize,
        /// What it returned.
        error: E,
    },
    /// The flag to stop was raised before every task had started.
    Stopped {
        /// Tasks that are done, with their results, in task order.
        done: Vec<(usize, R)>,
        /// How many tasks there are.
        tasks: usize,
    },
    /// The system refused to start a worker thread; no task was started.
    NoThread {
        /// How many workers were asked for.
        workers: usize,
        /// What the system said.
        message: String,
    },
}

impl<R, E: fmt::Display> fmt::Display for ScheduleError<R, E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ScheduleError::Panicked { task, message } => write!(f, "task {task} panicked: {message}"),
            ScheduleError::Failed { task, error } => write!(f, "task {task}: {error}"),
            ScheduleError::Stopped { done, tasks } => write!(f, "stopped with {} of {tasks} tasks done", done.len()),
            ScheduleError::NoThread { workers, message } => {
                write!(f, "found no thread for one of {workers} workers: {message}")
            }
        }
    }
}

impl<R: fmt::Debug, E: fmt::Debug + fmt::Display> std::error::Error for ScheduleError<R, E> {}

/// How one task ended.
pub(crate) enum Attempt<R, E> {
    Done(R),
    Failed(E),
    Panicked(String),
}

/// Runs a task and catches its panic.
///
/// What the task left half-changed behind its shared references must not be read: after a panic no task starts and
/// no result is returned. So it is safe to assert unwind safety here.
pub(crate) fn attempt<R, E>(task: impl FnOnce() -> Result<R, E>) -> Attempt<R, E> {
    match catch_unwind(AssertUnwindSafe(task)) {
        Ok(Ok(result)) => Attempt::Done(result),
        Ok(Err(error)) => Attempt::Failed(error),
        Err(payload) => Attempt::Panicked(message_of(payload.as_ref())),
    }
}

fn message_of(payload: &(dyn std::any::Any + Send)) -> String {
    if let Some(text) = payload.downcast_ref::<&str>() {
        (*text).to_owned()
    } else if let Some(text) = payload.downcast_ref::<String>() {
        text.clone()
    } else {
        "a panic without a message".to_owned()
    }
}

/// Results as they come in, whatever their order, and the first failure by place.
pub(crate) struct Outcome<R, E> {
    results: Vec<Option<R>>,
    failure: Option<(usize, ScheduleError<R, E>)>,
}

impl<R, E> Outcome<R, E> {
    pub(crate) fn new(tasks: usize) -> Self {
        Self { results: (0..tasks).map(|_| None).collect(), failure: None }
    }

    pub(crate) fn is_failed(&self) -> bool {
        self.failure.is_some()
    }

    /// Takes in how `task` ended; a failure counts if none before it in `place` is known.
    /// Returns the result, if there is one.
    pub(crate) fn accept(&mut self, task: usize, place: usize, attempt: Attempt<R, E>) -> Option<&R> {
        let error = match attempt {
            Attempt::Done(result) => return Some(self.results[task].insert(result)),
            Attempt::Failed(error) => ScheduleError::Failed { task, error },
            Attempt::Panicked(message) => ScheduleError::Panicked { task, message },
        };
        if self.failure.as_ref().is_none_or(|(first, _)| place < *first) {
            self.failure = Some((place, error));
        }
        None
    }

    /// All results in task order, or why there are not all of them.
    pub(crate) fn into_results(self) -> Result<Vec<R>, ScheduleError<R, E>> {
        if let Some((_, error)) = self.failure {
            return Err(error);
        }
        let tasks = self.results.len();
        if self.results.iter().all(Option::is_some) {
            return Ok(self.results.into_iter().flatten().collect());
        }
        let done = self.results.into_iter().enumerate().filter_map(|(task, result)| Some((task, result?))).collect();
        Err(ScheduleError::Stopped { done, tasks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(error: ScheduleError<u8, &str>, expected: &str) {
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn every_message_names_the_task_or_both_numbers() {
        check(ScheduleError::Panicked { task: 7, message: "no such vertex".into() }, "task 7 panicked: no such vertex");
        check(ScheduleError::Failed { task: 3, error: "disk full" }, "task 3: disk full");
        check(ScheduleError::Stopped { done: vec![(0, 1), (2, 1)], tasks: 36 }, "stopped with 2 of 36 tasks done");
        check(
            ScheduleError::NoThread { workers: 8, message: "resource unavailable".into() },
            "found no thread for one of 8 workers: resource unavailable",
        );
    }
}
