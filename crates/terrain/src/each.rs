//! How work that falls into pieces is run, where threads are none of a crate's business.

use std::sync::OnceLock;

/// Runs `piece(0)` to `piece(count - 1)`, in any order and perhaps several at once; returns when all have ended.
pub type Each<'a> = &'a (dyn Fn(usize, &(dyn Fn(usize) + Sync)) + Sync);

/// Runs pieces one after the other.
pub fn in_turn(count: usize, piece: &(dyn Fn(usize) + Sync)) {
    (0..count).for_each(piece);
}

/// What `piece` returns for each number, in the order of numbers.
pub fn gather<R: Send + Sync>(each: Each, count: usize, piece: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let results: Vec<OnceLock<R>> = (0..count).map(|_| OnceLock::new()).collect();
    each(count, &|number| {
        results[number].get_or_init(|| piece(number));
    });
    results.into_iter().filter_map(OnceLock::into_inner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_numbers_whatever_the_order_of_work() {
        let backwards = |count: usize, piece: &(dyn Fn(usize) + Sync)| (0..count).rev().for_each(piece);
        assert_eq!(gather(&backwards, 4, |number| 10 * number), [0, 10, 20, 30]);
        assert_eq!(gather(&in_turn, 4, |number| 10 * number), [0, 10, 20, 30]);
        assert!(gather(&in_turn, 0, |number| number).is_empty());
    }
}
