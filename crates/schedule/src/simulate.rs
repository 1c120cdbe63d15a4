//! How long a plan would take, without running it.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use crate::RankedTasks;
use crate::ranked::Ready;

/// What a simulated run took, in the unit of the durations given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simulation {
    /// From the first start to the last end.
    pub makespan: f64,
    /// Share of the workers' time spent in tasks, 0 to 1.
    pub busy: f64,
    /// The longest chain of tasks that wait for one another: no number of workers is faster.
    pub critical_path: f64,
    /// Tasks that ran at once, at most.
    pub at_once: usize,
}

/// Plays a walk by rank with `workers` workers and tasks of the given durations.
///
/// # Panics
/// When there is no worker, or not one duration per task.
pub fn simulate(plan: &RankedTasks, workers: usize, durations: &[f64]) -> Simulation {
    assert!(0 < workers, "work needs at least one worker");
    assert_eq!(durations.len(), plan.len(), "one duration per task");
    let mut ready = Ready::new(plan);
    let mut running: BinaryHeap<Reverse<Ends>> = BinaryHeap::new();
    let mut now = 0.0;
    let mut at_once = 0;
    loop {
        while running.len() < workers
            && let Some(task) = ready.start()
        {
            running.push(Reverse(Ends { at: now + durations[task], task }));
        }
        at_once = at_once.max(running.len());
        let Some(Reverse(next)) = running.pop() else { break };
        now = next.at;
        ready.finish(next.task);
    }
    let work: f64 = durations.iter().sum();
    let offered = now * workers as f64;
    let busy = if offered == 0.0 { 1.0 } else { work / offered };
    Simulation { makespan: now, busy, critical_path: critical_path(plan, durations), at_once }
}

/// When a running task ends; of those that end at once, the one of lowest number first.
struct Ends {
    at: f64,
    task: usize,
}

impl Ord for Ends {
    fn cmp(&self, other: &Self) -> Ordering {
        self.at.total_cmp(&other.at).then(self.task.cmp(&other.task))
    }
}

impl PartialOrd for Ends {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ends {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Ends {}

fn critical_path(plan: &RankedTasks, durations: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..plan.len()).collect();
    order.sort_by_key(|&task| plan.place(task));
    let mut ends = vec![0.0_f64; plan.len()];
    for task in order {
        let start = plan.lower(task).iter().fold(0.0, |latest: f64, &other| latest.max(ends[other]));
        ends[task] = start + durations[task];
    }
    ends.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::tests::four_colours;

    /// Durations like those of real tiles: mountains cost several times what plains do.
    fn uneven(tasks: usize) -> Vec<f64> {
        (0..tasks).map(|task| 1.0 + ((task * 7919 + 13) % 31) as f64 / 7.5).collect()
    }

    #[test]
    fn two_workers_are_kept_busy_on_a_board_of_36_tiles() {
        let plan = four_colours(6, 6);
        let even = simulate(&plan, 2, &[1.0; 36]);
        assert_eq!((even.makespan, even.busy, even.critical_path), (18.0, 1.0, 4.0));
        let mixed = simulate(&plan, 2, &uneven(36));
        assert!(0.97 <= mixed.busy, "two workers are busy for {:.3} of the time", mixed.busy);
    }

    #[test]
    fn more_workers_never_take_longer_than_one_nor_less_than_the_critical_path() {
        let plan = four_colours(6, 6);
        let durations = uneven(36);
        let alone = simulate(&plan, 1, &durations);
        assert!((alone.busy - 1.0).abs() < 1e-12);
        for workers in [2, 4, 8, 36] {
            let run = simulate(&plan, workers, &durations);
            assert!(alone.critical_path <= run.makespan && run.makespan <= alone.makespan);
        }
    }

    #[test]
    fn a_quarter_of_the_tiles_runs_at_once_at_most() {
        let run = simulate(&four_colours(12, 12), 1000, &[1.0; 144]);
        assert_eq!((run.makespan, run.at_once, run.critical_path), (4.0, 36, 4.0));
    }

    #[test]
    fn an_empty_plan_takes_no_time() {
        let plan = four_colours(0, 0);
        assert_eq!(simulate(&plan, 2, &[]).makespan, 0.0);
    }
}
