//! How much each effort does.

use terrain::Effort;

/// What an effort does.
pub(crate) struct Recipe {
    /// How many times its budget the TIN has before it is optimised.
    pub overshoot: f64,
    /// Times the budget to thin to, one after the other.
    pub stages: &'static [f64],
    /// Sweeps once the budget is met.
    pub sweeps: usize,
    /// Rounds of exchange at most.
    pub rounds: usize,
    /// Cycles of growing and thinning.
    pub cycles: usize,
    /// Sweeps on the final lattice.
    pub last_sweeps: usize,
}

impl Recipe {
    /// What this effort does.
    pub fn of(effort: Effort) -> Self {
        match effort {
            Effort::Fast => Self { overshoot: 1.0, stages: &[], sweeps: 3, rounds: 0, cycles: 0, last_sweeps: 0 },
            Effort::Normal => Self { overshoot: 2.0, stages: &[1.0], sweeps: 2, rounds: 10, cycles: 0, last_sweeps: 2 },
            Effort::Best => {
                Self { overshoot: 3.0, stages: &[2.0, 1.5, 1.2, 1.0], sweeps: 2, rounds: 10, cycles: 8, last_sweeps: 4 }
            }
        }
    }
}

/// How many times its budget a TIN should have before it is optimised.
pub fn overshoot(effort: Effort) -> f64 {
    Recipe::of(effort).overshoot
}
