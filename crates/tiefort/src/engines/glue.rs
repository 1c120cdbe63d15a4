//! What an engine has to run, after what, in packs that are worth a start.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use compiler::Plan;
use job::{DemSource, Job};
use terrain::TileId;

use crate::costs;
use crate::failure::Failure;

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
    /// Files that the job reads.
    pub sources: Vec<PathBuf>,
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
        let program = std::env::current_exe().map_err(|error| Failure::output(Path::new("tiefort"), &error))?;
        let sources = match &job.dem.source {
            DemSource::Files { files, .. } => {
                files.iter().map(|file| absolute(&file.path)).collect::<Result<_, _>>()?
            }
            DemSource::Sample { .. } => Vec::new(),
        };
        let costs = costs::of(job, plan, out);
        let total_s: f64 = costs.tiles.iter().map(|tile| tile.refine_s).sum();
        let by_time = (TASK_S * plan.tiles.len() as f64 / total_s.max(1e-6)).clamp(1.0, 65_536.0) as usize;
        let pack = pack.map_or(by_time, |pack| pack as usize);
        Ok(Self {
            area: job.area.name.clone(),
            program,
            job: absolute(&job.path)?,
            out: absolute(out)?,
            sources,
            tasks: tasks(plan, pack),
            tiles: (job.tiles.rows, job.tiles.columns),
            task_bytes: plan.forecast.shared_bytes + plan.forecast.worker_bytes,
        })
    }
}

/// Which task does a stage of a tile.
type Owner = BTreeMap<TileId, usize>;

fn tasks(plan: &Plan, pack: usize) -> Vec<Task> {
    let all: Vec<TileId> = plan.tiles.iter().map(|tile| tile.tile).collect();
    let mut tasks = Vec::new();
    if plan.is_surveyed {
        tasks.extend(all.chunks(pack).map(|tiles| Task { stage: "survey", tiles: tiles.to_vec(), after: Vec::new() }));
    }
    let surveys = (0..tasks.len()).collect();
    let allocate = tasks.len();
    tasks.push(Task { stage: "allocate", tiles: Vec::new(), after: surveys });

    let mut refined = Owner::new();
    for level in levels(plan) {
        for tiles in level.chunks(pack) {
            refined.extend(tiles.iter().map(|&tile| (tile, tasks.len())));
            let lower = tiles.iter().flat_map(|&tile| &planned(plan, tile).after).map(|other| refined[other]);
            let after = sorted([allocate].into_iter().chain(lower));
            tasks.push(Task { stage: "refine", tiles: tiles.to_vec(), after });
        }
    }
    let first = tasks.len();
    for tiles in all.chunks(pack) {
        let around = tiles.iter().flat_map(|&tile| around(plan, tile)).map(|other| refined[&other]);
        let after = sorted(around);
        tasks.push(Task { stage: "assemble", tiles: tiles.to_vec(), after });
    }
    let after = (first..tasks.len()).collect();
    tasks.push(Task { stage: "publish", tiles: Vec::new(), after });
    tasks
}

/// Tiles in groups: those of a group wait for earlier groups only, so any of them may share a task.
fn levels(plan: &Plan) -> Vec<Vec<TileId>> {
    let mut by_rank: Vec<&compiler::PlannedTile> = plan.tiles.iter().collect();
    by_rank.sort_by_key(|tile| tile.rank);
    let mut level_of: BTreeMap<TileId, usize> = BTreeMap::new();
    let mut levels: Vec<Vec<TileId>> = Vec::new();
    for tile in by_rank {
        let level = tile.after.iter().map(|other| level_of[other] + 1).max().unwrap_or(0);
        level_of.insert(tile.tile, level);
        levels.resize(levels.len().max(level + 1), Vec::new());
        levels[level].push(tile.tile);
    }
    levels
}

fn planned(plan: &Plan, tile: TileId) -> &compiler::PlannedTile {
    let place = plan.tiles.binary_search_by_key(&(tile.row, tile.col), |tile| (tile.tile.row, tile.tile.col));
    &plan.tiles[place.expect("a plan lists every tile, row by row")]
}

/// The tiles whose TINs the load modules of one are made from.
fn around(plan: &Plan, tile: TileId) -> Vec<TileId> {
    let is_near = |other: TileId| other.row.abs_diff(tile.row) <= 1 && other.col.abs_diff(tile.col) <= 1;
    match plan.is_clipped {
        true => plan.tiles.iter().map(|planned| planned.tile).filter(|&other| is_near(other)).collect(),
        false => vec![tile],
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    const JOB: &str = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [9000, 9000]\n\
                       spacing_m = 25\n[dem]\nsource = \"sample\"\n[tiles]\nrows = 3\ncolumns = 3\n";

    fn plan(more: &str) -> Plan {
        compiler::plan(&Job::from_text(&format!("{JOB}{more}"), Path::new("a.toml")).unwrap()).unwrap()
    }

    /// Whatever a task reads is done by tasks it waits for, directly or by others.
    #[track_caller]
    fn check(plan: &Plan, pack: usize) {
        let tasks = tasks(plan, pack);
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
                    "refine" => assert!(planned(plan, tile).after.iter().all(|&other| is_before("refine", other))),
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
        for plan in [plan(""), plan("order = \"raster\"\n"), plan(clip)] {
            for pack in [1, 2, 5, 100] {
                check(&plan, pack);
            }
        }
    }

    #[test]
    fn a_path_with_a_quote_is_one_word() {
        assert_eq!(shell_word(Path::new("a'b c")), "'a'\\''b c'");
    }
}
