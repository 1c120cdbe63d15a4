//! The closest sequence that never rises, by pooling neighbours that do (M. Ayer and others, 1955), in whole numbers.

/// A run of values with one mean.
#[derive(Clone, Copy)]
struct Pool {
    sum: i64,
    count: i64,
}

/// The sequence without a rise that is closest to `values` in squares, each pool's mean rounded down.
pub(crate) fn falling(values: &[i32]) -> Vec<i32> {
    let mut pools: Vec<Pool> = Vec::with_capacity(values.len());
    for &value in values {
        let mut pool = Pool { sum: i64::from(value), count: 1 };
        while let Some(before) = pools.last().filter(|before| before.sum * pool.count < pool.sum * before.count) {
            pool = Pool { sum: pool.sum + before.sum, count: pool.count + before.count };
            pools.pop();
        }
        pools.push(pool);
    }
    let repeated = |pool: &Pool| std::iter::repeat_n(pool.sum.div_euclid(pool.count) as i32, pool.count as usize);
    pools.iter().flat_map(repeated).collect()
}

/// The squares between values and their falling fit.
pub(crate) fn squares(values: &[i32]) -> i128 {
    let off = |(value, fit): (&i32, i32)| i128::from(value - fit) * i128::from(value - fit);
    values.iter().zip(falling(values)).map(off).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_falls_stays_and_what_rises_is_pooled() {
        assert_eq!(falling(&[9, 7, 7, 2]), [9, 7, 7, 2]);
        assert_eq!(falling(&[1, 2, 3]), [2, 2, 2]);
        assert_eq!(falling(&[9, 1, 4, 0]), [9, 2, 2, 0]);
        assert!(falling(&[]).is_empty());
    }

    proptest! {
        #[test]
        fn no_falling_sequence_on_small_numbers_is_closer(values in proptest::collection::vec(0..4i32, 1..6)) {
            let fit = falling(&values);
            prop_assert!(fit.windows(2).all(|pair| pair[1] <= pair[0]));
            // All falling sequences of thirds and halves would be the reals; whole numbers bound them from above.
            let best = squares_of_best(&values, 3, 0);
            prop_assert!(squares(&values) <= best + values.len() as i128);
        }
    }

    fn squares_of_best(values: &[i32], most: i32, at: usize) -> i128 {
        let Some(value) = values.get(at) else { return 0 };
        let with = |level: i32| i128::from((value - level) * (value - level)) + squares_of_best(values, level, at + 1);
        (0..=most).map(with).min().unwrap_or(0)
    }
}
