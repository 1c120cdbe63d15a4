//! Why a run of tasks ended before all of them were done.

use std::fmt;

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
