//! How much each effort does, step by step.

use terrain::Effort;

/// What an effort does.
pub(crate) struct Recipe {
    /// How many times its budget the TIN has before it is optimised.
    pub overshoot: f64,
    /// Its steps, part after part.
    pub steps: &'static [&'static [Step]],
}

/// One step of a recipe.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// From here on vertices move on the final lattice.
    OnLattice,
    /// Flips every edge that gains by it.
    Flip,
    /// Moves every vertex once, then flips where something changed much.
    Sweep,
    /// The same of vertices around which something has changed since they were moved.
    SweepChanged,
    /// Thins to so many times the budget.
    Thin(f64, ThinBy),
    /// Flips where that gains once the vertices around have moved, in so many rounds of moves at most.
    DeepFlip(usize),
    /// Moves all vertices at once, in so many steps.
    Descend(usize),
    /// Grows to so many times the budget.
    Grow(f64),
    /// Puts every vertex on the final lattice.
    Snap,
    /// Fits all heights at once, in so many steps.
    FitHeights(usize),
}

/// What thinning takes for the cost of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ThinBy {
    /// What the squares rise by where nothing else changes.
    AsItIs,
    /// What they rise by once heights around the hole are fitted.
    Fitted,
    /// What they rise by once the vertices around have moved; this part of the fitted cost, as a first guess.
    Deep(f64),
}

use Step::{DeepFlip, Descend, FitHeights, Flip, Grow, OnLattice, Snap, Sweep, SweepChanged, Thin};
use ThinBy::{AsItIs, Deep, Fitted};

/// Fitting all heights before thinning does most of what a sweep would there, for an eighth of its time.
const FAST: &[Step] = &[OnLattice, FitHeights(3), Thin(1.0, AsItIs), Sweep, SweepChanged, Snap];

const NORMAL: &[Step] = &[
    Sweep,
    Thin(1.6, AsItIs),
    Sweep,
    Thin(1.2, Fitted),
    Sweep,
    Thin(1.0, Deep(0.4)),
    DeepFlip(3),
    SweepChanged,
    DeepFlip(3),
    Descend(8),
    Flip,
    Snap,
    Sweep,
    FitHeights(9),
];

const BEGINNING_OF_BEST: &[Step] = &[
    Sweep,
    Thin(1.6, AsItIs),
    Sweep,
    Descend(4),
    Flip,
    Thin(1.2, Fitted),
    Sweep,
    DeepFlip(2),
    Descend(4),
    Flip,
    Thin(1.0, Deep(0.4)),
    DeepFlip(3),
    Descend(6),
    Flip,
];

/// Grows by squares and thins again: out of one local optimum and into a better one.
const CYCLE: &[Step] =
    &[Grow(1.2), Flip, Sweep, DeepFlip(2), Descend(4), Flip, Thin(1.0, Deep(0.4)), DeepFlip(3), Descend(6), Flip];

const END_OF_BEST: &[Step] = &[DeepFlip(3), Descend(6), Flip, Snap, Sweep, FitHeights(9)];

impl Recipe {
    /// What this effort does.
    pub fn of(effort: Effort) -> Self {
        match effort {
            Effort::Fast => Self { overshoot: 1.45, steps: &[FAST] },
            Effort::Normal => Self { overshoot: 2.5, steps: &[NORMAL] },
            Effort::Best => Self { overshoot: 2.5, steps: &[BEGINNING_OF_BEST, CYCLE, CYCLE, CYCLE, END_OF_BEST] },
        }
    }
}

/// How many times its budget a TIN should have before it is optimised.
pub fn overshoot(effort: Effort) -> f64 {
    Recipe::of(effort).overshoot
}
