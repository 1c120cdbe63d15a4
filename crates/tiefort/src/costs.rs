//! What the tiles of a job cost: as a build of it measured, or as forecast.

use std::collections::BTreeMap;
use std::path::Path;

use build::{Costs, Plan, TileCosts};
use job::Job;
use store::{Folder, Report};

/// Seconds of the tiles of `plan`: from the report of the database in `folder` if that was built in the same tiles,
/// otherwise as forecast. What a last build kept has no time of its own and takes what the others take on average.
pub fn of(job: &Job, plan: &Plan, folder: &Path) -> Costs {
    let folder = Folder::new(folder);
    let fits = folder.manifest().is_ok_and(|manifest| {
        let area = &manifest.area;
        area.name == job.area.name && (area.tile_rows, area.tile_cols) == (job.tiles.rows, job.tiles.columns)
    });
    let measured = folder.report().ok().filter(|_| fits).and_then(|report| measured(plan, &report));
    measured.unwrap_or_else(|| Costs::forecast(plan))
}

fn measured(plan: &Plan, report: &Report) -> Option<Costs> {
    let known: BTreeMap<[u32; 2], &BTreeMap<String, f64>> =
        report.tiles.iter().map(|tile| (tile.tile, &tile.seconds)).collect();
    let of_stage = |stage: &str| -> Vec<Option<f64>> {
        let seconds =
            |tile: &build::ground::PlannedTile| known.get(&[tile.tile.row, tile.tile.col])?.get(stage).copied();
        plan.tiles.iter().map(seconds).collect()
    };
    let refine = filled(&of_stage("refine"))?;
    let nothing = vec![0.0; plan.tiles.len()];
    let survey = filled(&of_stage("survey")).unwrap_or_else(|| nothing.clone());
    let assemble = filled(&of_stage("assemble")).unwrap_or(nothing);
    let cost = |at: usize| TileCosts { survey_s: survey[at], refine_s: refine[at], assemble_s: assemble[at] };
    let forecast = Costs::forecast(plan);
    Some(Costs { tiles: (0..plan.tiles.len()).map(cost).collect(), ..forecast })
}

/// Every number, with the mean where there is none; nothing where there are none at all.
fn filled(seconds: &[Option<f64>]) -> Option<Vec<f64>> {
    let known: Vec<f64> = seconds.iter().copied().flatten().collect();
    if known.is_empty() {
        return None;
    }
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    Some(seconds.iter().map(|seconds| seconds.unwrap_or(mean)).collect())
}
