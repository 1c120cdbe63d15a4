//! The order of the stages as processes share them out: which units of work there are, and what each needs done.
//!
//! ```text
//!   profile r02c03 ─► level ─┐    (with roads, rivers or lakes)
//!   survey r02c03 ◄──────────┘
//!   outlines ─► assemble r02c03              (with buildings, walls or woods; where they count in the limits of the
//!                                             ground, level ─► outlines ─► survey r02c03)
//!   survey r02c03 ─► allocate ─► refine r02c03 (after its lower-ranked neighbours) ─► assemble r02c03 ─► publish
//! ```

use std::fmt;

use crate::ground::GamingArea;
use job::{Edges, Job};
use terrain::TileId;

use crate::Stage;
use crate::tasks::is_surveyed;

/// The stages that are shared out, each after the ones before it.
pub const ORDER: [Stage; 8] = [
    Stage::Profile,
    Stage::Level,
    Stage::Outlines,
    Stage::Survey,
    Stage::Allocate,
    Stage::Refine,
    Stage::Assemble,
    Stage::Publish,
];

/// One unit of work: a stage of one tile, or of the whole area.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Unit {
    /// The stage.
    pub stage: Stage,
    /// The tile, of a stage that goes by tiles.
    pub tile: Option<TileId>,
}

impl Unit {
    /// A stage of one tile.
    pub const fn of(stage: Stage, tile: TileId) -> Self {
        Self { stage, tile: Some(tile) }
    }

    /// A stage of the whole area.
    pub const fn whole(stage: Stage) -> Self {
        Self { stage, tile: None }
    }
}

impl fmt::Display for Unit {
    /// As marks and leases are named.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.stage.name())?;
        self.tile.map_or(Ok(()), |tile| write!(f, "-{tile}"))
    }
}

/// Whether a stage goes by tiles.
pub const fn is_of_tiles(stage: Stage) -> bool {
    matches!(stage, Stage::Profile | Stage::Survey | Stage::Refine | Stage::Assemble | Stage::Enforce)
}

/// Every unit of a stage, in an order in which one process could do them.
pub fn units(stage: Stage, job: &Job, area: &GamingArea) -> Vec<Unit> {
    let of = |&tile: &TileId| Unit::of(stage, tile);
    match stage {
        Stage::Profile | Stage::Level if job.features.is_none() => Vec::new(),
        Stage::Outlines if job.objects.is_none() => Vec::new(),
        Stage::Survey if !is_surveyed(job) => Vec::new(),
        Stage::Refine => area.by_rank().into_iter().map(|index| of(&area.tiles[index])).collect(),
        _ if is_of_tiles(stage) => area.tiles.iter().map(of).collect(),
        _ => vec![Unit::whole(stage)],
    }
}

/// The units that one needs done.
pub fn needs(unit: Unit, job: &Job, area: &GamingArea) -> Vec<Unit> {
    let all = |stage| units(stage, job, area);
    // Features are part of the ground of every later stage, so each of them waits where that has to be decided again.
    let is_joint = job.counts_objects();
    let settled = || all(Stage::Level).into_iter().chain(if is_joint { all(Stage::Outlines) } else { Vec::new() });
    let and_settled = |needs: Vec<Unit>| settled().chain(needs).collect();
    match (unit.stage, unit.tile) {
        (Stage::Level, _) => all(Stage::Profile),
        (Stage::Outlines, _) if is_joint => all(Stage::Level),
        (Stage::Survey, _) => settled().collect(),
        (Stage::Allocate, _) => and_settled(all(Stage::Survey)),
        (Stage::Refine, Some(tile)) => {
            let lower = |other: &TileId| area.tiling.rank(*other) < area.tiling.rank(tile);
            let neighbours = area.tiling.neighbours(tile).into_iter().filter(lower);
            let inherited = neighbours.map(|other| Unit::of(Stage::Refine, other));
            and_settled(all(Stage::Allocate).into_iter().chain(inherited).collect())
        }
        (Stage::Assemble, Some(tile)) => {
            let tins = around(tile, job, area).into_iter().map(|other| Unit::of(Stage::Refine, other));
            all(Stage::Level).into_iter().chain(all(Stage::Outlines)).chain(tins).collect()
        }
        (Stage::Publish, _) => all(Stage::Assemble),
        _ => Vec::new(),
    }
}

/// The tiles whose TINs the load modules of one are made from, or may be: a building on the line between two tiles has
/// one roof.
pub(crate) fn around(tile: TileId, job: &Job, area: &GamingArea) -> Vec<TileId> {
    let mut around = match job.modules.edges {
        Edges::Constrained if job.objects.is_none() => Vec::new(),
        Edges::Constrained | Edges::Clip(_) => area.tiling.neighbours(tile),
    };
    around.push(tile);
    around
}
