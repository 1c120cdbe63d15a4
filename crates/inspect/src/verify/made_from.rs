//! What tiles say that they were made from, as far as it follows from the job and from other tiles.

use job::{Edges, Job};
use store::{DatabaseError, Fingerprint, Folder, Manifest, TileBudget, TileState};
use terrain::limits::Allowance;
use terrain::{ModuleRect, TileFeatures, TileId};

use super::tins::OfTins;
use build::ALGORITHM_REVISION;
use build::ground::GamingArea;
use build::tile_refinement;
use build::{LeftOut, TileObjects, modules_key};
use build::{kept_features, rules};

/// Load-module files whose fingerprint is not that of the TINs and the job, and, second, what was not checked.
pub(crate) fn problems(
    folder: &Folder,
    manifest: &Manifest,
    job: &Job,
    area: &GamingArea,
    tins: &OfTins,
    found: &[Fingerprint],
) -> (Vec<String>, Vec<String>) {
    let (mut problems, mut unchecked) = (Vec::new(), Vec::new());
    if manifest.algorithm_revision != ALGORITHM_REVISION {
        let revision = manifest.algorithm_revision;
        unchecked.push(format!(
            "fingerprints: algorithm revision {revision} made them, this program has {ALGORITHM_REVISION}"
        ));
        return (problems, unchecked);
    }
    let left_out = match job.lod.leaves_out().then(|| folder.read_level()) {
        None => None,
        Some(Ok((.., level))) => LeftOut::of(job, area, &level),
        Some(Err(error)) => {
            problems.push(error.to_string());
            return (problems, unchecked);
        }
    };
    let outlines = match job.objects.as_ref().map(|_| folder.read_outlines()).transpose() {
        Ok(read) => read.map(|(.., outlines)| outlines),
        Err(error) => {
            problems.push(error.to_string());
            return (problems, unchecked);
        }
    };
    let mut thinned = 0;
    for (&tile, found) in area.tiles.iter().zip(found) {
        let near = area.tiling.neighbours(tile);
        let is_thinned = near.iter().any(|&other| !tins.removed[area.tiling.index(other)].is_empty());
        // A tile that a removal does not reach keeps the name it had in an earlier round.
        if is_thinned && matches!(job.modules.edges, Edges::Clip(_)) {
            thinned += 1;
            continue;
        }
        let features = match tile_features(job, folder, tile) {
            Ok(features) => features,
            Err(error) => {
                problems.push(error.to_string());
                continue;
            }
        };
        let stamps = |index: usize| tins.stamps[index];
        let objects = outlines.as_ref().map(|outlines| TileObjects::of(outlines, area, tile));
        let features = (&features, left_out.as_ref());
        let key = modules_key((job, area), &stamps, &tins.removed, features, objects.as_ref());
        let expected = key.fingerprint();
        if *found != expected {
            problems.push(format!("modules/{tile}.slm: its fingerprint is not that of its TIN and its job"));
        }
    }
    problems.extend(other_rules(folder, manifest, job, area));
    if 0 < thinned {
        unchecked.push(format!("fingerprints of {thinned} files in modules/: points were taken out around them"));
    }
    (problems, unchecked)
}

/// What features put into a tile, as its file says.
fn tile_features(job: &Job, folder: &Folder, tile: TileId) -> Result<TileFeatures, DatabaseError> {
    match &job.features {
        Some(_) => Ok(folder.read_lines(tile)?.1),
        None => Ok(TileFeatures::none(tile)),
    }
}

/// Tiles whose points were selected by other rules than the job's. Frozen ones keep points that a build would choose.
fn other_rules(folder: &Folder, manifest: &Manifest, job: &Job, area: &GamingArea) -> Vec<String> {
    let mut problems = Vec::new();
    for record in manifest.tiles.iter().filter(|record| record.state != TileState::Frozen) {
        let tile = record.tile();
        // Rules are those of a tile whatever it may spend and inherit.
        let nothing = ModuleRect { south: 0, west: 0, north: 0, east: 0 };
        let allowance = Allowance {
            modules: nothing,
            module_room: Vec::new(),
            windows: nothing,
            window_size: (0, 0),
            window_room: Vec::new(),
            triangles: 0,
        };
        let budget = TileBudget { points: None, allowance: Some(allowance), rms_quanta: None };
        let Ok(features) = tile_features(job, folder, tile) else { continue };
        let refinement = tile_refinement(job, area, tile, &budget, Vec::new(), &features);
        let expected = rules(&refinement);
        if record.made_from.as_ref().is_some_and(|parts| parts.get("rules") != Some(&expected)) {
            problems.push(format!("database.json: tile {tile} was selected by other rules than those of its job"));
        }
        let expected = kept_features(&refinement);
        if record.made_from.as_ref().is_some_and(|parts| parts.get("features") != expected.as_ref()) {
            problems.push(format!("tiles/{tile}.tin: was made with other roads or water than survey/{tile}.lines has"));
        }
    }
    problems
}
