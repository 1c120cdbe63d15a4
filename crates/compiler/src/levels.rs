//! Coarser levels of a tile's load modules, as the job wants them.

use ground::Window;
use job::Method;
use load_modules::{Layout, LevelGround, Levels, coarser_levels};
use terrain::LoadModule;

use crate::run::Run;

/// Every level of a tile's load modules, beginning with the finest, which is given.
pub(crate) fn all_levels(run: &Run, finest: Vec<LoadModule>, layout: &Layout, window: &Window) -> Vec<Vec<LoadModule>> {
    let lod = &run.job.lod;
    let mut levels = vec![finest];
    if lod.inner_shares.is_empty() {
        return levels;
    }
    let wanted = Levels {
        inner_shares: &lod.inner_shares,
        border: lod.border,
        flips: matches!(run.job.tin.method, Method::Optimised(_)),
    };
    let ground = LevelGround { dem: &window.dem, mask: &window.importance };
    levels.resize_with(lod.level_count(), Vec::new);
    for place in 0..levels[0].len() {
        let coarser = coarser_levels(&levels[0][place], layout, &wanted, &ground);
        levels[1..].iter_mut().zip(coarser).for_each(|(level, module)| level.push(module));
    }
    levels
}
