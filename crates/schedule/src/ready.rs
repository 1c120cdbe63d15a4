//! The tasks whose lower-ranked neighbours are all done, and the bookkeeping that gets them there.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::RankedTasks;

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
