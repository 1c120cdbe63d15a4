//! Roads and water: the files of the stages that decide them, what is in the load modules, what the report says.

use std::collections::{BTreeMap, BTreeSet};

use build::ground::GamingArea;
use build::product::{Opened, Told, features_file, locate_features, read_told};
use job::Job;
use serde_json::Value;
use store::{AreaLevel, Folder, Manifest, Report, ReportFeatures, SourceRecord, files};
use terrain::{ModuleId, QUANTA_PER_METRE};

use super::decided::Decided;
use super::figures::is_of_other_ground;
use super::laid::{Laid, place_text};
use super::modules::Modules;
use super::square::At;
use super::waters::Waters;
use super::ways::{Ways, WaysFound};
use build::{ALGORITHM_REVISION, CompileError, level_fingerprint};

/// Steps by which edges may lie off lines that were rounded together with others, once and once more.
const ROUNDED: f64 = 4.0;

/// What the load modules hold of roads, rivers and lakes, counted from their lines and triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NetworkFound {
    /// Metres of lines that are kept, bridges among them, tunnels not.
    pub kept_m: f64,
    /// Stretches of lines in the ground without edges and without ground of another way.
    pub pieces_missing: u64,
    /// Those of them that are longer than 30 m.
    pub gaps: u64,
    /// Places inside the area at which kept lines end although their way goes on.
    pub ends: u64,
    /// Lakes of a hectare and more, whether their outline is in the ground or not.
    pub lakes: u64,
    /// Those of them whose posts lie more than 0.5 m RMS off their level.
    pub lakes_off_level: u64,
    /// Those of these whose shore had no room: their ground was levelled, and triangles pass over it as they may.
    pub lakes_without_shore: u64,
}

/// What is found of the features of a database.
#[derive(Default)]
pub(crate) struct Found {
    /// What is wrong.
    pub problems: Vec<String>,
    /// What was not checked.
    pub unchecked: Vec<String>,
    /// What its load modules hold.
    pub network: Option<NetworkFound>,
}

/// What is found of the features of a database whose files are whole; nothing of a job without any.
///
/// # Errors
/// When a file cannot be read that was sound a moment ago.
pub(crate) fn check(
    folder: &Folder,
    manifest: &Manifest,
    job: &Job,
    area: &GamingArea,
    (modules, decks): (&Modules, &BTreeMap<ModuleId, u32>),
    report: Option<&Report>,
) -> Result<Found, CompileError> {
    let listed = report.and_then(|report| report.features.as_ref());
    if job.features.is_none() {
        let told = listed.map(|_| "report.json: tells of roads and water, and its job has none".to_owned());
        return Ok(Found { problems: told.into_iter().collect(), ..Found::default() });
    }
    let (.., level) = folder.read_level()?;
    let mut problems = Vec::new();
    let mut decided = Decided::new(area);
    let first_class = job.importance.classes.len();
    let (mut waters, mut aside) = (Waters::default(), 0.0);
    for (index, &tile) in area.tiles.iter().enumerate() {
        let (file, features) = folder.read_lines(tile)?;
        if level.tiles.get(index) != Some(&file) {
            problems.push(format!("survey/{tile}.lines: is not the file that survey/features.level lists"));
            continue;
        }
        let (.., measured) = folder.read_measured(tile)?;
        let told = measured.features.map(|found| build::product::from_features(&found).missing).unwrap_or_default();
        problems.extend(decided.add(&features));
        let laid = Laid { area, features: &features, told: &told, first_class };
        problems.extend(laid.problems(modules));
        waters.add(&laid, modules);
        aside = ROUNDED * laid.step() as f64;
    }
    let (network, faults) = network(job, area, modules, &level, (&waters, aside));
    let files_agree = problems.is_empty();
    problems.extend(faults);
    if !files_agree {
        return Ok(Found { problems, unchecked: Vec::new(), network: Some(network) });
    }
    problems.extend(decided.problems(&level, decks, listed.map(|features| &features.checks)));
    let opened = Opened::of(folder.clone(), manifest.clone())?;
    if let (Some(report), Some((_, told)), true) = (report, read_told(&opened)?, problems.is_empty()) {
        let mut others = differing(report.features.as_ref(), &told.report);
        // Like residuals these stand on ground that the files of other tiles do not know.
        others.retain(|other| !is_of_other_ground(report) || !other.starts_with("report.json: features.checks."));
        problems.extend(others);
        problems.extend(differing_remarks(folder, job, &told));
    }
    let unchecked = match made_from_profiles(folder, manifest, job, area)? {
        Ok(problem) => {
            problems.extend(problem);
            None
        }
        Err(unchecked) => Some(unchecked),
    };
    Ok(Found { problems, unchecked: unchecked.into_iter().collect(), network: Some(network) })
}

/// What the load modules hold of the network, and what is wrong with that.
fn network(
    job: &Job,
    area: &GamingArea,
    modules: &Modules,
    level: &AreaLevel,
    (waters, aside): (&Waters, f64),
) -> (NetworkFound, Vec<String>) {
    let ways = Ways::of(job, modules, aside);
    let ends = ways.ends(area);
    let [lakes, lakes_off_level, lakes_without_shore] = waters.counts(area);
    let WaysFound { kept_m, pieces_missing, gaps } = ways.found;
    let count = ends.len() as u64;
    let found = NetworkFound { kept_m, pieces_missing, gaps, ends: count, lakes, lakes_off_level, lakes_without_shore };
    let mut problems: Vec<String> = ways.problems(area);
    let quanta = |at: f64, origin: f64| ((at - origin) * f64::from(QUANTA_PER_METRE)).round() as i64;
    let frame = area.frame;
    let listed: BTreeSet<At> = level
        .ends
        .iter()
        .map(|end| (quanta(end.at_m[1], frame.origin_north_m), quanta(end.at_m[0], frame.origin_east_m)))
        .collect();
    let untold: Vec<&At> = ends.iter().filter(|at| !listed.contains(at)).collect();
    problems.extend(untold.first().map(|at| {
        format!(
            "survey/features.level: does not list {} places at which lines of load modules end although their way goes \
             on, the first {}",
            untold.len(),
            place_text(area, **at)
        )
    }));
    (found, problems)
}

/// Whether what features came to was made from the published ground along them; else why that is not known.
fn made_from_profiles(
    folder: &Folder,
    manifest: &Manifest,
    job: &Job,
    area: &GamingArea,
) -> Result<Result<Option<String>, String>, CompileError> {
    if manifest.algorithm_revision != ALGORITHM_REVISION {
        return Ok(Err("the ground along roads and water: another algorithm revision made it".into()));
    }
    let mut job = job.clone();
    if locate_features(&mut job, manifest, folder.dir()).is_err() {
        return Ok(
            Err("the ground along roads and water: the files that features.sources names cannot be read".into()),
        );
    }
    let records: &[SourceRecord] = &manifest.sources;
    let (stamp, ..) = folder.read_level()?;
    let expected = level_fingerprint(&job, area, records, folder)?;
    let is_other = expected != Some(stamp.fingerprint);
    let problem = "survey/features.level: was not made from the ground along roads and water that survey/*.profile say";
    Ok(Ok(is_other.then(|| problem.to_owned())))
}

/// Whether the report says something else of features than the files, key by key.
fn differing(listed: Option<&ReportFeatures>, found: &ReportFeatures) -> Vec<String> {
    let Some(listed) = listed else {
        return vec!["report.json: tells nothing of roads and water, and its job has some".into()];
    };
    if listed == found {
        return Vec::new();
    }
    let value = |features: &ReportFeatures| serde_json::to_value(features).unwrap_or_default();
    let mut problems = Vec::new();
    differing_keys("features", &value(listed), &value(found), &mut problems);
    problems
}

fn differing_keys(key: &str, listed: &Value, found: &Value, problems: &mut Vec<String>) {
    match (listed, found) {
        (Value::Object(listed), Value::Object(found)) => {
            for (name, found) in found {
                let nothing = Value::Null;
                differing_keys(&format!("{key}.{name}"), listed.get(name).unwrap_or(&nothing), found, problems);
            }
        }
        (Value::Array(listed), Value::Array(found)) if listed.len() == found.len() => {
            for (at, (listed, found)) in listed.iter().zip(found).enumerate() {
                differing_keys(&format!("{key}[{at}]"), listed, found, problems);
            }
        }
        (Value::Array(listed), Value::Array(found)) => {
            let [listed, found] = [listed, found].map(Vec::len);
            problems.push(format!("report.json: {key} has {listed} entries, the files say {found}"));
        }
        _ if is_same(listed, found) => {}
        _ => problems.push(format!("report.json: {key} is {listed}, the files say {found}")),
    }
}

/// Numbers may differ in their last digits, where they were written and read.
fn is_same(listed: &Value, found: &Value) -> bool {
    match (listed.as_f64(), found.as_f64()) {
        (Some(listed), Some(found)) => (found - listed).abs() <= 1e-9 * (1.0 + found.abs()),
        _ => listed == found,
    }
}

/// Whether the list of what was mended, degraded or left out is another than that of the files.
fn differing_remarks(folder: &Folder, job: &Job, told: &Told) -> Option<String> {
    let (name, text) = features_file(job, &told.remarks);
    match folder.read_text(name) {
        Ok(found) if found == text => None,
        Ok(_) => Some(format!("{}: is not what {} says of each feature", name, files::LEVEL)),
        Err(error) => Some(error.to_string()),
    }
}
