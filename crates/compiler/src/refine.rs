//! Refinement of every tile in rank order, each seeded by the published borders of its lower-ranked neighbours.

use std::sync::{Arc, OnceLock};

use database::{FingerprintBuilder, Stamp};
use terrain::{TileId, TileTin, Vertex};

use crate::ground::Window;
use crate::refinement::Refinement;
use crate::run::{Run, Worked};
use crate::survey::Shares;
use crate::tasks::{inherited, posts_of, tile_refinement};
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
        let refinement = tile_refinement(run.job, &run.area, tile, &shares.tiles[index], posts_of(&seeds));
        let window = run.window(tile)?;
        let done = refine_or_keep(run, &window, &refinement, &seeds)?;
        let kept = !done.is_new;
        assert!(slots[index].set(done).is_ok(), "each tile is refined once");
        Ok(if kept { Worked::Kept(()) } else { Worked::Made(()) })
    })?;
    Ok(slots.into_iter().map(|slot| slot.into_inner().expect("every tile was refined")).collect())
}

/// Keeps a tile that was made from the same inputs, and refines any other.
fn refine_or_keep(
    run: &Run,
    window: &Window,
    refinement: &Refinement,
    seeds: &[Vertex],
) -> Result<Published, CompileError> {
    let stamp = tile_stamp(run, window, refinement, seeds);
    let tile = refinement.task.tile;
    let folder = run.database.folder();
    if folder.tile_stamp(tile).ok().flatten() == Some(stamp)
        && let Ok((_, tin)) = folder.read_tile(tile)
    {
        return Ok(Published { tin: Arc::new(tin), stamp, is_new: false });
    }
    let tin = refinement.run(window, seeds);
    run.database.write_tile(&stamp, &tin)?;
    Ok(Published { tin: Arc::new(tin), stamp, is_new: true })
}

/// What a tile's TIN is made from.
pub(crate) fn tile_stamp(run: &Run, window: &Window, refinement: &Refinement, seeds: &[Vertex]) -> Stamp {
    run.stamp("tile", window, |builder| feed(builder, refinement, seeds))
}

fn feed(builder: FingerprintBuilder, refinement: &Refinement, seeds: &[Vertex]) -> FingerprintBuilder {
    let task = &refinement.task;
    let mut builder = builder
        .text(&format!("{:?} {:?} {:?} {:?}", task.rule, task.stop, task.seams, refinement.optimising))
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
