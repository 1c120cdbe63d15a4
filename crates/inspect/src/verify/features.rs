//! Roads and water: the files of the stages that decide them, lakes in the load modules, what the report says.

use std::collections::HashSet;

use database::{AreaLevel, Folder, Manifest, Report, ReportFeatures};
use fidelity::{Bodies, missing_edges};
use ground::GamingArea;
use job::Job;
use product::{Opened, read_told};
use terrain::{LatticePoint, LoadModule, TileFeatures, TileId};

use super::modules::Modules;
use compiler::CompileError;

/// What is wrong with the features of a database whose files are whole; nothing of a job without any.
///
/// # Errors
/// When a file cannot be read that was sound a moment ago.
pub(crate) fn check(
    folder: &Folder,
    manifest: &Manifest,
    job: &Job,
    area: &GamingArea,
    modules: &Modules,
    report: Option<&Report>,
) -> Result<Vec<String>, CompileError> {
    let listed = report.and_then(|report| report.features.as_ref());
    if job.features.is_none() {
        let told = listed.map(|_| "report.json: tells of roads and water, and its job has none".to_owned());
        return Ok(told.into_iter().collect());
    }
    let (.., level) = folder.read_level()?;
    let mut problems = Vec::new();
    for (index, &tile) in area.tiles.iter().enumerate() {
        problems.extend(of_tile(folder, area, modules, &level, (index, tile))?);
    }
    let opened = Opened::of(folder.clone(), manifest.clone())?;
    if let (Some(report), Some((_, told)), true) = (report, read_told(&opened)?, problems.is_empty()) {
        problems.extend(differing(report.features.as_ref(), &told.report));
    }
    Ok(problems)
}

/// A tile's file against the one of the area, its edges against its TIN, its lakes against its load modules.
fn of_tile(
    folder: &Folder,
    area: &GamingArea,
    modules: &Modules,
    level: &AreaLevel,
    (index, tile): (usize, TileId),
) -> Result<Vec<String>, CompileError> {
    let (file, features) = folder.read_lines(tile)?;
    if level.tiles.get(index) != Some(&file) {
        return Ok(vec![format!("survey/{tile}.lines: is not the file that survey/features.level lists")]);
    }
    let mut problems = Vec::new();
    let ((_, tin), (.., measured)) = (folder.read_tile(tile)?, folder.read_measured(tile)?);
    let told = measured.features.map(|found| product::from_features(&found).missing).unwrap_or_default();
    let untold = missing_edges(&tin.tin, &features.kept).into_iter().filter(|edge| !told.contains(edge)).count();
    if 0 < untold {
        problems.push(format!("tiles/{tile}.tin: lacks {untold} edges of roads or water that nothing tells of"));
    }
    let of_tile = area.tiling.modules(tile, area.grid).iter().filter_map(|id| modules.get(&id));
    problems.extend(uneven_lakes(area, &features, of_tile));
    Ok(problems)
}

/// Load modules with a vertex in a lake that is not on its level, and is no other feature's.
fn uneven_lakes<'a>(
    area: &GamingArea,
    features: &TileFeatures,
    modules: impl Iterator<Item = &'a LoadModule>,
) -> Vec<String> {
    let bodies = Bodies::of(features);
    if !bodies.has_lake() {
        return Vec::new();
    }
    let step = area.frame.spacing.quanta_per_post() / features.kept.steps_per_post;
    let decided: HashSet<LatticePoint> = features.kept.vertices.iter().map(|vertex| vertex.at).collect();
    let is_uneven = |module: &&LoadModule| {
        let corner = area.grid.posts_of(module.id).south_west();
        let place = |post: i32, quanta: u16| post * features.kept.steps_per_post + i32::from(quanta) / step;
        module.vertices.iter().any(|vertex| {
            let at = LatticePoint::new(place(corner.row, vertex.y), place(corner.col, vertex.x));
            let level = bodies.lake_level(at).filter(|_| !decided.contains(&at));
            level.is_some_and(|level| level != vertex.z)
        })
    };
    modules.filter(is_uneven).map(|module| format!("load module {}: a lake in it is not level", module.id)).collect()
}

/// Whether the report says something else of features than the files.
fn differing(listed: Option<&ReportFeatures>, found: &ReportFeatures) -> Option<String> {
    let text = |features: &ReportFeatures| format!("{features:?}");
    match listed {
        None => Some("report.json: tells nothing of roads and water, and its job has some".into()),
        Some(listed) if text(listed) != text(found) => {
            Some("report.json: features are not what the files say of roads and water".into())
        }
        Some(_) => None,
    }
}
