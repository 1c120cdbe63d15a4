//! Refinement of every tile in rank order, each seeded by the published borders of its lower-ranked neighbours.

use std::sync::{Arc, OnceLock};

use database::{FingerprintBuilder, Stamp};
use terrain::{Dem, TileId, TileTin, Vertex};
use tin::TileTask;

use crate::ground::Window;
use crate::run::{Run, Worked};
use crate::survey::Shares;
use crate::tasks::{inherited, posts_of, tile_task};
use crate::{CompileError, Progress, Stage};

/// A tile's published TIN and what it was made from.
#[derive(Clone)]
pub(crate) struct Published {
    pub tin: Arc<TileTin>,
    pub stamp: Stamp,
    /// Whether this run made it.
    pub is_new: bool,
}

/// Refines every tile, or keeps what is published and fresh.
pub(crate) fn refine(run: &Run, shares: &Shares, progress: &mut dyn Progress) -> Result<Vec<Published>, CompileError> {
    let slots: Vec<OnceLock<Published>> = run.area.tiles.iter().map(|_| OnceLock::new()).collect();
    run.in_rank_order(Stage::Refine, progress, |tile| {
        let published = |other: TileId| {
            &*slots[run.area.tiling.index(other)].get().expect("lower-ranked neighbours are published first").tin
        };
        let seeds = inherited(&run.area.tiling, tile, published);
        let index = run.area.tiling.index(tile);
        let task = tile_task(run.job, &run.area, tile, &shares.tiles[index], posts_of(&seeds));
        let window = run.window(tile)?;
        let done = refine_or_keep(run, &window, &task, &seeds)?;
        let kept = !done.is_new;
        assert!(slots[index].set(done).is_ok(), "each tile is refined once");
        Ok(if kept { Worked::Kept(()) } else { Worked::Made(()) })
    })?;
    Ok(slots.into_iter().map(|slot| slot.into_inner().expect("every tile was refined")).collect())
}

/// Keeps a tile that was made from the same inputs, and refines any other.
fn refine_or_keep(run: &Run, window: &Window, task: &TileTask, seeds: &[Vertex]) -> Result<Published, CompileError> {
    let stamp = tile_stamp(run, window, task, seeds);
    let folder = run.database.folder();
    if folder.tile_stamp(task.tile).ok().flatten() == Some(stamp)
        && let Ok((_, tin)) = folder.read_tile(task.tile)
    {
        return Ok(Published { tin: Arc::new(tin), stamp, is_new: false });
    }
    let tin = refine_now(window, task, seeds);
    run.database.write_tile(&stamp, &tin)?;
    Ok(Published { tin: Arc::new(tin), stamp, is_new: true })
}

/// What a tile's TIN is made from.
pub(crate) fn tile_stamp(run: &Run, window: &Window, task: &TileTask, seeds: &[Vertex]) -> Stamp {
    run.stamp("tile", window, |builder| feed(builder, task, seeds))
}

/// Refines a tile. Seam points stand at the heights they were published with, whatever the DEM says today.
pub(crate) fn refine_now(window: &Window, task: &TileTask, seeds: &[Vertex]) -> TileTin {
    let level = geometry::widest_level();
    let differs = |seed: &Vertex| seed.at.post().is_some_and(|post| window.dem.height(post) != seed.height);
    if !seeds.iter().any(differs) {
        return tin::refine(&window.dem, &window.importance, task, level);
    }
    tin::refine(&with_heights(&window.dem, seeds), &window.importance, task, level)
}

fn with_heights(dem: &Dem, seeds: &[Vertex]) -> Dem {
    let mut at: Vec<(terrain::Post, i32)> =
        seeds.iter().filter_map(|seed| Some((seed.at.post()?, seed.height))).collect();
    at.sort_unstable();
    Dem::from_fn(dem.rect(), |post| match at.binary_search_by_key(&post, |&(post, _)| post) {
        Ok(found) => Some(at[found].1),
        Err(_) => Some(dem.height(post)),
    })
}

fn feed(builder: FingerprintBuilder, task: &TileTask, seeds: &[Vertex]) -> FingerprintBuilder {
    let mut builder = builder
        .text(&format!("{:?} {:?} {:?}", task.rule, task.stop, task.seams))
        .text(&format!("{:?}", task.frame))
        .text(&format!("{:?} {:?}", task.border, task.kept))
        .number(seeds.len() as u64);
    for seed in seeds {
        builder = builder.number(pack(seed.at.row, seed.at.col)).number(u64::from(seed.height as u32));
    }
    builder
}

fn pack(row: i32, col: i32) -> u64 {
    u64::from(row as u32) << 32 | u64::from(col as u32)
}
