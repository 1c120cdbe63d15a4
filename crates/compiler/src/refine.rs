//! Refinement of every tile in rank order, each seeded by the published borders of its lower-ranked neighbours.

use std::sync::{Arc, OnceLock};

use database::{FingerprintBuilder, MadeFrom, Stamp};
use ground::Window;
use terrain::{ModuleId, StopReason, TileId, TileTin, Vertex};

use crate::cause::{Cause, cause, made_from, summary};
use crate::refinement::Refinement;
use crate::refused::{RefusedPosts, by_module};
use crate::run::{Run, Worked};
use crate::survey::Shares;
use crate::tasks::{TileBudget, inherited, posts_of, tile_refinement};
use crate::{CompileError, Event, Progress, Stage};

/// What a tile's published TIN was made from, and what the report says of it. The TIN itself is asked of the run.
#[derive(Clone)]
pub(crate) struct Published {
    pub tile: TileId,
    pub stamp: Stamp,
    /// Why selection ended.
    pub stop: StopReason,
    /// What limits kept out, by load module, in ascending order.
    pub refused: Vec<(ModuleId, RefusedPosts)>,
    /// The same by parts; unknown where an earlier build did not say.
    pub made_from: Option<MadeFrom>,
    /// Why this run made it, if it did.
    pub cause: Option<Cause>,
}

impl Published {
    /// Of a TIN that is published with this stamp.
    pub fn new(tin: &TileTin, stamp: Stamp, made_from: Option<MadeFrom>, cause: Option<Cause>) -> Self {
        let (tile, stop, refused) = (tin.tile, tin.stop, by_module(&tin.refused));
        Self { tile, stamp, stop, refused, made_from, cause }
    }
}

/// Refines every tile, or keeps what is published and fresh.
pub(crate) fn refine(run: &Run, shares: &Shares, progress: &mut dyn Progress) -> Result<Vec<Published>, CompileError> {
    let slots: Vec<OnceLock<Published>> = run.area.tiles.iter().map(|_| OnceLock::new()).collect();
    run.in_rank_order(Stage::Refine, progress, |tile| {
        let published = |other: TileId| {
            let slot = slots[run.area.tiling.index(other)].get();
            run.tin(other, &slot.expect("lower-ranked neighbours are published first").stamp)
        };
        let index = run.area.tiling.index(tile);
        let done = refine_tile(run, &shares.tiles[index], &inherited(&run.area.tiling, tile, published)?, tile)?;
        let cause = done.cause.clone();
        assert!(slots[index].set(done).is_ok(), "each tile is refined once");
        Ok(match cause {
            None => Worked::Kept(()),
            Some(Cause::New) => Worked::Made((), None),
            Some(cause) => Worked::Made((), Some(cause.to_string())),
        })
    })?;
    let tins = slots.into_iter().map(|slot| slot.into_inner().expect("every tile was refined"));
    let tins: Vec<Published> = tins.collect();
    let causes: Vec<(TileId, Cause)> =
        tins.iter().filter_map(|published| Some((published.tile, published.cause.clone()?))).collect();
    if let Some(text) = summary(tins.len(), &causes) {
        progress.tell(Event::Note(text));
    }
    Ok(tins)
}

/// Refines a tile that inherits `seeds`, or keeps what is published and fresh.
pub(crate) fn refine_tile(
    run: &Run,
    budget: &TileBudget,
    seeds: &[Vertex],
    tile: TileId,
) -> Result<Published, CompileError> {
    let refinement = tile_refinement(run.job, &run.area, tile, budget, posts_of(seeds));
    let window = run.window(tile)?;
    refine_or_keep(run, &window, &refinement, seeds)
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
    let parts = made_from(window, refinement, |builder| feed_seeds(builder, seeds));
    let folder = run.database.folder();
    let published = folder.tile_stamp(tile);
    if matches!(published, Ok(Some(found)) if found == stamp)
        && let Ok((_, tin)) = folder.read_tile(tile)
    {
        return Ok(keep(run, tin, stamp, Some(parts), None));
    }
    let cause = cause(run, tile, &published, &stamp, &parts);
    let tin = refinement.run(window, seeds);
    run.database.write_tile(&stamp, &tin)?;
    Ok(keep(run, tin, stamp, Some(parts), Some(cause)))
}

/// A TIN that is published with this stamp, kept for whoever asks for it next.
pub(crate) fn keep(
    run: &Run,
    tin: TileTin,
    stamp: Stamp,
    made_from: Option<MadeFrom>,
    cause: Option<Cause>,
) -> Published {
    let published = Published::new(&tin, stamp, made_from, cause);
    run.tins.keep(stamp, Arc::new(tin));
    published
}

/// What a tile's TIN is made from.
pub(crate) fn tile_stamp(run: &Run, window: &Window, refinement: &Refinement, seeds: &[Vertex]) -> Stamp {
    run.stamp("tile", window, |builder| feed(builder, refinement, seeds))
}

fn feed(builder: FingerprintBuilder, refinement: &Refinement, seeds: &[Vertex]) -> FingerprintBuilder {
    let task = &refinement.task;
    let builder = builder
        .text(&format!("{:?} {:?} {:?} {:?}", task.rule, task.stop, task.seams, refinement.optimising))
        .text(&format!("{:?}", task.frame))
        .text(&format!("{:?} {:?}", task.border, task.kept));
    feed_seeds(builder, seeds)
}

/// The border points that a tile inherits or keeps.
pub(crate) fn feed_seeds(builder: FingerprintBuilder, seeds: &[Vertex]) -> FingerprintBuilder {
    let mut builder = builder.number(seeds.len() as u64);
    for seed in seeds {
        builder = builder.number(pack(seed.at.row, seed.at.col)).number(u64::from(seed.height as u32));
    }
    builder
}

fn pack(row: i32, col: i32) -> u64 {
    u64::from(row as u32) << 32 | u64::from(col as u32)
}
