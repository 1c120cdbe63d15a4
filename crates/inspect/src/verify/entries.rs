//! What `database.json` says of the database's files: names, tiles, states, the area. Looked at before any is opened.

use std::path::{Component, Path};

use job::{Edges, Job};
use store::{Manifest, TileRecord, TileState, files};
use terrain::TileId;

use build::database_area;
use build::ground::GamingArea;
use build::is_surveyed;

/// Names in the list of files that do not stay inside the folder: nothing of theirs is opened.
pub(crate) fn leading_out(manifest: &Manifest) -> Vec<String> {
    let is_inside = |name: &&String| {
        let mut parts = Path::new(name.as_str()).components();
        !name.is_empty() && !name.contains('\\') && parts.all(|part| matches!(part, Component::Normal(_)))
    };
    let outside = manifest.files.keys().filter(|name| !is_inside(name));
    outside.map(|name| format!("database.json: lists a file \"{name}\", which leads out of the folder")).collect()
}

/// What is wrong with the area, the list of tiles and the list of other files.
pub(crate) fn problems(manifest: &Manifest, job: &Job, area: &GamingArea) -> Vec<String> {
    let mut problems = Vec::new();
    if let Some((key, found, expected)) = manifest.area.difference(&database_area(job)) {
        problems.push(format!("database.json: its area says {key} {found}, its job {expected}"));
    }
    let listed: Vec<TileId> = manifest.tiles.iter().map(TileRecord::tile).collect();
    if listed != area.tiles {
        problems.push("database.json: its list of tiles is not that of its job".into());
    }
    let level = job.features.is_some().then_some(files::LEVEL);
    let has_buildings = job.features.as_ref().is_some_and(job::FeaturesSpec::has_buildings);
    let outlines = job.objects.is_some().then_some(files::OUTLINES);
    let needed: Vec<&str> = std::iter::once(files::ALLOCATION).chain(level).chain(outlines).collect();
    // A database that was built before buildings were kept has none.
    let is_of_job = |name: &str| needed.contains(&name) || (has_buildings && name == files::BUILDINGS);
    for name in manifest.files.keys().filter(|name| !is_of_job(name)) {
        problems.push(format!("database.json: lists a file \"{name}\", which no build of its job writes"));
    }
    for name in needed.into_iter().filter(|name| !manifest.files.contains_key(*name)) {
        problems.push(format!("database.json: does not list {name}"));
    }
    problems.extend(manifest.tiles.iter().flat_map(|record| of_tile(record, job)));
    problems
}

fn of_tile(record: &TileRecord, job: &Job) -> Vec<String> {
    let tile = record.tile();
    let mut problems = Vec::new();
    let mut tell = |what: String| problems.push(format!("database.json: tile {tile} {what}"));
    if matches!(record.state, TileState::Missing | TileState::Failed) {
        tell(format!("is listed as {}, in a database that is complete", state_word(record.state)));
    }
    let needed = [
        ("fingerprint", record.fingerprint.is_some(), true),
        ("file in tiles/", record.tin.is_some(), true),
        ("file in modules/", record.slm.is_some(), true),
        ("file in measured/", record.measured.is_some(), true),
        ("curve in survey/", record.curve.is_some(), is_surveyed(job)),
        ("profile of roads and water in survey/", record.profile.is_some(), job.features.is_some()),
        ("file of roads and water in survey/", record.lines.is_some(), job.features.is_some()),
    ];
    for (what, found, expected) in needed {
        match (found, expected) {
            (false, true) => tell(format!("has no {what}")),
            (true, false) => tell(format!("has a {what}, and its job needs none")),
            _ => {}
        }
    }
    if record.removed.is_some() && job.modules.edges == Edges::Constrained {
        tell("lists points taken out, and with constrained edges none are".into());
    }
    problems
}

/// A state as `database.json` writes it.
pub(crate) fn state_word(state: TileState) -> &'static str {
    match state {
        TileState::Done => "done",
        TileState::Frozen => "frozen",
        TileState::Failed => "failed",
        TileState::OverLimit => "over_limit",
        TileState::Missing => "missing",
    }
}
