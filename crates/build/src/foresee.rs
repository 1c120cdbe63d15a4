//! What a build would refuse, told before any height is decoded; and what roads, rivers and lakes will cost, counted
//! from the features alone.
//!
//! Before any height is read the ground is taken as level and nothing is degraded: strips that pay on slopes only are
//! lines then, and fewer stations are needed; on the other hand nothing is narrowed or left out for a limit.

use std::path::Path;

use features::{Shares, Sounded};
use fidelity::FeatureFigures;
use job::Job;
use store::{AreaLevel, Database, ReportFeatures};
use terrain::{ModuleId, in_turn};

use crate::CompileError;
use crate::ground::{FeatureTable, GamingArea};
use crate::pieces::cost_of;
use crate::publish::database_area;
use crate::read_features::ReadFeatures;

/// Opens what a job names and judges what headers tell, in the order of a build, and last the place of the database.
/// What a person should know, in words.
///
/// # Errors
/// What a build would say, where no height has to be decoded to know it.
pub fn foresee(job: &Job, folder: &Path) -> Result<Vec<String>, CompileError> {
    let told = crate::ground::foresee(job, &GamingArea::new(job)?)?;
    Database::foresee(folder, &database_area(job))?;
    Ok(told)
}

/// Load modules that are named as the most crowded.
const NAMED: usize = 3;

/// The features of a job before it is built.
#[derive(Clone, Debug, PartialEq)]
pub struct FeaturesForeseen {
    /// What they are.
    pub table: FeatureTable,
    /// What they cost by class, on level ground; lengths and checks are not known yet.
    pub cost: ReportFeatures,
    /// The load modules in which they cost most, and how many triangles.
    pub crowded: Vec<(ModuleId, u32)>,
    /// Load modules in which they ask for more than their share, and are degraded.
    pub over_share: usize,
    /// Triangles that are left of all where no load module gives more than that share.
    pub within_share: u64,
    /// Buildings that stand in the area, where the job wants them and has a file that may hold some.
    pub buildings: Option<usize>,
}

/// Foresees the features of a job that has some.
///
/// # Errors
/// When a file of them cannot be read at all.
pub fn foresee_features(job: &Job) -> Result<Option<FeaturesForeseen>, CompileError> {
    let (Some(spec), area) = (&job.features, GamingArea::new(job)?) else { return Ok(None) };
    let Some(read) = ReadFeatures::open(job, &area, &in_turn)? else { return Ok(None) };
    let ReadFeatures { table, features, vectors, .. } = read;
    let buildings = spec.has_buildings().then_some(vectors.buildings.len());
    let level_ground = vec![Some(0); features.stations().len()];
    // No limit, so that nothing is degraded.
    let inside = vec![Vec::new(); features.outlines().len()];
    let sounded = Sounded { heights: &level_ground, middles: &level_ground, inside: &inside };
    let levelled = features.level(sounded, (spec.options, spec.falls), &Shares::all(), &in_turn);
    let level = AreaLevel { cost: cost_of(job, area.grid, &levelled.reserved.cost), ..AreaLevel::default() };
    let mut modules = vec![0; area.grid.count()];
    level.cost.iter().for_each(|&(place, _, triangles)| modules[place as usize] += triangles);
    let share = spec.share_max * f64::from(area.budget.per_module);
    let left = |triangles: &u32| f64::from(*triangles).min(share) as u64;
    let within_share = modules.iter().map(left).sum();
    let over_share = modules.iter().filter(|&&triangles| share < f64::from(triangles)).count();
    let mut crowded: Vec<(ModuleId, u32)> = area.grid.all().iter().zip(modules).collect();
    crowded.retain(|(_, triangles)| 0 < *triangles);
    crowded.sort_by_key(|&(ModuleId { row, col }, triangles)| (std::cmp::Reverse(triangles), row, col));
    crowded.truncate(NAMED);
    let cost = crate::product::told(job, &area, &level, &FeatureFigures::default()).report;
    Ok(Some(FeaturesForeseen { table, cost, crowded, over_share, within_share, buildings }))
}
