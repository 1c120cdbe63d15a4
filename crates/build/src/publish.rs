//! The manifest before anything changes; and the last stage: breaches, the report, its page, and the manifest when
//! everything is there.

use std::collections::BTreeMap;

use crate::product::{Made, Opened, Product, Told, Wanted, WantedGround};
use job::Job;
use serde_json::{Value, json};
use store::{
    Area, Database, FileStamp, Manifest, ManifestState, Removals, Report, SourceRecord, TileRecord, TileState, files,
};
use terrain::{LatticePoint, TileId};

use crate::assemble::crs;
use crate::forecast::{PAGE_MODULES_MAX, PAGE_POSTS_MAX};
use crate::ground::Ground;
use crate::level::stamp_of_buildings;
use crate::outlines::objects_report;
use crate::refine::Published;
use crate::report::Findings;
use crate::run::{ALGORITHM_REVISION, Run, changed, run_name};
use crate::sums::Assembled;
use crate::survey::Shares;
use crate::tasks::is_surveyed;
use crate::{CompileError, Event, Progress, Stage, Stopwatch};

/// The area as the database knows it.
pub fn database_area(job: &Job) -> Area {
    let grid = job.area.grid;
    Area {
        name: job.area.name.clone(),
        crs: crs(job),
        vertical_datum: job.dem.vertical_datum.clone().unwrap_or_default(),
        origin_m: job.area.origin_m,
        size_m: job.area.size_m(),
        spacing_m: job.area.spacing.metres(),
        module_side_m: job.modules.side_m,
        module_rows: grid.rows,
        module_cols: grid.cols,
        tile_rows: job.tiles.rows,
        tile_cols: job.tiles.columns,
    }
}

/// A manifest of a run that has not published anything yet.
pub(crate) fn beginning(run: &Run) -> Manifest {
    beginning_of(run.job, &run.records, run.previous.as_ref())
}

/// The same of any build of `job` from these sources.
pub(crate) fn beginning_of(job: &Job, records: &[SourceRecord], previous: Option<&Manifest>) -> Manifest {
    let mut manifest = Manifest::new(database_area(job), job.canonical_text(), ALGORITHM_REVISION);
    manifest.sources = records.to_vec();
    // What was there before, by its bytes: while the build is under way, these files are not its own yet.
    if let Some(previous) = previous {
        manifest.tiles.clone_from(&previous.tiles);
    }
    manifest
}

/// What the last stage publishes.
pub(crate) struct Ready {
    pub report: Report,
    manifest: Manifest,
    /// What is told of features, in jobs with some.
    told: Option<Told>,
}

/// Begins the last stage: puts together what is to be published, of which little is on the disk yet. `frozen` lists
/// tiles whose sides are held as their neighbours have them.
pub(crate) fn prepare(
    findings: &Findings,
    shares: &Shares,
    frozen: &[TileId],
    progress: &mut dyn Progress,
) -> Result<Ready, CompileError> {
    progress.tell(Event::Enter(Stage::Publish, 0));
    let run = findings.run;
    let mut report = findings.report()?;
    let told = findings.told();
    report.features = told.as_ref().map(|told| told.report.clone());
    report.objects = run.outlines.as_ref().map(|(_, outlines)| objects_report(run, outlines));
    let posts: Vec<u64> = report.classes.iter().map(|class| class.posts).collect();
    report.warnings.extend(crate::ground::idle_areas(run.job, &run.area, &posts, (&run.workers, run.stop))?);
    let features = run.level.as_ref().map(|settled| (run.job, &settled.level));
    report.warnings.extend(crate::product::warnings(&Made { report: &report, features }));
    let mut manifest = beginning(run);
    manifest.state = ManifestState::Complete;
    let allocation = run.database.write_json(files::ALLOCATION, &allocation_json(run, shares))?;
    manifest.files.insert(files::ALLOCATION.to_owned(), allocation);
    if let Some(buildings) = stamp_of_buildings(run)? {
        manifest.files.insert(files::BUILDINGS.to_owned(), buildings);
    }
    match &run.outlines {
        Some((file, _)) => drop(manifest.files.insert(files::OUTLINES.to_owned(), *file)),
        // That of an earlier job.
        None => run.database.remove(files::OUTLINES)?,
    }
    for (index, &tile) in run.area.tiles.iter().enumerate() {
        let state = state_of(run, &report, tile, frozen.contains(&tile));
        fill(run, &mut manifest, tile, state, &findings.tins[index], &findings.assembled[index])?;
        let removed = publish_removals(run, tile, &findings.tins[index], &findings.enforced.removed[index])?;
        manifest.tile_mut(tile).expect("the manifest lists every tile").removed = removed;
    }
    manifest.totals = findings.totals(&report);
    Ok(Ready { report, manifest, told })
}

/// Ends the last stage. What a run leaves is written in this order, so that a database is complete only with all of it:
/// what the report lists (breaches, features, objects, the page), the report, the manifest.
pub(crate) fn publish(run: Run, ready: Ready, progress: &mut Stopwatch) -> Result<(Report, Database), CompileError> {
    let Ready { mut report, manifest, told } = ready;
    let work = run.database.folder().work(&run_name(&manifest.job, &run.records, ALGORITHM_REVISION));
    drop(run.tins);
    let mut ground = run.ground;
    ground.forget_natural();
    let (job, database, outlines) = (run.job, run.database, run.outlines);
    let level = run.level.map(|settled| settled.level);

    // The last moment: from here on everything says that it was made from these files.
    changed(&run.states)?;
    (report.stages, report.tiles) = progress.times();
    let mut beside = BTreeMap::new();
    let mut write = |name: &str, bytes: &[u8]| -> Result<(), CompileError> {
        beside.insert(name.to_owned(), database.write_bytes(name, bytes)?);
        Ok(())
    };
    for (name, text) in crate::product::breaches(job, &report) {
        write(name, text.as_bytes())?;
    }
    if let Some((told, level)) = told.zip(level) {
        let (name, text) = crate::product::features_file(job, &told.remarks);
        write(name, text.as_bytes())?;
        write(files::FEATURES_GPKG, &crate::product::features_package(job, &level, &told.remarks)?)?;
    }
    if let Some((_, outlines)) = outlines {
        let (name, text) = crate::product::objects_file(job, &outlines);
        write(name, text.as_bytes())?;
    }
    if run.page {
        progress.tell(Event::Enter(Stage::Page, 0));
        let opened = Opened::of(database.folder().clone(), manifest.clone())?;
        write(files::REPORT_HTML, draw(&opened, &ground, &report, run.workers.count())?.as_bytes())?;
        progress.tell(Event::Leave(Stage::Page));
    }
    report.files = beside;
    database.write_report(&mut report, &manifest)?;
    database.finish(&manifest)?;
    progress.tell(Event::Leave(Stage::Publish));
    work.sweep();
    // What came after the report was written is known now.
    (report.stages, report.tiles) = progress.times();
    Ok((report, database))
}

/// The page: with the ground as long as the area has no more than [`PAGE_POSTS_MAX`] posts (16 bytes each while it is
/// drawn), with maps as long as it has no more than [`PAGE_MODULES_MAX`] load modules (a kilobyte each). Later one can
/// ask for them.
fn draw(opened: &Opened, ground: &Ground, report: &Report, workers: usize) -> Result<String, CompileError> {
    let grid = opened.area.grid;
    if PAGE_MODULES_MAX < grid.count() {
        return Ok(crate::product::page_without_maps(opened, report));
    }
    let read = |ground| Product::of(opened, &Wanted { part: None, ground, workers });
    let is_small = grid.area().post_count() <= PAGE_POSTS_MAX;
    let ground = if is_small { WantedGround::Open(ground) } else { WantedGround::None };
    // A source may have gone meanwhile, and nothing else needs it any more.
    let product = read(ground).or_else(|_| read(WantedGround::None))?;
    Ok(crate::product::page(&product, report, workers))
}

fn state_of(run: &Run, report: &Report, tile: TileId, is_frozen: bool) -> TileState {
    let modules = run.area.tiling.modules(tile, run.area.grid);
    let is_over = report.breaches.iter().any(|breach| match breach.place {
        store::ReportPlace::Module([row, col]) => modules.contains(terrain::ModuleId { row, col }),
        _ => false,
    });
    match (is_frozen, is_over) {
        (true, _) => TileState::Frozen,
        (false, true) => TileState::OverLimit,
        (false, false) => TileState::Done,
    }
}

fn fill(
    run: &Run,
    manifest: &mut Manifest,
    tile: TileId,
    state: TileState,
    tin: &Published,
    assembled: &Assembled,
) -> Result<(), CompileError> {
    let folder = run.database.folder();
    let has_curve = is_surveyed(run.job);
    if !has_curve {
        run.database.remove(&format!("survey/{tile}.curve"))?;
    }
    let record = manifest.tile_mut(tile).expect("the manifest lists every tile");
    // Nothing that the build before it said of the tile holds any more.
    *record = TileRecord::missing(tile);
    record.state = state;
    record.fingerprint = Some(tin.stamp.fingerprint);
    record.made_from.clone_from(&tin.made_from);
    record.measured = Some(assembled.measured);
    record.tin = Some(folder.stamp_file(&folder.tile_path(tile))?);
    record.slm = Some(assembled.file);
    record.curve = if has_curve { Some(folder.stamp_file(&folder.curve_path(tile))?) } else { None };
    fill_features(run, manifest, tile)
}

/// What features put into a tile, and the ground along them; nothing of an earlier job is left where there are none.
fn fill_features(run: &Run, manifest: &mut Manifest, tile: TileId) -> Result<(), CompileError> {
    let folder = run.database.folder();
    let Some(settled) = &run.level else {
        run.database.remove(&format!("survey/{tile}.profile"))?;
        run.database.remove(&format!("survey/{tile}.lines"))?;
        return Ok(run.database.remove(files::LEVEL)?);
    };
    let record = manifest.tile_mut(tile).expect("the manifest lists every tile");
    record.profile = Some(folder.stamp_file(&folder.profile_path(tile))?);
    record.lines = Some(settled.level.tiles[run.area.tiling.index(tile)]);
    manifest.files.insert(files::LEVEL.to_owned(), settled.file);
    Ok(())
}

/// The list of points that enforcing took out of a tile, beside the tile's own file, which is never edited.
fn publish_removals(
    run: &Run,
    tile: TileId,
    tin: &Published,
    removed: &[LatticePoint],
) -> Result<Option<FileStamp>, CompileError> {
    if removed.is_empty() {
        run.database.remove(&format!("tiles/{tile}.removed"))?;
        return Ok(None);
    }
    let removals = Removals { tile, points: removed.to_vec() };
    Ok(Some(run.database.write_removals(&tin.stamp, &removals)?))
}

/// Numbers per tile, and per load module the exceptions only.
fn allocation_json(run: &Run, shares: &Shares) -> Value {
    let tiles: Vec<Value> = run
        .area
        .tiles
        .iter()
        .zip(&shares.tiles)
        .map(|(tile, budget)| {
            json!({
                "row": tile.row,
                "col": tile.col,
                "points": budget.points,
                "triangles": budget.allowance.as_ref().map(|allowance| allowance.triangles),
            })
        })
        .collect();
    let granted: Vec<Value> = shares.granted.iter().map(granted).collect();
    json!({
        "threshold_bin": shares.threshold_bin,
        "slack": shares.slack,
        "granted": granted,
        "tiles": tiles,
    })
}

fn granted((module, triangles): &(terrain::ModuleId, u32)) -> Value {
    json!({ "row": module.row, "col": module.col, "triangles": triangles })
}
