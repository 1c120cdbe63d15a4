//! One task run with its panic caught, and what many of them add up to.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::ScheduleError;

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
