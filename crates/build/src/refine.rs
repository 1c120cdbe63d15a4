//! Refinement of every tile in rank order, each seeded by the published borders of its lower-ranked neighbours.

use std::sync::{Arc, OnceLock};

use store::engine::{Artifact, Before, Cause, Key, Outcome, Parts, Stamp, keep_or_make};
use store::{TileBudget, TileRecord, TileState};
use terrain::{ModuleId, StopReason, TileId, TileTin, Vertex};

use crate::ground::{Sight, Surroundings, Window, scanned};
use crate::refinement::Refinement;
use crate::run::{ALGORITHM_REVISION, Run};
use crate::sums::{RefusedPosts, by_module};
use crate::survey::Shares;
use crate::tasks::{inherited, posts_of, tile_refinement};
use crate::{CompileError, Event, Progress, Stage, keys};

/// What a tile's published TIN was made from, and what the report says of it. The TIN itself is asked of the run.
#[derive(Clone)]
pub(crate) struct Published {
    pub tile: TileId,
    pub stamp: Stamp,
    /// Why selection ended.
    pub stop: StopReason,
    /// Triangles that its own points cost.
    pub charged: u32,
    /// What limits kept out, by load module, in ascending order.
    pub refused: Vec<(ModuleId, RefusedPosts)>,
    /// The same by parts; unknown where an earlier build did not say.
    pub made_from: Option<Parts>,
    /// Why this run made it, if it did.
    pub cause: Option<Cause>,
}

impl Published {
    /// Of a TIN that is published with this stamp, kept for the next that asks for it.
    pub fn keep(run: &Run, tin: TileTin, stamp: Stamp, made_from: Option<Parts>) -> Self {
        let (tile, stop, refused) = (tin.tile, tin.stop, by_module(&tin.refused));
        let charged = tin.triangles_charged;
        run.tins.keep(stamp, Arc::new(tin));
        Self { tile, stamp, stop, charged, refused, made_from, cause: None }
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
        let features = run.tile_features(tile)?;
        let seeds = inherited(&run.area.tiling, tile, &features.kept, published)?;
        let done = refine_tile(run, &shares.tiles[index], seeds, tile)?;
        Ok(done.map(|done| assert!(slots[index].set(done).is_ok(), "each tile is refined once")))
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
    seeds: Vec<Vertex>,
    tile: TileId,
) -> Result<Outcome<Published>, CompileError> {
    let done = keep_or_make(&Refining::new(run, budget, seeds, tile)?, ALGORITHM_REVISION)?;
    Ok(match done {
        Outcome::Kept(tin) => Outcome::Kept(tin),
        Outcome::Made(tin, cause) => Outcome::Made(Published { cause: Some(cause.clone()), ..tin }, cause),
    })
}

/// A tile's TIN, as the engine asks for it.
pub(crate) struct Refining<'a> {
    run: &'a Run<'a>,
    window: Arc<Window>,
    pub refinement: Refinement,
    /// Whose lines of sight count, and the ground they run over, where they do.
    sight: Option<(Sight, Surroundings)>,
    /// The border points that it inherits or keeps.
    pub seeds: Vec<Vertex>,
}

impl<'a> Refining<'a> {
    /// As a build refines it.
    pub fn new(run: &'a Run, budget: &TileBudget, seeds: Vec<Vertex>, tile: TileId) -> Result<Self, CompileError> {
        let features = run.tile_features(tile)?;
        let refinement = tile_refinement(run.job, &run.area, tile, budget, posts_of(&seeds), &features);
        let metres_per_post = run.area.frame.spacing.metres();
        let sight = refinement.optimising.and_then(|optimising| optimising.sight);
        let within = |sight| -> Result<(Sight, Surroundings), CompileError> {
            let sight = scanned(sight, metres_per_post);
            Ok((sight, run.ground.within_sight(&run.area, tile, &sight)?))
        };
        let sight = sight.map(within).transpose()?;
        Ok(Self { run, window: run.window(tile)?, refinement, sight, seeds })
    }

    fn tile(&self) -> TileId {
        self.refinement.task.tile
    }

    /// The TIN.
    pub fn refine(&self) -> TileTin {
        let for_sight = |(sight, around): &(Sight, Surroundings)| sight.weigh(&self.window.importance, around);
        let in_squares = self.sight.as_ref().map(for_sight);
        self.refinement.run(&self.window, in_squares.as_ref(), &self.seeds)
    }

    /// Publishes it.
    pub fn publish(&self, tin: TileTin, key: &Key, stamp: &Stamp) -> Result<Published, CompileError> {
        self.run.database.write_tile(stamp, &tin)?;
        Ok(Published::keep(self.run, tin, *stamp, Some(key.parts())))
    }
}

impl Artifact for Refining<'_> {
    type Output = Published;
    type Error = CompileError;

    fn key(&self) -> Key {
        keys::tin(&self.window, &self.refinement, self.sight.as_ref().map(|(_, around)| around), &self.seeds)
    }

    fn published(&self) -> Result<Option<Stamp>, CompileError> {
        Ok(self.run.database.folder().tile_stamp(self.tile())?)
    }

    fn read(&self, key: &Key) -> Option<(Stamp, Published)> {
        let (stamp, tin) = self.run.database.folder().read_tile(self.tile()).ok()?;
        Some((stamp, Published::keep(self.run, tin, stamp, Some(key.parts()))))
    }

    fn before(&self, found: &Stamp) -> Before {
        let record = self.run.previous.as_ref().and_then(|manifest| manifest.tile(self.tile()));
        match record.filter(|record| record.fingerprint == Some(found.fingerprint)) {
            Some(TileRecord { state: TileState::Frozen, .. }) => Before::Provisional(FROZEN),
            Some(TileRecord { made_from: Some(parts), .. }) => Before::Parts(parts.clone()),
            _ => Before::Unknown,
        }
    }

    fn make(&self, key: &Key, stamp: &Stamp) -> Result<Published, CompileError> {
        self.publish(self.refine(), key, stamp)
    }
}

/// Said of a tile whose sides were held as its neighbours had them.
const FROZEN: &str = "it was frozen";

/// The tiles that were refined again in one sentence, grouped by cause; nothing where none was there before.
fn summary(tiles: usize, causes: &[(TileId, Cause)]) -> Option<String> {
    /// Tiles that are named for one cause.
    const NAMED_MAX: usize = 12;
    let again: Vec<&(TileId, Cause)> = causes.iter().filter(|(_, cause)| *cause != Cause::New).collect();
    if again.is_empty() {
        return None;
    }
    let mut groups: Vec<(String, Vec<TileId>)> = Vec::new();
    for (tile, cause) in &again {
        let words = cause.to_string();
        match groups.iter_mut().find(|(known, _)| *known == words) {
            Some((_, members)) => members.push(*tile),
            None => groups.push((words, vec![*tile])),
        }
    }
    let sentence = |(words, members): &(String, Vec<TileId>)| {
        let names: Vec<String> = members.iter().take(NAMED_MAX).map(TileId::to_string).collect();
        let more = members.len().saturating_sub(NAMED_MAX);
        let more = if more == 0 { String::new() } else { format!(" and {more} more") };
        format!("{words}: {}{more}", names.join(" "))
    };
    let groups: Vec<String> = groups.iter().map(sentence).collect();
    Some(format!("{} of {tiles} tiles are refined again; {}", again.len(), groups.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_told_by_what_reached_them() {
        let tile = |col| TileId { row: 0, col };
        let border = || Cause::Changed(vec!["a neighbour's border changed"]);
        let causes =
            [(tile(0), Cause::New), (tile(1), border()), (tile(2), Cause::Provisional(FROZEN)), (tile(3), border())];
        let text = summary(4, &causes).unwrap_or_default();
        let expected =
            "3 of 4 tiles are refined again; a neighbour's border changed: r00c01 r00c03; it was frozen: r00c02";
        assert_eq!(text, expected);
        assert_eq!(summary(4, &causes[..1]), None);
    }
}
