//! What an engine has to run, after what, in packs that are worth a start.
//!
//! What the tiles of a job cost is as a build of it measured, or as forecast.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use build::ground::GamingArea;
use build::{CompileError, Costs, ORDER, Plan, Stage, TileCosts, Unit, needs, units};
use job::Job;
use source_files::FileState;
use store::{Folder, Report};
use terrain::TileId;

use crate::failure::Failure;
use crate::program;

/// Seconds a task should take, so that starting it does not matter.
const TASK_S: f64 = 30.0;

/// All that an engine has to know.
pub struct Glue {
    /// Name of the area.
    pub area: String,
    /// The program.
    pub program: PathBuf,
    /// The job file.
    pub job: PathBuf,
    /// Folder of the database.
    pub out: PathBuf,
    /// Every file that the job reads, once.
    pub sources: BTreeSet<PathBuf>,
    /// Every task, each after those it waits for.
    pub tasks: Vec<Task>,
    /// Rows and columns of tiles.
    pub tiles: (u32, u32),
    /// Memory of a task, in bytes.
    pub task_bytes: u64,
}

/// One task: a stage of one tile or several.
pub struct Task {
    /// As `tiefort task` names it.
    pub stage: &'static str,
    /// Its tiles; none where the stage is of the whole area.
    pub tiles: Vec<TileId>,
    /// Tasks it waits for, by place.
    pub after: Vec<usize>,
}

impl Task {
    /// A name for files and variables.
    pub fn name(&self) -> String {
        match self.tiles.first() {
            Some(first) => format!("{}-{first}", self.stage),
            None => self.stage.to_owned(),
        }
    }

    /// What comes behind `tiefort task JOB`.
    pub fn words(&self) -> String {
        let tiles = self.tiles.iter().map(|tile| format!(" {},{}", tile.row, tile.col));
        [self.stage.to_owned()].into_iter().chain(tiles).collect()
    }
}

impl Glue {
    /// The tasks of a plan, `pack` tiles in each, or as many as take half a minute.
    ///
    /// # Errors
    /// When a path cannot be made absolute.
    pub fn new(job: &Job, plan: &Plan, out: Option<&Path>, pack: Option<u32>) -> Result<Self, Failure> {
        let default = PathBuf::from(format!("{}.tdb", job.area.name));
        let out = out.unwrap_or(&default);
        let absolute = |path: &Path| std::path::absolute(path).map_err(|error| Failure::output(path, &error));
        let program = program::path().map_err(|error| Failure::output(Path::new("tiefort"), &error))?;
        let states = build::ground::states(job).map_err(CompileError::from)?;
        let sources = states.iter().flat_map(FileState::paths).map(absolute).collect::<Result<_, _>>()?;
        let area = GamingArea::new(job).map_err(CompileError::from)?;
        let costs = costs_of(job, plan, out);
        let total_s: f64 = costs.tiles.iter().map(|tile| tile.refine_s).sum();
        let by_time = (TASK_S * plan.tiles.len() as f64 / total_s.max(1e-6)).clamp(1.0, 65_536.0) as usize;
        let pack = pack.map_or(by_time, |pack| pack as usize);
        Ok(Self {
            area: job.area.name.clone(),
            program,
            job: absolute(&job.path)?,
            out: absolute(out)?,
            sources,
            tasks: tasks(job, &area, pack),
            tiles: (job.tiles.rows, job.tiles.columns),
            task_bytes: plan.forecast.shared_bytes + plan.forecast.worker_bytes,
        })
    }
}

impl Glue {
    /// Memory to ask for a task, in MiB: what is forecast, with room.
    pub fn task_mebibytes(&self) -> u64 {
        self.task_bytes.div_ceil(1 << 20) * 5 / 4 + 64
    }
}

/// Which task does a unit of work.
type Owner = BTreeMap<Unit, usize>;

fn tasks(job: &Job, area: &GamingArea, pack: usize) -> Vec<Task> {
    let (mut tasks, mut owner) = (Vec::new(), Owner::new());
    for stage in ORDER {
        for group in groups(stage, job, area) {
            for units in group.chunks(pack) {
                let after = units.iter().flat_map(|&unit| needs(unit, job, area)).map(|need| owner[&need]);
                let after = sorted(after);
                owner.extend(units.iter().map(|&unit| (unit, tasks.len())));
                let tiles = units.iter().filter_map(|unit| unit.tile).collect();
                tasks.push(Task { stage: stage.name(), tiles, after });
            }
        }
    }
    tasks
}

/// Units of a stage in groups: those of a group wait for earlier groups only, so any of them may share a task.
fn groups(stage: Stage, job: &Job, area: &GamingArea) -> Vec<Vec<Unit>> {
    let mut level_of: BTreeMap<Unit, usize> = BTreeMap::new();
    let mut groups: Vec<Vec<Unit>> = Vec::new();
    for unit in units(stage, job, area) {
        let before = needs(unit, job, area).into_iter().filter(|need| need.stage == stage);
        let level = before.map(|need| level_of[&need] + 1).max().unwrap_or(0);
        level_of.insert(unit, level);
        groups.resize(groups.len().max(level + 1), Vec::new());
        groups[level].push(unit);
    }
    groups
}

fn sorted(places: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut places: Vec<usize> = places.collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// A word of a shell, whatever it holds.
pub fn shell_word(path: &Path) -> String {
    format!("'{}'", path.to_string_lossy().replace('\'', "'\\''"))
}

/// A path as Python and YAML write a text: JSON's texts are theirs, too.
pub fn literal(path: &Path) -> String {
    serde_json::Value::from(path.to_string_lossy().into_owned()).to_string()
}

/// Seconds of the tiles of `plan`: from the report of the database in `folder` if that was built in the same tiles,
/// otherwise as forecast. What a last build kept has no time of its own and takes what the others take on average.
pub fn costs_of(job: &Job, plan: &Plan, folder: &Path) -> Costs {
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

#[cfg(test)]
mod tests {
    use super::*;

    const JOB: &str = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [9000, 9000]\n\
                       spacing_m = 25\n[dem]\nsource = \"sample\"\n[tiles]\nrows = 3\ncolumns = 3\n";

    /// The tiles that one waits for, as its plan says.
    fn after(plan: &Plan, tile: TileId) -> &[TileId] {
        let planned = plan.tiles.iter().find(|planned| planned.tile == tile);
        &planned.unwrap().after
    }

    /// The tiles whose TINs the load modules of one are made from.
    fn around(plan: &Plan, tile: TileId) -> Vec<TileId> {
        let is_near = |other: &TileId| other.row.abs_diff(tile.row) <= 1 && other.col.abs_diff(tile.col) <= 1;
        let all = plan.tiles.iter().map(|planned| planned.tile);
        all.filter(|other| *other == tile || plan.is_clipped && is_near(other)).collect()
    }

    /// Whatever a task reads is done by tasks it waits for, directly or by others.
    #[track_caller]
    fn check(job: &Job, pack: usize) {
        let plan = &build::plan(job).unwrap();
        let tasks = tasks(job, &GamingArea::new(job).unwrap(), pack);
        let mut reached: Vec<Vec<bool>> = Vec::new();
        for (place, task) in tasks.iter().enumerate() {
            assert!(task.after.iter().all(|&other| other < place), "{} waits for a later task", task.name());
            let mut before = vec![false; tasks.len()];
            for &other in &task.after {
                before[other] = true;
                (0..place).for_each(|at| before[at] |= reached[other][at]);
            }
            let is_before = |stage: &str, tile: TileId| {
                tasks
                    .iter()
                    .zip(&before)
                    .any(|(task, &before)| before && task.stage == stage && task.tiles.contains(&tile))
            };
            for &tile in &task.tiles {
                match task.stage {
                    "refine" => assert!(after(plan, tile).iter().all(|&other| is_before("refine", other))),
                    "assemble" => assert!(around(plan, tile).iter().all(|&other| is_before("refine", other))),
                    _ => {}
                }
            }
            if task.stage == "publish" {
                assert!(plan.tiles.iter().all(|tile| is_before("assemble", tile.tile)));
                assert_eq!(before.iter().filter(|&&before| !before).count(), 1, "publish waits for everything");
            }
            reached.push(before);
        }
    }

    #[test]
    fn a_task_waits_for_all_it_reads() {
        let clip = "[load_modules]\nedges = \"clip\"\n[tin]\nmethod = \"paper\"\npoints = 500\n";
        for more in ["", "order = \"raster\"\n", clip] {
            let job = Job::from_text(&format!("{JOB}{more}"), Path::new("a.toml")).unwrap();
            [1, 2, 5, 100].into_iter().for_each(|pack| check(&job, pack));
        }
    }

    #[test]
    fn a_path_with_a_quote_is_one_word() {
        assert_eq!(shell_word(Path::new("a'b c")), "'a'\\''b c'");
    }
}
