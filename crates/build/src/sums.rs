//! What the report says of an area's residuals and points: sums over its tiles.
//!
//! They are added up tile by tile, because the histogram of one takes 74 kB a class. All are whole numbers, so the
//! order of tiles does not matter.

use std::sync::{Mutex, PoisonError};

use fidelity::{Curvature, FeatureFigures, Residuals, Tally};

/// Of one tile, or of many.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// Against the working grid, by class of ground.
    pub residuals: Residuals,
    /// The same against the sources' heights alone, where features or water are burned into the working grid.
    pub at_source_grid: Option<Tally>,
    /// Against the sources' own posts.
    pub at_source: Tally,
    /// Whether that is of every tile: sources have other posts than the working grid.
    pub has_source: bool,
    /// Points per class, each point of the area in one tile; after the job's classes those over holes, if any are.
    pub points: Vec<u64>,
    /// Those of them that every build starts from: border points, corners not counted.
    pub border: u64,
    /// The lowest and the highest vertex of all levels, in quanta.
    pub heights: (i32, i32),
    /// How much the ground curves, for triangles as large as each tile has them.
    pub curvature: Curvature,
    /// What was found of features, in jobs with some.
    pub features: Option<FeatureFigures>,
}

/// Sums that several workers add to.
#[derive(Default)]
pub struct Adding(Mutex<Option<Sums>>);

impl Adding {
    /// Adds those of one tile.
    pub fn add(&self, sums: Sums) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match all.as_mut() {
            None => *all = Some(sums),
            Some(all) => all.merge(&sums),
        }
    }

    /// All of them.
    pub fn finish(self) -> Sums {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner).unwrap_or_default()
    }
}

impl Sums {
    fn merge(&mut self, other: &Sums) {
        self.residuals.merge(&other.residuals);
        match (&mut self.at_source_grid, &other.at_source_grid) {
            (Some(mine), Some(others)) => mine.merge(others),
            (mine, _) => *mine = None,
        }
        self.at_source.merge(&other.at_source);
        self.has_source &= other.has_source;
        self.points.resize(self.points.len().max(other.points.len()), 0);
        for (sum, points) in self.points.iter_mut().zip(&other.points) {
            *sum += points;
        }
        self.border += other.border;
        self.curvature.merge(&other.curvature);
        match (&mut self.features, &other.features) {
            (Some(mine), Some(others)) => mine.merge(others),
            (mine @ None, Some(others)) => *mine = Some(others.clone()),
            (_, None) => {}
        }
        self.heights = (self.heights.0.min(other.heights.0), self.heights.1.max(other.heights.1));
    }
}
