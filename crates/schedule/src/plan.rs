//! Tasks with ranks and neighbours: who waits for whom.

/// Tasks 0..n, each with a rank and with neighbours it must never run beside.
///
/// A task waits for all its neighbours of lower rank. Neighbours of equal rank are refused, so of any two
/// neighbours one waits for the other, and that alone keeps them from ever being in progress together.
#[derive(Clone, Debug)]
pub struct RankedTasks {
    /// Place of each task in the order (rank, task number).
    places: Vec<usize>,
    /// Neighbours of every task, one task after the other, those of lower rank first: a million tasks are held in
    /// tens of megabytes.
    links: Vec<usize>,
    /// Where in `links` those of a task begin; one more at the end.
    begins: Vec<usize>,
    /// Where those of higher rank begin.
    middles: Vec<usize>,
    /// Seed of a random order among ready tasks; `None` takes the lowest rank first.
    shuffle: Option<u64>,
}

impl RankedTasks {
    /// Tasks of the given ranks; `neighbours[t]` lists the tasks that `t` must never run beside.
    ///
    /// # Panics
    /// When the lists differ in length, when a task neighbours itself or names no task, when `a` lists `b` but not the
    /// other way round, or when two neighbours have the same rank.
    pub fn new(ranks: &[impl Ord], neighbours: &[Vec<usize>]) -> Self {
        assert_eq!(ranks.len(), neighbours.len(), "every task has a rank and a list of neighbours");
        for (task, beside) in neighbours.iter().enumerate() {
            for &other in beside {
                assert!(other < ranks.len(), "task {task} lists task {other}, and there are {}", ranks.len());
                assert!(neighbours[other].contains(&task), "task {task} lists {other}, which does not list it");
                assert!(ranks[task] != ranks[other], "neighbours {task} and {other} have the same rank");
            }
        }
        let mut order: Vec<usize> = (0..ranks.len()).collect();
        order.sort_by(|&a, &b| ranks[a].cmp(&ranks[b]).then(a.cmp(&b)));
        let mut places = vec![0; ranks.len()];
        for (place, &task) in order.iter().enumerate() {
            places[task] = place;
        }
        let (mut links, mut begins, mut middles) = (Vec::new(), Vec::with_capacity(ranks.len() + 1), Vec::new());
        for (task, beside) in neighbours.iter().enumerate() {
            let is_lower = |other: &usize| places[*other] < places[task];
            begins.push(links.len());
            links.extend(beside.iter().copied().filter(is_lower));
            middles.push(links.len());
            links.extend(beside.iter().copied().filter(|other| !is_lower(other)));
        }
        begins.push(links.len());
        Self { places, links, begins, middles, shuffle: None }
    }

    /// The same tasks, with ready ones taken in a random order: for tests that results do not depend on it.
    pub fn shuffled(mut self, seed: u64) -> Self {
        self.shuffle = Some(seed);
        self
    }

    /// How many tasks there are.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Place of `task` in rank order, counted from 0.
    pub fn place(&self, task: usize) -> usize {
        self.places[task]
    }

    /// The neighbours `task` waits for.
    pub fn lower(&self, task: usize) -> &[usize] {
        &self.links[self.begins[task]..self.middles[task]]
    }

    /// The neighbours that wait for `task`.
    pub(crate) fn higher(&self, task: usize) -> &[usize] {
        &self.links[self.middles[task]..self.begins[task + 1]]
    }

    /// Bytes that a walk through these tasks holds: what is here, and what it keeps of each task while it runs.
    pub fn coordinator_bytes(&self) -> u64 {
        /// State, count of missing neighbours, place in the queue, result.
        const BYTES_PER_TASK: usize = 48;
        let words = self.places.len() + self.links.len() + self.begins.len() + self.middles.len();
        (words * size_of::<usize>() + self.places.len() * BYTES_PER_TASK) as u64
    }

    /// Key by which ready tasks are taken, smallest first.
    pub(crate) fn urgency(&self, task: usize) -> u64 {
        match self.shuffle {
            None => self.places[task] as u64,
            Some(seed) => mixed(seed.wrapping_add(task as u64)),
        }
    }
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014): a bijection of `u64`, so no two tasks tie.
fn mixed(value: u64) -> u64 {
    let z = value.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Grids of tiles for this crate's tests.
#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A grid of tasks that neighbour one another by side and corner.
    pub(crate) fn grid_neighbours(rows: usize, cols: usize) -> Vec<Vec<usize>> {
        let near = |a: usize, b: usize| a.abs_diff(b) <= 1;
        let beside = |task: usize| {
            let (row, col) = (task / cols, task % cols);
            (0..rows * cols).filter(|&o| o != task && near(o / cols, row) && near(o % cols, col)).collect()
        };
        (0..rows * cols).map(beside).collect()
    }

    /// A grid of tasks ranked (colour, row, column) with four colours, as tiles are.
    pub(crate) fn four_colours(rows: usize, cols: usize) -> RankedTasks {
        let rank = |task: usize| {
            let (row, col) = (task / cols, task % cols);
            (2 * (row % 2) + col % 2, row, col)
        };
        let ranks: Vec<_> = (0..rows * cols).map(rank).collect();
        RankedTasks::new(&ranks, &grid_neighbours(rows, cols))
    }

    #[test]
    fn of_two_neighbours_one_waits_for_the_other() {
        let plan = four_colours(4, 5);
        for (task, beside) in grid_neighbours(4, 5).iter().enumerate() {
            for &other in beside {
                assert!(plan.lower(task).contains(&other) != plan.higher(task).contains(&other));
                assert_eq!(plan.lower(task).contains(&other), plan.higher(other).contains(&task));
            }
        }
        assert_eq!((plan.len(), plan.place(0), plan.lower(0).len()), (20, 0, 0));
    }

    #[test]
    #[should_panic(expected = "neighbours 0 and 1 have the same rank")]
    fn neighbours_of_equal_rank_are_refused() {
        RankedTasks::new(&[4, 4], &[vec![1], vec![0]]);
    }

    #[test]
    #[should_panic(expected = "task 0 lists 1, which does not list it")]
    fn one_sided_neighbours_are_refused() {
        RankedTasks::new(&[1, 2], &[vec![1], vec![]]);
    }
}
