//! One tile again: the same task, and what its changed border reaches.

use std::collections::BTreeSet;

use crate::ground::GroundError;
use job::{Edges, Job, deciding_lines};
use store::engine::{Artifact, Cause, Outcome};
use store::{Database, DatabaseError, Folder, Manifest, ManifestState, Report, TileRecord};
use terrain::{Post, SeamSides, Side, TileId, TileTin, Vertex};

use crate::assemble::{assemble, assemble_tile, read_assembled};
use crate::build::{decide_features, open};
use crate::curves::Curves;
use crate::enforce::enforce;
use crate::outlines::decide_objects;
use crate::publish::{beginning, prepare, publish};
use crate::refine::{Published, Refining};
use crate::report::Findings;
use crate::run::{ALGORITHM_REVISION, Options, Run};
use crate::sums::{Adding, Assembled, Sums};
use crate::survey::{Shares, allocate};
use crate::tasks::{inherited, is_surveyed, posts_of, seam_points, with_outer_sides};
use crate::{CompileError, Event, Progress, Stage, Stopwatch, keys};

/// A tile that was run again.
#[derive(Debug)]
pub struct Rebuilt {
    /// What was found in the whole area, as in a build.
    pub report: Report,
    /// Whether the tile's sides are held as its neighbours have them, until a full build.
    pub frozen: bool,
    /// The tiles that were refined, in rank order.
    pub rebuilt: Vec<TileId>,
    /// The database, still locked.
    pub database: Database,
}

/// Runs one tile of a finished database again, with the published allocation; with it others in which roads, rivers or
/// lakes have changed, since what crosses a side has to be the same in both tiles.
///
/// If its outgoing border comes out as published, only this tile changes. Otherwise its sides are frozen as the
/// neighbours have them, or, with `release_borders`, the tiles that the new border reaches are rebuilt too.
///
/// # Errors
/// As `build`; when there is no such tile, no finished database, or it was built from another job.
pub fn rebuild_tile(
    job: &Job,
    folder: impl Into<Folder>,
    tile: TileId,
    release_borders: bool,
    options: &Options,
    progress: &mut dyn Progress,
) -> Result<Rebuilt, CompileError> {
    let progress = &mut Stopwatch::start(options.clock, progress);
    // Nothing is created where there is nothing to go on from.
    let folder = &folder.into();
    folder.manifest()?;
    let mut run = open(job, folder, options, progress)?;
    let mut frozen = refuse_unfinished(&run, folder, tile)?;
    let is_outdated = is_outdated(&run);
    let mut tins = published_tins(&run)?;
    // What is decided of features and objects is published as it is found.
    run.database.begin(&beginning(&run))?;
    decide_features(&mut run, progress)?;
    decide_objects(&mut run, progress)?;
    let shares = published_shares(&run, progress)?;

    progress.tell(Event::Enter(Stage::Refine, 0));
    let others = with_other_features(&run, &shares, &tins, tile)?;
    if !others.is_empty() {
        let text = format!("roads, rivers or lakes changed in {} other tiles: these are run, too", others.len());
        progress.tell(Event::Note(text));
    }
    let reached = if release_borders || !others.is_empty() {
        let first = others.into_iter().chain([tile]).collect();
        cascade(&run, &shares, &mut tins, first, progress)?
    } else {
        rerun(&run, &shares, &mut tins, tile, progress)?
    };
    progress.tell(Event::Leave(Stage::Refine));
    for &(tile, is_frozen) in &reached {
        frozen.retain(|&other| other != tile);
        frozen.extend(is_frozen.then_some(tile));
    }

    let (mut assembled, mut sums) = match run.job.modules.edges {
        // Only what was refined again is published; the rest is read as it is.
        Edges::Constrained => reassemble(&run, &tins, &reached, progress)?,
        // The enforcer counts the whole area, from every point that was selected.
        Edges::Clip(_) => assemble(&run, &tins, progress)?,
    };
    let enforced = enforce(&run, &tins, &mut assembled, &mut sums, progress)?;
    let findings = Findings { run: &run, tins: &tins, assembled: &assembled, sums: &sums, enforced: &enforced };
    let mut ready = prepare(&findings, &shares, &frozen, progress)?;
    ready.report.outdated = is_outdated;
    let stale = stale(&run, &shares, &tins, &reached)?;
    let warning = match stale {
        0 => "what tiles share was decided before sources or program changed; a build decides it again".to_owned(),
        _ => format!("{stale} other tiles were made from other ground or borders; a build renews them"),
    };
    if 0 < stale || is_outdated {
        ready.report.warnings.push(warning);
    }
    drop((shares, tins, assembled, sums, enforced));
    let (report, database) = publish(run, ready, progress)?;
    let rebuilt = reached.iter().map(|&(tile, _)| tile).collect();
    Ok(Rebuilt { report, frozen: frozen.contains(&tile), rebuilt, database })
}

/// Assembles the tiles that were refined again and those in which features or objects are not what they were, as a
/// building on the line between two tiles that stands on the ground of both; reads the others as they are published.
fn reassemble(
    run: &Run,
    tins: &[Published],
    reached: &[(TileId, bool)],
    progress: &mut dyn Progress,
) -> Result<(Vec<Assembled>, Sums), CompileError> {
    let (none, adding) = (vec![Vec::new(); tins.len()], Adding::default());
    let done = run.for_each_tile(Stage::Assemble, progress, |tile| {
        let is_reached = reached.iter().any(|&(other, _)| other == tile);
        let kept = if is_reached { None } else { read_assembled(run, tins, &none, tile)? };
        let done = match kept {
            Some(read) => Outcome::Kept(read),
            None => assemble_tile(run, &|index| tins[index].stamp, &none, tile)?,
        };
        Ok(done.map(|(assembled, sums)| {
            adding.add(sums);
            assembled
        }))
    })?;
    Ok((done.into_iter().map(Outcome::into_inner).collect(), adding.finish()))
}

/// Tiles other than those of `reached` that a build would refine again: made from other ground than today's.
fn stale(run: &Run, shares: &Shares, tins: &[Published], reached: &[(TileId, bool)]) -> Result<usize, CompileError> {
    let mut count = 0;
    for (index, &tile) in run.area.tiles.iter().enumerate() {
        let stamp = as_built(run, shares, tins, tile)?.key().stamp(ALGORITHM_REVISION);
        let is_reached = reached.iter().any(|&(other, _)| other == tile);
        count += usize::from(!is_reached && stamp != tins[index].stamp);
    }
    Ok(count)
}

/// Whether no build has made the database from what there is now: then one may change tiles that this run does not.
fn is_outdated(run: &Run) -> bool {
    let is_of_now = |manifest: &Manifest| {
        manifest.state == ManifestState::Complete
            && manifest.algorithm_revision == ALGORITHM_REVISION
            && manifest.sources == run.records
    };
    let was_outdated = run.database.folder().report().map_or(true, |report| report.outdated);
    was_outdated || !run.previous.as_ref().is_some_and(is_of_now)
}

/// Tiles that are frozen already; a refusal when there is nothing whole to go on from.
fn refuse_unfinished(run: &Run, folder: &Folder, tile: TileId) -> Result<Vec<TileId>, CompileError> {
    let tiling = &run.area.tiling;
    if !tiling.contains(tile) {
        return Err(GroundError::Impossible {
            key: "ROW,COL".into(),
            found: format!("{},{}", tile.row, tile.col),
            expected: format!("a row below {} and a column below {}", tiling.rows(), tiling.cols()),
            hint: "rows count from the south, columns from the west, both from 0".into(),
        }
        .into());
    }
    let Some(manifest) = &run.previous else {
        let path = run.database.folder().path(store::files::DATABASE);
        return Err(DatabaseError::Missing { path }.into());
    };
    // A build that was stopped may have left tiles of two different grounds side by side.
    if manifest.state != ManifestState::Complete && !is_whole_but(run, manifest, tile) {
        return Err(DatabaseError::Unfinished { path: folder.dir().to_path_buf() }.into());
    }
    let job = run.job.canonical_text();
    if !deciding_lines(&manifest.job).eq(deciding_lines(&job)) {
        let difference = difference(&manifest.job, &job);
        return Err(CompileError::OtherJob { path: folder.dir().display().to_string(), difference });
    }
    let is_frozen = |record: &&store::TileRecord| record.state == store::TileState::Frozen;
    Ok(manifest.tiles.iter().filter(is_frozen).map(store::TileRecord::tile).collect())
}

/// The first line that only one of two jobs has, or that they have in different words.
fn difference(theirs: &str, ours: &str) -> String {
    let lines = |job| deciding_lines(job).collect::<Vec<&str>>();
    let (theirs, ours) = (lines(theirs), lines(ours));
    let [there, here] = [(&theirs, &ours), (&ours, &theirs)]
        .map(|(own, others)| own.iter().copied().find(|line| !others.contains(line)));
    let key = |line: &'_ str| line.split(" = ").next().map(str::to_owned);
    match (there, here) {
        (Some(there), Some(here)) if key(there) == key(here) => format!("`{there}` there, `{here}` here"),
        (Some(there), None) => format!("`{there}` there alone"),
        (_, Some(here)) => format!("`{here}` here alone"),
        (None, None) => "the same lines in another order".into(),
    }
}

/// Whether every tile but this one is as the last complete database had it: a re-run of this tile was broken off.
fn is_whole_but(run: &Run, manifest: &Manifest, tile: TileId) -> bool {
    let folder = run.database.folder();
    let is_whole = |record: &TileRecord| {
        let other = record.tile();
        let surveyed = is_surveyed(run.job).then_some((folder.curve_path(other), record.curve));
        let alone = (other != tile).then_some([
            (folder.tile_path(other), record.tin),
            (folder.modules_path(other), record.slm),
            (folder.measured_path(other), record.measured),
        ]);
        let files = surveyed.into_iter().chain(alone.into_iter().flatten());
        files.into_iter().all(|(path, stamp)| stamp.is_some_and(|stamp| folder.check_file(&path, &stamp).is_ok()))
    };
    // Clipped load modules reach into their neighbours' files, so nothing around the tile would be as it was.
    // Neither would they be where buildings stand on lines between tiles.
    run.job.modules.edges == Edges::Constrained && run.job.objects.is_none() && manifest.tiles.iter().all(is_whole)
}

/// The allocation the database was built with, from its published curves.
fn published_shares(run: &Run, progress: &mut dyn Progress) -> Result<Shares, CompileError> {
    if !is_surveyed(run.job) {
        return allocate(run, None, progress);
    }
    let curves = Curves::published(run, |tile| Ok(run.database.folder().read_curve(tile)?.1))?;
    allocate(run, Some(&curves), progress)
}

fn published_tins(run: &Run) -> Result<Vec<Published>, CompileError> {
    let folder = run.database.folder();
    let read = |&tile: &TileId| {
        let (stamp, tin) = folder.read_tile(tile)?;
        let record = run.previous.as_ref().and_then(|manifest| manifest.tile(tile));
        let made_from = record.and_then(|record| record.made_from.clone());
        Ok(Published::keep(run, tin, stamp, made_from))
    };
    run.area.tiles.iter().map(read).collect()
}

/// What a tile inherits from its lower-ranked neighbours as they are now.
fn seeds(run: &Run, tins: &[Published], tile: TileId) -> Result<Vec<Vertex>, CompileError> {
    let features = run.tile_features(tile)?;
    let published = |other| run.tin(other, &tins[run.area.tiling.index(other)].stamp);
    inherited(&run.area.tiling, tile, &features.kept, published)
}

/// The tile's TIN as a full build would refine it.
fn as_built<'a>(run: &'a Run, shares: &Shares, tins: &[Published], tile: TileId) -> Result<Refining<'a>, CompileError> {
    Refining::new(run, &shares.tiles[run.area.tiling.index(tile)], seeds(run, tins, tile)?, tile)
}

/// The same, with no more triangles than other tiles leave of the area's as they are now: where features have changed,
/// those took what a share of another budget was.
fn beside_others<'a>(
    run: &'a Run,
    shares: &Shares,
    tins: &[Published],
    tile: TileId,
) -> Result<Refining<'a>, CompileError> {
    let (budget, index) = (&run.area.budget, run.area.tiling.index(tile));
    let mut share = shares.tiles[index].clone();
    if let Some(allowance) = &mut share.allowance {
        let others = tins.iter().filter(|other| other.tile != tile).map(|other| u64::from(other.charged));
        let left = budget.area.saturating_sub(budget.start_total() + others.sum::<u64>());
        allowance.triangles = u64::from(allowance.triangles).min(left) as u32;
    }
    Refining::new(run, &share, seeds(run, tins, tile)?, tile)
}

/// Publishes a TIN in place of the one that was there.
fn publish_again(refining: &Refining, tin: TileTin) -> Result<Published, CompileError> {
    let key = refining.key();
    let published = refining.publish(tin, &key, &key.stamp(ALGORITHM_REVISION))?;
    Ok(Published { cause: Some(Cause::Other), ..published })
}

/// Runs `tile`, with its sides frozen if its border would change. Returns it, and whether it is frozen.
fn rerun(
    run: &Run,
    shares: &Shares,
    tins: &mut [Published],
    tile: TileId,
    progress: &mut dyn Progress,
) -> Result<Vec<(TileId, bool)>, CompileError> {
    progress.tell(Event::Started(Stage::Refine, tile));
    let index = run.area.tiling.index(tile);
    let mut refining = beside_others(run, shares, tins, tile)?;
    let mut tin = refining.refine();
    let before = outgoing(run, &*run.tin(tile, &tins[index].stamp)?)?;
    let is_frozen = outgoing(run, &tin)? != before;
    if is_frozen {
        freeze(run, &mut refining, before);
        tin = refining.refine();
    }
    tins[index] = publish_again(&refining, tin)?;
    progress.tell(Event::Done(Stage::Refine, tile));
    Ok(vec![(tile, is_frozen)])
}

/// Has every shared side of a tile held as it is published: with the border points `own`.
fn freeze(run: &Run, refining: &mut Refining, own: Vec<Vertex>) {
    let task = &mut refining.refinement.task;
    task.kept = posts_of(&own);
    task.kept.retain(|post| !task.inherited.contains(post));
    task.seams = with_outer_sides(run.job, &run.area, task.tile, SeamSides::CLOSED);
    if let Some(points) = &mut task.stop.points {
        // Seam points were selected once; load-module corners and regular border points among them never were.
        let side = run.area.grid.side_cells;
        let is_corner = |post: &Post| post.row % side == 0 && post.col % side == 0;
        let selected = task.kept.iter().filter(|post| !is_corner(post) && !task.border.contains(post)).count();
        *points = points.saturating_sub(selected);
    }
    refining.seeds.extend(own);
}

/// Tiles other than `tile` in which features are not what they were.
fn with_other_features(
    run: &Run,
    shares: &Shares,
    tins: &[Published],
    tile: TileId,
) -> Result<Vec<TileId>, CompileError> {
    let mut others = Vec::new();
    if run.job.features.is_none() {
        return Ok(others);
    }
    for (tin, &other) in tins.iter().zip(&run.area.tiles).filter(|&(_, &other)| other != tile) {
        let now = as_built(run, shares, tins, other)?.key().parts();
        let name = keys::FEATURES.name;
        if tin.made_from.as_ref().is_some_and(|before| before.get(name) != now.get(name)) {
            others.push(other);
        }
    }
    Ok(others)
}

/// Runs these tiles and every higher-ranked tile that a changed border reaches, in rank order.
fn cascade(
    run: &Run,
    shares: &Shares,
    tins: &mut [Published],
    first: Vec<TileId>,
    progress: &mut dyn Progress,
) -> Result<Vec<(TileId, bool)>, CompileError> {
    let tiling = &run.area.tiling;
    let mut waiting: BTreeSet<_> = first.into_iter().map(|tile| (tiling.rank(tile), tile)).collect();
    let mut reached = Vec::new();
    while let Some((_, tile)) = waiting.pop_first() {
        progress.tell(Event::Started(Stage::Refine, tile));
        let index = tiling.index(tile);
        let refining = beside_others(run, shares, tins, tile)?;
        let done = refining.refine();
        let before = run.tin(tile, &tins[index].stamp)?;
        let features = run.tile_features(tile)?;
        let points = |tin: &TileTin, side: Side| seam_points(tin, side, &features.kept);
        for side in Side::ALL {
            let Some(other) = tiling.beyond(tile, side).filter(|&other| tiling.rank(tile) < tiling.rank(other)) else {
                continue;
            };
            if points(&done, side) != points(&before, side) {
                waiting.insert((tiling.rank(other), other));
            }
        }
        tins[index] = publish_again(&refining, done)?;
        reached.push((tile, false));
        progress.tell(Event::Done(Stage::Refine, tile));
    }
    Ok(reached)
}

/// The border points a tile hands to its higher-ranked neighbours.
fn outgoing(run: &Run, tin: &TileTin) -> Result<Vec<Vertex>, CompileError> {
    let owned = run.area.tiling.owned_sides(tin.tile);
    let sides = Side::ALL.into_iter().filter(|&side| owned.is_open(side));
    let features = run.tile_features(tin.tile)?;
    let mut all: Vec<Vertex> = sides.flat_map(|side| seam_points(tin, side, &features.kept)).collect();
    all.sort_unstable();
    all.dedup();
    Ok(all)
}
