//! The statistics of a certificate: plans of acceptance sampling, intervals of shares, Cohen's kappa.
//!
//! A plan looks at `n` places and accepts where at most `c` of them fail. It is exact for the binomial distribution,
//! as G. A. Schiavone, R. S. Nelson and B. Goldiez take it for elevations in "Statistical certification of terrain
//! databases" (1995).

use statrs::function::factorial::ln_binomial;

/// Most places, or pairs of places, that may be looked at: their figures are held at once, about 250 bytes each.
pub const SAMPLES_MAX: u64 = 4_000_000;
/// How much smaller the share that fails is where two surfaces are to be accepted as surely as others are refused.
const GOOD: f64 = 0.5;

/// What is asked of a share: that it is at least `share`, told wrongly with a chance of at most `risk`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// The least share of the area, or of all pairs of places, that agrees: above 0 and below 1.
    pub share: f64,
    /// The chance of accepting where less than that agrees: above 0 and at most a half.
    pub risk: f64,
}

/// How many places are looked at, and how many of them may fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Places looked at.
    pub samples: u64,
    /// The most that may fail.
    pub failures_max: u64,
}

impl Demand {
    /// The smallest plan that keeps the risk, and with which two surfaces of which half as much fails are refused with
    /// no larger one. `None` where that takes more than [`SAMPLES_MAX`].
    pub(crate) fn plan(&self) -> Option<Plan> {
        let failing = 1.0 - self.share;
        let mut samples = 1;
        let mut failures_max = 0;
        loop {
            samples = least(samples, |samples| at_most(failures_max, samples, failing) <= self.risk)?;
            if 1.0 - self.risk <= at_most(failures_max, samples, GOOD * failing) {
                return Some(Plan { samples, failures_max });
            }
            failures_max += 1;
        }
    }

    /// The most failures of so many places with which the risk is kept; `None` where not even none keeps it.
    pub(crate) fn failures_max(&self, samples: u64) -> Option<u64> {
        let keeps = |failures| at_most(failures, samples, 1.0 - self.share) <= self.risk;
        if !keeps(0) {
            return None;
        }
        let (mut most, mut beyond) = (0, samples);
        while most + 1 < beyond {
            let middle = most + (beyond - most) / 2;
            if keeps(middle) { most = middle } else { beyond = middle }
        }
        Some(most)
    }

    /// The fewest places of which none may fail.
    pub(crate) fn samples_min(&self) -> Option<u64> {
        least(1, |samples| at_most(0, samples, 1.0 - self.share) <= self.risk)
    }
}

/// The smallest number from `from` to [`SAMPLES_MAX`] that holds, where all above it do.
fn least(from: u64, holds: impl Fn(u64) -> bool) -> Option<u64> {
    let (mut low, mut high) = (from, from);
    while !holds(high) {
        low = high + 1;
        high *= 2;
        if 2 * SAMPLES_MAX < high {
            return None;
        }
    }
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(middle) { high = middle } else { low = middle + 1 }
    }
    (low <= SAMPLES_MAX).then_some(low)
}

/// The chance that at most `failures` of so many places fail, where each does with a chance of `failing`: terms summed
/// from the largest on, above the mean those of more failures.
fn at_most(failures: u64, samples: u64, failing: f64) -> f64 {
    /// Part of the sum below which a term changes nothing, and neither does any after it.
    const NOTHING: f64 = 1e-17;
    if samples <= failures || failing <= 0.0 {
        return 1.0;
    }
    if 1.0 <= failing {
        return 0.0;
    }
    let odds = failing / (1.0 - failing);
    let is_below = failures as f64 <= failing * samples as f64;
    let mut count = if is_below { failures } else { failures + 1 };
    let (found, rest) = (count as f64, (samples - count) as f64);
    let mut term = (ln_binomial(samples, count) + found * failing.ln() + rest * (-failing).ln_1p()).exp();
    let mut sum = 0.0;
    while sum * NOTHING < term {
        sum += term;
        if is_below {
            term *= count as f64 / ((samples - count + 1) as f64 * odds);
            count = count.saturating_sub(1);
        } else {
            term *= (samples - count) as f64 / (count + 1) as f64 * odds;
            count += 1;
        }
    }
    if is_below { sum } else { 1.0 - sum }
}

/// The interval of C. J. Clopper and E. S. Pearson (1934) that holds a share with 95 %, of which `count` of `samples`
/// were found.
pub fn clopper_pearson(count: u64, samples: u64) -> [f64; 2] {
    const TAIL: f64 = 0.025;
    let low = || halved(|share| TAIL <= 1.0 - at_most(count - 1, samples, share));
    let high = || halved(|share| at_most(count, samples, share) <= TAIL);
    [if count == 0 { 0.0 } else { low() }, if count == samples { 1.0 } else { high() }]
}

/// The share from which on something holds, by halving.
fn halved(holds: impl Fn(f64) -> bool) -> f64 {
    const HALVINGS: usize = 60;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// How often two surfaces put a place, or a pair of places, into the same class: rows are those of A, columns of B.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Confusion<const N: usize>(pub [[u64; N]; N]);

/// Agreement beyond chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kappa {
    /// J. Cohen's kappa (1960): 1 where all agree, 0 where no more agree than would by chance.
    pub kappa: f64,
    /// The interval that holds it with 95 %, by the standard error of J. L. Fleiss, J. Cohen and B. S. Everitt (1969).
    pub interval: [f64; 2],
}

impl<const N: usize> Confusion<N> {
    /// All places.
    pub fn total(&self) -> u64 {
        self.0.iter().flatten().sum()
    }

    /// Places in the same class on both.
    pub fn agreeing(&self) -> u64 {
        (0..N).map(|class| self.0[class][class]).sum()
    }

    /// Kappa; `None` where all places of both lie in one class, so that nothing else could have been found, or where
    /// there is no place.
    pub fn kappa(&self) -> Option<Kappa> {
        let total = self.total() as f64;
        let part = |row: usize, col: usize| self.0[row][col] as f64 / total;
        let of_a: [f64; N] = std::array::from_fn(|row| (0..N).map(|col| part(row, col)).sum());
        let of_b: [f64; N] = std::array::from_fn(|col| (0..N).map(|row| part(row, col)).sum());
        let is_one_class = |class: usize| self.0[class][class] == self.total();
        if total == 0.0 || (0..N).any(is_one_class) {
            return None;
        }
        let found = self.agreeing() as f64 / total;
        let chance: f64 = (0..N).map(|class| of_a[class] * of_b[class]).sum();
        let kappa = (found - chance) / (1.0 - chance);
        let mut sum = 0.0;
        for row in 0..N {
            for col in 0..N {
                let factor = if row == col {
                    1.0 - (of_a[row] + of_b[row]) * (1.0 - kappa)
                } else {
                    (1.0 - kappa) * (of_b[row] + of_a[col])
                };
                sum += part(row, col) * factor * factor;
            }
        }
        let last = kappa - chance * (1.0 - kappa);
        let variance = (sum - last * last).max(0.0) / (total * (1.0 - chance) * (1.0 - chance));
        let half = 1.959_963_985 * variance.sqrt();
        Some(Kappa { kappa, interval: [(kappa - half).max(-1.0), (kappa + half).min(1.0)] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: Demand = Demand { share: 0.95, risk: 0.05 };

    #[test]
    fn plans_of_few_failures_are_those_of_wilks() {
        // Places for none to five failures, of tolerance limits for 95 % with 95 % (S. S. Wilks, 1941).
        for (failures, samples) in [(0, 59), (1, 93), (2, 124), (3, 153), (4, 181), (5, 208)] {
            assert_eq!(USUAL.failures_max(samples), Some(failures));
            assert_eq!(USUAL.failures_max(samples - 1), failures.checked_sub(1));
        }
        assert_eq!(USUAL.samples_min(), Some(59));
        assert_eq!(Demand { share: 0.9, risk: 0.1 }.samples_min(), Some(22));
        assert_eq!(Demand { share: 0.99, risk: 0.05 }.samples_min(), Some(299));
    }

    #[test]
    fn a_plan_keeps_both_risks_and_no_smaller_one_does() {
        for demand in [USUAL, Demand { share: 0.9, risk: 0.1 }, Demand { share: 0.99, risk: 0.01 }] {
            let plan = demand.plan().unwrap();
            let keeps = |plan: Plan| {
                let failing = 1.0 - demand.share;
                summed(plan.failures_max, plan.samples, failing) <= demand.risk
                    && 1.0 - demand.risk <= summed(plan.failures_max, plan.samples, failing / 2.0)
            };
            assert!(keeps(plan), "{plan:?}");
            assert_eq!(demand.failures_max(plan.samples), Some(plan.failures_max));
            for samples in (1..plan.samples).filter(|samples| samples % 7 == 0) {
                let failures_max = demand.failures_max(samples).unwrap_or(0);
                assert!(!keeps(Plan { samples, failures_max }), "{samples} would do");
            }
        }
        assert_eq!(Demand { share: 0.999_999_9, risk: 0.05 }.plan(), None);
    }

    /// The same chance, summed term by term.
    fn summed(failures: u64, samples: u64, failing: f64) -> f64 {
        let (mut term, mut sum) = ((1.0 - failing).powf(samples as f64), 0.0);
        for count in 0..=failures.min(samples) {
            sum += term;
            term *= (samples - count) as f64 / (count + 1) as f64 * failing / (1.0 - failing);
        }
        sum
    }

    #[test]
    fn chances_equal_those_summed_term_by_term() {
        for samples in [1, 2, 17, 59, 300, 900] {
            for failures in [0, 1, 5, 40] {
                for failing in [0.001, 0.05, 0.3] {
                    let (found, expected) = (at_most(failures, samples, failing), summed(failures, samples, failing));
                    assert!((found - expected).abs() < 1e-10, "{failures} of {samples} at {failing}: {found}");
                }
            }
        }
    }

    #[test]
    fn intervals_are_those_of_tables() {
        for (count, samples, expected) in [
            (0, 10, [0.0, 0.3085]),
            (1, 10, [0.0025, 0.4450]),
            (5, 20, [0.0866, 0.4910]),
            (10, 10, [0.6915, 1.0]),
            (59, 59, [0.9394, 1.0]),
        ] {
            let found = clopper_pearson(count, samples);
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{count} of {samples}: {found:?}");
        }
    }

    #[test]
    fn an_interval_holds_its_share_and_is_what_it_says() {
        for (count, samples) in [(3, 700), (690, 700), (4_999_000, 5_000_000), (1, 10_000_000)] {
            let [low, high] = clopper_pearson(count, samples);
            let share = count as f64 / samples as f64;
            assert!(0.0 < low && low < share && share < high && high < 1.0);
            assert!((at_most(count, samples, high) - 0.025).abs() < 1e-6, "{count} of {samples}");
            assert!((1.0 - at_most(count - 1, samples, low) - 0.025).abs() < 1e-6, "{count} of {samples}");
        }
    }

    #[test]
    fn kappa_is_that_of_the_book() {
        // J. L. Fleiss, "Statistical methods for rates and proportions": 0.68, with a standard error of 0.087.
        let found = Confusion([[75, 1, 4], [5, 4, 1], [0, 0, 10]]).kappa().unwrap();
        assert!((found.kappa - 0.676).abs() < 0.001, "{found:?}");
        let error = (found.interval[1] - found.kappa) / 1.96;
        assert!((error - 0.087).abs() < 0.001, "{error}");
        assert!((Confusion([[20, 5], [10, 15]]).kappa().unwrap().kappa - 0.4).abs() < 1e-12);
    }

    #[test]
    fn kappa_is_undefined_where_nothing_else_could_have_been_found() {
        assert_eq!(Confusion([[9, 0], [0, 0]]).kappa(), None);
        assert_eq!(Confusion([[0, 0], [0, 0]]).kappa(), None);
        let found = Confusion([[9, 0], [0, 3]]).kappa().unwrap();
        assert_eq!((found.kappa, found.interval), (1.0, [1.0, 1.0]));
    }
}
