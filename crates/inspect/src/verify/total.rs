//! Residuals of many load modules together, in 128 bits.

use fidelity::DeckFigures;
use store::MeasuredTally;
use terrain::{LoadModule, ModuleGrid, ModuleResidual, QUANTA_PER_METRE};

/// Residuals of many load modules together. Nothing that a file can hold makes them wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Total {
    pub posts: u128,
    pub largest: u32,
    pub sum_abs: u128,
    pub sum_squared: u128,
}

impl Total {
    pub fn of(residuals: impl Iterator<Item = ModuleResidual>) -> Self {
        let mut sum = Self::default();
        residuals.for_each(|residual| sum.add(residual));
        sum
    }

    pub fn add(&mut self, one: ModuleResidual) {
        self.posts += u128::from(one.posts);
        self.largest = self.largest.max(one.largest);
        self.sum_abs += u128::from(one.sum_abs);
        self.sum_squared += u128::from(one.sum_squared);
    }

    pub fn of_tallies(tallies: &[MeasuredTally]) -> Self {
        tallies.iter().fold(Self::default(), |sum, one| Self {
            posts: sum.posts + u128::from(one.posts),
            largest: sum.largest.max(one.largest),
            sum_abs: sum.sum_abs + u128::from(one.sum_abs),
            sum_squared: sum.sum_squared.saturating_add(squares(one)),
        })
    }

    pub fn max_m(&self) -> f64 {
        f64::from(self.largest) / f64::from(QUANTA_PER_METRE)
    }

    pub fn rms_m(&self) -> f64 {
        self.per_post(self.sum_squared).sqrt() / f64::from(QUANTA_PER_METRE)
    }

    fn per_post(&self, sum: u128) -> f64 {
        if self.posts == 0 { 0.0 } else { sum as f64 / self.posts as f64 }
    }
}

/// What the load modules of a level add up to.
#[derive(Default)]
pub(crate) struct LevelSums {
    pub modules: usize,
    pub triangles: u64,
    pub polygons: u64,
    pub residual: Total,
    /// The same of those at the border of the area, and of the others.
    pub at_border: Total,
    pub inside: Total,
    pub decks: DeckFigures,
}

impl LevelSums {
    /// Adds a load module of an area, but for its decks.
    pub fn add(&mut self, grid: ModuleGrid, module: &LoadModule) {
        let (id, counts) = (module.id, module.counts());
        let is_outer = id.row == 0 || id.col == 0 || id.row + 1 == grid.rows || id.col + 1 == grid.cols;
        self.modules += 1;
        self.triangles += u64::from(counts.triangles);
        self.polygons += u64::from(counts.polygons);
        let part = if is_outer { &mut self.at_border } else { &mut self.inside };
        [part, &mut self.residual].into_iter().for_each(|total| total.add(module.residual));
    }
}

pub(crate) fn squares(tally: &MeasuredTally) -> u128 {
    let [high, low] = tally.sum_squared.map(u128::from);
    high << 64 | low
}
