//! Least-cost paths between nodes that are known by number.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Hundredths of a metre on level, open ground.
pub(super) type Cost = u64;

/// The cheapest path from `start` to a node that is a goal, both included; of equal ones, that through lower numbers.
///
/// `beside` pushes the neighbours of a node with what it costs to go there.
pub(super) fn least_cost_path(
    count: usize,
    start: usize,
    is_goal: impl Fn(usize) -> bool,
    beside: impl Fn(usize, &mut Vec<(usize, Cost)>),
) -> Option<Vec<usize>> {
    let (mut costs, mut from) = (vec![Cost::MAX; count], vec![usize::MAX; count]);
    let (mut heap, mut neighbours) = (BinaryHeap::new(), Vec::new());
    costs[start] = 0;
    heap.push(Reverse((0, start)));
    while let Some(Reverse((cost, at))) = heap.pop() {
        if costs[at] < cost {
            continue;
        }
        if is_goal(at) {
            let mut path = vec![at];
            while let Some(&before) = path.last().map(|&at| &from[at]).filter(|&&before| before != usize::MAX) {
                path.push(before);
            }
            path.reverse();
            return Some(path);
        }
        neighbours.clear();
        beside(at, &mut neighbours);
        for &(next, step) in &neighbours {
            let next_cost = cost + step;
            if next_cost < costs[next] {
                (costs[next], from[next]) = (next_cost, at);
                heap.push(Reverse((next_cost, next)));
            }
        }
    }
    None
}

/// What a step of `length_m` metres that rises or falls by `rise_m` costs where a grade of `grade` costs as much again
/// as the way itself.
pub(super) fn step_cost(length_m: f64, rise_m: f64, grade: f64) -> f64 {
    let part = rise_m / (length_m * grade);
    100.0 * length_m * (1.0 + part * part)
}
