//! The order in which vertices on a side go.
//!
//! It is found from the places and heights along the side alone, which both load modules that share it list alike.

/// Places in `line` of all its points but the ends, in the order in which they go: each time the one without which the
/// line lies closest to the whole one, by squared distance in height along it; the first where several do.
pub(super) fn removal_order(line: &[(u16, i32)]) -> Vec<usize> {
    let mut kept: Vec<usize> = (0..line.len()).collect();
    let mut order = Vec::new();
    while 2 < kept.len() {
        let cost = |at: usize| {
            let [before, point, after] = [at - 1, at, at + 1].map(|at| kept[at]);
            missed(line, before, after) - missed(line, before, point) - missed(line, point, after)
        };
        let cheapest = (1..kept.len() - 1).map(|at| (at, cost(at))).min_by(|(_, a), (_, b)| a.total_cmp(b));
        let Some((at, _)) = cheapest else { break };
        order.push(kept.remove(at));
    }
    order
}

/// Squared distance in height, along the side, between the line and the straight one from `start` to `end` of it.
fn missed(line: &[(u16, i32)], start: usize, end: usize) -> f64 {
    let [(from, low), (to, high)] = [start, end].map(|at| (f64::from(line[at].0), f64::from(line[at].1)));
    let slope = (high - low) / (to - from);
    let above = |at: usize| f64::from(line[at].1) - low - slope * (f64::from(line[at].0) - from);
    let piece = |at: usize| {
        let (a, b) = (above(at), above(at + 1));
        let length = f64::from(line[at + 1].0) - f64::from(line[at].0);
        length * (a * a + a * b + b * b) / 3.0
    };
    (start..end).map(piece).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_on_a_straight_line_goes_before_a_summit() {
        assert_eq!(removal_order(&[(0, 0), (10, 10), (30, 30), (40, 100), (64, 0)]), [1, 2, 3]);
        assert_eq!(removal_order(&[(0, 0), (64, 50)]), [0; 0]);
    }

    #[test]
    fn what_is_left_is_judged_by_the_whole_line() {
        // Two small steps up: once one is gone, the other stands for both.
        let order = removal_order(&[(0, 0), (10, 5), (20, 5), (30, 0), (40, 9), (50, 0)]);
        assert_eq!(order.len(), 4);
        assert_eq!(order[3], 4);
    }
}
