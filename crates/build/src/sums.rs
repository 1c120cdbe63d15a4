//! What a build knows of load modules that are published, numbers only; and what the report says of an area's residuals
//! and points: sums over its tiles.
//!
//! They are added up tile by tile, because the histogram of one takes 74 kB a class. All are whole numbers, so the
//! order of tiles does not matter.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use fidelity::{Curvature, FeatureFigures, Residuals, Tally};
use store::FileStamp;
use terrain::{ModuleId, ModuleResidual, Refusal, RefusedBy};

/// What whole-area stages know of one tile's load modules: numbers only.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Assembled {
    pub file: FileStamp,
    /// The file of what follows.
    pub measured: FileStamp,
    /// Per load module of the tile, row by row.
    pub modules: Vec<ModuleNumbers>,
    /// The same of every level beside the finest.
    pub coarser: Vec<Vec<ModuleNumbers>>,
}

/// Counts and residual of one load module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ModuleNumbers {
    pub triangles: u32,
    pub polygons: u32,
    pub residual: ModuleResidual,
}

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

/// Posts that limits kept out of one load module: how many, and the largest of their residuals, by what refused them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct RefusedPosts {
    counts: [u32; 3],
    largest: [u32; 3],
}

/// What refuses posts, in the order of the counts.
const BY: [RefusedBy; 3] = [RefusedBy::Module, RefusedBy::Window, RefusedBy::Reservation];

impl RefusedPosts {
    /// Takes in one more.
    fn add(&mut self, refusal: &Refusal) {
        let by = BY.iter().position(|&by| by == refusal.by).expect("the list names every limit");
        self.counts[by] += 1;
        self.largest[by] = self.largest[by].max(refusal.residual);
    }

    /// Takes in those of another load module or tile.
    pub fn merge(&mut self, other: &RefusedPosts) {
        for by in 0..BY.len() {
            self.counts[by] += other.counts[by];
            self.largest[by] = self.largest[by].max(other.largest[by]);
        }
    }

    /// Only those that `by` refused, or that anything else did.
    pub fn part(&self, keep: impl Fn(RefusedBy) -> bool) -> RefusedPosts {
        let mut part = RefusedPosts::default();
        for by in (0..BY.len()).filter(|&by| keep(BY[by])) {
            (part.counts[by], part.largest[by]) = (self.counts[by], self.largest[by]);
        }
        part
    }

    /// Those that one limit refused.
    pub fn count_by(&self, by: RefusedBy) -> u32 {
        BY.iter().position(|&one| one == by).map_or(0, |by| self.counts[by])
    }

    /// All of them.
    pub fn count(&self) -> u32 {
        self.counts.iter().sum()
    }

    /// The largest residual of any, in quanta.
    pub fn largest(&self) -> u32 {
        self.largest.into_iter().max().unwrap_or(0)
    }
}

/// Refusals by load module, in ascending order.
pub(crate) fn by_module(refused: &[Refusal]) -> Vec<(ModuleId, RefusedPosts)> {
    let mut modules: BTreeMap<ModuleId, RefusedPosts> = BTreeMap::new();
    refused.iter().for_each(|refusal| modules.entry(refusal.module).or_default().add(refusal));
    modules.into_iter().collect()
}
